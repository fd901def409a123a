//! Uniform media from nothing to opaque, and media that jump.

use super::Row;
use super::look::{Bench, Bound, Case, constant, filled, looking, number, scene};
use crate::scene::{Classification, Method, Projection, Target, TransferFunction};
use crate::volume::{BoxConvention, Grid};
use crate::{Result, Scene, Volume};
use glam::DVec3;
use std::f64::consts::LN_2;

/// Optical depths of one slab.
const DEPTHS: [f64; 18] = [0.0, 1e-12, 1e-9, 1e-6, 1e-4, 1e-2, 0.1, 0.5, 1.0, 1.5, 2.0, 5.0, 20.0, 100.0, 1e3, 1e6, 1e9, 1e12];
const SLICES: u64 = 16;
/// Reference length of the rows on opacities.
const UNIT: f64 = 0.7;
/// Voxels along each side, one world unit apart.
const SIDE: usize = 8;

/// A uniform cube of [`SIDE`] units.
pub(super) fn cube() -> Result<Volume> {
    filled(Grid::with_spacing([SIDE; 3], [1.0; 3])?, |_| 0.0)
}

/// The cube in `slices` slices of optical depth `depth` each, seen along an axis.
pub(super) fn uniform(depth: f64, slices: u64) -> Result<Scene> {
    let camera = looking(DVec3::new(3.5, 3.5, 40.0), DVec3::splat(3.5), DVec3::Y, Projection::Orthographic { height: Some(6.0) })?;
    let plain = scene(constant(if depth == 0.0 { 0.0 } else { 0.5 })?, camera, slices)?;
    if depth == 0.0 {
        return Ok(plain);
    }
    // Opacity 1/2 over L0: kappa = ln 2 / L0.
    plain.with_opacity_unit(LN_2 * SIDE as f64 / slices as f64 / depth)
}

pub(super) fn rows(bench: &Bench<'_>) -> Result<Vec<Row>> {
    let mut rows = Vec::new();
    let methods = [
        ("midpoint", Method::default(), Bound::Absolute(2e-6)),
        ("pre-integrated", Method { classification: Classification::PreIntegrated, ..Method::default() }, Bound::Absolute(2e-6)),
        ("second-order", Method { classification: Classification::SecondOrder, ..Method::default() }, Bound::Absolute(2e-6)),
        ("unorm8", Method { target: Target::Unorm8, ..Method::default() }, Bound::None),
    ];
    for (name, method, bound) in methods {
        for depth in DEPTHS {
            let scene = uniform(depth, SLICES)?.with_method(method)?;
            let case = format!("{name}, kappa D = {}", number(depth));
            rows.push(bench.judge(Case { group: "stiffness", case, volume: cube()?, scene, bound })?);
        }
        let scene = uniform(1.0, SLICES)?.with_transfer(constant(1.0)?).with_method(method)?;
        rows.push(bench.judge(Case { group: "stiffness", case: format!("{name}, opacity exactly 1"), volume: cube()?, scene, bound })?);
    }
    // Thin media are weak, not gone: what light they give is right in proportion.
    for depth in [1e-12, 1e-9, 1e-6] {
        let scene = uniform(depth, SLICES)?;
        let case = format!("midpoint, kappa D = {}: colours in proportion", number(depth));
        rows.push(bench.judge(Case {
            group: "stiffness",
            case,
            volume: cube()?,
            scene,
            bound: Bound::Part { part: 1e-5, depth: SLICES as f64 * depth },
        })?);
    }
    for (said, opacity) in [("1 - 2^-24", 1.0 - libm::exp2(-24.0)), ("1 - 2^-53", 1.0 - libm::exp2(-53.0)), ("2^-24", libm::exp2(-24.0))] {
        rows.push(bench.judge(of_opacity(said, opacity, Bound::Absolute(2e-6))?)?);
    }
    for (said, opacity) in [("1e-30", 1e-30), ("1e-40, subnormal in f32", 1e-40), ("1e-310, subnormal in f64", 1e-310)] {
        // Below the least normal f32 (1.2e-38) nothing is left of proportion: such light is 30 orders below what is seen.
        let depth = -libm::log1p(-opacity) * SIDE as f64 / UNIT;
        let bound = if opacity > 1e-37 { Bound::Part { part: 1e-5, depth } } else { Bound::Absolute(1e-38) };
        rows.push(bench.judge(of_opacity(said, opacity, bound)?)?);
    }
    rows.extend(jumps(bench)?);
    Ok(rows)
}

fn of_opacity(said: &str, opacity: f64, bound: Bound) -> Result<Case> {
    let scene = uniform(1.0, SLICES)?.with_transfer(constant(opacity)?).with_opacity_unit(UNIT)?;
    Ok(Case { group: "opacity", case: format!("opacity {said}"), volume: cube()?, scene, bound })
}

/// Extinction that grows a billionfold within one cell.
fn jumps(bench: &Bench<'_>) -> Result<Vec<Row>> {
    let mut rows = Vec::new();
    // Values 0 and 1 on both sides of one cell; extinction from k to 1e9 k.
    let volume =
        || filled(Grid::with_spacing([16; 3], [1.0; 3])?.with_convention(BoxConvention::Nodes), |[x, ..]| f64::from(u8::from(x > 0.5)));
    let center = DVec3::splat(7.5);
    for (said, thick, slices, bound) in [
        ("6.9e-10 to 0.69", 0.5, 480, Bound::Absolute(2e-3)),
        ("6.9e-8 to 69", 1.0 - libm::exp2(-100.0), 480, Bound::None),
        ("7e-10 to 0.7, whole range in one cell, 15 slices", 0.5, 15, Bound::None),
    ] {
        let kappa = if thick == 0.5 { LN_2 } else { 100.0 * LN_2 };
        let thin = -libm::expm1(-kappa * 1e-9);
        // An opacity so near 1 is 1 in f64: 1 - 2^-53 is the most below it.
        let transfer =
            TransferFunction::new(vec![(0.0, [0.2, 0.5, 1.0])], vec![(0.0, thin), (1.0, f64::min(thick, 1.0 - libm::exp2(-53.0)))])?;
        for (way, from) in [("into the thick", DVec3::new(-30.0, 3.0, 2.0)), ("out of it", DVec3::new(30.0, 3.0, 2.0))] {
            let camera = looking(center + from, center, DVec3::Z, Projection::Orthographic { height: Some(6.0) })?;
            let scene = scene(transfer.clone(), camera, slices)?;
            rows.push(bench.judge(Case {
                group: "jumps",
                case: format!("kappa {said} in one cell, {way}"),
                volume: volume()?,
                scene,
                bound,
            })?);
        }
    }
    Ok(rows)
}
