//! Twins of lookups of voxels that are colours.

use super::fetch::{Cells, place, trilinear, weight};
use super::*;
use crate::volume::{Colors, OpacityFrom};

/// Opacity over the number that it goes by: a curve that is linear between the entries of every table.
fn opacity(number: f64) -> f64 {
    0.9 * number
}

/// What a number of a colour stands for.
fn unit(number: f64) -> f64 {
    0.25 + 0.5 * number
}

fn table(entries: usize, of: impl Fn(f64) -> f64) -> Vec<f64> {
    (0..=entries).map(|i| of(i.min(entries - 1) as f64 / (entries - 1) as f64)).collect()
}

/// The slab of a voxel: premultiplied colour and opacity.
fn slab(color: [f64; 4], from: OpacityFrom) -> [f64; 4] {
    let counts = if from == OpacityFrom::Alpha { 4 } else { 3 };
    if color[..counts].iter().any(|x| !x.is_finite()) {
        return [0.0; 4];
    }
    let [r, g, b, a] = color.map(|x| x.clamp(0.0, 1.0));
    let alpha = opacity(match from {
        OpacityFrom::Alpha => a,
        OpacityFrom::Luma => 0.2126 * r + 0.7152 * g + 0.0722 * b,
        OpacityFrom::Maximum => r.max(g).max(b),
    });
    [unit(r) * alpha, unit(g) * alpha, unit(b) * alpha, alpha]
}

/// Fragments have the interpolated slabs of the voxels around them, or that of the nearest; rows are left out where none shows, and those alone.
fn hold<const NEAREST: bool>(n: &mut Numbers, voxels: Colors<'_>, dims: [usize; 3], cells: &Cells, (before, far): (&Batch, bool)) {
    let none = Voxels::zeros(VoxelType::U8, 1);
    let from = OpacityFrom::ALL[n.bits() as usize % 3];
    let bytes = matches!(voxels, Colors::U8(_));
    let alphas = table(if bytes && from != OpacityFrom::Luma { 256 } else { FINE }, opacity);
    let units = table(if bytes { 256 } else { FINE }, unit);
    let mut frame = frame(&none, n);
    (frame.sample.strides, frame.sample.far) = (before.geometry.cells.strides, far);
    let least = if n.bits() % 2 == 0 { 0.0 } else { f32::from_bits(1) };
    frame.colors = Some(Box::new(ColorSource { voxels, from, alphas: Arc::new(alphas), units: Some(&units), least }));
    let mut first: Option<Box<Batch>> = None;
    run::<ClassifyColors<NEAREST>>(&frame, before, &[Part::Color, Part::Alpha, Part::Shown], |after, level| {
        assert_eq!(after.shown & !before.rows, 0, "rows that are not listed, at {level}");
        for i in (0..BATCH).filter(|&i| listed(before.rows, i)) {
            let corners: [[f64; 4]; 8] = std::array::from_fn(|c| {
                let [x, y, z] = [0, 1, 2].map(|a: usize| (cells[i][a] + (c >> a & 1)).min(dims[a] - 1));
                slab(voxels.get((z * dims[1] + y) * dims[0] + x), from)
            });
            let weight = weight(before, i).map(|w| if NEAREST { f64::from(u8::from(w >= 0.5)) } else { w });
            for c in 0..4 {
                let got = if c == 3 { after.slab.alpha[i] } else { after.slab.color[c][i] };
                assert_near(got, trilinear(corners.map(|corner| corner[c]), weight), 12.0 * ROUNDING, level, i);
            }
            let hidden = !listed(after.shown, i);
            assert!(!hidden || least > 0.0 && after.slab.alpha[i] == 0.0, "fragment {i} left out at {level}");
        }
        let bits = |b: &Batch| [Part::Color, Part::Alpha, Part::Shown].map(|part| part.bits(b));
        assert!(first.as_ref().is_none_or(|first| bits(first) == bits(after)), "other bits at {level}");
        first.get_or_insert_with(|| Box::new(after.clone()));
    });
}

/// Many batches in colours of every type.
#[test]
pub(super) fn slabs() {
    let mut n = Numbers::new(71);
    for round in 0..240 {
        let dims = [DIMS, [9, 1, 7], [6, 5, 1], [1, 1, 1]][round % 4];
        let count = dims.iter().product();
        let bytes: Vec<[u8; 4]> = (0..count).map(|_| if n.bits() % 3 == 0 { [0; 4] } else { [0; 4].map(|_| n.bits() as u8) }).collect();
        let words: Vec<[u16; 4]> = bytes.iter().map(|c| c.map(|x| u16::from(x) * 257)).collect();
        let odd = |n: &mut Numbers| match n.bits() % 40 {
            0 => f32::NAN,
            1 => f32::INFINITY,
            2 => -0.5,
            3 => 1.75,
            _ => n.unit32(),
        };
        let floats: Vec<[f32; 4]> = (0..count).map(|_| [0; 4].map(|_| odd(&mut n))).collect();
        let voxels = [Colors::U8(&bytes), Colors::U16(&words), Colors::F32(&floats)][round / 4 % 3];
        let mut before = batch(&mut n);
        let cells = place(&mut n, &mut before, dims, strides(dims));
        let far = round % 5 == 0;
        hold::<false>(&mut n, voxels, dims, &cells, (&before, far));
        hold::<true>(&mut n, voxels, dims, &cells, (&before, far));
    }
}
