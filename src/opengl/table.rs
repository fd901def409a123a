//! The colour table: 256 entries from texture value 0 to 1, the transfer function for one thickness of slab.

use super::texture::{Values, fixed_weight, mix_levels};
use crate::scene::{Arithmetic, Filter, OpenGl, TableColors, Target, TextureFormat, TransferFunction};

/// Entries of the table. Entry i stands at texture value i / 255.
const ENTRIES: usize = 256;

/// A one-dimensional RGBA texture, clamped to its edge.
///
/// A program that gives it to OpenGL looks it up at value * 255/256 + 0.5/256, so that 0 and 1 meet the centres of the outer texels.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Table {
    entries: Vec<[f32; 4]>,
    /// The same rounded to 8 bits.
    levels: Vec<[u8; 4]>,
    filter: Filter,
    /// Whether it is filtered in fixed point.
    fixed: bool,
}

impl Table {
    /// The table of `transfer` for slabs `ratio` reference lengths thick: opacity 1 - (1 - a)^ratio. 8-bit entries are rounded to
    /// nearest, last of all.
    pub(crate) fn new(transfer: &TransferFunction, values: &Values, ratio: f64, state: &OpenGl, target: Target) -> Self {
        let format = state.table.unwrap_or(match target {
            Target::F32 => TextureFormat::F32,
            Target::Unorm8 | Target::Unorm16 => TextureFormat::Unorm8,
        });
        let entry = |i: usize| {
            let color = transfer.eval(values.of_level(i));
            let alpha = if color.alpha >= 1.0 { 1.0 } else { -libm::expm1(ratio * libm::log1p(-color.alpha)) };
            let weight = match state.table_colors {
                TableColors::Premultiplied => alpha,
                TableColors::Straight => 1.0,
            };
            let [r, g, b] = color.rgb.map(|c| c * weight);
            [r, g, b, alpha]
        };
        let exact: Vec<[f64; 4]> = (0..ENTRIES).map(entry).collect();
        // Rounded once, not by way of f32.
        let levels: Vec<[u8; 4]> = exact.iter().map(|e| e.map(|c| libm::round(c * 255.0) as u8)).collect();
        let entries = match format {
            TextureFormat::Unorm8 => levels.iter().map(|e| e.map(|l| (f64::from(l) / 255.0) as f32)).collect(),
            TextureFormat::F32 => exact.iter().map(|e| e.map(|c| c as f32)).collect(),
        };
        let fixed = format == TextureFormat::Unorm8 && state.filter_arithmetic == Arithmetic::Fixed;
        Self { entries, levels, filter: state.table_filter, fixed }
    }

    /// Entry `i` in 8 bits.
    pub(super) fn level(&self, i: u8) -> [u8; 4] {
        self.levels[usize::from(i)]
    }

    /// The colour at texture value `value`.
    pub(super) fn lookup(&self, value: f32) -> [f32; 4] {
        let x = value.clamp(0.0, 1.0) * (ENTRIES - 1) as f32;
        match self.filter {
            Filter::Linear | Filter::Cubic { .. } => {
                let i = x as usize;
                if self.fixed {
                    let (a, b, w) = (&self.levels[i], &self.levels[(i + 1).min(ENTRIES - 1)], fixed_weight(x - i as f32));
                    return std::array::from_fn(|c| f32::from(mix_levels(a[c], b[c], w)) / 255.0);
                }
                let (a, b, w) = (&self.entries[i], &self.entries[(i + 1).min(ENTRIES - 1)], x - i as f32);
                [a[0] + w * (b[0] - a[0]), a[1] + w * (b[1] - a[1]), a[2] + w * (b[2] - a[2]), a[3] + w * (b[3] - a[3])]
            }
            Filter::Nearest => self.entries[((x + 0.5) as usize).min(ENTRIES - 1)],
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn transfer() -> TransferFunction {
        TransferFunction::new(vec![(0.0, [1.0, 0.5, 0.0])], vec![(0.0, 0.0), (255.0, 0.51)]).expect("valid")
    }

    fn table(ratio: f64, colors: TableColors, format: TextureFormat, filter: Filter) -> Table {
        let state = OpenGl { table_colors: colors, table: Some(format), table_filter: filter, ..OpenGl::default() };
        Table::new(&transfer(), &Values::Levels { slope: 1.0, intercept: 0.0 }, ratio, &state, Target::Unorm8)
    }

    #[test]
    fn entries_are_corrected_then_premultiplied_then_rounded() {
        // a = 0.51 for one reference length, 1 - 0.49^0.5 = 0.3 for half of one; times 0.5 = 0.15; 38.25 and 76.5 of 255.
        let exact = table(0.5, TableColors::Premultiplied, TextureFormat::F32, Filter::Linear).entries[255];
        assert!(exact.iter().zip([0.3f32, 0.15, 0.0, 0.3]).all(|(a, b)| (a - b).abs() < 1e-6), "{exact:?}");
        let rounded = table(1.0, TableColors::Premultiplied, TextureFormat::Unorm8, Filter::Linear).entries[255];
        assert_eq!(rounded, [130.0 / 255.0, 65.0 / 255.0, 0.0, 130.0 / 255.0]);
        assert_eq!(table(1.0, TableColors::Straight, TextureFormat::Unorm8, Filter::Linear).entries[0], [1.0, 128.0 / 255.0, 0.0, 0.0]);
    }

    #[test]
    fn entry_i_stands_at_i_of_255() {
        for filter in [Filter::Linear, Filter::Nearest] {
            let table = table(1.0, TableColors::Straight, TextureFormat::F32, filter);
            for i in 0..ENTRIES {
                let found = table.lookup(i as f32 / 255.0);
                assert!((found[3] - table.entries[i][3]).abs() < 1e-6, "{filter:?} {i}");
            }
            assert_eq!(table.lookup(7.0), table.entries[255]);
            assert_eq!(table.lookup(-1.0), table.entries[0]);
        }
        let linear = table(1.0, TableColors::Straight, TextureFormat::F32, Filter::Linear);
        assert!((linear.lookup(100.25 / 255.0)[3] - 0.51 * 100.25 / 255.0).abs() < 1e-6);
        let nearest = table(1.0, TableColors::Straight, TextureFormat::F32, Filter::Nearest);
        assert_eq!(nearest.lookup(100.4 / 255.0), nearest.entries[100]);
        assert_eq!(nearest.lookup(100.6 / 255.0), nearest.entries[101]);
    }
}
