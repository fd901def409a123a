//! Colours that are multiplied by their alpha, and colours that are not: two types, so that one is never taken for the other.

/// A colour as people write it: components in `[0,1]`, alpha beside them, not multiplied in.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Straight {
    /// Red, green, blue, each in `[0,1]`.
    pub rgb: [f64; 3],
    /// Opacity in `[0,1]`.
    pub alpha: f64,
}

impl Straight {
    /// The same colour with alpha multiplied into its components.
    pub fn premultiply(self) -> Premultiplied {
        Premultiplied { rgb: self.rgb.map(|c| c * self.alpha), alpha: self.alpha }
    }
}

/// A colour ready for blending with "over": components already carry alpha.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Premultiplied {
    /// Red, green, blue times alpha.
    pub rgb: [f64; 3],
    /// Opacity in `[0,1]`.
    pub alpha: f64,
}
