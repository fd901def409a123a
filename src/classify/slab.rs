//! What a slab of the volume is, and its colour and opacity at one value.

use crate::scene::{SlabForm, TransferFunction};

/// What a slab is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Slab {
    /// Its thickness in reference lengths.
    pub(crate) ratio: f64,
    /// What becomes of its extinction.
    pub(crate) form: SlabForm,
}

/// Slab colour and opacity at a value: premultiplied, 1 - (1 - a)^ratio; for Riemann's form -ln(1 - a) ratio.
pub(crate) fn color(transfer: &TransferFunction, value: f64, slab: Slab) -> [f64; 4] {
    let straight = transfer.eval(value);
    let alpha = match slab.form {
        SlabForm::Exponential if straight.alpha >= 1.0 => 1.0,
        SlabForm::Exponential => -libm::expm1(slab.ratio * libm::log1p(-straight.alpha)),
        // Opacity 1 has no finite extinction; the largest below it has.
        SlabForm::Riemann => -slab.ratio * libm::log1p(-straight.alpha.min(1.0 - f64::EPSILON / 2.0)),
    };
    let [r, g, b] = straight.rgb.map(|c| c * alpha);
    [r, g, b, alpha]
}
