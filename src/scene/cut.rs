//! Opaque planes inside the picture that show the data on them: a multi-planar cut through the volume.

use super::linear_light::to_linear;
use super::{ColorMap, TransferFunction};
use crate::{Error, Result};
use glam::DVec3;

/// Most cut planes a scene may have.
pub const MAX_CUT_PLANES: usize = 6;

/// The plane normal . p = offset in world space, opaque where it lies in the box and on the kept side of every clip plane. What is behind it
/// on a ray is hidden; rays that pass it elsewhere go on as if it were not there. Its colour is the data's through a colour map: neither lit nor of any opacity.
/// Where the data is NaN or infinite the plane has a hole.
///
/// # Guarantees
/// The normal has length 1, all numbers are finite, and a window has a width above 0.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CutPlane {
    normal: DVec3,
    offset: f64,
    colors: ColorMap,
    window: Option<(f64, f64)>,
}

impl CutPlane {
    /// The plane normal . p = offset in world space, in grey from the least value of the data to its greatest.
    ///
    /// # Errors
    /// [`Error::Invalid`] for a zero normal or a number that is not finite.
    pub fn new(normal: DVec3, offset: f64) -> Result<Self> {
        let length = normal.length();
        if !(length > 0.0 && length.is_finite() && offset.is_finite()) {
            return Err(Error::invalid(format!(
                "cut plane with normal {normal}, offset {offset}: the normal must not be 0 and all numbers finite"
            )));
        }
        let (normal, offset) = if super::is_unit(length) { (normal, offset) } else { (normal / length, offset / length) };
        Ok(Self { normal, offset, colors: ColorMap::Gray, window: None })
    }

    /// The same plane in other colours.
    #[must_use]
    pub fn with_colors(mut self, colors: ColorMap) -> Self {
        self.colors = colors;
        self
    }

    /// The same plane with the first colour at `center` - `width` / 2 and the last at `center` + `width` / 2, data units; values beyond
    /// have the end's colour.
    ///
    /// # Errors
    /// [`Error::Invalid`] when a number is not finite, or the width is not positive or vanishes beside the centre.
    pub fn with_window(mut self, center: f64, width: f64) -> Result<Self> {
        let (low, high) = (center - 0.5 * width, center + 0.5 * width);
        if !(low.is_finite() && high.is_finite() && low < high) {
            return Err(Error::invalid(format!("cut window {center},{width}: centre and width must be finite, the width above 0")));
        }
        self.window = Some((center, width));
        Ok(self)
    }

    /// Unit normal.
    pub fn normal(&self) -> DVec3 {
        self.normal
    }

    /// Distance of the plane from the world's origin along the normal.
    pub fn offset(&self) -> f64 {
        self.offset
    }

    /// The colours.
    pub fn colors(&self) -> ColorMap {
        self.colors
    }

    /// Centre and width of the values that are told apart, data units; `None` where they are all of the data's.
    pub fn window(&self) -> Option<(f64, f64)> {
        self.window
    }

    /// The values of the first and the last colour, for data from `least` to `most`. Data of one value has a window one unit wide.
    pub(crate) fn values(&self, (least, most): (f64, f64)) -> (f64, f64) {
        match self.window {
            Some((center, width)) => (center - 0.5 * width, center + 0.5 * width),
            None if least < most && (most - least).is_finite() => (least, most),
            None if least.is_finite() && most.is_finite() && least >= most => {
                // Half a unit vanishes beside very large values.
                let half = 0.5f64.max(least.abs() * 1e-9);
                (least - half, least + half)
            }
            None => (0.0, 1.0),
        }
    }
}

/// The colours of a cut plane, ready to be looked up.
#[derive(Debug, Clone)]
pub(crate) struct CutColors {
    map: TransferFunction,
    /// Whether colours are amounts of light.
    light: bool,
}

impl CutColors {
    /// Those of `plane` over data of values from the first of `range` to the second; as amounts of `light`, or as the display's numbers.
    pub(crate) fn new(plane: &CutPlane, range: (f64, f64), light: bool) -> Result<Self> {
        let (low, high) = plane.values(range);
        Ok(Self { map: TransferFunction::new(plane.colors.spread(low, high), vec![(low, 1.0)])?, light })
    }

    /// The colour of `value`.
    pub(crate) fn at(&self, value: f64) -> [f64; 3] {
        let rgb = self.map.eval(value).rgb;
        if self.light { rgb.map(to_linear) } else { rgb }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn windows_are_the_datas_unless_they_are_given() {
        let plane = CutPlane::new(DVec3::new(0.0, 3.0, 4.0), 10.0).expect("a plane");
        assert_eq!((plane.normal(), plane.offset()), (DVec3::new(0.0, 0.6, 0.8), 2.0));
        assert_eq!(plane.values((-3.0, 9.0)), (-3.0, 9.0));
        assert_eq!(plane.values((7.0, 7.0)), (6.5, 7.5));
        assert_eq!(plane.values((f64::INFINITY, f64::NEG_INFINITY)), (0.0, 1.0));
        assert_eq!(plane.with_window(40.0, 400.0).expect("a window").values((-3.0, 9.0)), (-160.0, 240.0));
        assert!(plane.with_window(1e300, 1.0).is_err() && plane.with_window(0.0, -1.0).is_err());
        assert!(CutPlane::new(DVec3::ZERO, 1.0).is_err() && CutPlane::new(DVec3::X, f64::NAN).is_err());
    }

    #[test]
    fn colors_in_light_are_the_maps_own() {
        let plane = CutPlane::new(DVec3::X, 0.0).expect("a plane");
        let at = |light: bool| CutColors::new(&plane, (0.0, 10.0), light).expect("colours").at(5.0);
        // A half of grey is 21.4 % of the light (IEC 61966-2-1).
        assert!(at(false).iter().all(|c| (c - 0.5).abs() < 1e-12), "{:?}", at(false));
        assert!(at(true).iter().all(|c| (c - 0.214_041_14).abs() < 1e-8), "{:?}", at(true));
    }
}
