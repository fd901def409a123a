//! The README's comparison with other renderers is what was measured.
#![cfg(feature = "cli")]
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test fails by panicking")]

use serde_json::Value;
use slicestack::scene::{Overrides, SceneFile};
use std::fs;
use std::path::{Path, PathBuf};

fn package() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR"))
}

fn read(path: impl AsRef<Path>) -> String {
    fs::read_to_string(package().join(path)).unwrap()
}

/// The cells of the tables' rows.
fn rows(table: &str) -> Vec<Vec<String>> {
    let cells = |line: &str| line.trim_matches('|').split('|').map(|c| c.trim().to_owned()).collect();
    table.lines().filter(|l| l.starts_with("| ")).map(cells).collect()
}

/// A number as it is told, to the digits that are told.
fn tells(cell: &str, value: f64) -> bool {
    let text = cell.trim_matches('*').trim_end_matches(" ms");
    let told: f64 = text.parse().unwrap();
    // Errors have two digits; times and ratios are whole numbers or have one decimal.
    let digit = if text.contains('e') {
        0.06 * told
    } else if text.contains('.') {
        0.051
    } else {
        0.51
    };
    (told - value).abs() <= digit
}

#[test]
fn the_readme_shows_the_table() {
    let (readme, table) = (read("README.md"), read("docs/peers/table.md"));
    let (_, after) = readme.split_once("<!-- begin: printed by the bench peers -->").unwrap();
    let (shown, _) = after.split_once("<!-- end: printed by the bench peers -->").unwrap();
    assert_eq!(shown.trim(), table.trim(), "README.md does not hold docs/peers/table.md");
}

#[test]
fn the_table_tells_what_was_measured() {
    let json: Value = serde_json::from_str(&read("docs/peers/peers.json")).unwrap();
    let rows = rows(&read("docs/peers/table.md"));
    let mut means = Vec::new();
    for peer in ["llvmpipe", "VTK", "VTK, lit", "VTK's default, lit", "VolPack"] {
        let start = rows.iter().position(|r| r[1] == peer).unwrap();
        let of_peer: Vec<&Value> = json["rows"].as_array().unwrap().iter().filter(|r| r["peer"] == peer).collect();
        assert!(of_peer.len() >= 4, "{peer}: {} rows", of_peer.len());
        let mut logarithms = 0.0;
        for (row, told) in of_peer.iter().zip(&rows[start + 1..]) {
            assert_eq!(row["scene"], told[0]);
            let number = |value: &Value| value.as_f64().unwrap();
            let (theirs, ours) = (number(&row["seconds"]), number(&row["counted"]["seconds"]));
            let aim = number(&row["measured"]["error"]) / number(&row["measured"]["part"]);
            assert!(number(&row["counted"]["error"]) <= aim, "{told:?}");
            assert!(tells(&told[2], number(&row["measured"]["error"])) && tells(&told[5], number(&row["counted"]["error"])), "{told:?}");
            assert!(tells(&told[3], 1e3 * theirs) && tells(&told[6], 1e3 * ours) && tells(&told[7], theirs / ours), "{told:?}");
            let by_tolerance = &row["tolerance"];
            assert!(
                tells(&told[9], number(&by_tolerance["error"])) && tells(&told[10], 1e3 * number(&by_tolerance["seconds"])),
                "{told:?}"
            );
            logarithms += (theirs / ours).ln();
        }
        let mean = &rows[start + 1 + of_peer.len()];
        assert_eq!(mean[0], "geometric mean");
        assert!(tells(mean[7].split(' ').next().unwrap(), (logarithms / of_peer.len() as f64).exp()), "{peer}: {mean:?}");
        means.push(mean[7].clone());
    }
    assert_eq!(means.len(), 5);
}

#[test]
fn its_scenes_can_be_read() {
    let mut found = 0;
    for entry in fs::read_dir(package().join("benches/peers")).unwrap() {
        let path = entry.unwrap().path();
        if path.extension().is_some_and(|e| e == "toml") {
            let file = SceneFile::read(&path, &Overrides::default()).unwrap();
            let built_in = path.ends_with("marschner-lobb.toml");
            assert_eq!(file.volume().path().is_none(), built_in, "{}", path.display());
            found += 1;
        }
    }
    assert_eq!(found, 4);
}
