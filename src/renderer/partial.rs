//! Partial pictures: what parts of a volume leave in the pixels, before it is finished; and as bytes, on their way between machines.

use super::finish::OverBackground;
use super::layer::NOTHING;
use super::part::combined;
use super::rectangle::Rectangle;
use crate::picture::Picture;
use crate::raster::{Finish, Sums};
use crate::scene::{Blend, Scene};
use crate::{Error, Result};

/// What the pixels of a partial picture hold.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Kind {
    /// Premultiplied red, green, blue, and transmittance.
    Over,
    /// The largest value, minus infinity where there is none.
    Largest,
    /// The smallest value, minus infinity where there is none.
    Smallest,
    /// The sum of values times lengths, and that of the lengths.
    Mean,
    /// Sums of red, green, blue and opacity.
    Sum,
}

impl Kind {
    const ALL: [Self; 5] = [Self::Over, Self::Largest, Self::Smallest, Self::Mean, Self::Sum];

    /// Whether it holds values, which become colours at the end.
    pub(super) fn holds_values(self) -> bool {
        matches!(self, Self::Largest | Self::Smallest | Self::Mean)
    }

    /// Numbers a pixel that are not the same everywhere.
    fn channels(self) -> usize {
        match self {
            Self::Over | Self::Sum => 4,
            Self::Mean => 2,
            Self::Largest | Self::Smallest => 1,
        }
    }

    /// A pixel that has gathered nothing.
    fn nothing(self) -> [f32; 4] {
        match self {
            Self::Over => NOTHING,
            Self::Largest | Self::Smallest => [f32::NEG_INFINITY, 0.0, 0.0, 1.0],
            Self::Mean | Self::Sum => [0.0; 4],
        }
    }

    fn blend(self) -> Blend {
        match self {
            Self::Over => Blend::Over,
            Self::Largest => Blend::Mip,
            Self::Smallest => Blend::Min,
            Self::Mean => Blend::Average,
            Self::Sum => Blend::Add,
        }
    }
}

/// What a part of a volume leaves in the pixels of a picture: a rectangle of them, each with what it has gathered.
///
/// [`Partial::over`] is associative, so partial pictures combine in any tree of neighbours; but for [`Kind::Over`] their order does not matter
/// either. Rounding depends on the tree, by about 1e-7 a combination.
///
/// # Guarantees
/// There are as many pixels as the rectangle has, row by row from the top; the rectangle lies in the picture, and pixels beside it have gathered
/// nothing.
#[derive(Debug, Clone, PartialEq)]
pub struct Partial {
    kind: Kind,
    rectangle: Rectangle,
    /// Of gathered values v: `numbers[0] * v + numbers[1]` is the value in the data's units; averages are relative to `numbers[2]`.
    numbers: [f64; 3],
    fragments: u64,
}

/// What partial pictures as bytes begin with.
const MAGIC: &[u8; 8] = b"slicepp1";

impl Partial {
    pub(super) fn new(kind: Kind, rectangle: Rectangle, numbers: [f64; 3], fragments: u64) -> Self {
        Self { kind, rectangle, numbers, fragments }
    }

    /// What its pixels hold.
    pub fn kind(&self) -> Kind {
        self.kind
    }

    /// Columns and rows of the whole picture.
    pub fn picture_size(&self) -> (u32, u32) {
        self.rectangle.picture
    }

    /// First column and row of the rectangle, and its columns and rows.
    pub fn rectangle(&self) -> ((u32, u32), (u32, u32)) {
        (self.rectangle.first, self.rectangle.size)
    }

    /// The rectangle's pixels, row by row from the top: see [`Kind`].
    pub fn pixels(&self) -> &[[f32; 4]] {
        &self.rectangle.pixels
    }

    /// Fragments that went through the stages for it. Where nothing is passed over as empty, those of all parts add up to those of the whole.
    pub fn fragments(&self) -> u64 {
        self.fragments
    }

    /// This one before `back`: what both have gathered.
    ///
    /// # Errors
    /// [`Error::Invalid`] when the two are of different pictures: of other sizes, another blend, or other values.
    pub fn over(&self, back: &Self) -> Result<Self> {
        if self.rectangle.picture != back.rectangle.picture {
            let ((w, h), (v, g)) = (self.rectangle.picture, back.rectangle.picture);
            return Err(Error::invalid(format!("a partial picture of {w} x {h} pixels over one of {v} x {g}")));
        }
        if self.kind != back.kind {
            return Err(Error::invalid(format!("a partial picture of kind {:?} over one of kind {:?}", self.kind, back.kind)));
        }
        if self.numbers != back.numbers {
            return Err(Error::invalid(
                "partial pictures of different ranges of values: parts of one volume are told the range of the whole",
            ));
        }
        let kind = self.kind;
        let rectangle = self.rectangle.joined(&back.rectangle, kind.nothing(), |front, back| combined(kind, front, back));
        Ok(Self { kind, rectangle, numbers: self.numbers, fragments: self.fragments + back.fragments })
    }

    /// The finished picture of `scene`, over its background.
    ///
    /// # Errors
    /// [`Error::Invalid`] when the scene's picture is of another size or blend.
    pub fn finish(&self, scene: &Scene) -> Result<Picture> {
        let (width, height) = self.rectangle.picture;
        if (width, height) != scene.size() {
            let (v, g) = scene.size();
            return Err(Error::invalid(format!("a partial picture of {width} x {height} pixels in a picture of {v} x {g}")));
        }
        if self.kind.blend() != scene.blend() {
            return Err(Error::invalid(format!("a partial picture of kind {:?} for a scene of another blend", self.kind)));
        }
        let scene = &scene.blended();
        let over = OverBackground::new(scene, &crate::plan::method(scene));
        let [scale, offset, low] = self.numbers;
        let sums =
            Sums { blend: scene.blend(), transfer: scene.transfer(), scale, offset, labels: None, low, window: Sums::window_of(scene) };
        let nothing = self.kind.nothing();
        let mut all = vec![over.nothing(); width as usize * height as usize];
        let finished = |here, there| if here == nothing { there } else { sums.finished(&over, here) };
        self.rectangle.put((0, 0), width, &mut all, finished);
        Ok(Picture::new(width, height, all))
    }

    /// As bytes, little-endian, for another process: a head of 72 bytes, then the rectangle's pixels with as many f32 each as differ (four; two
    /// of [`Kind::Mean`]; one of the largest or smallest value).
    pub fn to_bytes(&self) -> Vec<u8> {
        let r = &self.rectangle;
        let channels = self.kind.channels();
        let mut bytes = Vec::with_capacity(HEAD + 4 * channels * r.pixels.len());
        bytes.extend(MAGIC);
        let kind = Kind::ALL.iter().position(|kind| *kind == self.kind).unwrap_or(0) as u64;
        bytes.extend(kind.to_le_bytes());
        for side in [r.picture.0, r.picture.1, r.first.0, r.first.1, r.size.0, r.size.1] {
            bytes.extend(side.to_le_bytes());
        }
        self.numbers.iter().for_each(|x| bytes.extend(x.to_le_bytes()));
        bytes.extend(self.fragments.to_le_bytes());
        r.pixels.iter().for_each(|pixel| pixel[..channels].iter().for_each(|x| bytes.extend(x.to_le_bytes())));
        bytes
    }

    /// What [`Partial::to_bytes`] wrote.
    ///
    /// # Errors
    /// [`Error::Invalid`] for bytes that are no partial picture, or not all of one.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self> {
        let bad = |what: String| Error::invalid(format!("partial picture of {} bytes: {what}", bytes.len()));
        let Some((head, rest)) = bytes.split_first_chunk::<HEAD>().filter(|(head, _)| head.starts_with(MAGIC)) else {
            return Err(bad("not one of this version".into()));
        };
        let word = |at: usize| u64::from_le_bytes(std::array::from_fn(|i| head[at + i]));
        let half = |at: usize| u32::from_le_bytes(std::array::from_fn(|i| head[at + i]));
        let kind = *Kind::ALL.get(word(8) as usize).ok_or_else(|| bad(format!("kind {}", word(8))))?;
        let [picture, first, size] = [16, 24, 32].map(|at| (half(at), half(at + 4)));
        let inside = |first: u32, size: u32, whole: u32| first.checked_add(size).is_some_and(|end| end <= whole);
        if !inside(first.0, size.0, picture.0) || !inside(first.1, size.1, picture.1) {
            return Err(bad(format!("a rectangle of {} x {} at {},{} in {} x {}", size.0, size.1, first.0, first.1, picture.0, picture.1)));
        }
        let channels = kind.channels();
        let wanted = u128::from(size.0) * u128::from(size.1) * 4 * channels as u128;
        if wanted != rest.len() as u128 {
            return Err(bad(format!("{} x {} pixels take {wanted} bytes, {} are there", size.0, size.1, rest.len())));
        }
        let pixel = |bytes: &[u8]| {
            let mut pixel = kind.nothing();
            for (to, from) in pixel.iter_mut().zip(bytes.chunks_exact(4)) {
                *to = f32::from_le_bytes([from[0], from[1], from[2], from[3]]);
            }
            pixel
        };
        let pixels = rest.chunks_exact(4 * channels).map(pixel).collect();
        let numbers = [40, 48, 56].map(|at| f64::from_bits(word(at)));
        Ok(Self { kind, rectangle: Rectangle { picture, first, size, pixels }, numbers, fragments: word(64) })
    }
}

/// Bytes of the head.
const HEAD: usize = 72;
