//! Small pictures kept in the repository, each as a PNG to look at and as the hash of its pixels.
//!
//! `SLICESTACK_BLESS=1 cargo test --test goldens` makes them anew.

#![cfg(all(feature = "encoders", feature = "annotate"))]
#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

mod scenes;

use glam::DVec3;
use slicestack::annotate::{annotate, annotate_cuts};
use slicestack::cut::{Frame, Orientation, Sheet};
use slicestack::picture::{Depth, Format};
use slicestack::scene::{Annotations, Camera, ColorMap, Filter, Placement, Projection};
use slicestack::volume::Space;
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

/// A picture in perspective with everything on it.
fn annotated() -> Picture {
    let sample = scenes::samples().into_iter().find(|s| s.name == "oblique").unwrap();
    let camera =
        Camera::new(Placement::Orbit { azimuth: -35.0, elevation: 25.0, roll: 10.0, zoom: 0.9 }, Projection::Perspective { fov_y: 30.0 });
    let scene = sample.scene.with_camera(camera.unwrap()).with_size(256, 192).unwrap();
    let picture = Renderer::new(&sample.volume, Settings::new().level(Level::SCALAR)).render(&scene).unwrap().0;
    let mut all = Annotations::new();
    (all.colorbar, all.scale_bar, all.axes, all.box_edges) = (true, true, true, true);
    all.title = Some("Head, oblique".into());
    annotate(&picture, &all, &scene, &sample.volume).unwrap().0
}

/// Oblique cuts through the spline, in colours, with their positions.
fn cuts() -> Picture {
    let volume = scenes::samples().into_iter().find(|s| s.name == "oblique").unwrap().volume;
    let grid = volume.grid().clone().with_space(Space::Ras);
    let volume = volume.with_grid(grid.clone()).unwrap();
    let orientation = Orientation::Oblique(DVec3::new(1.0, 2.0, 0.5));
    let frame = Frame::new(&grid, orientation).unwrap();
    let sheet = Sheet::new(&grid, orientation, vec![frame.offset_at(&grid, 0.4), frame.offset_at(&grid, 0.6)]).unwrap();
    let sheet = sheet.with_columns(2).unwrap().with_filter(Filter::CUBIC).with_colors(ColorMap::Viridis).with_size(258, 128).unwrap();
    let mut some = Annotations::new();
    (some.position, some.scale_bar, some.axes) = (true, true, true);
    annotate_cuts(&sheet.draw(&volume).unwrap(), &some).unwrap().0
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
    let rendered = scenes::samples().into_iter().map(|s| (s.name, render(&s)));
    let pictures: Vec<(&str, Picture)> = rendered.chain([("annotated", annotated()), ("cuts-annotated", cuts())]).collect();
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
