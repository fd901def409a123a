//! A study as files: page, numbers, plots, pictures.

mod algorithms;
mod charts;
mod hits;
mod page;
mod pictures;
mod scene;
mod stability;
mod strip;
mod tables;

pub use scene::scene_files;
pub use stability::stability_files;

use super::plot::{Bars, Chart, Drawing, Layout, seconds};
use crate::{Error, Result};
use serde::Serialize;

/// A file of a report.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct File {
    /// Its name, without a folder.
    pub name: String,
    /// What is in it.
    pub bytes: Vec<u8>,
}

impl File {
    fn text(name: &str, text: String) -> Self {
        Self { name: name.into(), bytes: text.into_bytes() }
    }

    fn json(name: &str, value: &impl Serialize) -> Result<Self> {
        let text = serde_json::to_string_pretty(value).map_err(|e| Error::invalid(format!("{name}: {e}")))?;
        Ok(Self::text(name, text + "\n"))
    }

    fn csv(name: &str, rows: &[impl Serialize]) -> Result<Self> {
        let mut writer = csv::Writer::from_writer(Vec::new());
        for row in rows {
            writer.serialize(row).map_err(|e| Error::invalid(format!("{name}: {e}")))?;
        }
        let bytes = writer.into_inner().map_err(|e| Error::invalid(format!("{name}: {e}")))?;
        Ok(Self { name: name.into(), bytes })
    }
}

/// A plot in the forms it is shown in.
enum Plot {
    Chart(Chart),
    Bars(Bars),
}

impl Plot {
    fn draw(&self, layout: Layout) -> Drawing {
        match self {
            Self::Chart(chart) => chart.draw(layout),
            Self::Bars(bars) => bars.draw(layout),
        }
    }

    /// `name`.svg and `name`.png.
    fn files(&self, name: &str) -> Result<[File; 2]> {
        let drawing = self.draw(Layout::Wide);
        Ok([File::text(&format!("{name}.svg"), drawing.svg()), File { name: format!("{name}.png"), bytes: drawing.png()? }])
    }

    /// For the page: one drawing for wide windows, one for narrow ones.
    fn figure(&self, caption: &str) -> String {
        let [wide, narrow] = [Layout::Wide, Layout::Narrow].map(|l| self.draw(l).inline_svg());
        format!("<figure><div class=\"wide\">{wide}</div><div class=\"narrow\">{narrow}</div><figcaption>{caption}</figcaption></figure>\n")
    }
}

/// An error in two digits.
fn error(x: f64) -> String {
    if x == 0.0 { "0".into() } else { format!("{x:.1e}") }
}

/// A number that may not be there.
fn or_dash<T>(value: Option<T>, say: impl Fn(T) -> String) -> String {
    value.map_or_else(|| "-".into(), say)
}

fn time(x: f64) -> String {
    seconds(x)
}
