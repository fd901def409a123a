//! The differences as tables: comma-separated values for machines, Markdown for docs/opengl.md.

use super::scenes::Bits;
use super::{Compared, Measured};
use std::path::Path;

/// The lines of docs/opengl.md that the table stands between.
const BEGIN: &str = "<!-- begin: written by the conformance test -->\n";
const END: &str = "<!-- end -->\n";

/// Writes `opengl.csv` into `folder`, and the tables into its `opengl.md`.
pub(crate) fn write(folder: &Path, measured: &[Measured], driver: &str) {
    std::fs::write(folder.join("opengl.csv"), csv(measured, driver)).unwrap();
    let page = folder.join("opengl.md");
    let old = std::fs::read_to_string(&page).unwrap();
    let (head, rest) = old.split_once(BEGIN).expect("docs/opengl.md has a place for the tables");
    let (_, tail) = rest.split_once(END).expect("docs/opengl.md says where the tables end");
    std::fs::write(page, format!("{head}{BEGIN}\n{}\n{END}{tail}", markdown(measured, driver))).unwrap();
}

/// A line for each picture and each way to filter; differences in steps of 1/255.
fn csv(measured: &[Measured], driver: &str) -> String {
    let mut text = format!("# {driver}; differences in steps of 1/255\n");
    text += "group,scene,numbers,mesa filters in,slicestack filters in,max,max off outlines,rms,mean,share beyond 2 steps,";
    text += "fragments,differing on outlines,differing elsewhere\n";
    for m in measured {
        for r in &m.results {
            for (mesa, own, d) in [("fixed", "fixed", &r.fixed), ("fixed", "float", &r.mixed), ("float", "float", &r.float)] {
                text += &format!(
                    "{},\"{}\",\"{}\",{mesa},{own},{:.5},{:.5},{:.5},{:.5},{:.5},{},{},{}\n",
                    m.case.group,
                    m.case.name,
                    r.bits.name(),
                    d.most,
                    d.most_inside,
                    d.rms,
                    d.mean,
                    d.beyond,
                    m.coverage.fragments,
                    m.coverage.outline,
                    m.coverage.inside
                );
            }
        }
    }
    text
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
        "| numbers | filtered by both in | pictures | worst RMS | worst mean | most pixels beyond 2 steps | largest off outlines and jumps |\n|---|---|---|---|---|---|---|\n",
    );
    type Pick = fn(&Compared) -> &super::Difference;
    let ways: [(&str, Pick); 3] =
        [("fixed point, as Mesa does", |r| &r.fixed), ("Mesa fixed point, slicestack floats", |r| &r.mixed), ("floats", |r| &r.float)];
    for bits in Bits::ALL {
        for (way, pick) in ways {
            let of_bits = |m: &'_ &Measured| m.results.iter().find(|r| r.bits == bits).map(pick).copied();
            let all: Vec<super::Difference> = measured.iter().filter_map(|m| of_bits(&m)).collect();
            let smooth: Vec<super::Difference> = measured.iter().filter(|m| !m.case.jumps()).filter_map(|m| of_bits(&m)).collect();
            if all.is_empty() || (bits == Bits::Float && way != "floats") {
                continue;
            }
            let worst = |of: fn(&super::Difference) -> f64| all.iter().map(of).fold(0.0, f64::max);
            text += &format!(
                "| {} | {way} | {} | {} | {} | {} | {} |\n",
                bits.name(),
                all.len(),
                steps(worst(|d| d.rms)),
                steps(worst(|d| d.mean)),
                percent(worst(|d| d.beyond)),
                steps(smooth.iter().map(|d| d.most_inside).fold(0.0, f64::max))
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
