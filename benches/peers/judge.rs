//! What a picture is held against.

use super::case::Case;
use slicestack::reference::metrics::{Displayed, difference};
use slicestack::reference::{ReferenceImage, Region, image};
use std::error::Error;

/// Every so many columns and rows are compared: errors are of a quarter of the pixels, times of all of them.
pub(crate) const STEP: u32 = 2;

/// The reference on the compared pixels.
pub(crate) struct Judge {
    reference: ReferenceImage,
    shown: Displayed,
}

impl Judge {
    pub(crate) fn new(case: &Case) -> Result<Self, Box<dyn Error>> {
        let reference = image(&case.scene, &case.volume, Region::every(&case.scene, STEP))?;
        let shown = Displayed::over_black(reference.size().0, reference.pixels())?;
        Ok(Self { reference, shown })
    }

    /// The RMS error of red, green and blue over black, of a whole picture `width` pixels wide, row 0 on top.
    pub(crate) fn error(&self, width: u32, pixels: &[[f32; 4]]) -> Result<f64, Box<dyn Error>> {
        let at = |i: usize| {
            let (x, y) = self.reference.place(i);
            pixels[(y * width + x) as usize]
        };
        let compared: Vec<[f32; 4]> = (0..self.reference.pixels().len()).map(at).collect();
        Ok(difference(&self.shown, &Displayed::over_black(self.reference.size().0, &compared)?)?.rms)
    }
}
