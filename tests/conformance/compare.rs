//! What two pictures differ by, and what may differ.

use super::draw::slice_count;
use super::scenes::Bits;
use super::slices::{Eye, cut, planes};
use glam::{DVec2, DVec3};
use slicestack::{Scene, Volume};

/// A step of 8 bits.
const STEP: f64 = 1.0 / 255.0;

/// Differences of two pictures over all components, in steps of 1/255.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Difference {
    /// Largest.
    pub(crate) most: f64,
    /// Largest where OpenGL drew the same fragments.
    pub(crate) most_inside: f64,
    /// Root of the mean square.
    pub(crate) rms: f64,
    /// Mean.
    pub(crate) mean: f64,
    /// Share of pixels with a component more than two steps apart.
    pub(crate) beyond: f64,
    /// Share of pixels with a component more than 1e-4 apart, though OpenGL drew the same fragments.
    pub(crate) apart: f64,
}

impl Difference {
    /// `outline`: pixels that have another number of fragments.
    pub(crate) fn new(ours: &[[f32; 4]], theirs: &[[f32; 4]], outline: &[bool]) -> Self {
        assert_eq!((ours.len(), ours.len()), (theirs.len(), outline.len()));
        let (mut most, mut most_inside, mut square, mut sum, mut beyond, mut apart) = (0.0f64, 0.0f64, 0.0, 0.0, 0, 0);
        for ((a, b), &outline) in ours.iter().zip(theirs).zip(outline) {
            let mut pixel = 0.0f64;
            for c in 0..4 {
                let d = (f64::from(a[c]) - f64::from(b[c])).abs() / STEP;
                // A NaN on either side is no small difference.
                pixel = if d.is_nan() { f64::INFINITY } else { pixel.max(d) };
                square += d * d;
                sum += d;
            }
            most = most.max(pixel);
            if !outline {
                most_inside = most_inside.max(pixel);
                apart += u32::from(pixel * STEP > 1e-4);
            }
            // Differences of exactly two steps come out a hair above in f32.
            beyond += u32::from(pixel > 2.0 + 1e-3);
        }
        let n = 4.0 * ours.len() as f64;
        let share = |count: u32| f64::from(count) / ours.len() as f64;
        Self { most, most_inside, rms: (square / n).sqrt(), mean: sum / n, beyond: share(beyond), apart: share(apart) }
    }

    /// Whether they are small enough for these numbers; else why not. Float pictures whose colours jump (`jumps`) may differ where a
    /// last bit decides on which side of the jump a fragment lies.
    pub(crate) fn check(&self, bits: Bits, jumps: bool) -> Result<(), String> {
        let held = match bits {
            Bits::Mixed | Bits::Sixteen => self.beyond <= 0.001 && self.rms <= 0.5,
            Bits::Float if jumps => self.apart <= 0.001,
            Bits::Float => self.most_inside * STEP <= 1e-4,
            Bits::Eight => self.beyond <= 0.005 && self.mean <= 0.3,
        };
        if held { Ok(()) } else { Err(format!("{self:.4?}")) }
    }

    /// As numbers in a line.
    pub(crate) fn line(&self) -> String {
        format!("{} {} {} {} {} {}", self.most, self.most_inside, self.rms, self.mean, self.beyond, self.apart)
    }

    pub(crate) fn from_line(line: &str) -> Self {
        let mut numbers = line.split(' ').map(|n| n.parse().unwrap());
        let mut next = || numbers.next().unwrap();
        Self { most: next(), most_inside: next(), rms: next(), mean: next(), beyond: next(), apart: next() }
    }
}

/// Fragments of two pictures, counted.
#[derive(Clone, Debug)]
pub(crate) struct Coverage {
    /// Fragments that OpenGL drew.
    pub(crate) fragments: f64,
    /// Fragments that one drew and the other did not, on outlines.
    pub(crate) outline: f64,
    /// Fragments that one drew and the other did not, elsewhere.
    pub(crate) inside: f64,
    /// Which pixels have another number of fragments.
    pub(crate) differs: Vec<bool>,
}

/// How far, in pixels, a drawn outline may lie from the exact one. Mesa's corners stand on a grid of 1/256 pixel, at most half a step in
/// x and in y from their place; the rest is for f32 in its transformations.
const OUTLINE: f64 = 0.005;

/// Counts fragments; those on the outline of a slice are told from others by geometry.
pub(crate) fn coverage(volume: &Volume, scene: &Scene, ours: &[[f32; 4]], theirs: &[[f32; 4]]) -> Coverage {
    let width = scene.size().0 as usize;
    let mut outlines: Option<Vec<Outline>> = None;
    let mut c = Coverage { fragments: 0.0, outline: 0.0, inside: 0.0, differs: vec![false; ours.len()] };
    for (i, (a, b)) in ours.iter().zip(theirs).enumerate() {
        let d = f64::from((a[0] - b[0]).abs());
        c.fragments += f64::from(b[0]);
        if d == 0.0 {
            continue;
        }
        c.differs[i] = true;
        let outlines = outlines.get_or_insert_with(|| outlines_of(volume, scene));
        let p = DVec2::new((i % width) as f64 + 0.5, (i / width) as f64 + 0.5);
        let near = outlines.iter().filter(|o| o.is_near(p)).count() as f64;
        c.outline += d.min(near);
        c.inside += (d - near).max(0.0);
    }
    c
}

impl Coverage {
    pub(crate) fn share(&self) -> f64 {
        self.outline / self.fragments.max(1.0)
    }

    pub(crate) fn check(&self) -> Result<(), String> {
        if self.inside > 0.0 {
            return Err(format!("{} fragments more or less away from every outline", self.inside));
        }
        if self.share() > 0.001 {
            return Err(format!("{} of {} fragments differ on outlines", self.outline, self.fragments));
        }
        Ok(())
    }
}

/// What a slice ends at.
struct Outline {
    sides: Vec<(DVec2, DVec2)>,
    /// Clip planes as functions a + b x + c y of window position.
    planes: Vec<DVec3>,
}

impl Outline {
    fn is_near(&self, p: DVec2) -> bool {
        let side = |&(a, b): &(DVec2, DVec2)| {
            let t = ((p - a).dot(b - a) / (b - a).length_squared()).clamp(0.0, 1.0);
            (a + (b - a) * t - p).length() <= OUTLINE
        };
        let plane = |f: &DVec3| (f.x + f.y * p.x + f.z * p.y).abs() <= OUTLINE * DVec2::new(f.y, f.z).length();
        self.sides.iter().any(side) || self.planes.iter().any(plane)
    }
}

fn outlines_of(volume: &Volume, scene: &Scene) -> Vec<Outline> {
    let eye = Eye::new(scene);
    let back = eye.modelview.inverse();
    let outline = |d: f64| {
        let corners: Vec<DVec2> = cut(volume, &eye, d).iter().map(|c| eye.window(c.eye)).collect();
        let sides = (0..corners.len()).map(|i| (corners[i], corners[(i + 1) % corners.len()])).collect();
        let planes = scene.clip_planes().iter().map(|plane| {
            // Affine on the slice: three values tell.
            let at = |x: f64, y: f64| plane.distance(back.transform_point3(eye.unproject(x, y, d)));
            let a = at(0.0, 0.0);
            DVec3::new(a, at(1.0, 0.0) - a, at(0.0, 1.0) - a)
        });
        Outline { sides, planes: planes.collect() }
    };
    planes(volume, &eye, slice_count(scene)).depths.into_iter().map(outline).collect()
}
