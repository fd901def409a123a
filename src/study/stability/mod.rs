//! What is promised in extreme cases, and what was measured: small pictures, each checked against the reference in f64.
//!
//! Every picture is watched while it is made: no pixel's transmittance may rise from slice to slice, leave `[0,1]` or be NaN.

mod counts;
mod lights;
mod look;
mod pieces;
mod places;
mod riemann;
mod stiff;
mod values;

use super::clock::Clock;
use crate::{Result, Settings};
use serde::Serialize;

/// One extreme case.
#[derive(Debug, Clone, Serialize)]
#[non_exhaustive]
pub struct Row {
    /// What kind of extreme.
    pub group: String,
    /// The case.
    pub case: String,
    /// What is promised.
    pub promise: String,
    /// What was measured.
    pub measured: String,
    /// The largest error, where one is bounded.
    pub error: Option<f64>,
    /// Its bound.
    pub bound: Option<f64>,
    /// Whether the promise holds.
    pub holds: bool,
}

/// A uniform medium in very many slices.
#[derive(Debug, Clone, Serialize)]
#[non_exhaustive]
pub struct CountPoint {
    /// How sums are kept: `f32`, `plain f32`, `8 bits`.
    pub target: String,
    /// Opacity of the whole medium.
    pub opacity: f64,
    /// Slices.
    pub slices: u64,
    /// Error of the picture's opacity and colours, the largest.
    pub error: f64,
    /// The same as a part of the component, the largest.
    pub part: f64,
    /// What theory says of it: a bound for floats, the error itself for 8 bits.
    pub predicted: f64,
    /// Seconds of the frame.
    pub seconds: f64,
}

/// What a stack of slabs leaves of the light behind it.
#[derive(Debug, Clone, Serialize)]
#[non_exhaustive]
pub struct RiemannPoint {
    /// Optical depth of a slab, kappa D.
    pub slab_depth: f64,
    /// Slabs.
    pub slices: u64,
    /// Transmittance by opacity kappa D a slab, as rendered.
    pub riemann: f64,
    /// Transmittance by opacity 1 - exp(-kappa D) a slab, as rendered.
    pub exponential: f64,
    /// (1 - kappa D)^slices.
    pub predicted: f64,
}

/// All of it.
#[derive(Debug, Clone, Serialize)]
#[non_exhaustive]
pub struct Stability {
    /// The cases.
    pub rows: Vec<Row>,
    /// Uniform media in many slices.
    pub counts: Vec<CountPoint>,
    /// Explicit Euler steps and exponential ones.
    pub riemann: Vec<RiemannPoint>,
    /// Optical depth of a slab from which Riemann's transmittance was seen negative.
    pub negative_from: Option<f64>,
    /// Optical depth of a slab from which Riemann's transmittance was seen to grow from slab to slab.
    pub divergent_from: Option<f64>,
    /// Seconds it took.
    pub seconds: f64,
    /// Version of the program.
    pub version: String,
}

impl Stability {
    /// Rows whose promise does not hold.
    pub fn broken(&self) -> impl Iterator<Item = &Row> {
        self.rows.iter().filter(|r| !r.holds)
    }
}

/// Seconds that the rows take, about: what progress is told by.
const SECONDS: f64 = 14.0;

/// Renders every extreme case and says what holds.
///
/// # Errors
/// [`crate::Error::Stopped`] when progress said so. A case that cannot be rendered at all is a row that does not hold.
pub fn stability(settings: &Settings) -> Result<Stability> {
    let clock = Clock::new(SECONDS, settings.progress.clone());
    let settings = Settings { progress: clock.progress(), ..settings.clone() };
    let bench = look::Bench::new(&settings);
    let mut rows = Vec::new();
    clock.now("stiff media")?;
    rows.extend(stiff::rows(&bench)?);
    clock.now("pieces of slabs")?;
    rows.extend(pieces::rows(&bench)?);
    clock.now("many slices")?;
    let (more, counts) = counts::rows(&bench)?;
    rows.extend(more);
    clock.now("explicit Euler")?;
    let euler = riemann::measure(&bench)?;
    rows.extend(euler.rows);
    clock.now("extreme values")?;
    rows.extend(values::rows(&bench)?);
    clock.now("extreme places")?;
    rows.extend(places::rows(&bench)?);
    clock.now("extreme lights")?;
    rows.extend(lights::rows(&bench)?);
    Ok(Stability {
        rows,
        counts,
        riemann: euler.points,
        negative_from: euler.negative_from,
        divergent_from: euler.divergent_from,
        seconds: clock.gone(),
        version: env!("CARGO_PKG_VERSION").into(),
    })
}
