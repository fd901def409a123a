//! The differences as tables.

use super::Measured;
use super::scenes::Bits;
use std::fmt::Write;
use std::path::Path;

/// Writes `conformance.json` and `conformance.md` into `folder`.
pub(crate) fn write(folder: &Path, measured: &[Measured], renderer: &str, version: &str) {
    std::fs::create_dir_all(folder).unwrap();
    std::fs::write(folder.join("conformance.json"), json(measured, renderer, version)).unwrap();
    std::fs::write(folder.join("conformance.md"), markdown(measured, renderer, version)).unwrap();
}

fn json(measured: &[Measured], renderer: &str, version: &str) -> String {
    let mut text = format!("{{\n  \"renderer\": {renderer:?},\n  \"version\": {version:?},\n  \"scenes\": [\n");
    let rows: Vec<String> = measured
        .iter()
        .map(|m| {
            let results: Vec<String> = m
                .results
                .iter()
                .map(|(bits, d)| {
                    format!(
                        "{{ \"bits\": {:?}, \"max\": {:.5}, \"max_inside\": {:.5}, \"rms\": {:.5}, \"mean\": {:.5}, \"share_beyond_2\": {:.6}, \"held\": {} }}",
                        bits.name(),
                        d.most,
                        d.most_inside,
                        d.rms,
                        d.mean,
                        d.beyond,
                        d.check(*bits).is_ok()
                    )
                })
                .collect();
            let c = &m.coverage;
            format!(
                "    {{ \"group\": {:?}, \"name\": {:?}, \"fragments\": {}, \"outline_differs\": {}, \"inside_differs\": {},\n      \"pictures\": [\n        {}\n      ] }}",
                m.group,
                m.name,
                c.fragments,
                c.outline,
                c.inside,
                results.join(",\n        ")
            )
        })
        .collect();
    text += &rows.join(",\n");
    text + "\n  ]\n}\n"
}

/// Steps of 1/255, in few digits.
fn steps(x: f64) -> String {
    if x == 0.0 {
        "0".into()
    } else if x < 0.001 {
        format!("{x:.0e}")
    } else if x < 0.1 {
        format!("{x:.3}")
    } else {
        format!("{x:.2}")
    }
}

fn markdown(measured: &[Measured], renderer: &str, version: &str) -> String {
    let mut text = format!("Measured against {renderer}, {version}.\n");
    for bits in Bits::ALL {
        let rows: Vec<_> = measured.iter().flat_map(|m| m.results.iter().filter(|r| r.0 == bits).map(move |r| (m, r.1))).collect();
        if rows.is_empty() {
            continue;
        }
        writeln!(text, "\n### {}, {} scenes\n", capital(bits.name()), rows.len()).unwrap();
        text += "| scene | max | max off outlines | RMS | mean | pixels beyond 2 steps |\n|---|---|---|---|---|---|\n";
        let mut group = "";
        for (m, d) in rows {
            if m.group != group {
                group = m.group;
                writeln!(text, "| **{group}** | | | | | |").unwrap();
            }
            writeln!(
                text,
                "| {} | {} | {} | {} | {} | {:.3} % |",
                m.name,
                steps(d.most),
                steps(d.most_inside),
                steps(d.rms),
                steps(d.mean),
                d.beyond * 100.0
            )
            .unwrap();
        }
    }
    let fragments: f64 = measured.iter().map(|m| m.coverage.fragments).sum();
    let outline: f64 = measured.iter().map(|m| m.coverage.outline).sum();
    let inside: f64 = measured.iter().map(|m| m.coverage.inside).sum();
    let worst = measured.iter().max_by(|a, b| a.coverage.share().total_cmp(&b.coverage.share())).unwrap();
    writeln!(text, "\n### Coverage\n").unwrap();
    writeln!(
        text,
        "{fragments} fragments in {} scenes: {inside} differ inside slices, {outline} on outlines ({:.4} %; most in \"{}\", {:.4} %).",
        measured.len(),
        100.0 * outline / fragments,
        worst.name,
        100.0 * worst.coverage.share()
    )
    .unwrap();
    text
}

fn capital(text: &str) -> String {
    let mut letters = text.chars();
    letters.next().map(|c| c.to_uppercase().chain(letters).collect()).unwrap_or_default()
}
