//! A finished picture: premultiplied RGBA in f32.

use sha2::{Digest, Sha256};

/// Largest side of a picture in pixels: sizes are checked before memory is taken.
pub const MAX_SIDE: u32 = 1 << 15;

/// A picture of `width` x `height` pixels, row 0 on top, premultiplied RGBA in f32.
#[derive(Debug, Clone, PartialEq)]
pub struct Picture {
    width: u32,
    height: u32,
    pixels: Vec<[f32; 4]>,
}

impl Picture {
    pub(crate) fn new(width: u32, height: u32, pixels: Vec<[f32; 4]>) -> Self {
        debug_assert_eq!(pixels.len(), width as usize * height as usize);
        Self { width, height, pixels }
    }

    /// A picture of pixels made elsewhere: row by row from the top, premultiplied RGBA.
    ///
    /// # Errors
    /// [`crate::Error::Invalid`] when there are not `width` x `height` of them, or none at all.
    pub fn from_pixels(width: u32, height: u32, pixels: Vec<[f32; 4]>) -> crate::Result<Self> {
        if pixels.is_empty() || pixels.len() as u64 != u64::from(width) * u64::from(height) {
            return Err(crate::Error::invalid(format!("{} pixels given for a picture of {width} x {height}", pixels.len())));
        }
        Ok(Self::new(width, height, pixels))
    }

    /// Columns.
    pub fn width(&self) -> u32 {
        self.width
    }

    /// Rows.
    pub fn height(&self) -> u32 {
        self.height
    }

    /// All pixels, row by row from the top, premultiplied RGBA.
    pub fn pixels(&self) -> &[[f32; 4]] {
        &self.pixels
    }

    /// The pixel in column `x` of row `y`.
    ///
    /// # Panics
    /// When it is outside the picture.
    pub fn pixel(&self, x: u32, y: u32) -> [f32; 4] {
        assert!(x < self.width && y < self.height, "pixel {x},{y} outside {} x {}", self.width, self.height);
        self.pixels[y as usize * self.width as usize + x as usize]
    }

    /// SHA-256 of the pixels as little-endian f32, in hex: the same on every machine.
    pub fn sha256(&self) -> String {
        let mut hash = Sha256::new();
        let mut row = Vec::with_capacity(self.width as usize * 16);
        for pixels in self.pixels.chunks(self.width as usize) {
            row.clear();
            row.extend(pixels.iter().flatten().flat_map(|c| c.to_le_bytes()));
            hash.update(&row);
        }
        hash.finalize().iter().map(|b| format!("{b:02x}")).collect()
    }

    /// 8-bit straight-alpha RGBA, rounded to nearest: what a PNG holds.
    pub fn to_rgba8(&self) -> Vec<u8> {
        self.straight().flat_map(|c| c.map(|x| (x * 255.0 + 0.5) as u8)).collect()
    }

    /// 16-bit straight-alpha RGBA, rounded to nearest.
    pub fn to_rgba16(&self) -> Vec<u16> {
        self.straight().flat_map(|c| c.map(|x| (x * 65535.0 + 0.5) as u16)).collect()
    }

    /// Straight-alpha components, clamped to `[0,1]`.
    fn straight(&self) -> impl Iterator<Item = [f32; 4]> + '_ {
        self.pixels.iter().map(|&[r, g, b, a]| {
            let un = |c: f32| if a > 0.0 { (c / a).clamp(0.0, 1.0) } else { 0.0 };
            [un(r), un(g), un(b), a.clamp(0.0, 1.0)]
        })
    }
}
