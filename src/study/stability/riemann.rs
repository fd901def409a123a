//! Explicit Euler steps (opacity kappa D) beside exponential ones: where the first turn negative and where they grow.

use super::look::{Bench, number};
use super::stiff::{cube, uniform};
use super::{RiemannPoint, Row};
use crate::scene::{Method, SlabForm};
use crate::{Result, Volume};

/// Slabs: an odd number shows the sign.
const SLICES: u64 = 15;

/// What was seen.
pub(super) struct Euler {
    pub(super) rows: Vec<Row>,
    pub(super) points: Vec<RiemannPoint>,
    pub(super) negative_from: Option<f64>,
    pub(super) divergent_from: Option<f64>,
}

/// Renders a uniform medium both ways, slab by slab thicker.
pub(super) fn measure(bench: &Bench<'_>) -> Result<Euler> {
    let volume = cube()?;
    let fine = (1..=60).map(|i| f64::from(i) * 0.05);
    let depths: Vec<f64> = fine.chain([4.0, 6.0, 10.0, 30.0, 100.0, 1e3, 1e6]).collect();
    let riemann = Method { slab: SlabForm::Riemann, ..Method::default() };
    let mut points = Vec::new();
    for depth in depths {
        points.push(RiemannPoint {
            slab_depth: depth,
            slices: SLICES,
            riemann: left(bench, &volume, depth, riemann)?,
            exponential: left(bench, &volume, depth, Method::default())?,
            predicted: libm::pow(1.0 - depth, SLICES as f64),
        });
    }
    // In f32, and 1 - opacity is what a picture tells.
    let first = |wanted: &dyn Fn(&RiemannPoint) -> bool| points.iter().find(|p| wanted(p)).map(|p| p.slab_depth);
    let negative_from = first(&|p| p.riemann < -1e-6);
    let divergent_from = first(&|p| p.riemann.abs() > 1.0 + 1e-3);
    let tame = points.iter().all(|p| (0.0..=1.0).contains(&p.exponential));
    let within = |x: Option<f64>, from: f64, to: f64| x.is_some_and(|x| x > from && x <= to);
    let close = points.iter().filter(|p| p.slab_depth <= 3.0).all(|p| (p.riemann - p.predicted).abs() <= 1e-5 * p.predicted.abs().max(1.0));
    let row = |case: &str, promise: &str, measured: String, holds: bool| Row {
        group: "explicit Euler".into(),
        case: case.into(),
        promise: promise.into(),
        measured,
        error: None,
        bound: None,
        holds,
    };
    let said = |x: Option<f64>| x.map_or("nowhere".into(), number);
    // (1 - kappa D)^15 is -1e-6 at kappa D = 1.4: f32 shows no less.
    let rows = vec![
        row(
            "riemann: negative weights",
            "transmittance below 0 past kappa D = 1 (by 1e-6 or more from 1.4 on)",
            format!("from kappa D = {} on", said(negative_from)),
            within(negative_from, 1.0, 1.5),
        ),
        row(
            "riemann: divergence",
            "transmittance grows past kappa D = 2",
            format!(
                "from kappa D = {} on; {:.1e} at 3",
                said(divergent_from),
                points.iter().find(|p| p.slab_depth > 2.99).map_or(0.0, |p| p.riemann)
            ),
            within(divergent_from, 2.0, 2.051),
        ),
        row(
            "riemann: as theory has it",
            "(1 - kappa D)^15 up to kappa D = 3, to 1e-5 of it",
            if close { "so".into() } else { "not so".into() },
            close,
        ),
        row(
            "exponential slabs at the same depths",
            "transmittance in [0,1] up to kappa D = 1e6",
            format!(
                "{} to {}",
                number(points.iter().map(|p| p.exponential).fold(1.0, f64::min)),
                number(points.iter().map(|p| p.exponential).fold(0.0, f64::max))
            ),
            tame,
        ),
    ];
    Ok(Euler { rows, points, negative_from, divergent_from })
}

/// What the medium leaves of the light behind it: the mean over the picture.
fn left(bench: &Bench<'_>, volume: &Volume, depth: f64, method: Method) -> Result<f64> {
    let scene = uniform(depth, SLICES)?.with_size(8, 8)?.with_method(method)?;
    let (picture, ..) = bench.render(volume, &scene)?;
    Ok(1.0 - f64::from(picture.pixel(4, 4)[3]))
}
