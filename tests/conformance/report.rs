//! The differences as tables: JSON for machines, Markdown for docs/opengl.md.

use super::scenes::Bits;
use super::{Compared, Measured};
use serde_json::{Value, json};
use std::path::Path;

/// The lines of docs/opengl.md that the table stands between.
const BEGIN: &str = "<!-- begin: written by the conformance test -->\n";
const END: &str = "<!-- end -->\n";

/// Writes `opengl.json` into `folder`, and the tables into its `opengl.md`.
pub(crate) fn write(folder: &Path, measured: &[Measured], driver: &str) {
    let text = serde_json::to_string_pretty(&json(measured, driver)).unwrap() + "\n";
    std::fs::write(folder.join("opengl.json"), text).unwrap();
    let page = folder.join("opengl.md");
    let old = std::fs::read_to_string(&page).unwrap();
    let (head, rest) = old.split_once(BEGIN).expect("docs/opengl.md has a place for the tables");
    let (_, tail) = rest.split_once(END).expect("docs/opengl.md says where the tables end");
    std::fs::write(page, format!("{head}{BEGIN}\n{}\n{END}{tail}", markdown(measured, driver))).unwrap();
}

fn json(measured: &[Measured], driver: &str) -> Value {
    let rounded = |x: f64| (x * 1e6).round() / 1e6;
    let picture = |m: &Measured, r: &Compared| {
        let numbers = |d: &super::Difference| {
            json!({
                "max": rounded(d.most), "max_off_outlines": rounded(d.most_inside), "rms": rounded(d.rms), "mean": rounded(d.mean),
                "share_beyond_2": rounded(d.beyond),
            })
        };
        json!({
            "bits": r.bits.name(),
            "both_filter_in_fixed_point": numbers(&r.fixed),
            "mesa_in_fixed_point_slicestack_in_floats": numbers(&r.mixed),
            "both_filter_in_floats": numbers(&r.float),
            "held": r.fixed.check(r.bits, m.case.jumps()).is_ok(),
        })
    };
    let scenes: Vec<Value> = measured
        .iter()
        .map(|m| {
            json!({
                "group": m.case.group,
                "name": m.case.name,
                "fragments": m.coverage.fragments,
                "fragments_that_differ_on_outlines": m.coverage.outline,
                "fragments_that_differ_elsewhere": m.coverage.inside,
                "pictures": m.results.iter().map(|r| picture(m, r)).collect::<Vec<_>>(),
            })
        })
        .collect();
    json!({ "driver": driver, "unit": "1/255", "scenes": scenes })
}

/// Steps of 1/255, in few digits.
fn steps(x: f64) -> String {
    match x {
        0.0 => "0".into(),
        x if x < 0.001 => format!("{x:.0e}"),
        x if x < 0.1 => format!("{x:.3}"),
        x => format!("{x:.2}"),
    }
}

fn percent(x: f64) -> String {
    if x == 0.0 { "0".into() } else { format!("{:.3} %", x * 100.0) }
}

fn markdown(measured: &[Measured], driver: &str) -> String {
    let mut text = format!(
        "Driver: {driver}. {} scenes, each in up to four kinds of numbers. Differences are over all four components, in steps of 1/255.\n\n",
        measured.len()
    );
    text += &summary(measured);
    text += "\n### Coverage\n\n";
    let sum = |of: fn(&Measured) -> f64| measured.iter().map(of).sum::<f64>();
    let (fragments, outline, inside) = (sum(|m| m.coverage.fragments), sum(|m| m.coverage.outline), sum(|m| m.coverage.inside));
    let worst = measured.iter().max_by(|a, b| a.coverage.share().total_cmp(&b.coverage.share())).unwrap();
    text += &format!(
        "{fragments} fragments: {inside} differ inside slices, {outline} on outlines ({}; most in \"{}\", {}).\n",
        percent(outline / fragments),
        worst.case.name,
        percent(worst.coverage.share())
    );
    for bits in Bits::ALL {
        let rows: Vec<(&Measured, &Compared)> =
            measured.iter().flat_map(|m| m.results.iter().filter(|r| r.bits == bits).map(move |r| (m, r))).collect();
        if !rows.is_empty() {
            text += &table(bits, &rows);
        }
    }
    text
}

/// The worst of every kind of numbers.
fn summary(measured: &[Measured]) -> String {
    let mut text = String::from(
        "| numbers | filtered by both in | pictures | worst RMS | worst mean | most pixels beyond 2 steps | largest off outlines |\n|---|---|---|---|---|---|---|\n",
    );
    type Pick = fn(&Compared) -> &super::Difference;
    let ways: [(&str, Pick); 3] =
        [("fixed point, as Mesa does", |r| &r.fixed), ("Mesa fixed point, slicestack floats", |r| &r.mixed), ("floats", |r| &r.float)];
    for bits in Bits::ALL {
        for (way, pick) in ways {
            let all: Vec<_> = measured.iter().flat_map(|m| &m.results).filter(|r| r.bits == bits).map(pick).collect();
            if all.is_empty() || (bits == Bits::Float && way != "floats") {
                continue;
            }
            let worst = |of: fn(&super::Difference) -> f64| all.iter().map(|d| of(d)).fold(0.0, f64::max);
            text += &format!(
                "| {} | {way} | {} | {} | {} | {} | {} |\n",
                bits.name(),
                all.len(),
                steps(worst(|d| d.rms)),
                steps(worst(|d| d.mean)),
                percent(worst(|d| d.beyond)),
                steps(worst(|d| d.most_inside))
            );
        }
    }
    text
}

fn table(bits: Bits, rows: &[(&Measured, &Compared)]) -> String {
    let mut text = format!("\n### {}\n\n", capital(bits.name()));
    text += "| scene | max | max off outlines | RMS | mean | beyond 2 steps | in floats: max off outlines | RMS |\n|---|---|---|---|---|---|---|---|\n";
    let mut group = "";
    for (m, r) in rows {
        if m.case.group != group {
            group = m.case.group;
            text += &format!("| **{group}** | | | | | | | |\n");
        }
        let (d, f) = (&r.fixed, &r.float);
        text += &format!(
            "| {} | {} | {} | {} | {} | {} | {} | {} |\n",
            m.case.name,
            steps(d.most),
            steps(d.most_inside),
            steps(d.rms),
            steps(d.mean),
            percent(d.beyond),
            steps(f.most_inside),
            steps(f.rms)
        );
    }
    text
}

fn capital(text: &str) -> String {
    let mut letters = text.chars();
    letters.next().map(|c| c.to_uppercase().chain(letters).collect()).unwrap_or_default()
}
