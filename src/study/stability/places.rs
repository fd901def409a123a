//! Extreme grids, eyes, views and fogs.

use super::Row;
use super::look::{Bench, Bound, Case, fade, filled, looking, scene};
use crate::scene::{Camera, Fog, FogDistance, FogMode, Projection};
use crate::volume::{BoxConvention, Grid};
use crate::{Result, Volume};
use glam::{DMat3, DVec3};

const PARALLEL: Projection = Projection::Orthographic { height: None };
const VIEW: Projection = Projection::Perspective { fov_y: 50.0 };
/// Smooth cases.
const BOUND: Bound = Bound::Absolute(5e-5);

/// Values that go evenly from 0 to 1 along x: exact between voxels.
fn ramp(grid: Grid) -> Result<Volume> {
    filled(grid.with_convention(BoxConvention::Nodes), |[x, ..]| x)
}

/// A box of 8 x 7 x 6 units.
fn plain() -> Result<Volume> {
    ramp(Grid::with_spacing([9, 8, 7], [1.0; 3])?)
}

struct Rows<'b, 's> {
    bench: &'b Bench<'s>,
    rows: Vec<Row>,
}

impl Rows<'_, '_> {
    /// The ramp in 400 slices through an opacity of 0.1 per unit.
    fn see(&mut self, group: &'static str, case: String, volume: Volume, camera: Camera, opacity: f64, bound: Bound) -> Result<()> {
        self.fogged(group, case, volume, camera, opacity, None, 400, bound)
    }

    #[allow(clippy::too_many_arguments, reason = "a case is all of these")]
    fn fogged(
        &mut self,
        group: &'static str,
        case: String,
        volume: Volume,
        camera: Camera,
        opacity: f64,
        fog: Option<Fog>,
        slices: u64,
        bound: Bound,
    ) -> Result<()> {
        let scene = scene(fade(0.0, 1.0, opacity)?, camera, slices)?.with_fog(fog);
        self.rows.push(self.bench.judge(Case { group, case, volume, scene, bound })?);
        Ok(())
    }
}

pub(super) fn rows(bench: &Bench<'_>) -> Result<Vec<Row>> {
    let mut rows = Rows { bench, rows: Vec::new() };
    grids(&mut rows)?;
    eyes(&mut rows)?;
    views(&mut rows)?;
    fogs(&mut rows)?;
    Ok(rows.rows)
}

fn grids(rows: &mut Rows<'_, '_>) -> Result<()> {
    for spacing in [[1.0, 1.0, 1000.0], [1000.0, 1.0, 1.0], [1e-6; 3], [1e6; 3]] {
        let volume = ramp(Grid::with_spacing([6, 7, 5], spacing)?)?;
        let [x, y, z] = spacing;
        // Opacities are per smallest spacing: faint enough for the long way.
        let opacity = if x == y && y == z { 0.1 } else { 1e-4 };
        rows.see("grids", format!("spacing {x:e} : {y:e} : {z:e}"), volume, Camera::orbit(33.0, 21.0)?, opacity, BOUND)?;
    }
    for spacing in [1.0, 1e-3, 1e-6] {
        let steps = DMat3::from_diagonal(DVec3::splat(spacing));
        let volume = ramp(Grid::new([6, 7, 5], DVec3::new(1e6, -1e6, 1e6), steps)?)?;
        // 1e6 in f64 ends at 1e-10: a ten-thousandth of the smallest voxel.
        rows.see("grids", format!("origin 1e6, spacing {spacing:e}"), volume, Camera::orbit(33.0, 21.0)?, 0.1, Bound::Absolute(2e-4))?;
    }
    for dims in [[1, 1, 1], [1, 1, 9], [1, 9, 1], [9, 1, 1], [1, 7, 7]] {
        for convention in [BoxConvention::Cells, BoxConvention::Nodes] {
            let [x, y, z] = dims;
            let volume = filled(Grid::with_spacing(dims, [1.0; 3])?.with_convention(convention), |[x, ..]| x)?;
            let name = if convention == BoxConvention::Cells { "cells" } else { "nodes" };
            // A box of no size does not say where to look from.
            let eye = volume.grid().center() + DVec3::new(-20.0, 15.0, 9.0);
            let height = Projection::Orthographic { height: Some(9.0) };
            let camera = looking(eye, volume.grid().center(), DVec3::Z, height)?;
            rows.see("grids", format!("{x} x {y} x {z} voxels, box of {name}"), volume, camera, 0.2, BOUND)?;
        }
    }
    Ok(())
}

fn eyes(rows: &mut Rows<'_, '_>) -> Result<()> {
    let places = [
        ("inside the box", DVec3::new(3.3, 2.9, 3.1)),
        ("on a voxel", DVec3::new(4.0, 3.0, 2.0)),
        ("on a face", DVec3::new(0.0, 3.3, 2.9)),
        ("on an edge", DVec3::new(0.0, 0.0, 2.9)),
        ("in a corner", DVec3::ZERO),
        ("a millionth before a face", DVec3::new(-1e-6, 3.3, 2.9)),
    ];
    for (said, eye) in places {
        for (way, target) in [("across", DVec3::new(8.0, 4.1, 3.3)), ("along an axis", eye + DVec3::X)] {
            let camera = looking(eye, target, DVec3::Z, VIEW)?;
            rows.see("eyes", format!("eye {said}, looking {way}"), plain()?, camera, 0.1, BOUND)?;
        }
    }
    let center = DVec3::new(4.0, 3.5, 3.0);
    for (near, said) in [(12.0, "in the middle of the box"), (8.0, "on a face"), (1e-9, "at the eye"), (1e9, "behind everything")] {
        let camera = looking(center - DVec3::X * 12.0, center, DVec3::Z, VIEW)?.with_near(near)?;
        rows.see("eyes", format!("near plane {said}"), plain()?, camera, 0.1, BOUND)?;
    }
    for fov_y in [0.001, 179.9] {
        let camera = looking(center + DVec3::new(-9.0, -4.0, 3.0), center, DVec3::Z, Projection::Perspective { fov_y })?;
        rows.see("eyes", format!("field of view {fov_y} degrees"), plain()?, camera, 0.1, BOUND)?;
        let camera = looking(DVec3::new(3.3, 2.9, 3.1), center, DVec3::Z, Projection::Perspective { fov_y })?;
        // Rays aslant cross a thousand slabs' worth of way in each.
        let case = format!("field of view {fov_y} degrees, from inside");
        rows.fogged("eyes", case, plain()?, camera, 0.1, None, 100_000, BOUND)?;
    }
    Ok(())
}

fn views(rows: &mut Rows<'_, '_>) -> Result<()> {
    let cube = || ramp(Grid::with_spacing([9; 3], [1.0; 3])?);
    let center = DVec3::splat(4.0);
    let hair = f64::EPSILON;
    let ways: [(&str, DVec3); 12] = [
        ("+x", DVec3::X),
        ("-y", DVec3::NEG_Y),
        ("+z", DVec3::Z),
        ("a face's diagonal", DVec3::new(1.0, 1.0, 0.0)),
        ("another face's diagonal", DVec3::new(0.0, -1.0, 1.0)),
        ("the cube's diagonal", DVec3::ONE),
        ("+x, one ulp off", DVec3::new(1.0, hair, 0.0)),
        ("+x, one ulp off the other way", DVec3::new(1.0, 0.0, -hair)),
        ("+z, the least number off", DVec3::new(f64::MIN_POSITIVE, 0.0, 1.0)),
        ("a face's diagonal, one ulp off", DVec3::new(1.0, 1.0 + hair, 0.0)),
        ("the cube's diagonal, one ulp off", DVec3::new(1.0, 1.0 + hair, 1.0 - hair)),
        ("-x, one f32 ulp off", DVec3::new(-1.0, 1.2e-7, 0.0)),
    ];
    for (said, way) in ways {
        let up = if way.y == 0.0 && way.x.abs() < 1e-300 { DVec3::Y } else { DVec3::Z };
        for (projection, name) in [(PARALLEL, "parallel"), (VIEW, "perspective")] {
            let camera = looking(center - way.normalize() * 20.0, center, up, projection)?;
            rows.see("views", format!("along {said}, {name}"), cube()?, camera, 0.1, BOUND)?;
        }
    }
    // The middle slice of an odd number goes through the cube's edges, seen along the diagonal of a face; of 4 k + 2 slices two go
    // through vertices, seen along (1,3,0).
    for (way, slices) in [(DVec3::new(1.0, 1.0, 0.0), 401), (DVec3::new(1.0, 3.0, 0.0), 402), (DVec3::new(1.0, 1.0, 2.0), 402)] {
        let camera = looking(center - way.normalize() * 20.0, center, DVec3::Z, PARALLEL)?;
        let case = format!("slice planes through vertices, along ({}, {}, {})", way.x, way.y, way.z);
        rows.fogged("views", case, cube()?, camera, 0.1, None, slices, BOUND)?;
    }
    Ok(())
}

fn fogs(rows: &mut Rows<'_, '_>) -> Result<()> {
    let modes = [
        ("linear, start = end within the box", FogMode::Linear { start: 20.0, end: 20.0 }, Bound::Absolute(1e-3)),
        ("linear, end before start", FogMode::Linear { start: 23.0, end: 17.0 }, BOUND),
        ("linear, from 0 to the largest number", FogMode::Linear { start: 0.0, end: f64::MAX }, BOUND),
        ("linear, from -1e300 to 1e300", FogMode::Linear { start: -1e300, end: 1e300 }, BOUND),
        ("exp, density 0", FogMode::Exp { density: 0.0 }, BOUND),
        ("exp, density 1e-300", FogMode::Exp { density: 1e-300 }, BOUND),
        ("exp, density 1e300", FogMode::Exp { density: 1e300 }, BOUND),
        ("exp2, density 0", FogMode::Exp2 { density: 0.0 }, BOUND),
        ("exp2, density 1e-300", FogMode::Exp2 { density: 1e-300 }, BOUND),
        ("exp2, density 1e300", FogMode::Exp2 { density: 1e300 }, BOUND),
    ];
    let center = DVec3::splat(4.0);
    for (said, mode, bound) in modes {
        for distance in [FogDistance::Planar, FogDistance::Radial] {
            let name = if distance == FogDistance::Planar { "planar" } else { "radial" };
            let camera = looking(center + DVec3::new(-14.0, 11.0, 9.0), center, DVec3::Z, VIEW)?;
            let fog = Fog::new(mode, [0.3, 0.6, 0.9])?.with_distance(distance);
            rows.fogged("fogs", format!("{said}, {name}"), plain()?, camera, 0.1, Some(fog), 1000, bound)?;
        }
    }
    Ok(())
}
