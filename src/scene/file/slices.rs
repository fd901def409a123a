//! The section `[slices]`: how many slices there are, how a slab is integrated, and how slabs are blended.

use super::section::{Context, Data, Given, Rivals, choices};
use crate::Result;
use crate::scene::{Accumulation, Blend, Ends, Method, Order, SampleAt, Scene, SlabForm, Slicing};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Error of colours that is asked for unless the scene says otherwise: one of 256 levels. Rings are gone by then.
const USUAL_TOLERANCE: f64 = 0.004;

/// Most slices that a spacing of half a voxel comes to.
const MOST_USUAL: f64 = 4096.0;

#[derive(Debug, Clone, Default, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub(super) struct SliceKeys {
    /// Number of slices through the box's depth. Unless count, spacing or tolerance is given: a tolerance of 0.004, one of 256 levels, where colours are
    /// blended; a spacing of half a voxel for projections and surfaces, and for algorithms that go ray by ray; 256 in the profile opengl.
    pub count: Option<u64>,
    /// Distance of slices, world units, instead of their number.
    pub spacing: Option<f64>,
    /// Root-mean-square error of the colours to stay below, instead of a number of slices.
    pub tolerance: Option<f64>,
    /// Which slice is blended first: front-to-back (the default) or back-to-front (the default in the profile opengl).
    pub order: Option<OrderKey>,
    /// Transmittance below which a pixel is finished; 1/1024 unless given, 0 = never.
    pub terminate: Option<f64>,
    /// Opacity of a slab: exponential (1 - exp(-kappa L), the default) or riemann (kappa L, for comparison).
    pub slab: Option<SlabKey>,
    /// Where in its slab a value is taken: center (the default) or end (for comparison).
    pub sample: Option<SampleKey>,
    /// What the outermost fragments stand for: partial slabs (the default) or whole ones, as in OpenGL.
    pub ends: Option<EndsKey>,
    /// Sums over slices: auto (the default), plain, or compensated, which a million slices need.
    pub accumulation: Option<AccumulationKey>,
    /// Whether pictures of N and 2 N slices are extrapolated to infinitely many.
    pub extrapolate: Option<bool>,
    /// Whether three slabs or nine become one where colour and opacity hardly change, or hardly any light comes from; always where a tolerance is given.
    pub merge: Option<bool>,
    /// A seed: each pixel's slices are shifted by a part of a slab that depends on its place and on this, so that rings of too few slices become noise.
    pub jitter: Option<u32>,
}

choices! {
    OrderKey => Order { FrontToBack, BackToFront }
    SlabKey => SlabForm { Exponential, Riemann }
    SampleKey => SampleAt { Center, End }
    EndsKey => Ends { Partial, Whole }
    AccumulationKey => Accumulation { Auto, Plain, Compensated }
}

pub(super) const RIVALS: &[Rivals] = &[
    (&["slices.count"], &["slices.spacing", "slices.tolerance"]),
    (&["slices.spacing"], &["slices.count", "slices.tolerance"]),
    (&["slices.tolerance"], &["slices.count", "slices.spacing"]),
];

impl SliceKeys {
    /// The keys that say what the slices of `scene` are. What has no effect there is left out: the profile opengl draws every slice as a whole
    /// slab, and slabs are merged where they are blended over each other front to back.
    pub(super) fn of(scene: &Scene) -> Self {
        let (count, spacing, tolerance) = match scene.slicing() {
            Slicing::Count(n) => (Some(n), None, None),
            Slicing::Spacing(s) => (None, Some(s), None),
            Slicing::Tolerance(t) => (None, None, Some(t)),
        };
        let (m, accurate) = (scene.method(), scene.opengl().is_none());
        let merge = m.merge && scene.blend() == Blend::Over && scene.blending_order() == Order::FrontToBack;
        Self {
            count,
            spacing,
            tolerance,
            order: Some(scene.order().into()),
            terminate: accurate.then_some(scene.terminate().into()),
            slab: accurate.then_some(m.slab.into()),
            sample: accurate.then_some(m.sample.into()),
            ends: (accurate || m.ends == Ends::Whole).then_some(m.ends.into()),
            accumulation: accurate.then_some(m.accumulation.into()),
            extrapolate: accurate.then_some(m.extrapolate),
            merge: merge.then_some(true),
            jitter: scene.jitter(),
        }
    }

    /// `scene` with its slices. The section `[opengl]` has been applied before, because it sets another order.
    pub(super) fn apply(&self, cx: &Context<'_>, mut scene: Scene) -> Result<Scene> {
        if scene.opengl().is_some() {
            cx.refuse(&self.accurate_alone(), "belongs to the profile accurate; opengl draws every slice as a whole slab")?;
        }
        if let Some(slicing) = self.slicing(cx)? {
            scene = scene.with_slices(slicing)?;
        }
        if let Some(order) = self.order {
            scene = scene.with_order(order.into());
        }
        if let Some(t) = self.terminate {
            scene = scene.with_terminate(t as f32)?;
        }
        scene.with_jitter(self.jitter)
    }

    /// Refuses to merge slabs of a scene whose other sections leave no room for it.
    pub(super) fn check_merge(&self, cx: &Context<'_>, scene: &Scene) -> Result<()> {
        let back = self.merge == Some(true) && scene.blending_order() == Order::BackToFront;
        cx.refuse(&[("slices.merge", back)], "is for slices blended front to back: it goes by the light that they still get through")
    }

    /// The part of the method that stands in this section.
    pub(super) fn method(&self, mut method: Method) -> Method {
        method.slab = self.slab.map_or(method.slab, SlabForm::from);
        method.sample = self.sample.map_or(method.sample, SampleAt::from);
        method.ends = self.ends.map_or(method.ends, Ends::from);
        method.accumulation = self.accumulation.map_or(method.accumulation, Accumulation::from);
        method.extrapolate = self.extrapolate.unwrap_or(method.extrapolate);
        method.merge = self.merge.unwrap_or(method.merge);
        method
    }

    /// Whether the number of slices, their distance or an error is given.
    pub(super) fn says_slices(&self) -> bool {
        self.count.is_some() || self.spacing.is_some() || self.tolerance.is_some()
    }

    /// Slices that leave no rings, where none are asked for; tells of a key that a tolerance overrules.
    pub(super) fn finish(&self, data: &mut Data<'_>) -> Result<()> {
        if !self.says_slices() && data.scene.opengl().is_none() {
            let scene = data.scene.clone();
            let tolerant = scene.blend().blends_colors().then(|| scene.clone().with_slices(Slicing::Tolerance(USUAL_TOLERANCE)));
            let cast = scene.algorithm().is_cast();
            data.scene = match tolerant {
                Some(Ok(scene)) => scene,
                _ => {
                    let grid = data.volume.grid();
                    let spacing = (0.5 * grid.smallest_spacing()).max(2.0 * grid.radius() / MOST_USUAL);
                    let name = scene.algorithm().name();
                    if cast && scene.algorithm().has_steps() {
                        data.notes.push(format!(
                            "samples lie {spacing} world units apart, at half a voxel: render.algorithm = \"{name}\" does not choose them for an error"
                        ));
                    }
                    scene.with_slices(Slicing::Spacing(spacing))?
                }
            };
        } else if self.says_slices() && !data.scene.algorithm().has_steps() {
            let key = if self.count.is_some() { "slices.count" } else { "slices.spacing" };
            let name = data.scene.algorithm().name();
            data.notes.push(format!("{key} is not heeded: render.algorithm = \"{name}\" goes from voxel to voxel"));
        }
        if self.merge == Some(false) && self.tolerance.is_some() && data.volume.scalars().is_some() {
            data.warnings.push("slices.merge = false is not heeded: to a tolerance slabs are merged where that will do".to_owned());
        }
        Ok(())
    }

    /// Keys that say nothing to the profile opengl.
    fn accurate_alone(&self) -> [Given; 8] {
        [
            ("slices.tolerance", self.tolerance.is_some()),
            ("slices.terminate", self.terminate.is_some()),
            ("slices.slab", self.slab.is_some()),
            ("slices.sample", self.sample.is_some()),
            // Whole slabs are what it draws.
            ("slices.ends", self.ends == Some(EndsKey::Partial)),
            ("slices.accumulation", self.accumulation.is_some()),
            ("slices.extrapolate", self.extrapolate.is_some()),
            ("slices.merge", self.merge.is_some()),
        ]
    }

    fn slicing(&self, cx: &Context<'_>) -> Result<Option<Slicing>> {
        Ok(match (self.count, self.spacing, self.tolerance) {
            (None, None, None) => None,
            (Some(n), None, None) => Some(Slicing::Count(n)),
            (None, Some(s), None) => Some(Slicing::Spacing(s)),
            (None, None, Some(t)) => Some(Slicing::Tolerance(t)),
            (count, ..) => {
                let (key, others) = if count.is_some() {
                    ("slices.count", "slices.spacing or slices.tolerance")
                } else {
                    ("slices.spacing", "slices.tolerance")
                };
                return Err(cx.error(key, format!("{others} is given too; give one of them")));
            }
        })
    }
}
