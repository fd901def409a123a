//! The stages that fragments go through, each declared once.
//!
//! A stage is a step that 64 fragments take together: see `fragment`. Every room that has to know of one reads this list: the plan (which
//! stages run, and what is said of those that do not), the checks of a [`Scene`], the record and the page of `explain`. The kernel of a stage
//! that scenes may ask for is in `fragment`, what the truth does about it in `reference`: both match on [`OptionalStage`] without a wildcard, so
//! that a stage without an answer there does not compile.
//!
//! To add a stage that scenes may ask for: a variant of [`OptionalStage`] here, with its [`StageInfo`] and [`StageOption`]; a setting in
//! [`Scene`] whose setter returns a `Result` and ends with `agreed`, which checks what it goes together with (see `with_linear_light`); its key
//! in the scene file; its kernel in `fragment`; the answer of `reference`. One that OpenGL draws too is drawn in `opengl`.

use super::{FogWeighting, Scene};
use std::cmp::Ordering;

/// A stage, in the order that fragments go through them.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum StageId {
    /// Which fragments a slice covers, and how long their pieces of the ray are.
    Span,
    /// Where in the volume fragments lie.
    Texcoord,
    /// Voxels around a fragment, interpolated.
    Fetch,
    /// Fragments whose value is NaN or infinite are not covered.
    Guard,
    /// Values are kept for the next slice, without colours.
    Keep,
    /// From values to premultiplied colour and opacity of slabs.
    Classify,
    /// Opacity for the true length of a piece of the ray.
    Correct,
    /// A stage that scenes may ask for.
    Optional(OptionalStage),
    /// Fragments that are not covered become transparent.
    Mask,
    /// Fragments are added to what their pixels have gathered.
    Blend,
}

/// A stage that scenes may ask for, in the order that fragments go through them.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[non_exhaustive]
pub enum OptionalStage {
    /// Colour and opacity by the transfer function of the region that a fragment lies in.
    Regions,
    /// Segments of a label map hidden, tinted or replaced.
    Labels,
    /// The gradient of the values at a fragment.
    Gradient,
    /// Opacity by the gradient's size.
    GradientOpacity,
    /// Colour and opacity by value and gradient.
    Transfer2d,
    /// Light.
    Light,
    /// Fog between the eye and a fragment.
    Fog,
}

/// What a stage may set in a batch.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[non_exhaustive]
pub enum Quantity {
    /// Whether the fragment is covered.
    Covered,
    /// Length of its piece of the ray, in slabs.
    Length,
    /// The cell of eight voxels that it lies in.
    Cell,
    /// Where in its cell it lies, 0 to 1 along each axis.
    Weight,
    /// The interpolated value.
    Value,
    /// Direction against the gradient, world space, of length 1.
    Normal,
    /// Size of the gradient, data units per world unit.
    Steepness,
    /// Premultiplied colour of its slab.
    Color,
    /// Opacity of its slab.
    Alpha,
    /// Colour that its pixel has gathered.
    Sum,
    /// Transmittance left to its pixel.
    Transmittance,
}

/// Whether a stage goes together with something, or why it does not.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Fits {
    /// It does.
    Yes,
    /// It does not, for this reason.
    No(&'static str),
}

/// What becomes of a stage where values are projected, and colours are not blended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum InProjections {
    /// It runs.
    Runs,
    /// It is left out, and the list of what was left out says why.
    LeftOut(&'static str),
    /// A scene that asks for it is refused, for this reason. Level surfaces, which are no values, are not refused: light and normals are taken
    /// where rays meet them, and not stage by stage.
    Refused(&'static str),
}

impl InProjections {
    /// Why a projection of values is refused, where it is.
    pub(super) fn refusal(self) -> Fits {
        match self {
            Self::Refused(why) => Fits::No(why),
            Self::Runs | Self::LeftOut(_) => Fits::Yes,
        }
    }

    /// Why the stage does not run, where it does not.
    pub(crate) fn left_out(self) -> Option<&'static str> {
        match self {
            Self::Runs => None,
            Self::LeftOut(why) | Self::Refused(why) => Some(why),
        }
    }
}

/// What a stage is called, does and sets.
#[derive(Debug, Clone, Copy)]
#[non_exhaustive]
pub struct StageInfo {
    /// Its name on the teaching page, in reports and benches.
    pub name: &'static str,
    /// What it does, one sentence, for the teaching page.
    pub about: &'static str,
    /// What it sets.
    pub sets: &'static [Quantity],
}

/// What a stage that scenes may ask for answers for itself.
#[derive(Debug, Clone, Copy)]
pub struct StageOption {
    /// Section and key of the scene file that ask for it, for messages: `fog mode`.
    pub key: &'static str,
    /// Whether a scene asks for it.
    pub wanted: fn(&Scene) -> bool,
    /// What the list of what was left out says of scenes that do not ask for it: "the scene has none".
    pub absent: &'static str,
    /// What becomes of it where values are projected (mip, average, ...), and colours are not blended.
    pub projections: InProjections,
    /// Whether one slab may stand for three or nine in its scenes: whether what it does to a thick slab is what it does to thin ones. `No`,
    /// as for the two fields below: such a scene is refused.
    pub merging: Fits,
    /// Whether it runs on slabs between two values (pre-integrated).
    pub pairs: Fits,
    /// Whether it runs on Riemann's slabs, whose opacity may pass 1.
    pub riemann: Fits,
    /// Whether the profile opengl draws it.
    pub opengl: Fits,
    /// Why empty space cannot be skipped in a scene that asks for it, where that is so: it shows where classification shows nothing.
    pub shows_in_empty_space: fn(&Scene) -> Option<&'static str>,
}

impl StageId {
    /// All stages, in their order.
    pub const ALL: [Self; 16] = [
        Self::Span,
        Self::Texcoord,
        Self::Fetch,
        Self::Guard,
        Self::Keep,
        Self::Classify,
        Self::Optional(OptionalStage::Regions),
        Self::Optional(OptionalStage::Labels),
        Self::Correct,
        Self::Optional(OptionalStage::Gradient),
        Self::Optional(OptionalStage::GradientOpacity),
        Self::Optional(OptionalStage::Transfer2d),
        Self::Optional(OptionalStage::Light),
        Self::Optional(OptionalStage::Fog),
        Self::Mask,
        Self::Blend,
    ];

    /// What it is called, does and sets.
    pub const fn info(self) -> StageInfo {
        use Quantity::{Alpha, Cell, Color, Covered, Length, Sum, Transmittance, Value, Weight};
        match self {
            Self::Span => StageInfo {
                name: "span",
                about: "compares the slice with the first and last slice of each pixel's ray",
                sets: &[Covered, Length],
            },
            Self::Texcoord => StageInfo {
                name: "texcoord",
                about: "finds the cell of eight voxels that each fragment lies in, and where in it",
                sets: &[Cell, Weight],
            },
            Self::Fetch => {
                StageInfo { name: "fetch", about: "loads the voxels around each fragment and interpolates between them", sets: &[Value] }
            }
            Self::Guard => {
                StageInfo { name: "guard", about: "leaves out fragments whose value is NaN or infinite", sets: &[Value, Covered] }
            }
            Self::Keep => StageInfo { name: "keep", about: "keeps the values of a slice for the slab behind it", sets: &[Value] },
            Self::Classify => StageInfo {
                name: "classify",
                about: "looks colour and opacity of the slab up in the transfer function's table",
                sets: &[Color, Alpha],
            },
            Self::Correct => StageInfo {
                name: "correct",
                about: "turns the opacity of a slab into that of the true length of the ray's piece",
                sets: &[Color, Alpha],
            },
            Self::Optional(stage) => stage.info(),
            Self::Mask => {
                StageInfo { name: "mask", about: "makes fragments that the slice does not cover transparent", sets: &[Color, Alpha] }
            }
            Self::Blend => StageInfo {
                name: "blend",
                about: "adds the slab's colour, dimmed by what lies before it, to the pixel",
                sets: &[Sum, Transmittance],
            },
        }
    }

    /// Its name.
    pub const fn name(self) -> &'static str {
        self.info().name
    }

    /// Its place in the order: stages that say what whole slabs look like come before the one that knows the length of a piece, those that
    /// need that come after it.
    const fn rank(self) -> u8 {
        match self {
            Self::Span => 0,
            Self::Texcoord => 1,
            Self::Fetch => 2,
            Self::Guard => 3,
            Self::Keep => 4,
            Self::Classify => 5,
            Self::Optional(OptionalStage::Regions | OptionalStage::Labels) => 6,
            Self::Correct => 7,
            Self::Optional(_) => 8,
            Self::Mask => 9,
            Self::Blend => 10,
        }
    }
}

impl Ord for StageId {
    fn cmp(&self, other: &Self) -> Ordering {
        self.rank().cmp(&other.rank()).then_with(|| match (self, other) {
            (Self::Optional(a), Self::Optional(b)) => a.cmp(b),
            _ => Ordering::Equal,
        })
    }
}

impl PartialOrd for StageId {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl OptionalStage {
    /// All of them, in their order.
    pub const ALL: [Self; 7] =
        [Self::Regions, Self::Labels, Self::Gradient, Self::GradientOpacity, Self::Transfer2d, Self::Light, Self::Fog];

    /// What it is called, does and sets.
    pub const fn info(self) -> StageInfo {
        match self {
            Self::Regions => StageInfo {
                name: "regions",
                about: "looks colour and opacity up in the transfer function of the region that a fragment lies in",
                sets: &[Quantity::Color, Quantity::Alpha],
            },
            Self::Labels => StageInfo {
                name: "labels",
                about: "hides, tints or replaces segments: by the label of the voxel nearest to each fragment",
                sets: &[Quantity::Covered, Quantity::Color, Quantity::Alpha],
            },
            Self::Gradient => StageInfo {
                name: "gradient",
                about: "takes differences of the values around each fragment that shows: which way, and how steeply, they fall",
                sets: &[Quantity::Normal, Quantity::Steepness],
            },
            Self::GradientOpacity => StageInfo {
                name: "gradient opacity",
                about: "turns optical depth into opacity, by a factor that depends on the gradient's size",
                sets: &[Quantity::Color, Quantity::Alpha],
            },
            Self::Transfer2d => StageInfo {
                name: "classify by gradient",
                about: "adds up what the regions of the transfer function give for the value and the size of its gradient",
                sets: &[Quantity::Color, Quantity::Alpha],
            },
            Self::Light => StageInfo {
                name: "light",
                about: "lights the colour: dark where the surface turns away from a light, bright where it mirrors one",
                sets: &[Quantity::Color],
            },
            Self::Fog => {
                StageInfo { name: "fog", about: "mixes the colour with the fog's, the more the farther away", sets: &[Quantity::Color] }
            }
        }
    }

    /// What it answers for itself.
    pub fn option(self) -> StageOption {
        const SURFACES: InProjections = InProjections::Refused("values are projected, and have no surface to light");
        const SLABS: Fits = Fits::No("light changes from slab to slab where values do not");
        const BY_PLACE: Fits = Fits::No("what lies side by side in space need not look alike where values do");
        const BETWEEN: Fits = Fits::No("a slab between two values lies in two places; choose post");
        match self {
            Self::Regions => StageOption {
                key: "region",
                wanted: |scene| !scene.regions().is_empty(),
                absent: "the scene has none",
                projections: InProjections::Refused("values are projected, and classified once a pixel"),
                merging: BY_PLACE,
                pairs: BETWEEN,
                riemann: Fits::Yes,
                opengl: Fits::No("OpenGL's tables know values alone"),
                shows_in_empty_space: |_| None,
            },
            Self::Labels => StageOption {
                key: "labels",
                wanted: Scene::uses_labels,
                absent: "no segment is hidden, tinted or replaced",
                projections: InProjections::Runs,
                merging: BY_PLACE,
                pairs: BETWEEN,
                riemann: Fits::Yes,
                opengl: Fits::No("OpenGL's textures hold no labels here"),
                shows_in_empty_space: |_| None,
            },
            Self::Gradient => StageOption {
                key: "light gradient",
                wanted: Scene::needs_gradient,
                absent: "nothing in the scene depends on it",
                projections: InProjections::LeftOut("nothing depends on it before a pixel is finished"),
                merging: Fits::Yes,
                pairs: Fits::Yes,
                riemann: Fits::Yes,
                opengl: Fits::Yes,
                shows_in_empty_space: |_| None,
            },
            Self::GradientOpacity => StageOption {
                key: "transfer gradient_opacity",
                wanted: |scene| !scene.transfer().gradient_opacity().is_empty() && scene.transfer2d().is_none(),
                absent: "the transfer function has no factor by gradient",
                projections: InProjections::Refused("values are projected, opacities are not"),
                merging: Fits::No("gradients change from slab to slab where values do not"),
                pairs: Fits::No("a slab between two values has no gradient of its own; choose post"),
                riemann: Fits::No("is for slabs of the form exponential"),
                opengl: Fits::No("OpenGL's textures hold no gradients here"),
                shows_in_empty_space: |_| None,
            },
            Self::Transfer2d => StageOption {
                key: "transfer2d",
                wanted: |scene| scene.transfer2d().is_some(),
                absent: "the transfer function is none of value and gradient",
                projections: InProjections::Refused("values are projected, and colours are not looked up by gradient"),
                merging: Fits::No("gradients change from slab to slab where values do not"),
                pairs: Fits::No("a slab between two values has no gradient of its own; choose post"),
                riemann: Fits::No("is for slabs of the form exponential"),
                opengl: Fits::No("OpenGL's textures hold no gradients here"),
                shows_in_empty_space: |_| None,
            },
            Self::Light => StageOption {
                key: "light",
                wanted: |scene| scene.lighting().is_some(),
                absent: "the scene has no light",
                projections: SURFACES,
                merging: SLABS,
                pairs: Fits::Yes,
                riemann: Fits::Yes,
                opengl: Fits::No("OpenGL lights vertices, and slices have no surface's"),
                shows_in_empty_space: |_| None,
            },
            Self::Fog => StageOption {
                key: "fog mode",
                wanted: |scene| scene.fog().is_some(),
                absent: "the scene has none",
                projections: InProjections::LeftOut("values are projected, colours are not blended"),
                merging: Fits::Yes,
                pairs: Fits::Yes,
                riemann: Fits::Yes,
                opengl: Fits::Yes,
                // Literal fog adds its colour whatever a fragment's opacity: that is its mistake, and it is reproduced.
                shows_in_empty_space: |scene| {
                    let literal = scene.fog().is_some_and(|f| f.weighting() == FogWeighting::Literal);
                    literal.then_some("literal fog lights up empty slices too")
                },
            },
        }
    }

    /// Those that `scene` asks for.
    pub fn wanted(scene: &Scene) -> impl Iterator<Item = Self> + '_ {
        Self::ALL.into_iter().filter(|stage| (stage.option().wanted)(scene))
    }
}

impl Quantity {
    /// Its name in records.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Covered => "covered",
            Self::Length => "length",
            Self::Cell => "cell",
            Self::Weight => "weight",
            Self::Value => "value",
            Self::Normal => "normal",
            Self::Steepness => "steepness",
            Self::Color => "color",
            Self::Alpha => "alpha",
            Self::Sum => "sum",
            Self::Transmittance => "transmittance",
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stages_are_in_order_and_have_names_of_their_own() {
        assert!(StageId::ALL.windows(2).all(|w| w[0] < w[1]));
        let optional: Vec<StageId> = OptionalStage::ALL.map(StageId::Optional).to_vec();
        assert_eq!(StageId::ALL.iter().copied().filter(|id| matches!(id, StageId::Optional(_))).collect::<Vec<_>>(), optional);
        let mut names: Vec<&str> = StageId::ALL.iter().map(|id| id.name()).collect();
        names.sort_unstable();
        names.dedup();
        assert_eq!(names.len(), StageId::ALL.len());
        assert!(StageId::ALL.iter().all(|id| !id.info().about.is_empty() && !id.info().sets.is_empty()));
    }
}
