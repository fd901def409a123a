//! Transfer functions of other programs in scenes and on the command line, and what is drawn of them.
#![cfg(feature = "cli")]
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test fails by panicking")]

use slicestack::scene::{
    Lighting, Overrides, Preset, SceneFile, Shading, TransferFile, TransferFunction, transfer_sections, write_transfer,
};
use slicestack::transfer_io::FileKind;
use slicestack::volume::{Grid, JointHistogram, Voxels};
use slicestack::{Picture, Volume};
use std::fs;
use std::path::Path;
use std::process::{Command, Output};
use tempfile::TempDir;

const PROPERTY: &str = "1\n1\n0.8\n0.1\n0.3\n12\n4 0 0 1 0.5\n4 0 0.25 2 1\n8 0 0 0 0 1 1 0.5 0.25\n";
const PRESETS: &str = r#"<MRML>
 <VolumeProperty name="Unlit" shade="0" scalarOpacity="4 0 0 1 0.5" colorTransfer="8 0 0 0 0 1 1 0.5 0.25"/>
 <VolumeProperty name="Lit" shade="1" specularPower="0" scalarOpacity="4 0 0 1 0.75" colorTransfer="8 0 0 0 0 1 1 0.5 0.25"/>
</MRML>"#;

fn dir() -> TempDir {
    let dir = tempfile::tempdir().unwrap();
    fs::write(dir.path().join("a.vp"), PROPERTY).unwrap();
    fs::write(dir.path().join("b.xml"), PRESETS).unwrap();
    dir
}

fn volume() -> Volume {
    let values: Vec<f32> = (0..5 * 6 * 7).map(|i| i as f32 / 209.0).collect();
    Volume::new(Grid::with_spacing([5, 6, 7], [0.5, 1.0, 2.0]).unwrap(), Voxels::F32(values.into())).unwrap()
}

/// The scene of `keys` beside the files of `dir`, for [`volume`].
fn scene(dir: &Path, keys: &str) -> (slicestack::Scene, Vec<String>) {
    let text = format!("[volume]\nphantom = \"shepp-logan\"\nsize = 4\n{keys}");
    SceneFile::parse(&text, dir, &Overrides::default()).unwrap().to_scene(&volume()).unwrap()
}

fn refused(dir: &Path, keys: &str) -> String {
    let text = format!("[volume]\nphantom = \"shepp-logan\"\nsize = 4\n{keys}");
    let line = SceneFile::parse(&text, dir, &Overrides::default()).unwrap_err().to_string();
    assert!(!line.contains('\n'), "{line}");
    line
}

#[test]
fn a_scene_takes_curves_and_light_from_a_file() {
    let dir = dir();
    let (scene_of_file, _) = scene(dir.path(), "[transfer]\nfile = \"a.vp\"\n");
    let t = scene_of_file.transfer();
    assert_eq!((t.unit(), t.opacity()), (Some(1.0), &[(0.0, 0.0), (1.0, 0.5)][..]));
    assert_eq!(t.gradient_opacity(), [(0.0, 0.25), (2.0, 1.0)]);
    let light = scene_of_file.lighting().unwrap();
    assert_eq!((light.ambient, light.diffuse, light.specular, light.shininess), (0.1, 0.8, 0.3, 12.0));
    // Keys beside the file change what they name.
    let (changed, _) =
        scene(dir.path(), "[transfer]\nfile = \"a.vp\"\nopacity_unit = 0.5\ngradient_opacity = [[0, 1]]\n[light]\nambient = 0.5\n");
    assert_eq!((changed.transfer().unit(), changed.transfer().gradient_opacity()), (Some(0.5), &[(0.0, 1.0)][..]));
    assert_eq!(changed.lighting().map(|l| (l.ambient, l.diffuse)), Some((0.5, 0.8)));
    let (dark, _) = scene(dir.path(), "[transfer]\nfile = \"a.vp\"\n[light]\nmodel = \"none\"\n");
    assert!(dark.lighting().is_none());
    let (unlit, _) = scene(dir.path(), "[transfer]\nfile = \"b.xml\"\nname = \"Unlit\"\n");
    assert!(unlit.lighting().is_none() && unlit.transfer().gradient_opacity().is_empty());
    // A specular power of 0 is brought into the range that a scene has.
    let (lit, _) = scene(dir.path(), "[transfer]\nfile = \"b.xml\"\nname = \"Lit\"\n");
    assert_eq!(lit.lighting().map(|l| l.shininess), Some(1.0));
    assert_eq!(lit.transfer().eval(1.0).alpha, 0.75);
}

#[test]
fn another_scene_lends_its_sections() {
    let dir = dir();
    let own = "[transfer]\ncolor = [[0, 1, 0, 0]]\nopacity = [[0, 0.25]]\n[light]\nemission = 0.5\n[[lights]]\nposition = [1, 2, 3]\n";
    fs::write(dir.path().join("own.toml"), own).unwrap();
    let (borrowed, _) = scene(dir.path(), "[transfer]\nfile = \"own.toml\"\n");
    assert_eq!((borrowed.transfer().unit(), borrowed.transfer().eval(0.0).rgb), (None, [1.0, 0.0, 0.0]));
    assert_eq!(borrowed.lighting().map(|l| (l.emission, l.lights().len())), Some((0.5, 1)));
    // One that is laid over the data is laid over this scene's.
    fs::write(dir.path().join("ramp.json"), "{\"transfer\": {\"preset\": \"grey-ramp\"}}").unwrap();
    let (ramp, _) = scene(dir.path(), "[transfer]\nfile = \"ramp.json\"\n");
    assert_eq!(ramp.transfer(), &Preset::GreyRamp.transfer(&volume()).unwrap());
    fs::write(dir.path().join("loop.toml"), "[transfer]\nfile = \"loop.toml\"\n").unwrap();
    assert!(
        refused(dir.path(), "[transfer]\nfile = \"loop.toml\"\n").contains("line 2: transfer.file: this file is a transfer.file itself")
    );
    fs::write(dir.path().join("none.toml"), "[volume]\npath = \"a\"\n").unwrap();
    assert!(refused(dir.path(), "[transfer]\nfile = \"none.toml\"\n").contains("none.toml: has no section [transfer]"));
    assert!(refused(dir.path(), "[transfer]\nfile = \"own.toml\"\nname = \"x\"\n").contains("leave the name \"x\" out"));
}

#[test]
fn rivals_and_mistakes_are_told() {
    let dir = dir();
    let says = |keys: &str, want: &str| {
        let line = refused(dir.path(), &format!("[transfer]\n{keys}\n"));
        assert!(line.contains(want), "{keys}: {line}");
    };
    says("file = \"a.vp\"\npreset = \"ct-bone\"", "transfer.preset: transfer.file is given too; give one of them");
    says("file = \"a.vp\"\nopacity = [[0, 1]]", "transfer.opacity: transfer.file is given too");
    says("file = \"a.vp\"\ncolormap = \"hot\"", "transfer.colormap: transfer.file is given too");
    says("name = \"x\"", "transfer.name: is for transfer.file");
    says("file = \"\"", "transfer.file: is empty");
    says("file = \"missing.vp\"", "missing.vp: ");
    says("file = \"a.tf\"", "a.tf: the extension tells no kind");
    says("file = \"a.vp\"\nname = \"x\"", "leave the name \"x\" out");
    says("file = \"b.xml\"", "b.xml: holds 2 transfer functions, name one of them: Unlit, Lit");
    says("file = \"b.xml\"\nname = \"Lid\"", "b.xml: holds no \"Lid\"; there are Unlit, Lit");
    fs::write(dir.path().join("bad.vp"), PROPERTY.replace("0.5\n", "x\n")).unwrap();
    says("file = \"bad.vp\"", "bad.vp: line 7: scalar opacity: \"x\" is no number");
    // A flag drops what the file says otherwise.
    let text = "[volume]\nphantom = \"shepp-logan\"\n[transfer]\npreset = \"ct-bone\"\nopacity_unit = 3\n";
    let mut overrides = Overrides::default();
    overrides.set("transfer.file", dir.path().join("a.vp").to_str().unwrap());
    let (scene, _) = SceneFile::parse(text, "", &overrides).unwrap().to_scene(&volume()).unwrap();
    assert_eq!(scene.transfer().unit(), Some(1.0));
}

/// A function and a light with every part that a scene file can hold.
fn full() -> (TransferFunction, Lighting) {
    let transfer = TransferFunction::new(vec![(-1e30, [0.0; 3]), (1e-7, [0.1, 0.2, 1.0])], vec![(0.0, 0.0), (0.0, 0.5), (1.0, 1.0)]);
    let transfer = transfer.and_then(|t| t.with_unit(0.25)).and_then(|t| t.with_gradient_opacity(vec![(0.5, 0.0), (9.0, 1.0)])).unwrap();
    let mut light = Lighting::default();
    (light.shading, light.ambient, light.emission, light.gradient_floor) = (Shading::Depth, 0.0, 0.125, 1e-3);
    light.two_sided = false;
    use slicestack::scene::{Light, LightSource};
    let lights = [LightSource::Head, LightSource::Position(glam::DVec3::new(1.0, -2.5, 1e20))];
    (transfer, light.with_lights(lights.map(|l| Light::new(l, [1.0, 0.5, 0.0]).unwrap()).to_vec()).unwrap())
}

#[test]
fn sections_of_a_scene_read_back_as_they_were() {
    let dir = dir();
    let (transfer, light) = full();
    let path = dir.path().join("full.toml");
    for light in [Some(light), Some(Lighting::default()), None] {
        fs::write(&path, transfer_sections(&transfer, light.as_ref()).unwrap()).unwrap();
        let file = TransferFile::open(&path, None).unwrap();
        assert!(!file.needs_volume().unwrap() && file.volume().is_none());
        let found = file.transfer(None).unwrap();
        assert_eq!((found.transfer, found.lighting), (transfer.clone(), light));
    }
}

#[test]
fn what_a_format_has_no_place_for_is_told() {
    let (transfer, light) = full();
    let mut material = light.clone();
    material.shading = Shading::BlinnPhong;
    let (_, lost) = write_transfer("x", &transfer, Some(&material), FileKind::SlicerProperty);
    assert_eq!(lost.len(), 1, "{lost:?}");
    assert!(lost[0].contains("emission, gradient_floor, two_sided, lights cannot be written"), "{lost:?}");
    let (text, lost) = write_transfer("x", &transfer, Some(&Lighting::default()), FileKind::SlicerPresets);
    assert!(lost.is_empty() && text.contains("shade=\"1\"") && text.contains("name=\"x\""), "{lost:?} {text}");
    assert_eq!(write_transfer("x", &transfer, Some(&material), FileKind::Csv).1.len(), 2);
}

#[test]
fn every_preset_survives_every_format() {
    let dir = dir();
    let volume = volume();
    for preset in Preset::ALL {
        let found = preset.found(Some(&volume)).unwrap();
        let transfer = found.transfer.clone().with_unit(found.transfer.opacity_length(volume.grid())).unwrap();
        for kind in FileKind::ALL {
            let path = dir.path().join("p").with_extension(kind.extension());
            fs::write(&path, write_transfer(preset.name(), &transfer, found.lighting.as_ref(), kind).0).unwrap();
            let again = TransferFile::open(&path, None).unwrap().transfer(None).unwrap();
            assert_eq!(again.transfer.unit(), Some(1.0));
            let knots = transfer.knots();
            let (lo, hi) = (knots[0], knots[knots.len() - 1]);
            for i in 0..=400 {
                let v = lo + (hi - lo) * f64::from(i) / 400.0;
                let (a, b) = (transfer.eval(v), again.transfer.eval(v));
                let per_unit = 1.0 - (1.0 - a.alpha).powf(1.0 / transfer.unit().unwrap());
                assert!((per_unit - b.alpha).abs() < 1e-3, "{} {kind:?} at {v}: {per_unit}, {}", preset.name(), b.alpha);
                assert!((0..3).all(|c| (a.rgb[c] - b.rgb[c]).abs() < 1e-5), "{} {kind:?} at {v}", preset.name());
            }
            if matches!(kind, FileKind::SlicerProperty | FileKind::SlicerPresets) {
                assert_eq!(again.transfer.gradient_opacity(), transfer.gradient_opacity());
            }
        }
    }
}

// ---- the command -------------------------------------------------------------------------------------------------------

fn run(dir: &Path, args: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_slicestack")).args(args).current_dir(dir).output().unwrap()
}

/// What a command that works prints, and the lines on stderr.
fn good(dir: &Path, args: &[&str]) -> (String, String) {
    let out = run(dir, args);
    let errors = String::from_utf8(out.stderr).unwrap();
    assert!(out.status.success(), "{args:?}: {errors}");
    (String::from_utf8(out.stdout).unwrap(), errors)
}

fn bad(dir: &Path, args: &[&str], status: i32) -> String {
    let out = run(dir, args);
    let line = String::from_utf8(out.stderr).unwrap();
    assert_eq!(out.status.code(), Some(status), "{args:?}: {line}");
    assert!(line.starts_with("error: ") && line.lines().count() == 1 && out.stdout.is_empty(), "{args:?}: {line}");
    line
}

const RAW: [&str; 8] = ["--volume.dimensions", "5,6,7", "--volume.type", "u8", "--volume.spacing", "0.5,1,2", "--volume.modality", "mr"];

#[test]
fn tf_writes_tables_files_and_pictures() {
    let dir = dir();
    let d = dir.path();
    fs::write(d.join("v.raw"), (0..210).map(|i| (i * 7 % 256) as u8).collect::<Vec<_>>()).unwrap();
    let (table, _) = good(d, &["tf", "ct-bone"]);
    assert!(table.starts_with("value,r,g,b,opacity\n150,"), "{table}");
    assert_eq!(table.lines().count(), 1 + Preset::CtBone.at_fixed_values().unwrap().knots().len());
    for name in ["o.vp", "o.xml", "o.json", "o.toml", "o.csv"] {
        good(d, &["tf", "a.vp", "-o", name]);
        let (again, _) = good(d, &["tf", name]);
        assert_eq!(again, good(d, &["tf", "a.vp"]).0, "{name}");
        // Its like gives way.
        good(d, &["tf", "b.xml", "--name", "Lit", "-o", name]);
    }
    let (_, told) = good(d, &["tf", "a.vp", "-o", "o.json"]);
    assert!(told.contains("warning: gradient opacity is left out") && told.contains("warning: light is left out"), "{told}");
    good(d, &["tf", "a.vp", "-o", "curve.png"]);
    good(d, &[&["tf", "mr-brain", "--volume", "v.raw", "-o", "over.png"][..], &RAW].concat());
    let size = |name: &str| {
        let picture = Picture::open(d.join(name)).unwrap();
        (picture.width(), picture.height())
    };
    let (curve, over) = (size("curve.png"), size("over.png"));
    assert_eq!((curve.0, over.0), (1800, 1800));
    assert!(curve.1 > over.1, "the gradient opacity has a plot of its own");
    // A scene's own volume serves where one is needed.
    fs::write(d.join("s.toml"), "[volume]\nphantom = \"cloud\"\nsize = 8\n[transfer]\npreset = \"hot-ramp\"\n").unwrap();
    assert!(good(d, &["tf", "s.toml"]).0.lines().count() > 4);
    let toml = good(d, &["tf", "s.toml", "-o", "t.toml"]);
    assert!(toml.0.is_empty() && fs::read_to_string(d.join("t.toml")).unwrap().contains("opacity_unit = "));
}

#[test]
fn tf_says_what_is_wrong() {
    let dir = dir();
    let d = dir.path();
    assert!(bad(d, &["tf", "ct-bome"], 2).contains("neither a file nor a preset; the nearest preset is ct-bone"));
    assert!(bad(d, &["tf", "mr-brain"], 2).contains("mr-brain: is laid over the values of a volume: name one with --volume FILE"));
    assert!(bad(d, &["tf", "ct-bone", "-o", "a.bmp"], 2).contains("a.bmp: write .png, .vp"));
    assert!(bad(d, &["tf", "ct-bone", "--name", "x"], 2).contains("--name x"));
    assert!(bad(d, &["tf", "b.xml"], 1).contains("b.xml: holds 2 transfer functions"));
    assert!(bad(d, &["tf", "none.vp"], 1).contains("none.vp: "));
    assert!(bad(d, &["tf", "a.vp", "-o", "a.vp"], 2).contains("would overwrite the input"));
    fs::write(d.join("other.csv"), "name,age\n").unwrap();
    assert!(bad(d, &["tf", "a.vp", "-o", "other.csv"], 2).contains("is there already"));
    fs::write(d.join("s.toml"), "[transfer]\ncolormap = \"hot\"\n").unwrap();
    assert!(bad(d, &["tf", "s.toml"], 2).contains("--volume FILE"));
}

#[test]
fn info_counts_every_finite_voxel() {
    let dir = dir();
    let d = dir.path();
    fs::write(d.join("v.raw"), (0..210).map(|i| (i * 7 % 256) as u8).collect::<Vec<_>>()).unwrap();
    fn info<'a>(more: &[&'a str]) -> Vec<&'a str> {
        [&["info", "v.raw"][..], &RAW, more].concat()
    }
    let (told, _) = good(d, &info(&["--histogram2d", "joint.csv"]));
    assert!(told.contains("210 voxels"), "{told}");
    let table = fs::read_to_string(d.join("joint.csv")).unwrap();
    let counts = table.lines().skip(1).map(|l| l.rsplit(',').next().unwrap().parse::<u64>().unwrap());
    assert_eq!(counts.sum::<u64>(), 210);
    good(d, &info(&["--histogram2d", "joint.png"]));
    let picture = Picture::open(d.join("joint.png")).unwrap();
    assert!(picture.width() > 1024 && picture.pixels().iter().filter(|p| p[0] < 0.5).count() > 100);
    assert!(bad(d, &info(&["--histogram2d", "joint.txt"]), 2).contains("write .png or .csv"));
    assert!(bad(d, &info(&["--histogram2d", "v.raw.png/x.csv"]), 1).contains("there is no directory"));
}

#[test]
fn counts_of_a_large_volume_add_up_for_every_number_of_threads() {
    let values: Vec<i16> = (0..40 * 41 * 42).map(|i: i32| (i.wrapping_mul(7919) % 4096) as i16).collect();
    let volume = Volume::new(Grid::with_spacing([40, 41, 42], [1.0, 0.5, -2.0]).unwrap(), Voxels::I16(values.into())).unwrap();
    let one = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap().install(|| JointHistogram::of(&volume, None).unwrap());
    let many = rayon::ThreadPoolBuilder::new().num_threads(7).build().unwrap().install(|| JointHistogram::of(&volume, None).unwrap());
    assert_eq!(one, many);
    assert_eq!(one.total(), 40 * 41 * 42);
}
