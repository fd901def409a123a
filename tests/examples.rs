//! The examples run, every scene file beside them makes a picture, and the README says what the code does.
//!
//! Scenes about files outside the package run where those files are; elsewhere the test says so, and fails in continuous
//! integration (`$CI` is set).

#![cfg(feature = "cli")]
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test fails by panicking")]

use slicestack::picture::Depth;
use slicestack::scene::{Overrides, SceneFile};
use slicestack::study::LESSONS;
use slicestack::volume::phantom::Phantom;
use slicestack::volume::{Origin, VolumeSource};
use slicestack::{Limits, render};
use std::fs;
use std::path::{Path, PathBuf};

// The examples' own files: what is tested is what the reader sees.
macro_rules! examples {
    ($($name:ident $path:literal),*) => {
        $(
            #[path = $path]
            #[allow(dead_code, reason = "an example's main is not called here")]
            mod $name;
        )*
    };
}
examples!(classroom "../examples/classroom.rs");
examples!(first "../examples/first.rs", fog "../examples/fog.rs", scene_file "../examples/scene_file.rs");
examples!(lesson_1_polygons "../examples/lesson_1_polygons.rs", lesson_2_coverage "../examples/lesson_2_coverage.rs");
examples!(lesson_3_fetch "../examples/lesson_3_fetch.rs", lesson_4_transfer_function "../examples/lesson_4_transfer_function.rs");
examples!(lesson_5_over "../examples/lesson_5_over.rs", lesson_6_fog "../examples/lesson_6_fog.rs");
examples!(transfer_function "../examples/transfer_function.rs", turntable "../examples/turntable.rs");

fn package() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// The pixels of a PNG that an example wrote: width, height, straight RGBA.
fn pixels(path: &Path) -> (u32, u32, Vec<u8>) {
    let mut reader = png::Decoder::new(std::io::BufReader::new(fs::File::open(path).unwrap())).read_info().unwrap();
    let mut bytes = vec![0; reader.output_buffer_size().unwrap()];
    let info = reader.next_frame(&mut bytes).unwrap();
    (info.width, info.height, bytes)
}

/// Share of pixels that differ from the first.
fn drawn(pixels: &[u8]) -> f64 {
    pixels.chunks(4).filter(|p| *p != &pixels[..4]).count() as f64 / (pixels.len() / 4) as f64
}

#[test]
fn examples_make_their_pictures() {
    let dir = tempfile::tempdir().unwrap();
    let at = |name: &str| dir.path().join(name);

    first::run(&at("first.png")).unwrap();
    let (width, height, first) = pixels(&at("first.png"));
    assert_eq!((width, height), (512, 512));
    assert!(drawn(&first) > 0.1);

    classroom::run(dir.path(), Path::new("no such file")).unwrap();
    let steps =
        ["1-threshold", "2-depth", "3-first-sample", "4-refined", "5-skin-over-bone"].map(|n| pixels(&at(&format!("classroom-{n}.png"))).2);
    assert!(steps.windows(2).all(|w| w[0] != w[1]) && steps.iter().all(|s| drawn(s) > 0.1));

    transfer_function::run(&at("shells.png"), &Phantom::Hydrogen.volume(48).unwrap()).unwrap();
    assert!(drawn(&pixels(&at("shells.png")).2) > 0.1);

    scene_file::run(&at("scene.png"), None).unwrap();
    assert_eq!(pixels(&at("scene.png")).0, 320);

    fog::run(dir.path()).unwrap();
    let fogs = ["none", "linear", "exp", "exp2"].map(|mode| pixels(&at(&format!("fog-{mode}.png"))).2);
    for i in 0..fogs.len() {
        assert!(drawn(&fogs[i]) > 0.1);
        assert!(fogs[i + 1..].iter().all(|other| *other != fogs[i]), "two fogs look the same");
    }

    turntable::run(dir.path(), 3).unwrap();
    let frames: Vec<_> = (0..3).map(|i| pixels(&at(&format!("frame-{i:03}.png"))).2).collect();
    assert!(frames[0] != frames[1] && frames[1] != frames[2]);
    assert!(!at("frame-003.png").exists());
}

/// A lesson's own `run`.
type Run = fn(&Path) -> slicestack::Result<()>;

#[test]
fn lessons_draw_the_pictures_of_the_tutorial() {
    let tutorial = fs::read_to_string(package().join("docs/tutorial.md")).unwrap();
    let dir = tempfile::tempdir().unwrap();
    let examples: [Run; 6] = [
        lesson_1_polygons::run,
        lesson_2_coverage::run,
        lesson_3_fetch::run,
        lesson_4_transfer_function::run,
        lesson_5_over::run,
        lesson_6_fog::run,
    ];
    let mut place = 0;
    for (lesson, run) in LESSONS.iter().zip(examples) {
        let (name, file) = (lesson.name, lesson.file_name());
        let path = dir.path().join(&file);
        run(&path).unwrap();
        let [drawn, shown] = [path, package().join("docs/tutorial").join(&file)].map(|p| slicestack::Picture::open(p).unwrap());
        assert_eq!((drawn.width(), drawn.height()), (shown.width(), shown.height()), "{name}");
        let [drawn, shown] = [drawn.to_rgba8(), shown.to_rgba8()];
        // Lessons may use the platform's powers and roots; and a table's rounding is no new picture.
        let apart: u64 = drawn.iter().zip(&shown).map(|(a, b)| u64::from(a.abs_diff(*b))).sum();
        assert!(2 * apart < drawn.len() as u64, "{name}: docs/tutorial holds another picture");
        assert!(self::drawn(&drawn) > 0.05, "{name}");
        // The tutorial tells them in order, each with its picture and its code, and how the command runs it.
        let code = format!("src/study/lessons/{name}.rs");
        for link in [format!("slicestack lesson {}", lesson.number), format!("tutorial/{file}"), format!("../{code}")] {
            let at = tutorial[place..].find(&link).unwrap_or_else(|| panic!("{link} is not in docs/tutorial.md, or comes too early"));
            place += at;
        }
        let lines = fs::read_to_string(package().join(code)).unwrap().lines().count();
        assert!(lines <= 90, "{name}: {lines} lines are more than a screen");
    }
}

#[test]
fn lessons_run_from_the_command() {
    let dir = tempfile::tempdir().unwrap();
    let run = |args: &[&str]| {
        let command =
            std::process::Command::new(env!("CARGO_BIN_EXE_slicestack")).arg("lesson").args(args).current_dir(dir.path()).output();
        let out = command.unwrap();
        let [told, said] = [out.stdout, out.stderr].map(|bytes| String::from_utf8(bytes).unwrap());
        (out.status.code(), told, said)
    };
    let (status, list, _) = run(&[]);
    assert!(status == Some(0) && LESSONS.iter().all(|l| list.contains(l.name) && list.contains(l.about)), "{list}");
    for (name, lesson) in [("5", &LESSONS[4]), ("coverage", &LESSONS[1])] {
        let (status, told, said) = run(&[name, "-o", "lessons"]);
        assert_eq!((status, said.as_str()), (Some(0), ""));
        let shown = lesson.run().unwrap();
        assert!(told.starts_with(&shown.told) && told.contains(&lesson.file_name()), "{told}");
        assert_eq!(fs::read(dir.path().join("lessons").join(lesson.file_name())).unwrap(), shown.picture);
    }
    // A picture of a lesson may be replaced; what is none is spared.
    assert_eq!(run(&["5", "-o", "lessons"]).0, Some(0));
    fs::write(dir.path().join("lesson_5_over.png"), "mine").unwrap();
    fs::write(dir.path().join("file"), "mine").unwrap();
    for (args, status, words) in [
        (&["5"][..], 2, "lesson_5_over.png"),
        (&["7"], 2, "1 (polygons)"),
        (&["fetch", "-o", "file"], 1, "not a folder"),
        (&["fetch", "-o", "no/such"], 1, "no/such"),
        (&["-o", "lessons"], 2, "<LESSON>"),
    ] {
        let (found, told, said) = run(args);
        assert_eq!((found, told.as_str(), said.lines().count()), (Some(status), "", 1), "{args:?}: {said}");
        assert!(said.starts_with("error: ") && said.contains(words), "{args:?}: {said}");
    }
    assert_eq!(fs::read(dir.path().join("lesson_5_over.png")).unwrap(), b"mine");
}

/// Paths of the scene files, sorted.
fn scene_files() -> Vec<PathBuf> {
    let paths = scenes_in("examples/scenes");
    assert!(paths.len() >= 10);
    paths
}

/// Paths of the scene files in a folder of the package, sorted.
fn scenes_in(folder: &str) -> Vec<PathBuf> {
    let all = fs::read_dir(package().join(folder)).unwrap().map(|e| e.unwrap().path());
    let mut paths: Vec<_> = all.filter(|path| path.extension().is_some_and(|e| e == "toml")).collect();
    paths.sort();
    paths
}

#[test]
fn every_topic_of_the_notes_has_a_scene_a_picture_and_a_word_to_change() {
    let page = fs::read_to_string(package().join("docs/notes.md")).unwrap();
    let paths = scenes_in("examples/scenes/notes");
    assert!(paths.len() >= 35);
    let mut small = Overrides::default();
    small.set("image.width", "64");
    small.set("image.height", "64");
    let mut place = 0;
    for path in paths {
        let name = path.file_stem().unwrap().to_str().unwrap().to_owned();
        let text = fs::read_to_string(&path).unwrap();
        let command = format!("# slicestack render examples/scenes/notes/{name}.toml -o docs/notes/{name}.png");
        assert!(text.lines().take(4).any(|line| line == command), "{name}: the first lines do not hold the command");
        // The page tells them in the order of their numbers.
        let (picture, link) = (format!("](notes/{name}.png)"), format!("](../examples/scenes/notes/{name}.toml)"));
        assert!(page.contains(&picture), "{name}: no picture in docs/notes.md");
        let at = page[place..].find(&link).unwrap_or_else(|| panic!("{name} is not in docs/notes.md, or comes too early"));
        place += at;
        let (width, height, _) = pixels(&package().join(format!("docs/notes/{name}.png")));
        assert!(width <= 512 && height <= 512, "{name}: {width} x {height}");
        let file = SceneFile::read(&path, &small).unwrap();
        let source = located(file.volume());
        if let Origin::File(data) | Origin::Raw(data, _) = &source.origin {
            let is_pattern = data.to_string_lossy().contains('*');
            if !is_pattern && !data.is_file() {
                eprintln!("data absent: {}", data.display());
                assert!(std::env::var_os("CI").is_none(), "data absent: {}", data.display());
                continue;
            }
        }
        let source = if name == "28-layers" { file.volume().clone() } else { source };
        let volume = source.load(&Limits::default()).unwrap();
        let (scene, warnings) = file.to_scene(&volume).unwrap();
        assert!(warnings.is_empty(), "{name}: {warnings:?}");
        let picture = render(&volume, &scene).unwrap();
        let share = drawn(&picture.to_rgba8());
        assert!(share > 0.05, "{name}: only {share} of the picture shows anything");
    }
    // Words that the page says to try are keys and values that there are.
    let tried: Vec<&str> = page.split("`--").skip(1).filter_map(|rest| rest.split('`').next()).collect();
    assert!(tried.len() >= 20, "{}", tried.len());
    for words in tried {
        let (key, value) = words.split_once(' ').unwrap();
        assert!(slicestack::scene::keys().iter().any(|k| k.path == key), "--{key} {value}: no such key");
    }
}

/// Where the file of a scene's volume is, with `$SLICESTACK_DATA` in place of the folder that scene files name.
fn located(source: &VolumeSource) -> VolumeSource {
    let mut source = source.clone();
    if let (Origin::File(path) | Origin::Raw(path, _), Some(root)) = (&mut source.origin, std::env::var_os("SLICESTACK_DATA")) {
        let inside: PathBuf = path.components().rev().take(2).collect::<Vec<_>>().into_iter().rev().collect();
        *path = Path::new(&root).join(inside);
    }
    source
}

#[test]
fn every_scene_file_makes_a_picture() {
    let mut small = Overrides::default();
    small.set("image.width", "72");
    small.set("image.height", "60");
    for path in scene_files() {
        let name = path.display();
        let file = SceneFile::read(&path, &small).unwrap();
        let source = located(file.volume());
        if let Origin::File(data) | Origin::Raw(data, _) = &source.origin {
            if !data.is_file() {
                eprintln!("data absent: {}", data.display());
                assert!(std::env::var_os("CI").is_none(), "data absent: {}", data.display());
                continue;
            }
        }
        let volume = source.load(&Limits::default()).unwrap();
        let (scene, warnings) = file.to_scene(&volume).unwrap();
        assert!(warnings.is_empty(), "{name}: {warnings:?}");
        let picture = render(&volume, &scene).unwrap();
        let share = drawn(&picture.to_rgba8());
        assert!(share > 0.1, "{name}: only {share} of the picture shows anything");
        assert!(picture.encode(slicestack::picture::Format::Png, Depth::Eight).unwrap().len() > 1000, "{name}");
    }
}

#[test]
fn every_scene_file_has_its_place_in_the_gallery() {
    let readme = fs::read_to_string(package().join("README.md")).unwrap();
    for path in scene_files() {
        let name = path.file_stem().unwrap().to_str().unwrap().to_owned();
        let text = fs::read_to_string(&path).unwrap();
        let command = format!("slicestack render examples/scenes/{name}.toml -o docs/gallery/{name}.png");
        assert!(text.lines().nth(1) == Some(&format!("# {command}")), "{name}: the second line is not the command");
        let (width, height, _) = pixels(&package().join(format!("docs/gallery/{name}.png")));
        assert!(width <= 512 && height <= 512, "{name}: {width} x {height}");
        assert!(readme.contains(&format!("docs/gallery/{name}.png")), "{name} is not in README.md");
        assert!(fs::metadata(package().join(format!("docs/gallery/{name}.png"))).unwrap().len() < 150 << 10, "{name}");
    }
}

/// The lines between the fences of `text`'s first block after `heading`, without what rustdoc hides.
fn block<'t>(text: &'t str, heading: &str, fence: &str) -> Vec<&'t str> {
    let after = text.split_once(heading).unwrap().1;
    let lines = after.lines().skip_while(|l| *l != fence).skip(1).take_while(|l| *l != "```");
    lines.filter(|l| !l.starts_with("# ")).collect()
}

#[test]
fn readme_and_crate_docs_show_the_same_five_lines() {
    let readme = fs::read_to_string(package().join("README.md")).unwrap();
    let source = fs::read_to_string(package().join("src/lib.rs")).unwrap();
    let docs: Vec<&str> = source.lines().filter_map(|l| l.strip_prefix("//!")).map(|l| l.strip_prefix(' ').unwrap_or(l)).collect();
    let documented = docs.join("\n");
    let shown = block(&readme, "## The library", "```rust");
    assert!(shown.len() >= 5);
    assert_eq!(shown, block(&documented, "# A picture in five lines", "```"));
}
