//! The pictures of a report: what it should be, what it is, where they differ.

use crate::Result;
use crate::picture::png::rgb8;
use crate::reference::metrics::Displayed;
use crate::scene::{ColorMap, TransferFunction};

/// Displayed colours as a PNG file of 8 bits.
pub(super) fn png(picture: &Displayed) -> Result<Vec<u8>> {
    let (width, height) = picture.size();
    let bytes: Vec<u8> = picture.rgb().iter().flatten().map(|c| (c * 255.0 + 0.5) as u8).collect();
    rgb8(width as u32, height as u32, &bytes)
}

/// The largest difference of the components at each pixel, black at 0, white at `most` and above.
pub(super) fn difference(a: &Displayed, b: &Displayed, most: f64) -> Result<Displayed> {
    let map = TransferFunction::new(ColorMap::Inferno.spread(0.0, 1.0), vec![(0.0, 1.0)])?;
    let pixel = |(x, y): (&[f64; 3], &[f64; 3])| {
        let off = (0..3).map(|c| (x[c] - y[c]).abs()).fold(0.0, f64::max);
        let [r, g, b] = map.eval((off / most).min(1.0)).rgb;
        [r, g, b, 1.0]
    };
    let pixels: Vec<[f64; 4]> = a.rgb().iter().zip(b.rgb()).map(pixel).collect();
    Displayed::over_black(a.size().0, &pixels)
}
