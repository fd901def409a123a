//! Whether the numbers of a raw file look as if they were read in the wrong way: bytes in the other order, or numbers without their sign.

use super::voxels::{Voxels, with_voxels};
use super::{Volume, VoxelType};

/// Pairs of neighbours that are looked at.
const PAIRS: usize = 1 << 16;

/// Neighbours that differ by a smaller share of what any two voxels do are read as they should be.
const ROUGH: f64 = 0.2;
/// How much smoother another way to read must be to be named: bytes in the wrong order never make smooth numbers smoother.
const SMOOTHER: f64 = 0.4;
/// Numbers beyond these are no measurements.
const HUGE: f64 = 1e30;

/// What would make better sense of a file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Doubt {
    /// The other byte order.
    Endian,
    /// The same number of bits with a sign.
    Signed,
}

/// Pairs of neighbours along x, as they are stored.
fn pairs<T: Copy>(voxels: &[T], nx: usize) -> Vec<[T; 2]> {
    let step = voxels.len().div_ceil(PAIRS) | 1;
    let inside = (0..voxels.len().saturating_sub(1)).step_by(step).filter(|i| (i + 1) % nx != 0);
    inside.map(|i| [voxels[i], voxels[i + 1]]).collect()
}

/// Mean difference of neighbours, as a share of the mean distance from the mean; infinite where hardly a number is one.
fn roughness(pairs: &[[f64; 2]]) -> f64 {
    let sound: Vec<[f64; 2]> =
        pairs.iter().copied().filter(|p| p.iter().all(|x| x.abs() < HUGE && (*x == 0.0 || x.abs() > 1.0 / HUGE))).collect();
    if sound.len() * 10 < pairs.len() * 9 || sound.is_empty() {
        return f64::INFINITY;
    }
    let n = sound.len() as f64;
    let mean = sound.iter().map(|p| p[0]).sum::<f64>() / n;
    let spread = sound.iter().map(|p| (p[0] - mean).abs()).sum::<f64>() / n;
    let step = sound.iter().map(|p| (p[0] - p[1]).abs()).sum::<f64>() / n;
    if spread > 0.0 { step / spread } else { 0.0 }
}

impl Volume {
    /// What would make better sense of the voxels, if neighbours look like noise and would not then, or a sign seems to be missing.
    pub(crate) fn doubt(&self) -> Option<Doubt> {
        let nx = self.grid().dims()[0];
        let voxels = self.scalars()?;
        if let Voxels::U16(v) = voxels {
            let found = pairs(v, nx);
            let share =
                |from: u16, to: u16| found.iter().filter(|p| (from..=to).contains(&p[0])).count() as f64 / found.len().max(1) as f64;
            // Both ends of the range and nothing between: small numbers around 0.
            if share(0, 0x1fff) > 0.01 && share(0xe000, 0xffff) > 0.01 && share(0x2000, 0xdfff) < 0.001 {
                return Some(Doubt::Signed);
            }
        }
        if matches!(voxels.voxel_type(), VoxelType::U8 | VoxelType::I8) {
            return None;
        }
        let [as_is, swapped] = with_voxels!(voxels, v => {
            let found = pairs(v, nx);
            let numbers = |swap: bool| -> Vec<[f64; 2]> {
                found.iter().map(|pair| pair.map(|x| crate::lanes::Number::to_f64(if swap { swapped(x) } else { x }))).collect()
            };
            [roughness(&numbers(false)), roughness(&numbers(true))]
        });
        (as_is > ROUGH && swapped < SMOOTHER * as_is.min(2.0)).then_some(Doubt::Endian)
    }
}

/// A number with its bytes in the other order.
fn swapped<T: bytemuck::Pod>(x: T) -> T {
    let mut bytes = bytemuck::bytes_of(&x).to_vec();
    bytes.reverse();
    bytemuck::pod_read_unaligned(&bytes)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::volume::Grid;

    fn volume(voxels: Voxels) -> Volume {
        Volume::new(Grid::with_spacing([32; 3], [1.0; 3]).expect("grid"), voxels).expect("volume")
    }

    /// A smooth body, and noise.
    fn numbers(noise: bool) -> impl Iterator<Item = f64> {
        (0..32_usize.pow(3)).map(move |i| {
            let at = [i % 32, i / 32 % 32, i / 1024].map(|n| n as f64 - 15.5);
            let grain = (i.wrapping_mul(2_654_435_761) >> 9) % 1000;
            if noise { grain as f64 } else { 1500.0 - 80.0 * at.iter().map(|x| x * x).sum::<f64>().sqrt() + (grain % 20) as f64 }
        })
    }

    #[test]
    fn swapped_bytes_are_found_in_every_type() {
        let swap = |x: i16| x.swap_bytes();
        for noise in [false, true] {
            let wrong = (!noise).then_some(Doubt::Endian);
            assert_eq!(volume(Voxels::I16(numbers(noise).map(|x| x as i16).collect())).doubt(), None);
            assert_eq!(volume(Voxels::I16(numbers(noise).map(|x| swap(x as i16)).collect())).doubt(), wrong);
            assert_eq!(volume(Voxels::F32(numbers(noise).map(|x| x as f32).collect())).doubt(), None);
            let bits = |x: f64| f32::from_bits((x as f32).to_bits().swap_bytes());
            assert_eq!(volume(Voxels::F32(numbers(false).map(bits).collect())).doubt(), Some(Doubt::Endian));
            assert_eq!(volume(Voxels::I32(numbers(noise).map(|x| (x as i32).swap_bytes()).collect())).doubt(), wrong);
            assert_eq!(volume(Voxels::F64(numbers(noise).collect())).doubt(), None);
        }
        assert_eq!(volume(Voxels::U8(numbers(true).map(|x| x as u8).collect())).doubt(), None);
        assert_eq!(volume(Voxels::U16(vec![7; 32 * 32 * 32].into())).doubt(), None);
    }

    #[test]
    fn a_missing_sign_is_found() {
        let unsigned = |x: f64| (x - 1000.0) as i16 as u16;
        assert_eq!(volume(Voxels::U16(numbers(false).map(unsigned).collect())).doubt(), Some(Doubt::Signed));
        assert_eq!(volume(Voxels::U16(numbers(false).map(|x| x as u16).collect())).doubt(), None);
    }
}
