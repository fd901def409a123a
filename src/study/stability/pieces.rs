//! Pieces of slabs far thinner than the slab, which may be so deep that its opacity rounds to 1.

use super::Row;
use super::look::{Bench, COLOR, Descent, looking, number};
use super::stiff::{cube, uniform};
use crate::Result;
use crate::reference::closed::{constant_color, opacity};
use crate::scene::{Classification, ClipPlane, Method, Order, Projection};
use glam::DVec3;

/// Optical depths of a slab.
const DEPTHS: [f64; 7] = [1.0, 10.0, 100.0, 1e3, 1e6, 1e9, 1e12];
/// Lengths of the pieces, in slabs.
const PIECES: [f64; 7] = [1e-6, 1e-5, 1e-3, 0.02, 0.1, 0.5, 1.0];
const SLICES: u64 = 16;
/// Thickness of a slab, world units.
const SLAB: f64 = 0.5;
/// Where the pieces begin, world units: within a slab.
const FROM: f64 = 3.0;
const BOUND: f64 = 1e-6;

pub(super) fn rows(bench: &Bench<'_>) -> Result<Vec<Row>> {
    let mut rows = Vec::new();
    for (name, classification) in [
        ("midpoint", Classification::Post),
        ("pre-classified", Classification::Pre),
        ("pre-integrated", Classification::PreIntegrated),
        ("second-order", Classification::SecondOrder),
    ] {
        for depth in DEPTHS {
            rows.push(row(bench, name, classification, depth)?);
        }
    }
    Ok(rows)
}

/// Pieces of all lengths of a slab of optical depth `depth`, both ways of blending.
fn row(bench: &Bench<'_>, name: &str, classification: Classification, depth: f64) -> Result<Row> {
    let mut renderer = bench.renderer(&cube()?);
    let center = DVec3::splat(3.5);
    let camera = looking(center.with_z(40.0), center, DVec3::Y, Projection::Orthographic { height: Some(6.0) })?;
    let scene = uniform(depth, SLICES)?.with_camera(camera).with_size(8, 8)?.with_method(Method { classification, ..Method::default() })?;
    let (mut worst, mut at, mut broken) = (0.0, 0.0, 0);
    for piece in PIECES {
        let planes = vec![ClipPlane::new(DVec3::Z, FROM)?, ClipPlane::new(DVec3::NEG_Z, -(FROM + piece * SLAB))?];
        // What the two planes leave in f64.
        let all = depth * ((FROM + piece * SLAB) - FROM) / SLAB;
        let want = [constant_color(COLOR[0], all), constant_color(COLOR[1], all), constant_color(COLOR[2], all), opacity(all)];
        for order in [Order::FrontToBack, Order::BackToFront] {
            let scene = scene.clone().with_clip_planes(planes.clone())?.with_order(order);
            let (picture, _, descent) = renderer.render_observed(&scene, Descent::default())?;
            broken += descent.broken;
            let off = picture.pixels().iter().flat_map(|p| (0..4).map(|c| (f64::from(p[c]) - want[c]).abs()));
            let error = off.fold(0.0, |most: f64, d| if d.is_nan() { f64::INFINITY } else { most.max(d) });
            if error > worst {
                (worst, at) = (error, piece);
            }
        }
    }
    let risen = if broken == 0 { "" } else { ", transmittance rises" };
    Ok(Row {
        group: "pieces of slabs".into(),
        case: format!("{name}, kappa D = {}, pieces of 1e-6 to 1 slab", number(depth)),
        promise: format!("error <= {BOUND:.0e} of 1 - exp(-kappa l), transmittance never rises"),
        measured: format!("error {worst:.1e} at {} slabs{risen}", number(at)),
        error: Some(worst),
        bound: Some(BOUND),
        holds: worst <= BOUND && broken == 0,
    })
}
