//! Values at the ends of their types, values that are NaN, and transfer functions one table entry wide.

use super::Row;
use super::look::{Bench, Bound, Case, fade, filled, looking, scene};
use crate::scene::{Camera, Classification, Method, Projection, TransferFunction};
use crate::volume::{BoxConvention, Grid, Voxel, VoxelType, Voxels};
use crate::{Result, Scene, Volume};
use glam::DVec3;

const SIDE: usize = 12;

fn grid() -> Result<Grid> {
    Ok(Grid::with_spacing([SIDE; 3], [1.0; 3])?.with_convention(BoxConvention::Nodes))
}

fn camera() -> Result<Camera> {
    let center = DVec3::splat(0.5 * (SIDE - 1) as f64);
    looking(center + DVec3::new(-30.0, 12.0, 9.0), center, DVec3::Z, Projection::Orthographic { height: Some(7.0) })
}

/// Values that go evenly from the least to the most along x, and jump there and back once on the way.
fn ends<T: Voxel>(low: f64, high: f64) -> Voxels {
    let at = |i: usize| {
        let x = i % SIDE;
        let t = x as f64 / (SIDE - 1) as f64;
        match x {
            4 => high,
            5 => low,
            _ => low * (1.0 - t) + high * t,
        }
    };
    T::wrap((0..SIDE * SIDE * SIDE).map(|i| T::from_f64(at(i))).collect())
}

fn of_type(kind: VoxelType, low: f64, high: f64) -> Voxels {
    match kind {
        VoxelType::U8 => ends::<u8>(low, high),
        VoxelType::I8 => ends::<i8>(low, high),
        VoxelType::U16 => ends::<u16>(low, high),
        VoxelType::I16 => ends::<i16>(low, high),
        VoxelType::U32 => ends::<u32>(low, high),
        VoxelType::I32 => ends::<i32>(low, high),
        VoxelType::F32 => ends::<f32>(low, high),
        VoxelType::F64 => ends::<f64>(low, high),
    }
}

/// Slices fine enough for values that turn round in a cell.
const FINE: u64 = 1100;
const BOUND: Bound = Bound::Absolute(1e-4);

pub(super) fn rows(bench: &Bench<'_>) -> Result<Vec<Row>> {
    let mut rows = Vec::new();
    let mut judge = |group: &'static str, case: String, volume: Volume, scene: Scene, bound: Bound| -> Result<()> {
        rows.push(bench.judge(Case { group, case, volume, scene, bound })?);
        Ok(())
    };
    for kind in [VoxelType::U8, VoxelType::I8, VoxelType::U16, VoxelType::I16, VoxelType::U32, VoxelType::I32] {
        let (low, high) = kind.limits();
        let volume = Volume::new(grid()?, of_type(kind, low, high))?;
        judge("values", format!("{}: {low} to {high}", kind.name()), volume, scene(fade(low, high, 0.1)?, camera()?, FINE)?, BOUND)?;
    }
    for (low, high) in [(0.0, 1e-38), (0.0, 1e-44), (-1e38, 1e38), (0.0, 1e38), (-3.4e38, 3.4e38)] {
        let volume = Volume::new(grid()?, of_type(VoxelType::F32, low, high))?;
        let bound = if high < 1e-40 { Bound::None } else { BOUND };
        judge("values", format!("f32: {low:e} to {high:e}"), volume, scene(fade(low, high, 0.1)?, camera()?, FINE)?, bound)?;
    }
    for (low, high) in [(0.0, 1e-300), (-1e300, 1e300)] {
        let volume = Volume::new(grid()?, of_type(VoxelType::F64, low, high))?;
        judge("values", format!("f64: {low:e} to {high:e}"), volume, scene(fade(low, high, 0.1)?, camera()?, FINE)?, BOUND)?;
    }
    for (said, odd) in [("NaN", f32::NAN), ("infinity", f32::INFINITY), ("minus infinity", f32::NEG_INFINITY)] {
        // A hole in the middle: its cells are transparent, and begin and end at once.
        let mut values = vec![0.0f32; SIDE * SIDE * SIDE];
        values.iter_mut().enumerate().for_each(|(i, v)| *v = (i % SIDE) as f32);
        values[(5 * SIDE + 5) * SIDE + 5] = odd;
        values[(8 * SIDE + 6) * SIDE + 7] = odd;
        let volume = Volume::new(grid()?, Voxels::F32(values.into()))?;
        judge("values", format!("f32 with {said}"), volume, scene(fade(0.0, 11.0, 0.1)?, camera()?, FINE)?, Bound::Absolute(1e-3))?;
        let volume = Volume::new(grid()?, Voxels::F32(vec![odd; SIDE * SIDE * SIDE].into()))?;
        judge("values", format!("f32, nothing but {said}"), volume, scene(fade(0.0, 1.0, 0.1)?, camera()?, 64)?, Bound::Absolute(0.0))?;
    }
    // One value in a thousand shows: as wide as an entry of the table that fits it.
    let pre = Method { classification: Classification::PreIntegrated, ..Method::default() };
    for (most, at, half, said, method, slices, bound) in [
        (1000.0, 400.0, 0.5, "midpoint, 100000 slices", Method::default(), 100_000, Bound::Absolute(3e-3)),
        (1000.0, 400.0, 0.5, "midpoint, 100 slices", Method::default(), 100, Bound::None),
        (256.0, 101.0, 1.0, "midpoint, 20000 slices", Method::default(), 20_000, Bound::Absolute(3e-3)),
        (256.0, 101.0, 1.0, "pre-integrated, 300 slices", pre, 300, Bound::Absolute(1e-2)),
        (1000.0, 400.0, 0.5, "pre-integrated, 300 slices", pre, 300, Bound::None),
    ] {
        let spike = TransferFunction::new(vec![(0.0, [1.0, 0.5, 0.2])], vec![(at - half, 0.0), (at, 0.9), (at + half, 0.0)])?;
        let volume = filled(grid()?, |[x, ..]| most * x)?;
        let scene = scene(spike, camera()?, slices)?.with_opacity_unit(0.01)?.with_method(method)?;
        judge("spikes", format!("a spike of width {} in values from 0 to {most}: {said}", 2.0 * half), volume, scene, bound)?;
    }
    Ok(rows)
}
