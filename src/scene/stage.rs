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

/// A stage, in the order that fragments go through them.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
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
    /// Whether it runs where values are projected (mip, average, ...), and colours are not blended. `No`: it is left out there, and the list
    /// of what was left out says why.
    pub projections: Fits,
    /// Whether one slab may stand for three or nine in its scenes: whether what it does to a thick slab is what it does to thin ones. `No`,
    /// as for the two fields below: such a scene is refused.
    pub merging: Fits,
    /// Whether it runs on slabs between two values (pre-integrated).
    pub pairs: Fits,
    /// Whether the profile opengl draws it.
    pub opengl: Fits,
    /// Why empty space cannot be skipped in a scene that asks for it, where that is so: it shows where classification shows nothing.
    pub shows_in_empty_space: fn(&Scene) -> Option<&'static str>,
}

impl StageId {
    /// All stages, in their order.
    pub const ALL: [Self; 10] = [
        Self::Span,
        Self::Texcoord,
        Self::Fetch,
        Self::Guard,
        Self::Keep,
        Self::Classify,
        Self::Correct,
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
}

impl OptionalStage {
    /// All of them, in their order.
    pub const ALL: [Self; 1] = [Self::Fog];

    /// What it is called, does and sets.
    pub const fn info(self) -> StageInfo {
        match self {
            Self::Fog => {
                StageInfo { name: "fog", about: "mixes the colour with the fog's, the more the farther away", sets: &[Quantity::Color] }
            }
        }
    }

    /// What it answers for itself.
    pub fn option(self) -> StageOption {
        match self {
            Self::Fog => StageOption {
                key: "fog mode",
                wanted: |scene| scene.fog().is_some(),
                absent: "the scene has none",
                projections: Fits::No("values are projected, colours are not blended"),
                merging: Fits::Yes,
                pairs: Fits::Yes,
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
