//! `slicestack report` as a user meets it.
#![cfg(feature = "cli")]
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test fails by panicking")]

use serde_json::Value;
use std::fs;
use std::path::Path;
use std::process::{Command, Output};
use tempfile::TempDir;

const TINY: [&str; 13] = [
    "report",
    "--volume.phantom",
    "marschner-lobb",
    "--volume.size",
    "16",
    "--size",
    "40x32",
    "--slices.count",
    "64",
    "--budget",
    "1.5",
    "--camera.fit",
    "box",
];

fn run(dir: &Path, args: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_slicestack")).args(args).current_dir(dir).output().unwrap()
}

fn dir() -> TempDir {
    tempfile::tempdir().unwrap()
}

fn read(path: impl AsRef<Path>) -> String {
    String::from_utf8(fs::read(path.as_ref()).unwrap_or_else(|e| panic!("{}: {e}", path.as_ref().display()))).unwrap()
}

/// Rows of a CSV file as (column, text).
fn csv(path: impl AsRef<Path>) -> Vec<Vec<(String, String)>> {
    let mut reader = csv::Reader::from_path(path).unwrap();
    let head: Vec<String> = reader.headers().unwrap().iter().map(str::to_owned).collect();
    reader.records().map(|r| head.iter().cloned().zip(r.unwrap().iter().map(str::to_owned)).collect()).collect()
}

/// Whether a CSV cell says what a JSON value is.
fn same(cell: &str, value: &Value) -> bool {
    match value {
        Value::Null => cell.is_empty(),
        Value::String(text) => cell == text,
        Value::Bool(b) => cell == b.to_string(),
        // The reader of JSON rounds the last bit otherwise.
        Value::Number(n) => (cell.parse::<f64>().unwrap() - n.as_f64().unwrap()).abs() <= 1e-14 * n.as_f64().unwrap().abs(),
        _ => false,
    }
}

/// The CSV file holds what the list in the JSON holds, number for number.
fn agree(csv_path: &Path, list: &Value) -> usize {
    let rows = csv(csv_path);
    let list = list.as_array().unwrap();
    assert_eq!(rows.len(), list.len(), "{}", csv_path.display());
    for (row, object) in rows.iter().zip(list) {
        for (name, cell) in row {
            assert!(same(cell, &object[name]), "{}: {name}: {cell} is not {}", csv_path.display(), object[name]);
        }
    }
    rows.len()
}

/// Every tag that opens closes, in order; names of the elements.
fn elements(xml: &str) -> Vec<String> {
    let (mut open, mut all) = (Vec::new(), Vec::new());
    for part in xml.split('<').skip(1) {
        let (tag, _) = part.split_once('>').unwrap();
        let name = |t: &str| t.split_whitespace().next().unwrap().to_owned();
        if let Some(closed) = tag.strip_prefix('/') {
            assert_eq!(open.pop().as_deref(), Some(closed), "in {xml:.200}");
        } else {
            assert_eq!(tag.matches('"').count() % 2, 0, "{tag}");
            all.push(name(tag.trim_end_matches('/')));
            if !tag.ends_with('/') {
                open.push(name(tag));
            }
        }
    }
    assert!(open.is_empty(), "{open:?} left open");
    all
}

fn check_pictures(dir: &Path, plots: &[&str]) {
    for plot in plots {
        let svg = elements(&read(dir.join(format!("{plot}.svg"))));
        assert!(svg[0] == "svg" && svg.len() > 20, "{plot}: {svg:?}");
    }
    for entry in fs::read_dir(dir).unwrap().map(|e| e.unwrap().path()).filter(|p| p.extension().is_some_and(|e| e == "png")) {
        let mut reader = png::Decoder::new(std::io::BufReader::new(fs::File::open(&entry).unwrap())).read_info().unwrap();
        let mut data = vec![0; reader.output_buffer_size().unwrap()];
        reader.next_frame(&mut data).unwrap();
        assert!(data.iter().any(|&b| b != data[0]), "{}: of one colour", entry.display());
    }
}

/// The page fetches nothing and links nowhere.
fn check_page(html: &str) {
    assert!(html.starts_with("<!DOCTYPE html>") && html.trim_end().ends_with("</html>"));
    let outside = html.replace("http://www.w3.org/2000/svg", "");
    for word in ["http:", "https:", "href=", "url(", "@import", "<script", "<link"] {
        assert!(!outside.contains(word), "{word} in the page");
    }
    for source in html.split("src=\"").skip(1) {
        assert!(source.starts_with("data:image/png;base64,"), "{source:.60}");
    }
    assert!(html.contains("prefers-color-scheme:dark") && html.contains("@media print"));
}

/// No cell of a table is empty or holds a dash that is not explained, there and below the table.
fn check_cells(html: &str) {
    let mut dashes = 0;
    for part in html.split("<div class=\"scroll\"><table>").skip(1) {
        let (table, rest) = part.split_once("</table></div>").unwrap();
        let below = rest.split_once("</p>").map_or("", |p| p.0);
        for cell in table.split("<td").skip(1) {
            let (attributes, content) = cell.split_once('>').unwrap();
            let content = content.split_once("</td>").unwrap().0;
            assert!(!content.is_empty() && content != "-", "an empty cell in {table:.300}");
            if let Some(number) = content.strip_prefix("&ndash;") {
                let why = attributes.split_once("title=\"").unwrap().1.trim_end_matches('"');
                assert!(below.contains(&format!("&ndash;{number} {why}")), "{why}: not explained in {below}");
                dashes += 1;
            }
        }
    }
    assert!(dashes > 0, "no dash was seen");
}

/// The page begins with what errors look like: one detail at errors that fall, each with its error and its time.
fn check_strip(folder: &Path, json: &Value, html: &str) {
    let details = json["details"].as_array().unwrap();
    assert_eq!(details.iter().map(|d| d["error"].as_f64().unwrap()).collect::<Vec<_>>(), [1e-1, 1e-2, 1e-3, 1e-4]);
    let first = html.find("<h2>").unwrap();
    assert!(html[first..].starts_with("<h2>What an error looks like</h2>"));
    let strip = html[first..].split_once("</div>").unwrap().0;
    for (detail, figure) in details.iter().zip(strip.split("<figure>").skip(1)) {
        let rms = detail["rms"].as_f64().unwrap();
        assert!(figure.contains(&format!("RMS error {rms:.1e}")) && figure.contains("s a frame"), "{}", &figure[figure.len() - 200..]);
        assert!(detail["seconds"].as_f64().unwrap() > 0.0);
        let picture = slicestack::Picture::open(folder.join(format!("detail-{:e}.png", detail["error"].as_f64().unwrap()))).unwrap();
        let size = [&detail["width"], &detail["height"]].map(|n| n.as_u64().unwrap() as u32);
        assert_eq!([picture.width(), picture.height()], size);
    }
    // Here they can be had: each picture has the error that it stands for, and they differ.
    for d in details {
        let (rms, error) = (d["rms"].as_f64().unwrap(), d["error"].as_f64().unwrap());
        assert!(rms < 1.6 * error && rms > error / 1.6, "{d}");
    }
}

#[test]
fn a_small_scene_becomes_a_page_numbers_and_plots() {
    let dir = dir();
    let out = run(dir.path(), &[&TINY[..], &["-o", "r"]].concat());
    let told = String::from_utf8(out.stdout).unwrap();
    assert!(out.status.success(), "{}", String::from_utf8_lossy(&out.stderr));
    assert!(told.contains("cheapest way") && told.contains("1e-2") && told.contains("report.html"), "{told}");
    let folder = dir.path().join("r");
    let json: Value = serde_json::from_str(&read(folder.join("report.json"))).unwrap();
    for list in ["details", "points", "methods", "stages", "advice", "algorithms"] {
        assert!(agree(&folder.join(format!("{list}.csv")), &json[list]) > 0, "{list} is empty");
    }
    // Sizes are lists in the JSON and columns in the CSV.
    let costs = csv(folder.join("costs.csv"));
    assert_eq!(costs.len(), json["costs"].as_array().unwrap().len());
    assert!(costs.len() >= 4);
    let balance = csv(folder.join("balance.csv"));
    assert_eq!((balance.len(), json["balance"].as_array().unwrap().len()), (12, 3));
    check_pictures(&folder, &["work-precision", "convergence", "stages", "cost-image", "cost-volume"]);
    assert!(folder.join("reference.png").is_file() && folder.join("rendering.png").is_file());
    let html = read(folder.join("report.html"));
    check_page(&html);
    check_cells(&html);
    check_strip(&folder, &json, &html);
    // A few curves to look at, the others in grey.
    let (all, faint) = (html.matches("<g class=\"curve").count(), html.matches("<g class=\"curve faint\"").count());
    assert!(faint > 0 && faint < all, "{faint} of {all} curves are faint");
    let table = read(folder.join("table.md"));
    assert!(table.starts_with("| RMS error at most |") && table.lines().filter(|l| l.starts_with("| ")).count() == 8, "{table}");
    // The numbers make sense: times pass, errors fall.
    let points = json["points"].as_array().unwrap();
    assert!(points.iter().all(|p| p["seconds"].as_f64().unwrap() > 0.0 && p["rms"].as_f64().unwrap() > 0.0));
    let rms: Vec<f64> = points.iter().filter(|p| p["method"] == "midpoint").map(|p| p["rms"].as_f64().unwrap()).collect();
    assert!(rms.len() >= 2 && rms[rms.len() - 1] < 0.5 * rms[0], "{rms:?}");
    assert_eq!(json["methods"].as_array().unwrap().len(), slicestack::study::METHODS.len());
    // Along parallel rays shells are slices.
    let missing = json["methods"].as_array().unwrap().iter().filter(|m| !m["missing"].is_null());
    assert!(missing.clone().all(|m| m["name"] == "shells"), "{}", json["methods"]);
    // Every algorithm draws the scene, but for templates where rays are not parallel; rays as slices do.
    let error = |name: &str| {
        let row = json["algorithms"].as_array().unwrap().iter().find(|r| r["algorithm"] == name);
        row.unwrap_or_else(|| panic!("{name} is missing"))["rms"].as_f64().unwrap()
    };
    assert!((error("rays") / error("slices") - 1.0).abs() < 0.5, "{} for {}", error("rays"), error("slices"));
    // Every voxel that a ray passes tells more than one of each layer, and chance adds an error to that of slices.
    assert!(error("traversal, connectivity 6") < error("traversal, connectivity 26"));
    assert!(error("slices") < error("coin-flips, 64 games"));
    assert!(error("object-slices") < error("object-slices, spacing_correction false"));
    assert!(html.contains("<h2>Algorithms</h2>"));
    // Shares of a frame add up to it.
    let stages = json["stages"].as_array().unwrap();
    let sum: f64 = stages.iter().filter(|s| s["method"] == "midpoint").map(|s| s["share"].as_f64().unwrap()).sum();
    assert!((sum - 1.0).abs() < 1e-9, "{sum}");
    // A second report takes the first one's place.
    assert!(run(dir.path(), &[&TINY[..], &["-o", "r", "--methods", "midpoint"]].concat()).status.success());
    let json: Value = serde_json::from_str(&read(folder.join("report.json"))).unwrap();
    assert_eq!(json["methods"].as_array().unwrap().len(), 1);
}

#[test]
fn lit_scenes_tell_what_each_kind_of_gradient_costs() {
    let dir = dir();
    let out = run(
        dir.path(),
        &[&TINY[..], &["-o", "r", "--methods", "midpoint", "--light.ambient", "0.3", "--light.gradient_floor", "0.05"]].concat(),
    );
    assert!(out.status.success(), "{}", String::from_utf8_lossy(&out.stderr));
    let folder = dir.path().join("r");
    let json: Value = serde_json::from_str(&read(folder.join("report.json"))).unwrap();
    let rows = json["gradients"].as_array().unwrap();
    assert_eq!(rows.iter().map(|r| r["kind"].as_str().unwrap()).collect::<Vec<_>>(), ["central", "analytic", "sobel"]);
    for r in rows {
        let (rms, bound) = (r["rms"].as_f64().unwrap(), r["reference_bound"].as_f64().unwrap());
        assert!(rms > 0.0 && rms < 0.02 && bound < 1e-10 && r["seconds"].as_f64().unwrap() > 0.0, "{r}");
    }
    assert_eq!(agree(&folder.join("gradients.csv"), &json["gradients"]), 3);
    assert!(read(folder.join("report.html")).contains("Kinds of gradient"));
    // Opacity that depends on the gradient goes without slabs between two values: those methods are told as missing.
    let weighted =
        [&TINY[..], &["-o", "r", "--methods", "midpoint,pre-integrated", "--transfer.gradient_opacity", "[0, 0.1], [0.2, 1]"]].concat();
    let out = run(dir.path(), &weighted);
    assert!(out.status.success(), "{}", String::from_utf8_lossy(&out.stderr));
    let json: Value = serde_json::from_str(&read(folder.join("report.json"))).unwrap();
    assert!(json["methods"][1]["missing"].as_str().unwrap().contains("gradient_opacity"), "{}", json["methods"]);
    assert_eq!(json["gradients"].as_array().unwrap().len(), 3);
    // Elsewhere there are none.
    assert!(run(dir.path(), &[&TINY[..], &["-o", "r", "--methods", "midpoint"]].concat()).status.success());
    assert!(csv(folder.join("gradients.csv")).is_empty() && !read(folder.join("report.html")).contains("Kinds of gradient"));
}

#[test]
fn scenes_of_surfaces_tell_refined_hits_from_first_samples() {
    let dir = dir();
    let scene = "[volume]\nphantom = \"cloud\"\nsize = 24\n[camera]\nfit = \"box\"\n[image]\nwidth = 40\nheight = 32\n[slices]\ncount = 64\n[render]\n\
                 blend = \"iso\"\nlevels = [{ level = 0.3, color = [0.9, 0.4, 0.3] }, { level = 0.15, color = [0.3, 0.8, 0.4], opacity = 0.4 }]\n";
    fs::write(dir.path().join("s.toml"), scene).unwrap();
    let methods = "midpoint,pre-integrated,cubic";
    let out = run(dir.path(), &["report", "s.toml", "-o", "r", "--budget", "1.5", "--methods", methods]);
    let told = String::from_utf8(out.stdout).unwrap();
    assert!(out.status.success(), "{}", String::from_utf8_lossy(&out.stderr));
    let folder = dir.path().join("r");
    let json: Value = serde_json::from_str(&read(folder.join("report.json"))).unwrap();
    let rows = json["hits"].as_array().unwrap();
    assert_eq!(agree(&folder.join("hits.csv"), &json["hits"]), 8);
    let number = |r: &Value, name: &str| r[name].as_f64().unwrap_or_else(|| panic!("{name} in {r}"));
    for (pair, slices) in rows.chunks(2).zip([16, 32, 64, 128]) {
        let (refined, first) = (&pair[0], &pair[1]);
        assert!(refined["kind"] == "refined" && first["kind"] == "first-sample", "{refined} {first}");
        assert!(refined["slices"] == slices && first["slices"] == slices && number(refined, "seconds") > 0.0);
        assert!(number(refined, "rms") < 0.7 * number(first, "rms"), "{refined} {first}");
        assert!(number(refined, "mean_distance") < 1e-3 * number(first, "mean_distance"), "{refined} {first}");
        assert!(number(first, "max_distance") <= 1.01, "{first}");
    }
    assert!(told.contains("first-sample") && told.contains("off, in slabs"), "{told}");
    let html = read(folder.join("report.html"));
    check_page(&html);
    assert!(html.contains("Kinds of hit") && html.contains("From 16 to 128 slices, the RMS error of refined hits goes from "));
    assert!(html.contains("exact but for rounding") && !html.contains("rays integrated"));
    // Slabs do not matter where surfaces are met between slices, and there is no order to expect.
    let found = json["methods"].as_array().unwrap();
    assert!(found[0]["missing"].is_null() && found[0]["expected_order"].is_null(), "{}", found[0]);
    assert!(found[1..].iter().all(|m| m["missing"].as_str().unwrap().contains("level surfaces")), "{}", json["methods"]);
    assert!(json["points"].as_array().unwrap().iter().all(|p| p["method"] == "midpoint"));
    // Scenes without levels have no such rows.
    let out = run(dir.path(), &[&TINY[..], &["-o", "r", "--methods", "midpoint"]].concat());
    assert!(out.status.success() && !String::from_utf8(out.stdout).unwrap().contains("first-sample"));
    let json: Value = serde_json::from_str(&read(folder.join("report.json"))).unwrap();
    assert!(json["hits"].as_array().unwrap().is_empty() && csv(folder.join("hits.csv")).is_empty());
    assert!(!read(folder.join("report.html")).contains("Kinds of hit"));
}

#[test]
fn errors_fall_as_fast_as_a_smooth_scene_lets_them() {
    let dir = dir();
    let scene = "[volume]\nphantom = \"hydrogen\"\nsize = 24\n[camera]\nazimuth = 20\nelevation = 15\n[image]\nwidth = 40\nheight = 40\n\
                 [transfer]\ncolor = [[0, 0.2, 0.4, 1], [1, 1, 0.6, 0.1]]\nopacity = [[0, 0], [1, 0.3]]\n";
    fs::write(dir.path().join("s.toml"), scene).unwrap();
    let out = run(dir.path(), &["report", "s.toml", "-o", "r", "--budget", "4", "--methods", "pre-integrated, second-order"]);
    assert!(out.status.success(), "{}", String::from_utf8_lossy(&out.stderr));
    let json: Value = serde_json::from_str(&read(dir.path().join("r/report.json"))).unwrap();
    for m in json["methods"].as_array().unwrap() {
        let order = m["measured_order"].as_f64().unwrap();
        assert!((1.5..3.2).contains(&order), "{}: {order}", m["name"]);
        assert_eq!(m["expected_order"], if m["name"] == "second-order" { 3 } else { 2 });
    }
    assert_eq!(json["setting"]["name"], "s");
}

/// Runs a command that is to fail with `status`: one line on stderr, nothing left behind.
fn refused(dir: &Path, args: &[&str], status: i32) -> String {
    let count = || fs::read_dir(dir).unwrap().count();
    let before = count();
    let out = run(dir, args);
    let line = String::from_utf8(out.stderr).unwrap();
    assert_eq!(out.status.code(), Some(status), "{args:?}: {line}");
    assert!(line.starts_with("error: ") && line.lines().count() == 1, "{args:?}: {line}");
    assert_eq!(count(), before, "{args:?} left something behind");
    line
}

#[test]
fn senseless_wishes_are_one_line_each() {
    let dir = dir();
    let with = |more: &[&'static str]| [&TINY[..9], more].concat();
    let said = refused(dir.path(), &with(&["-o", "r", "--methods", "midpiont"]), 2);
    assert!(said.contains("\"midpiont\"") && said.contains("\"midpoint\""), "{said}");
    assert!(refused(dir.path(), &with(&["-o", "r", "--methods", " , "]), 2).contains("pre-integrated"));
    for budget in ["0", "-3", "nan", "inf"] {
        assert!(refused(dir.path(), &with(&["-o", "r", "--budget", budget]), 2).contains("--budget"));
    }
    assert!(refused(dir.path(), &with(&["-o", "no/such/r"]), 1).contains("no/such/r"));
    assert!(refused(dir.path(), &["report", "-o", "r"], 2).contains("--stability"));
    assert!(refused(dir.path(), &with(&["-o", "r", "--stability"]), 2).contains("--stability"));
    assert!(refused(dir.path(), &["report", "missing.nrrd", "-o", "r"], 1).contains("missing.nrrd"));
    // There is no reference for these.
    assert!(refused(dir.path(), &with(&["-o", "r", "--render.blend", "mip"]), 1).contains("render blend"));
    assert!(refused(dir.path(), &with(&["-o", "r", "--render.blend", "iso", "--render.level", "0.5"]), 1).contains("render.levels"));
    fs::write(dir.path().join("f"), "mine").unwrap();
    assert!(refused(dir.path(), &with(&["-o", "f"]), 1).contains("f: is a file, not a folder"));
    // Other people's files are spared.
    fs::create_dir(dir.path().join("theirs")).unwrap();
    fs::write(dir.path().join("theirs/points.csv"), "mine").unwrap();
    assert!(refused(dir.path(), &with(&["-o", "theirs"]), 2).contains("theirs: holds other files"));
    assert_eq!(read(dir.path().join("theirs/points.csv")), "mine");
}

#[cfg(unix)]
#[test]
fn a_folder_that_cannot_be_written_to_is_told_before_the_work() {
    let dir = dir();
    // A device's folder takes no files, not even from those who may do everything.
    let said = refused(dir.path(), &[&TINY[..9], &["-o", "/proc/self"]].concat(), 1);
    assert!(said.contains("/proc/self: no file can be written there"), "{said}");
    let said = refused(dir.path(), &[&TINY[..9], &["-o", "/proc/self/report"]].concat(), 1);
    assert!(said.contains("/proc/self/report"), "{said}");
}

#[test]
fn extreme_cases_become_a_page_too() {
    let dir = dir();
    let out = run(dir.path(), &["report", "--stability", "-o", "s"]);
    let told = String::from_utf8(out.stdout).unwrap();
    assert_eq!(out.status.code(), Some(0), "{told}{}", String::from_utf8_lossy(&out.stderr));
    assert!(told.contains("riemann diverges from kappa D = 2.05 on"), "{told}");
    let folder = dir.path().join("s");
    let json: Value = serde_json::from_str(&read(folder.join("stability.json"))).unwrap();
    assert!(agree(&folder.join("stability.csv"), &json["rows"]) > 200);
    assert!(agree(&folder.join("counts.csv"), &json["counts"]) > 100);
    assert!(agree(&folder.join("riemann.csv"), &json["riemann"]) > 50);
    check_pictures(&folder, &["counts", "counts-faint", "riemann"]);
    let html = read(folder.join("stability.html"));
    check_page(&html);
    assert!(html.contains("does not hold") == json["rows"].as_array().unwrap().iter().any(|r| r["holds"] == false));
}

#[test]
fn the_readme_quotes_the_report() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let (readme, table) = (read(root.join("README.md")), read(root.join("docs/report/table.md")));
    assert!(readme.contains(table.trim_end()), "README.md does not hold docs/report/table.md");
    let json: Value = serde_json::from_str(&read(root.join("docs/report/report.json"))).unwrap();
    for a in json["advice"].as_array().unwrap() {
        let error = format!("| {:e} | ", a["error"].as_f64().unwrap());
        let row = table.lines().find(|l| l.starts_with(&error)).unwrap_or_else(|| panic!("no row for {error}"));
        if let Some(slices) = a["default_slices"].as_u64() {
            assert!(row.contains(&format!("{slices} slices")), "{row}");
        }
    }
}
