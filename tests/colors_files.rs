//! Scene files, cut pictures and records of volumes whose voxels are colours.

#![cfg(all(feature = "scene-file", feature = "formats", feature = "encoders"))]
#![allow(clippy::unwrap_used, reason = "a test stops at the first surprise")]

use slicestack::cut::{Drawn, Frame, Orientation, Sheet, Window};
use slicestack::picture::{Depth, Format};
use slicestack::proof::{Inputs, Provenance, verify};
use slicestack::scene::{
    Annotations, ColorMap, Filter, OpacityFrom, Overrides, ResolvedScene, SceneFile, SceneFormat, Straight, write_scene,
};
use slicestack::volume::io::{WriteFormat, Writing, write_to};
use slicestack::volume::{Channels, Grid, Origin, VolumeSource};
use slicestack::{Renderer, Settings, Volume};
use std::path::{Path, PathBuf};

const SIDE: usize = 10;

fn folder() -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("colors");
    std::fs::create_dir_all(&folder).unwrap();
    folder
}

fn bytes() -> Vec<u8> {
    (0..SIDE * SIDE * SIDE).flat_map(|i| [(i % SIDE * 25) as u8, (i / SIDE % SIDE * 25) as u8, 90, (i * 7 % 60) as u8]).collect()
}

fn rgba() -> Volume {
    Volume::with_colors(Grid::with_spacing([SIDE; 3], [1.0; 3]).unwrap(), bytes().into()).unwrap()
}

fn resolve(text: &str, volume: &Volume) -> slicestack::Result<ResolvedScene> {
    let text = format!("[volume]\npath = \"c.nrrd\"\n[image]\nwidth = 60\nheight = 50\n{text}");
    SceneFile::parse(&text, "", &Overrides::default())?.resolve(volume)
}

#[track_caller]
fn refused<T: std::fmt::Debug>(result: slicestack::Result<T>, words: &[&str]) {
    let line = result.unwrap_err().to_string();
    assert!(!line.contains('\n') && words.iter().all(|w| line.contains(w)), "{line}");
}

#[test]
fn what_a_scene_leaves_open_goes_by_what_the_colours_have() {
    let found = resolve("", &rgba()).unwrap();
    assert_eq!((found.scene.opacity_from(), &found.warnings, found.scene.lighting()), (Some(OpacityFrom::Alpha), &Vec::new(), None));
    assert!(found.notes.iter().all(|note| !note.contains("opacity")), "{:?}", found.notes);
    let rgb = rgba().without_alpha().unwrap();
    let found = resolve("", &rgb).unwrap();
    assert_eq!((found.scene.opacity_from(), &found.warnings), (Some(OpacityFrom::Luma), &Vec::new()));
    assert!(found.notes.iter().any(|n| n.starts_with("opacity goes by luma: from 0 at 0.1 to 0.25 at 1 ")), "{:?}", found.notes);
    let text = "[transfer]\nopacity_from = \"maximum\"\nopacity = [[0.5, 0], [1, 0.4]]\nopacity_unit = 2.5\n";
    let scene = resolve(text, &rgb).unwrap().scene;
    assert_eq!((scene.opacity_from(), scene.transfer().unit()), (Some(OpacityFrom::Maximum), Some(2.5)));
    assert_eq!(scene.transfer().opacity(), [(0.5, 0.0), (1.0, 0.4)]);
    assert_eq!(resolve("[transfer]\nopacity_from = \"luma\"\n", &rgba()).unwrap().scene.opacity_from(), Some(OpacityFrom::Luma));
    // What shows nothing is told.
    let clear = Volume::with_colors(rgba().grid().clone(), vec![0u8; 4 * SIDE * SIDE * SIDE].into()).unwrap();
    let warnings = resolve("", &clear).unwrap().warnings;
    assert!(warnings.contains(&"the picture is empty: no voxel has an opacity above 0 by its alpha".to_owned()), "{warnings:?}");
}

#[test]
fn keys_that_go_by_values_are_refused() {
    let volume = rgba();
    for key in [
        "preset = \"ct-bone\"",
        "colormap = \"viridis\"",
        "color = [[0, 1, 1, 1]]",
        "gradient_opacity = [[0, 1]]",
        "classification = \"post\"",
        "classification = \"pre\"",
    ] {
        let name = format!("transfer.{}", key.split(' ').next().unwrap());
        refused(resolve(&format!("[transfer]\n{key}\n"), &volume), &[&name, "line 7", "colours"]);
        // Found before a volume is there.
        refused(resolve(&format!("[transfer]\n{key}\nopacity_from = \"luma\"\n"), &volume), &[&name, "colours"]);
    }
    refused(resolve("[transfer]\nopacity = [[0, 0], [1, 1]]\n", &volume), &["transfer.opacity", "alpha"]);
    refused(resolve("[light]\nambient = 0.5\n", &volume), &["light", "colours"]);
    refused(resolve("[render]\nblend = \"iso\"\n", &volume), &["render.blend iso", "colours"]);
    refused(resolve("[render]\nblend = \"lmip\"\n", &volume), &["render.blend lmip", "colours"]);
    refused(resolve("[render]\nfilter = \"cubic\"\n", &volume), &["render.filter cubic", "colours"]);
    refused(resolve("[render]\nprofile = \"opengl\"\n", &volume), &["render.profile opengl", "colours"]);
    refused(resolve("[slices]\nmerge = true\ncount = 9\n", &volume), &["slices.merge", "colours"]);
    refused(resolve("[slices]\njitter = 1\n", &volume), &["slices.jitter", "colours"]);
    let two = "[transfer2d]\nregions = [{shape = \"box\", value = [0, 1], gradient = [0, 1], color = [1, 1, 1], opacity = 1}]\n";
    refused(resolve(two, &volume), &["transfer2d", "colours"]);
    refused(resolve("[transfer]\nopacity_from = \"alpha\"\n", &volume.without_alpha().unwrap()), &["opacity_from alpha", "without alpha"]);
    let values = Volume::new(rgba().grid().clone(), vec![1u8; SIDE * SIDE * SIDE].into()).unwrap();
    refused(resolve("[transfer]\nopacity_from = \"luma\"\n", &values), &["opacity_from luma", "values"]);
}

#[test]
fn a_picture_of_colours_can_be_verified() {
    for (numbers, kind, channels) in [(4, "RGBA-color", Channels::Rgba), (3, "RGB-color", Channels::Rgb)] {
        let path = folder().join(format!("colors-{numbers}.nrrd"));
        let header = format!(
            "NRRD0004\ntype: uint8\ndimension: 4\nsizes: {numbers} {SIDE} {SIDE} {SIDE}\nkinds: {kind} domain domain domain\nencoding: raw\n\n"
        );
        let voxels = bytes().chunks_exact(4).flat_map(|c| c[..numbers].to_vec()).collect::<Vec<u8>>();
        std::fs::write(&path, [header.as_bytes(), &voxels].concat()).unwrap();
        let source = VolumeSource::new(Origin::File(path.clone()));
        let volume = source.load(&slicestack::Limits::default()).unwrap();
        assert_eq!(volume.channels(), &channels);
        for text in ["", "[transfer]\nopacity_from = \"luma\"\n"] {
            let scene = resolve(text, &volume).unwrap().scene;
            // A scene made in code leaves it to the volume.
            for scene in [scene.clone(), scene.with_opacity_from(None)] {
                let picture = Renderer::new(&volume, Settings::default()).render(&scene).unwrap().0;
                let png = folder().join("colors.png");
                let metadata = Provenance::of(&scene, &source, &volume, &picture).unwrap().metadata().unwrap();
                std::fs::write(&png, picture.encode_with(Format::Png, Depth::Eight, &metadata).unwrap()).unwrap();
                let verdict = verify(&png, &Inputs::new().volume(&path), &Settings::default()).unwrap();
                assert!(verdict.is_same(), "{:?}", verdict.lines());
            }
        }
    }
}

#[test]
fn that_colours_had_no_alpha_is_told() {
    let told = |volume: &Volume| {
        let written = write_to(volume, &mut Vec::new(), WriteFormat::Nrrd, &Writing::new()).unwrap();
        written.notes.iter().any(|note| note.contains("with an alpha of 1"))
    };
    assert!(!told(&rgba()) && told(&rgba().without_alpha().unwrap()));
}

#[test]
fn scenes_of_colours_are_written_without_what_voxels_have() {
    let scene = resolve("", &rgba()).unwrap().scene;
    let text = write_scene(&scene, None, &Annotations::new(), SceneFormat::Toml).unwrap();
    assert!(text.contains("opacity_from = \"alpha\"") && !text.contains("color =") && !text.contains("\nopacity ="), "{text}");
}

/// A cut through the middle, across z.
fn cut(volume: &Volume, change: impl FnOnce(Sheet) -> Sheet) -> slicestack::Result<Drawn> {
    let frame = Frame::new(volume.grid(), Orientation::Axial).unwrap();
    let sheet = Sheet::new(volume.grid(), Orientation::Axial, vec![frame.offset_of_layer(volume.grid(), 4).unwrap()]).unwrap();
    change(sheet.with_size(SIDE as u32, SIDE as u32).unwrap()).draw(volume)
}

#[test]
fn cut_pictures_show_colours_as_they_are() {
    let volume = rgba();
    let drawn = cut(&volume, |s| s).unwrap();
    assert_eq!(drawn.window, None);
    // A pixel for each voxel, in some order: its premultiplied colour.
    let colors = volume.colors().unwrap();
    let layer: Vec<[f32; 4]> = (0..SIDE * SIDE)
        .map(|i| {
            let [r, g, b, a] = colors.get(4 * SIDE * SIDE + i);
            [r * a, g * a, b * a, a].map(|c| c as f32)
        })
        .collect();
    let near = |a: &[f32; 4], b: &[f32; 4]| (0..4).all(|c| (a[c] - b[c]).abs() < 1e-6);
    assert!(drawn.picture.pixels().iter().all(|p| layer.iter().any(|l| near(p, l))));
    assert!(layer.iter().all(|l| drawn.picture.pixels().iter().any(|p| near(p, l))));
    let nearest = cut(&volume, |s| s.with_filter(Filter::Nearest)).unwrap();
    assert!(nearest.picture.pixels().iter().zip(drawn.picture.pixels()).all(|(a, b)| near(a, b)));
    // Over a background, and without alpha.
    let white = Straight { rgb: [1.0; 3], alpha: 1.0 };
    let over = cut(&volume, |s| s.with_background(white).unwrap()).unwrap();
    assert!(over.picture.pixels().iter().zip(drawn.picture.pixels()).all(|(a, b)| near(a, &[0, 1, 2, 3].map(|c| b[c] + 1.0 - b[3]))));
    let solid = cut(&volume.clone().without_alpha().unwrap(), |s| s).unwrap();
    assert!(solid.picture.pixels().iter().all(|p| p[3] == 1.0));
    let window = Window::new(1.0, 2.0).unwrap();
    refused(cut(&volume, |s| s.with_window(window)), &["window", "colours"]);
    refused(cut(&volume, |s| s.with_colors(ColorMap::Gray)), &["colors", "colours"]);
    refused(cut(&volume, |s| s.with_filter(Filter::CUBIC)), &["filter cubic", "colours"]);
}
