//! Which voxels of an axis a new voxel is made from, and with which weights.
//!
//! Old and new voxels are cells that fill the same length evenly. New cells that are no larger than old ones look up at their centres,
//! linearly between the centres of old ones. Larger ones take the mean over what they cover, so that nothing between the centres is missed.
//! All places are fractions of whole numbers: weights have one rounding each.

/// The taps of all new voxels along one axis.
pub(super) struct Taps {
    /// For each new voxel: the first old one, and the end of its weights in `weights`.
    each: Vec<(usize, usize)>,
    /// Weights of the old voxels from the first on; those of one new voxel add up to 1.
    weights: Vec<f64>,
}

impl Taps {
    /// From `old` voxels to `new` ones.
    pub(super) fn new(old: usize, new: usize) -> Self {
        let mut taps = Self { each: Vec::with_capacity(new), weights: Vec::new() };
        for j in 0..new {
            if new < old { taps.mean(j, old, new) } else { taps.linear(j, old, new) }
        }
        taps
    }

    /// The nearest old voxel alone: the one that the centre lies in, at a face the upper one.
    pub(super) fn nearest(old: usize, new: usize) -> Self {
        let mut taps = Self { each: Vec::with_capacity(new), weights: Vec::new() };
        for j in 0..new {
            taps.push(((2 * j as u64 + 1) * old as u64 / (2 * new as u64)) as usize, &[1.0]);
        }
        taps
    }

    fn push(&mut self, first: usize, weights: &[f64]) {
        self.weights.extend_from_slice(weights);
        self.each.push((first, self.weights.len()));
    }

    /// The centre of cell `j`, at (j + 1/2) old/new - 1/2 between the centres of old cells; beyond the outermost ones these count.
    fn linear(&mut self, j: usize, old: usize, new: usize) {
        let (whole, half) = (2 * new as u64, new as u64);
        let place = ((2 * j as u64 + 1) * old as u64).saturating_sub(half);
        let (low, rest) = ((place / whole) as usize, place % whole);
        if low + 1 >= old || rest == 0 {
            return self.push(low.min(old - 1), &[1.0]);
        }
        let t = rest as f64 / whole as f64;
        self.push(low, &[1.0 - t, t]);
    }

    /// What cell `j` covers, in parts of which an old cell has `new` and a new one has `old`.
    fn mean(&mut self, j: usize, old: usize, new: usize) {
        let (j, old, new) = (j as u64, old as u64, new as u64);
        let (from, to) = (j * old, (j + 1) * old);
        let first = from / new;
        for i in first..to.div_ceil(new) {
            let shared = to.min((i + 1) * new) - from.max(i * new);
            self.weights.push(shared as f64 / old as f64);
        }
        self.each.push((first as usize, self.weights.len()));
    }

    /// New voxels.
    pub(super) fn len(&self) -> usize {
        self.each.len()
    }

    /// The first old voxel of new voxel `j`, and the weights from there on.
    #[inline]
    pub(super) fn of(&self, j: usize) -> (usize, &[f64]) {
        let from = if j == 0 { 0 } else { self.each[j - 1].1 };
        let (first, to) = self.each[j];
        (first, &self.weights[from..to])
    }
}
