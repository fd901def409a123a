//! Twins of light.

use super::fetch::{Cells, place};
use super::*;
use crate::fragment::light::{CueDepth, CueEach, Shade, ShadeAlong, ShadeEach};
use crate::proxy::Stack;
use crate::scene::{Camera, Gradient, Light, LightSource, Lighting, Placement, Projection, Shading, View};
use crate::volume::Grid;
use glam::{DMat3, DVec3};

/// An oblique, anisotropic, mirrored grid of [`DIMS`].
fn grid() -> Grid {
    let steps = DMat3::from_cols(DVec3::new(0.7, 0.1, 0.0), DVec3::new(0.2, -1.1, 0.1), DVec3::new(-0.1, 0.3, 1.9));
    Grid::new(DIMS, DVec3::new(3.0, -7.0, 11.0), steps).expect("a grid")
}

/// A camera that looks at the middle of `grid` along `way`.
fn view(grid: &Grid, way: DVec3, perspective: bool) -> View {
    let (target, eye) = (grid.center(), grid.center() - way * grid.radius() * 1.7);
    let up = if way.x == 0.0 && way.y == 0.0 { DVec3::Y } else { DVec3::Z };
    let projection = if perspective { Projection::Perspective { fov_y: 40.0 } } else { Projection::Orthographic { height: None } };
    let camera = Camera::new(Placement::LookAt { eye, target, up }, projection).expect("a camera");
    camera.resolve(grid, 64, 48).expect("numbers within f64")
}

fn stack(grid: &Grid, view: &View) -> Stack {
    Stack::new(grid, view, &[], 50)
}

fn direction(n: &mut Numbers) -> DVec3 {
    let v = DVec3::from_array([0; 3].map(|_| n.between(-1.0, 1.0)));
    if v.length() > 0.1 { v.normalize() } else { DVec3::new(0.6, 0.0, 0.8) }
}

/// A material with random numbers in up to four random lights.
fn random_lighting(n: &mut Numbers, grid: &Grid, view: &View) -> Lighting {
    let mut lighting = Lighting::default();
    (lighting.ambient, lighting.emission) = (n.between(0.0, 0.5), n.between(0.0, 0.2));
    lighting.diffuse = if n.bits() % 8 == 0 { 0.0 } else { n.between(0.0, 3.0) };
    lighting.specular = if n.bits() % 8 == 0 { 0.0 } else { n.between(0.0, 1.0) };
    lighting.shininess = [1.0, 1.5, 2.0, 20.0, 127.0, 128.0, 129.0, 999.5, 1000.0, n.between(1.0, 60.0)][n.bits() as usize % 10];
    lighting.two_sided = n.bits() % 2 == 0;
    lighting.gradient_floor = [0.0, 0.0, 1e-30, n.between(0.1, 60.0), 1e300][n.bits() as usize % 5];
    let light = |n: &mut Numbers| {
        let source = match n.bits() % 6 {
            0 => LightSource::Head,
            1 | 2 => LightSource::Direction(direction(n)),
            3 => LightSource::Position(grid.center() + direction(n) * grid.radius() * n.between(0.1, 5.0)),
            4 => LightSource::Position(view.eye),
            _ => LightSource::Position(grid.center() + direction(n) * 1e6),
        };
        Light::new(source, [0; 3].map(|_| n.unit())).expect("a light")
    };
    let lights = (0..1 + n.bits() % 4).map(|_| light(n)).collect();
    lighting.with_lights(lights).expect("four at most")
}

/// What light needs, and what it is made from.
struct Setting<'s> {
    lighting: &'s Lighting,
    grid: &'s Grid,
    view: &'s View,
}

/// A direction of length 1 and how far an f32 one may be off it; `None` for one without length.
fn towards(point: DVec3, from: DVec3, reach: f64) -> Option<(DVec3, f64)> {
    // Squares of very large numbers would leave f64.
    let far = (point - from).abs().max_element().max(1.0);
    let way = (point - from) / far;
    let length = way.length();
    // The way is a difference of numbers as large as the batch's part of the box, or the light's distance, is.
    (length > 0.0).then(|| (way / length, 16.0 * ROUNDING * (1.0 + reach / (length * far))))
}

/// Colours of fragment `i` in the light, each with how far an f32 may be off it, where that is little enough to tell anything.
fn lit(setting: &Setting<'_>, unit: f64, b: &Batch, i: usize, world: DVec3) -> Option<[(f64, f64); 3]> {
    let Setting { lighting, grid, view } = *setting;
    let (alpha, size) = (f64::from(b.slab.alpha[i]), f64::from(b.gradient().size[i]));
    let color = [0, 1, 2].map(|c: usize| f64::from(b.slab.color[c][i]));
    if size == 0.0 {
        return Some(color.map(|c| (c, 0.0)));
    }
    let normal = DVec3::from_array([0, 1, 2].map(|a: usize| f64::from(b.gradient().normal[a][i])));
    // Rounding of places: those of the batch against the base voxel.
    let reach = 3.0 * grid.radius();
    let (to_eye, eye_off) = if view.perspective { towards(view.eye, world, reach)? } else { (-view.forward, 4.0 * ROUNDING) };
    let facing = |cosine: f64| (if lighting.two_sided { cosine.abs() } else { cosine.max(0.0) }).min(1.0);
    let mut glow = [(lighting.emission + lighting.ambient, 0.0); 3];
    let mut shine = [(0.0, 0.0); 3];
    for light in lighting.lights() {
        let (to_light, light_off) = match light.source() {
            LightSource::Head => (to_eye, eye_off),
            LightSource::Direction(d) => (d, 4.0 * ROUNDING),
            LightSource::Position(p) => towards(p, world, reach)?,
        };
        let half = to_light + to_eye;
        let (mirror, mirror_off) = if half.length() == 0.0 {
            (0.0, 0.0)
        } else {
            let off =
                if light.source() == LightSource::Head { eye_off } else { 2.0 * (light_off + eye_off + 4.0 * ROUNDING) / half.length() };
            (facing(normal.dot(half.normalize())), off + 8.0 * ROUNDING)
        };
        let surface = facing(normal.dot(to_light));
        let power = libm::pow(mirror, lighting.shininess);
        // The steepest slope of h^s is s; its own arithmetic is good to a few roundings of s times the logarithm.
        let power_off =
            lighting.shininess * (mirror_off + 8.0 * ROUNDING) * libm::pow((mirror + mirror_off).min(1.0), lighting.shininess - 1.0)
                + 8.0 * ROUNDING
                + 1e-37;
        for c in 0..3 {
            glow[c].0 += lighting.diffuse * surface * light.color()[c];
            glow[c].1 += lighting.diffuse * (light_off + 8.0 * ROUNDING);
            shine[c].0 += lighting.specular * power * light.color()[c];
            shine[c].1 += lighting.specular * power_off;
        }
    }
    let floor = lighting.gradient_floor / (size * unit);
    let weight = 1.0 / (1.0 + floor * floor);
    let all = [0, 1, 2].map(|c: usize| {
        let sum = color[c] * glow[c].0 + alpha * shine[c].0;
        let off = color[c] * glow[c].1 + alpha * shine[c].1 + 12.0 * ROUNDING * sum;
        let full = sum.min(alpha);
        (color[c] + weight * (full - color[c]), off + 16.0 * ROUNDING * (full + color[c]))
    });
    all.iter().all(|(_, off)| *off <= 0.02 * alpha).then_some(all)
}

/// Lit colours of fragments that have gradients, the rest as it was.
fn hold<K: for<'v> Kernel<Frame<'v>, Batch>>(
    setting: &Setting<'_>,
    unit: f64,
    frame: &Frame<'_>,
    before: &Batch,
    world: impl Fn(usize) -> DVec3,
) -> u32 {
    let mut held = 0;
    run::<K>(frame, before, &[Part::Color], |after, level| {
        for i in 0..BATCH {
            let [got, old] = [after, before].map(|b| [0, 1, 2].map(|c: usize| b.slab.color[c][i]));
            if !bit(before.gradient().lanes, i) {
                (0..3).for_each(|c| assert_same(got[c], old[c], level, i));
                continue;
            }
            let alpha = before.slab.alpha[i];
            // Mixed with the unlit colour it may be a rounding above its opacity.
            let most = alpha * (1.0 + f32::EPSILON);
            assert!(got.iter().all(|&x| (0.0..=most).contains(&x)), "{got:?} of opacity {alpha}, at {level}, fragment {i}");
            if let Some(want) = lit(setting, unit, before, i, world(i)) {
                held += 1;
                (0..3).for_each(|c| assert_near(got[c], want[c].0, want[c].1, level, i));
            }
        }
    });
    held
}

/// A frame with light of the given kind, and a unit of the batch's gradients.
fn lighted<'v>(n: &mut Numbers, none: &'v Voxels, setting: &Setting<'_>) -> (Frame<'v>, f64) {
    let mut frame = frame(none, n);
    let gradient = GradientFrame::new(Gradient::Central, setting.grid, 0.7);
    let unit = gradient.unit;
    frame.optional.light = Some(LightingFrame::new(setting.lighting, Some(&gradient), setting.grid, &stack(setting.grid, setting.view)));
    frame.optional.gradient = Some(gradient);
    (frame, unit)
}

/// World position of fragment `i` of a slice's batch.
fn on_slice(grid: &Grid, b: &Batch, i: usize) -> DVec3 {
    let base = b.geometry.cells.base;
    let low = [base % DIMS[0], base / DIMS[0] % DIMS[1], base / (DIMS[0] * DIMS[1])];
    let g = &b.geometry;
    let index = [0, 1, 2].map(|a: usize| {
        let place = f64::from(g.origin[a]) + (i % SIDE) as f64 * f64::from(g.across[a]) + (i / SIDE) as f64 * f64::from(g.down[a]);
        low[a] as f64 + place
    });
    grid.index_to_world().transform_point3(DVec3::from_array(index))
}

fn in_cell(grid: &Grid, b: &Batch, cells: &Cells, i: usize) -> DVec3 {
    let index = [0, 1, 2].map(|a: usize| cells[i][a] as f64 + f64::from(b.sample.weight[a][i]));
    grid.index_to_world().transform_point3(DVec3::from_array(index))
}

#[test]
pub(super) fn shades() {
    let mut n = Numbers::new(81);
    let none = Voxels::zeros(VoxelType::U8, 1);
    let grid = grid();
    let mut held = 0;
    for round in 0..300 {
        let way = if round % 3 == 0 { DVec3::X } else { direction(&mut n) };
        let view = view(&grid, way, round % 2 == 0);
        let lighting = random_lighting(&mut n, &grid, &view);
        let setting = Setting { lighting: &lighting, grid: &grid, view: &view };
        let (frame, unit) = lighted(&mut n, &none, &setting);
        let mut before = batch(&mut n);
        if round % 4 == 0 {
            (before.shown, before.gradient_mut().lanes) = (u8::MAX, u64::MAX);
        }
        held += hold::<Shade>(&setting, unit, &frame, &before, |i| on_slice(&grid, &before, i));
    }
    assert!(held > 5000, "{held} colours");
}

#[test]
pub(super) fn shades_at_depths_of_their_own() {
    let mut n = Numbers::new(82);
    let none = Voxels::zeros(VoxelType::U8, 1);
    let grid = grid();
    let mut held = 0;
    for round in 0..150 {
        let view = view(&grid, direction(&mut n), round % 2 == 0);
        let lighting = random_lighting(&mut n, &grid, &view);
        let setting = Setting { lighting: &lighting, grid: &grid, view: &view };
        let (mut frame, unit) = lighted(&mut n, &none, &setting);
        let mut before = batch(&mut n);
        let cells = place(&mut n, &mut before, DIMS, frame.sample.strides);
        for far in [false, true] {
            frame.sample.far = far;
            held += hold::<ShadeEach<false>>(&setting, unit, &frame, &before, |i| in_cell(&grid, &before, &cells, i));
        }
    }
    assert!(held > 5000, "{held} colours");
}

#[test]
pub(super) fn shades_along_rays() {
    let mut n = Numbers::new(84);
    let none = Voxels::zeros(VoxelType::U8, 1);
    let grid = grid();
    let mut held = 0;
    for round in 0..150 {
        let view = view(&grid, direction(&mut n), round % 2 == 0);
        let lighting = random_lighting(&mut n, &grid, &view);
        let setting = Setting { lighting: &lighting, grid: &grid, view: &view };
        let (frame, unit) = lighted(&mut n, &none, &setting);
        let before = batch(&mut n);
        let base = before.geometry.cells.base;
        let low = [base % DIMS[0], base / DIMS[0] % DIMS[1], base / (DIMS[0] * DIMS[1])];
        let rays = before.rays.as_deref().expect("the batch has rays");
        let world = |i: usize| {
            let index = [0, 1, 2].map(|a: usize| low[a] as f64 + f64::from(rays.place[a][i]));
            grid.index_to_world().transform_point3(DVec3::from_array(index))
        };
        held += hold::<ShadeAlong>(&setting, unit, &frame, &before, world);
    }
    assert!(held > 2500, "{held} colours");
}

/// Lights where directions end: at the eye, behind it, in a fragment, exactly opposite to the eye, farther than f32 counts.
#[test]
pub(super) fn special_lights() {
    let mut n = Numbers::new(83);
    let none = Voxels::zeros(VoxelType::U8, 1);
    // Along an axis the directions to the eye are exact.
    let grid = Grid::with_spacing(DIMS, [1.0; 3]).expect("a grid");
    for perspective in [false, true] {
        let view = view(&grid, DVec3::Z, perspective);
        let sources = [
            LightSource::Direction(DVec3::Z),
            LightSource::Direction(DVec3::NEG_Z),
            LightSource::Direction(DVec3::new(1e-300, 0.0, 1e300)),
            LightSource::Position(view.eye),
            LightSource::Position(view.eye - DVec3::Z * 100.0),
            LightSource::Position(grid.center()),
            LightSource::Position(DVec3::new(3.0, 4.0, 5.0)),
            LightSource::Position(DVec3::splat(1e30)),
            LightSource::Position(DVec3::splat(-1e300)),
        ];
        for source in sources {
            for shininess in [1.0, 30.0, 1000.0] {
                let mut lighting = Lighting::default();
                (lighting.shininess, lighting.specular, lighting.two_sided) = (shininess, 0.9, n.bits() % 2 == 0);
                let lighting = lighting.with_lights(vec![Light::new(source, [1.0, 0.5, 0.0]).expect("a light")]).expect("one light");
                let setting = Setting { lighting: &lighting, grid: &grid, view: &view };
                let (frame, unit) = lighted(&mut n, &none, &setting);
                let mut before = batch(&mut n);
                (before.shown, before.gradient_mut().lanes) = (u8::MAX, u64::MAX);
                // Fragments on whole voxels: one of them is where a light is.
                (before.geometry.across, before.geometry.down) = ([1.0, 0.0, 0.0], [0.0, 1.0, 0.0]);
                before.geometry.origin = [0.0; 3];
                before.geometry.cells.base = 5 * DIMS[0] * DIMS[1];
                // Halfway between exactly opposite directions lies nothing; beside that the direction between them is f32's rounding.
                let held = hold::<Shade>(&setting, unit, &frame, &before, |i| on_slice(&grid, &before, i));
                let opposite = perspective && source == LightSource::Direction(DVec3::Z);
                assert!(held > 40 || opposite || shininess > 100.0, "{held} colours of {source:?}");
            }
        }
    }
    // Coefficients beyond f32 leave colours within their opacity.
    let view = view(&grid, DVec3::Z, false);
    let mut lighting = Lighting::default();
    (lighting.ambient, lighting.diffuse, lighting.specular, lighting.emission) = (1e300, f64::MAX, 1e308, f64::MAX);
    let setting = Setting { lighting: &lighting, grid: &grid, view: &view };
    let (frame, _) = lighted(&mut n, &none, &setting);
    let mut before = batch(&mut n);
    (before.shown, before.gradient_mut().lanes) = (u8::MAX, u64::MAX);
    run::<Shade>(&frame, &before, &[Part::Color], |after, level| {
        for i in 0..BATCH {
            for c in 0..3 {
                let (got, old, alpha) = (after.slab.color[c][i], before.slab.color[c][i], before.slab.alpha[i]);
                let want = if before.gradient().size[i] > 0.0 && old > 0.0 { alpha } else { got };
                assert!((0.0..=alpha).contains(&got), "{got} of opacity {alpha}, at {level}");
                assert_same(got, want, level, i);
            }
        }
    });
}

/// The least and the greatest depth of the box before the near plane.
fn depths(grid: &Grid, view: &View) -> [f64; 2] {
    let depths = grid.corners().map(|c| (c - view.eye).dot(view.forward));
    [depths.iter().copied().fold(f64::INFINITY, f64::min).max(view.near), depths.iter().copied().fold(f64::NEG_INFINITY, f64::max)]
}

#[test]
pub(super) fn darkness_by_depth() {
    let mut n = Numbers::new(84);
    let none = Voxels::zeros(VoxelType::U8, 1);
    let grid = grid();
    for round in 0..100 {
        let mut view = view(&grid, direction(&mut n), round % 2 == 0);
        if round % 5 == 0 {
            // The eye in the box.
            view.eye = grid.center() + direction(&mut n) * 0.1;
        }
        let mut lighting = Lighting::default();
        lighting.shading = Shading::Depth;
        let setting = Setting { lighting: &lighting, grid: &grid, view: &view };
        let (mut frame, _) = lighted(&mut n, &none, &setting);
        // It needs no gradient.
        frame.optional.gradient = None;
        let [near, far] = depths(&grid, &view);
        let mut before = batch(&mut n);
        before.depth = n.between(near, far) as f32;
        let cells = place(&mut n, &mut before, DIMS, frame.sample.strides);
        let check = |after: &Batch, level: &'static str, depth: &dyn Fn(usize) -> f64| {
            for i in 0..BATCH {
                let left = (1.0 - (depth(i) - near) / (far - near)).clamp(0.0, 1.0);
                for c in 0..3 {
                    let old = before.slab.color[c][i];
                    if listed(before.shown, i) {
                        let want = f64::from(old) * left;
                        assert_near(after.slab.color[c][i], want, f64::from(old) * 16.0 * ROUNDING, level, i);
                    } else {
                        assert_same(after.slab.color[c][i], old, level, i);
                    }
                }
            }
        };
        run::<CueDepth>(&frame, &before, &[Part::Color], |after, level| check(after, level, &|_| f64::from(before.depth)));
        let own = |i: usize| (in_cell(&grid, &before, &cells, i) - view.eye).dot(view.forward);
        for far in [false, true] {
            frame.sample.far = far;
            run::<CueEach<false>>(&frame, &before, &[Part::Color], |after, level| check(after, level, &own));
        }
    }
}
