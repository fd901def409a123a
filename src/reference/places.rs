//! What values look like at a place: which transfer function holds there, and what becomes of the segment that the place belongs to.
//!
//! Along a ray that changes at faces only: of regions (a sphere's are roots of a quadratic, a box's lie on planes) and halfway between voxels, where the
//! nearest label changes. Rays are cut there, and between two cuts everything is as it was.

use super::segments::Segments;
use crate::scene::{FocusRegion, FocusShape, Scene, SegmentEffect, TransferFunction};
use crate::volume::{Grid, LabelMap, Volume};
use crate::{Error, Result};
use glam::DVec3;

/// What values look like at some places.
#[derive(Debug, Clone)]
pub(super) struct Look {
    pub(super) segments: Segments,
    /// Length that its opacities refer to.
    pub(super) unit: f64,
}

/// All looks of one scene over one volume.
#[derive(Debug, Clone)]
pub(super) struct Places<'a> {
    regions: Vec<FocusRegion>,
    labels: Option<Labels<'a>>,
    /// By effect; then by region, the main transfer function last. Nothing where nothing shows.
    looks: Vec<Vec<Option<Look>>>,
}

#[derive(Debug, Clone)]
struct Labels<'a> {
    map: &'a LabelMap,
    dims: [usize; 3],
    /// Of each label, in the order of the map's values: which effect.
    effect: Vec<usize>,
}

impl<'a> Places<'a> {
    /// Those of `scene`, whose main transfer function is `main` and refers to lengths of `unit`; colours are turned by `turn`.
    ///
    /// # Errors
    /// [`Error::Invalid`] where the scene asks for labels and the volume has none.
    pub(super) fn new(
        scene: &Scene,
        volume: &'a Volume,
        (main, unit): (&TransferFunction, f64),
        turn: impl Fn(f64) -> f64,
    ) -> Result<Self> {
        let mut functions = Vec::new();
        for region in scene.regions() {
            let own = region.transfer();
            let color = own.color().iter().map(|&(value, rgb)| (value, rgb.map(&turn))).collect();
            functions.push((TransferFunction::new(color, own.opacity().to_vec())?, own.opacity_length(volume.grid())));
        }
        functions.push((main.clone(), unit));
        let mut effects = vec![SegmentEffect::Show];
        let mut labels = None;
        let used: Vec<_> = scene.segments().iter().filter(|s| s.effect() != SegmentEffect::Show).collect();
        if !used.is_empty() {
            let Some(map) = volume.labels() else {
                return Err(Error::invalid("labels segment: the volume has no label map"));
            };
            let mut effect = vec![0; map.values().len()];
            for style in used {
                let Some(at) = map.values().iter().position(|&label| label == style.label()) else { continue };
                effect[at] = effects.iter().position(|&e| e == style.effect()).unwrap_or_else(|| {
                    effects.push(style.effect());
                    effects.len() - 1
                });
            }
            labels = Some(Labels { map, dims: volume.grid().dims(), effect });
        }
        let look = |effect: SegmentEffect, (function, own): &(TransferFunction, f64)| -> Result<Option<Look>> {
            Ok(match effect {
                SegmentEffect::Show => Some(Look { segments: Segments::new(function), unit: *own }),
                SegmentEffect::Hide => None,
                SegmentEffect::Tint { color, strength } => {
                    // Linear in the colour: points may be tinted in the place of what lies between them.
                    let tinted = |rgb: [f64; 3]| {
                        let luminance = 0.2126 * rgb[0] + 0.7152 * rgb[1] + 0.0722 * rgb[2];
                        [0, 1, 2].map(|c: usize| ((1.0 - strength) * rgb[c] + strength * luminance * turn(color[c])).clamp(0.0, 1.0))
                    };
                    let color = function.color().iter().map(|&(value, rgb)| (value, tinted(rgb))).collect();
                    Some(Look { segments: Segments::new(&TransferFunction::new(color, function.opacity().to_vec())?), unit: *own })
                }
                SegmentEffect::Replace { color, opacity } => {
                    let constant = TransferFunction::new(vec![(0.0, color.map(&turn))], vec![(0.0, opacity)])?;
                    Some(Look { segments: Segments::new(&constant), unit })
                }
            })
        };
        let looks = effects.iter().map(|&e| functions.iter().map(|f| look(e, f)).collect()).collect::<Result<_>>()?;
        Ok(Self { regions: scene.regions().to_vec(), labels, looks })
    }

    /// What values look like at a point, given in the world and in index space; nothing where nothing shows.
    pub(super) fn look(&self, world: DVec3, index: DVec3) -> Option<&Look> {
        let effect = self.labels.as_ref().map_or(0, |labels| {
            let [x, y, z] = [0, 1, 2].map(|axis: usize| ((index[axis] + 0.5).floor().max(0.0) as usize).min(labels.dims[axis] - 1));
            let label = labels.map.label((z * labels.dims[1] + y) * labels.dims[0] + x);
            labels.map.values().binary_search(&label).map_or(0, |at| labels.effect[at])
        });
        let inside = |region: &FocusRegion| {
            let from = world - region.center();
            match region.shape() {
                FocusShape::Sphere { radius } => from.length() <= radius,
                FocusShape::Box { size } => (0..3).all(|axis| 2.0 * from[axis].abs() <= size[axis]),
            }
        };
        let function = self.regions.iter().position(inside).unwrap_or(self.regions.len());
        self.looks[effect][function].as_ref()
    }

    /// Depths at which the ray from `origin` along `direction`, whose length is that of a unit of depth, passes a face of a region; and, between
    /// `entry` and `exit`, the middle between two voxels where labels count. Rising.
    pub(super) fn cuts(&self, (origin, direction): (DVec3, DVec3), grid: &Grid, (entry, exit): (f64, f64)) -> Vec<f64> {
        let mut cuts = Vec::new();
        for region in &self.regions {
            let from = origin - region.center();
            match region.shape() {
                FocusShape::Sphere { radius } => {
                    let (a, half, c) = (direction.length_squared(), direction.dot(from), from.length_squared() - radius * radius);
                    let root = (half * half - a * c).sqrt();
                    cuts.extend([(-half - root) / a, (-half + root) / a]);
                }
                FocusShape::Box { size } => {
                    let faces = |axis: usize| [-0.5, 0.5].map(|side| (side * size[axis] - from[axis]) / direction[axis]);
                    cuts.extend((0..3).flat_map(faces));
                }
            }
        }
        if self.labels.is_some() {
            let map = grid.world_to_index();
            let (at, step) = (map.transform_point3(origin), map.transform_vector3(direction));
            for axis in 0..3 {
                let ends = [at[axis] + step[axis] * entry, at[axis] + step[axis] * exit];
                let first = ends[0].min(ends[1]).floor().max(0.0);
                let last = ends[0].max(ends[1]).ceil().min((grid.dims()[axis] - 1) as f64);
                let mut low = first;
                while low < last {
                    cuts.push((low + 0.5 - at[axis]) / step[axis]);
                    low += 1.0;
                }
            }
        }
        // Also drops what is no number.
        cuts.retain(|&d| d > entry && d < exit);
        cuts.sort_by(f64::total_cmp);
        cuts
    }
}
