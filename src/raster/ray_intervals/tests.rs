//! Intervals of slices against the edge functions of every slice, over random scenes and those made of ties.

use super::*;
use crate::fragment::Batch;
use crate::scene::{Camera, ClipPlane, Placement, Projection};
use crate::volume::{BoxConvention, Grid};
use glam::{DMat3, DQuat, DVec3};

struct Numbers(u64);

impl Numbers {
    fn bits(&mut self) -> u64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        self.0
    }
    fn below(&mut self, n: u64) -> u64 {
        (self.bits() >> 20) % n
    }
    fn between(&mut self, lo: f64, hi: f64) -> f64 {
        lo + (hi - lo) * (self.bits() >> 11) as f64 / (1u64 << 53) as f64
    }
    fn direction(&mut self) -> DVec3 {
        loop {
            let v = DVec3::new(self.between(-1.0, 1.0), self.between(-1.0, 1.0), self.between(-1.0, 1.0));
            if v.length() > 0.2 {
                return v.normalize();
            }
        }
    }
}

/// A stack anywhere: outside, inside, grazing, in both projections, with up to three clip planes.
fn anywhere(n: &mut Numbers) -> (Stack, Grid, Vec<ClipPlane>) {
    let dims = [1 + n.below(30) as usize, 1 + n.below(30) as usize, 1 + n.below(30) as usize];
    let spacing = DVec3::new(n.between(0.1, 3.0), -n.between(0.1, 3.0), n.between(0.1, 3.0));
    let turn = if n.below(2) == 0 { DMat3::IDENTITY } else { DMat3::from_quat(DQuat::from_axis_angle(n.direction(), n.between(0.0, 6.0))) };
    let grid = Grid::new(dims, n.direction() * 20.0, turn * DMat3::from_diagonal(spacing)).expect("grid");
    let (center, radius) = (grid.center(), grid.radius());
    let towards = match n.below(3) {
        // Along an axis of the box, or as good as.
        0 => turn * [DVec3::X, DVec3::NEG_Y, DVec3::Z, DVec3::new(1.0, f64::EPSILON, 0.0), DVec3::new(1.0, 1.0, 0.0)][n.below(5) as usize],
        _ => n.direction(),
    };
    let projection = if n.below(2) == 0 {
        Projection::Perspective { fov_y: n.between(20.0, 110.0) }
    } else {
        Projection::Orthographic { height: Some(radius * n.between(0.5, 4.0)) }
    };
    let up = if towards.normalize().z.abs() < 0.9 { DVec3::Z } else { DVec3::Y };
    let eye = center + towards * radius * n.between(0.05, 3.0);
    let camera = Camera::new(Placement::LookAt { eye, target: center, up }, projection).expect("camera");
    let camera = if n.below(3) == 0 { camera.with_near(radius * n.between(0.01, 1.5)).expect("near") } else { camera };
    let view = camera.resolve(&grid, 1 + n.below(40) as u32, 1 + n.below(40) as u32).expect("view");
    let planes: Vec<ClipPlane> = (0..n.below(4))
        .map(|_| {
            let normal = n.direction();
            ClipPlane::new(normal, normal.dot(center) + radius * n.between(-0.7, 0.7)).expect("plane")
        })
        .collect();
    (Stack::new(&grid, &view, &planes, 1 + n.below(40)), grid, planes)
}

/// A stack whose box has its edges on pixel centres, seen along an axis or a diagonal: ties everywhere.
fn tied(n: &mut Numbers) -> (Stack, Grid, Vec<ClipPlane>) {
    let dims = [2 * (1 + n.below(5)) as usize, 2 * (1 + n.below(5)) as usize, 2 * (1 + n.below(5)) as usize];
    let grid = Grid::with_spacing(dims, [1.0; 3]).expect("grid");
    let grid = if n.below(2) == 0 { grid } else { grid.with_convention(BoxConvention::Nodes) };
    let center = grid.center();
    let (towards, up) = [
        (DVec3::X, DVec3::Z),
        (DVec3::Y, DVec3::X),
        (DVec3::NEG_Z, DVec3::Y),
        (DVec3::new(1.0, 1.0, 0.0), DVec3::Z),
        (DVec3::new(f64::EPSILON, 0.0, -1.0), DVec3::X),
        (DVec3::ONE, DVec3::Z),
    ][n.below(6) as usize];
    // Odd sizes have a pixel centre in the middle, and a pixel is a half or a quarter of a unit.
    let side = 33;
    let pixel = [0.5, 0.25][n.below(2) as usize];
    let projection = Projection::Orthographic { height: Some(f64::from(side) * pixel) };
    let camera = Camera::new(Placement::LookAt { eye: center + towards * 16.0, target: center, up }, projection).expect("camera");
    let view = camera.resolve(&grid, side, side).expect("view");
    let planes = if n.below(3) == 0 {
        vec![ClipPlane::new(up, up.dot(center)).expect("plane"), ClipPlane::new(towards, towards.normalize().dot(center)).expect("plane")]
    } else {
        Vec::new()
    };
    (Stack::new(&grid, &view, &planes, 1 + n.below(12)), grid, planes)
}

/// Depths at which the ray through window position (x,y) enters and leaves box, planes and stack.
fn path(stack: &Stack, grid: &Grid, planes: &[ClipPlane], x: f64, y: f64) -> (f64, f64) {
    let (origin, direction) = stack.view.ray(x, y);
    let (at, step) = (grid.world_to_index().transform_point3(origin), grid.world_to_index().transform_vector3(direction));
    let (lo, hi) = grid.index_bounds();
    let (mut entry, mut exit) = (stack.near, stack.far);
    let mut keep = |height: f64, rate: f64| {
        if rate > 0.0 {
            entry = entry.max(-height / rate);
        } else if rate < 0.0 {
            exit = exit.min(-height / rate);
        } else if height < 0.0 {
            exit = f64::NEG_INFINITY;
        }
    };
    for axis in 0..3 {
        keep(at[axis] - lo[axis], step[axis]);
        keep(hi[axis] - at[axis], -step[axis]);
    }
    planes.iter().for_each(|p| keep(p.distance(origin), p.normal().dot(direction)));
    (entry, exit)
}

/// Blocks, covered pixels, whole slices of blocks, pixels in doubt.
#[derive(Debug, Default)]
struct Seen {
    pixels: u64,
    covered: u64,
    whole: u64,
    doubt: u64,
    corners: u64,
    /// Blocks whose rays' ends need not be known.
    unsettled: u64,
}

fn check((stack, grid, planes): &(Stack, Grid, Vec<ClipPlane>), level: Level, seen: &mut Seen) {
    if stack.is_empty() {
        return;
    }
    let intervals = RayIntervals::new(stack, false, EndPieces::Partial, level);
    let (width, height) = (stack.view.width, stack.view.height);
    let mut batch = Batch::new(true, true);
    for y0 in (0..height).step_by(SIDE) {
        for x0 in (0..width).step_by(SIDE) {
            let place = |i: usize| (x0 + (i % SIDE) as u32, y0 + (i / SIDE) as u32);
            let inside = |i: usize| place(i).0 < width && place(i).1 < height;
            let lanes = (0..BATCH).fold(0, |bits, i| bits | u64::from(inside(i)) << i);
            let told = intervals.range(x0, y0, lanes, &mut batch.pixels);
            let range = intervals.block(x0, y0, lanes, &mut batch.pixels);
            intervals.plane(x0, y0, &mut batch.pixels);
            let lasts = if told.settled { 0 } else { batch.pixels.last.iter().map(|&last| i64::from(last)).sum() };
            assert_eq!(told, BlockRange { lasts, settled: told.settled, ..range });
            seen.unsettled += u64::from(!told.settled);
            // Of a block that no slice covers nothing else is told.
            let missed = range.any.0 > range.any.1;
            let (mut any, mut fragments) = ((i64::MAX, i64::MIN), 0);
            for i in 0..BATCH {
                let pixels = &batch.pixels;
                let (first, last) = if missed { (1, 0) } else { (i64::from(pixels.first[i]), i64::from(pixels.last[i])) };
                let doubt = pixels.doubt >> i & 1 == 1;
                let (x, y) = (f64::from(place(i).0) + 0.5, f64::from(place(i).1) + 0.5);
                let count = if inside(i) { (0..stack.count).filter(|&k| stack.covers(k, x, y)).count() as i64 } else { 0 };
                // A ray that meets no slice on its way through the box has one piece all the same.
                let corner = count == 0 && first == last && !doubt;
                if corner {
                    let (entry, exit) = path(stack, grid, planes, x, y);
                    let want = (exit - entry) / stack.spacing;
                    let sum = f64::from(pixels.first_length[i]);
                    assert!(want > 0.0 && (sum - want).abs() < 1e-6 && sum <= 1.0 + 1e-6, "({x},{y}): {sum} slabs, not {want}");
                    seen.corners += 1;
                }
                for k in 0..stack.count as i64 {
                    let covered = inside(i) && stack.covers(k as u64, x, y);
                    let ranged = (first..=last).contains(&k);
                    // The edge functions decide inside the range of a pixel in doubt; beyond it they must not cover.
                    assert!(
                        ranged == covered || (ranged && (doubt || corner)),
                        "slice {k} of pixel ({x},{y}): {first}..={last}, doubt {doubt}"
                    );
                    assert!(covered || !(range.whole.0..=range.whole.1).contains(&k), "slice {k} is not whole at pixel ({x},{y})");
                }
                fragments += count as u64;
                if first <= last {
                    any = (any.0.min(first), any.1.max(last));
                    assert!(range.whole.0 > first && range.whole.1 < last || range.whole.0 > range.whole.1);
                }
                seen.pixels += 1;
                seen.covered += u64::from(count > 0);
                seen.doubt += u64::from(doubt);
                if count > 0 && count == last - first + 1 {
                    let (a, b) = (f64::from(pixels.first_length[i]), f64::from(pixels.last_length[i]));
                    let sum = if first == last { a } else { a + b + (last - first - 1) as f64 };
                    let (entry, exit) = path(stack, grid, planes, x, y);
                    let want = (exit - entry) / stack.spacing;
                    // A ray in doubt runs along a side: which of its depths are inside is a matter of the last bit.
                    let close = doubt || (sum - want).abs() < 1e-6 * (1.0 + want);
                    assert!(a >= 0.0 && b >= 0.0 && close, "({x},{y}): {sum} slabs, not {want}");
                    let (_, direction) = stack.view.ray(x, y);
                    assert!((f64::from(pixels.slant[i]) - direction.length()).abs() < 1e-6 * direction.length());
                }
            }
            assert!(range.any == any || (missed && any.0 > any.1), "{:?} not {any:?}", range.any);
            assert_eq!(range.fragments, fragments);
            seen.whole += (range.whole.1 - range.whole.0 + 1).max(0) as u64;
        }
    }
}

#[test]
fn intervals_are_the_slices_that_edge_functions_cover() {
    let (mut n, mut seen) = (Numbers(3), Seen::default());
    for round in 0..700 {
        check(&anywhere(&mut n), Level::available()[round % Level::available().len()], &mut seen);
    }
    assert!(
        seen.covered > 40_000 && seen.whole > 1000 && seen.doubt == 0 && seen.corners > 100 && seen.unsettled > 100,
        "{seen:?} is no test"
    );
}

#[test]
fn intervals_hold_where_edges_meet_pixel_centres() {
    let (mut n, mut seen) = (Numbers(4), Seen::default());
    for round in 0..300 {
        check(&tied(&mut n), Level::available()[round % Level::available().len()], &mut seen);
    }
    assert!(seen.covered > 20_000 && seen.doubt > 100, "{seen:?} is no test");
}
