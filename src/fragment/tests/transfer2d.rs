//! Twins of classification by value and gradient.

use super::*;
use crate::fragment::gradient::GradientFrame;
use crate::fragment::transfer2d::{Classify2d, Numbers as Scaled, Transfer2dFrame};
use crate::scene::{Gradient, Region, Shape, Transfer2d};
use crate::volume::Grid;

/// Extinction times reference length: extinctions of regions add up, and the largest opacity below 1 stands for 1.
fn extinction(transfer: &Transfer2d, value: f64, gradient: f64) -> f64 {
    let of = |opacity: f64| -libm::log1p(-opacity.min(1.0 - f64::EPSILON / 2.0));
    match transfer.entries() {
        Some(_) => of(transfer.eval(value, gradient).alpha),
        None => transfer.region_list().iter().map(|r| of(r.opacity * r.shape.at(value, gradient))).sum(),
    }
}

/// A batch whose values and gradients are spread over those of `transfer`, through the kernel at every level.
fn check(transfer: &Transfer2d, n: &mut Numbers) {
    let voxels = voxels(VoxelType::F32, DIMS, n);
    let mut frame = frame(&voxels, n);
    let grid = Grid::with_spacing(DIMS, [0.5, 1.0, 3.0]).expect("a grid");
    let (scale, offset, ratio) = (n.between(0.1, 4.0), n.between(-50.0, 50.0), n.between(0.05, 2.0));
    let gradient = GradientFrame::new(Gradient::Central, &grid, scale);
    frame.optional.transfer2d = Some(Transfer2dFrame::new(transfer, &gradient, Scaled { scale, offset }, ratio));
    let mut before = batch(n);
    for i in 0..BATCH {
        before.sample.value[i] = ((n.between(-20.0, 120.0) - offset) / scale) as f32;
        before.gradient_mut().size[i] = if n.bits() % 8 == 0 { 0.0 } else { (n.between(0.0, 12.0) / gradient.unit) as f32 };
        before.slab.length[i] = if n.bits() % 3 == 0 { n.between(1e-3, 0.05) } else { n.between(0.1, 1.5) } as f32;
    }
    (before.shown, before.gradient_mut().lanes) = (u8::MAX, spread(some_rows(n)));
    run::<Classify2d>(&frame, &before, &[Part::Shown, Part::Color, Part::Alpha], |after, level| {
        assert_eq!(after.shown, rows_of(before.gradient().lanes), "{level}");
        for i in (0..BATCH).filter(|&i| listed(after.shown, i)) {
            let value = scale * f64::from(before.sample.value[i]) + offset;
            let size = f64::from(before.gradient().size[i]) * gradient.unit;
            let length = ratio * f64::from(before.slab.length[i]);
            let opacity_at = |v: f64, g: f64| -libm::expm1(-length * extinction(transfer, v, g));
            let straight = transfer.eval(value, size);
            let alpha = opacity_at(value, size);
            // What a rounding of value and gradient may change: much beside a side, which a jump is skipped for.
            let (dv, dg) = (2e-5, 2e-6 * size.max(1.0));
            let around = [(dv, 0.0), (-dv, 0.0), (0.0, dg), (0.0, -dg)].map(|(a, b)| opacity_at(value + a, size + b));
            let near = around.iter().fold(0.0, |most: f64, a| most.max((a - alpha).abs()));
            if near > 1e-3 {
                continue;
            }
            let bound = 2.0 * near + 40.0 * ROUNDING;
            assert_near(after.slab.alpha[i], alpha, bound, level, i);
            for c in 0..3 {
                assert_near(after.slab.color[c][i], straight.rgb[c] * alpha, bound + 4e-5 * alpha, level, i);
            }
        }
    });
}

#[test]
pub(super) fn regions() {
    let mut n = Numbers::new(98);
    for _ in 0..60 {
        let shapes = [
            Shape::Box { value: [n.between(0.0, 40.0), n.between(40.0, 100.0)], gradient: [n.between(0.0, 3.0), n.between(3.0, 9.0)] },
            Shape::Triangle { value: n.between(20.0, 80.0), width: n.between(1.0, 60.0), gradient: n.between(1.0, 10.0) },
            Shape::Gaussian {
                value: n.between(0.0, 100.0),
                width: n.between(1.0, 30.0),
                gradient: n.between(0.0, 8.0),
                height: n.between(0.5, 5.0),
            },
            Shape::Levoy { value: n.between(20.0, 80.0), thickness: n.between(0.5, 9.0) },
        ];
        let count = 1 + n.bits() as usize % 4;
        let regions = (0..count).map(|i| Region {
            shape: shapes[(i + n.bits() as usize) % 4],
            color: [n.unit(), n.unit(), n.unit()],
            opacity: [0.0, 1.0 - 1e-9, 1.0, n.between(0.01, 0.95), n.between(0.01, 0.95), n.between(0.9, 1.0)][n.bits() as usize % 6],
        });
        let transfer = Transfer2d::regions(regions.collect()).expect("regions");
        check(&transfer, &mut n);
    }
}

#[test]
pub(super) fn tables() {
    let mut n = Numbers::new(99);
    for (columns, rows) in [(2, 2), (7, 3), (64, 33)] {
        let colors: Vec<[f32; 4]> =
            (0..columns * rows).map(|_| [n.unit() as f32, n.unit() as f32, n.unit() as f32, 0.9 * n.unit() as f32]).collect();
        check(&Transfer2d::table((columns, rows), &colors, [0.0, 100.0], [0.5, 9.0]).expect("a table"), &mut n);
    }
}
