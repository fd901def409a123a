//! Small pictures kept in the repository, each as a PNG to look at and as the hash of its pixels.
//!
//! `SLICESTACK_BLESS=1 cargo test --test goldens` makes them anew.

#![cfg(feature = "encoders")]
#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

mod scenes;

use slicestack::picture::{Depth, Format};
use slicestack::{Level, Picture, Renderer, Settings};
use std::collections::BTreeMap;
use std::fmt::Write;
use std::fs;
use std::path::{Path, PathBuf};

fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/goldens")
}

fn render(sample: &scenes::Sample) -> Picture {
    let settings = Settings::new().level(Level::SCALAR);
    Renderer::new(&sample.volume, settings).render(&sample.scene).unwrap().0
}

/// Largest difference of a picture's 8-bit components to those of a PNG.
fn difference(picture: &Picture, png: &Path) -> String {
    let Ok(file) = fs::File::open(png) else { return "there is no PNG to compare with".into() };
    let mut reader = png::Decoder::new(std::io::BufReader::new(file)).read_info().unwrap();
    let mut data = vec![0; reader.output_buffer_size().unwrap()];
    reader.next_frame(&mut data).unwrap();
    let new = picture.to_rgba8();
    if new.len() != data.len() {
        return "the PNG has another size".into();
    }
    let most = new.iter().zip(&data).map(|(a, b)| a.abs_diff(*b)).max().unwrap_or(0);
    format!("largest difference to the PNG: {most} of 255")
}

#[test]
fn pictures_are_those_on_record() {
    let list = folder().join("sha256.txt");
    let pictures: Vec<(&str, Picture)> = scenes::samples().iter().map(|s| (s.name, render(s))).collect();
    assert!(pictures.len() >= 32);
    if std::env::var_os("SLICESTACK_BLESS").is_some() {
        fs::create_dir_all(folder()).unwrap();
        let mut text = String::new();
        for (name, picture) in &pictures {
            picture.save(folder().join(format!("{name}.png")), Depth::Eight).unwrap();
            writeln!(text, "{}  {name}", picture.sha256()).unwrap();
        }
        fs::write(list, text).unwrap();
        return;
    }
    let text = fs::read_to_string(&list).unwrap();
    let mut recorded: BTreeMap<&str, &str> = text.lines().map(|l| l.split_once("  ").map(|(hash, name)| (name, hash)).unwrap()).collect();
    let mut wrong = String::new();
    for (name, picture) in &pictures {
        let old = recorded.remove(name).unwrap_or("none");
        let new = picture.sha256();
        if new != old {
            let out = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("{name}.png"));
            fs::write(&out, picture.encode(Format::Png, Depth::Eight).unwrap()).unwrap();
            let difference = difference(picture, &folder().join(format!("{name}.png")));
            writeln!(wrong, "{name}: recorded {old}, now {new}; {difference}; see {}", out.display()).unwrap();
        }
    }
    assert!(wrong.is_empty() && recorded.is_empty(), "\n{wrong}pictures on record without a scene: {:?}", recorded.keys());
}
