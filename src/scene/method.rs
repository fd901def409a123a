//! How the integral along a ray is turned into a sum over slabs: where values are taken, how a slab's opacity is computed, and in
//! which numbers slabs add up.
//!
//! The default is the best choice for most scenes; the others are for comparison, for teaching, and for the scenes they suit.

use crate::{Error, Result};

/// When values become colours.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[non_exhaustive]
pub enum Classification {
    /// Interpolate between voxels, then classify the value.
    #[default]
    Post,
    /// Classify the voxels, then interpolate premultiplied colours: what textures of colours do.
    Pre,
    /// Integrate the transfer function over each slab, between the values on its two sides: a table over both of them.
    PreIntegrated,
    /// As [`Classification::PreIntegrated`], with the values' curvature along the ray taken into account.
    SecondOrder,
}

/// What a lookup between voxels gives.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[non_exhaustive]
pub enum Filter {
    /// Trilinear interpolation of the eight voxels around.
    #[default]
    Linear,
    /// The nearest voxel.
    Nearest,
    /// The tricubic B-spline over the 4 x 4 x 4 voxels around: twice continuously differentiable, so that neither slopes nor curvature
    /// jump from cell to cell.
    Cubic {
        /// Whether the spline goes through the voxels: its coefficients are computed from them once (and kept as f32: four bytes a voxel),
        /// and between sharply different voxels its values leave their range. Otherwise the voxels are the coefficients, which smooths them.
        prefilter: bool,
    },
}

impl Filter {
    /// The spline that goes through the voxels.
    pub const CUBIC: Self = Self::Cubic { prefilter: true };

    /// Whether it is the spline, with coefficients of either kind.
    pub const fn is_cubic(self) -> bool {
        matches!(self, Self::Cubic { .. })
    }
}

/// How the opacity of a slab is computed from its extinction kappa and its length L.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[non_exhaustive]
pub enum SlabForm {
    /// Opacity 1 - exp(-kappa L): exact for constant kappa, stable for any.
    #[default]
    Exponential,
    /// Opacity kappa L, the explicit Euler step: of first order; past kappa L = 1 weights turn negative, past 2 they grow.
    Riemann,
}

/// Where in its slab a value is taken.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[non_exhaustive]
pub enum SampleAt {
    /// In the middle: of second order.
    #[default]
    Center,
    /// At the far side: of first order.
    End,
}

/// What the outermost fragments of a pixel stand for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Ends {
    /// The ray's way from the box's face to the next slab: the pieces add up to the ray's path through the box.
    #[default]
    Partial,
    /// Whole slabs, as in OpenGL: of first order.
    Whole,
}

/// Numbers that fragments are blended in.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[non_exhaustive]
pub enum Target {
    /// 32-bit floats.
    #[default]
    F32,
    /// 8 bits a component, 0 to 1, rounded to nearest after every blend.
    Unorm8,
    /// 16 bits a component, for the OpenGL profile.
    Unorm16,
}

/// How sums over many slices are kept in f32.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[non_exhaustive]
pub enum Accumulation {
    /// Compensated from [`Accumulation::MANY`] slices on, from 257 on where no slab's opacity is above 1/256, and in any number where none is above
    /// 2^-13; plain otherwise.
    #[default]
    Auto,
    /// One f32 a component: errors grow with the number of slices, and opacities below 2^-25 vanish.
    Plain,
    /// An f32 and what rounding has taken from it so far: as exact for a million slices as for ten.
    Compensated,
}

impl Accumulation {
    /// Slices from which [`Accumulation::Auto`] compensates.
    pub const MANY: u64 = 2048;

    /// Whether [`Accumulation::Auto`] compensates in fewer than [`Accumulation::MANY`] slices, whose strongest slab has an opacity of `strongest`.
    ///
    /// Plain sums round 1 - a, slab after slab, by up to 2^-25: that is a part of 2^-25 / a of a faint opacity, and adds up to N 2^-25 where
    /// slabs are too weak to hide what has gone wrong before. So errors stay below 1e-5, and below 1e-3 of the opacity.
    pub(crate) fn is_faint(slices: u64, strongest: f64) -> bool {
        const FAINTEST: f64 = 1.0 / 8192.0;
        const FAINT: f64 = 1.0 / 256.0;
        const SOME: u64 = 256;
        strongest > 0.0 && (strongest <= FAINTEST || slices > SOME && strongest <= FAINT)
    }
}

/// All of these choices together.
///
/// ```
/// use slicestack::scene::{Classification, Method};
///
/// let method = Method::default().with_classification(Classification::PreIntegrated).with_extrapolate(true);
/// assert!(method.is_pre_integrated());
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[non_exhaustive]
pub struct Method {
    /// When values become colours.
    pub classification: Classification,
    /// What a lookup between voxels gives.
    pub filter: Filter,
    /// How the opacity of a slab is computed.
    pub slab: SlabForm,
    /// Where in its slab a value is taken.
    pub sample: SampleAt,
    /// What the outermost fragments stand for.
    pub ends: Ends,
    /// Numbers that fragments are blended in.
    pub target: Target,
    /// How sums are kept.
    pub accumulation: Accumulation,
    /// Whether pictures of N and 2 N slices are extrapolated to infinitely many (Richardson), by the method's order.
    pub extrapolate: bool,
    /// Whether three slabs or nine become one where colour and opacity hardly change, or hardly any light comes from.
    pub merge: bool,
}

impl Method {
    /// The method with values that become colours at another time.
    #[must_use]
    pub const fn with_classification(mut self, classification: Classification) -> Self {
        self.classification = classification;
        self
    }

    /// The method with another lookup between voxels.
    #[must_use]
    pub const fn with_filter(mut self, filter: Filter) -> Self {
        self.filter = filter;
        self
    }

    /// The method with another form of slabs.
    #[must_use]
    pub const fn with_slab(mut self, slab: SlabForm) -> Self {
        self.slab = slab;
        self
    }

    /// The method with values from another place in each slab.
    #[must_use]
    pub const fn with_sample(mut self, sample: SampleAt) -> Self {
        self.sample = sample;
        self
    }

    /// The method with outermost fragments that stand for something else.
    #[must_use]
    pub const fn with_ends(mut self, ends: Ends) -> Self {
        self.ends = ends;
        self
    }

    /// The method that blends fragments in other numbers.
    #[must_use]
    pub const fn with_target(mut self, target: Target) -> Self {
        self.target = target;
        self
    }

    /// The method that keeps its sums another way.
    #[must_use]
    pub const fn with_accumulation(mut self, accumulation: Accumulation) -> Self {
        self.accumulation = accumulation;
        self
    }

    /// The method with or without extrapolation to infinitely many slices.
    #[must_use]
    pub const fn with_extrapolate(mut self, extrapolate: bool) -> Self {
        self.extrapolate = extrapolate;
        self
    }

    /// The method that lets three slabs or nine be one, or does not.
    #[must_use]
    pub const fn with_merge(mut self, merge: bool) -> Self {
        self.merge = merge;
        self
    }

    /// Whether values on both sides of a slab are looked at.
    pub fn is_pre_integrated(&self) -> bool {
        matches!(self.classification, Classification::PreIntegrated | Classification::SecondOrder)
    }

    /// Order of the error in the thickness of slabs, on smooth scenes: 1, 2 or 3.
    pub fn order(&self) -> u32 {
        let first =
            self.ends == Ends::Whole || self.sample == SampleAt::End || self.slab == SlabForm::Riemann || self.filter == Filter::Nearest;
        match self.classification {
            // Interpolated opacities of slabs are not the slab's of interpolated extinction.
            Classification::Pre => 1,
            _ if first => 1,
            Classification::SecondOrder => 3,
            Classification::Post | Classification::PreIntegrated => 2,
        }
    }

    /// # Errors
    /// [`Error::Invalid`] for choices that exclude each other.
    pub(super) fn check(&self) -> Result<()> {
        let plain = Self { accumulation: self.accumulation, ends: self.ends, merge: self.merge, ..Self::default() };
        if self.merge && *self != plain {
            let others = [
                ("values classified after interpolation (transfer.classification post)", self.classification != plain.classification),
                ("the linear filter (render.filter)", self.filter != plain.filter),
                ("exponential slabs (slices.slab)", self.slab != plain.slab),
                ("values from the middle of slabs (slices.sample center)", self.sample != plain.sample),
                ("the target f32 (render.target)", self.target != plain.target),
                ("pictures that are not extrapolated (slices.extrapolate)", self.extrapolate),
            ];
            let wants: Vec<&str> = others.iter().filter(|(_, other)| *other).map(|(what, _)| *what).collect();
            return Err(Error::invalid(format!("slices merge: is for {}", wants.join(" and "))));
        }
        if self.filter.is_cubic() && self.classification == Classification::Pre {
            return Err(Error::invalid("render filter cubic: is computed from values, and pre-classified voxels are colours; choose post"));
        }
        if self.is_pre_integrated() && self.slab == SlabForm::Riemann {
            return Err(Error::invalid("slices slab riemann: pre-integrated slabs are integrals already; choose exponential"));
        }
        if self.is_pre_integrated() && self.sample == SampleAt::End {
            return Err(Error::invalid("slices sample end: pre-integrated slabs are sampled on both sides; choose center"));
        }
        if self.target == Target::Unorm8 && self.extrapolate {
            return Err(Error::invalid("slices extrapolate: rounding to 8 bits leaves no series to extrapolate; choose target f32"));
        }
        if self.slab == SlabForm::Riemann && self.accumulation == Accumulation::Compensated {
            return Err(Error::invalid("slices accumulation compensated: riemann slabs have errors of their own; choose exponential"));
        }
        if self.target == Target::Unorm8 && self.accumulation == Accumulation::Compensated {
            return Err(Error::invalid("slices accumulation compensated: is for target f32"));
        }
        Ok(())
    }
}
