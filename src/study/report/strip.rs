//! What an error looks like: one detail of the picture at several errors, side by side.

use super::super::details::NEAR;
use super::super::plot::escape;
use super::super::precision::Study;
use super::super::record::{Detail, Record};
use super::pictures::png;
use super::{File, error, time};
use crate::Result;
use base64::Engine;
use base64::engine::general_purpose::STANDARD;

/// The details as PNG files, and the truth behind them where there is one.
pub(super) fn pictures(study: &Study) -> Result<Vec<File>> {
    let shown = study.record.details.iter().zip(&study.details);
    let named = shown.map(|(detail, picture)| (format!("detail-{:e}.png", detail.error), picture));
    let truth = study.detail_truth.iter().map(|picture| ("detail-reference.png".to_owned(), picture));
    named.chain(truth).map(|(name, picture)| Ok(File { name, bytes: png(picture)? })).collect()
}

/// Heading, pictures, and what they are; `files` are those of [`pictures`].
pub(super) fn section(record: &Record, files: &[File]) -> String {
    let Some(first) = record.details.first() else { return String::new() };
    let captions = record.details.iter().map(caption).chain(["<strong>No error</strong><br>the reference, in f64".to_owned()]);
    let mut body = String::from("<h2>What an error looks like</h2>\n<div class=\"strip\">\n");
    for (file, caption) in files.iter().zip(captions) {
        let data = STANDARD.encode(&file.bytes);
        let said = escape(&file.name);
        body += &format!("<figure><img alt=\"{said}\" src=\"data:image/png;base64,{data}\"><figcaption>{caption}</figcaption></figure>\n");
    }
    let wanted: Vec<String> = record.details.iter().map(|d| format!("{:e}", d.error)).collect();
    body += &format!(
        "</div>\n<p class=\"soft\">The same {} x {} pixels of the picture, from column {} and row {} on, where few slices err most. Each picture was \
         rendered with the number of slices whose RMS error comes nearest to one of {}; error and time below it are measured, on the whole \
         picture.</p>\n",
        first.width,
        first.height,
        first.column,
        first.row,
        wanted.join(", ")
    );
    body
}

fn caption(d: &Detail) -> String {
    let slices = if d.slices == 1 { "slice" } else { "slices" };
    let far = d.rms > d.error * NEAR || d.rms * NEAR < d.error;
    let nearest = if far { format!("<br>the nearest to {:e} that was found", d.error) } else { String::new() };
    let (rms, seconds) = (error(d.rms), time(d.seconds));
    format!("<strong>RMS error {rms}</strong><br>{}, {} {slices}<br>{seconds} a frame{nearest}", escape(&d.method), d.slices)
}
