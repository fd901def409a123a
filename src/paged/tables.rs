//! Tables of a picture, made once; and what bricks of each piece show by them.

use crate::plan::{MergedData, PlaceBricks, Prepared, SurfaceBricks, ThinnessData, TransferData, TransferKey, VolumeData, peak_classes};
use crate::scene::{Scene, Surfaces};
use crate::skip::{PeakTable, Runs, SkipTable};
use crate::volume::Volume;
use std::sync::{Arc, Mutex, PoisonError};

/// Tables by what they are for.
#[derive(Default)]
pub(super) struct Tables {
    transfer: Mutex<Vec<Arc<TransferData>>>,
    thin: Mutex<Vec<(TransferKey, Arc<ThinnessData>)>>,
}

/// The tables as the plan for one piece sees them.
pub(super) struct PieceTables<'t> {
    pub(super) tables: &'t Tables,
    pub(super) volume: &'t Volume,
    pub(super) data: &'t VolumeData,
}

impl Prepared for PieceTables<'_> {
    fn transfer(&mut self, key: TransferKey) -> Arc<TransferData> {
        let mut list = self.tables.transfer.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(made) = list.iter().find(|made| made.key == key).map(Arc::clone) {
            drop(list);
            return Arc::new(made.for_bricks(self.volume, &self.data.bricks));
        }
        let made = Arc::new(TransferData::new(key, self.volume, &self.data.bricks, std::iter::empty()));
        list.push(Arc::clone(&made));
        made
    }

    fn region(&mut self, key: TransferKey) -> Arc<TransferData> {
        self.transfer(key)
    }

    fn merged(&mut self, data: &TransferData) -> Option<Arc<MergedData>> {
        MergedData::new(data, self.volume, &self.data.bricks).map(Arc::new)
    }

    fn thinness(&mut self, data: &TransferData) -> Arc<ThinnessData> {
        let mut list = self.tables.thin.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some((_, made)) = list.iter().find(|(key, _)| *key == data.key) {
            return Arc::clone(made);
        }
        let made = Arc::new(ThinnessData::new(data));
        list.push((data.key.clone(), Arc::clone(&made)));
        made
    }

    fn skip_table(&mut self, data: &TransferData, merged: Option<&MergedData>, runs: &Runs) -> Arc<SkipTable> {
        Arc::new(SkipTable::new(merged.map_or(&*data.bricks, |merged| &merged.bricks), runs.sides))
    }

    fn place_table(&mut self, scene: &Scene, data: &[Arc<TransferData>], runs: &Runs) -> (Arc<SkipTable>, f64) {
        let bricks = PlaceBricks::new(scene, data, self.volume, &self.data.bricks);
        (Arc::new(SkipTable::new(&bricks.classes, runs.sides)), bricks.classes.share())
    }

    fn surface_table(&mut self, surfaces: &Surfaces, runs: &Runs) -> (Arc<SkipTable>, f64) {
        let bricks = SurfaceBricks::new(surfaces, self.volume, &self.data.bricks);
        (Arc::new(SkipTable::new(&bricks.classes, runs.sides)), bricks.classes.share())
    }

    fn peak_table(&mut self, falls: bool, runs: &Runs) -> Arc<PeakTable> {
        Arc::new(peak_classes(self.data, falls).table(runs.sides))
    }
}
