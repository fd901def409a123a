//! The methods that are compared, by name.

use crate::scene::{Accumulation, Algorithm, Classification, Ends, Filter, Method, Projection, SampleAt, SlabForm, Target};
use crate::{Error, Result, Scene};

/// A way to integrate, under the name it has in reports.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct NamedMethod {
    /// Its name.
    pub name: &'static str,
    /// What it does, in half a line.
    pub about: &'static str,
    /// The choices it stands for.
    pub method: Method,
    /// What draws, where that is not what draws the scene.
    pub algorithm: Option<Algorithm>,
    /// A seed of jitter, where stacks are shifted pixel by pixel although the scene does not ask for it.
    pub jitter: Option<u32>,
    /// Whether slices are chosen block by block for an error asked for; else pictures of ever more slices are made.
    pub tolerance: bool,
    /// Why more slices do not lead to the reference, for methods that solve another problem.
    pub other_limit: Option<&'static str>,
    /// Slices that the series of pictures starts from.
    pub first: u64,
}

impl NamedMethod {
    /// The order at which its error is expected to fall on smooth scenes; `None` where no slice count is chosen.
    pub fn expected_order(&self) -> Option<u32> {
        if self.tolerance {
            return None;
        }
        // An extrapolation takes the leading term away.
        Some(self.method.order() + u32::from(self.method.extrapolate))
    }

    /// Whether it is a choice for pictures, and not there to be compared with: its error goes on falling, and at the order of its rule.
    pub fn is_a_choice(&self) -> bool {
        let m = &self.method;
        if self.jitter.is_some() {
            return false;
        }
        let plain = Method { classification: Classification::Post, extrapolate: false, merge: false, ..*m } == BASE;
        plain && m.classification != Classification::Pre
    }

    /// Whether level surfaces are drawn as it says: they are met between slices, so that slabs and their sums do not matter, and only how values
    /// are looked up and how many slices there are does.
    pub(super) fn is_for_surfaces(&self) -> bool {
        let flat = self.algorithm.is_none() && self.jitter.is_none();
        flat && !self.method.filter.is_cubic() && Method { filter: BASE.filter, ..self.method } == BASE
    }

    /// `scene` drawn by it.
    ///
    /// # Errors
    /// [`Error::Invalid`] where the scene has parts that do not go together with it, and where it draws what another method draws already.
    pub fn of(&self, scene: &Scene) -> Result<Scene> {
        let mut scene = scene.clone().with_method(self.method)?;
        if let Some(algorithm) = self.algorithm {
            if algorithm == Algorithm::Shells && !matches!(scene.camera().projection(), Projection::Perspective { .. }) {
                return Err(Error::invalid("along parallel rays shells are slices: their pictures are those of midpoint"));
            }
            scene = scene.with_algorithm(algorithm)?;
        }
        if self.jitter.is_some() {
            scene = scene.with_jitter(self.jitter)?;
        }
        Ok(scene)
    }

    /// The method called `name`.
    ///
    /// # Errors
    /// [`Error::Invalid`] that tells the nearest name.
    pub fn named(name: &str) -> Result<&'static Self> {
        METHODS.iter().find(|m| m.name == name).ok_or_else(|| {
            let nearest = METHODS.iter().map(|m| (strsim::levenshtein(name, m.name), m.name)).min();
            // A guess that keeps less than half of the letters helps nobody.
            let hint = match nearest.filter(|n| 2 * n.0 <= n.1.len()) {
                Some((_, nearest)) => format!("did you mean \"{nearest}\"?"),
                None => format!("there are {}", METHODS.iter().map(|m| m.name).collect::<Vec<_>>().join(", ")),
            };
            Error::invalid(format!("method \"{name}\" is not known: {hint}"))
        })
    }
}

const BASE: Method = Method {
    classification: Classification::Post,
    filter: Filter::Linear,
    slab: SlabForm::Exponential,
    sample: SampleAt::Center,
    ends: Ends::Partial,
    target: Target::F32,
    accumulation: Accumulation::Auto,
    extrapolate: false,
    merge: false,
};

const PLAIN: NamedMethod = NamedMethod {
    name: "midpoint",
    about: "a sample in the middle of each slab: the default",
    method: BASE,
    algorithm: None,
    jitter: None,
    tolerance: false,
    other_limit: None,
    first: 32,
};

/// Slices from which the two ways to add up differ.
const LONG: u64 = 4096;

/// All of them, the default first.
pub const METHODS: &[NamedMethod] = &[
    PLAIN,
    NamedMethod {
        name: "tolerance",
        about: "slices, and slabs of second order where they pay, chosen block by block for the error asked for",
        tolerance: true,
        ..PLAIN
    },
    NamedMethod {
        name: "merged",
        about: "midpoint, but three or nine slabs as one where colour and opacity hardly change",
        method: Method { merge: true, ..BASE },
        ..PLAIN
    },
    NamedMethod {
        name: "pre-integrated",
        about: "the transfer function integrated over each slab, between the values on its two sides",
        method: Method { classification: Classification::PreIntegrated, ..BASE },
        ..PLAIN
    },
    NamedMethod {
        name: "second-order",
        about: "pre-integrated, with the values' curvature along the ray",
        method: Method { classification: Classification::SecondOrder, ..BASE },
        ..PLAIN
    },
    NamedMethod {
        name: "midpoint-richardson",
        about: "pictures of N and 2 N slices, extrapolated",
        method: Method { extrapolate: true, ..BASE },
        ..PLAIN
    },
    NamedMethod {
        name: "pre-integrated-richardson",
        about: "pre-integrated pictures of N and 2 N slices, extrapolated",
        method: Method { classification: Classification::PreIntegrated, extrapolate: true, ..BASE },
        ..PLAIN
    },
    NamedMethod {
        name: "midpoint-whole",
        about: "whole slabs where the ray enters and leaves the box, as in OpenGL",
        method: Method { ends: Ends::Whole, ..BASE },
        ..PLAIN
    },
    NamedMethod {
        name: "end-sample",
        about: "a sample at the far side of each slab",
        method: Method { sample: SampleAt::End, ..BASE },
        ..PLAIN
    },
    NamedMethod {
        name: "riemann",
        about: "opacity kappa L instead of 1 - exp(-kappa L): explicit Euler",
        method: Method { slab: SlabForm::Riemann, ..BASE },
        ..PLAIN
    },
    NamedMethod { name: "unorm8", about: "blended in 8 bits a component", method: Method { target: Target::Unorm8, ..BASE }, ..PLAIN },
    NamedMethod {
        name: "pre-classified",
        about: "voxels classified, their colours interpolated",
        method: Method { classification: Classification::Pre, ..BASE },
        other_limit: Some("interpolates colours instead of values"),
        ..PLAIN
    },
    NamedMethod {
        name: "nearest",
        about: "the nearest voxel instead of the eight around",
        method: Method { filter: Filter::Nearest, ..BASE },
        other_limit: Some("shows a field of blocks instead of the interpolated one"),
        ..PLAIN
    },
    NamedMethod {
        name: "plain-f32",
        about: "very many slices added up in plain f32",
        method: Method { accumulation: Accumulation::Plain, ..BASE },
        first: LONG,
        ..PLAIN
    },
    NamedMethod {
        name: "compensated-f32",
        about: "very many slices added up in f32 with what rounding lost",
        method: Method { accumulation: Accumulation::Compensated, ..BASE },
        first: LONG,
        ..PLAIN
    },
    NamedMethod {
        name: "cubic",
        about: "midpoint on the cubic spline through the voxels, held against the reference of that spline",
        method: Method { filter: Filter::CUBIC, ..BASE },
        ..PLAIN
    },
    NamedMethod {
        name: "shells",
        about: "midpoint on spherical shells about the eye, equally far apart on all rays",
        algorithm: Some(Algorithm::Shells),
        ..PLAIN
    },
    NamedMethod { name: "jitter", about: "midpoint, each pixel's slices shifted: noise in the place of rings", jitter: Some(0), ..PLAIN },
];

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test fails by panicking")]
mod tests {
    use super::*;

    #[test]
    fn names_are_found_and_near_misses_told() {
        for m in METHODS {
            assert_eq!(NamedMethod::named(m.name).unwrap().name, m.name);
            assert_eq!(METHODS.iter().filter(|n| n.name == m.name).count(), 1);
        }
        let said = NamedMethod::named("pre-intergated").unwrap_err().to_string();
        assert!(said.contains("\"pre-integrated\""), "{said}");
        assert!(NamedMethod::named("foo").unwrap_err().to_string().contains("there are midpoint, "));
    }

    #[test]
    fn orders_are_those_of_the_choices() {
        let order = |name: &str| NamedMethod::named(name).unwrap().expected_order();
        assert_eq!(["midpoint", "second-order", "riemann", "end-sample", "midpoint-whole"].map(order), [2, 3, 1, 1, 1].map(Some));
        assert_eq!(order("tolerance"), None);
    }

    #[test]
    fn surfaces_know_no_slabs() {
        let found: Vec<&str> = METHODS.iter().filter(|m| m.is_for_surfaces()).map(|m| m.name).collect();
        assert_eq!(found, ["midpoint", "tolerance", "nearest"]);
    }
}
