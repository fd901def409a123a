//! What a picture cost, as JSON and as a table.

use serde_json::{Value, json};
use slicestack::scene::SceneDepths;
use slicestack::{LeftOut, Picture, RenderStats, Volume};

/// Times that the command takes itself, in seconds.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Clock {
    pub(super) load: f64,
    pub(super) prepare: f64,
    pub(super) render: f64,
    pub(super) encode: f64,
}

/// What a user is told besides numbers.
pub(super) struct Told {
    pub(super) warnings: Vec<String>,
    /// What was decided, and why.
    pub(super) notes: Vec<String>,
    /// Where the box begins and ends for the eye, and what shows of it.
    pub(super) depths: Option<SceneDepths>,
}

/// Eye distances along the view direction, world units.
pub(super) fn depths_json(depths: SceneDepths) -> Value {
    json!({ "box": depths.whole, "visible": depths.visible })
}

/// The statistics file.
pub(super) fn json(clock: Clock, stats: &RenderStats, told: &Told, picture: &Picture, volume: &Volume) -> Value {
    let left_out: Vec<Value> = stats.left_out.iter().map(left_out_json).collect();
    let t = &stats.tally;
    let mut value = json!({
        "seconds": { "load": clock.load, "prepare": clock.prepare, "render": clock.render, "encode": clock.encode },
        "slices": stats.slices,
        "fragments": stats.fragments,
        "fetches": stats.fetches,
        "threads": stats.threads,
        "simd": stats.simd,
        "tally": {
            "frames": t.frames,
            "fragments": t.fragments,
            "corners": t.corners,
            "looked_up": t.looked_up,
            "empty": t.empty,
            "finished": t.finished,
            "merged": t.merged,
            "beside": t.beside,
            "between": t.between,
            "lanes": t.lanes,
            "hidden": t.hidden,
            "gradients": t.gradients,
            "batches": t.batches,
            "whole_batches": t.whole_batches,
            "empty_batches": t.empty_batches,
            "finished_batches": t.finished_batches,
            "merged_batches": t.merged_batches,
            "blocks": t.blocks,
            "missed_blocks": t.missed_blocks,
        },
        "left_out": left_out,
        "sha256": picture.sha256(),
        "warnings": told.warnings,
        "notes": told.notes,
        "depths": told.depths.map(depths_json),
        "non_finite_voxels": stats.non_finite_voxels,
        "image": { "width": picture.width(), "height": picture.height() },
        "volume": {
            "name": volume.name(),
            "dimensions": volume.grid().dims(),
            "type": volume.voxels().voxel_type().name(),
            "bytes": volume.voxels().bytes(),
        },
        "version": env!("CARGO_PKG_VERSION"),
    });
    if let (Some(estimate), Some(map)) = (stats.error_estimate, value.as_object_mut()) {
        // An estimate: four digits are more than it holds.
        let rounded = format!("{estimate:.3e}").parse().unwrap_or(estimate);
        map.insert("error_estimate".into(), json!(rounded));
    }
    value
}

fn left_out_json(LeftOut { what, why, saved, .. }: &LeftOut) -> Value {
    let mut value = json!({ "stage": what, "why": why });
    if let (Some(s), Some(map)) = (saved, value.as_object_mut()) {
        map.insert("saved".into(), json!({ "count": s.count, "of": s.of, "unit": s.unit }));
    }
    value
}

/// Where the work of a picture went and what was left out of it, for people.
pub(super) fn explain(stats: &RenderStats, picture: &Picture) -> String {
    let t = &stats.tally;
    let several = if t.frames > 1 { format!(", in {} frames that are counted together", t.frames) } else { String::new() };
    let mut text = format!(
        "{} x {} pixels, {}{several}; {}, {}\n\n",
        picture.width(),
        picture.height(),
        counted(stats.slices, "slice"),
        counted(stats.threads as u64, "thread"),
        stats.simd
    );
    let all = t.fragments + t.corners;
    let mut table = Table::new(&["fragments", "number", "share", "what they are"]);
    let mut row = |what: &str, n: u64, of: u64, why: &str| table.row(&[what, &grouped(n), &percent(n, of), why]);
    row("covered by slices", t.fragments, all, "pixel centres inside the polygons");
    row("between two slices", t.corners, all, "rays that cross a corner of the box: a piece each");
    row("= looked up", t.looked_up, all, "went through the stages");
    row("+ passed over, empty", t.empty, all, "the transfer function shows nothing there");
    row("+ passed over, finished", t.finished, all, "nothing behind an opaque front shows");
    if t.merged > 0 {
        row("+ merged", t.merged, all, "the slab in the middle stands for two others or eight");
    }
    text += &table.end();
    let mut table = Table::new(&["voxel lookups", "number", "share", "what they are"]);
    let mut row = |what: &str, n: u64, why: &str| table.row(&[what, &grouped(n), &percent(n, stats.fetches), why]);
    row("done", stats.fetches, "one brings the eight voxels around a point");
    row("= for fragments", t.looked_up, "as above");
    row("+ in lanes beside them", t.beside, "a row of a batch is 8 pixels of one slice, 8 lanes, covered or not");
    row("+ between slabs", t.between, "values at the rays' ends, and where slices resume");
    if t.gradients > 0 {
        row("gradients taken", t.gradients, "of the values, where something shows of pixels that still take light");
    }
    text += &table.end();
    let mut table = Table::new(&["left out", "saved", "of", "share", "why"]);
    for LeftOut { what, why, saved, .. } in &stats.left_out {
        match saved {
            Some(s) => table.row(&[what, &grouped(s.count), &format!("{} {}", grouped(s.of), s.unit), &percent(s.count, s.of), why]),
            None => table.row(&[what, "-", "-", "-", why]),
        }
    }
    text + table.end().trim_end_matches('\n') + "\n"
}

/// `n` of something, by name.
pub(super) fn counted(n: u64, what: &str) -> String {
    format!("{n} {what}{}", if n == 1 { "" } else { "s" })
}

/// `n` with a space between groups of three digits.
fn grouped(n: u64) -> String {
    let digits = n.to_string();
    let mut text = String::new();
    for (i, digit) in digits.chars().enumerate() {
        if i > 0 && (digits.len() - i) % 3 == 0 {
            text.push(' ');
        }
        text.push(digit);
    }
    text
}

fn percent(n: u64, of: u64) -> String {
    if of == 0 { "-".into() } else { format!("{:.1} %", 100.0 * n as f64 / of as f64) }
}

/// A table of text: the first and the last column begin at the left, numbers between them end at the right.
struct Table {
    rows: Vec<Vec<String>>,
}

impl Table {
    fn new(head: &[&str]) -> Self {
        let mut table = Self { rows: Vec::new() };
        table.row(head);
        table
    }

    fn row(&mut self, cells: &[&str]) {
        self.rows.push(cells.iter().map(|&c| c.to_owned()).collect());
    }

    /// The table, a line under its head, an empty line behind it.
    fn end(self) -> String {
        let columns = self.rows.first().map_or(0, Vec::len);
        let width = |c: usize| self.rows.iter().filter_map(|r| r.get(c)).map(|cell| cell.chars().count()).max().unwrap_or(0);
        let widths: Vec<usize> = (0..columns).map(width).collect();
        let mut text = String::new();
        for (i, row) in self.rows.iter().enumerate() {
            let mut line = String::new();
            for (c, cell) in row.iter().enumerate() {
                let width = widths[c];
                line += &if c == 0 || c + 1 == columns { format!("{cell:width$}  ") } else { format!("{cell:>width$}  ") };
            }
            text += line.trim_end();
            text.push('\n');
            if i == 0 {
                let rules: Vec<String> = widths.iter().map(|&w| "-".repeat(w)).collect();
                text += &rules.join("  ");
                text.push('\n');
            }
        }
        text + "\n"
    }
}

#[cfg(test)]
mod tests {
    use super::{Table, grouped, percent};

    #[test]
    fn numbers_are_grouped_and_columns_aligned() {
        assert_eq!([0, 12, 999, 1000, 1_234_567].map(grouped), ["0", "12", "999", "1 000", "1 234 567"]);
        assert_eq!((percent(1, 8), percent(1, 0)), ("12.5 %".to_owned(), "-".to_owned()));
        let mut table = Table::new(&["what", "n", "why"]);
        table.row(&["a", "1 000", "because"]);
        assert_eq!(table.end(), "what      n  why\n----  -----  -------\na     1 000  because\n\n");
    }
}
