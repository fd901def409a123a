//! Which pixels and which slices to record.

use super::MAX_SLICES;
use super::activity::{Activity, Worth};
use crate::proxy::{HalfSpace, Stack};
use crate::{Error, Result};
use std::collections::BTreeMap;
use std::ops::Range;

/// What all pixels of a record may weigh together: batches of their blocks, and a quarter of the slices that cover them.
const BUDGET: f64 = 9000.0;

/// The pixel that most slices change; of several, the first.
pub(super) fn busiest(activity: &Activity) -> Option<(u32, u32)> {
    let mut best: Option<((u32, u32), u32)> = None;
    for (x, y) in activity.blocks().flat_map(lanes) {
        if let Some(worth) = activity.at(x, y) {
            if best.is_none_or(|b| worth.events > b.1) {
                best = Some(((x, y), worth.events));
            }
        }
    }
    best.map(|b| b.0)
}

/// The pixels of a block.
fn lanes((x, y): (u32, u32)) -> impl Iterator<Item = (u32, u32)> {
    (0..64).map(move |i| (x + i % 8, y + i / 8))
}

/// Pixels all over what the slices cover, where most happens; as many as the budget lets when a `share` of all slices is recorded.
pub(super) fn choose(activity: &Activity, (width, height): (u32, u32), share: f64) -> Vec<(u32, u32)> {
    let covered = || activity.blocks().flat_map(lanes).filter(|&(x, y)| x < width && y < height && activity.at(x, y).is_some());
    let (mut low, mut high) = ((u32::MAX, u32::MAX), (0, 0));
    for (x, y) in covered() {
        low = (low.0.min(x), low.1.min(y));
        high = (high.0.max(x), high.1.max(y));
    }
    if low.0 > high.0 {
        return Vec::new();
    }
    for side in [14, 12, 10, 8, 6, 5, 4, 3, 2] {
        let cell = |v: u32, low: u32, high: u32| (v - low) * side / (high - low + 1);
        let mut best: BTreeMap<(u32, u32), ((u32, u32), Worth)> = BTreeMap::new();
        for p in covered() {
            let Some(worth) = activity.at(p.0, p.1) else { continue };
            let kept = best.entry((cell(p.1, low.1, high.1), cell(p.0, low.0, high.0))).or_insert((p, worth));
            if worth.events > kept.1.events {
                *kept = (p, worth);
            }
        }
        let cost: u64 = best.values().map(|(_, w)| u64::from(w.batches) + u64::from(w.covered) / 4).sum();
        if cost as f64 * share <= BUDGET {
            return best.into_values().map(|(p, _)| p).collect();
        }
    }
    Vec::new()
}

/// Depths at which the ray of a pixel enters and leaves the box, clip planes left out.
pub(super) fn through(stack: &Stack, pixel: (u32, u32)) -> Option<[f64; 2]> {
    interval(stack, &stack.half_spaces[..6], pixel)
}

/// Depths between which the ray of a pixel lies on the inner side of `sides`.
pub(super) fn interval(stack: &Stack, sides: &[HalfSpace], (x, y): (u32, u32)) -> Option<[f64; 2]> {
    let (x, y) = (f64::from(x) + 0.5, f64::from(y) + 0.5);
    let (mut entry, mut exit) = (stack.near, stack.far);
    for h in sides {
        let plane = h.b * x + h.c * y;
        let (base, slope) = if stack.perspective { (h.a, h.g + plane) } else { (h.a + plane, h.g) };
        match slope {
            s if s > 0.0 => entry = entry.max(-base / s),
            s if s < 0.0 => exit = exit.min(-base / s),
            _ if base < 0.0 => return None,
            _ => {}
        }
    }
    (entry <= exit).then_some([entry, exit])
}

/// The slices of the page.
pub(super) fn shown(asked: Option<Range<u64>>, count: u64, worth: Option<Worth>, notes: &mut Vec<String>) -> Result<Range<u64>> {
    if let Some(Range { start, end }) = asked {
        if start >= end {
            let what = if start == end { "empty" } else { "reversed" };
            return Err(Error::invalid(format!(
                "slices {start}..{end}: the range is {what}; it runs from the first number up to but without the second"
            )));
        }
        if end > count {
            return Err(Error::invalid(format!("slices {start}..{end}: the stack has {count} slices, 0..{count}")));
        }
        if end - start > MAX_SLICES {
            return Err(Error::invalid(format!("slices {start}..{end}: a page holds at most {MAX_SLICES}")));
        }
        return Ok(start..end);
    }
    if count <= MAX_SLICES {
        return Ok(0..count);
    }
    let middle = worth.map_or(count / 2, |w| w.heaviest);
    let start = middle.saturating_sub(MAX_SLICES / 2).min(count - MAX_SLICES);
    let range = start..start + MAX_SLICES;
    notes.push(format!(
        "The stack has {count} slices; the page holds {} to {}, around the slice that takes most light from the chosen pixel.",
        range.start,
        range.end - 1
    ));
    Ok(range)
}
