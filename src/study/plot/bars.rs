//! Groups of horizontal bars, each with its name and its number.

use super::chart::text;
use super::{ADVANCE, Anchor, Drawing, Ink, Layout, Shape};

/// One bar.
#[derive(Debug, Clone, PartialEq)]
pub(in crate::study) struct Bar {
    pub(in crate::study) name: String,
    pub(in crate::study) value: f64,
    /// What stands beside it.
    pub(in crate::study) said: String,
}

/// Bars in groups, all on one scale from 0.
#[derive(Debug, Clone, PartialEq)]
pub(in crate::study) struct Bars {
    pub(in crate::study) title: String,
    /// Name of the group, its colour, its bars.
    pub(in crate::study) groups: Vec<(String, usize, Vec<Bar>)>,
}

const ROW: f64 = 18.0;

impl Bars {
    /// The bars as shapes.
    pub(in crate::study) fn draw(&self, layout: Layout) -> Drawing {
        let width = if layout == Layout::Wide { 900.0 } else { 360.0 };
        let bars = || self.groups.iter().flat_map(|g| &g.2);
        let letters = |f: &dyn Fn(&Bar) -> usize| bars().map(f).max().unwrap_or(0) as f64 * ADVANCE;
        let (names, said) = (letters(&|b| b.name.chars().count()), letters(&|b| b.said.chars().count()));
        let left = names + 18.0;
        let room = (width - left - said - 14.0).max(20.0);
        let most = bars().map(|b| b.value).fold(0.0, f64::max);
        let mut shapes = vec![text([8.0, 16.0], &self.title, Ink::Text, Anchor::Start, true)];
        let mut y = 40.0;
        for (group, look, bars) in &self.groups {
            shapes.push(text([8.0, y], group, Ink::Curve(*look), Anchor::Start, true));
            y += ROW + 2.0;
            for bar in bars {
                let length = if most > 0.0 { (bar.value / most * room).max(0.5) } else { 0.5 };
                shapes.push(text([left - 6.0, y], &bar.name, Ink::Text, Anchor::End, false));
                let points = vec![[left, y - 6.0], [left + length, y - 6.0], [left + length, y + 6.0], [left, y + 6.0]];
                shapes.push(Shape::Area { points, fill: Ink::Curve(*look), edge: None });
                shapes.push(text([left + length + 6.0, y], &bar.said, Ink::Muted, Anchor::Start, false));
                y += ROW;
            }
            y += 10.0;
        }
        Drawing { width, height: y, title: self.title.clone(), shapes }
    }
}
