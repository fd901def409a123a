//! Extents: blocks of points or cells, as whole numbers along three axes.

/// Most blocks that what is left of a box may fall into; see [`Extent::is_covered`].
const MOST: usize = 4096;

/// The points or cells from `low` up to, not including, `high`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Extent {
    pub(super) low: [i64; 3],
    pub(super) high: [i64; 3],
}

impl Extent {
    /// How many there are along each axis.
    pub(super) fn dims(&self) -> [usize; 3] {
        [0, 1, 2].map(|a| (self.high[a] - self.low[a]).max(0) as usize)
    }

    /// The cells between these points. Along an axis of one point they are flat and keep its place.
    pub(super) fn cells(&self) -> Self {
        Self { low: self.low, high: [0, 1, 2].map(|a| if self.high[a] - self.low[a] > 1 { self.high[a] - 1 } else { self.high[a] }) }
    }

    /// The smallest one that holds both.
    pub(super) fn joined(&self, other: &Self) -> Self {
        Self { low: [0, 1, 2].map(|a| self.low[a].min(other.low[a])), high: [0, 1, 2].map(|a| self.high[a].max(other.high[a])) }
    }

    fn is_empty(&self) -> bool {
        self.dims().contains(&0)
    }

    /// What of this one is not in `other`: up to six blocks.
    fn without(mut self, other: &Self, out: &mut Vec<Self>) {
        let common =
            Self { low: [0, 1, 2].map(|a| self.low[a].max(other.low[a])), high: [0, 1, 2].map(|a| self.high[a].min(other.high[a])) };
        if common.is_empty() {
            out.push(self);
            return;
        }
        for axis in 0..3 {
            for (low, high) in [(self.low[axis], common.low[axis]), (common.high[axis], self.high[axis])] {
                if low < high {
                    let mut slab = self;
                    (slab.low[axis], slab.high[axis]) = (low, high);
                    out.push(slab);
                }
            }
            (self.low[axis], self.high[axis]) = (common.low[axis], common.high[axis]);
        }
    }

    /// Whether all of it is in `pieces`; also false where finding out would take too long.
    pub(super) fn is_covered(&self, pieces: impl Iterator<Item = Self>) -> bool {
        let mut left = vec![*self];
        for piece in pieces {
            let mut rest = Vec::new();
            left.iter().for_each(|block| block.without(&piece, &mut rest));
            if rest.len() > MOST {
                return false;
            }
            left = rest;
        }
        left.is_empty()
    }
}

impl std::fmt::Display for Extent {
    /// As in the file: first and last along each axis.
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let ([a, c, e], [b, d, g]) = (self.low, self.high);
        write!(f, "{a} {} {c} {} {e} {}", b - 1, d - 1, g - 1)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_box_is_covered_when_each_point_is_in_a_piece() {
        let of = |[a, b, c, d, e, f]: [i64; 6]| Extent { low: [a, c, e], high: [b, d, f] };
        let whole = of([0, 4, -2, 3, 5, 9]);
        let halves = [of([0, 3, -2, 3, 5, 9]), of([2, 4, -2, 3, 5, 9])];
        assert!(whole.is_covered(halves.into_iter()));
        assert!(!whole.is_covered(halves.into_iter().take(1)));
        // All but one corner.
        let but = [of([1, 4, -2, 3, 5, 9]), of([0, 1, -1, 3, 5, 9]), of([0, 1, -2, -1, 6, 9])];
        assert!(!whole.is_covered(but.into_iter()));
        assert!(whole.is_covered(but.into_iter().chain([of([0, 1, -2, -1, 5, 6])])));
        assert_eq!((whole.cells().dims(), whole.dims()), ([3, 4, 3], [4, 5, 4]));
        assert_eq!(of([3, 4, 0, 2, 0, 9]).cells().dims(), [1, 1, 8]);
        assert_eq!(whole.to_string(), "0 3 -2 2 5 8");
    }
}
