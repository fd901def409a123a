//! The report of the extreme cases.

use super::super::plot::escape;
use super::super::stability::Stability;
use super::page::{Cell, page, table};
use super::{File, charts, time};
use crate::Result;

/// Opacities of the media whose errors are plotted.
const PLOTTED: [(f64, &str); 2] = [(0.9, "counts"), (0.001, "counts-faint")];

/// All files of the report of extreme cases.
///
/// # Errors
/// [`crate::Error::Invalid`] when an encoder refuses.
pub fn stability_files(stability: &Stability) -> Result<Vec<File>> {
    let mut files = vec![
        File::json("stability.json", stability)?,
        File::csv("stability.csv", &stability.rows)?,
        File::csv("counts.csv", &stability.counts)?,
        File::csv("riemann.csv", &stability.riemann)?,
    ];
    let mut body = String::from("<h1>What holds in extreme cases</h1>\n");
    let broken = stability.broken().count();
    let all = stability.rows.len();
    body += &match broken {
        0 => format!("<p>All {all} promises <span class=\"yes\">hold</span>.</p>\n"),
        n => format!("<p><span class=\"no\">{n} of {all} promises do not hold.</span></p>\n"),
    };
    body += "<p>Compositing a ray is a one-step integrator for the stiff linear equation dC/ds = -kappa C + q. Small pictures drive it to the \
             ends of its numbers; each is held against closed forms or rays integrated in f64, and watched while it is made: no pixel's \
             transmittance may rise from one slice to the next.</p>\n";
    body += "<h2>Many slices</h2>\n";
    for (opacity, name) in PLOTTED {
        let plot = charts::counts(stability, opacity);
        files.extend(plot.files(name)?);
        body += &plot.figure(&escape(
            "Dashed: what theory says. Plain f32 loses at most 1.5 2^-24 a slice. In 8 bits every sum is rounded to 1/255: a slab whose \
             contribution is below half a step adds nothing, and the error comes to rest where the last contribution did.",
        ));
    }
    body += "<h2>Explicit Euler</h2>\n";
    let plot = charts::riemann(stability);
    files.extend(plot.files("riemann")?);
    let said = |x: Option<f64>| x.map_or("nowhere".into(), |x| format!("kappa D = {x:.2}"));
    body += &plot.figure(&escape(&format!(
        "Opacity kappa D a slab instead of 1 - exp(-kappa D): transmittance was seen negative from {} on, and growing from slab to slab from {} \
         on. Exponential slabs stay in [0,1] at every depth.",
        said(stability.negative_from),
        said(stability.divergent_from)
    )));
    if broken > 0 {
        body += "<h2>What does not hold</h2>\n";
        body += &rows(stability, |r| !r.holds);
    }
    let mut groups: Vec<&str> = Vec::new();
    for row in &stability.rows {
        if !groups.contains(&row.group.as_str()) {
            groups.push(&row.group);
        }
    }
    for group in groups {
        body += &format!("<h2>{}</h2>\n", escape(&capital(group)));
        body += &rows(stability, |r| r.group == group);
    }
    body += &format!("<p class=\"soft\">Measured in {}. slicestack {}.</p>\n", time(stability.seconds), escape(&stability.version));
    files.push(File::text("stability.html", page("What holds in extreme cases", &body)));
    Ok(files)
}

fn rows(stability: &Stability, wanted: impl Fn(&super::super::stability::Row) -> bool) -> String {
    let text = |s: &str| Cell::Text(s.into());
    let list: Vec<Vec<Cell>> = stability
        .rows
        .iter()
        .filter(|r| wanted(r))
        .map(|r| vec![text(&r.case), text(&r.promise), text(&r.measured), Cell::Holds(r.holds)])
        .collect();
    table(&["case", "promised", "measured", ""], &list)
}

fn capital(text: &str) -> String {
    let mut letters = text.chars();
    letters.next().map_or(String::new(), |first| first.to_uppercase().chain(letters).collect())
}
