//! Pictures that prove themselves, as a user meets them: `compare`, `render --save-scene`, `verify`, `golden`.
#![cfg(feature = "cli")]
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test fails by panicking")]

use serde_json::Value;
use slicestack::picture::{Depth, Format, Metadata};
use slicestack::proof::{Inputs, verify_bounded};
use slicestack::{Picture, Progress, Settings, assert_golden};
use std::fs;
use std::path::Path;
use std::process::{Command, Output};
use std::sync::Arc;
use tempfile::TempDir;

fn run(dir: &Path, args: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_slicestack")).args(args).current_dir(dir).output().unwrap()
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8(bytes.to_vec()).unwrap()
}

/// What a command that ends with `status` says on stdout and on stderr, where a failure says one line.
fn ends(dir: &Path, args: &[&str], status: i32) -> (String, String) {
    let out = run(dir, args);
    let (told, errors) = (text(&out.stdout), text(&out.stderr));
    assert_eq!(out.status.code(), Some(status), "{args:?}: {told}{errors}");
    if status != 0 {
        assert!(errors.starts_with("error: ") && errors.lines().count() == 1, "{args:?}: {errors}");
    }
    (told, errors)
}

fn dir() -> TempDir {
    tempfile::tempdir().unwrap()
}

fn picture(off: f32) -> Picture {
    let pixel = |i: u32| if i == 16 * 5 + 9 { [0.5 + off, 0.25, 0.0, 1.0] } else { [0.5, 0.25, 0.0, 1.0] };
    Picture::from_pixels(16, 12, (0..16 * 12).map(pixel).collect()).unwrap()
}

/// A volume in a file whose folder, name and header are nobody's business.
fn private_volume(dir: &Path) -> &'static str {
    fs::create_dir_all(dir.join("ward-seven")).unwrap();
    let mut bytes =
        b"NRRD0004\n# Doe^Jane 1970-01-01\ntype: unsigned char\ndimension: 3\nsizes: 8 9 10\nencoding: raw\ncontent: Doe^Jane\n\
        spacings: 1 1 1.5\nPatientName:=Doe^Jane\n\n"
            .to_vec();
    bytes.extend((0..8 * 9 * 10).map(|i| (i * 7 % 251) as u8));
    fs::write(dir.join("ward-seven/doe-jane.nrrd"), bytes).unwrap();
    "ward-seven/doe-jane.nrrd"
}

const SMALL: [&str; 4] = ["--size", "24x20", "--count", "24"];

fn render<'a>(input: &'a str, more: &[&'a str]) -> Vec<&'a str> {
    [&["render", input, "--camera.fit", "box"], &SMALL[..], more].concat()
}

#[test]
fn pictures_are_compared_and_limits_kept() {
    let dir = dir();
    let d = dir.path();
    picture(0.0).save(d.join("a.png"), Depth::Eight).unwrap();
    picture(1.0 / 255.0).save(d.join("b.png"), Depth::Eight).unwrap();
    for name in ["a.webp", "a.tif", "a.exr", "a.npy"] {
        picture(0.0).save(d.join(name), Depth::Eight).unwrap();
    }
    let (same, _) = ends(d, &["compare", "a.png", "a.webp", "--max-diff", "0", "--max-rms", "0", "--max-flip", "0"], 0);
    assert!(same.contains("differing pixels  0 of 192") && same.contains("PSNR              inf dB"), "{same}");
    ends(d, &["compare", "a.png", "a.tif", "--max-diff", "0"], 0);
    ends(d, &["compare", "a.exr", "a.npy", "--max-diff", "0"], 0);
    // Without a limit nothing is too far away.
    let (told, _) = ends(d, &["compare", "a.png", "b.png", "-o", "diff.png"], 0);
    for want in
        ["1 of 192 (0.52 %)", "0.003922, at pixel 9,5", "(67 pixels per degree)", "diff.png: black: equal; violet: differs by 1/1024"]
    {
        assert!(told.contains(want), "{want} in\n{told}");
    }
    let diff = Picture::open(d.join("diff.png")).unwrap();
    let light = |x, y| diff.pixel(x, y)[..3].iter().sum::<f32>();
    assert!(light(9, 5) > 0.7 && (0..192).filter(|i| light(i % 16, i / 16) > 0.0).count() == 1);
    let (told, line) = ends(d, &["compare", "a.png", "b.png", "--max-diff", "0", "--json"], 3);
    assert_eq!(line, "error: a.png, b.png: 1 pixels differ, over 0\n");
    let json: Value = serde_json::from_str(&told).unwrap();
    assert_eq!((json["differing"].as_u64(), json["worst"]["x"].as_u64(), json["within"].as_bool()), (Some(1), Some(9), Some(false)));
    assert!((json["rms"].as_f64().unwrap() - (1.0 / 255.0) / (4.0 * 192.0f64).sqrt()).abs() < 1e-7);
    ends(d, &["compare", "a.png", "b.png", "--max-rms", "1e-6"], 3);
    ends(d, &["compare", "a.png", "b.png", "--max-flip", "1e-6"], 3);
    ends(d, &["compare", "a.png", "b.png", "--max-flip", "0.5", "--max-rms", "0.1", "--max-diff", "1"], 0);
}

#[test]
fn what_cannot_be_compared_is_told_in_a_line() {
    let dir = dir();
    let d = dir.path();
    picture(0.0).save(d.join("a.png"), Depth::Eight).unwrap();
    Picture::from_pixels(2, 3, vec![[0.0; 4]; 6]).unwrap().save(d.join("small.png"), Depth::Eight).unwrap();
    Picture::from_pixels(2, 3, vec![[f32::NAN; 4]; 6]).unwrap().save(d.join("nan.npy"), Depth::Eight).unwrap();
    fs::write(d.join("notes.png"), "notes").unwrap();
    for (args, status, want) in [
        (&["compare", "a.png", "small.png"][..], 1, "a.png, small.png: pictures of 16 x 12 and 2 x 3 pixels cannot be compared"),
        (&["compare", "small.png", "nan.npy"], 1, "small.png, nan.npy: pixel 0,0 of the second picture is NaN"),
        (&["compare", "a.png", "none.png"], 1, "none.png: "),
        (&["compare", "a.png", "notes.png"], 1, "notes.png: is no picture"),
        (&["compare", "a.png", "a.png", "-o", "a.png"], 2, "a.png: would overwrite the input"),
        (&["compare", "a.png", "a.png", "-o", "notes.png"], 2, "notes.png: is there already and is no picture"),
        (&["compare", "a.png", "a.png", "-o", "d.gif"], 2, "d.gif: GIF is read but not written"),
        (&["compare", "a.png", "a.png", "--max-rms=-1"], 2, "--max-rms -1: must be 0 or more"),
        (&["compare", "a.png", "a.png", "--max-flip", "nan"], 2, "--max-flip NaN: must be 0 or more"),
        (&["compare", "a.png", "a.png", "--pixels-per-degree", "0"], 2, "--pixels-per-degree 0: must lie between"),
        (&["compare", "a.png", "a.png", "--json", "-o", "-"], 2, "cannot both go to stdout"),
        (&["compare", "a.png"], 2, "required"),
    ] {
        let (_, line) = ends(d, args, status);
        assert!(line.contains(want), "{args:?}: {line}");
    }
}

#[test]
fn saved_scenes_make_the_same_picture() {
    let dir = dir();
    let d = dir.path();
    let volume = private_volume(d);
    fs::create_dir(d.join("scenes")).unwrap();
    let cases: [&[&str]; 4] = [
        &["--preset", "grey-ramp", "--azimuth", "77"],
        &["--transfer.colormap", "viridis", "--render.blend", "iso", "--volume.spacing", "1,2,0.7"],
        &["--slices.tolerance", "0.01", "--light.ambient", "0.3", "--clip", "1,2,3,4"],
        &["--render.profile", "opengl", "--fog.mode", "exp2", "--fog.density", "0.01"],
    ];
    for (n, case) in cases.iter().enumerate() {
        for kind in ["toml", "json"] {
            let saved = format!("scenes/{n}.{kind}");
            // A tolerance takes the place of a count.
            let size = ["render", volume, "--size", "24x20", "-o", "a.npy", "--save-scene", &saved];
            ends(d, &[&size, *case].concat(), 0);
            ends(d, &["render", &saved, "-o", "b.npy"], 0);
            assert_eq!(fs::read(d.join("a.npy")).unwrap(), fs::read(d.join("b.npy")).unwrap(), "{case:?} {kind}");
            let text = fs::read_to_string(d.join(&saved)).unwrap();
            assert!(text.contains("../ward-seven/doe-jane.nrrd") && !text.contains("preset"), "{text}");
        }
    }
    // What somebody wrote by hand is not replaced; what was saved is.
    fs::write(d.join("mine.toml"), "# my scene\n[volume]\nphantom = \"cloud\"\n").unwrap();
    let (_, line) = ends(d, &render(volume, &["--save-scene", "mine.toml"]), 2);
    assert!(line.contains("mine.toml: is there already and is no scene saved by this command"), "{line}");
    let (_, line) = ends(d, &["render", "scenes/0.toml", "--save-scene", "scenes/0.toml"], 2);
    assert!(line.contains("would overwrite the input"), "{line}");
    ends(d, &render(volume, &["--save-scene", "scenes/0.toml", "-o", "c.png"]), 0);
    for (name, want) in
        [("s.yaml", "a scene file ends in .toml or .json"), ("-", "a scene goes into a file"), ("no/s.toml", "no directory")]
    {
        let (_, line) = ends(d, &render(volume, &["--save-scene", name]), if name == "no/s.toml" { 1 } else { 2 });
        assert!(line.contains(want), "{line}");
    }
}

#[test]
fn pictures_carry_their_scene_and_nothing_private() {
    let dir = dir();
    let d = dir.path();
    let volume = private_volume(d);
    let absolute = d.join(volume);
    ends(d, &render(absolute.to_str().unwrap(), &["-o", "a.png", "--stats", "s.json", "--azimuth", "33"]), 0);
    ends(d, &render(volume, &["-o", "a.exr", "--azimuth", "33"]), 0);
    ends(d, &render(volume, &["-o", "plain.png", "--azimuth", "33", "--no-metadata"]), 0);
    let stats: Value = serde_json::from_slice(&fs::read(d.join("s.json")).unwrap()).unwrap();
    for name in ["a.png", "a.exr"] {
        let metadata = Metadata::open(d.join(name)).unwrap();
        assert_eq!(metadata.get("slicestack.version"), Some(env!("CARGO_PKG_VERSION")));
        assert_eq!(metadata.get("slicestack.sha256"), stats["sha256"].as_str());
        assert_eq!(metadata.get("slicestack.volume.sha256").map(str::len), Some(64));
        let scene = metadata.get("slicestack.scene").unwrap();
        assert!(scene.contains("azimuth = 33.0") && scene.contains("[transfer]") && !scene.contains("path"), "{scene}");
        let bytes = String::from_utf8_lossy(&fs::read(d.join(name)).unwrap()).to_lowercase();
        let here = d.file_name().unwrap().to_str().unwrap().to_lowercase();
        for private in ["doe", "jane", "ward", "1970", &here, "/tmp", "nrrd"] {
            assert!(!bytes.contains(private), "{name} holds {private}");
        }
    }
    // The pixels' bytes are those of a picture without metadata.
    let (with, without) = (fs::read(d.join("a.png")).unwrap(), fs::read(d.join("plain.png")).unwrap());
    assert!(with.len() > without.len() && with.ends_with(&without[33..]) && with.starts_with(&without[..33]));
    assert!(Metadata::open(d.join("plain.png")).unwrap().is_empty());
    // Other formats carry none, and are what the library writes.
    ends(d, &render(volume, &["-o", "a.webp", "--azimuth", "33"]), 0);
    assert_eq!(fs::read(d.join("a.webp")).unwrap(), Picture::open(d.join("a.png")).unwrap().encode(Format::WebP, Depth::Eight).unwrap());
}

/// The picture `from` with a text of it changed, as `to`.
fn edit(dir: &Path, from: &str, to: &str, change: impl Fn(&str, &str) -> String) {
    let old = Metadata::open(dir.join(from)).unwrap();
    let new = old.iter().fold(Metadata::new(), |new, (key, text)| new.with(key, change(key, text)).unwrap());
    let picture = Picture::open(dir.join(from)).unwrap();
    fs::write(dir.join(to), picture.encode_with(Format::of_path(Path::new(to)).unwrap(), Depth::Eight, &new).unwrap()).unwrap();
}

#[test]
fn verify_says_same_bytes_or_what_differs() {
    let dir = dir();
    let d = dir.path();
    let volume = private_volume(d);
    let made = |more: &[&str]| drop(ends(d, &render(volume, &[&["--background", "white"], more].concat()), 0));
    made(&["-o", "a.png"]);
    made(&["-o", "deep.png", "--depth", "16"]);
    made(&["-o", "a.exr"]);
    for name in ["a.png", "deep.png", "a.exr"] {
        let (told, errors) = ends(d, &["verify", name, "--volume", volume], 0);
        assert_eq!((told.as_str(), errors.as_str()), ("same bytes\n", ""), "{name}");
    }
    // Another version, the same pixels.
    edit(d, "a.png", "version.png", |key, text| if key == "slicestack.version" { "0.0.7".into() } else { text.into() });
    let (told, note) = ends(d, &["verify", "version.png", "--volume", volume], 0);
    assert_eq!(told, "same bytes\n");
    assert!(note.starts_with("note: version.png: version: made by slicestack 0.0.7, this is "), "{note}");
    // A key of the scene.
    let turned = |key: &str, text: &str| {
        if key == "slicestack.scene" { text.replace("azimuth = 30.0", "azimuth = 31.0") } else { text.into() }
    };
    edit(d, "a.png", "scene.png", turned);
    let (told, line) = ends(d, &["verify", "scene.png", "--volume", volume], 3);
    assert!(told.contains("scene: edited since the picture was made: camera.azimuth\n") && told.contains("pixels: "), "{told}");
    assert_eq!(line, "error: scene.png: not the same\n");
    // A pixel of the picture.
    let mut pixels = Picture::open(d.join("a.exr")).unwrap().pixels().to_vec();
    pixels[24 * 3 + 5][1] -= 0.25;
    let forged = Picture::from_pixels(24, 20, pixels).unwrap();
    let metadata = Metadata::open(d.join("a.exr")).unwrap();
    fs::write(d.join("forged.exr"), forged.encode_with(Format::Exr, Depth::Eight, &metadata).unwrap()).unwrap();
    let (told, _) = ends(d, &["verify", "forged.exr", "--volume", volume], 3);
    assert_eq!(told, "pixels: 1 of 480 differ, most by 2.500e-1, at 5,3\n");
    // A voxel, changed by one step.
    let mut bytes = fs::read(d.join(volume)).unwrap();
    let at = bytes.len() - 400;
    bytes[at] ^= 1;
    fs::write(d.join("changed.nrrd"), bytes).unwrap();
    let (told, _) = ends(d, &["verify", "a.png", "--volume", "changed.nrrd"], 3);
    assert!(told.starts_with("volume: its SHA-256 is "), "{told}");
    // Another size.
    edit(d, "a.png", "size.png", |_, text| text.replace("width = 24", "width = 25"));
    let (told, _) = ends(d, &["verify", "size.png", "--volume", volume], 3);
    assert!(told.contains("pixels: the file has 24 x 20 of them, the scene 25 x 20"), "{told}");
}

#[test]
fn verify_says_what_it_lacks() {
    let dir = dir();
    let d = dir.path();
    let volume = private_volume(d);
    ends(d, &render(volume, &["-o", "a.png"]), 0);
    ends(d, &render(volume, &["-o", "plain.png", "--no-metadata"]), 0);
    ends(d, &render(volume, &["-o", "a.webp"]), 0);
    edit(d, "a.png", "broken.png", |key, text| if key == "slicestack.scene" { "[camera".into() } else { text.into() });
    edit(d, "a.png", "names.png", |_, text| text.replace("[volume]\n", "[volume]\npath = \"/etc/passwd\"\n"));
    edit(d, "a.png", "unknown.png", |_, text| text.replace("azimuth", "azimut"));
    for (args, want) in [
        (&["verify", "a.png"][..], "a.png: does not say where its volume is: name the file with --volume FILE"),
        (&["verify", "a.png", "--volume", "none.nrrd"], "none.nrrd: "),
        (&["verify", "plain.png"], "plain.png: carries no scene"),
        (&["verify", "a.webp"], "a.webp: carries no scene"),
        (&["verify", "none.png"], "none.png: "),
        (&["verify", volume], "doe-jane.nrrd: is no picture"),
        (&["verify", "names.png"], "names.png: its scene names a file (volume.path), which no picture made here does"),
        (&["verify", "broken.png", "--volume", volume], "broken.png: its scene: "),
        (&["verify", "unknown.png", "--volume", volume], "unknown.png: its scene: line "),
    ] {
        let (_, line) = ends(d, args, 1);
        assert!(line.contains(want), "{args:?}: {line}");
    }
    // A built-in volume and a raw file described by flags need nothing, or the file alone.
    ends(d, &["render", "--size", "20x20", "--count", "16", "--volume.size", "12", "-o", "p.png"], 0);
    assert_eq!(ends(d, &["verify", "p.png"], 0).0, "same bytes\n");
    fs::write(d.join("v.raw"), (0..240).map(|i| i as u8).collect::<Vec<_>>()).unwrap();
    let flags = ["--volume.dimensions", "4,5,6", "--volume.type", "i16", "--volume.offset", "0", "--volume.spacing", "1,-1,2"];
    ends(d, &render("v.raw", &[&flags[..], &["-o", "r.png"]].concat()), 0);
    assert_eq!(ends(d, &["verify", "r.png", "--volume", "v.raw"], 0).0, "same bytes\n");
}

#[test]
fn a_label_map_is_named_to_verify_and_another_is_told() {
    let dir = dir();
    let d = dir.path();
    let volume = private_volume(d);
    let labels = |name: &str, of: fn(usize) -> u8| {
        let mut bytes = b"NRRD0004\ntype: unsigned char\ndimension: 3\nsizes: 8 9 10\nencoding: raw\nspacings: 1 1 1.5\n\n".to_vec();
        bytes.extend((0..8 * 9 * 10).map(of));
        fs::write(d.join(name), bytes).unwrap();
    };
    labels("a.nrrd", |i| u8::from(i % 8 > 3));
    labels("b.nrrd", |i| u8::from(i % 8 > 2));
    ends(d, &render(volume, &["-o", "a.png", "--labels.path", "a.nrrd", "--labels.segment", "[{value=1,color=[1,0,0]}]"]), 0);
    ends(d, &render(volume, &["-o", "plain.png"]), 0);
    assert_eq!(ends(d, &["verify", "a.png", "--volume", volume, "--labels", "a.nrrd"], 0).0, "same bytes\n");
    let (told, _) = ends(d, &["verify", "a.png", "--volume", volume, "--labels", "b.nrrd"], 3);
    assert!(told.starts_with("labels: their SHA-256 is ") && told.contains("\npixels: "), "{told}");
    let (_, line) = ends(d, &["verify", "a.png", "--volume", volume], 1);
    assert!(line.contains("a.png: does not say where its label map is: name the file with --labels FILE"), "{line}");
    let (_, line) = ends(d, &["verify", "plain.png", "--volume", volume, "--labels", "a.nrrd"], 1);
    assert!(line.contains("plain.png: was made without a label map beside its volume: leave --labels out"), "{line}");
    let text = Metadata::open(d.join("a.png")).unwrap();
    assert!(!text.get("slicestack.scene").unwrap().contains("a.nrrd"), "the picture names no file");
}

fn golden_folder(dir: &Path) {
    fs::create_dir_all(dir.join("g")).unwrap();
    let scene =
        |phantom: &str| format!("[volume]\nphantom = \"{phantom}\"\nsize = 12\n[image]\nwidth = 24\nheight = 24\n[slices]\ncount = 16\n");
    fs::write(dir.join("g/cloud.toml"), scene("cloud")).unwrap();
    fs::write(dir.join("g/rings.toml"), scene("distance-field")).unwrap();
    fs::write(dir.join("g/head.json"), r#"{"volume": {"phantom": "shepp-logan", "size": 12}, "image": {"width": 16, "height": 16}}"#)
        .unwrap();
    fs::write(dir.join("g/README.md"), "no scene").unwrap();
}

#[test]
fn folders_of_scenes_are_blessed_and_checked() {
    let dir = dir();
    let d = dir.path();
    golden_folder(d);
    let (told, line) = ends(d, &["golden", "check", "g"], 3);
    assert!(told.contains("g/cloud.toml: differs: there is no g/cloud.png") && line.ends_with("3 of 3 pictures differ\n"), "{told}{line}");
    let (told, _) = ends(d, &["golden", "bless", "g"], 0);
    assert_eq!(told, "g/cloud.png: written\ng/head.png: written\ng/rings.png: written\n");
    let (told, _) = ends(d, &["golden", "check", "g", "-o", "page"], 0);
    assert_eq!(told.matches(": same pixels\n").count(), 3, "{told}");
    assert!(!d.join("page").exists());
    assert_eq!(ends(d, &["golden", "bless", "g"], 0).0.matches("unchanged").count(), 3);
    assert_eq!(ends(d, &["verify", "g/head.png"], 0).0, "same bytes\n");
    // A changed scene.
    let text = fs::read_to_string(d.join("g/cloud.toml")).unwrap();
    fs::write(d.join("g/cloud.toml"), text.clone() + "[camera]\nazimuth = 31\n").unwrap();
    let (told, line) = ends(d, &["golden", "check", "g", "-o", "page"], 3);
    assert!(told.contains("g/cloud.toml: differs: ") && told.contains("pixels differ, over 0, largest difference"), "{told}");
    assert!(told.ends_with("page/index.html\n") && line == "error: g: 1 of 3 pictures differ\n", "{told}{line}");
    let page = fs::read_to_string(d.join("page/index.html")).unwrap();
    for what in ["before", "after", "difference", "flip"] {
        let name = format!("cloud-{what}.png");
        assert!(page.contains(&format!("src=\"{name}\"")) && Picture::open(d.join("page").join(&name)).is_ok(), "{name}");
    }
    assert!(!page.contains("http") && !page.contains("rings") && !d.join("page/rings-before.png").exists());
    ends(d, &["golden", "check", "g", "--max-flip", "0.9"], 0);
    ends(d, &["golden", "check", "g", "--max-rms", "1e-9", "-o", "page"], 3);
    // A scene that cannot be rendered is no difference.
    fs::write(d.join("g/bad.toml"), "[volume]\nphantom = \"clod\"\n").unwrap();
    let (told, line) = ends(d, &["golden", "check", "g"], 1);
    assert!(
        told.contains("g/bad.toml: cannot be rendered: g/bad.toml: line 2: ") && line.contains("1 of 4 scenes cannot be rendered"),
        "{told}{line}"
    );
}

#[test]
fn pictures_of_others_are_not_replaced() {
    let dir = dir();
    let d = dir.path();
    golden_folder(d);
    picture(0.0).save(d.join("g/rings.png"), Depth::Eight).unwrap();
    let before = fs::read(d.join("g/rings.png")).unwrap();
    let (_, line) = ends(d, &["golden", "bless", "g"], 1);
    assert!(line.contains("g/rings.png: is there already and carries no scene"), "{line}");
    assert!(fs::read(d.join("g/rings.png")).unwrap() == before && !d.join("g/cloud.png").exists());
    let (told, _) = ends(d, &["golden", "check", "g"], 3);
    assert!(told.contains("g/rings.toml: differs: 24 x 24 pixels, g/rings.png has 16 x 12"), "{told}");
    ends(d, &["golden", "bless", "g", "--force"], 0);
    ends(d, &["golden", "check", "g"], 0);
    fs::write(d.join("g/rings.json"), "{}").unwrap();
    fs::create_dir(d.join("empty")).unwrap();
    for (args, status, want) in [
        (&["golden", "check", "g"][..], 1, "two scenes cannot share a picture"),
        (&["golden", "check", "empty"], 1, "empty: holds no scene file"),
        (&["golden", "bless", "none"], 1, "none: "),
        (&["golden", "check", "empty", "-o", "g"], 2, "g: holds other files"),
        (&["golden", "check", "empty", "-o", "g/head.json"], 2, "g/head.json: is a file"),
        (&["golden", "check", "empty", "--max-rms", "-3"], 2, ""),
        (&["golden"], 2, ""),
    ] {
        let out = run(d, args);
        assert_eq!(out.status.code(), Some(status), "{args:?}: {}", text(&out.stderr));
        assert!(text(&out.stderr).contains(want), "{args:?}: {}", text(&out.stderr));
    }
}

#[test]
fn the_macro_compares_with_the_goldens_of_this_crate() {
    // A picture on record here, in its own file.
    let on_record = Picture::open(Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/goldens/1x1.png")).unwrap();
    assert_golden!(on_record, "1x1");
    assert_golden!(on_record, "1x1", slicestack::compare::Tolerance::new().max_flip(0.01));
    // Where pictures are put on record, this one must not be.
    if std::env::var_os("SLICESTACK_BLESS").is_some() {
        return;
    }
    let other = picture(0.0);
    let failed = std::panic::catch_unwind(|| assert_golden!(other, "1x1")).unwrap_err();
    let message = failed.downcast_ref::<String>().unwrap();
    assert!(message.contains("1x1: 16 x 12 pixels, on record") && message.contains("goldens"), "{message}");
}

#[test]
fn pictures_are_proven() {
    let dir = dir();
    let d = dir.path();
    fs::write(d.join("rings.toml"), "[volume]\nphantom = \"distance-field\"\nsize = 24\n").unwrap();
    fs::write(d.join("lit.toml"), "[volume]\nphantom = \"cloud\"\nsize = 16\n[light]\nambient = 0.3\n").unwrap();
    ends(d, &["render", "rings.toml", "--size", "24x20", "-o", "a.png", "--count", "64"], 0);
    let (told, _) = ends(d, &["verify", "a.png", "--proof", "40"], 0);
    let lines: Vec<&str> = told.lines().collect();
    assert_eq!(lines[0], "same bytes", "{told}");
    assert!(lines[1].starts_with("proven: each of these 40 of 480 pixels lies within "), "{told}");
    assert!(lines[2].starts_with("proven: rounded as in the file, each lies within "), "{told}");
    assert!(lines[3].starts_with("bounds: at most ") && lines[3].ends_with("wide (asked for: 1e-4)"), "{told}");
    assert_eq!(lines.len(), 4, "{told}");
    // The number behind "within", and the two of the RMS.
    let number = |line: &str, behind: &str| -> f64 {
        let text = line.split(behind).nth(1).and_then(|rest| rest.split([' ', ';']).next()).unwrap();
        text.parse().unwrap()
    };
    let (largest, least, most) = (number(lines[1], "within "), number(lines[1], "between "), number(lines[1], " and "));
    assert!(least <= most && most <= largest && largest < 0.1, "{told}");
    // 8 bits are half a step off at most, straight colours a little more of theirs.
    assert!(number(lines[2], "within ") < largest + 2.0 / 255.0, "{told}");
    // The same pixels and numbers again; other bounds surround the same truth; all pixels, where more are asked for than there are.
    assert_eq!(ends(d, &["verify", "a.png", "--proof", "40"], 0).0, told);
    let (narrow, _) = ends(d, &["verify", "a.png", "--proof", "40", "--width", "1e-7"], 0);
    let narrow: Vec<&str> = narrow.lines().collect();
    assert!(number(narrow[1], "between ") <= most * 1.001 && number(narrow[1], " and ") >= least * 0.999, "{narrow:?} {told}");
    let (all, _) = ends(d, &["verify", "a.png", "--proof", "1000"], 0);
    assert!(all.contains("each of these 480 of 480 pixels"), "{all}");
    // A tolerance is told of.
    ends(d, &["render", "rings.toml", "--size", "24x20", "-o", "t.png", "--slices.tolerance", "0.01"], 0);
    let (told, _) = ends(d, &["verify", "t.png", "--proof", "480", "--width", "1e-5"], 0);
    assert!(told.contains("\ntolerance 1e-2: proven: kept by these pixels\n"), "{told}");
    // What has no bounds is told before anything is rendered, and wrong numbers are wrong usage.
    ends(d, &["render", "lit.toml", "--size", "8x8", "-o", "lit.png"], 0);
    let (_, line) = ends(d, &["verify", "lit.png", "--proof", "3"], 1);
    assert!(line.starts_with("error: lit.png: light: no bounds can be proven"), "{line}");
    ends(d, &["verify", "lit.png"], 0);
    for bad in [&["--proof", "0"][..], &["--proof", "many"], &["--width", "1e-3"], &["--proof", "3", "--width", "0"]] {
        ends(d, &[&["verify", "a.png"][..], bad].concat(), 2);
    }
    // Any number of threads; and whoever hears of the progress may stop it.
    let prove = |settings: Settings| verify_bounded(&d.join("a.png"), &Inputs::new(), 100, 1e-5, &settings);
    let one = prove(Settings::new().threads(1)).unwrap();
    assert_eq!(one, prove(Settings::new().threads(3)).unwrap());
    assert!(one.0.is_same() && one.1.pixels == 100 && one.1.width <= 1e-5);
    assert!(matches!(prove(Settings::new().progress(Arc::new(Impatient))), Err(slicestack::Error::Stopped)));
    assert!(prove(Settings::new().progress(Arc::new(Patient))).is_ok());
    for (count, width, want) in
        [(0, 1e-4, "a proof of 0 pixels says nothing"), (1, f64::NAN, "width NaN of proven bounds: must lie between")]
    {
        let line = verify_bounded(&d.join("a.png"), &Inputs::new(), count, width, &Settings::new()).unwrap_err().to_string();
        assert!(line.starts_with(want), "{line}");
    }
}

/// Lets the picture be rendered, and stops the proof.
struct Impatient;

impl Progress for Impatient {
    fn step(&self, what: &str, _: u64, _: u64) -> bool {
        what != "proving pixels"
    }
}

/// Hears of each pixel that is proven.
struct Patient;

impl Progress for Patient {
    fn step(&self, what: &str, done: u64, total: u64) -> bool {
        assert!(what != "proving pixels" || (done <= total && total == 100), "{what} {done} {total}");
        true
    }
}
