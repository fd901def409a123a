//! The field along one ray: a polynomial on each piece, cubic where the field is trilinear.

use crate::volume::{Number, Volume, with_voxels};

/// The value along a piece of ray, s from 0 to 1.
pub(super) trait Along {
    /// What stands before the powers of s, from 0 up.
    fn coefficients(&self) -> &[f64];

    fn at(&self, s: f64) -> f64;

    /// Its derivative by s.
    fn slope(&self, s: f64) -> f64;

    /// Whether it is no constant.
    fn varies(&self) -> bool;

    /// Places strictly inside (0,1) where the slope changes sign.
    fn turns(&self) -> Turns;
}

/// Up to eight places on a piece of ray, rising: as many turns as a polynomial of degree nine has at most.
#[derive(Debug, Clone, Copy)]
pub(super) struct Turns {
    places: [f64; 8],
    count: usize,
}

impl Turns {
    pub(super) fn new(places: impl Iterator<Item = f64>) -> Self {
        let mut turns = Self { places: [0.0; 8], count: 0 };
        places.take(8).for_each(|s| {
            turns.places[turns.count] = s;
            turns.count += 1;
        });
        turns
    }

    pub(super) fn iter(&self) -> impl Iterator<Item = f64> + '_ {
        self.places[..self.count].iter().copied()
    }
}

/// f(s) = c0 + c1 s + c2 s^2 + c3 s^3 on a piece of ray, s from 0 to 1.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Cubic(pub(super) [f64; 4]);

impl Cubic {
    pub(super) fn at(&self, s: f64) -> f64 {
        let [a, b, c, d] = self.0;
        a + s * (b + s * (c + s * d))
    }

    pub(super) fn slope(&self, s: f64) -> f64 {
        let [_, b, c, d] = self.0;
        b + s * (2.0 * c + s * (3.0 * d))
    }

    /// Places strictly inside (0,1) where the slope changes sign, rising. At most two.
    pub(super) fn turns(&self) -> impl Iterator<Item = f64> + use<> {
        let [_, b, half, d] = self.0;
        // 3 d s^2 + 2 half s + b = 0; the root of larger size first, the other from their product, so that nothing cancels.
        let disc = half * half - 3.0 * d * b;
        let mut roots = [f64::NAN; 2];
        if disc >= 0.0 {
            let q = -(half + disc.sqrt().copysign(half));
            roots = [q / (3.0 * d), b / q];
            if roots[0] > roots[1] {
                roots.swap(0, 1);
            }
        }
        // Also drops the infinities and NaN of a slope of lower degree.
        roots.into_iter().filter(|&s| s > 0.0 && s < 1.0)
    }
}

impl Along for Cubic {
    fn coefficients(&self) -> &[f64] {
        &self.0
    }

    fn at(&self, s: f64) -> f64 {
        Self::at(self, s)
    }

    fn slope(&self, s: f64) -> f64 {
        Self::slope(self, s)
    }

    fn varies(&self) -> bool {
        self.0[1..].iter().any(|&c| c != 0.0)
    }

    fn turns(&self) -> Turns {
        Turns::new(Self::turns(self))
    }
}

/// Where `at` is `level` within [a, b], on which it rises or falls throughout and meets the level; `slope` is its derivative.
pub(super) fn solve(at: impl Fn(f64) -> f64, slope: impl Fn(f64) -> f64, level: f64, a: f64, b: f64) -> f64 {
    let rising = at(b) > at(a);
    let (mut low, mut high) = (a, b);
    let mut s = 0.5 * (a + b);
    for _ in 0..200 {
        let miss = at(s) - level;
        if miss == 0.0 {
            return s;
        }
        if (miss > 0.0) == rising {
            high = s;
        } else {
            low = s;
        }
        let newton = s - miss / slope(s);
        // Newton's step where it stays in the bracket, else the middle: never worse than halving in the long run,
        // because a step that does not move the bracket's far end is at the root to rounding.
        let next = if newton > low && newton < high { newton } else { 0.5 * (low + high) };
        if next == s || next <= low || next >= high || (next - s).abs() < 1e-16 {
            return next.clamp(low, high);
        }
        s = next;
    }
    s
}

/// The corners of one cell: value at bit 0 = x, bit 1 = y, bit 2 = z.
pub(super) type Corners = [f64; 8];

/// The values at the corners of the cell whose lower corner is voxel `low`; voxels beyond the grid are those at its edge.
pub(super) fn corners(volume: &Volume, low: [i64; 3]) -> Corners {
    let dims = volume.grid().dims();
    let pick = |axis: usize, step: i64| (low[axis] + step).clamp(0, dims[axis] as i64 - 1) as usize;
    let index: [usize; 8] = std::array::from_fn(|c| {
        let [x, y, z] = [pick(0, c as i64 & 1), pick(1, c as i64 >> 1 & 1), pick(2, c as i64 >> 2)];
        (z * dims[1] + y) * dims[0] + x
    });
    let (slope, intercept) = volume.rescale();
    with_voxels!(volume.voxels(), v => index.map(|i| slope * v[i].to_f64() + intercept))
}

/// The field along a piece of ray within a cell: from `at`, its place in the cell (each in `[0,1]` where the cell is not clamped),
/// over `step`.
pub(super) fn cubic(v: &Corners, at: [f64; 3], step: [f64; 3]) -> Cubic {
    let [x, y, z] = at;
    let [gx, gy, gz] = step;
    // Coefficients of the trilinear form in the cell's own monomials.
    let (kx, ky, kz) = (v[1] - v[0], v[2] - v[0], v[4] - v[0]);
    let kxy = (v[3] - v[2]) - kx;
    let kxz = (v[5] - v[4]) - kx;
    let kyz = (v[6] - v[4]) - ky;
    let kxyz = ((v[7] - v[6]) - (v[5] - v[4])) - kxy;
    // Derivatives at the start of the piece.
    let fx = kx + kxy * y + kxz * z + kxyz * y * z;
    let fy = ky + kxy * x + kyz * z + kxyz * x * z;
    let fz = kz + kxz * x + kyz * y + kxyz * x * y;
    let (fxy, fxz, fyz) = (kxy + kxyz * z, kxz + kxyz * y, kyz + kxyz * x);
    let mix = |a: f64, b: f64, t: f64| a * (1.0 - t) + b * t;
    let start = mix(mix(mix(v[0], v[1], x), mix(v[2], v[3], x), y), mix(mix(v[4], v[5], x), mix(v[6], v[7], x), y), z);
    Cubic([start, gx * fx + gy * fy + gz * fz, gx * gy * fxy + gx * gz * fxz + gy * gz * fyz, gx * gy * gz * kxyz])
}
