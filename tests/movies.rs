//! `turntable`, `animate` and `render --show` as commands.
#![cfg(feature = "cli")]
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test fails by panicking")]

use std::fs;
use std::path::Path;
use std::process::{Command, Output};

fn run(dir: &Path, args: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_slicestack")).args(args).current_dir(dir).output().unwrap()
}

fn done(dir: &Path, args: &[&str]) {
    let out = run(dir, args);
    assert!(out.status.success(), "{args:?}: {}", String::from_utf8_lossy(&out.stderr));
}

/// The one line that says why not, at exit status `status`.
fn refused(dir: &Path, args: &[&str], status: i32) -> String {
    let out = run(dir, args);
    assert_eq!(out.status.code(), Some(status), "{args:?}: {}", String::from_utf8_lossy(&out.stderr));
    let text = String::from_utf8(out.stderr).unwrap();
    let lines: Vec<&str> = text.lines().filter(|l| l.starts_with("error: ")).collect();
    assert_eq!(lines.len(), 1, "{args:?}: {text}");
    lines[0].to_owned()
}

const SMALL: [&str; 6] = ["--volume.phantom", "cloud", "--volume.size", "24", "--size", "32x24"];

fn with<'a>(head: &[&'a str], tail: &[&'a str]) -> Vec<&'a str> {
    [head, &SMALL, tail].concat()
}

#[test]
fn a_turntable_goes_into_every_kind_of_file() {
    let dir = tempfile::tempdir().unwrap();
    for (name, start) in [("a.gif", &b"GIF89a"[..]), ("a.png", b"\x89PNG"), ("a.apng", b"\x89PNG"), ("a.webp", b"RIFF")] {
        done(dir.path(), &with(&["turntable", "-o", name, "--frames", "3"], &[]));
        assert!(fs::read(dir.path().join(name)).unwrap().starts_with(start), "{name}");
    }
    let png = fs::read(dir.path().join("a.png")).unwrap();
    assert!(png.windows(4).any(|w| w == b"acTL"), "an animated PNG");
    assert!(refused(dir.path(), &with(&["turntable", "-o", "a.mp4"], &[]), 2).contains("write .gif, .png or .webp"));
    fs::write(dir.path().join("notes.gif"), "not a picture").unwrap();
    assert!(refused(dir.path(), &with(&["turntable", "-o", "notes.gif"], &[]), 2).contains("is there already"));
    assert!(refused(dir.path(), &with(&["turntable", "-o", "x.gif", "--frames", "0"], &[]), 2).contains("--frames"));
    assert!(refused(dir.path(), &with(&["turntable", "-o", "x.gif"], &["--camera.eye", "1,2,300"]), 1).contains("turntable"));
    assert!(!dir.path().join("x.gif").exists());
}

/// Frames in a folder are made once; what is missing is made again, to the same bytes; other folders are left alone.
#[test]
fn a_folder_of_frames_goes_on_where_it_was_stopped() {
    let dir = tempfile::tempdir().unwrap();
    let command = with(&["turntable", "-o", "frames", "--frames", "4"], &[]);
    done(dir.path(), &command);
    let frame = |n: u32| dir.path().join(format!("frames/frame-{n:04}.png"));
    let before: Vec<Vec<u8>> = (0..4).map(|n| fs::read(frame(n)).unwrap()).collect();
    assert!(before.windows(2).all(|w| w[0] != w[1]), "the volume turns");
    fs::remove_file(frame(2)).unwrap();
    // One that was cut short is made again, too; what is no picture is told.
    fs::write(frame(1), &before[1][..40]).unwrap();
    done(dir.path(), &command);
    assert!((0..4).all(|n| fs::read(frame(n)).unwrap() == before[n as usize]));
    fs::write(frame(3), "mine").unwrap();
    assert!(refused(dir.path(), &command, 1).contains("is no frame"));
    fs::write(frame(3), &before[3]).unwrap();
    let other = with(&["turntable", "-o", "frames", "--frames", "5"], &[]);
    assert!(refused(dir.path(), &other, 1).contains("frames of something else"));
    fs::create_dir(dir.path().join("mine")).unwrap();
    fs::write(dir.path().join("mine/letter.txt"), "dear").unwrap();
    assert!(refused(dir.path(), &with(&["turntable", "-o", "mine"], &[]), 1).contains("not empty"));
    assert_eq!(fs::read_dir(dir.path().join("mine")).unwrap().count(), 1);
}

#[test]
fn key_frames_change_what_they_name() {
    let dir = tempfile::tempdir().unwrap();
    fs::write(dir.path().join("keys.toml"), "[[key]]\ntime = 0\ncamera.azimuth = 0\n[[key]]\ntime = 0.2\ncamera.azimuth = 360\n").unwrap();
    done(dir.path(), &with(&["animate", "keys.toml", "-o", "frames", "--fps", "20"], &["--camera.fit", "box", "--count", "20"]));
    let frame = |n: u32| fs::read(dir.path().join(format!("frames/frame-{n:04}.png"))).unwrap();
    // Four steps; the fifth would be the first again.
    assert_eq!(
        fs::read_dir(dir.path().join("frames"))
            .unwrap()
            .filter(|f| f.as_ref().unwrap().path().extension().is_some_and(|e| e == "png"))
            .count(),
        4
    );
    // A frame is what `render` makes of the same scene.
    done(dir.path(), &with(&["render", "-o", "half.png", "--no-metadata", "--azimuth", "180"], &["--camera.fit", "box", "--count", "20"]));
    assert_eq!(frame(2), fs::read(dir.path().join("half.png")).unwrap());
    assert_ne!(frame(0), frame(1));
    fs::write(dir.path().join("wrong.toml"), "[[key]]\ntime = 0\ncamera.azimut = 0\n[[key]]\ntime = 1\n").unwrap();
    let line = refused(dir.path(), &with(&["animate", "wrong.toml", "-o", "x.gif"], &[]), 1);
    assert!(line.contains("wrong.toml") && line.contains("key[0].camera.azimut"), "{line}");
    assert!(refused(dir.path(), &["animate", "keys.toml", "-o", "x.gif"], 2).contains("names no scene and no volume"));
}

#[test]
fn pictures_are_shown_on_terminals_alone() {
    let dir = tempfile::tempdir().unwrap();
    assert!(refused(dir.path(), &with(&["render", "--show"], &[]), 2).contains("stdout is no terminal"));
    assert!(refused(dir.path(), &with(&["render", "--show", "-o", "-"], &[]), 2).contains("goes to stdout itself"));
}

/// Help of `render` in a line a flag; colours by name; wrong usage before any work, at exit status 2.
#[test]
fn help_is_short_and_colours_have_names() {
    let dir = tempfile::tempdir().unwrap();
    for args in [&["render", "--help"][..], &["help", "render"], &["render", "-h"]] {
        let help = String::from_utf8(run(dir.path(), args).stdout).unwrap();
        assert!(help.lines().count() < 160, "{} lines", help.lines().count());
        assert!(help.contains("--camera.fit") && !help.contains("--opengl.alpha"), "{args:?}");
    }
    let opengl = String::from_utf8(run(dir.path(), &["help", "opengl"]).stdout).unwrap();
    assert!(opengl.contains("--opengl.") && opengl.lines().count() > 20);
    for (name, digits) in [("tomato", "#ff6347"), ("#fa3", "#ffaa33"), ("black", "0,0,0,1")] {
        done(dir.path(), &with(&["render", "-o", "a.png", "--no-metadata", "--background", name, "--count", "9"], &[]));
        done(dir.path(), &with(&["render", "-o", "b.png", "--no-metadata", "--background", digits, "--count", "9"], &[]));
        assert_eq!(fs::read(dir.path().join("a.png")).unwrap(), fs::read(dir.path().join("b.png")).unwrap(), "{name}");
    }
    for wrong in [
        &["render", "--preset", "ct-bon"][..],
        &["render", "--background", "blackish"],
        &["render", "--render.blend", "iso", "--render.filter", "cubic"],
        &["render", "--render.blend", "mip", "--light.ambient", "0.3"],
        &["render", "--slices.count", "0"],
        &["render", "--camera.eye", "1,2,300", "--azimuth", "3"],
    ] {
        refused(dir.path(), &with(wrong, &["-o", "none.png"]), 2);
        assert!(!dir.path().join("none.png").exists());
    }
    // A fog that a scene describes is turned off by its mode.
    fs::write(dir.path().join("s.toml"), "[volume]\nphantom = \"cloud\"\nsize = 16\n[fog]\nmode = \"exp\"\ndensity = 0.1\n").unwrap();
    done(dir.path(), &["render", "s.toml", "-o", "clear.png", "--fog.mode", "none", "--size", "16x16"]);
}
