//! Regions of space with a transfer function of their own: focus and context.
//!
//! A transfer function says nothing about position; a region is the one exception. Inside it another function holds, so that what lies
//! there can be shown in other colours, or through all that is around it.

use super::{Blend, Classification, Scene, TransferFunction};
use crate::{Error, Result};
use glam::DVec3;

/// Most regions of a scene.
pub const MAX_FOCUS_REGIONS: usize = 8;

/// Where a region lies. All in world units; faces belong to it.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum FocusShape {
    /// Everything no farther from the centre than this.
    Sphere {
        /// Radius, above 0.
        radius: f64,
    },
    /// A box with faces across the world's axes.
    Box {
        /// Lengths along x, y and z, above 0.
        size: [f64; 3],
    },
}

/// A region of space, and the transfer function that holds in it.
#[derive(Debug, Clone, PartialEq)]
pub struct FocusRegion {
    shape: FocusShape,
    center: DVec3,
    transfer: TransferFunction,
}

impl FocusRegion {
    /// The region of `shape` about `center`, world space, through `transfer`, whose opacities refer to a length of its own.
    ///
    /// # Errors
    /// [`Error::Invalid`] for a length that is not positive and finite, a centre that is not finite, and a function with a gradient opacity.
    pub fn new(shape: FocusShape, center: DVec3, transfer: TransferFunction) -> Result<Self> {
        let lengths = match shape {
            FocusShape::Sphere { radius } => [radius; 3],
            FocusShape::Box { size } => size,
        };
        if let Some(x) = lengths.iter().find(|x| !(**x > 0.0 && x.is_finite())) {
            return Err(Error::invalid(format!("region size {x}: must be positive and finite")));
        }
        if !center.is_finite() {
            return Err(Error::invalid(format!("region center {center}: must be finite")));
        }
        if !transfer.gradient_opacity().is_empty() {
            return Err(Error::invalid("region: its transfer function has an opacity by gradient, which regions have not"));
        }
        Ok(Self { shape, center, transfer })
    }

    /// Its shape.
    pub fn shape(&self) -> FocusShape {
        self.shape
    }

    /// Its centre, world space.
    pub fn center(&self) -> DVec3 {
        self.center
    }

    /// The transfer function that holds in it.
    pub fn transfer(&self) -> &TransferFunction {
        &self.transfer
    }

    /// Whether it holds a point in the world.
    pub fn holds(&self, point: DVec3) -> bool {
        let from = point - self.center;
        match self.shape {
            FocusShape::Sphere { radius } => from.length_squared() <= radius * radius,
            FocusShape::Box { size } => (0..3).all(|axis| from[axis].abs() <= 0.5 * size[axis]),
        }
    }

    /// Whether it may hold points of the box of `grid`; where it does not, it never does.
    #[cfg(feature = "scene-file")]
    pub(crate) fn touches(&self, grid: &crate::volume::Grid) -> bool {
        self.share(&grid.corners(), 0.0) != Share::None
    }

    /// What it and a body with these `corners` have in common: none of it, all of it, or some. Its faces count as `margin` thick, and where that
    /// leaves a doubt it is some.
    pub(crate) fn share(&self, corners: &[DVec3; 8], margin: f64) -> Share {
        let (low, high) = corners.iter().fold((corners[0], corners[0]), |(low, high), &c| (low.min(c), high.max(c)));
        let (within, touches) = match self.shape {
            FocusShape::Sphere { radius } => {
                let middle = (low + high) * 0.5;
                let reach = corners.iter().map(|c| c.distance(middle)).fold(0.0, f64::max);
                let farthest = corners.iter().map(|c| c.distance(self.center)).fold(0.0, f64::max);
                (farthest <= radius - margin, middle.distance(self.center) <= radius + reach + margin)
            }
            FocusShape::Box { size } => {
                let half = DVec3::from_array(size) * 0.5;
                let (first, last) = (low - self.center, high - self.center);
                let within = (0..3).all(|i| first[i] >= margin - half[i] && last[i] <= half[i] - margin);
                (within, (0..3).all(|i| first[i] <= half[i] + margin && last[i] >= -half[i] - margin))
            }
        };
        match (within, touches) {
            (true, _) => Share::All,
            (false, true) => Share::Some,
            (false, false) => Share::None,
        }
    }
}

/// How much of a body lies in a region.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Share {
    None,
    Some,
    All,
}

impl Scene {
    /// The scene with regions in which other transfer functions hold; where several hold a point, the first of them.
    ///
    /// # Errors
    /// [`Error::Invalid`] for more than [`MAX_FOCUS_REGIONS`], and together with what has no regions: pre-classification, pre-integrated slabs, opacity by gradient,
    /// [`super::Method::merge`], projections of values, level surfaces, the profile `opengl`.
    pub fn with_regions(mut self, regions: Vec<FocusRegion>) -> Result<Self> {
        if regions.len() > MAX_FOCUS_REGIONS {
            return Err(Error::invalid(format!("{} regions: at most {MAX_FOCUS_REGIONS} are allowed", regions.len())));
        }
        self.regions = regions;
        self.agreed()
    }

    /// Regions in which other transfer functions hold.
    pub fn regions(&self) -> &[FocusRegion] {
        &self.regions
    }

    /// Regions in amounts of light.
    pub(super) fn regions_in_light(&self) -> Vec<FocusRegion> {
        let turned = |r: &FocusRegion| r.transfer.with_colors(|rgb| rgb.map(super::linear_light::to_linear));
        self.regions.iter().map(|r| FocusRegion { transfer: turned(r), ..r.clone() }).collect()
    }

    /// Refuses regions where they do not go together with the rest of the scene.
    pub(super) fn check_regions(&self) -> Result<()> {
        if self.regions.is_empty() {
            return Ok(());
        }
        let no = |why: &str| Err(Error::invalid(format!("region: {why}")));
        if self.method.classification == Classification::Pre {
            return no("values are classified after they are interpolated, where the place is known; choose transfer.classification post");
        }
        if self.opacity_by_gradient() {
            return no("does not go together with opacity by gradient, which is the whole volume's");
        }
        if matches!(self.blend, Blend::Iso { .. } | Blend::Surfaces) {
            return no("does not go together with level surfaces (render blend iso), which have colours of their own");
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test fails by panicking")]
    use super::*;

    fn region(shape: FocusShape) -> FocusRegion {
        let transfer = TransferFunction::new(vec![(0.0, [1.0; 3])], vec![(0.0, 1.0)]).unwrap();
        FocusRegion::new(shape, DVec3::new(1.0, -2.0, 3.0), transfer).unwrap()
    }

    #[test]
    fn a_body_is_within_beside_or_across_as_its_points_are() {
        for r in [region(FocusShape::Sphere { radius: 2.0 }), region(FocusShape::Box { size: [3.0, 2.0, 5.0] })] {
            let mut counts = [0; 3];
            for n in 0..4000u32 {
                let at = |k: u32| f64::from(n.wrapping_mul(2_654_435_761).rotate_left(k * 9) % 1000) / 100.0 - 5.0;
                let low = r.center() + DVec3::new(at(1), at(2), at(3));
                let size = DVec3::new(0.7, 0.4, 1.1);
                let corner = |c: u32| low + DVec3::new(f64::from(c & 1), f64::from(c >> 1 & 1), f64::from(c >> 2)) * size;
                let share = r.share(&std::array::from_fn(|c| corner(c as u32)), 1e-6);
                // Points of the body, one by one.
                let inside = (0..1000).filter(|&i| {
                    let p = DVec3::new(f64::from(i % 10), f64::from(i / 10 % 10), f64::from(i / 100)) / 9.0;
                    r.holds(low + p * size)
                });
                match inside.count() {
                    0 => assert_ne!(share, Share::All),
                    1000 => assert_ne!(share, Share::None),
                    _ => assert_eq!(share, Share::Some),
                }
                counts[share as usize] += 1;
            }
            assert!(counts.iter().all(|&c| c > 5), "{counts:?}");
        }
    }

    #[test]
    fn regions_are_checked_and_the_first_that_holds_a_point_counts() {
        let transfer = |a: f64| TransferFunction::new(vec![(0.0, [1.0; 3])], vec![(0.0, a)]).unwrap();
        let new = |shape, center| FocusRegion::new(shape, center, transfer(0.5));
        assert!(new(FocusShape::Sphere { radius: 0.0 }, DVec3::ZERO).unwrap_err().to_string().contains("region size 0"));
        assert!(new(FocusShape::Box { size: [1.0, f64::INFINITY, 1.0] }, DVec3::ZERO).is_err());
        assert!(new(FocusShape::Sphere { radius: 1.0 }, DVec3::NAN).is_err());
        let by_gradient = transfer(0.5).with_gradient_opacity(vec![(1.0, 0.0), (2.0, 1.0)]).unwrap();
        assert!(FocusRegion::new(FocusShape::Sphere { radius: 1.0 }, DVec3::ZERO, by_gradient.clone()).is_err());
        let ball = FocusRegion::new(FocusShape::Sphere { radius: 2.0 }, DVec3::ZERO, transfer(0.25)).unwrap();
        let cube = FocusRegion::new(FocusShape::Box { size: [6.0; 3] }, DVec3::ZERO, transfer(0.5)).unwrap();
        let scene = Scene::new(transfer(0.75)).with_regions(vec![ball.clone(), cube]).unwrap();
        let first = |x: f64| scene.regions().iter().find(|r| r.holds(DVec3::X * x));
        let alpha = |x: f64| first(x).map_or(0.75, |r| r.transfer().eval(7.0).alpha);
        assert_eq!([0.0, 2.0, 2.1, 3.0, 3.1].map(alpha), [0.25, 0.25, 0.5, 0.5, 0.75]);
        assert!(scene.clone().with_regions(vec![ball; 9]).is_err());
        assert!(scene.with_transfer(by_gradient).check().unwrap_err().to_string().contains("opacity by gradient"));
    }
}
