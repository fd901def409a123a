//! Label maps and regions in scene files: what the keys come to, and what is refused, in one line that names the key.
#![cfg(all(feature = "scene-file", feature = "formats"))]
#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use slicestack::scene::{
    Annotations, Filter, FocusShape, Overrides, ResolvedScene, SceneFile, SceneFormat, SegmentEffect, SegmentStyle, label_color,
    write_scene,
};
use slicestack::{Limits, Renderer, Result, Settings};
use std::fs;
use std::path::Path;

const LIVER: [f64; 3] = [0.8, 0.3, 0.2];
const KIDNEY: [f64; 3] = [0.25, 0.5, 0.75];

/// Labels 0, 2, 3, 7 of a volume of 8 x 8 x 8 voxels, of which 2 and 3 have names and colours, 9 has them and no voxel.
fn label_map(spacing: f64) -> Vec<u8> {
    let names = "Segment0_Name:=liver\nSegment0_LabelValue:=2\nSegment0_Color:=0.8 0.3 0.2\n\
                 Segment1_Name:=left kidney\nSegment1_LabelValue:=3\nSegment1_Color:=0.25 0.5 0.75\n\
                 Segment2_Name:=spleen\nSegment2_LabelValue:=9\nSegment2_Color:=1 1 0\n";
    let mut file = format!(
        "NRRD0005\ntype: uint8\ndimension: 3\nspace: right-anterior-superior\nsizes: 8 8 8\n\
         space directions: ({spacing},0,0) (0,1,0) (0,0,1)\nspace origin: (0,0,0)\nencoding: raw\n{names}\n"
    )
    .into_bytes();
    file.extend((0..512).map(|i| [0u8, 2, 3, 7][i % 8 / 2]));
    file
}

/// A volume beside which the label map fits, as bare numbers of 8 x 8 x 8 bytes, and the label map.
fn folder() -> tempfile::TempDir {
    let dir = tempfile::tempdir().unwrap();
    fs::write(dir.path().join("seg.nrrd"), label_map(1.0)).unwrap();
    fs::write(dir.path().join("wide.nrrd"), label_map(1.5)).unwrap();
    fs::write(dir.path().join("v.raw"), (0..512).map(|i| (i % 251) as u8).collect::<Vec<_>>()).unwrap();
    dir
}

const VOLUME: &str = "[volume]\npath = \"v.raw\"\ndimensions = [8, 8, 8]\ntype = \"u8\"\n[transfer]\ncolor = [[0, 1, 0.5, 0], [200, 1, 1, 1]]\nopacity = [[0, 0], [200, 0.5]]\n";
const BESIDE: &str = "[labels]\npath = \"seg.nrrd\"\n";

fn open_in(dir: &Path, text: &str) -> Result<ResolvedScene> {
    let file = SceneFile::parse(text, dir, &Overrides::default())?;
    let volume = file.volume().load(&Limits::default())?;
    file.resolve(&volume)
}

fn open(sections: &str) -> Result<ResolvedScene> {
    open_in(folder().path(), &format!("{VOLUME}{sections}\n"))
}

/// Refused in one line that holds every part of `says`.
#[track_caller]
fn refused(sections: &str, says: &[&str]) {
    let line = open(sections).expect_err(sections).to_string();
    assert_eq!(line.lines().count(), 1, "{sections}: {line}");
    for part in says {
        assert!(line.contains(part), "{sections}: {line} does not say {part}");
    }
}

fn tint(label: i64, color: [f64; 3]) -> SegmentStyle {
    SegmentStyle::new(label, SegmentEffect::Tint { color, strength: 1.0 }).unwrap()
}

fn style(label: i64, effect: SegmentEffect) -> SegmentStyle {
    SegmentStyle::new(label, effect).unwrap()
}

#[test]
fn segments_that_have_a_color_tint_unless_the_scene_says_otherwise() {
    let found = open(BESIDE).unwrap();
    assert_eq!(found.scene.segments(), [tint(2, LIVER), tint(3, KIDNEY)]);
    assert!(found.notes.iter().any(|n| n.starts_with("labels: 2 segments are tinted (liver, left kidney)")), "{:?}", found.notes);
    let others = |what: &str| open(&format!("{BESIDE}others = \"{what}\"\n")).unwrap().scene.segments().to_vec();
    assert_eq!(others("tint"), [tint(2, LIVER), tint(3, KIDNEY)]);
    assert_eq!(others("show"), []);
    assert_eq!(others("hide"), [2, 3, 7].map(|l| style(l, SegmentEffect::Hide)));
    // By a flag, relative to where the command stands.
    let dir = folder();
    let mut flags = Overrides::default();
    flags.set("labels.path", dir.path().join("seg.nrrd").to_str().unwrap());
    let file = SceneFile::parse(VOLUME, dir.path(), &flags).unwrap();
    let volume = file.volume().load(&Limits::default()).unwrap();
    assert_eq!(file.to_scene(&volume).unwrap().0.segments().len(), 2);
    // Where values are projected there is nothing to tint.
    let found = open(&format!("[render]\nblend = \"mip\"\n{BESIDE}")).unwrap();
    assert!(found.scene.segments().is_empty() && found.notes.iter().any(|n| n.contains("tints are left out")), "{:?}", found.notes);
}

#[test]
fn segments_are_named_by_label_or_by_name() {
    let list = "[[labels.segment]]\nname = \"liver\"\nvisible = false\n\
                [[labels.segment]]\nvalue = 3\nopacity = 0.25\n\
                [[labels.segment]]\nvalue = 7\ncolor = [0.1, 0.2, 0.3]\nstrength = 0.5\n\
                [[labels.segment]]\nvalue = 0\nmode = \"show\"\n\
                [[labels.segment]]\nname = \"spleen\"\nmode = \"replace\"\ncolor = [0, 0, 1]\n";
    let found = open(&format!("{BESIDE}{list}")).unwrap();
    let want = [
        style(2, SegmentEffect::Hide),
        style(3, SegmentEffect::Replace { color: KIDNEY, opacity: 0.25 }),
        style(7, SegmentEffect::Tint { color: [0.1, 0.2, 0.3], strength: 0.5 }),
        style(0, SegmentEffect::Show),
        style(9, SegmentEffect::Replace { color: [0.0, 0.0, 1.0], opacity: 1.0 }),
    ];
    assert_eq!(found.scene.segments(), want);
    assert!(found.warnings.iter().any(|w| w.contains("labels.segment 9: no voxel has that label")), "{:?}", found.warnings);
    // A label without a colour gets one that goes with it.
    let found = open(&format!("{BESIDE}[[labels.segment]]\nvalue = 7\n")).unwrap();
    assert_eq!(found.scene.segments()[0], tint(7, label_color(7)));
}

#[test]
fn what_makes_no_sense_of_labels_is_one_line() {
    let segment = |keys: &str| format!("{BESIDE}[[labels.segment]]\n{keys}\n");
    refused(&segment("name = \"livr\""), &["labels.segment[0].name", "unknown \"livr\"", "nearest known one is \"liver\"", "left kidney"]);
    refused(&segment("color = [1, 0, 0]"), &["labels.segment[0]", "value of its label, or its name"]);
    refused(&segment("value = 2\nvisible = true\nmode = \"hide\""), &["labels.segment[0].visible", "contradicts"]);
    refused(&segment("value = 2\nvisible = false\nmode = \"tint\""), &["labels.segment[0].visible", "contradicts"]);
    refused(&segment("value = 2\nmode = \"tint\"\nopacity = 0.5"), &["labels.segment[0].opacity", "is replaced"]);
    refused(&segment("value = 2\nopacity = 0.5\nstrength = 0.5"), &["labels.segment[0].strength", "is tinted"]);
    refused(&segment("value = 2\nmode = \"show\"\ncolor = [1, 0, 0]"), &["labels.segment[0].color", "tinted or replaced"]);
    refused(&segment("value = 2\nopacity = 1.5"), &["labels.segment[0]", "1.5 is outside [0,1]"]);
    refused(&segment("value = 2.5"), &["labels.segment[0].value"]);
    refused(&segment("value = 2\nmode = \"paint\""), &["labels.segment[0].mode", "paint"]);
    refused(&segment("value = 2\nshade = 1"), &["labels.segment[0]", "shade"]);
    refused(&segment("value = 2\n[[labels.segment]]\nname = \"liver\""), &["labels.segment[1]", "label 2 is given twice"]);
    refused("[[labels.segment]]\nvalue = 2\n", &["labels.segment", "there is no label map: give labels.path"]);
    refused("[labels]\nframe = 2\n", &["labels.frame", "labels.path"]);
    refused("[labels]\npath = \"\"\n", &["labels.path", "is empty"]);
    refused("[labels]\npath = \"none.nrrd\"\n", &["none.nrrd"]);
    refused("[labels]\npath = \"wide.nrrd\"\n", &["wide.nrrd", "labels: their box is not the volume's", "voxels"]);
    refused(&format!("[slices]\nmerge = true\ncount = 9\n{BESIDE}"), &["labels", "slices merge"]);
    let mip = format!("[render]\nblend = \"mip\"\n{}", segment("value = 2\nmode = \"tint\""));
    refused(&mip, &["labels segment 2", "values are projected"]);
}

#[test]
fn a_label_map_alone_has_a_color_for_each_label() {
    let dir = folder();
    let text = |rest: &str| format!("[volume]\npath = \"seg.nrrd\"\n{rest}\n");
    let open = |rest: &str| open_in(dir.path(), &text(rest));
    let found = open("").unwrap();
    let look = |found: &ResolvedScene, label: f64| found.scene.transfer().eval(label);
    assert_eq!([2.0, 3.0, 7.0].map(|l| look(&found, l).rgb), [LIVER, KIDNEY, label_color(7)]);
    assert_eq!(look(&found, 0.0).alpha, 0.0);
    assert!([2.0, 3.0, 7.0].iter().all(|&l| look(&found, l).alpha > 0.5));
    assert_eq!(found.scene.method().filter, Filter::Nearest);
    assert!(found.scene.segments().is_empty() && found.scene.lighting().is_some());
    assert!(found.notes.iter().any(|n| n.contains("3 segments in colours of their own")), "{:?}", found.notes);
    let list = "[[labels.segment]]\nname = \"liver\"\nvisible = false\n[[labels.segment]]\nvalue = 7\ncolor = [1, 0, 0]\nopacity = 0.25\n\
                [[labels.segment]]\nvalue = 0\ncolor = [0, 0, 1]\nopacity = 0.125\n";
    let found = open(list).unwrap();
    assert_eq!([0.0, 2.0, 3.0, 7.0].map(|l| look(&found, l).alpha > 0.0), [true, false, true, true]);
    assert_eq!((look(&found, 7.0).rgb, look(&found, 7.0).alpha, look(&found, 0.0).alpha), ([1.0, 0.0, 0.0], 0.25, 0.125));
    let found = open("[labels]\nothers = \"hide\"\n[[labels.segment]]\nvalue = 3\n").unwrap();
    assert_eq!([2.0, 3.0, 7.0].map(|l| look(&found, l).alpha > 0.0), [false, true, false]);
    let line = |rest: &str| open(rest).unwrap_err().to_string();
    assert!(line("[[labels.segment]]\nvalue = 3\nmode = \"tint\"").contains("is a label map itself"));
    assert!(line("[transfer]\npreset = \"grey-ramp\"\n[[labels.segment]]\nvalue = 3").contains("labels.segment"));
    // A transfer function of its own is left alone.
    let found = open("[transfer]\npreset = \"grey-ramp\"").unwrap();
    assert_eq!((found.scene.method().filter, look(&found, 2.0).rgb == LIVER), (Filter::Linear, false));
    assert_eq!(open("[render]\nfilter = \"linear\"").unwrap().scene.method().filter, Filter::Linear);
}

#[test]
fn regions_have_a_function_of_their_own() {
    let sphere = "shape = \"sphere\"\ncenter = [3.5, 3.5, 3.5]\nradius = 2\n";
    let region = |keys: &str| format!("[[region]]\n{keys}\n");
    let found = open(&region(&format!("{sphere}color = [[0, 0, 0, 1]]\nopacity = [[50, 0], [100, 0.5]]\nopacity_unit = 3"))).unwrap();
    let own = &found.scene.regions()[0];
    assert_eq!((own.shape(), own.transfer().unit()), (FocusShape::Sphere { radius: 2.0 }, Some(3.0)));
    assert_eq!((own.transfer().eval(75.0).alpha, own.transfer().eval(75.0).rgb), (0.25, [0.0, 0.0, 1.0]));
    // What is left open is the scene's own.
    let found = open(&region(&format!("{sphere}opacity = [[0, 0.5]]"))).unwrap();
    assert_eq!(found.scene.regions()[0].transfer().color(), found.scene.transfer().color());
    let cube = "shape = \"box\"\ncenter = [3.5, 3.5, 3.5]\nsize = [2, 3, 4]\n";
    let found = open(&region(&format!("{cube}preset = \"hot-ramp\""))).unwrap();
    assert_eq!(found.scene.regions()[0].shape(), FocusShape::Box { size: [2.0, 3.0, 4.0] });
    refused(&region("shape = \"sphere\"\ncenter = [0, 0, 0]\nopacity = [[0, 1]]"), &["region[0]", "a sphere needs its radius"]);
    refused(&region("shape = \"box\"\ncenter = [0, 0, 0]\nopacity = [[0, 1]]"), &["region[0]", "a box needs its size"]);
    refused(&region(&format!("{sphere}size = [1, 1, 1]\nopacity = [[0, 1]]")), &["region[0].size", "a sphere has a radius"]);
    refused(&region(&format!("{cube}radius = 1\nopacity = [[0, 1]]")), &["region[0].radius", "a box has a size"]);
    refused(&region(sphere), &["region[0]", "give a preset, or points of color or opacity"]);
    refused(&region(&format!("{sphere}preset = \"hot-ramp\"\ncolor = [[0, 1, 1, 1]]")), &["region[0].color", "preset is given too"]);
    refused(&region(&format!("{sphere}preset = \"hot-romp\"")), &["region[0].preset", "nearest known one is \"hot-ramp\""]);
    refused(&region(&format!("{sphere}opacity = [[0, 2]]")), &["region[0]", "outside [0,1]"]);
    refused(&region("shape = \"cone\"\ncenter = [0, 0, 0]"), &["region[0].shape", "cone"]);
    refused(&region("shape = \"sphere\"\nradius = 1\nopacity = [[0, 1]]"), &["region[0]", "center"]);
    refused(&region("shape = \"sphere\"\ncenter = [0, 0, 0]\nradius = -1\nopacity = [[0, 1]]"), &["region[0]", "-1", "positive"]);
    refused(&region(&format!("{sphere}opacity = [[0, 1]]")).repeat(9), &["9 regions", "at most 8"]);
    let sections = format!("[render]\nblend = \"mip\"\n{}", region(&format!("{sphere}opacity = [[0, 1]]")));
    refused(&sections, &["region", "a projection of values"]);
}

#[test]
fn a_scene_written_with_its_label_map_gives_the_same_picture() {
    let dir = folder();
    let text = format!(
        "{VOLUME}[image]\nwidth = 40\nheight = 30\n[slices]\ncount = 40\n{BESIDE}[[labels.segment]]\nname = \"liver\"\nopacity = 0.5\n\
         [[region]]\nshape = \"sphere\"\ncenter = [3.5, 3.5, 3.5]\nradius = 2.5\nopacity = [[0, 0.3]]\n"
    );
    let picture = |text: &str| {
        let file = SceneFile::parse(text, dir.path(), &Overrides::default()).unwrap();
        let volume = file.volume().load(&Limits::default()).unwrap();
        let scene = file.to_scene(&volume).unwrap().0;
        let pixels = Renderer::new(&volume, Settings::default()).render(&scene).unwrap().0;
        (pixels.sha256(), scene, file.volume().clone())
    };
    let (sha, scene, source) = picture(&text);
    for format in [SceneFormat::Toml, SceneFormat::Json] {
        let written = write_scene(&scene, Some(&source), &Annotations::new(), format).unwrap();
        let (again, back, _) = picture(&written);
        assert_eq!((again, back), (sha.clone(), scene.clone()), "{written}");
    }
}

#[test]
fn a_name_beside_a_label_is_not_that_of_another() {
    let other = format!("{BESIDE}segment = [{{ value = 3, name = \"liver\", mode = \"hide\" }}]");
    refused(&other, &["labels.segment[0].name", "\"liver\" is label 2 in the label map, not 3"]);
    // A name of the reader's own is none.
    assert!(open(&format!("{BESIDE}segment = [{{ value = 3, name = \"mine\", mode = \"hide\" }}]")).is_ok());
}

#[test]
fn voxels_are_labels_where_the_scene_says_so() {
    let dir = folder();
    let raw = "[volume]\npath = \"v.raw\"\ndimensions = [8, 8, 8]\ntype = \"u8\"\nmodality = \"labels\"\n";
    let found = open_in(dir.path(), raw).unwrap();
    assert_eq!(found.scene.method().filter, Filter::Nearest);
    assert!(found.notes.iter().any(|n| n.starts_with("a label map: 250 segments")), "{:?}", found.notes);
    let file = SceneFile::parse(raw, dir.path(), &Overrides::default()).unwrap();
    let text = write_scene(&found.scene, Some(file.volume()), &Annotations::new(), SceneFormat::Toml).unwrap();
    assert!(text.contains("modality = \"labels\""), "{text}");
    let floats = raw.replace("\"u8\"", "\"f32\"").replace("[8, 8, 8]", "[4, 4, 8]");
    let line = open_in(dir.path(), &floats).unwrap_err().to_string();
    assert!(line.contains("v.raw: ") && line.contains("label"), "{line}");
}

#[test]
fn what_changes_nothing_is_told() {
    let told = |sections: &str| open(sections).unwrap().warnings.join("\n");
    let region = |center: f64| format!("[[region]]\nshape = \"sphere\"\ncenter = [{center}, 4, 4]\nradius = 3\nopacity = [[0, 0], [9, 1]]");
    assert!(told(&region(50.0)).contains("region[0]: lies outside the volume's box") && !told(&region(4.0)).contains("region"));
    let cut = |offset: f64| format!("[[cut]]\nnormal = [1, 0, 0]\noffset = {offset}");
    assert!(told(&cut(50.0)).contains("cut[0]: passes the volume's box by") && !told(&cut(4.0)).contains("cut"));
}
