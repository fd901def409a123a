//! The tables of a scene's page.

use super::super::record::{Advice, Balance, GradientKind, MethodRecord, Point, Record};
use super::page::{Cell, table};
use super::scene::{asked, default_of};
use super::{error, time};

/// Why an error has no time.
const NOT_REACHED: &str = "no picture that was made within the budget has so small an error";

/// The cheapest way to each error.
pub(super) fn advice_table(record: &Record) -> String {
    let row = |a: &Advice| {
        vec![
            Cell::Number(format!("{:e}", a.error)),
            Cell::Text(if a.method.is_some() { asked(a, "") } else { "not reached within the budget".into() }),
            Cell::number(a.seconds, time, NOT_REACHED),
            Cell::number(a.rms, error, NOT_REACHED),
            match a.default_slices {
                Some(_) => Cell::Text(default_of(a)),
                None => Cell::Missing("no picture of the default method that was made within the budget has so small an error"),
            },
        ]
    };
    let rows: Vec<Vec<Cell>> = record.advice.iter().map(row).collect();
    table(&["RMS error at most", "cheapest way", "time of a frame", "its error", "by the default alone"], &rows)
}

/// Heading, table and remark; nothing where nothing was measured.
pub(super) fn balance_table(list: &[Balance]) -> String {
    let Some(first) = list.first() else { return String::new() };
    let percent = |x: f64| Cell::Number(format!("{:.1} %", 100.0 * x));
    let row = |b: &Balance| {
        let mut row = vec![
            Cell::Number(format!("{0} x {0}", b.tile)),
            Cell::Number(b.tiles.to_string()),
            Cell::Number(time(b.longest)),
            Cell::Number(time(b.seconds)),
            percent(b.idle),
        ];
        row.extend(b.shared.iter().map(|s| Cell::Number(format!("{:.1} x, {:.1} %", s.speedup, 100.0 * s.mean_idle))));
        row
    };
    let more: Vec<String> = first.shared.iter().map(|s| format!("on {} threads", s.threads)).collect();
    let mut head = vec!["tile", "tiles", "longest", "frame", "idle"];
    head.extend(more.iter().map(String::as_str));
    let rows: Vec<Vec<Cell>> = list.iter().map(row).collect();
    format!(
        "<h2>How work falls on threads</h2>\n{}<p class=\"soft\">Frame and idle: measured on {} threads, idle being the share of the frame that the \
         least busy of them had nothing to do. The rest is worked out from the shortest time of each tile in several frames, each tile going to the \
         first thread that is free: how many times as fast as one thread, and how much of the time threads stand idle on average.</p>\n",
        table(&head, &rows),
        first.threads
    )
}

/// Heading, table and remark; nothing where the scene depends on no gradient.
pub(super) fn gradients_table(list: &[GradientKind]) -> String {
    let Some(first) = list.first() else { return String::new() };
    let row = |g: &GradientKind| {
        vec![
            Cell::Text(g.kind.clone()),
            Cell::Number(time(g.seconds)),
            Cell::Number(error(g.rms)),
            Cell::Number(error(g.max)),
            Cell::Number(error(g.reference_bound)),
        ]
    };
    let rows: Vec<Vec<Cell>> = list.iter().map(row).collect();
    format!(
        "<h2>Kinds of gradient</h2>\n{}<p class=\"soft\">The scene in {} slices with each kind, against the reference with the same kind, on {} \
         pixels. Pictures of different kinds are different pictures: see which one is wanted.</p>\n",
        table(&["gradient", "frame", "RMS", "largest", "bound of the reference"], &rows),
        first.slices,
        first.reference_pixels
    )
}

/// Why methods have no order, or no error.
const UNSTEADY: &str = "too few pictures whose error falls steadily to tell an order";
const NOT_MADE: &str = "no pictures of it were made";

/// Every method, its order, and what is to be said of it.
pub(super) fn methods_table(methods: &[MethodRecord], points: &[Point]) -> String {
    let row = |m: &MethodRecord| {
        let least = points.iter().filter(|p| p.method == m.name).map(|p| p.rms).fold(f64::INFINITY, f64::min);
        let remark = match (&m.other_limit, &m.missing) {
            (_, Some(why)) => Cell::Text(format!("not made: {why}")),
            (Some(why), None) => Cell::Text(format!("converges to another picture: it {why}")),
            (None, None) => Cell::Missing("nothing to remark: with more slices it comes to the reference"),
        };
        let made = m.missing.is_none();
        vec![
            Cell::Text(m.name.clone()),
            Cell::Text(m.about.clone()),
            Cell::number(
                m.expected_order,
                |o| o.to_string(),
                "no number of slices is chosen, or surfaces are met between slices: no order is expected",
            ),
            Cell::number(m.measured_order, |o| format!("{o:.2}"), if made { UNSTEADY } else { NOT_MADE }),
            Cell::number(least.is_finite().then_some(least), error, NOT_MADE),
            remark,
        ]
    };
    let rows: Vec<Vec<Cell>> = methods.iter().map(row).collect();
    table(&["method", "what it does", "order expected", "measured", "least error", "remark"], &rows)
}

/// Why there is no SSIM or FLIP.
const NO_TIME: &str = "there was no time for it within the budget";

/// Every picture, folded away.
pub(super) fn all_points(points: &[Point]) -> String {
    let row = |p: &Point| {
        vec![
            Cell::Text(p.method.clone()),
            Cell::Number(p.slices.to_string()),
            Cell::number(p.tolerance, |t| t.to_string(), "the slices were given, not an error asked for"),
            Cell::Number(time(p.seconds)),
            Cell::Number(time(p.prepare_seconds)),
            Cell::Number(error(p.rms)),
            Cell::Number(error(p.max)),
            Cell::Number(error(p.p999)),
            Cell::number(p.psnr, |x| format!("{x:.1} dB"), "infinite: no difference at all"),
            Cell::Number(format!("{:.1} %", 100.0 * p.visible)),
            Cell::number(p.ssim, |x| format!("{x:.4}"), NO_TIME),
            Cell::number(p.flip, |x| format!("{x:.4}"), NO_TIME),
        ]
    };
    let rows: Vec<Vec<Cell>> = points.iter().map(row).collect();
    let head =
        ["method", "slices", "tolerance", "frame", "prepared", "RMS", "largest", "99.9 %", "PSNR", "off by 1/255 or more", "SSIM", "FLIP"];
    format!("<details><summary>All {} pictures in numbers</summary>\n{}</details>\n", points.len(), table(&head, &rows))
}
