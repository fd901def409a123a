//! Where slices belong whose places along the stack are known: one after the other, with some missing, or unevenly.

use super::geometry::{Builder, Plan, UNEVEN, short};
use super::series::Frame;
use crate::{Error, Result};

/// A slice may lie so much of a step beside its regular place. Positions are often written with few digits.
const BESIDE: f64 = 0.02;
/// A slice at an end of the stack is no part of it where it lies more than so many steps away from the others.
const STRAY: f64 = 4.0;
/// Fewest slices that say how large a step is.
const FEWEST: usize = 4;
/// Slices that are made up where some are missing or uneven: at most so many in all for each one that is there.
const MOST_TIMES: usize = 4;

fn gaps(along: &[f64]) -> Vec<f64> {
    along.windows(2).map(|w| w[1] - w[0]).collect()
}

/// The usual distance from slice to slice.
fn usual(gaps: &[f64]) -> f64 {
    let mut sorted = gaps.to_vec();
    sorted.sort_by(f64::total_cmp);
    sorted[(sorted.len() - 1) / 2]
}

/// Whether slices `whole` steps apart from each other are where they belong, or distances are.
fn is_regular(along: &[f64], whole: &[f64], step: f64) -> bool {
    let even = gaps(along).iter().zip(whole).all(|(gap, k)| (gap - k * step).abs() <= UNEVEN * k * step);
    let mut place = along[0];
    even || along[1..].iter().zip(whole).all(|(at, k)| {
        place += k * step;
        (at - place).abs() <= BESIDE * step
    })
}

impl Builder<'_> {
    /// Leaves out a slice that lies far away from all others at an end.
    fn leave_strays(&mut self, slices: &mut Vec<Frame>, along: &mut Vec<f64>) {
        for at_end in [false, true] {
            let n = along.len();
            if n < FEWEST {
                return;
            }
            let gaps = gaps(along);
            let gap = if at_end { gaps[n - 2] } else { gaps[0] };
            if gap > STRAY * (1.0 + UNEVEN) * usual(&gaps) {
                let at = if at_end { n - 1 } else { 0 };
                along.remove(at);
                let name = self.name(&slices.remove(at));
                let step = short(usual(&gaps));
                self.notes.push(format!(
                    "Left out: {name}, which lies alone {} mm from the nearest of the other slices, which are {step} mm apart.",
                    short(gap)
                ));
            }
        }
    }

    /// Where slices belong that lie `along` so many millimetres: rising, two at least. A stray one is taken out of both lists.
    ///
    /// # Errors
    /// When too many slices would have to be made up.
    pub(super) fn plan(&mut self, slices: &mut Vec<Frame>, along: &mut Vec<f64>) -> Result<Plan> {
        self.leave_strays(slices, along);
        let n = along.len();
        let range = along[n - 1] - along[0];
        let gaps = gaps(along);
        if is_regular(along, &vec![1.0; n - 1], range / (n - 1) as f64) {
            return Ok(Plan::Direct);
        }
        let smallest = gaps.iter().fold(f64::INFINITY, |a, &b| a.min(b));
        let most = gaps.iter().fold(0.0, |a: f64, &b| a.max(b));
        // Never coarser than the smallest distance, but for what a step may be beside its place.
        let regular = libm::ceil(range / smallest - BESIDE).max(1.0);
        let whole: Vec<f64> = gaps.iter().map(|gap| libm::rint(gap / smallest).max(1.0)).collect();
        let steps = whole.iter().sum::<f64>();
        let is_filled = is_regular(along, &whole, range / steps);
        if if is_filled { steps } else { regular } + 1.0 > (MOST_TIMES * n) as f64 {
            // One far away, or two that are nearly in the same place.
            let far = most > STRAY * usual(&gaps);
            let at = gaps.iter().position(|&gap| gap == if far { most } else { smallest }).unwrap_or(0);
            let (gap, second) = (short(gaps[at]), self.name(&slices[at + 1]));
            let what = format!(
                "lies {gap} mm from the next slice, {second}, where {} mm is usual: more than {MOST_TIMES} times as many slices as there are \
                 would have to be made up; {}",
                short(usual(&gaps)),
                if far { "take away the slices on one side of the gap" } else { "take one of the two away" }
            );
            return Err(Error::format(self.name(&slices[at]), what));
        }
        if is_filled {
            let count = steps as usize + 1;
            let wide: Vec<usize> = (0..gaps.len()).filter(|&i| whole[i] > 1.0).collect();
            let shown: Vec<String> = wide.iter().take(4).map(|&i| format!("{} and {} mm", short(along[i]), short(along[i + 1]))).collect();
            let more = if wide.len() > 4 { format!(" and {} more", wide.len() - 4) } else { String::new() };
            self.notes.push(format!(
                "Slices are missing: {} of {count}, between {}{more} along the normal; they are interpolated linearly.",
                count - n,
                shown.join(", ")
            ));
            let mut place = 0;
            let places = std::iter::once(0).chain(whole.iter().map(|k| {
                place += *k as usize;
                place
            }));
            return Ok(Plan::Fill { places: places.collect(), count });
        }
        let count = regular as usize + 1;
        let step = range / regular;
        self.notes.push(format!(
            "Slices are unevenly spaced, {} to {} mm: {count} slices {} mm apart are interpolated linearly between the {n} that are there.",
            short(smallest),
            short(most),
            short(step)
        ));
        let mut below = 0;
        let places = (0..count).map(|k| {
            let at = along[0] + step * k as f64;
            while below + 2 < n && along[below + 1] <= at {
                below += 1;
            }
            below as f64 + ((at - along[below]) / gaps[below]).clamp(0.0, 1.0)
        });
        Ok(Plan::Resample { places: places.collect() })
    }
}
