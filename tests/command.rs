//! The command as a user meets it: exit statuses, one-line errors, what goes to which stream, what is left behind.
#![cfg(feature = "cli")]
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test fails by panicking")]

use serde_json::Value;
use slicestack::volume::io::Format;
use std::fs;
use std::path::Path;
use std::process::{Command, Output};
use tempfile::TempDir;

const SMALL: [&str; 6] = ["--size", "16x12", "--volume.size", "8", "--count", "16"];
const RAW: [&str; 5] = ["v.raw", "--volume.dimensions", "4,5,6", "--volume.type", "u8"];

fn run(dir: &Path, args: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_slicestack")).args(args).current_dir(dir).output().unwrap()
}

fn dir() -> TempDir {
    tempfile::tempdir().unwrap()
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8(bytes.to_vec()).unwrap()
}

fn files(dir: &Path) -> Vec<String> {
    let mut names: Vec<String> = fs::read_dir(dir).unwrap().map(|e| e.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    names
}

/// Runs a command that is to fail with `status`: one line on stderr, nothing on stdout, no file more than before.
fn refused(dir: &Path, args: &[&str], status: i32) -> String {
    let before = files(dir);
    let out = run(dir, args);
    let line = text(&out.stderr);
    assert_eq!(out.status.code(), Some(status), "{args:?}: {line}");
    assert!(line.starts_with("error: ") && line.lines().count() == 1, "{args:?}: {line}");
    assert!(out.stdout.is_empty(), "{args:?}: {}", text(&out.stdout));
    assert_eq!(files(dir), before, "{args:?}");
    line
}

/// `render` of a small built-in volume.
fn small<'a>(more: &[&'a str]) -> Vec<&'a str> {
    [&["render"][..], &SMALL, more].concat()
}

fn raw_volume(dir: &Path) {
    let voxels: Vec<u8> = (0..4 * 5 * 6).map(|i| (i * 2) as u8).collect();
    fs::write(dir.join("v.raw"), voxels).unwrap();
}

#[test]
fn without_arguments_the_built_in_volume_becomes_slicestack_png() {
    let dir = dir();
    let out = run(dir.path(), &small(&[]));
    assert!(out.status.success(), "{}", text(&out.stderr));
    assert!(out.stdout.is_empty() && out.stderr.is_empty(), "{}", text(&out.stderr));
    assert_eq!(files(dir.path()), ["slicestack.png"]);
    let file = std::io::BufReader::new(fs::File::open(dir.path().join("slicestack.png")).unwrap());
    let mut reader = png::Decoder::new(file).read_info().unwrap();
    assert_eq!((reader.info().width, reader.info().height), (16, 12));
    let mut pixels = vec![0; reader.output_buffer_size().unwrap()];
    reader.next_frame(&mut pixels).unwrap();
    assert!(pixels.chunks(4).any(|p| p[3] > 0), "something is to be seen");
}

#[test]
fn formats_go_by_name_and_by_flag() {
    let dir = dir();
    for (args, magic) in [
        (&["-o", "a.npy"][..], &b"\x93NUMPY"[..]),
        (&["-o", "a.exr"], b"\x76\x2f\x31\x01"),
        (&["-o", "a.png", "--depth", "16"], b"\x89PNG"),
        (&["-o", "a.dat", "--format", "npy"], b"\x93NUMPY"),
        (&["-o", "a.webp"], b"RIFF"),
        (&["-o", "a.tif", "--depth", "16"], b"II\x2a\0"),
        (&["-o", "a.jpeg", "--background", "white"], b"\xff\xd8\xff"),
        (&["-o", "b.dat", "--format", "jpeg", "--background", "white"], b"\xff\xd8\xff"),
    ] {
        let out = run(dir.path(), &small(args));
        assert!(out.status.success(), "{args:?}: {}", text(&out.stderr));
        assert!(fs::read(dir.path().join(args[1])).unwrap().starts_with(magic), "{args:?}");
    }
    let npy = fs::read(dir.path().join("a.npy")).unwrap();
    assert_eq!(npy.len(), 128 + 16 * 12 * 16);
    assert_eq!(run(dir.path(), &small(&["-o", "-", "--format", "npy"])).stdout, npy);
    assert!(run(dir.path(), &small(&["-o", "-"])).stdout.starts_with(b"\x89PNG"));
}

#[test]
fn statistics_say_what_the_picture_cost() {
    let dir = dir();
    let out = run(dir.path(), &small(&["--stats", "-", "--repeat", "2", "--threads", "1", "--simd", "scalar", "--tile", "8", "--explain"]));
    assert!(out.status.success(), "{}", text(&out.stderr));
    let stats: Value = serde_json::from_slice(&out.stdout).unwrap();
    for key in ["load", "prepare", "render"] {
        assert!(stats["seconds"][key].as_f64().unwrap() >= 0.0, "{key}");
    }
    assert_eq!((stats["slices"].as_u64(), stats["threads"].as_u64(), stats["simd"].as_str()), (Some(16), Some(1), Some("scalar")));
    assert!(stats["fragments"].as_u64().unwrap() > 0 && stats["fetches"].as_u64().unwrap() > 0);
    assert_eq!(stats["sha256"].as_str().unwrap().len(), 64);
    assert_eq!(stats["warnings"], Value::Array(vec![]));
    let left_out = stats["left_out"].as_array().unwrap();
    assert!(left_out.iter().any(|l| l["stage"] == "fog" && !l["why"].as_str().unwrap().is_empty()));
    // The table for people goes to the other stream and holds the same stages.
    let table = text(&out.stderr);
    assert!(left_out.iter().all(|l| table.contains(l["stage"].as_str().unwrap())), "{table}");
    // Its numbers are those of the file, and add up.
    let number = |row: &str| -> u64 {
        let line = table.lines().find(|l| l.starts_with(row)).unwrap_or_else(|| panic!("no row {row}: {table}"));
        let digits = line[row.len()..].trim_start().split("  ").next().unwrap().replace(' ', "");
        digits.parse().unwrap_or_else(|_| panic!("{line}"))
    };
    let tally = |key: &str| stats["tally"][key].as_u64().unwrap();
    let (covered, corners) = (number("covered by slices"), number("between two slices"));
    assert_eq!((covered, Some(covered)), (tally("fragments"), stats["fragments"].as_u64()));
    assert_eq!(covered + corners, number("= looked up") + number("+ passed over, empty") + number("+ passed over, finished"));
    assert_eq!(number("done"), number("= for fragments") + number("+ in lanes beside them") + number("+ between slabs"));
    assert_eq!(Some(number("done")), stats["fetches"].as_u64());
    for saved in left_out.iter().filter_map(|l| l.get("saved")) {
        assert!(saved["count"].as_u64().unwrap() <= saved["of"].as_u64().unwrap() && saved["unit"].is_string(), "{saved}");
    }
    let fog = left_out.iter().find(|l| l["stage"] == "fog").unwrap();
    assert_eq!(fog["saved"]["count"].as_u64().unwrap(), tally("lanes"));
    // How it was run changes no byte.
    let other = run(dir.path(), &small(&["--stats", "s.json", "--threads", "3"]));
    assert!(other.status.success() && other.stdout.is_empty());
    let again: Value = serde_json::from_slice(&fs::read(dir.path().join("s.json")).unwrap()).unwrap();
    assert_eq!(again["sha256"], stats["sha256"]);
}

#[test]
fn scene_files_and_flags_make_one_scene() {
    let dir = dir();
    raw_volume(dir.path());
    fs::create_dir(dir.path().join("sub")).unwrap();
    let toml =
        "[volume]\npath = \"../v.raw\"\ndimensions = [4, 5, 6]\ntype = \"u8\"\n[image]\nwidth = 9\nheight = 7\n[camera]\nazimuth = 10\n";
    let json = r#"{"volume": {"path": "../v.raw", "dimensions": [4, 5, 6], "type": "u8"},
        "image": {"width": 9, "height": 7}, "camera": {"azimuth": 10}}"#;
    fs::write(dir.path().join("sub/s.toml"), toml).unwrap();
    fs::write(dir.path().join("sub/s.json"), json).unwrap();
    let picture = |args: &[&str]| {
        let out = run(dir.path(), &[&["render", "-o", "-", "--format", "npy"], args].concat());
        assert!(out.status.success(), "{args:?}: {}", text(&out.stderr));
        out.stdout
    };
    let from_toml = picture(&["sub/s.toml"]);
    assert_eq!(picture(&["sub/s.json"]), from_toml);
    let flags = [&RAW[..], &["--image.width", "9", "--image.height", "7", "--camera.azimuth", "10"]].concat();
    assert_eq!(picture(&flags), from_toml);
    let turned = picture(&["sub/s.toml", "--azimuth", "-80"]);
    assert!(turned.len() == from_toml.len() && turned != from_toml);
    let cut = picture(&["sub/s.toml", "--clip", "1,0,0,2", "--clip", "0,1,0,1"]);
    assert_ne!(cut, from_toml);
    assert_ne!(picture(&["sub/s.toml", "--background", "#102030"]), from_toml);
    let matrix = |m: &str| picture(&["sub/s.toml", "--render.profile", "opengl", "--opengl.texture_matrix", m]);
    let flat = matrix("0,1,0,0,1,0,0,0,0,0,1,0,0,0,0,1");
    assert_eq!(flat, matrix("[[0,1,0,0],[1,0,0,0],[0,0,1,0],[0,0,0,1]]"));
    assert_ne!(flat, matrix("1,0,0,0,0,1,0,0,0,0,1,0,0,0,0,1"));
}

#[test]
fn warnings_are_lines_on_stderr() {
    let dir = dir();
    raw_volume(dir.path());
    let out = run(dir.path(), &[&["render"], &RAW[..], &["--size", "4x4", "--preset", "ct-bone", "--stats", "-"]].concat());
    assert!(out.status.success());
    let lines = text(&out.stderr);
    assert!(lines.lines().all(|l| l.starts_with("warning: ")) && lines.contains("ct-bone needs Hounsfield units"), "{lines}");
    let stats: Value = serde_json::from_slice(&out.stdout).unwrap();
    assert_eq!(stats["warnings"].as_array().unwrap().len(), lines.lines().count());
}

#[test]
fn wrong_usage_ends_with_2() {
    let dir = dir();
    for (args, want) in [
        (&["frobnicate"][..], "unrecognized subcommand 'frobnicate'"),
        (&["render", "--foo"], "unexpected argument '--foo'"),
        (&["render", "a", "b"], "unexpected argument 'b'"),
        (&["render", "-o", "a.bmp"], "a.bmp: unknown picture extension \"bmp\": use .png, .npy, .exr, .jpg, .webp or .tif"),
        (&["render", "-o", "a.gif"], "a.gif: GIF is read but not written"),
        (&["render", "-o", "a"], "a: unknown picture extension \"\""),
        (&["render", "-o", "a.npy", "--depth", "16"], "--depth 16 is for PNG and TIFF; NumPy holds 32-bit floats"),
        (&["render", "-o", "a.webp", "--depth", "16"], "--depth 16 is for PNG and TIFF; WebP holds 8 bits"),
        (&["render", "--depth", "12"], "invalid value '12'"),
        (&["render", "--size", "12"], "--size 12: write WIDTHxHEIGHT"),
        (&["render", "--size=-1x3"], "--size -1x3: write"),
        (&["render", "--background", "pinkish"], "--background pinkish"),
        (&["render", "--background", "#12345"], "--background #12345"),
        (&["render", "--background", "0,0,0,2"], "--image.background 2: outside [0,1]"),
        (&["render", "--repeat", "0"], "invalid value '0'"),
        (&["render", "--threads", "0"], "invalid value '0'"),
        (&["render", "--tile", "0"], "invalid value '0'"),
        (&["render", "--simd", "mmx"], "--simd mmx: this machine has auto, scalar"),
        (&["render", "-o", "-", "--stats", "-"], "cannot both go to stdout"),
        (&["render", "--count", "0"], "--slices.count 0: must lie between"),
        (&["render", "--count", "5", "--slices.count", "6"], "--count and --slices.count say the same thing"),
        (&["render", "--size", "8x8", "--image.height", "9"], "--size and --image.height say the same thing"),
        (&["render", "--camera.zoom", "x"], "--camera.zoom: cannot read \"x\""),
        (&["render", "--fog.mode", "smog"], "invalid value 'smog'"),
        (&["render", "--preset", "bone"], "invalid value 'bone'"),
        (&["render", "--opengl.wrap", "repeat"], "--opengl.wrap: is for render.profile"),
        (&["info"], "required arguments"),
        (&["completions", "cmd"], "invalid value 'cmd'"),
    ] {
        let line = refused(dir.path(), args, 2);
        assert!(line.contains(want), "{args:?}: {line}");
    }
    let bare = run(dir.path(), &[]);
    assert_eq!(bare.status.code(), Some(2));
    assert!(text(&bare.stderr).contains("Examples:"));
}

#[test]
fn failures_end_with_1_name_the_file_and_leave_nothing() {
    let dir = dir();
    raw_volume(dir.path());
    let write = |name: &str, bytes: &[u8]| fs::write(dir.path().join(name), bytes).unwrap();
    write("empty.nrrd", b"");
    write("text.nii", b"this is no volume at all");
    write("bad.toml", b"[volume]\npath = \"v.raw\"\n[camera]\nazimut = 3\n");
    write("broken.toml", b"[volume\n");
    write("none.toml", b"[image]\nwidth = 3\n");
    write("binary.toml", b"\xff\xfe\x00");
    write("lost.toml", b"[volume]\npath = \"lost.raw\"\n");
    fs::create_dir(dir.path().join("d.png")).unwrap();
    fs::create_dir(dir.path().join("scans")).unwrap();
    write("scans/ct.nrrd", b"NRRD0004\n");
    write("folder.toml", b"[volume]\npath = \"scans\"\n");
    let folder = "scans: is a directory, not a volume: give one volume file, such as \"ct.nrrd\" in it";
    for (args, want) in [
        (&["render", "nothing.nrrd"][..], "nothing.nrrd: "),
        (&["render", "nothing.toml"], "nothing.toml: "),
        (&["render", "empty.nrrd"], "empty.nrrd: "),
        (&["render", "text.nii"], "text.nii: "),
        (&["render", "bad.toml"], "bad.toml: line 4: camera.azimut: unknown key; the nearest known one is camera.azimuth"),
        (&["render", "broken.toml"], "broken.toml: line 1: "),
        (&["render", "none.toml"], "none.toml: volume: give volume.path"),
        (&["render", "binary.toml"], "binary.toml: not a scene"),
        (&["render", "lost.toml"], "lost.raw: "),
        (&["render", "v.raw", "--volume.dimensions", "40,50,60", "--volume.type", "u8"], "v.raw: "),
        (&["render", "-o", "no/such/a.png"], "no/such/a.png: there is no directory no/such"),
        (&["render", "-o", "d.png"], "d.png: is a directory"),
        (&["render", "--stats", "no/such/s.json"], "no/such/s.json: there is no directory"),
        (&["info", "nothing.nrrd"], "nothing.nrrd: "),
        (&["info", "text.nii"], "text.nii: "),
        (&["render", "scans"], folder),
        (&["render", "scans/"], "give one volume file, such as"),
        (&["render", "folder.toml"], folder),
        (&["info", "scans"], folder),
        (&["explain", "scans"], folder),
        (&["report", "scans", "-o", "r"], folder),
        (&["render", "scans", "--volume.dimensions", "4,5,6", "--volume.type", "u8"], "scans: is a directory, not a file"),
    ] {
        let line = refused(dir.path(), args, 1);
        assert!(line.contains(want), "{args:?}: {line}");
        assert!(line.matches("os error").count() <= 1, "told twice: {line}");
    }
}

#[test]
fn info_tells_what_a_file_is() {
    let dir = dir();
    raw_volume(dir.path());
    let args = [&["info"], &RAW[..], &["--volume.spacing", "1,1,2", "--volume.intercept", "-10"]].concat();
    let told = text(&run(dir.path(), &args).stdout);
    for want in ["4 x 5 x 6 = 120 voxels", "u8", "1 1 2", "-10 to 228, mean 109", "(-0.5 -0.5 -1) to (3.5 4.5 11)", "grey-ramp"] {
        assert!(told.contains(want), "{want} in\n{told}");
    }
    let json: Value = serde_json::from_slice(&run(dir.path(), &[&args[..], &["--json"]].concat()).stdout).unwrap();
    assert_eq!(json["dimensions"], serde_json::json!([4, 5, 6]));
    assert_eq!(json["histogram"].as_array().unwrap().iter().map(|n| n.as_u64().unwrap()).sum::<u64>(), 120);
    assert!(json["presets"].as_array().unwrap().iter().any(|p| p == "grey-ramp"));
    assert!(json["rejected"].as_array().unwrap().iter().any(|p| p["preset"] == "ct-bone"));
}

#[test]
fn help_teaches_every_key() {
    let dir = dir();
    let long = text(&run(dir.path(), &["render", "--help"]).stdout);
    let opengl = text(&run(dir.path(), &["help", "opengl"]).stdout);
    let schema: Value = serde_json::from_slice(&run(dir.path(), &["schema"]).stdout).unwrap();
    let mut keys = 0;
    for (section, inner) in schema["properties"].as_object().unwrap() {
        for key in inner["properties"].as_object().into_iter().flat_map(|p| p.keys()) {
            let path = format!("{section}.{key}");
            // Some have a shorter flag in their place; those of OpenGL a list of their own.
            let shorter = ["transfer.preset", "image.width", "image.height", "image.background", "slices.count"];
            let shorter = shorter.contains(&path.as_str()) || ["azimuth", "elevation", "zoom"].contains(&key.as_str());
            // Lists of tables are for scene files.
            let shorter = shorter || section == "transfer2d" || ["render.levels", "volume.path"].contains(&path.as_str());
            let help = if section == "opengl" { &opengl } else { &long };
            assert!(shorter || help.contains(&format!("--{path} ")), "--{path}");
            keys += 1;
        }
    }
    assert!(keys > 40 && long.contains("--clip ") && long.contains("Examples:"));
    let info = text(&run(dir.path(), &["info", "--help"]).stdout);
    for format in Format::ALL {
        let line = info.lines().find(|l| {
            l.trim_start().starts_with(&format!("{format} ")) && format.extensions().first().is_none_or(|e| l.contains(&format!(".{e}")))
        });
        assert!(line.is_some(), "{format} in\n{info}");
    }
    let short = run(dir.path(), &["render", "-h"]);
    assert!(short.status.success() && !text(&short.stdout).contains("--camera.azimuth <"));
    assert!(text(&run(dir.path(), &["--version"]).stdout).starts_with("slicestack "));
}

#[test]
fn the_schema_is_one_and_lists_choices() {
    let schema: Value = serde_json::from_slice(&run(dir().path(), &["schema"]).stdout).unwrap();
    assert_eq!(schema["$schema"], "https://json-schema.org/draft/2020-12/schema");
    assert_eq!((schema["type"].as_str(), schema["additionalProperties"].as_bool()), (Some("object"), Some(false)));
    let words = |section: &str, key: &str| schema["properties"][section]["properties"][key]["enum"].to_string();
    assert!(words("transfer", "preset").contains("\"ct-bone\""));
    assert!(words("transfer", "colormap").contains("\"viridis\""));
    assert!(words("volume", "phantom").contains("\"marschner-lobb\""));
    assert!(!schema.to_string().contains("$ref"));
}

#[test]
fn completions_and_lists_are_printed() {
    let dir = dir();
    for shell in ["bash", "zsh", "fish", "elvish", "powershell"] {
        let script = text(&run(dir.path(), &["completions", shell]).stdout);
        assert!(script.contains("slicestack") && script.contains("camera.azimuth"), "{shell}");
    }
    let list = text(&run(dir.path(), &["presets"]).stdout);
    assert!(list.contains("mr-brain") && list.contains("coolwarm") && !list.contains('\x1b'));
}

#[test]
fn inputs_and_files_that_are_no_pictures_are_never_replaced() {
    let dir = dir();
    raw_volume(dir.path());
    let scene = "[volume]\npath = \"v.raw\"\ndimensions = [4, 5, 6]\ntype = \"u8\"\n";
    fs::write(dir.path().join("s.toml"), scene).unwrap();
    fs::write(dir.path().join("notes.png"), "not a picture").unwrap();
    let before = fs::read(dir.path().join("v.raw")).unwrap();
    let cases: [(&[&str], &str); 6] = [
        (&["render", "s.toml", "-o", "s.toml", "--format", "png"], "s.toml: would overwrite the input"),
        (&["render", "s.toml", "-o", "v.raw", "--format", "npy"], "v.raw: is there already and is no picture"),
        (&["render", "s.toml", "-o", "./notes.png"], "notes.png: is there already and is no picture"),
        (&["render", "s.toml", "-o", "p.png", "--stats", "s.toml"], "s.toml: would overwrite the input"),
        (&["render", "s.toml", "-o", "p.png", "--stats", "notes.png"], "notes.png: is there already and is no file of statistics"),
        (&["render", "s.toml", "-o", "p.png", "--stats", "p.png"], "p.png: picture and statistics cannot both go there"),
    ];
    for (args, told) in cases {
        let line = refused(dir.path(), args, 2);
        assert!(line.contains(told), "{args:?}: {line}");
    }
    assert_eq!(fs::read(dir.path().join("v.raw")).unwrap(), before);
    assert_eq!(fs::read_to_string(dir.path().join("s.toml")).unwrap(), scene);
    assert_eq!(fs::read_to_string(dir.path().join("notes.png")).unwrap(), "not a picture");
    // A picture may be made again.
    for _ in 0..2 {
        let out = run(dir.path(), &["render", "s.toml", "-o", "p.png", "--stats", "p.json", "--size", "9x9"]);
        assert!(out.status.success(), "{}", text(&out.stderr));
    }
}

/// Runs the command with `input` sent through a pipe.
fn piped(dir: &Path, args: &[&str], input: &[u8]) -> Output {
    use std::io::Write;
    use std::process::Stdio;
    let mut child = Command::new(env!("CARGO_BIN_EXE_slicestack"))
        .args(args)
        .current_dir(dir)
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    // A command that has read enough closes the pipe.
    drop(child.stdin.take().unwrap().write_all(input));
    child.wait_with_output().unwrap()
}

#[test]
fn volumes_come_through_standard_input() {
    let dir = dir();
    let voxels: Vec<u8> = (0..4 * 5 * 6).map(|i| (i * 2) as u8).collect();
    let nrrd = [b"NRRD0004\ntype: uchar\ndimension: 3\nsizes: 4 5 6\nencoding: raw\n\n", &voxels[..]].concat();
    fs::write(dir.path().join("v.nrrd"), &nrrd).unwrap();
    let of_file: Value = serde_json::from_slice(&run(dir.path(), &["info", "v.nrrd", "--json"]).stdout).unwrap();
    let through: Value = serde_json::from_slice(&piped(dir.path(), &["info", "-", "--json"], &nrrd).stdout).unwrap();
    assert_eq!((&through["dimensions"], &through["histogram"]), (&of_file["dimensions"], &of_file["histogram"]));
    assert_eq!(through["name"], "standard input");
    let picture = |input, name| ["render", input, "-o", name, "--size", "16x12", "--count", "16", "--no-metadata"];
    assert!(run(dir.path(), &picture("v.nrrd", "file.png")).status.success());
    let out = piped(dir.path(), &picture("-", "pipe.png"), &nrrd);
    assert!(out.status.success(), "{}", text(&out.stderr));
    // A file that the shell opened.
    let shell = Command::new(env!("CARGO_BIN_EXE_slicestack"))
        .args(picture("-", "shell.png"))
        .current_dir(dir.path())
        .stdin(fs::File::open(dir.path().join("v.nrrd")).unwrap())
        .output()
        .unwrap();
    assert!(shell.status.success(), "{}", text(&shell.stderr));
    let bytes = |name: &str| fs::read(dir.path().join(name)).unwrap();
    assert_eq!(bytes("file.png"), bytes("pipe.png"));
    assert_eq!(bytes("file.png"), bytes("shell.png"));
    let out = piped(dir.path(), &["info", "-"], b"nothing of the kind");
    assert_eq!(text(&out.stderr).lines().count(), 1);
    assert!(text(&out.stderr).contains("standard input: no volume format is known"), "{}", text(&out.stderr));
    let out = piped(dir.path(), &["info", "-"], b"");
    assert!(text(&out.stderr).contains("standard input: the file is empty"), "{}", text(&out.stderr));
}

#[test]
fn what_may_be_chosen_is_listed_and_told() {
    let dir = dir();
    let nrrd = b"NRRD0004\ntype: uchar\ndimension: 4\nsizes: 2 2 2 3\nkinds: space space space list\nencoding: raw\n\n";
    fs::write(dir.path().join("v.nrrd"), [&nrrd[..], &(0..24).collect::<Vec<u8>>()].concat()).unwrap();
    let shown = text(&run(dir.path(), &["info", "v.nrrd"]).stdout);
    assert!(shown.contains("* frame 0 to 2") && shown.contains("frame 0 of 3 is read"), "{shown}");
    let json: Value = serde_json::from_slice(&run(dir.path(), &["info", "v.nrrd", "--json", "--volume.frame", "2"]).stdout).unwrap();
    assert_eq!(
        (json["choices"][0]["count"].as_u64(), json["min"].as_f64(), json["notes"].as_array().map(Vec::len)),
        (Some(3), Some(16.0), Some(0))
    );
    let out = run(dir.path(), &["render", "v.nrrd", "--size", "16x12", "--count", "16"]);
    assert!(out.status.success() && text(&out.stderr).contains("note: frame 0 of 3 is read"), "{}", text(&out.stderr));
    let line = refused(dir.path(), &["render", "v.nrrd", "--volume.frame", "3"], 1);
    assert!(line.contains("v.nrrd: volume.frame is 3: there are 3, 0 to 2"), "{line}");
    let line = refused(dir.path(), &["render", "v.nrrd", "--volume.series", "1.2.826.0.1"], 1);
    assert!(line.contains("NRRD has no series to choose"), "{line}");
    refused(dir.path(), &["render", "--volume.phantom", "cloud", "--volume.level", "1"], 2);
}

#[test]
fn no_part_of_an_input_is_replaced() {
    let dir = dir();
    let voxels: Vec<u8> = (0..4 * 5 * 6).map(|i| (i * 2) as u8).collect();
    let put = |name: &str, bytes: &[u8]| fs::write(dir.path().join(name), bytes).unwrap();
    put("v.raw", &voxels);
    put("v.mhd", b"NDims = 3\nDimSize = 4 5 6\nElementType = MET_UCHAR\nElementDataFile = v.raw\n");
    put("v.nhdr", b"NRRD0004\ntype: uchar\ndimension: 3\nsizes: 4 5 6\nencoding: raw\ndata file: v.raw\n");
    put("many.nhdr", b"NRRD0004\ntype: uchar\ndimension: 3\nsizes: 4 5 1\nencoding: raw\ndata file: s%d.raw 1 1 1\n");
    put("s1.raw", &voxels[..20]);
    for input in ["v.mhd", "v.nhdr"] {
        assert!(refused(dir.path(), &["convert", input, "v.raw", "--force"], 2).contains("v.raw: would overwrite a part of the input"));
    }
    assert!(refused(dir.path(), &["convert", "many.nhdr", "s1.raw", "--force"], 2).contains("a part of the input"));
    assert_eq!(fs::read(dir.path().join("v.raw")).unwrap(), voxels);
    // A folder of images, and a pattern.
    fs::create_dir(dir.path().join("stack")).unwrap();
    for n in 1..4 {
        let image = image::GrayImage::from_fn(8, 8, |x, y| image::Luma([(x * y * n) as u8]));
        image.save(dir.path().join(format!("stack/s{n}.png"))).unwrap();
    }
    let before = fs::read(dir.path().join("stack/s2.png")).unwrap();
    for input in ["stack", "stack/s*.png"] {
        for args in [&["render", input, "-o", "stack/s2.png"][..], &["slices", input, "-o", "stack/s2.png"]] {
            assert!(refused(dir.path(), args, 2).contains("would overwrite a part of the input"), "{args:?}");
        }
        refused(dir.path(), &["convert", input, "stack/s2.png", "--format", "raw", "--force"], 2);
    }
    assert_eq!(fs::read(dir.path().join("stack/s2.png")).unwrap(), before);
    // What the command wrote there itself gives way.
    let own = ["render", "stack/s*.png", "-o", "stack/picture.png", "--size", "16x12", "--count", "16"];
    assert!(run(dir.path(), &own).status.success() && run(dir.path(), &own).status.success());
    // What standard input comes from.
    let nrrd = [b"NRRD0004\ntype: uchar\ndimension: 3\nsizes: 4 5 6\nencoding: raw\n\n", &voxels[..]].concat();
    put("in.nrrd", &nrrd);
    let out = Command::new(env!("CARGO_BIN_EXE_slicestack"))
        .args(["convert", "-", "in.nrrd", "--force"])
        .current_dir(dir.path())
        .stdin(fs::File::open(dir.path().join("in.nrrd")).unwrap())
        .output()
        .unwrap();
    assert_eq!(out.status.code(), Some(2), "{}", text(&out.stderr));
    assert_eq!(fs::read(dir.path().join("in.nrrd")).unwrap(), nrrd);
}

#[test]
fn the_manual_has_a_page_for_each_verb() {
    let dir = dir();
    for _ in 0..2 {
        let out = run(dir.path(), &["manual", "man1"]);
        assert!(out.status.success(), "{}", text(&out.stderr));
    }
    let page = |name: &str| fs::read_to_string(dir.path().join("man1").join(name)).unwrap();
    let help = text(&run(dir.path(), &["--help"]).stdout);
    let verbs: Vec<&str> = help
        .lines()
        .skip_while(|l| !l.starts_with("Commands:"))
        .skip(1)
        .take_while(|l| l.starts_with("  "))
        .filter_map(|l| l.split_whitespace().next())
        .collect();
    assert!(verbs.len() > 15 && verbs.contains(&"render"), "{verbs:?}");
    for verb in verbs.iter().filter(|v| **v != "help") {
        assert!(page(&format!("slicestack-{verb}.1")).contains(&format!(".TH slicestack-{verb} 1")), "{verb}");
    }
    let render = page("slicestack-render.1");
    assert!(render.contains("\\-\\-repeat") && render.contains("shortest time"), "{render}");
    assert!(page("slicestack.1").contains("slicestack\\-render(1)"));
    fs::write(dir.path().join("man1/slicestack-render.1"), "mine").unwrap();
    assert!(refused(dir.path(), &["manual", "man1"], 1).contains("is no page of this manual"));
}
