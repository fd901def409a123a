//! Pictures of differences.

use super::{check, differences, displayed};
use crate::reference::metrics;
use crate::scene::{ColorMap, TransferFunction};
use crate::{Picture, Result};

/// What the colours of [`difference_map`] mean, in words.
pub const DIFFERENCE_SCALE: &str = "black: equal; violet: differs by 1/1024 or less; then lighter with every doubling, through red and orange, to pale yellow: by 1 or more";

/// Differences up to this have the darkest colour that is not black.
const FAINTEST: f64 = 1.0 / 1024.0;
/// Where on the colour map that colour is.
const DARKEST: f64 = 0.3;

/// The largest difference of the components at each pixel in colours that show the faintest: see [`DIFFERENCE_SCALE`]. Colour map: inferno,
/// logarithmic.
///
/// # Errors
/// [`crate::Error::Invalid`] when the sizes differ or a component is NaN.
pub fn difference_map(a: &Picture, b: &Picture) -> Result<Picture> {
    check(a, b)?;
    let place = |most: f64| {
        let doublings = libm::log2(most / FAINTEST) / libm::log2(1.0 / FAINTEST);
        DARKEST + (1.0 - DARKEST) * doublings.clamp(0.0, 1.0)
    };
    let largest = a.pixels().iter().zip(b.pixels()).map(|(x, y)| differences(x, y).into_iter().fold(0.0, f64::max));
    colored(ColorMap::Inferno, largest.map(|most| if most > 0.0 { place(most) } else { 0.0 }), a)
}

/// The FLIP map of two pictures: 0 black, 1 pale yellow. Colour map: magma, linear, as the authors' own tool shows it.
///
/// # Errors
/// As [`super::Comparison::at`].
pub fn flip_map(a: &Picture, b: &Picture, pixels_per_degree: f64) -> Result<Picture> {
    check(a, b)?;
    let map = metrics::flip_map(&displayed(a)?, &displayed(b)?, pixels_per_degree)?;
    colored(ColorMap::Magma, map.into_iter(), a)
}

/// An opaque picture as large as `like` of numbers from 0 to 1.
fn colored(map: ColorMap, numbers: impl Iterator<Item = f64>, like: &Picture) -> Result<Picture> {
    let map = TransferFunction::new(map.spread(0.0, 1.0), vec![(0.0, 1.0)])?;
    let pixel = |x: f64| {
        let [r, g, b] = if x > 0.0 { map.eval(x).rgb } else { [0.0; 3] };
        [r as f32, g as f32, b as f32, 1.0]
    };
    Picture::from_pixels(like.width(), like.height(), numbers.map(pixel).collect())
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test fails by panicking")]
    use super::*;

    #[test]
    fn one_step_of_255_shows_and_more_shows_more() {
        let row = |offs: [f32; 5]| Picture::from_pixels(5, 1, offs.map(|x| [x, 0.0, 0.0, 1.0]).into()).unwrap();
        let map = difference_map(&row([0.0; 5]), &row([0.0, 1e-9, 1.0 / 255.0, 0.1, 2.0])).unwrap();
        let light = |x: u32| map.pixel(x, 0)[..3].iter().sum::<f32>();
        assert_eq!(map.pixel(0, 0), [0.0, 0.0, 0.0, 1.0]);
        // Well above the least that a screen shows.
        assert!(light(1) > 0.5 && light(2) > 0.7 && light(1) < light(2), "{} {}", light(1), light(2));
        assert!(light(2) < light(3) && light(3) < light(4) && light(4) > 2.0);
        let black = flip_map(&row([0.3; 5]), &row([0.3; 5]), 67.0).unwrap();
        assert!(black.pixels().iter().all(|p| *p == [0.0, 0.0, 0.0, 1.0]));
    }
}
