//! What fills the picture: closed forms for blocks of voxels, and properties over random views.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test fails by panicking")]

use glam::DVec3;
use slicestack::scene::{
    Blend, Camera, ClipPlane, FocusRegion, FocusShape, Placement, Projection, Scene, SegmentEffect, SegmentStyle, TransferFunction, Visible,
};
use slicestack::volume::{Grid, Voxels};
use slicestack::{Picture, Renderer, Settings, Volume};

/// Share of the picture that is filled.
const FILLED: f64 = 0.94;

const DIMS: [usize; 3] = [64, 48, 40];

/// 64 x 48 x 40 voxels of 0, with 200 in a block of bricks.
fn block(from: [usize; 3], to: [usize; 3]) -> Volume {
    let (dims, inside) = (DIMS, |n: usize, axis: usize| (from[axis]..to[axis]).contains(&n));
    let voxels: Vec<u8> = (0..dims.iter().product())
        .map(|i| {
            let at = [i % dims[0], i / dims[0] % dims[1], i / dims[0] / dims[1]];
            if (0..3).all(|axis| inside(at[axis], axis)) { 200 } else { 0 }
        })
        .collect();
    Volume::new(Grid::with_spacing(dims, [1.0, 2.0, 0.5]).unwrap(), Voxels::U8(voxels.into())).unwrap()
}

fn scene(azimuth: f64, elevation: f64, projection: Projection) -> Scene {
    let transfer = TransferFunction::new(vec![(0.0, [1.0; 3])], vec![(100.0, 0.0), (150.0, 0.9)]).unwrap();
    let placement = Placement::Orbit { azimuth, elevation, roll: 0.0, zoom: 1.0 };
    Scene::new(transfer).with_camera(Camera::new(placement, projection).unwrap()).with_size(60, 40).unwrap()
}

const PARALLEL: Projection = Projection::Orthographic { height: None };

/// Bricks of four cells that touch the block's voxels, in world units: from the brick before the first voxel's to the last's.
fn bricks_around(from: [usize; 3], to: [usize; 3]) -> [DVec3; 2] {
    let spacing = DVec3::new(1.0, 2.0, 0.5);
    let low = from.map(|n| ((n as f64 - 1.0) / 4.0).floor() * 4.0);
    let high = to.map(|n| ((n as f64 - 1.0) / 4.0).floor() * 4.0 + 4.0);
    // Those at the border reach to the box's faces, half a voxel beyond the outermost voxels.
    let low = low.map(|n| if n <= 0.0 { -0.5 } else { n });
    let high = [0, 1, 2].map(|axis: usize| if high[axis] >= DIMS[axis] as f64 - 1.0 { DIMS[axis] as f64 - 0.5 } else { high[axis] });
    [DVec3::from_array(low) * spacing, DVec3::from_array(high) * spacing]
}

#[test]
fn hidden_segments_are_not_framed_and_what_shows_by_place_is() {
    // All of the block is one segment; another lies apart from it.
    let (from, to) = ([10, 9, 6], [30, 27, 30]);
    let volume = block(from, to);
    let other = ([41, 33, 9], [55, 43, 19]);
    let labels: Vec<u8> = (0..DIMS.iter().product())
        .map(|i: usize| {
            let at = [i % DIMS[0], i / DIMS[0] % DIMS[1], i / DIMS[0] / DIMS[1]];
            let within = |from: [usize; 3], to: [usize; 3]| (0..3).all(|a| (from[a]..to[a]).contains(&at[a]));
            if within([0; 3], [40, 32, 40]) { 1 } else { 2 * u8::from(within(other.0, other.1)) }
        })
        .collect();
    let volume = volume.clone().with_labels(&Volume::new(volume.grid().clone(), labels.into()).unwrap()).unwrap();
    let style = |label, effect| SegmentStyle::new(label, effect).unwrap();
    let hidden = scene(0.0, 0.0, PARALLEL).with_segments(vec![style(1, SegmentEffect::Hide)]).unwrap();
    assert!(Visible::of(&hidden, &volume).is_none());
    let replaced = vec![style(1, SegmentEffect::Hide), style(2, SegmentEffect::Replace { color: [1.0; 3], opacity: 0.5 })];
    let replaced = hidden.with_segments(replaced).unwrap();
    let [low, high] = bricks_around(other.0, other.1);
    let visible = Visible::of(&replaced, &volume).unwrap();
    for (axis, n) in [DVec3::X, DVec3::Y, DVec3::Z].into_iter().enumerate() {
        let [a, b] = visible.extent(n);
        assert!((a - low[axis]).abs() < 1e-9 && (b - high[axis]).abs() < 1e-9, "axis {axis}: {a} to {b}");
    }
    // A region that holds the block and shows nothing, and one beside it that shows everything.
    let even = |a: f64| TransferFunction::new(vec![(0.0, [1.0; 3])], vec![(0.0, a)]).unwrap();
    let ball = |at: DVec3, r: f64, a: f64| FocusRegion::new(FocusShape::Sphere { radius: r }, at, even(a)).unwrap();
    let with = |region: FocusRegion| scene(0.0, 0.0, PARALLEL).with_regions(vec![region]).unwrap();
    assert!(Visible::of(&with(ball(DVec3::new(20.0, 36.0, 9.0), 60.0, 0.0)), &volume).is_none());
    let visible = Visible::of(&with(ball(DVec3::new(50.0, 36.0, 9.0), 8.0, 0.5)), &volume).unwrap();
    assert!(visible.extent(DVec3::X)[1] >= 58.0);
}

#[test]
fn a_parallel_view_along_an_axis_fits_the_blocks_extent() {
    let (from, to) = ([10, 9, 6], [30, 27, 30]);
    let volume = block(from, to);
    let [low, high] = bricks_around(from, to);
    let visible = Visible::of(&scene(0.0, 0.0, PARALLEL), &volume).unwrap();
    for (axis, n) in [DVec3::X, DVec3::Y, DVec3::Z].into_iter().enumerate() {
        let [a, b] = visible.extent(n);
        assert!(
            (a - low[axis]).abs() < 1e-9 && (b - high[axis]).abs() < 1e-9,
            "axis {axis}: {a} to {b}, not {} to {}",
            low[axis],
            high[axis]
        );
    }
    let framed = scene(0.0, 0.0, PARALLEL).framed(&volume, 1.0);
    let view = framed.camera().resolve(volume.grid(), 60, 40).unwrap();
    let wide = (view.right.abs().dot(high - low), view.up.abs().dot(high - low));
    let height = f64::max(wide.1, wide.0 / 1.5) / FILLED;
    assert!((view.scale * 40.0 - height).abs() < 1e-9 * height, "{} not {height}", view.scale * 40.0);
    let (x, y) = view.window(0.5 * (low + high));
    assert!((x - 30.0).abs() < 1e-6 && (y - 20.0).abs() < 1e-6, "the middle is at {x}, {y}");
    // Twice as large; and at a height of one's own.
    let twice = scene(0.0, 0.0, PARALLEL).framed(&volume, 2.0).camera().resolve(volume.grid(), 60, 40).unwrap();
    assert!((twice.scale * 2.0 - view.scale).abs() < 1e-12);
    let own = scene(0.0, 0.0, Projection::Orthographic { height: Some(7.0) }).framed(&volume, 1.0);
    assert!((own.camera().resolve(volume.grid(), 60, 40).unwrap().scale * 40.0 - 7.0).abs() < 1e-12);
}

/// In every view all of the bricks lies within the filled share, and something reaches its edge on two opposite sides.
#[test]
fn every_view_shows_all_and_wastes_nothing() {
    let (from, to) = ([3, 20, 11], [41, 33, 40]);
    let volume = block(from, to);
    let [low, high] = bricks_around(from, to);
    for step in 0..60 {
        let (azimuth, elevation) = (f64::from(step) * 37.0, f64::from(step % 13) * 13.0 - 80.0);
        for projection in [PARALLEL, Projection::Perspective { fov_y: [12.0, 45.0, 100.0][step as usize % 3] }] {
            let framed = scene(azimuth, elevation, projection).framed(&volume, 1.0);
            let before = scene(azimuth, elevation, projection).camera().resolve(volume.grid(), 60, 40).unwrap();
            let view = framed.camera().resolve(volume.grid(), 60, 40).unwrap();
            assert!((view.forward - before.forward).length() < 1e-9, "the direction is kept");
            let (mut x, mut y) = ([f64::INFINITY, f64::NEG_INFINITY], [f64::INFINITY, f64::NEG_INFINITY]);
            for corner in 0..8 {
                let p = DVec3::from_array([0, 1, 2].map(|axis: usize| if corner >> axis & 1 == 0 { low[axis] } else { high[axis] }));
                assert!(view.depth(p) > 0.0, "a corner behind the eye");
                let (u, v) = view.window(p);
                (x, y) = ([x[0].min(u / 30.0 - 1.0), x[1].max(u / 30.0 - 1.0)], [y[0].min(v / 20.0 - 1.0), y[1].max(v / 20.0 - 1.0)]);
            }
            let most = [-x[0], x[1], -y[0], y[1]].into_iter().fold(0.0, f64::max);
            assert!(most <= FILLED + 1e-6, "{most} at {azimuth}, {elevation}, {projection:?}");
            let touches = |[a, b]: [f64; 2]| (a + FILLED).abs() < 1e-6 && (b - FILLED).abs() < 1e-6;
            // A wide angle may have to keep the eye out of what it shows.
            let wide = matches!(projection, Projection::Perspective { fov_y } if fov_y > 90.0);
            assert!(touches(x) || touches(y) || wide, "{x:?} {y:?} at {azimuth}, {elevation}, {projection:?}");
        }
    }
}

#[test]
fn clip_planes_take_away_and_specks_do_not_count() {
    let volume = block([10, 9, 6], [30, 27, 30]);
    let plane = ClipPlane::new(DVec3::X, 22.0).unwrap();
    let clipped = scene(0.0, 0.0, PARALLEL).with_clip_planes(vec![plane]).unwrap();
    let [a, b] = Visible::of(&clipped, &volume).unwrap().extent(DVec3::X);
    assert_eq!([a, b], [20.0, 32.0]);
    let away = scene(0.0, 0.0, PARALLEL).with_clip_planes(vec![ClipPlane::new(DVec3::X, 60.0).unwrap()]).unwrap();
    assert!(Visible::of(&away, &volume).is_none());
    assert_eq!(away.clone().framed(&volume, 1.0), away);

    // A voxel on its own inside one brick, far from the block.
    let mut voxels = match volume.voxels() {
        Voxels::U8(v) => v.to_vec(),
        _ => unreachable!(),
    };
    voxels[(2 * 48 + 42) * 64 + 58] = 255;
    let specked = Volume::new(volume.grid().clone(), Voxels::U8(voxels.into())).unwrap();
    let seen = |v: &Volume| Visible::of(&scene(0.0, 0.0, PARALLEL), v).unwrap().extent(DVec3::X);
    assert_eq!(seen(&specked), seen(&volume));
}

#[test]
fn surfaces_and_projections_have_extents_of_their_own() {
    let volume = block([12, 12, 12], [24, 24, 24]);
    let of = |scene: Scene| Visible::of(&scene, &volume);
    let plain = scene(0.0, 0.0, PARALLEL);
    for blend in [Blend::Mip, Blend::Average, Blend::Iso { level: 100.0 }, Blend::Add] {
        let found = of(plain.clone().with_blend(blend).unwrap()).unwrap_or_else(|| panic!("{blend:?}"));
        assert!(found.extent(DVec3::X)[0] >= 8.0 && found.extent(DVec3::X)[1] <= 28.0, "{blend:?}");
    }
    assert!(of(plain.clone().with_blend(Blend::Iso { level: 300.0 }).unwrap()).is_none());
    assert!(of(plain.with_blend(Blend::Min).unwrap()).is_none());
}

/// The rendered picture itself: nothing of it at the border, much of it near the border.
#[test]
fn the_picture_is_filled() {
    let volume = block([10, 9, 6], [30, 27, 30]);
    for projection in [PARALLEL, Projection::Perspective { fov_y: 30.0 }] {
        let framed = scene(30.0, 20.0, projection).with_size(96, 96).unwrap().framed(&volume, 1.0);
        let (picture, _): (Picture, _) = Renderer::new(&volume, Settings::new()).render(&framed).unwrap();
        let alpha = |x: u32, y: u32| picture.pixels()[(y * 96 + x) as usize][3];
        let at = |range: std::ops::Range<u32>| {
            range.flat_map(|n| (0..96).map(move |m| (n, m))).map(|(n, m)| alpha(n, m).max(alpha(m, n))).fold(0.0, f32::max)
        };
        assert_eq!(at(0..2).max(at(94..96)), 0.0, "{projection:?}");
        assert!(at(2..16) > 0.1 && at(80..94) > 0.1, "{projection:?}");
    }
}

/// All frames of a turntable hold what shows, at one size, and turn by equal angles all the way round.
#[test]
fn a_turntable_shows_all_in_every_frame_and_closes() {
    let (from, to) = ([3, 20, 11], [41, 33, 40]);
    let volume = block(from, to);
    let [low, high] = bricks_around(from, to);
    for projection in [PARALLEL, Projection::Perspective { fov_y: 40.0 }] {
        let scene = scene(10.0, 25.0, projection);
        let cameras = scene.turntable(&volume, 24, 1.0).unwrap();
        let views: Vec<_> = cameras.iter().map(|c| c.resolve(volume.grid(), 60, 40).unwrap()).collect();
        let mut most = 0.0_f64;
        for (i, view) in views.iter().enumerate() {
            let next = &views[(i + 1) % 24];
            let turn = (view.forward - next.forward).length();
            let first = (views[0].forward - views[1].forward).length();
            assert!((turn - first).abs() < 1e-9, "step {i}");
            assert!((view.scale - views[0].scale).abs() < 1e-12);
            for corner in 0..8 {
                let p = DVec3::from_array([0, 1, 2].map(|axis: usize| if corner >> axis & 1 == 0 { low[axis] } else { high[axis] }));
                let (u, v) = view.window(p);
                most = most.max((u / 30.0 - 1.0).abs()).max((v / 20.0 - 1.0).abs());
                assert!(view.depth(p) > 0.0);
            }
        }
        assert!((most - FILLED).abs() < 1e-6, "{most}");
        let direct = scene.camera().resolve(volume.grid(), 60, 40).unwrap();
        assert!((views[0].forward - direct.forward).length() < 1e-9, "the first frame keeps the direction");
    }
    let fixed = Camera::new(Placement::LookAt { eye: DVec3::ZERO, target: DVec3::X, up: DVec3::Z }, PARALLEL).unwrap();
    assert!(scene(0.0, 0.0, PARALLEL).with_camera(fixed).turntable(&volume, 4, 1.0).is_err());
}

/// A ball of soft edges in k x 2k x 2k voxels of the same box, through a transfer function that is faint at the edge.
fn ball(k: usize) -> Volume {
    let at = |n: usize, count: usize| (2.0 * n as f64 + 1.0) / count as f64 - 1.0;
    let square = |n: usize, count: usize| at(n, count) * at(n, count);
    let voxels: Vec<u16> = (0..4 * k * k * k)
        .map(|i| {
            let r2 = square(i % k, k) + square(i / k % (2 * k), 2 * k) + square(i / (2 * k * k), 2 * k);
            ((1.0 - r2).max(0.0) * 4000.0) as u16
        })
        .collect();
    let spacing = 128.0 / k as f64;
    Volume::new(Grid::with_spacing([k, 2 * k, 2 * k], [spacing; 3]).unwrap(), Voxels::U16(voxels.into())).unwrap()
}

#[test]
fn one_object_is_framed_alike_at_every_resolution() {
    let transfer = TransferFunction::new(vec![(0.0, [1.0; 3])], vec![(0.0, 0.0), (4000.0, 0.02)]).unwrap().with_unit(1.0).unwrap();
    let found = [64, 96, 144].map(|k| {
        let volume = ball(k);
        let framed = scene(0.0, 0.0, PARALLEL).with_transfer(transfer.clone()).framed(&volume, 1.0);
        framed.camera().resolve(volume.grid(), 60, 40).unwrap().scale
    });
    assert!(found.iter().all(|scale| (scale / found[0] - 1.0).abs() < 0.05), "{found:?}");
}
