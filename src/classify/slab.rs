//! What a slab of the volume is, and its colour and opacity at one value.

use crate::scene::{DEEPEST, SlabForm, Straight, TransferFunction};

/// What a slab is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Slab {
    /// Its thickness in reference lengths.
    pub(crate) ratio: f64,
    /// What becomes of its extinction.
    pub(crate) form: SlabForm,
    /// What a table says of it.
    pub(crate) measure: Measure,
    /// How fine a table may be.
    pub(crate) detail: Detail,
}

/// How fine a table may be.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Detail {
    /// As fine as pictures need, up to a limit.
    Usual,
    /// Finer where that limit leaves a table that does not follow the transfer function: for pictures that tell the error of others.
    Finer,
}

/// What a table says of slabs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Measure {
    /// Opacity, and colour times opacity.
    Opacity,
    /// Optical depth, and colour times that: where opacity depends on more than the value, and so is made of it later.
    OpticalDepth,
    /// Thinness 1 / (1 + optical depth) in the place of opacity, and no colour: 1 of nothing, 0 of an opacity of 1, which is infinitely deep.
    /// It keeps the digits of depths whose opacity rounds to 1, and stays finite between such and infinity.
    Thinness,
}

/// Thinness of a slab of optical depth `depth`.
pub(super) fn thinness(depth: f64) -> f64 {
    1.0 / (1.0 + depth)
}

/// What a table says of a slab at a value: premultiplied colour and opacity 1 - (1 - a)^ratio; for Riemann's form, and as optical depth,
/// -ln(1 - a) ratio; or its thinness.
pub(crate) fn color(transfer: &TransferFunction, value: f64, slab: Slab) -> [f64; 4] {
    of_straight(transfer.eval(value), slab)
}

/// The same of a straight colour and an opacity per reference length.
pub(crate) fn of_straight(straight: Straight, slab: Slab) -> [f64; 4] {
    if slab.measure == Measure::Thinness {
        let depth = if straight.alpha >= 1.0 { f64::INFINITY } else { -slab.ratio * libm::log1p(-straight.alpha) };
        return [0.0, 0.0, 0.0, thinness(depth)];
    }
    let alpha = match slab.form {
        _ if slab.measure == Measure::OpticalDepth => {
            // An opacity of 1 is infinitely deep in a slab of any thickness.
            if straight.alpha >= 1.0 { DEEPEST } else { (-slab.ratio * libm::log1p(-straight.alpha)).min(DEEPEST) }
        }
        SlabForm::Exponential if straight.alpha >= 1.0 => 1.0,
        SlabForm::Exponential => -libm::expm1(slab.ratio * libm::log1p(-straight.alpha)),
        // Opacity 1 has no finite extinction; the largest below it has.
        SlabForm::Riemann => -slab.ratio * libm::log1p(-straight.alpha.min(1.0 - f64::EPSILON / 2.0)),
    };
    let [r, g, b] = straight.rgb.map(|c| c * alpha);
    [r, g, b, alpha]
}

/// What is seen of a table's entry: premultiplied colour and opacity; of one of optical depth, over a `share` of the slab.
pub(super) fn seen([r, g, b, depth]: [f64; 4], measure: Measure, share: f64) -> [f64; 4] {
    if measure != Measure::OpticalDepth || depth == 0.0 {
        return [r, g, b, depth];
    }
    let alpha = -libm::expm1(-depth * share);
    let by = alpha / depth;
    [r * by, g * by, b * by, alpha]
}
