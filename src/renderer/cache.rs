//! What is kept between frames: a change rebuilds only what it touches, and a new camera costs a plan and a frame.

use super::job::Clock;
use crate::opengl::{Texture, TextureKey};
use crate::plan::{MergedData, PlaceBricks, Prepared, SurfaceBricks, ThinnessData, TransferData, TransferKey, VolumeData, peak_classes};
use crate::proxy::Domain;
use crate::scene::{Filter, MAX_FOCUS_REGIONS, Scene, Surfaces};
use crate::skip::{PeakClasses, PeakTable, Runs, SkipTable};
use crate::volume::OpacityFrom;
use crate::volume::Volume;
use crate::volume::spline::Coefficients;
use crate::{Error, Result};
use std::sync::Arc;

/// Tables for so many thicknesses of slabs are kept: a picture to a tolerance takes several.
const KEPT: usize = 16;

/// What depends on volume and transfer function, and the skip tables of the latest views.
#[derive(Default)]
pub(super) struct Cache {
    volume: Option<Arc<VolumeData>>,
    /// What opacities go by, where voxels are colours.
    from: Option<OpacityFrom>,
    /// What depends on the volume where the spline over it is looked up, and whether that is prefiltered.
    spline: Option<(bool, Arc<VolumeData>)>,
    /// What the tables are for: the voxels themselves, or the spline with or without prefilter.
    filter: Option<bool>,
    /// The whole that the volume was taken for a part of.
    domain: Option<Domain>,
    /// Latest first.
    entries: Vec<Entry>,
    places: PlaceEntries,
    /// Of the latest level surfaces.
    pub(super) surfaces: Option<SurfaceEntry>,
    /// Of the latest projection of the largest or smallest value.
    pub(super) peaks: Option<PeakEntry>,
    /// The profile opengl's texture, and what it was made for.
    pub(super) texture: Option<(TextureKey, Texture)>,
}

/// Tables of one transfer function and one thickness of slabs.
pub(super) struct Entry {
    data: Arc<TransferData>,
    merged: Option<Option<Arc<MergedData>>>,
    thinness: Option<Arc<ThinnessData>>,
    /// Of plain slabs, and of merged ones.
    skip_tables: [Option<Arc<SkipTable>>; 2],
}

/// How far bricks reach, and the table of the latest view.
pub(super) struct PeakEntry {
    classes: PeakClasses,
    table: Option<Arc<PeakTable>>,
}

/// Of the latest regions and label maps.
#[derive(Default)]
pub(super) struct PlaceEntries {
    /// Tables of regions, latest first.
    regions: Vec<Entry>,
    /// What bricks show, and their skip table of the latest view.
    bricks: Option<(PlaceBricks, Option<Arc<SkipTable>>)>,
}

/// Bricks that hold some levels, and their skip table of the latest view.
pub(super) struct SurfaceEntry {
    bricks: SurfaceBricks,
    skip_table: Option<Arc<SkipTable>>,
}

impl Cache {
    /// One that begins with what this one holds of the volume.
    pub(super) fn beside(&self) -> Self {
        Self {
            volume: self.volume.clone(),
            from: self.from,
            spline: self.spline.clone(),
            filter: self.filter,
            domain: self.domain.clone(),
            ..Self::default()
        }
    }

    /// What depends on `volume` alone and on how lookups `filter` it, and on the whole where it is a part of one.
    ///
    /// # Errors
    /// [`Error::Limit`] when a spline's coefficients take more than `limit` bytes, [`Error::Invalid`] when this machine does not give that many.
    pub(super) fn volume_data(
        &mut self,
        volume: &Volume,
        (filter, from, limit): (Filter, Option<OpacityFrom>, u64),
        domain: Option<&Domain>,
        clock: &mut Clock,
    ) -> Result<Arc<VolumeData>> {
        if self.domain.as_ref() != domain {
            *self = Self { domain: domain.cloned(), ..Self::default() };
        }
        if self.from != from {
            // Other numbers decide what shows.
            *self = Self { domain: self.domain.take(), from, ..Self::default() };
        }
        let filter = if let Filter::Cubic { prefilter } = filter { Some(prefilter) } else { None };
        if self.filter != filter {
            // A spline's values have another range.
            self.entries.clear();
            self.places = PlaceEntries::default();
            self.surfaces = None;
            self.peaks = None;
            self.filter = filter;
        }
        let Some(prefilter) = filter else {
            let of_colors = || from.and_then(|from| VolumeData::of_colors(volume, from));
            let make = || clock.prepare(|| Arc::new(of_colors().unwrap_or_else(|| VolumeData::new(volume, domain))));
            return Ok(Arc::clone(self.volume.get_or_insert_with(make)));
        };
        if let Some((_, data)) = self.spline.as_ref().filter(|kept| kept.0 == prefilter) {
            return Ok(Arc::clone(data));
        }
        let bytes = Coefficients::bytes(volume.grid().dims());
        if bytes > u128::from(limit) {
            let what = "render filter cubic: bytes of coefficients".into();
            return Err(Error::Limit { what, needed: bytes, limit: u128::from(limit) });
        }
        // Never two of them at once.
        self.spline = None;
        let data = clock.prepare(|| VolumeData::of_spline(volume, prefilter).map(Arc::new)).ok_or_else(|| {
            Error::invalid(format!("render filter cubic: {bytes} bytes of coefficients, this machine does not give that much memory"))
        })?;
        self.spline = Some((prefilter, Arc::clone(&data)));
        Ok(data)
    }

    /// What [`Cache::volume_data`] gave last, and the tables made from it.
    pub(super) fn kept(&mut self) -> (Option<&VolumeData>, Kept<'_>) {
        let data = if self.filter.is_some() { self.spline.as_ref().map(|s| &*s.1) } else { self.volume.as_deref() };
        (data, Kept { entries: &mut self.entries, places: &mut self.places, surfaces: &mut self.surfaces, peaks: &mut self.peaks })
    }

    /// Voxels whose colours leave 0 to 1, as far as they have been counted.
    pub(super) fn clamped(&self) -> usize {
        self.volume.as_ref().and_then(|data| data.colors.as_ref()).map_or(0, |colors| colors.clamped)
    }

    /// Voxels of `volume` that are NaN or infinite, as far as they have been counted.
    pub(super) fn non_finite(&self) -> usize {
        self.volume.as_ref().or(self.spline.as_ref().map(|s| &s.1)).map_or(0, |data| data.bricks.non_finite)
    }

    /// The cache as a plan sees it, of `volume` and its `data`; what is made goes by `clock`.
    pub(super) fn keeper<'k>(&'k mut self, volume: &'k Volume, data: &'k VolumeData, clock: &'k mut Clock) -> Keeper<'k> {
        let kept = Kept { entries: &mut self.entries, places: &mut self.places, surfaces: &mut self.surfaces, peaks: &mut self.peaks };
        Keeper { kept, volume, data, clock }
    }
}

/// What the cache keeps for plans.
pub(super) struct Kept<'k> {
    entries: &'k mut Vec<Entry>,
    places: &'k mut PlaceEntries,
    surfaces: &'k mut Option<SurfaceEntry>,
    peaks: &'k mut Option<PeakEntry>,
}

/// See [`Cache::keeper`].
pub(super) struct Keeper<'k> {
    pub(super) kept: Kept<'k>,
    pub(super) volume: &'k Volume,
    pub(super) data: &'k VolumeData,
    pub(super) clock: &'k mut Clock,
}

impl Entry {
    fn new(data: Arc<TransferData>) -> Self {
        Self { data, merged: None, thinness: None, skip_tables: [None, None] }
    }
}

impl Keeper<'_> {
    fn entry(&mut self, data: &TransferData) -> Option<&mut Entry> {
        let Kept { entries, places, .. } = &mut self.kept;
        entries.iter_mut().chain(&mut places.regions).find(|e| e.data.key == data.key)
    }
}

impl Prepared for Keeper<'_> {
    fn transfer(&mut self, key: TransferKey) -> Arc<TransferData> {
        let list = &mut *self.kept.entries;
        list.retain(|e| e.data.key.transfer == key.transfer && e.data.key.transfer2d == key.transfer2d);
        let at = list.iter().position(|e| e.data.key == key).unwrap_or_else(|| {
            let others = list.iter().map(|e| &*e.data);
            let data = self.clock.prepare(|| Arc::new(TransferData::new(key, self.volume, &self.data.bricks, others)));
            list.push(Entry::new(data));
            list.len() - 1
        });
        list[..=at].rotate_right(1);
        list.truncate(KEPT);
        Arc::clone(&list[0].data)
    }

    fn region(&mut self, key: TransferKey) -> Arc<TransferData> {
        let list = &mut self.kept.places.regions;
        let at = list.iter().position(|e| e.data.key == key).unwrap_or_else(|| {
            let others = list.iter().map(|e| &*e.data);
            let data = self.clock.prepare(|| Arc::new(TransferData::new(key, self.volume, &self.data.bricks, others)));
            list.push(Entry::new(data));
            list.len() - 1
        });
        list[..=at].rotate_right(1);
        list.truncate(KEPT * MAX_FOCUS_REGIONS);
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

    fn thinness(&mut self, data: &TransferData) -> Arc<ThinnessData> {
        if let Some(thinness) = self.entry(data).and_then(|e| e.thinness.clone()) {
            return thinness;
        }
        let made = self.clock.prepare(|| Arc::new(ThinnessData::new(data)));
        if let Some(entry) = self.entry(data) {
            entry.thinness = Some(Arc::clone(&made));
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

    fn place_table(&mut self, scene: &Scene, data: &[Arc<TransferData>], runs: &Runs) -> (Arc<SkipTable>, f64) {
        let kept = self.kept.places.bricks.take().filter(|(bricks, _)| bricks.serves(scene, data));
        let make = || (self.clock.prepare(|| PlaceBricks::new(scene, data, self.volume, &self.data.bricks)), None);
        let (bricks, table) = kept.unwrap_or_else(make);
        let table = table.filter(|table: &Arc<SkipTable>| table.sides() == runs.sides);
        let table = table.unwrap_or_else(|| Arc::new(SkipTable::new(&bricks.classes, runs.sides)));
        let share = bricks.classes.share();
        self.kept.places.bricks = Some((bricks, Some(Arc::clone(&table))));
        (table, share)
    }

    fn surface_table(&mut self, surfaces: &Surfaces, runs: &Runs) -> (Arc<SkipTable>, f64) {
        let kept = self.kept.surfaces.take().filter(|entry| entry.bricks.surfaces == *surfaces);
        let make = || SurfaceEntry {
            bricks: self.clock.prepare(|| SurfaceBricks::new(surfaces, self.volume, &self.data.bricks)),
            skip_table: None,
        };
        let mut entry = kept.unwrap_or_else(make);
        let kept = entry.skip_table.take().filter(|table| table.sides() == runs.sides);
        let table = kept.unwrap_or_else(|| Arc::new(SkipTable::new(&entry.bricks.classes, runs.sides)));
        entry.skip_table = Some(Arc::clone(&table));
        let share = entry.bricks.classes.share();
        *self.kept.surfaces = Some(entry);
        (table, share)
    }

    fn peak_table(&mut self, falls: bool, runs: &Runs) -> Arc<PeakTable> {
        let kept = self.kept.peaks.take().filter(|entry| entry.classes.falls == falls);
        let make = || PeakEntry { classes: self.clock.prepare(|| peak_classes(self.data, falls)), table: None };
        let mut entry = kept.unwrap_or_else(make);
        let kept = entry.table.take().filter(|table| table.sides() == runs.sides[0]);
        let table = kept.unwrap_or_else(|| Arc::new(entry.classes.table(runs.sides)));
        entry.table = Some(Arc::clone(&table));
        *self.kept.peaks = Some(entry);
        table
    }
}
