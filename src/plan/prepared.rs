//! What is made once for a volume, or for a volume and a transfer function, and kept between frames.

use super::Scaling;
use super::colors::{self, ColorData};
use super::scaling::value_range;
use crate::classify::{By, ChangeClasses, Classifier, Classify, Measure, Slab, strongest};
use crate::lanes::LookupTable;
use crate::proxy::Domain;
use crate::scene::{Scene, Surfaces, Transfer2d, TransferFunction};
use crate::skip::{BrickClasses, MERGED, PeakClasses, PeakTable, Runs, SkipTable};
use crate::volume::bricks::Bricks;
use crate::volume::packed::Packed;
use crate::volume::spline::Coefficients;
use crate::volume::{OpacityFrom, Volume};
use std::sync::Arc;

/// What depends on the volume alone, and on what is looked up in it: voxels, or a spline over them.
#[derive(Debug)]
pub(crate) struct VolumeData {
    /// Least and greatest value of each brick.
    pub(crate) bricks: Arc<Bricks>,
    /// The spline's coefficients, where that is looked up.
    pub(crate) coefficients: Option<Coefficients>,
    /// 8- and 16-bit voxels packed with their neighbours, where there is room.
    pub(crate) packed: Option<Packed>,
    /// How stored values become numbers.
    pub(crate) scaling: Scaling,
    /// Where voxels are colours: bricks are then those of the number that their opacity goes by.
    pub(crate) colors: Option<ColorData>,
}

impl VolumeData {
    /// All of it for `volume`; where that is a part of a larger one, tables are those of the whole `domain`.
    pub(crate) fn new(volume: &Volume, domain: Option<&Domain>) -> Self {
        let mut bricks = volume.bricks().clone();
        if let Some(domain) = domain {
            let part = Arc::make_mut(&mut bricks);
            (part.range, part.non_finite) = (domain.range(), domain.non_finite());
        }
        let scaling = Scaling::new(volume, &bricks);
        // Lookups that convert do not read packed voxels.
        let packed = if scaling.to_f32.is_none() { Packed::new(volume.voxels(), volume.grid().dims()) } else { None };
        Self { bricks, coefficients: None, packed, scaling, colors: None }
    }

    /// All of it for a piece of a larger volume, whose stored values lie in `range`: conversions and tables are made for that.
    pub(crate) fn of_piece(volume: &Volume, range: (f64, f64)) -> Self {
        let bricks = Arc::new(Bricks { range, ..Bricks::new(volume.voxels(), volume.grid().dims()) });
        let scaling = Scaling::new(volume, &bricks);
        let packed = if scaling.to_f32.is_none() { Packed::new(volume.voxels(), volume.grid().dims()) } else { None };
        Self { bricks, coefficients: None, packed, scaling, colors: None }
    }

    /// All of it for the colours of `volume`, whose opacities go by `from`; `None` for scalars and labels.
    pub(crate) fn of_colors(volume: &Volume, from: OpacityFrom) -> Option<Self> {
        let found = volume.color_bricks(from)?;
        let bricks = Arc::clone(&found.bricks);
        let colors = Some(ColorData::new(from, found.clamped));
        Some(Self { scaling: Scaling::new(volume, &bricks), bricks, coefficients: None, packed: None, colors })
    }

    /// All of it for the spline over `volume`, with or without `prefilter`; `None` where this machine does not give the memory for its coefficients.
    pub(crate) fn of_spline(volume: &Volume, prefilter: bool) -> Option<Self> {
        let dims = volume.grid().dims();
        let (scaling, map) = Scaling::of_spline(volume, volume.bricks());
        let coefficients = Coefficients::new(volume.voxels(), dims, map, prefilter)?;
        let bricks = Arc::new(coefficients.bricks(dims, map, volume.bricks().non_finite));
        Some(Self { bricks, coefficients: Some(coefficients), packed: None, scaling, colors: None })
    }
}

/// What classification by the value goes by in `scene`: its transfer function, or what one of two variables may show of each value; of colours the
/// opacity of the number that it goes by.
pub(super) fn classified_by(scene: &Scene, volume: &Volume, data: &VolumeData) -> TransferFunction {
    if let Some(colors) = &data.colors {
        return colors::opacities(scene, colors.from);
    }
    let (min, max) = data.bricks.range;
    let (min, max) = if min <= max { value_range(volume, min, max) } else { (0.0, 0.0) };
    scene.transfer2d().and_then(|t| t.shown(min, max).ok()).unwrap_or_else(|| scene.transfer().clone())
}

/// What tables depend on besides the volume.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct TransferKey {
    /// From values to colour and opacity per reference length.
    pub(crate) transfer: TransferFunction,
    /// Thickness of the slabs.
    pub(crate) slab: Slab,
    /// What the table goes by.
    pub(crate) by: By,
    /// A function of value and gradient, whose values `transfer` stands for.
    pub(crate) transfer2d: Option<Transfer2d>,
}

/// What depends on the volume, the transfer function and the thickness of slabs.
#[derive(Debug)]
pub(crate) struct TransferData {
    /// What it was made for.
    pub(crate) key: TransferKey,
    /// How values are classified.
    pub(crate) classifier: Classifier,
    /// Colour and opacity of slabs.
    pub(crate) table: Arc<LookupTable>,
    /// A table over values on their own, beside one over pairs.
    pub(crate) fine: Option<Arc<LookupTable>>,
    /// Opacities of slabs, where voxels are colours.
    pub(crate) alphas: Option<Arc<Vec<f64>>>,
    /// What bricks show: 0 nothing, 1 something.
    pub(crate) bricks: Arc<BrickClasses>,
    /// What the strongest slab's opacity is, or its optical depth where the table tells that.
    pub(crate) strongest: f32,
}

impl TransferData {
    /// Tables for `key`, and what the bricks of `volume` show. What `others` hold for another thickness serves again where it does not
    /// depend on it.
    pub(crate) fn new<'o>(key: TransferKey, volume: &Volume, bricks: &Bricks, mut others: impl Iterator<Item = &'o Self>) -> Self {
        let (min, max) = bricks.range;
        let range = if min <= max { value_range(volume, min, max) } else { (0.0, 0.0) };
        let TransferKey { transfer, slab, by, transfer2d } = &key;
        let classifier = Classifier::new(transfer, range, *slab, *by);
        let table = Arc::new(classifier.table(transfer, *slab));
        let fine = classifier.fine().map(|layout| Arc::new(layout.table(transfer, *slab)));
        let alphas = classifier.alphas(transfer, *slab).map(Arc::new);
        let same = |o: &&Self| o.classifier == classifier && o.key.transfer == *transfer && o.key.transfer2d == *transfer2d;
        let bricks = match others.find(same) {
            Some(same) => same.bricks.clone(),
            None => Arc::new(shown(&classifier, &key, volume, bricks)),
        };
        let fine_strongest = fine.as_deref().map_or(0.0, strongest);
        Self { strongest: strongest(&table).max(fine_strongest), key, classifier, table, fine, alphas, bricks }
    }

    /// The same tables for `bricks` of another `volume` of the same type and rescale, whose values lie in the same range.
    pub(crate) fn for_bricks(&self, volume: &Volume, bricks: &Bricks) -> Self {
        Self {
            key: self.key.clone(),
            classifier: self.classifier.clone(),
            table: Arc::clone(&self.table),
            fine: self.fine.clone(),
            alphas: self.alphas.clone(),
            bricks: Arc::new(shown(&self.classifier, &self.key, volume, bricks)),
            strongest: self.strongest,
        }
    }
}

/// What `bricks` of `volume` show of what `key` says.
fn shown(
    classifier: &Classifier,
    TransferKey { transfer, transfer2d, .. }: &TransferKey,
    volume: &Volume,
    bricks: &Bricks,
) -> BrickClasses {
    let by_value = BrickClasses::new(bricks, |low, high| {
        let (low, high) = value_range(volume, low, high);
        u8::from(classifier.may_show(low, high))
    });
    if transfer2d.is_none() && transfer.gradient_opacity().is_empty() {
        return by_value;
    }
    // No gradient of values that differ by 1 is larger.
    let steepest = volume.grid().world_to_index().matrix3.to_cols_array().iter().map(|x| x * x).sum::<f64>().sqrt();
    let steepest = steepest * volume.rescale().0.abs() * (1.0 + 1e-6);
    by_value.without(bricks, |low, high, width| {
        let (low, high) = value_range(volume, low, high);
        match transfer2d {
            Some(transfer) => !transfer.may_show(low, high, steepest * width),
            None => transfer.most_gradient_factor(steepest * width) <= 0.0,
        }
    })
}

/// What slabs several times as thick need: see [`MERGED`].
#[derive(Debug)]
pub(crate) struct MergedData {
    /// Tables for slabs so many times as thick.
    pub(crate) tables: [Arc<LookupTable>; 2],
    /// Opacity of the strongest plain slab.
    pub(crate) strongest: f32,
    /// How much colour and opacity change in bricks.
    pub(crate) bricks: BrickClasses,
}

impl MergedData {
    /// What it takes to make one slab of several like those of `data`; nothing where values come in pairs.
    pub(crate) fn new(data: &TransferData, volume: &Volume, bricks: &Bricks) -> Option<Self> {
        let Classifier::Value(layout) = &data.classifier else { return None };
        let changes = ChangeClasses::new(&data.table, layout.range(), layout.last());
        let bricks = BrickClasses::new(bricks, |low, high| {
            let (low, high) = value_range(volume, low, high);
            // Classes are too coarse to tell what shows from what does not.
            if layout.may_show(low, high) { changes.class(low, high).max(1) } else { 0 }
        });
        let slab = data.key.slab;
        let tables = MERGED.map(|count| Arc::new(layout.table(&data.key.transfer, Slab { ratio: count as f64 * slab.ratio, ..slab })));
        Some(Self { tables, strongest: data.strongest, bricks })
    }
}

/// Tables of the thinness of slabs, laid out as those of their colours.
#[derive(Debug)]
pub(crate) struct ThinnessData {
    pub(crate) table: Arc<LookupTable>,
    pub(crate) fine: Option<Arc<LookupTable>>,
    pub(crate) alphas: Option<Arc<Vec<f64>>>,
}

impl ThinnessData {
    /// Those of slabs like those of `data`.
    pub(crate) fn new(data: &TransferData) -> Self {
        let (transfer, slab) = (&data.key.transfer, Slab { measure: Measure::Thinness, ..data.key.slab });
        Self {
            table: Arc::new(data.classifier.table(transfer, slab)),
            fine: data.classifier.fine().map(|layout| Arc::new(layout.table(transfer, slab))),
            alphas: data.classifier.alphas(transfer, slab).map(Arc::new),
        }
    }
}

/// Where a plan gets what is kept between frames; what is not there yet is made.
pub(crate) trait Prepared {
    /// Tables for `key`.
    fn transfer(&mut self, key: TransferKey) -> Arc<TransferData>;

    /// Tables for `key`, of a region with a transfer function of its own.
    fn region(&mut self, key: TransferKey) -> Arc<TransferData>;

    /// What it takes to make one slab of several like those of `data`; nothing where that cannot be.
    fn merged(&mut self, data: &TransferData) -> Option<Arc<MergedData>>;

    /// The thinness of slabs like those of `data`.
    fn thinness(&mut self, data: &TransferData) -> Arc<ThinnessData>;

    /// What bricks show of `data` (of slabs that are `merged`, how much changes there), in windows for `runs`.
    fn skip_table(&mut self, data: &TransferData, merged: Option<&MergedData>, runs: &Runs) -> Arc<SkipTable>;

    /// What bricks show of `scene` where that depends on their place too, in windows for `runs`, and the share of bricks that show something. `data`
    /// are the tables of the scene's transfer function and of its regions.
    fn place_table(&mut self, scene: &Scene, data: &[Arc<TransferData>], runs: &Runs) -> (Arc<SkipTable>, f64);

    /// Which bricks may hold a place of `surfaces`, in windows for `runs`, and the share of bricks that may.
    fn surface_table(&mut self, surfaces: &Surfaces, runs: &Runs) -> (Arc<SkipTable>, f64);

    /// How far bricks reach up, or down where a projection `falls`, in windows for `runs`.
    fn peak_table(&mut self, falls: bool, runs: &Runs) -> Arc<PeakTable>;
}

/// How far the bricks of `data` reach up, or down where a projection `falls`.
pub(crate) fn peak_classes(data: &VolumeData, falls: bool) -> PeakClasses {
    let number = |stored: f64| data.scaling.to_f32.map_or(stored, |map| stored * map.gain - map.bias);
    // A spline between equal coefficients is a sum of products, each rounded.
    PeakClasses::new(&data.bricks, falls, data.coefficients.is_none(), number)
}

/// Which bricks may hold a place of some surfaces.
#[derive(Debug)]
pub(crate) struct SurfaceBricks {
    pub(crate) surfaces: Surfaces,
    pub(crate) classes: BrickClasses,
}

impl SurfaceBricks {
    /// What `bricks` of `volume` hold of `surfaces`.
    pub(crate) fn new(surfaces: &Surfaces, volume: &Volume, bricks: &Bricks) -> Self {
        let classes = BrickClasses::new(bricks, |low, high| {
            let (low, high) = value_range(volume, low, high);
            let near = |level: f64| {
                // Interpolation and the level as a number are rounded by a few units in the last place of f32.
                let slack = 1e-6 * low.abs().max(high.abs()).max(level.abs());
                // Where rays enter above the level, the surface is at the box's face.
                (surfaces.capped || low - slack <= level) && level <= high + slack
            };
            u8::from(surfaces.levels.iter().any(|level| near(level.0)))
        });
        Self { surfaces: surfaces.clone(), classes }
    }
}
