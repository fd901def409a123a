//! What is kept between frames: a change rebuilds only what it touches, and a new camera costs a plan and a frame.

use super::job::Clock;
use crate::opengl::{Texture, TextureKey};
use crate::plan::{MergedData, Prepared, SurfaceBricks, TransferData, TransferKey, VolumeData};
use crate::proxy::Domain;
use crate::scene::Surfaces;
use crate::skip::{Runs, SkipTable};
use crate::volume::Volume;
use std::sync::Arc;

/// Tables for so many thicknesses of slabs are kept: a picture to a tolerance takes several.
const KEPT: usize = 8;

/// What depends on volume and transfer function, and the skip tables of the latest views.
#[derive(Default)]
pub(super) struct Cache {
    pub(super) volume: Option<Arc<VolumeData>>,
    /// The whole that the volume was taken for a part of.
    domain: Option<Domain>,
    /// Latest first.
    pub(super) entries: Vec<Entry>,
    /// Of the latest level surfaces.
    pub(super) surfaces: Option<SurfaceEntry>,
    /// The profile opengl's texture, and what it was made for.
    pub(super) texture: Option<(TextureKey, Texture)>,
}

/// Tables of one transfer function and one thickness of slabs.
pub(super) struct Entry {
    data: Arc<TransferData>,
    merged: Option<Option<Arc<MergedData>>>,
    /// Of plain slabs, and of merged ones.
    skip_tables: [Option<Arc<SkipTable>>; 2],
}

/// Bricks that hold some levels, and their skip table of the latest view.
pub(super) struct SurfaceEntry {
    bricks: SurfaceBricks,
    skip_table: Option<Arc<SkipTable>>,
}

impl Cache {
    /// What depends on `volume` alone, and on the whole where it is a part of one.
    pub(super) fn volume_data(&mut self, volume: &Volume, domain: Option<&Domain>, clock: &mut Clock) -> Arc<VolumeData> {
        if self.domain.as_ref() != domain {
            *self = Self { domain: domain.cloned(), ..Self::default() };
        }
        let make = || clock.prepare(|| Arc::new(VolumeData::new(volume, domain)));
        Arc::clone(self.volume.get_or_insert_with(make))
    }

    /// Voxels of `volume` that are NaN or infinite, as far as they have been counted.
    pub(super) fn non_finite(&self) -> usize {
        self.volume.as_ref().map_or(0, |data| data.bricks.non_finite)
    }

    /// The cache as a plan sees it, of `volume` and its `data`; what is made goes by `clock`.
    pub(super) fn keeper<'k>(&'k mut self, volume: &'k Volume, data: &'k VolumeData, clock: &'k mut Clock) -> Keeper<'k> {
        Keeper { entries: &mut self.entries, surfaces: &mut self.surfaces, volume, data, clock }
    }
}

/// See [`Cache::keeper`].
pub(super) struct Keeper<'k> {
    pub(super) entries: &'k mut Vec<Entry>,
    pub(super) surfaces: &'k mut Option<SurfaceEntry>,
    pub(super) volume: &'k Volume,
    pub(super) data: &'k VolumeData,
    pub(super) clock: &'k mut Clock,
}

impl Keeper<'_> {
    fn entry(&mut self, data: &TransferData) -> Option<&mut Entry> {
        self.entries.iter_mut().find(|e| e.data.key == data.key)
    }
}

impl Prepared for Keeper<'_> {
    fn transfer(&mut self, key: TransferKey) -> Arc<TransferData> {
        let list = &mut *self.entries;
        list.retain(|e| e.data.key.transfer == key.transfer);
        let at = list.iter().position(|e| e.data.key == key).unwrap_or_else(|| {
            let others = list.iter().map(|e| &*e.data);
            let data = self.clock.prepare(|| Arc::new(TransferData::new(key, self.volume, &self.data.bricks, others)));
            list.push(Entry { data, merged: None, skip_tables: [None, None] });
            list.len() - 1
        });
        list[..=at].rotate_right(1);
        list.truncate(KEPT);
        Arc::clone(&list[0].data)
    }

    fn merged(&mut self, data: &TransferData) -> Option<Arc<MergedData>> {
        if let Some(merged) = self.entry(data).and_then(|e| e.merged.clone()) {
            return merged;
        }
        let made = self.clock.prepare(|| MergedData::new(data, self.volume, &self.data.bricks).map(Arc::new));
        if let Some(entry) = self.entry(data) {
            entry.merged = Some(made.clone());
        }
        made
    }

    fn skip_table(&mut self, data: &TransferData, merged: Option<&MergedData>, runs: &Runs) -> Arc<SkipTable> {
        let which = usize::from(merged.is_some());
        let kept = self.entry(data).and_then(|e| e.skip_tables[which].clone());
        if let Some(table) = kept.filter(|table| table.sides() == runs.sides) {
            return table;
        }
        let bricks = merged.map_or(&*data.bricks, |merged| &merged.bricks);
        let table = Arc::new(SkipTable::new(bricks, runs.sides));
        if let Some(entry) = self.entry(data) {
            entry.skip_tables[which] = Some(Arc::clone(&table));
        }
        table
    }

    fn surface_table(&mut self, surfaces: &Surfaces, runs: &Runs) -> (Arc<SkipTable>, f64) {
        let kept = self.surfaces.take().filter(|entry| entry.bricks.surfaces == *surfaces);
        let make = || SurfaceEntry {
            bricks: self.clock.prepare(|| SurfaceBricks::new(surfaces, self.volume, &self.data.bricks)),
            skip_table: None,
        };
        let mut entry = kept.unwrap_or_else(make);
        let kept = entry.skip_table.take().filter(|table| table.sides() == runs.sides);
        let table = kept.unwrap_or_else(|| Arc::new(SkipTable::new(&entry.bricks.classes, runs.sides)));
        entry.skip_table = Some(Arc::clone(&table));
        let share = entry.bricks.classes.share();
        *self.surfaces = Some(entry);
        (table, share)
    }
}
