//! Light and gradients at the ends of their numbers.

use super::Row;
use super::look::{Bench, Bound, Case, fade, filled, looking, scene};
use crate::scene::{Camera, Gradient, Light, LightSource, Lighting, Projection, Shading, TransferFunction};
use crate::volume::{BoxConvention, Grid, Voxels};
use crate::{Result, Scene, Volume};
use glam::DVec3;

const SLICES: u64 = 500;
const SIDE: usize = 9;
/// Smooth cases.
const BOUND: Bound = Bound::Absolute(1e-3);

fn center() -> DVec3 {
    DVec3::splat(0.5 * (SIDE - 1) as f64)
}

fn grid() -> Result<Grid> {
    Ok(Grid::with_spacing([SIDE; 3], [1.0; 3])?.with_convention(BoxConvention::Nodes))
}

/// A smooth hill, from 0 to `most`, whose gradient is 0 at the top alone.
fn hill(most: f64) -> Result<Volume> {
    let values = (0..SIDE * SIDE * SIDE).map(|i| {
        let p = DVec3::new((i % SIDE) as f64, (i / SIDE % SIDE) as f64, (i / SIDE / SIDE) as f64) - center();
        most * libm::exp(-0.04 * p.length_squared())
    });
    Volume::new(grid()?, Voxels::F64(values.collect()))
}

fn camera(perspective: bool) -> Result<Camera> {
    let projection = if perspective { Projection::Perspective { fov_y: 25.0 } } else { Projection::Orthographic { height: Some(6.0) } };
    looking(center() + DVec3::new(-20.0, 8.0, 6.0), center(), DVec3::Z, projection)
}

/// The scene in one light of the default material, changed.
fn lit(scene: &Scene, source: LightSource, change: impl Fn(&mut Lighting)) -> Result<Scene> {
    let mut lighting = Lighting::default();
    change(&mut lighting);
    scene.clone().with_lighting(Some(lighting.with_lights(vec![Light::new(source, [1.0; 3])?])?))
}

pub(super) fn rows(bench: &Bench<'_>) -> Result<Vec<Row>> {
    let mut rows = Vec::new();
    let mut judge = |case: String, volume: Volume, scene: Scene, bound: Bound| -> Result<()> {
        rows.push(bench.judge(Case { group: "lights", case, volume, scene, bound })?);
        Ok(())
    };
    let plain = |perspective: bool| scene(fade(0.0, 1.0, 0.1)?, camera(perspective)?, SLICES);
    let head = LightSource::Head;
    for shininess in [1.0, 1.5, 1000.0] {
        for perspective in [false, true] {
            let scene = lit(&plain(perspective)?, head, |m| (m.shininess, m.specular) = (shininess, 1.0))?;
            let way = if perspective { "perspective" } else { "parallel" };
            judge(format!("shininess {shininess}, {way}"), hill(1.0)?, scene, BOUND)?;
        }
    }
    let eye = center() + DVec3::new(-20.0, 8.0, 6.0);
    for (said, source) in [
        ("inside the volume", LightSource::Position(center() + DVec3::new(0.3, -0.7, 1.1))),
        ("at the eye", LightSource::Position(eye)),
        ("behind the eye", LightSource::Position(eye + DVec3::new(-20.0, 8.0, 6.0))),
        ("1e9 away", LightSource::Position(DVec3::new(1e9, -2e9, 5e8))),
        ("1e300 away", LightSource::Position(DVec3::splat(1e300))),
        ("from behind the volume", LightSource::Direction(DVec3::new(20.0, -8.0, -6.0))),
    ] {
        for two_sided in [true, false] {
            let sides = if two_sided { "two sides" } else { "one side" };
            let scene = lit(&plain(true)?, source, |m| m.two_sided = two_sided)?;
            // Halfway between a direction and its opposite lies no direction: highlights are left to rounding there.
            let bound = if said.starts_with("from behind") { Bound::None } else { Bound::Absolute(3e-3) };
            judge(format!("a light {said}, {sides}"), hill(1.0)?, scene, bound)?;
        }
    }
    for floor in [0.0, 1e-300, 1e-9, 1.0, 1e30, 1e300] {
        let scene = lit(&plain(false)?, head, |m| m.gradient_floor = floor)?;
        judge(format!("gradient floor {floor:e}"), hill(1.0)?, scene, BOUND)?;
    }
    let flat = filled(grid()?, |_| 0.5)?;
    judge("gradient 0 everywhere".into(), flat.clone(), lit(&plain(false)?, head, |_| {})?, Bound::Absolute(4e-6))?;
    judge("gradient 0 everywhere, floor 1".into(), flat, lit(&plain(false)?, head, |m| m.gradient_floor = 1.0)?, Bound::Absolute(4e-6))?;
    let dark = lit(&plain(false)?, head, |m| (m.ambient, m.diffuse, m.specular) = (0.0, 0.0, 0.0))?;
    judge("no light at all".into(), hill(1.0)?, dark, BOUND)?;
    let bright = lit(&plain(false)?, head, |m| (m.ambient, m.diffuse, m.specular, m.emission) = (1e300, f64::MAX, 1e30, f64::MAX))?;
    judge("coefficients up to the largest number".into(), hill(1.0)?, bright, BOUND)?;
    for (most, said) in [(1e30, "1e30"), (1e-30, "1e-30"), (1e300, "1e300"), (1e-300, "1e-300")] {
        for (kind, name) in [(Gradient::Central, "central"), (Gradient::Sobel, "sobel")] {
            let scene = scene(fade(0.0, most, 0.1)?, camera(false)?, SLICES)?.with_gradient(kind);
            judge(format!("f64 up to {said}, {name}"), hill(most)?, lit(&scene, head, |m| m.gradient_floor = 0.05 * most)?, BOUND)?;
        }
    }
    for perspective in [false, true] {
        let scene = lit(&plain(perspective)?, head, |m| m.shading = Shading::Depth)?;
        judge(format!("darker with depth, {}", if perspective { "perspective" } else { "parallel" }), hill(1.0)?, scene, BOUND)?;
    }
    let opacity = |points: Vec<(f64, f64)>| -> Result<Scene> {
        let transfer = TransferFunction::new(vec![(0.0, [0.1, 0.4, 1.0]), (1.0, [1.0, 0.5, 0.2])], vec![(0.0, 0.1)])?;
        Ok(plain(false)?.with_transfer(transfer.with_gradient_opacity(points)?))
    };
    for (said, points, bound) in [
        ("from 0 to 1", vec![(0.0, 0.0), (0.2, 1.0)], BOUND),
        ("a step", vec![(0.1, 0.0), (0.1, 1.0)], Bound::Absolute(3e-2)),
        ("up to the largest number", vec![(0.0, 1.0), (1e300, 0.0)], BOUND),
        ("within the smallest numbers", vec![(1e-310, 0.0), (2e-310, 1.0)], BOUND),
    ] {
        judge(format!("gradient opacity {said}"), hill(1.0)?, opacity(points)?, bound)?;
    }
    // What is opaque stays so, however small the factor, unless it is 0.
    let solid = TransferFunction::new(vec![(0.0, [0.9, 0.5, 0.25])], vec![(0.0, 1.0)])?.with_gradient_opacity(vec![(0.0, 0.5)])?;
    judge("gradient opacity one half of opacity 1".into(), hill(1.0)?, plain(false)?.with_transfer(solid), Bound::Absolute(1e-2))?;
    Ok(rows)
}
