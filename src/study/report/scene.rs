//! The report of one scene.

use super::super::advice::slope;
use super::super::plot::{escape, short};
use super::super::precision::Study;
use super::super::record::{Advice, Balance, Record, Shared};
use super::page::{Cell, page, table};
use super::pictures::{difference, png};
use super::tables::{advice_table, all_points, balance_table, gradients_table, methods_table};
use super::{File, Plot, algorithms, charts, error, hits, or_dash, strip, time};
use crate::Result;
use crate::reference::metrics;
use base64::Engine;
use base64::engine::general_purpose::STANDARD;

/// All files of a scene's report.
///
/// # Errors
/// [`crate::Error::Invalid`] when an encoder refuses.
pub fn scene_files(study: &Study) -> Result<Vec<File>> {
    let record = &study.record;
    let mut files = vec![
        File::json("report.json", record)?,
        File::csv("details.csv", &record.details)?,
        File::csv("points.csv", &record.points)?,
        File::csv("methods.csv", &record.methods)?,
        File::csv("stages.csv", &record.stages)?,
        File::csv("costs.csv", &record.costs.iter().map(flat).collect::<Vec<_>>())?,
        File::csv("balance.csv", &record.balance.iter().flat_map(shared).collect::<Vec<_>>())?,
        File::csv("advice.csv", &record.advice)?,
        File::csv("gradients.csv", &record.gradients)?,
        File::csv("hits.csv", &record.hits)?,
        File::csv("algorithms.csv", &record.algorithms)?,
        File::text("table.md", markdown(record)),
    ];
    let plots = plots(record);
    for (name, plot, _) in &plots {
        files.extend(plot.files(name)?);
    }
    let pictures = pictures(study)?;
    let details = strip::pictures(study)?;
    files.push(File::text("report.html", html(record, &plots, &pictures, &strip::section(record, &details))));
    files.extend(details);
    files.extend(pictures.into_iter().map(|p| File { name: p.name, bytes: p.bytes }));
    Ok(files)
}

/// A cost without lists in it: a CSV file has none.
fn flat(c: &super::super::record::Cost) -> impl serde::Serialize + use<> {
    #[derive(serde::Serialize)]
    struct Row {
        of: String,
        width: u32,
        height: u32,
        voxels_x: usize,
        voxels_y: usize,
        voxels_z: usize,
        size: u64,
        seconds: f64,
        prepare_seconds: f64,
        fetches: u64,
    }
    let ([width, height], [voxels_x, voxels_y, voxels_z]) = (c.image, c.dimensions);
    let super::super::record::Cost { of, size, seconds, prepare_seconds, fetches, .. } = c.clone();
    Row { of, width, height, voxels_x, voxels_y, voxels_z, size, seconds, prepare_seconds, fetches }
}

/// A balance, one row for each number of threads.
fn shared(b: &Balance) -> Vec<impl serde::Serialize + use<>> {
    #[derive(serde::Serialize)]
    struct Row {
        tile: u32,
        tiles: usize,
        longest: f64,
        measured_threads: usize,
        measured_seconds: f64,
        measured_idle: f64,
        threads: usize,
        seconds: f64,
        speedup: f64,
        idle: f64,
        mean_idle: f64,
    }
    let row = |s: &Shared| Row {
        tile: b.tile,
        tiles: b.tiles,
        longest: b.longest,
        measured_threads: b.threads,
        measured_seconds: b.seconds,
        measured_idle: b.idle,
        threads: s.threads,
        seconds: s.seconds,
        speedup: s.speedup,
        idle: s.idle,
        mean_idle: s.mean_idle,
    };
    b.shared.iter().map(row).collect()
}

/// File name, plot, caption.
fn plots(record: &Record) -> Vec<(&'static str, Plot, String)> {
    let s = &record.setting;
    let mut list = vec![
        (
            "work-precision",
            charts::work_precision(record),
            format!(
                "{} x {} pixels, {} threads, {}. Each mark is a picture; along a curve the number of slices doubles, or the tolerance falls.{}",
                s.image[0],
                s.image[1],
                s.threads,
                s.simd,
                charts::in_grey(record)
            ),
        ),
        ("convergence", charts::convergence(record), format!("Dashed: the slopes of orders 1, 2 and 3.{}", charts::in_grey(record))),
    ];
    if let Some(stages) = charts::stages(record) {
        let caption = "Batches of 64 fragments timed on the way; \"between stages\" is geometry, passing over what is empty or finished, and the rest.";
        list.push(("stages", stages, caption.to_owned()));
    }
    for (name, of) in [("cost-image", "image"), ("cost-volume", "volume")] {
        let sizes: Vec<(f64, f64)> = record.costs.iter().filter(|c| c.of == of).map(|c| (c.size as f64, c.seconds)).collect();
        if sizes.len() >= 2 {
            let unit = if of == "image" { "pixels" } else { "voxels" };
            let caption = format!("Measured: time goes as ({unit})^{:.2}. midpoint, {} slices.", slope(&sizes), s.slices);
            list.push((name, charts::cost(record, of), caption));
        }
    }
    list
}

/// A picture of the report.
struct Shown {
    name: String,
    bytes: Vec<u8>,
    caption: String,
}

fn pictures(study: &Study) -> Result<Vec<Shown>> {
    let caption = format!("The reference: {}.", truth(&study.record));
    let mut list = vec![Shown { name: "reference.png".into(), bytes: png(&study.reference)?, caption }];
    // All differences on one scale: what the first one's 99.9th percentile is, rounded up to a power of two of 1/255.
    let mut most: Option<f64> = None;
    for wanted in ["midpoint", "pre-integrated", "second-order"] {
        let Some((method, slices, picture)) = study.pictures.iter().find(|p| p.0 == wanted) else { continue };
        let found = metrics::difference(&study.reference, picture)?;
        let most = *most.get_or_insert_with(|| libm::exp2(libm::ceil(libm::log2((found.p999 * 255.0).max(1.0 / 64.0)))) / 255.0);
        if list.len() == 1 {
            let caption = format!("{method}, {slices} slices: RMS error {}.", error(found.rms));
            list.push(Shown { name: "rendering.png".into(), bytes: png(picture)?, caption });
        }
        let caption = format!(
            "Difference of {method}, {slices} slices: black none, white {} of 255 steps or more. RMS error {}.",
            short(most * 255.0),
            error(found.rms)
        );
        let picture = difference(&study.reference, picture, most)?;
        list.push(Shown { name: format!("difference-{method}.png"), bytes: png(&picture)?, caption });
    }
    Ok(list)
}

/// What pictures are held against.
fn truth(record: &Record) -> &'static str {
    if record.hits.is_empty() { "rays integrated in f64" } else { "rays whose crossings of the levels are solved for in f64" }
}

/// What to use for which error, for a README.
fn markdown(record: &Record) -> String {
    let s = &record.setting;
    let mut out =
        String::from("| RMS error at most | cheapest way | time of a frame | its error | by the default alone |\n|---|---|---|---|---|\n");
    for a in &record.advice {
        out += &match &a.method {
            Some(_) => format!(
                "| {:e} | {} | {} | {} | {} |\n",
                a.error,
                asked(a, "`"),
                or_dash(a.seconds, time),
                or_dash(a.rms, error),
                default_of(a)
            ),
            None => format!("| {:e} | not reached within the budget | - | - | - |\n", a.error),
        };
    }
    out += &format!(
        "\n{} x {} x {} voxels ({}), {} x {} pixels, {} threads, {}; error of red, green and blue against {}.\n",
        s.dimensions[0],
        s.dimensions[1],
        s.dimensions[2],
        s.voxel_type,
        s.image[0],
        s.image[1],
        s.threads,
        s.simd,
        truth(record)
    );
    out
}

/// The method of a recommendation, and what to ask it for.
pub(super) fn asked(a: &Advice, quote: &str) -> String {
    let method = a.method.as_deref().unwrap_or("-");
    match (a.tolerance, a.slices) {
        (Some(t), _) => format!("{quote}tolerance = {t}{quote}"),
        (None, Some(n)) => format!("{method}, {n} slices"),
        _ => method.into(),
    }
}

pub(super) fn default_of(a: &Advice) -> String {
    match (a.default_slices, a.default_seconds) {
        (Some(n), Some(t)) => format!("{n} slices, {}", time(t)),
        _ => "-".into(),
    }
}

fn html(record: &Record, plots: &[(&str, Plot, String)], pictures: &[Shown], strip: &str) -> String {
    let s = &record.setting;
    let figure = |name: &str| plots.iter().find(|p| p.0 == name).map_or(String::new(), |p| p.1.figure(&escape(&p.2)));
    let mut body = format!("<h1>What error costs: {}</h1>\n", escape(&s.name));
    body += &format!(
        "<p>{} x {} x {} voxels ({}), a picture of {} x {} pixels, {} threads, {}. Single pictures are shown in {} slices.</p>\n",
        s.dimensions[0], s.dimensions[1], s.dimensions[2], s.voxel_type, s.image[0], s.image[1], s.threads, s.simd, s.slices
    );
    body += strip;
    body += "<h2>Which method for which error</h2>\n";
    body += &advice_table(record);
    body += "<p class=\"soft\">The cheapest picture measured whose RMS error lies below the first column; the default, unless \
             another is a tenth faster. Methods that are there to be compared with, and those that solve another problem (marked below), \
             are not among the candidates.</p>\n";
    body += "<h2>Error against time</h2>\n";
    body += &figure("work-precision");
    body += "<h2>Error against slices</h2>\n";
    body += &figure("convergence");
    body += &methods_table(&record.methods, &record.points);
    body += "<p class=\"soft\">Orders are expected on smooth scenes: steps and edges in the data, narrow points of the transfer function, and \
             slices coarser than the voxels give others. The order of methods with another limit is that of the change from half as many \
             slices.</p>\n";
    if let Some(p) = &record.pre_integration {
        body += &format!("<h2>Pre-integration</h2>\n<p>{}</p>\n", escape(&p.verdict));
        let number = |x: f64| Cell::Number(format!("{x:.0}"));
        let rows: Vec<Vec<Cell>> = p
            .slices_for
            .iter()
            .map(|r| {
                let ratio = |a: f64, b: f64| Cell::Number(format!("{:.2}", a / b));
                vec![
                    Cell::Number(format!("{:e}", r.error)),
                    number(r.midpoint),
                    number(r.pre_integrated),
                    ratio(r.pre_integrated, r.midpoint),
                    ratio(r.pre_integrated_seconds, r.midpoint_seconds),
                ]
            })
            .collect();
        body += &table(&["RMS error", "slices, midpoint", "slices, pre-integrated", "ratio of slices", "ratio of times"], &rows);
    }
    body += "<h2>Where time goes</h2>\n";
    body += &figure("stages");
    body += &gradients_table(&record.gradients);
    body += &hits::section(&record.hits);
    body += &algorithms::section(&record.algorithms);
    body += &balance_table(&record.balance);
    body += "<h2>Reference, rendering, difference</h2>\n<div class=\"pictures\">\n";
    for p in pictures {
        let (data, caption) = (STANDARD.encode(&p.bytes), escape(&p.caption));
        body +=
            &format!("<figure><img alt=\"{caption}\" src=\"data:image/png;base64,{data}\"><figcaption>{caption}</figcaption></figure>\n");
    }
    body += "</div>\n";
    if record.costs.len() >= 2 {
        body += "<h2>Size</h2>\n";
        body += &figure("cost-image");
        body += &figure("cost-volume");
        body += "<p class=\"soft\">Volumes of other sizes are the same one with voxels left out or repeated, in the same box.</p>\n";
    }
    body += &measured(record);
    body += &all_points(&record.points);
    page(&format!("What error costs: {}", s.name), &body)
}

fn measured(record: &Record) -> String {
    let s = &record.setting;
    let pixels = match s.reference_step {
        1 => format!("all {} pixels", s.reference_pixels),
        n => format!("every {n}. column and row ({} pixels)", s.reference_pixels),
    };
    let bound = match record.hits.len() {
        0 => format!("to a bound of {}", error(s.reference_bound)),
        _ => "exact but for rounding".into(),
    };
    format!(
        "<h2>How this was measured</h2>\n<p>Error: red, green and blue over black against {}, cell by cell, {}; taken on {pixels}; the reference took {}. Time: the whole picture at its own size, once everything that depends on \
         volume and transfer function only is prepared; the shortest of several frames after a first one, in rounds over all pictures. \
         Error is computed outside the timed part. From 256 slices on, pixels end at a transmittance of the scene's own times \
         (256 / N)<sup>2</sup>, so that ending early never sets the error. The study took {} of {} granted. slicestack {}.</p>\n",
        truth(record),
        bound,
        time(s.reference_seconds),
        time(s.seconds),
        time(s.budget),
        escape(&s.version)
    )
}
