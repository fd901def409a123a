//! Planes: numbers beside a picture's colours, one or three a pixel, in f32.

#[cfg(feature = "encoders")]
use super::npy;
#[cfg(feature = "encoders")]
use crate::{Error, Result};

/// What a plane holds of each pixel. Where a ray ends up is the first surface that it meets where level surfaces are drawn; where slabs are
/// blended over one another it is the place at which their opacity together first passes a half.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum Aov {
    /// Distance of that place from the eye along the view direction, world units; +infinity where there is none.
    Depth,
    /// Direction against the gradient of the values there (from dense to thin), world space, of length 1; 0 where there is none.
    Normal,
    /// The value there, data units: of a surface its level; NaN where there is none.
    Value,
    /// Opacity of the volume, 0 to 1, whatever is behind it.
    Alpha,
}

impl Aov {
    /// All of them.
    pub const ALL: [Self; 4] = [Self::Depth, Self::Normal, Self::Value, Self::Alpha];

    /// Its name.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Depth => "depth",
            Self::Normal => "normal",
            Self::Value => "value",
            Self::Alpha => "alpha",
        }
    }

    /// Numbers a pixel: 3 of a normal (x, y, z), else 1.
    pub const fn channels(self) -> usize {
        if matches!(self, Self::Normal) { 3 } else { 1 }
    }

    /// Names of the channels in an OpenEXR file, in the order of the alphabet that such files keep, each with its place among the numbers of a
    /// pixel. Normals are red, green and blue, so that any viewer shows them.
    #[cfg(feature = "encoders")]
    const fn exr_channels(self) -> &'static [(&'static str, usize)] {
        match self {
            Self::Depth => &[("Z", 0)],
            Self::Normal => &[("B", 2), ("G", 1), ("R", 0)],
            Self::Value => &[("Y", 0)],
            Self::Alpha => &[("A", 0)],
        }
    }
}

/// A file of a plane.
#[cfg(feature = "encoders")]
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[non_exhaustive]
pub enum PlaneFormat {
    /// A NumPy array of height x width, or height x width x 3, in little-endian f32, row 0 on top.
    #[default]
    Npy,
    /// OpenEXR without compression: channel Z of a depth, R G B of a normal, Y of a value, A of an opacity.
    Exr,
}

#[cfg(feature = "encoders")]
impl PlaneFormat {
    /// Its extension, without a dot.
    pub const fn extension(self) -> &'static str {
        match self {
            Self::Npy => "npy",
            Self::Exr => "exr",
        }
    }
}

/// One or three numbers for each pixel of a picture.
///
/// # Guarantees
/// There are `width * height * channels` numbers, pixel by pixel and row by row from the top.
#[derive(Debug, Clone, PartialEq)]
pub struct Plane {
    aov: Aov,
    width: u32,
    height: u32,
    numbers: Vec<f32>,
}

/// The attribute by which an OpenEXR file of a plane is told from others.
#[cfg(feature = "encoders")]
const ATTRIBUTE: &str = "slicestack.plane";

impl Plane {
    pub(crate) fn new(aov: Aov, width: u32, height: u32, numbers: Vec<f32>) -> Self {
        debug_assert_eq!(numbers.len(), width as usize * height as usize * aov.channels());
        Self { aov, width, height, numbers }
    }

    /// What it holds.
    pub fn aov(&self) -> Aov {
        self.aov
    }

    /// Width and height in pixels.
    pub fn size(&self) -> (u32, u32) {
        (self.width, self.height)
    }

    /// All numbers, pixel by pixel and row by row from the top.
    pub fn numbers(&self) -> &[f32] {
        &self.numbers
    }

    /// The numbers of the pixel in column `x` and row `y`.
    ///
    /// # Panics
    /// When there is no such pixel.
    pub fn pixel(&self, x: u32, y: u32) -> &[f32] {
        assert!(x < self.width && y < self.height, "pixel {x},{y} outside {} x {}", self.width, self.height);
        let channels = self.aov.channels();
        &self.numbers[(y as usize * self.width as usize + x as usize) * channels..][..channels]
    }

    /// The plane as the bytes of a file.
    ///
    /// # Errors
    /// [`Error::Limit`] when a row is longer than OpenEXR can count.
    #[cfg(feature = "encoders")]
    pub fn encode(&self, format: PlaneFormat) -> Result<Vec<u8>> {
        match format {
            PlaneFormat::Npy => {
                let shape = match self.aov.channels() {
                    1 => format!("({}, {})", self.height, self.width),
                    n => format!("({}, {}, {n})", self.height, self.width),
                };
                Ok(npy::array(&shape, &self.numbers))
            }
            PlaneFormat::Exr => self.exr(),
        }
    }

    /// Whether a file that begins with `start` is an OpenEXR file of a plane.
    #[cfg(feature = "encoders")]
    pub fn is_exr(start: &[u8]) -> bool {
        start.starts_with(&EXR_MAGIC) && start.windows(ATTRIBUTE.len()).any(|w| w == ATTRIBUTE.as_bytes())
    }

    /// Layout: <https://openexr.com/en/latest/OpenEXRFileLayout.html>.
    #[cfg(feature = "encoders")]
    fn exr(&self) -> Result<Vec<u8>> {
        let (width, height, channels) = (self.width as usize, self.height as usize, self.aov.channels());
        let row_bytes = 4 * width * channels;
        if i32::try_from(row_bytes).is_err() || i32::try_from(height).is_err() {
            return Err(Error::Limit { what: "OpenEXR: bytes of a row".into(), needed: row_bytes as u128, limit: i32::MAX as u128 });
        }
        let mut out = EXR_MAGIC.to_vec();
        out.extend(2u32.to_le_bytes());
        let mut attribute = |name: &str, kind: &str, value: &[u8]| {
            for text in [name, kind] {
                out.extend(text.as_bytes());
                out.push(0);
            }
            out.extend((value.len() as u32).to_le_bytes());
            out.extend(value);
        };
        let mut list = Vec::new();
        for (name, _) in self.aov.exr_channels() {
            list.extend(name.as_bytes());
            list.push(0);
            // f32; not perceptual; every column and row.
            [2u32, 0, 1, 1].iter().for_each(|n| list.extend(n.to_le_bytes()));
        }
        list.push(0);
        let window: Vec<u8> = [0, 0, self.width - 1, self.height - 1].iter().flat_map(|n| n.to_le_bytes()).collect();
        attribute("channels", "chlist", &list);
        attribute("compression", "compression", &[0]);
        attribute("dataWindow", "box2i", &window);
        attribute("displayWindow", "box2i", &window);
        attribute("lineOrder", "lineOrder", &[0]);
        attribute("pixelAspectRatio", "float", &1f32.to_le_bytes());
        attribute("screenWindowCenter", "v2f", &[0; 8]);
        attribute("screenWindowWidth", "float", &1f32.to_le_bytes());
        attribute(ATTRIBUTE, "string", self.aov.name().as_bytes());
        out.push(0);
        let start = out.len() + 8 * height;
        (0..height).for_each(|y| out.extend(((start + y * (8 + row_bytes)) as u64).to_le_bytes()));
        for (y, row) in self.numbers.chunks(width * channels).enumerate() {
            out.extend((y as u32).to_le_bytes());
            out.extend((row_bytes as u32).to_le_bytes());
            for (_, channel) in self.aov.exr_channels() {
                out.extend(row.iter().skip(*channel).step_by(channels).flat_map(|x| x.to_le_bytes()));
            }
        }
        Ok(out)
    }
}

#[cfg(feature = "encoders")]
const EXR_MAGIC: [u8; 4] = [0x76, 0x2f, 0x31, 0x01];
