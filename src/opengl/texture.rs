//! The 3D texture: texels from voxels, filters and wrap modes.
//!
//! ```text
//!  texel        0     1           n-1
//!          |--o--|--o--| ... |--o--|        o = texel centre, at s = (i + 1/2) / n
//!       s = 0                     s = 1     u = s n - 1/2: the texel it stands on, and the way to the next
//! ```

use super::table::Table;
use crate::scene::{TextureFormat, Wrap};
use crate::volume::{Volume, VoxelType, Voxels, with_voxels};
use crate::{Error, Result};
use rayon::prelude::*;

/// How values in the data's units lie in the texture's `[0,1]`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Values {
    /// 8-bit voxels as they are: value = slope * level + intercept.
    Levels {
        /// Of the volume's rescale.
        slope: f64,
        /// Of the volume's rescale.
        intercept: f64,
    },
    /// From the smallest value, at 0, to the largest, at 1.
    Range {
        /// Smallest finite value.
        min: f64,
        /// Largest finite value.
        max: f64,
    },
}

impl Values {
    pub(crate) fn of(volume: &Volume) -> Self {
        let (slope, intercept) = volume.rescale();
        if volume.voxels().voxel_type() == VoxelType::U8 {
            return Self::Levels { slope, intercept };
        }
        let s = volume.statistics();
        Self::Range { min: s.min, max: s.max }
    }

    /// The value, in the data's units, of level `i` of 255.
    pub(super) fn of_level(&self, i: usize) -> f64 {
        match *self {
            Self::Levels { slope, intercept } => slope * i as f64 + intercept,
            Self::Range { min, max } => {
                let t = i as f64 / 255.0;
                min * (1.0 - t) + max * t
            }
        }
    }

    /// Where `value` lies in `[0,1]`; 0 for NaN, and in a volume of one value.
    fn position(min: f64, max: f64, value: f64) -> f64 {
        // Halves, so that the range of values as large as f64 has them stays finite.
        let (low, width) = (min * 0.5, max * 0.5 - min * 0.5);
        let t = (value * 0.5 - low) / width;
        if value.is_finite() && width > 0.0 { t.clamp(0.0, 1.0) } else { 0.0 }
    }
}

/// What a texture depends on beside the volume.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct TextureKey {
    /// Numbers of the texels.
    pub(crate) format: TextureFormat,
    /// The table that voxels were classified through; `None` = the texture holds values.
    pub(crate) table: Option<Table>,
}

/// Texels, x fastest.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Texture {
    /// Values, 8 bits.
    R8(Vec<u8>),
    /// Values, floats.
    R32F(Vec<f32>),
    /// Colours, 8 bits.
    Rgba8(Vec<[u8; 4]>),
    /// Colours, floats.
    Rgba32F(Vec<[f32; 4]>),
}

impl Texture {
    /// # Errors
    /// [`Error::Invalid`] when there is no memory for the texels.
    pub(crate) fn new(volume: &Volume, values: &Values, key: &TextureKey) -> Result<Self> {
        let level = |t: f64| libm::round(t * 255.0) as u8;
        Ok(match (key.format, &key.table) {
            (TextureFormat::Unorm8, None) => Self::R8(texels(volume, values, level)?),
            (TextureFormat::F32, None) => Self::R32F(texels(volume, values, |t| t as f32)?),
            (TextureFormat::Unorm8, Some(table)) => Self::Rgba8(texels(volume, values, |t| table.level(level(t)))?),
            (TextureFormat::F32, Some(table)) => Self::Rgba32F(texels(volume, values, |t| table.lookup(t as f32))?),
        })
    }
}

/// The voxels of `volume`, each at its position in `[0,1]`, through `map`.
fn texels<T: Send>(volume: &Volume, values: &Values, map: impl Fn(f64) -> T + Sync) -> Result<Vec<T>> {
    let count = volume.voxels().len();
    let mut texels = Vec::new();
    if crate::memory::reserve(&mut texels, count).is_err() {
        let bytes = count as u128 * size_of::<T>() as u128;
        return Err(Error::invalid(format!("a texture of {bytes} bytes: this machine does not give that much memory")));
    }
    match (*values, volume.voxels()) {
        (Values::Levels { .. }, Voxels::U8(levels)) => levels.par_iter().map(|&v| map(f64::from(v) / 255.0)).collect_into_vec(&mut texels),
        (Values::Range { min, max }, voxels) => {
            let (slope, intercept) = volume.rescale();
            with_voxels!(voxels, v => {
                v.par_iter().map(|&x| map(Values::position(min, max, slope * to_f64(x) + intercept))).collect_into_vec(&mut texels);
            });
        }
        (Values::Levels { .. }, _) => return Err(Error::invalid("levels are for voxels of 8 bits")),
    }
    Ok(texels)
}

fn to_f64<T: crate::volume::Voxel>(x: T) -> f64 {
    x.to_f64()
}

/// One texel of C components. 8-bit texels are filtered as whole numbers and divided by 255 afterwards.
pub(super) trait Texel<const C: usize>: Copy + Send + Sync {
    /// What 1.0 is in these numbers.
    const ONE: f32;
    /// Its components, `ONE` for 1.0.
    fn components(self) -> [f32; C];
    /// The texel with these components, `ONE` for 1.0, as near as its numbers come.
    fn nearest_to(components: [f32; C]) -> Self;
    /// From `self` to `other` by `w` (0 to 1) in fixed point, for texels that have one.
    fn mix_fixed(self, other: Self, w: f32) -> Self;
}

/// From `a` to `b` by w/256, rounded to nearest.
#[inline(always)]
pub(super) fn mix_levels(a: u8, b: u8, w: u8) -> u8 {
    let (a, b) = (i32::from(a), i32::from(b));
    (a + ((i32::from(w) * (b - a) + 128) >> 8)) as u8
}

/// `w` in steps of 1/256, rounded down.
#[inline(always)]
pub(super) fn fixed_weight(w: f32) -> u8 {
    (w * 256.0) as u8
}

impl Texel<1> for u8 {
    const ONE: f32 = 255.0;
    #[inline(always)]
    fn components(self) -> [f32; 1] {
        [f32::from(self)]
    }
    fn nearest_to([c]: [f32; 1]) -> Self {
        (c + 0.5) as u8
    }
    #[inline(always)]
    fn mix_fixed(self, other: Self, w: f32) -> Self {
        mix_levels(self, other, fixed_weight(w))
    }
}

impl Texel<4> for [u8; 4] {
    const ONE: f32 = 255.0;
    #[inline(always)]
    fn components(self) -> [f32; 4] {
        let [r, g, b, a] = self;
        [f32::from(r), f32::from(g), f32::from(b), f32::from(a)]
    }
    fn nearest_to(components: [f32; 4]) -> Self {
        components.map(|c| (c + 0.5) as u8)
    }
    #[inline(always)]
    fn mix_fixed(self, other: Self, w: f32) -> Self {
        let w = fixed_weight(w);
        std::array::from_fn(|c| mix_levels(self[c], other[c], w))
    }
}

impl Texel<1> for f32 {
    const ONE: f32 = 1.0;
    #[inline(always)]
    fn components(self) -> [f32; 1] {
        [self]
    }
    fn nearest_to([c]: [f32; 1]) -> Self {
        c
    }
    #[inline(always)]
    fn mix_fixed(self, other: Self, w: f32) -> Self {
        self + w * (other - self)
    }
}

impl Texel<4> for [f32; 4] {
    const ONE: f32 = 1.0;
    #[inline(always)]
    fn components(self) -> [f32; 4] {
        self
    }
    fn nearest_to(components: [f32; 4]) -> Self {
        components
    }
    #[inline(always)]
    fn mix_fixed(self, other: Self, w: f32) -> Self {
        mix(self, other, w)
    }
}

/// Stands for the border in place of a texel's index.
const BORDER: usize = usize::MAX;

/// Looks up texels of one texture.
pub(super) struct Sampler<'t, const C: usize, T> {
    texels: &'t [T],
    dims: [usize; 3],
    wrap: [Wrap; 3],
    /// Border colour in the texels' own numbers.
    border: [f32; C],
}

impl<'t, const C: usize, T: Texel<C>> Sampler<'t, C, T> {
    pub(super) fn new(texels: &'t [T], dims: [usize; 3], wrap: [Wrap; 3], border: [f64; 4]) -> Self {
        Self { texels, dims, wrap, border: std::array::from_fn(|c| border[c] as f32 * T::ONE) }
    }

    #[inline(always)]
    fn texel(&self, i: usize, j: usize, k: usize) -> [f32; C] {
        if i == BORDER || j == BORDER || k == BORDER {
            return self.border;
        }
        self.texels[(k * self.dims[1] + j) * self.dims[0] + i].components()
    }

    #[inline(always)]
    fn stored(&self, i: usize, j: usize, k: usize) -> T {
        if i == BORDER || j == BORDER || k == BORDER {
            return T::nearest_to(self.border);
        }
        self.texels[(k * self.dims[1] + j) * self.dims[0] + i]
    }

    /// `GL_NEAREST`: the texel that (s,t,p) lies in, components in `[0,1]`.
    pub(super) fn nearest(&self, at: [f64; 3]) -> [f32; C] {
        let i = nearest(at[0], self.dims[0], self.wrap[0]);
        let j = nearest(at[1], self.dims[1], self.wrap[1]);
        let k = nearest(at[2], self.dims[2], self.wrap[2]);
        self.texel(i, j, k).map(|c| c / T::ONE)
    }

    /// `GL_LINEAR`: the eight texels around (s,t,p), first along s, then t, then p; components in `[0,1]`.
    pub(super) fn linear(&self, at: [f64; 3]) -> [f32; C] {
        let (i0, i1, ws) = around(at[0], self.dims[0], self.wrap[0]);
        let (j0, j1, wt) = around(at[1], self.dims[1], self.wrap[1]);
        let (k0, k1, wp) = around(at[2], self.dims[2], self.wrap[2]);
        let along = |j: usize, k: usize| mix(self.texel(i0, j, k), self.texel(i1, j, k), ws);
        let near = mix(along(j0, k0), along(j1, k0), wt);
        let far = mix(along(j0, k1), along(j1, k1), wt);
        mix(near, far, wp).map(|c| c / T::ONE)
    }

    /// `GL_LINEAR` in fixed point: weights in steps of 1/256, rounded to 8 bits after each direction. Floats are filtered as ever.
    pub(super) fn linear_fixed(&self, at: [f64; 3]) -> [f32; C] {
        let (i0, i1, ws) = around(at[0], self.dims[0], self.wrap[0]);
        let (j0, j1, wt) = around(at[1], self.dims[1], self.wrap[1]);
        let (k0, k1, wp) = around(at[2], self.dims[2], self.wrap[2]);
        let along = |j: usize, k: usize| self.stored(i0, j, k).mix_fixed(self.stored(i1, j, k), ws);
        let near = along(j0, k0).mix_fixed(along(j1, k0), wt);
        let far = along(j0, k1).mix_fixed(along(j1, k1), wt);
        near.mix_fixed(far, wp).components().map(|c| c / T::ONE)
    }
}

#[inline(always)]
fn mix<const C: usize>(mut a: [f32; C], b: [f32; C], w: f32) -> [f32; C] {
    for c in 0..C {
        a[c] += w * (b[c] - a[c]);
    }
    a
}

/// The index of the texel that coordinate `s` lies in.
#[inline(always)]
fn nearest(s: f64, n: usize, wrap: Wrap) -> usize {
    let size = n as f64;
    match wrap {
        Wrap::ClampToEdge => ((s * size).max(0.0) as usize).min(n - 1),
        Wrap::ClampToBorder => {
            let u = s * size;
            if u >= 0.0 && u < size { u as usize } else { BORDER }
        }
        Wrap::Repeat => (((s - s.floor()) * size) as usize).min(n - 1),
    }
}

/// The two texels around coordinate `s`, and the weight of the second.
#[inline(always)]
fn around(s: f64, n: usize, wrap: Wrap) -> (usize, usize, f32) {
    let size = n as f64;
    match wrap {
        Wrap::ClampToEdge => {
            let u = (s * size - 0.5).clamp(0.0, size - 1.0);
            let i = u as usize;
            (i, (i + 1).min(n - 1), (u - i as f64) as f32)
        }
        Wrap::ClampToBorder => {
            // Texel -1 and texel n are the border.
            let u = (s * size - 0.5).clamp(-1.0, size);
            let low = u.floor();
            let inside = |x: f64| if x >= 0.0 && x < size { x as usize } else { BORDER };
            (inside(low), inside(low + 1.0), (u - low) as f32)
        }
        Wrap::Repeat => {
            let u = (s - s.floor()) * size - 0.5;
            let low = u.floor();
            let i = if low < 0.0 { n - 1 } else { (low as usize).min(n - 1) };
            (i, if i + 1 == n { 0 } else { i + 1 }, (u - low) as f32)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::volume::Grid;

    const EDGE: [Wrap; 3] = [Wrap::ClampToEdge; 3];
    const RED: [f64; 4] = [1.0, 0.0, 0.0, 1.0];

    fn row(wrap: Wrap) -> Sampler<'static, 1, u8> {
        Sampler::new(&[0, 51, 255], [3, 1, 1], [wrap, Wrap::ClampToEdge, Wrap::ClampToEdge], RED)
    }

    fn close(a: f32, b: f32) {
        assert!((a - b).abs() < 1e-6, "{a} is not {b}");
    }

    #[test]
    fn texel_centers_give_texels_and_middles_their_mean() {
        for wrap in [Wrap::ClampToEdge, Wrap::ClampToBorder, Wrap::Repeat] {
            let row = row(wrap);
            for (i, want) in [0.0, 0.2, 1.0].into_iter().enumerate() {
                close(row.linear([(i as f64 + 0.5) / 3.0, 0.5, 0.5])[0], want);
                close(row.nearest([(i as f64 + 0.9) / 3.0, 0.5, 0.5])[0], want);
            }
            close(row.linear([1.0 / 3.0, 0.5, 0.5])[0], 0.1);
            close(row.linear([0.75 / 3.0, 0.5, 0.5])[0], 0.05);
        }
    }

    #[test]
    fn beyond_the_edge_each_wrap_mode_has_its_own() {
        let at = |wrap, s| row(wrap).linear([s, 0.5, 0.5])[0];
        close(at(Wrap::ClampToEdge, -7.0), 0.0);
        close(at(Wrap::ClampToEdge, 1.0), 1.0);
        // Half border (1.0), half texel 0; then border alone.
        close(at(Wrap::ClampToBorder, 0.0), 0.5);
        close(at(Wrap::ClampToBorder, -1.0 / 6.0), 1.0);
        close(at(Wrap::ClampToBorder, -9.0), 1.0);
        close(at(Wrap::ClampToBorder, 2.0), 1.0);
        // Half the last texel, half the first; then the texture again.
        close(at(Wrap::Repeat, 0.0), 0.5);
        close(at(Wrap::Repeat, 1.0), 0.5);
        close(at(Wrap::Repeat, -1.5), 0.2);
        close(at(Wrap::Repeat, 5.25), 0.05);
        close(at(Wrap::Repeat, -1e-17), 0.5);
        let near = |wrap, s| row(wrap).nearest([s, 0.5, 0.5])[0];
        close(near(Wrap::ClampToEdge, 1.0), 1.0);
        close(near(Wrap::ClampToEdge, -0.1), 0.0);
        close(near(Wrap::ClampToBorder, 1.0), 1.0);
        close(near(Wrap::ClampToBorder, -1e-9), 1.0);
        close(near(Wrap::Repeat, 1.0), 0.0);
        close(near(Wrap::Repeat, -1e-17), 1.0);
        close(near(Wrap::Repeat, -0.5), 0.2);
    }

    #[test]
    fn a_single_texel_is_the_same_everywhere() {
        for wrap in [Wrap::ClampToEdge, Wrap::Repeat] {
            let one: Sampler<'_, 4, [f32; 4]> = Sampler::new(&[[0.1, 0.2, 0.3, 0.4]], [1; 3], [wrap; 3], RED);
            for s in [-3.3, 0.0, 0.2, 0.5, 1.0, 4.1] {
                assert_eq!(one.linear([s; 3]), [0.1, 0.2, 0.3, 0.4]);
                assert_eq!(one.nearest([s; 3]), [0.1, 0.2, 0.3, 0.4]);
            }
        }
    }

    #[test]
    fn eight_texels_are_weighted_by_all_three_coordinates() {
        let cube: Sampler<'_, 1, f32> = Sampler::new(&[0.0, 1.0, 0.0, 1.0, 0.0, 1.0, 0.0, 5.0], [2; 3], EDGE, RED);
        // u = 0.5, 0.25, 0.75: 1/2 of x alone, and 4 more in the last corner with weight 1/2 * 1/4 * 3/4.
        close(cube.linear([0.5, 0.375, 0.625])[0], 0.5 + 4.0 * 0.5 * 0.25 * 0.75);
    }

    #[test]
    fn fixed_point_filters_round_after_each_direction() {
        let row = row(Wrap::ClampToEdge);
        // A quarter of the way from 0 to 51: 64/256 of 51 = 12.75.
        close(row.linear_fixed([0.75 / 3.0, 0.5, 0.5])[0], 13.0 / 255.0);
        // A weight of 0.999/256 is none.
        close(row.linear_fixed([(0.5 + 0.999 / 256.0) / 3.0, 0.5, 0.5])[0], 0.0);
        assert_eq!((mix_levels(255, 0, 128), mix_levels(0, 255, 255), mix_levels(7, 7, 99)), (128, 254, 7));
        let worst = (0..1000).map(|i| {
            let at = [f64::from(i) / 1000.0, 0.5, 0.5];
            (row.linear(at)[0] - row.linear_fixed(at)[0]).abs()
        });
        assert!(worst.fold(0.0, f32::max) < 1.5 / 255.0);
        // Floats have no fixed point.
        let floats: Sampler<'_, 1, f32> = Sampler::new(&[0.0, 1.0], [2, 1, 1], EDGE, RED);
        assert_eq!(floats.linear_fixed([0.3, 0.5, 0.5]), floats.linear([0.3, 0.5, 0.5]));
    }

    #[test]
    fn bytes_stay_as_they_are_and_other_types_fill_the_range() {
        let grid = Grid::with_spacing([3, 1, 1], [1.0; 3]).expect("grid");
        let key = TextureKey { format: TextureFormat::Unorm8, table: None };
        let bytes = Volume::new(grid.clone(), Voxels::U8(vec![7, 8, 9].into())).expect("volume");
        assert_eq!(Texture::new(&bytes, &Values::of(&bytes), &key).expect("texture"), Texture::R8(vec![7, 8, 9]));
        assert_eq!(Values::of(&bytes).of_level(8), 8.0);
        let floats = Volume::new(grid.clone(), Voxels::F32(vec![-1.0, f32::NAN, 3.0].into())).expect("volume");
        assert_eq!(Texture::new(&floats, &Values::of(&floats), &key).expect("texture"), Texture::R8(vec![0, 0, 255]));
        let wide = Volume::new(grid, Voxels::F64(vec![f64::MIN, 0.0, f64::MAX].into())).expect("volume");
        let key = TextureKey { format: TextureFormat::F32, table: None };
        assert_eq!(Texture::new(&wide, &Values::of(&wide), &key).expect("texture"), Texture::R32F(vec![0.0, 0.5, 1.0]));
        assert_eq!((Values::of(&wide).of_level(0), Values::of(&wide).of_level(255)), (f64::MIN, f64::MAX));
    }
}
