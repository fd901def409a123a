//! The verb `explain` as a user meets it: what it writes, what it refuses, what is left behind.
#![cfg(feature = "cli")]
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test fails by panicking")]

use serde_json::Value;
use std::fs;
use std::path::Path;
use std::process::{Command, Output};
use tempfile::TempDir;

const SMALL: [&str; 6] = ["--size", "24x20", "--volume.size", "12", "--count", "20"];

fn run(dir: &Path, args: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_slicestack")).arg("explain").args(args).current_dir(dir).output().unwrap()
}

fn small<'a>(more: &[&'a str]) -> Vec<&'a str> {
    [&SMALL[..], more].concat()
}

fn dir() -> TempDir {
    tempfile::tempdir().unwrap()
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8(bytes.to_vec()).unwrap()
}

/// Everything in `dir`, folders with what is in them.
fn tree(dir: &Path) -> Vec<String> {
    let mut names = Vec::new();
    for entry in fs::read_dir(dir).unwrap().map(Result::unwrap) {
        let name = entry.file_name().into_string().unwrap();
        if entry.path().is_dir() {
            names.extend(tree(&entry.path()).into_iter().map(|inner| format!("{name}/{inner}")));
        }
        names.push(name);
    }
    names.sort();
    names
}

/// Runs a command that is to fail with `status`: one line on stderr, nothing on stdout, no file or folder more than before.
fn refused(dir: &Path, args: &[&str], status: i32) -> String {
    let before = tree(dir);
    let out = run(dir, args);
    let line = text(&out.stderr);
    assert_eq!(out.status.code(), Some(status), "{args:?}: {line}");
    assert!(line.starts_with("error: ") && line.lines().count() == 1, "{args:?}: {line}");
    assert!(out.stdout.is_empty(), "{args:?}");
    assert_eq!(tree(dir), before, "{args:?}");
    line
}

#[test]
fn a_page_of_the_built_in_volume() {
    let dir = dir();
    let out = run(dir.path(), &small(&[]));
    assert!(out.status.success() && out.stdout.is_empty() && out.stderr.is_empty(), "{}", text(&out.stderr));
    assert_eq!(tree(dir.path()), ["slicestack-explain", "slicestack-explain/index.html"]);
    let page = fs::read_to_string(dir.path().join("slicestack-explain/index.html")).unwrap();
    assert!(page.starts_with("<!doctype html>\n") && page.len() < 4 << 20);
    // A page may be replaced by a page.
    assert!(run(dir.path(), &small(&[])).status.success());
}

#[test]
fn the_record_is_the_pages_and_holds_the_pixel_asked_for() {
    let dir = dir();
    let args = small(&["-o", "page", "--pixel", "12,9", "--slices", "4..15", "--json", "-"]);
    let out = run(dir.path(), &args);
    assert!(out.status.success(), "{}", text(&out.stderr));
    let record: Value = serde_json::from_slice(&out.stdout).unwrap();
    let pixel = &record["pixels"][record["chosen"].as_u64().unwrap() as usize];
    assert_eq!((pixel["x"].as_u64(), pixel["y"].as_u64()), (Some(12), Some(9)));
    assert_eq!(record["slices"], serde_json::json!([4, 15]));
    assert_eq!(record["stack"]["slices"].as_array().unwrap().len(), 11);
    assert!(!pixel["slice"].as_array().unwrap().is_empty());
    let page = fs::read_to_string(dir.path().join("page/index.html")).unwrap();
    let inside = page.split_once("id=\"record\">").unwrap().1.split_once("</script>").unwrap().0;
    assert_eq!(serde_json::from_str::<Value>(inside).unwrap(), record);
    // The same record every time, in a file too.
    assert!(run(dir.path(), &small(&["-o", "page", "--pixel", "12,9", "--slices", "4..15", "--json", "r.json"])).status.success());
    assert_eq!(fs::read(dir.path().join("r.json")).unwrap(), out.stdout);
}

#[test]
fn frames_show_the_picture_building_up() {
    let dir = dir();
    let out = run(dir.path(), &small(&["-o", "page", "--frames"]));
    assert!(out.status.success(), "{}", text(&out.stderr));
    let names = tree(&dir.path().join("page"));
    // As many frames as there are slices, since these are fewer than frames wanted.
    assert_eq!(names.iter().filter(|n| n.starts_with("frame-")).count(), 20, "{names:?}");
    let pixels = |name: &str| {
        let file = std::io::BufReader::new(fs::File::open(dir.path().join("page").join(name)).unwrap());
        let mut reader = png::Decoder::new(file).read_info().unwrap();
        let frames = reader.info().animation_control().map(|a| a.num_frames);
        let mut bytes = vec![0; reader.output_buffer_size().unwrap()];
        reader.next_frame(&mut bytes).unwrap();
        (frames, bytes)
    };
    assert_eq!(pixels("build-up.png").0, Some(20));
    assert_eq!(pixels("build-up.png").1, pixels("frame-00.png").1);
    let mut render = Command::new(env!("CARGO_BIN_EXE_slicestack"));
    assert!(render.arg("render").args(SMALL).args(["-o", "whole.png"]).current_dir(dir.path()).status().unwrap().success());
    assert_eq!(pixels("frame-19.png").1, pixels("../whole.png").1);
    assert_ne!(pixels("frame-05.png").1, pixels("frame-19.png").1);
}

#[test]
fn bad_input_is_told_in_one_line_and_leaves_nothing() {
    let dir = dir();
    fs::write(dir.path().join("file.txt"), "mine").unwrap();
    fs::create_dir(dir.path().join("mine")).unwrap();
    fs::write(dir.path().join("mine/index.html"), "my own page").unwrap();
    for (args, status, words) in [
        (&["--pixel", "24,5"][..], 1, &["pixel 24,5", "24 x 20"][..]),
        (&["--pixel", "5,20"], 1, &["pixel 5,20"]),
        (&["--pixel", "0,0"], 1, &["pixel 0,0", "passes the box by"]),
        (&["--pixel", "-3,5"], 2, &["--pixel -3,5"]),
        (&["--pixel", "3"], 2, &["--pixel 3"]),
        (&["--slices", "10..21"], 1, &["slices 10..21", "20 slices"]),
        (&["--slices", "20..25"], 1, &["20 slices"]),
        (&["--slices", "7..7"], 2, &["7..7", "empty"]),
        (&["--slices", "9..4"], 2, &["9..4", "reversed"]),
        (&["--slices", "all"], 2, &["--slices all"]),
        (&["-o", "file.txt"], 1, &["file.txt", "not a folder"]),
        (&["-o", "file.txt/page"], 1, &["file.txt"]),
        (&["-o", "no/such/place"], 1, &["no/such"]),
        (&["-o", "mine"], 2, &["index.html", "is no page"]),
        (&["-o", "-"], 2, &["folder"]),
        (&["--json", "file.txt"], 2, &["file.txt", "no record"]),
        (&["--json", "no/r.json"], 1, &["no/r.json"]),
        (&["--render.profile", "opengl"], 1, &["profile opengl"]),
        (&["--render.algorithm", "shells"], 1, &["render algorithm shells", "flat slices"]),
        (&["--slices.jitter", "3"], 1, &["slices jitter", "flat slices"]),
        (&["--cut", "1,0,0"], 1, &["cut: a page follows rays through the whole box"]),
        (&["--render.filter", "cubic"], 1, &["render filter cubic", "64"]),
        (&["--camera.azimuth", "north"], 2, &["camera.azimuth"]),
    ] {
        let line = refused(dir.path(), &small(args), status);
        assert!(words.iter().all(|w| line.contains(w)), "{args:?}: {line}");
    }
    assert!(refused(dir.path(), &["absent.nrrd"], 1).contains("absent.nrrd"));
    assert_eq!(fs::read_to_string(dir.path().join("mine/index.html")).unwrap(), "my own page");
}

#[cfg(target_os = "linux")]
#[test]
fn a_folder_that_takes_no_files_is_told_and_left() {
    // Nobody, not even root, can make files in /proc.
    let dir = dir();
    for place in ["/proc/slicestack-page", "/proc"] {
        let line = refused(dir.path(), &small(&["-o", place, "--json", "r.json"]), 1);
        assert!(line.contains(place), "{line}");
    }
}

#[test]
fn a_pixel_that_no_slice_covers_gets_a_page() {
    let dir = dir();
    // The left half is cut away.
    let args = small(&["--azimuth", "0", "--elevation", "0", "--clip", "1,0,0,5.5", "--pixel", "7,10", "--json", "-", "-o", "page"]);
    let out = run(dir.path(), &args);
    assert!(out.status.success(), "{}", text(&out.stderr));
    let record: Value = serde_json::from_slice(&out.stdout).unwrap();
    assert_eq!(record["pixels"][0]["span"], Value::Null);
    assert!(!record["pixels"][0]["through"].is_null());
    assert!(fs::read_to_string(dir.path().join("page/index.html")).unwrap().contains("No slice covers pixel"));
}
