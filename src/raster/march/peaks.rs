//! The slices of a projection of the largest value (or the smallest), those of the highest bricks first: what is left then cannot change a pixel, mostly.
//!
//! ```text
//!   runs of slices     2   7   3   9   9   1       9 first: a pixel that has seen more than 7 stands for needs no 7 and nothing lower; once
//!   by class                       ^   ^           that holds for all pixels of the block all the rest is passed over
//! ```
//! The largest of some numbers is the same whatever order they come in, so the bytes are those of all slices one after the other. Where the transfer
//! function is flat at its ends it does not matter how large or small a value is: pixels that have seen one of those look no further.
//!
//! First local maxima at or above a threshold are looked for front to back. Runs that stay below it hold none: they are passed over unless a pixel waits for
//! its values to fall. Pixels that have seen no value at the threshold then show their largest one, which is looked for as above.

use super::March;
use crate::fragment::Frame;
use crate::lanes::BATCH;
use crate::plan::Peaks;
use crate::raster::observer::Observer;
use crate::skip::BOXES;

/// Runs that are put in order together.
const TOGETHER: usize = 16 * BOXES;

/// What a march over peaks goes by.
#[derive(Clone, Copy)]
struct Search<'f, 'v> {
    peaks: &'f Peaks<'v>,
    /// Slices of the block.
    slices: (i64, i64),
    /// The first of the runs at hand.
    first: i64,
    /// Pixels that any slice covers, one bit each.
    covered: u64,
}

impl<'v> Search<'_, 'v> {
    /// The number that no lookup in a run with this mark is above; see [`March::marks`].
    fn bound(&self, mark: u8) -> f32 {
        // The last mark stands for two classes, neither of which has a bound.
        self.peaks.table.bound(if mark == u8::MAX { u8::MAX } else { mark - 1 })
    }
}

impl<'f, 'v, W: Observer> March<'_, 'f, 'v, W> {
    /// Slices `from..to`, but for those on which no value can change a pixel.
    #[inline(never)]
    pub(super) fn peaks(&mut self, peaks: &'f Peaks<'v>, from: i64, to: i64) {
        let slices = self.work.runs.slices;
        let (first, end) = (from / slices, (to - 1) / slices + 1);
        // What was passed over before has to be known in the end.
        if peaks.to_the_end.is_some() && end - first > TOGETHER as i64 {
            self.run(from, to);
            return;
        }
        self.settle();
        let pixels = &self.batch.pixels;
        let covered = (0..BATCH).fold(0, |bits, i| bits | u64::from(pixels.first[i] <= pixels.last[i]) << i);
        let mut search = Search { peaks, slices: (from, to), first, covered };
        while search.first < end {
            let count = ((end - search.first) as usize).min(TOGETHER);
            let mut marks = [0; TOGETHER];
            let marks = &mut marks[..count];
            self.marks(search, marks);
            match &peaks.to_the_end {
                None => self.highest_first(search, marks, self.work.frame),
                Some(to_the_end) => {
                    self.first_maxima(search, marks);
                    self.highest_first(search, marks, to_the_end);
                }
            }
            search.first += count as i64;
        }
        self.batch.pixels.alive = u64::MAX;
    }

    /// One more than the class of each run: 0 stands for a run that is done.
    fn marks(&self, search: Search<'f, 'v>, marks: &mut [u8]) {
        let slices = self.work.runs.slices;
        for (n, marks) in marks.chunks_mut(BOXES).enumerate() {
            let mut classes = [0; BOXES];
            let run = search.first + (n * BOXES) as i64;
            self.work.query_boxes(&self.transform, &search.peaks.table.windows, (run * slices, slices), marks.len(), &mut classes);
            marks.iter_mut().zip(classes).for_each(|(mark, class)| *mark = class.saturating_add(1));
        }
    }

    /// The slices of run `run` of those at hand.
    fn of_run(&self, search: Search<'f, 'v>, run: usize) -> (i64, i64) {
        let (slices, run) = (self.work.runs.slices, search.first + run as i64);
        ((run * slices).max(search.slices.0), ((run + 1) * slices).min(search.slices.1))
    }

    /// Pixels whose result does not stand yet, one bit each.
    fn unfinished(&self) -> u64 {
        self.batch.pixels.transmittance.iter().rev().fold(0, |bits, &t| bits << 1 | u64::from(t > 0.0))
    }

    /// Pixels of a search that a value up to `bound` may change.
    fn open(&self, search: Search<'f, 'v>, bound: f32) -> u64 {
        let seen = usize::from(search.peaks.to_the_end.is_some());
        let enough = search.peaks.enough(bound);
        self.work.open_to(enough, &self.batch.pixels.color[seen]) & search.covered & self.unfinished()
    }

    /// The slices of the runs that are not done, those that reach highest first, by the numbers of `frame`.
    fn highest_first(&mut self, search: Search<'f, 'v>, marks: &mut [u8], frame: &'f Frame<'v>) {
        while let Some(highest) = marks.iter().copied().max().filter(|&highest| highest > 0) {
            let bound = search.bound(highest);
            if self.open(search, bound) == 0 {
                for run in (0..marks.len()).filter(|&run| marks[run] > 0) {
                    let (first, end) = self.of_run(search, run);
                    self.pass_over(first, end);
                }
                return;
            }
            for run in 0..marks.len() {
                if marks[run] != highest {
                    continue;
                }
                marks[run] = 0;
                let (first, end) = self.of_run(search, run);
                for k in first..end {
                    let open = self.open(search, bound);
                    if open == 0 {
                        self.pass_over(k, end);
                        break;
                    }
                    // Rows of pixels that have seen as much are left out.
                    self.batch.pixels.alive = open;
                    self.slice_not_inlined(k, frame);
                }
            }
        }
    }

    /// The slices of the runs that reach the level, and of those behind them in which pixels wait for their values to fall, nearest first. The other runs
    /// are left for pixels without a maximum.
    fn first_maxima(&mut self, search: Search<'f, 'v>, marks: &mut [u8]) {
        let level = self.work.frame.blend.level;
        for run in 0..marks.len() {
            if search.bound(marks[run]) < level {
                let below = self.work.open_to(level, &self.batch.pixels.color[0]);
                if !below & self.unfinished() & self.batch.pixels.alive == 0 {
                    continue;
                }
            }
            marks[run] = 0;
            let (first, end) = self.of_run(search, run);
            if !self.run(first, end) {
                // Every pixel is finished, or has left the box.
                marks[run..].fill(0);
                let rest = (run + 1..marks.len()).map(|run| self.of_run(search, run)).fold(end, |end, (_, last)| end.max(last));
                self.count_finished(end, rest);
                return;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Blend, Camera, Filter, Method, Placement, Projection, Slicing, TransferFunction};
    use crate::volume::{Grid, Voxels};
    use crate::{Renderer, Scene, Settings, Volume};

    /// Sees every batch, and so all of them.
    struct Witness;

    impl Observer for Witness {
        fn fresh(&self) -> Self {
            Self
        }

        fn merge(&mut self, Self: Self) {}
    }

    const DIMS: [usize; 3] = [40, 33, 29];

    fn volumes() -> Vec<Volume> {
        let at = |i: usize| [i % DIMS[0], i / DIMS[0] % DIMS[1], i / (DIMS[0] * DIMS[1])];
        let bodies = |i: usize| {
            let [x, y, z] = at(i);
            let noise = (i.wrapping_mul(2_654_435_761) >> 9) % 12;
            (noise + if (x / 9 + y / 7 + z / 8) % 4 == 0 { 180 } else { x / 3 }) as f64
        };
        let all = 0..DIMS.iter().product::<usize>();
        let bytes: Vec<u8> = all.clone().map(|i| bodies(i) as u8).collect();
        // Nothing but the least value around a ball of the greatest.
        let ball = |i: usize| if at(i).iter().zip(DIMS).all(|(&n, of)| n.abs_diff(of / 2) < 8) { 250 } else { 3 };
        let flat: Vec<u16> = all.clone().map(ball).collect();
        let holes: Vec<f32> = all.clone().map(|i| if i % 97 == 0 { f32::NAN } else { bodies(i) as f32 * 0.37 - 20.0 }).collect();
        let wide: Vec<f64> = all.map(|i| 1e9 + bodies(i)).collect();
        let grid = Grid::with_spacing(DIMS, [1.0, 1.2, 0.8]).unwrap();
        [Voxels::U8(bytes.into()), Voxels::U16(flat.into()), Voxels::F32(holes.into()), Voxels::F64(wide.into())]
            .into_iter()
            .flat_map(|voxels| {
                [1.0, -0.5].map(|slope| Volume::new(grid.clone(), voxels.clone()).unwrap().with_rescale(slope, 7.0).unwrap())
            })
            .collect()
    }

    #[test]
    fn pictures_are_those_of_all_slices_to_the_bit() {
        let mut saved = 0;
        for volume in volumes() {
            let (min, max) = (volume.statistics().min, volume.statistics().max);
            let wide = TransferFunction::new(vec![(min, [0.0, 0.5, 1.0]), (max, [1.0, 0.0, 0.2])], vec![(min, 1.0)]).unwrap();
            let at = |share: f64| min + share * (max - min);
            let ends = vec![(at(0.3), [0.0, 0.5, 1.0]), (at(0.6), [1.0, 0.0, 0.2])];
            let narrow = TransferFunction::new(ends, vec![(at(0.1), 0.0), (at(0.35), 0.0), (at(0.35), 0.4), (at(0.5), 0.9)]).unwrap();
            let level = |share: f64| Blend::Lmip { threshold: min + share * (max - min) };
            for blend in [Blend::Mip, Blend::Min, level(0.7), level(0.2), level(1.0), level(1.1), level(-0.1)] {
                for (azimuth, zoom, projection, slices) in [
                    (25.0, 1.2, Projection::Orthographic { height: None }, 70),
                    (0.0, 1.0, Projection::Orthographic { height: None }, 29),
                    (140.0, 1.5, Projection::Perspective { fov_y: 60.0 }, 130),
                    // More runs than are put in order together.
                    (60.0, 2.5, Projection::Perspective { fov_y: 30.0 }, 6000),
                ] {
                    for (transfer, filter) in
                        [(&wide, Filter::Linear), (&narrow, Filter::Linear), (&narrow, Filter::Nearest), (&wide, Filter::CUBIC)]
                    {
                        let size = if slices > 1000 { (29, 27) } else { (93, 81) };
                        if slices > 1000 && filter != Filter::Linear {
                            continue;
                        }
                        let camera = Camera::new(Placement::Orbit { azimuth, elevation: 20.0, roll: 5.0, zoom }, projection).unwrap();
                        let scene = Scene::new(transfer.clone()).with_camera(camera).with_size(size.0, size.1).unwrap();
                        let scene = scene.with_slices(Slicing::Count(slices)).unwrap().with_blend(blend).unwrap();
                        let scene = scene.with_method(Method { filter, ..Method::default() }).unwrap();
                        // Blocks cut by tiles hold fewer pixels, and pass over other slices.
                        let (picture, stats) = Renderer::new(&volume, Settings::new().tile(13)).render(&scene).unwrap();
                        let (all, every, _) = Renderer::new(&volume, Settings::default()).render_observed(&scene, Witness).unwrap();
                        assert_eq!(picture.sha256(), all.sha256(), "{blend:?} {projection:?} {filter:?} {}", volume.voxels().voxel_type());
                        let t = stats.tally;
                        assert_eq!(t.fragments + t.corners, t.looked_up + t.empty + t.finished + t.merged);
                        saved += usize::from(4 * stats.fetches < 3 * every.fetches && t.empty_batches > 0);
                    }
                }
            }
        }
        assert!(saved > 60, "a quarter of the lookups saved in {saved} scenes only");
    }
}
