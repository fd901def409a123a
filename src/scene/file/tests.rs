#![allow(clippy::panic, reason = "a test fails by panicking")]

use super::*;
use crate::scene::{Blend, Fog, FogDistance, FogMode, FogWeighting, Order, Placement, Projection, Slicing};
use crate::volume::io::Endian;
use crate::volume::phantom::Phantom;
use crate::volume::{BoxConvention, Grid, Modality, Origin, VoxelType, Voxels};
use glam::DVec3;

const PHANTOM: &str = "[volume]\nphantom = \"marschner-lobb\"\n";

fn parse(text: &str) -> Result<SceneFile> {
    SceneFile::parse(text, "dir", &Overrides::default())
}

fn with(flags: &[(&str, &str)], text: &str) -> Result<SceneFile> {
    let mut overrides = Overrides::default();
    flags.iter().for_each(|&(k, v)| overrides.set(k, v));
    SceneFile::parse(text, "dir", &overrides)
}

fn volume() -> Volume {
    let values = (0..4000).map(|i| if i % 4 == 0 { (i % 250) as u8 } else { 0 }).collect();
    Volume::new(Grid::with_spacing([20, 20, 10], [1.0, 1.0, 2.0]).expect("grid"), Voxels::U8(values)).expect("volume")
}

fn scene(text: &str) -> Scene {
    parse(&format!("{PHANTOM}{text}")).and_then(|f| f.to_scene(&volume())).unwrap_or_else(|e| panic!("{text}: {e}")).0
}

/// Fails on parsing or on meeting the data; gives the message.
fn refusal(text: &str) -> String {
    let e = parse(text).and_then(|f| f.to_scene(&volume())).err().unwrap_or_else(|| panic!("accepted: {text}"));
    let line = e.to_string();
    assert!(!line.contains('\n'), "{line}");
    line
}

#[test]
fn everything_but_the_volume_has_a_default() {
    let file = parse(PHANTOM).expect("scene");
    assert_eq!(file.volume().convention, BoxConvention::Cells);
    assert!(matches!(file.volume().origin, Origin::Phantom(_, 128)));
    let (scene, warnings) = file.to_scene(&volume()).expect("scene");
    // What shows fills the picture, in slices that leave no rings.
    let plain = Scene::new(scene.transfer().clone());
    let usual = plain.clone().with_slices(Slicing::Tolerance(0.004)).expect("a tolerance").with_camera(*scene.camera());
    assert_eq!(scene, usual);
    assert_eq!(scene.camera(), plain.framed(&volume(), 1.0).camera());
    assert!(matches!(scene.camera().placement(), Placement::LookAt { .. }));
    assert!(warnings.is_empty(), "{warnings:?}");
}

#[test]
fn every_key_arrives() {
    let file = parse(
        r#"
        [volume]
        path = "a.raw"
        box = "nodes"
        dimensions = [2, 3, 4]
        type = "i16"
        endian = "big"
        spacing = [1, 1, -2]
        origin = [1, 2, 3]
        offset = 8
        slope = 2
        intercept = -1024
        modality = "ct"
        "#,
    )
    .expect("scene");
    let Origin::Raw(path, spec) = &file.volume().origin else { panic!("not raw") };
    assert_eq!(path, Path::new("dir/a.raw"));
    assert_eq!((spec.dimensions, spec.voxel_type, spec.endian, spec.offset), ([2, 3, 4], VoxelType::I16, Endian::Big, 8));
    assert_eq!((spec.spacing, spec.origin), ([1.0, 1.0, -2.0], [1.0, 2.0, 3.0]));
    assert_eq!((file.volume().slope, file.volume().intercept), (Some(2.0), Some(-1024.0)));
    assert_eq!((file.volume().convention, file.volume().modality), (BoxConvention::Nodes, Some(Modality::Ct)));

    let s = scene(
        r#"
        [camera]
        projection = "perspective"
        eye = [1, 2, 300]
        target = [4, 5, 6]
        up = [0, 1, 0]
        fov_y = 40
        near = 2.5
        [image]
        width = 63
        height = 65
        background = [0.1, 0.2, 0.3, 0.4]
        [transfer]
        opacity_unit = 3
        color = [[0, 0, 0, 0], [100, 1, 0.5, 0]]
        opacity = [[10, 0], [20, 0.5]]
        [slices]
        spacing = 0.5
        order = "back-to-front"
        terminate = 0
        [fog]
        mode = "exp2"
        density = 0.35
        color = [0.5, 0.6, 0.7]
        distance = "radial"
        weighting = "literal"
        background = true
        [render]
        blend = "lmip"
        threshold = 12
        [[clip]]
        normal = [0, 0, 2]
        offset = 4
        [[clip]]
        normal = [1, 0, 0]
        "#,
    );
    let (eye, target) = (DVec3::new(1.0, 2.0, 300.0), DVec3::new(4.0, 5.0, 6.0));
    assert_eq!(s.camera().placement(), Placement::LookAt { eye, target, up: DVec3::Y });
    assert_eq!(s.camera().projection(), Projection::Perspective { fov_y: 40.0 });
    assert_eq!(s.camera().near(), Some(2.5));
    assert_eq!(s.size(), (63, 65));
    assert_eq!((s.background().rgb, s.background().alpha), ([0.1, 0.2, 0.3], 0.4));
    assert_eq!(s.transfer().unit(), Some(3.0));
    assert_eq!(s.transfer().eval(15.0).alpha, 0.25);
    assert_eq!(s.transfer().eval(100.0).rgb, [1.0, 0.5, 0.0]);
    assert_eq!((s.slicing(), s.order(), s.terminate()), (Slicing::Spacing(0.5), Order::BackToFront, 0.0));
    let fog = Fog::new(FogMode::Exp2 { density: 0.35 }, [0.5, 0.6, 0.7]).expect("fog");
    assert_eq!(s.fog(), Some(&fog.with_distance(FogDistance::Radial).with_weighting(FogWeighting::Literal)));
    assert!(s.fogged_background());
    assert_eq!(s.blend(), Blend::Lmip { threshold: 12.0 });
    assert_eq!((s.clip_planes()[0].normal(), s.clip_planes()[0].offset()), (DVec3::Z, 2.0));
    assert_eq!((s.clip_planes()[1].normal(), s.clip_planes()[1].offset()), (DVec3::X, 0.0));
}

#[test]
fn under_attenuation_and_windows() {
    let render = |keys: &str| scene(&format!("[render]\n{keys}\n"));
    assert_eq!(render("blend = \"under\"").blend(), Blend::Under);
    assert_eq!(render("blend = \"attenuated-mip\"").blend(), Blend::AttenuatedMip { attenuation: 4.0 });
    let faded = render("blend = \"attenuated-mip\"\nattenuation = 0.5\nwindow = [40, 400]");
    assert_eq!((faded.blend(), faded.window()), (Blend::AttenuatedMip { attenuation: 0.5 }, Some([40.0, 400.0])));
    assert_eq!(render("blend = \"add\"\nwindow = [3, 4]").window(), Some([3.0, 4.0]));
    // Of the largest value the window is a grey map.
    let mip = render("blend = \"mip\"\nwindow = [40, 400]");
    let grey = |v: f64| mip.transfer().eval(v);
    assert_eq!((mip.window(), grey(-160.0).rgb, grey(240.0).rgb, grey(40.0).alpha), (None, [0.0; 3], [1.0; 3], 1.0));
    assert!((grey(40.0).rgb[1] - 0.5).abs() < 1e-9);

    let refused = |keys: &str, words: &[&str]| {
        let line = refusal(&format!("{PHANTOM}{keys}\n"));
        assert!(words.iter().all(|word| line.contains(word)), "{line}");
    };
    refused("[render]\nwindow = [1, 2]", &["render.window", "projections of values"]);
    refused("[render]\nblend = \"iso\"\nlevel = 3\nwindow = [1, 2]", &["render.window"]);
    refused("[render]\nblend = \"mip\"\nwindow = [1, 0]", &["render.window", "positive width"]);
    refused("[render]\nblend = \"add\"\nwindow = [1, 3]", &["begin at 0"]);
    refused("[render]\nblend = \"mip\"\nattenuation = 2", &["render.attenuation", "attenuated-mip"]);
    refused("[render]\nblend = \"attenuated-mip\"\nattenuation = -2", &["attenuation", "-2"]);
    refused(
        "[render]\nblend = \"mip\"\nwindow = [1, 2]\n[transfer]\ncolor = [[0, 1, 1, 1]]\nopacity = [[0, 1]]",
        &["render.window", "transfer.range"],
    );
    refused("[render]\nblend = \"under\"\n[slices]\nmerge = true", &["slices.merge"]);
    refused(
        "[render]\nblend = \"under\"\n[slices]\norder = \"back-to-front\"\n[transfer]\nclassification = \"pre-integrated\"",
        &["under"],
    );
    refused("[render]\nblend = \"attenuated-mip\"\n[light]\nambient = 0.5", &["light"]);
    refused("[render]\nblend = \"under\"\nprofile = \"opengl\"", &["opengl"]);
}

#[test]
fn orbit_cameras_and_the_other_modes() {
    let s = scene(
        "[camera]\nazimuth = 90\nroll = 5\nheight = 20\nfit = \"box\"\n[fog]\nmode = \"linear\"\nstart = 0\nend = 9\n[slices]\ntolerance = 0.002\n",
    );
    assert_eq!(s.camera().placement(), Placement::Orbit { azimuth: 90.0, elevation: 20.0, roll: 5.0, zoom: 1.0 });
    assert_eq!(s.camera().projection(), Projection::Orthographic { height: Some(20.0) });
    assert_eq!(s.fog().map(Fog::mode), Some(FogMode::Linear { start: 0.0, end: 9.0 }));
    assert_eq!(s.slicing(), Slicing::Tolerance(0.002));
    for (name, blend) in [("over", Blend::Over), ("mip", Blend::Mip), ("min", Blend::Min), ("average", Blend::Average), ("add", Blend::Add)]
    {
        assert_eq!(scene(&format!("[render]\nblend = \"{name}\"\n")).blend(), blend);
    }
    assert_eq!(scene("[render]\nblend = \"iso\"\nlevel = 7\n").blend(), Blend::Iso { level: 7.0 });
    let shells = scene(
        "[render]\nblend = \"iso\"\nhit = \"first-sample\"\nlevels = [{ level = 7 }, { level = -2, color = [1, 0.5, 0], opacity = 0.25 }]\n",
    );
    assert_eq!((shells.blend(), shells.hit(), shells.levels().len()), (Blend::Surfaces, crate::scene::Hit::FirstSample, 2));
    assert_eq!(
        (shells.levels()[0].opacity(), shells.levels()[1].color(), shells.levels()[1].opacity()),
        (1.0, Some([1.0, 0.5, 0.0]), 0.25)
    );
    assert!(scene("[render]\nblend = \"iso\"\nlevel = 7\n[light]\nmodel = \"none\"").flat_surfaces());
    // A look-at camera with nothing but an eye, from the front and from straight above.
    for eye in ["[10, -99, 10]", "[9.5, 9.5, 500]"] {
        let s = scene(&format!("[camera]\neye = {eye}\n"));
        assert!(matches!(s.camera().placement(), Placement::LookAt { target, .. } if target == volume().grid().center()));
    }
}

#[test]
fn transfer_functions_come_in_four_ways() {
    let preset = scene("[transfer]\npreset = \"hot-ramp\"\n");
    assert!(preset.transfer().unit().is_some());
    assert_eq!(scene("[transfer]\npreset = \"hot-ramp\"\nopacity_unit = 4\n").transfer().unit(), Some(4.0));
    let map = scene("[transfer]\ncolormap = \"viridis\"\nrange = [0, 100]\n");
    assert_eq!(map.transfer().eval(100.0).rgb, [0.9932, 0.9062, 0.1439]);
    assert!(map.transfer().eval(200.0).alpha > 0.0 && map.transfer().unit().is_some());
    let both = scene("[transfer]\ncolormap = \"viridis\"\nopacity = [[0, 0], [100, 1]]\n");
    assert_eq!((both.transfer().eval(50.0).alpha, both.transfer().unit()), (0.5, None));
    let opacity = scene("[transfer]\nopacity = [[0, 0], [100, 1]]\n");
    assert_eq!(opacity.transfer().eval(25.0).alpha, 0.25);
    // A built-in volume brings its own, unless its values are changed.
    let own = scene("");
    assert_eq!(own.transfer(), &Phantom::MarschnerLobb.default_transfer(128));
    assert_eq!(own.transfer().unit(), Some(1.0));
    let changed = parse("[volume]\nphantom = \"marschner-lobb\"\nslope = 100\n").and_then(|f| f.to_scene(&volume())).expect("scene").0;
    assert_ne!(changed.transfer(), own.transfer());
}

#[test]
fn json_says_the_same() {
    let toml = format!("{PHANTOM}[camera]\nazimuth = 12.5\n[image]\nwidth = 7\n[[clip]]\nnormal = [1, 0, 0]\n");
    let json = r#"{ "volume": { "phantom": "marschner-lobb" },
        "camera": { "azimuth": 12.5, "zoom": null },
        "image": { "width": 7 },
        "clip": [ { "normal": [1, 0, 0] } ] }"#;
    assert_eq!(parse(&toml).expect("toml").document, parse(json).expect("json").document);
    let typo = json.replace("width", "widht");
    let line = refusal(&typo);
    assert_eq!(line, "line 3: image.widht: unknown key; the nearest known one is image.width");
    assert!(refusal("{ \"volume\": [ }").starts_with("line 1: "));
}

#[test]
fn flags_win_and_drop_what_they_exclude() {
    let text =
        format!("{PHANTOM}[camera]\neye = [1, 2, 90]\n[slices]\nspacing = 2\n[image]\nwidth = 10\n[transfer]\ncolor = [[0, 0, 0, 0]]\n");
    let flags =
        [("camera.azimuth", "45"), ("camera.fit", "box"), ("slices.count", "12"), ("image.width", "20"), ("transfer.preset", "x-ray")];
    let s = with(&flags, &text).and_then(|f| f.to_scene(&volume())).expect("scene").0;
    assert!(matches!(s.camera().placement(), Placement::Orbit { azimuth: 45.0, .. }));
    assert_eq!((s.slicing(), s.size()), (Slicing::Count(12), (20, 512)));
    // Later flags win over earlier ones; lists need no outer brackets.
    let flags = [
        ("camera.eye", "1,2,3"),
        ("camera.eye", "[4, .5, -60]"),
        ("transfer.opacity", "[0, 0], [10, 1]"),
        ("clip", "[{ normal = [0, 0, 1] }]"),
    ];
    let s = with(&flags, PHANTOM).and_then(|f| f.to_scene(&volume())).expect("scene").0;
    assert!(matches!(s.camera().placement(), Placement::LookAt { eye, .. } if eye == DVec3::new(4.0, 0.5, -60.0)));
    assert_eq!((s.transfer().opacity().len(), s.clip_planes().len()), (2, 1));
    // A path typed as a flag is relative to where the command runs, not to the scene.
    let f = with(&[("volume.path", "b.nrrd")], PHANTOM).expect("scene");
    assert_eq!(f.volume().origin, Origin::File("b.nrrd".into()));
    for (flags, want) in [
        (&[("camera.azimut", "1")][..], "--camera.azimut: unknown key; the nearest known one is camera.azimuth"),
        (&[("camera.zoom", "big")], "--camera.zoom: cannot read \"big\""),
        (&[("camera.zoom", "-1")], "--camera.zoom -1: must be positive and finite"),
        (&[("camera.zoom", "1\nazimuth = 3")], "--camera.zoom: cannot read"),
        (&[("image.width", "0")], "--image.width 0: must lie between 1 and 32768"),
        (&[("image.width", "1.5")], "--image.width: invalid type: floating point `1.5`, expected a whole number from 0 to 4294967295"),
        (&[("slices.order", "sideways")], "--slices.order: unknown variant `sideways`, expected `front-to-back` or `back-to-front`"),
        (&[("slices.count", "3"), ("slices.spacing", "1")], "--slices.count: slices.spacing or slices.tolerance is given too"),
        (&[("camera.eye", "1,2")], "--camera.eye"),
    ] {
        let line = with(flags, PHANTOM).err().unwrap_or_else(|| panic!("accepted: {flags:?}")).to_string();
        assert!(line.starts_with(want) && !line.contains('\n'), "{line}");
    }
}

#[test]
fn files_are_read_and_named() {
    let dir = tempfile::tempdir().expect("dir");
    let path = dir.path().join("s.toml");
    std::fs::write(&path, "[volume]\npath = \"sub/v.nrrd\"\n").expect("write");
    let file = SceneFile::read(&path, &Overrides::default()).expect("scene");
    assert_eq!(file.volume().origin, Origin::File(dir.path().join("sub/v.nrrd")));
    std::fs::write(&path, "[volume]\npath = \"v.nrrd\"\n\n[image]\nwidth = 0\n").expect("write");
    let line = SceneFile::read(&path, &Overrides::default()).expect_err("width").to_string();
    assert_eq!(line, format!("{}: line 5: image width 0: must lie between 1 and 32768", path.display()));
    // A flag is at fault, not the file.
    std::fs::write(&path, PHANTOM).expect("write");
    for (flags, want) in [
        (&[("slices.count", "3"), ("slices.spacing", "1")][..], "--slices.count: slices.spacing or slices.tolerance is given too"),
        (&[("render.level", "3")], "--render.level: is for render.blend = \"iso\" alone"),
        (&[("transfer.opacity_unit", "-3")], "--transfer.opacity_unit -3: must be positive and finite"),
    ] {
        let mut overrides = Overrides::default();
        flags.iter().for_each(|&(k, v)| overrides.set(k, v));
        let line = SceneFile::read(&path, &overrides).expect_err("flag").to_string();
        assert!(line.starts_with(want), "{line}");
    }
    std::fs::write(&path, b"\xff\xfe").expect("write");
    assert!(SceneFile::read(&path, &Overrides::default()).expect_err("bytes").to_string().contains("byte 0 is no text"));
    assert!(SceneFile::read(dir.path().join("none.toml"), &Overrides::default()).is_err());
}

#[test]
fn bad_scenes_say_what_is_wrong_and_where() {
    let cases = [
        ("", "volume: give volume.path"),
        ("[volume]", "line 1: volume: give volume.path"),
        ("[volume]\npath = 3", "line 2: volume.path: invalid type: integer `3`, expected a string"),
        ("[volume]\npath = \"\"", "volume.path: is empty"),
        ("[volume", "line 1: "),
        ("[volume]\nphantom = \"cloud\"\nphantom = \"cloud\"", "line 3: duplicate key"),
        ("volume = 3", "line 1: volume: invalid type: integer `3`"),
        ("[volume]\nphantom = \"clowd\"", "line 2: volume.phantom: unknown \"clowd\"; the nearest known one is \"cloud\""),
        ("[volume]\nphantom = \"cloud\"\npath = \"a\"", "line 2: volume.phantom: volume.path is given too"),
        ("[volume]\nphantom = \"cloud\"\nsize = 0", "line 3: volume.size: 0: must lie between 1 and 65536"),
        ("[volume]\nphantom = \"cloud\"\nsize = -4", "line 3: volume.size: invalid value: integer `-4`"),
        ("[volume]\nphantom = \"cloud\"\nendian = \"big\"", "line 3: volume.endian: belongs to raw files"),
        ("[volume]\npath = \"a\"\nsize = 3", "line 3: volume.size: belongs to built-in volumes"),
        ("[volume]\npath = \"a\"\noffset = 3", "line 3: volume.offset: belongs to raw files"),
        ("[volume]\npath = \"a\"\ndimensions = [1, 2, 3]", "volume.type: a raw file needs it"),
        ("[volume]\npath = \"a\"\ntype = \"u8\"", "volume.dimensions: a raw file needs it"),
        ("[volume]\npath = \"a\"\ndimensions = [1, 2]", "line 3: volume.dimensions: invalid length 2"),
        ("[volume]\npath = \"a\"\ntype = \"u8\"\ndimensions = [1, 0, 2]", "line 4: volume.dimensions: [1, 0, 2]: every dimension"),
        (
            "[volume]\npath = \"a\"\ndimensions = [1, 1, 2]\ntype = \"u24\"",
            "line 4: volume.type: unknown \"u24\"; the nearest known one is",
        ),
        ("[volume]\npath = \"a\"\nspacing = [1, 0, 1]", "line 3: volume.spacing: [1.0, 0.0, 1.0]: every number"),
        ("[volume]\npath = \"a\"\norigin = [1, nan, 1]", "line 3: volume.origin"),
        ("[volume]\npath = \"a\"\nslope = 0", "line 3: volume.slope: 0"),
        ("[volume]\npath = \"a\"\nintercept = inf", "line 3: volume.intercept: inf"),
        (
            "[volume]\npath = \"a\"\nmodality = \"pet\"",
            "line 3: volume.modality: unknown variant `pet`, expected one of `ct`, `mr`, `labels`, `other`",
        ),
        ("[volume]\npath = \"a\"\nbox = \"cell\"", "line 3: volume.box: unknown variant `cell`"),
        ("[volum]\npath = \"a\"", "line 1: volum: unknown key; the nearest known one is volume"),
        ("width = 3\n[volume]\npath = \"a\"", "line 1: width: unknown key; the nearest known one is image.width"),
    ];
    let more = [
        ("[camera]\nazimut = 3", "line 4: camera.azimut: unknown key; the nearest known one is camera.azimuth"),
        ("[camera]\ncount = 3", "line 4: camera.count: unknown key; the nearest known one is slices.count"),
        ("[[clip]]\nnormal = [0, 0, 0]", "clip plane with normal [0, 0, 0]"),
        ("[[clip]]\noffset = 2", "clip[0]: missing field `normal`"),
        ("[[cut]]\nnormal = [0, 0, 0]", "cut[0]: cut plane with normal [0, 0, 0]"),
        ("[[cut]]\nnormal = [0, 0, 1]\nwindow = [40, -1]", "cut[0]: cut window 40,-1"),
        ("[[cut]]\nnormal = [0, 0, 1]\ncolormap = \"grey\"", "cut[0].colormap: unknown \"grey\"; the nearest known one is \"gray\""),
        ("[[cut]]\nnormal = [0, 0, 1]\n[render]\nblend = \"mip\"", "cut: planes inside the picture hide what is behind them"),
        (
            "[slices]\njitter = 1\n[render]\nalgorithm = \"rays\"",
            "slices jitter: does not go together with render algorithm rays: it has no slices to shift",
        ),
        ("[[clip]]\nnormal = [0, 0, 1]\nofset = 2", "clip[0].ofset: unknown field `ofset`"),
        ("[camera]\neye = [1, 2, 3]\nazimuth = 4", "line 5: camera.azimuth: mixes the orbit form"),
        ("[camera]\nup = [0, 0, 1]", "line 4: camera.up: belongs to the look-at form, which needs camera.eye"),
        ("[camera]\neye = [1, 2, 3]\ntarget = [1, 2, 3]", "line 4: camera eye [1, 2, 3] and target [1, 2, 3]: the same point"),
        ("[camera]\neye = [1, 2, 3]\nup = [0, 0, 0]", "line 5: camera up [0, 0, 0]: zero or along"),
        ("[camera]\neye = [nan, 2, 3]", "line 4: camera eye"),
        ("[camera]\nfov_y = 30", "line 4: camera.fov_y: needs camera.projection = \"perspective\""),
        ("[camera]\nprojection = \"perspective\"\nheight = 3", "line 5: camera.height: belongs to orthographic"),
        ("[camera]\nprojection = \"perspective\"\nfov_y = 180", "line 5: camera fov_y 180"),
        ("[camera]\nheight = 0", "line 4: camera height 0"),
        ("[camera]\nzoom = 0", "line 4: camera zoom 0"),
        ("[camera]\nnear = -1", "line 4: camera near -1"),
        ("[camera]\nelevation = inf", "line 4: camera elevation inf"),
        ("[image]\nheight = 40000", "line 4: image height 40000"),
        ("[image]\nbackground = [0, 0, 2, 1]", "line 4: image background 2: outside [0,1]"),
        ("[image]\nbackground = [0, 0, 0]", "line 4: image.background: invalid length 3"),
        ("[transfer]\npreset = \"ct-bonee\"", "line 4: transfer.preset: unknown \"ct-bonee\"; the nearest known one is \"ct-bone\""),
        ("[transfer]\npreset = \"x-ray\"\ncolormap = \"hot\"", "line 5: transfer.colormap: transfer.preset is given too"),
        ("[transfer]\ncolormap = \"jet\"", "line 4: transfer.colormap: unknown \"jet\""),
        ("[transfer]\ncolormap = \"hot\"\ncolor = [[0, 0, 0, 0]]", "line 5: transfer.color: transfer.colormap is given too"),
        ("[transfer]\nrange = [0, 1]", "line 4: transfer.range: is for transfer.colormap"),
        ("[transfer]\ncolormap = \"hot\"\nrange = [1, 1]", "line 5: transfer.range: [1, 1]: must be two different"),
        ("[transfer]\ncolor = []", "line 4: transfer color: no points"),
        ("[transfer]\nopacity = [[1, 0], [0, 1]]", "line 4: transfer opacity: value 0 comes after 1"),
        ("[transfer]\nopacity = [[1, 1.5]]", "line 4: transfer opacity at value 1: 1.5 is outside [0,1]"),
        ("[transfer]\nopacity = [[1, 2, 3]]", "line 4: transfer.opacity[0]: "),
        ("[transfer]\nopacity_unit = 0", "line 4: transfer opacity_unit 0"),
        ("[transfer]\nclassification = \"pre-integrated\"\n[slices]\nslab = \"riemann\"", "line 6: slices slab riemann: pre-integrated"),
        ("[transfer]\nclassification = \"second-order\"\n[slices]\nsample = \"end\"", "line 6: slices sample end: pre-integrated"),
        ("[slices]\nextrapolate = true\n[render]\ntarget = \"unorm8\"", "line 4: slices extrapolate: rounding to 8 bits"),
        ("[slices]\nextrapolate = true\ntolerance = 0.01", "line 4: slices extrapolate: a tolerance chooses"),
        ("[slices]\naccumulation = \"compensated\"\n[render]\ntarget = \"unorm8\"", "line 4: slices accumulation compensated"),
        ("[slices]\naccumulation = \"compensated\"\nslab = \"riemann\"", "line 4: slices accumulation compensated"),
        ("[opengl]\nwrap = \"repeat\"", "line 4: opengl.wrap: is for render.profile = \"opengl\" alone"),
        ("[render]\ntarget = \"unorm16\"", "line 4: render target unorm16: is for the profile opengl"),
        (
            "[render]\nlinear_light = true\nprofile = \"opengl\"",
            "line 4: render linear_light: the profile opengl blends the display's numbers",
        ),
        ("[render]\nblend = \"max\"", "line 4: render.blend: unknown variant `max`"),
        ("[render]\nprefilter = true", "line 4: render.prefilter: is for render.filter = \"cubic\" alone"),
        ("[render]\nfilter = \"linear\"\nprefilter = false", "line 5: render.prefilter: is for render.filter = \"cubic\" alone"),
        ("[render]\nfilter = \"cubic\"\n[transfer]\nclassification = \"pre\"", "line 4: render filter cubic: is computed from values"),
        ("[render]\nfilter = \"cubic\"\n[slices]\nmerge = true", "line 6: slices merge: is for the linear filter (render.filter)"),
        ("[render]\nlevel = 3", "line 4: render.level: is for render.blend = \"iso\" alone"),
        ("[render]\nthreshold = 3", "line 4: render.threshold: is for render.blend = \"lmip\" alone"),
        ("[render]\nblend = \"iso\"\nlevel = inf", "line 5: render level inf"),
        ("[render]\nlevels = [{ level = 3 }]", "line 4: render.levels: is for render.blend = \"iso\" alone"),
        ("[render]\nhit = \"refined\"", "line 4: render.hit: is for render.blend = \"iso\" alone"),
        (
            "[render]\nblend = \"iso\"\nlevel = 3\nlevels = [{ level = 3 }]",
            "line 6: render.levels: render.level is given too; give one of them",
        ),
        ("[render]\nblend = \"iso\"\nlevels = [{ level = 3, opacity = 2 }]", "line 5: render.levels[0]: opacity 2: outside [0,1]"),
        ("[render]\nblend = \"iso\"\nlevels = []", "line 5: render levels: 0 are given, there can be 1 to 16"),
        ("[slices]\ncount = 0", "line 4: slices count 0"),
        ("[slices]\ncount = 2\nspacing = 2", "line 4: slices.count: slices.spacing or slices.tolerance is given too"),
        ("[slices]\nspacing = -2", "line 4: slices spacing -2"),
        ("[slices]\ntolerance = 0", "line 4: slices tolerance 0"),
        ("[slices]\nterminate = 1", "line 4: slices terminate 1"),
        ("[fog]\ndensity = 2", "line 4: fog.density: has no effect without fog.mode"),
        ("[fog]\ncolor = [1, 1, 1]", "line 4: fog.color: has no effect without fog.mode"),
        ("[fog]\ndistance = \"radial\"", "line 4: fog.distance: has no effect without fog.mode"),
        ("[fog]\nweighting = \"alpha\"", "line 4: fog.weighting: has no effect without fog.mode"),
        ("[fog]\nmode = \"exp\"\nstart = 2", "line 5: fog.start: belongs to the mode linear"),
        ("[fog]\nmode = \"linear\"\ndensity = 2", "line 5: fog.density: belongs to the modes exp"),
        ("[fog]\nmode = \"exp\"\ndensity = -2", "line 5: fog density -2"),
        ("[fog]\nmode = \"exp\"\ncolor = [0, 0, 3]", "line 5: fog color 3"),
    ];
    for (text, want) in cases {
        let line = refusal(text);
        assert!(line.contains(want), "{text:?}\n  says: {line}\n  not:  {want}");
    }
    let opengl = [
        ("[opengl]\nblend_source = \"src-alfa\"", "line 6: opengl.blend_source: unknown variant `src-alfa`"),
        ("[opengl]\nblend_sauce = \"one\"", "line 6: opengl.blend_sauce: unknown key; the nearest known one is opengl.blend_source"),
        ("[opengl]\nalpha_test = \"greater\"\nalpha_reference = 2", "line 7: opengl alpha_reference 2: outside [0,1]"),
        ("[opengl]\nalpha_reference = 0.5", "line 6: opengl.alpha_reference: has no effect without opengl.alpha_test"),
        ("[opengl]\nprimary_color = [1, 1, 1, 0.5]", "line 6: opengl.primary_color: is for opengl.environment"),
        ("[opengl]\nborder_color = [1, 1, 1, 7]\nwrap = \"clamp-to-border\"", "line 6: opengl border_color 7: outside [0,1]"),
        ("[opengl]\nborder_color = [1, 1, 1, 1]\nwrap_s = \"repeat\"", "line 6: opengl.border_color: has no effect without opengl.wrap"),
        ("[opengl]\nblend_color = [1, 1, 1, 1]\nblend_source = \"one\"", "line 6: opengl.blend_color: has no effect without a constant"),
        ("[opengl]\ntexture_matrix = [[1,0,0,0],[0,1,0,0],[0,0,1,0],[0,0,0,0]]", "line 6: opengl texture_matrix: singular"),
        ("[opengl]\ntexture_matrix = [[1,0],[0,1]]", "line 6: opengl.texture_matrix"),
        ("[opengl]\nscissor = [0, 0, -1, 5]", "line 6: opengl.scissor"),
        ("[opengl]\nfog_evaluation = \"vertex\"", "line 6: opengl.fog_evaluation: has no effect without fog.mode"),
        ("[fog]\nmode = \"exp\"\ndensity = -1", "line 7: fog density -1"),
        ("[slices]\ntolerance = 0.1", "line 6: slices.tolerance: belongs to the profile accurate"),
        ("[slices]\nterminate = 0", "line 6: slices.terminate: belongs to the profile accurate"),
        ("[transfer]\nclassification = \"pre-integrated\"", "transfer classification: the profile opengl has post and pre"),
        ("filter = \"cubic\"", "render filter cubic: the profile opengl has linear and nearest"),
        ("[opengl]\nmin_filter = \"cubic\"", "line 6: opengl.min_filter: unknown variant `cubic`"),
    ];
    for (text, want) in opengl {
        let line = refusal(&format!("{PHANTOM}[render]\nprofile = \"opengl\"\n{text}"));
        assert!(line.contains(want), "{text:?}\n  says: {line}\n  not:  {want}");
    }
    for (text, want) in more {
        let line = refusal(&format!("{PHANTOM}{text}"));
        assert!(line.contains(want), "{text:?}\n  says: {line}\n  not:  {want}");
    }
    let seven = "[[clip]]\nnormal = [1, 0, 0]\n".repeat(7);
    assert!(refusal(&format!("{PHANTOM}{seven}")).contains("7 clip planes: at most 6"));
}

#[test]
fn senseless_presets_are_told() {
    let warn = |text: &str| parse(&format!("{PHANTOM}{text}")).and_then(|f| f.to_scene(&volume())).expect("scene").1;
    let lines = warn("[transfer]\npreset = \"ct-bone\"\n");
    assert!(lines[0].contains("ct-bone needs Hounsfield units"), "{lines:?}");
    assert!(warn("[transfer]\nopacity = [[500, 0], [600, 1]]\n")[0].contains("the picture is empty"));
    assert!(warn("[transfer]\npreset = \"grey-ramp\"\n").is_empty());
    assert!(warn("[render]\nblend = \"iso\"\n")[0].contains("the surface is taken at"));
}

#[test]
fn the_schema_knows_every_key_and_explains_it() {
    let schema = schema();
    assert_eq!(schema["additionalProperties"], serde_json::json!(false));
    let keys = keys();
    for path in ["volume.path", "camera.fov_y", "transfer.opacity_unit", "slices.terminate", "render.level", "clip", "fog.background"] {
        assert!(keys.iter().any(|k| k.path == path), "{path}");
    }
    for key in keys {
        assert!(!key.about.is_empty() && !key.about.contains('\n'), "{}", key.path);
    }
    let kind = |path: &str| keys.iter().find(|k| k.path == path).map(|k| k.kind.clone());
    assert_eq!(kind("fog.distance"), Some(KeyKind::Text(vec!["planar".into(), "radial".into()])));
    assert_eq!(kind("volume.path"), Some(KeyKind::Text(vec![])));
    assert_eq!(kind("camera.eye"), Some(KeyKind::List));
    assert_eq!(kind("camera.zoom"), Some(KeyKind::Scalar));
    assert_eq!(kind("slices.count"), Some(KeyKind::Whole));
    assert_eq!(kind("clip"), Some(KeyKind::List));
    assert!(matches!(kind("transfer.preset"), Some(KeyKind::Text(words)) if words.contains(&"mr-brain".to_owned())));
    // Every section refuses what it does not know.
    for (section, inner) in schema["properties"].as_object().expect("sections") {
        let inner = if ["clip", "cut", "lights", "region"].contains(&section.as_str()) { &inner["items"] } else { inner };
        assert_eq!(inner["additionalProperties"], serde_json::json!(false), "{section}");
    }
}

#[test]
fn every_key_of_opengl_arrives() {
    use crate::scene::{
        AlphaTest, Arithmetic, BlendFunction, Classification, Compare, Environment, Equation, Factor, Filter, FogEvaluation, OpenGl,
        Scissor, TableColors, Target, TextureFormat, Wrap,
    };
    use glam::{DMat4, DVec4};
    let plain = scene("[render]\nprofile = \"opengl\"\n[fog]\nmode = \"exp\"\n");
    assert_eq!(plain.opengl(), Some(&OpenGl::default()));
    assert_eq!((plain.method().target, plain.order()), (Target::Unorm8, Order::BackToFront));
    assert_eq!(plain.fog().map(Fog::weighting), Some(FogWeighting::Literal));
    let straight = |keys: &str| {
        let s = scene(&format!("[render]\nprofile = \"opengl\"\n[opengl]\ntable_colors = \"straight\"\n{keys}\n"));
        *s.opengl().expect("the profile")
    };
    assert_eq!(straight(""), OpenGl::straight_separate());
    assert_eq!(straight("").blend_alpha, BlendFunction::OVER);
    // A factor that is given is alpha's too, unless alpha has its own.
    assert_eq!(straight("blend_source = \"src-alpha\""), OpenGl::straight());
    assert_eq!(straight("blend_source_alpha = \"src-alpha\""), OpenGl::straight());
    assert_eq!(straight("blend_source = \"src-alpha\"\nblend_source_alpha = \"one\""), OpenGl::straight_separate());

    let all = scene(
        r#"
        [transfer]
        classification = "pre"
        [slices]
        order = "front-to-back"
        [fog]
        mode = "exp2"
        weighting = "alpha"
        [render]
        profile = "opengl"
        target = "unorm16"
        filter = "nearest"
        [opengl]
        texture = "f32"
        min_filter = "linear"
        filter_arithmetic = "fixed"
        wrap = "repeat"
        wrap_t = "clamp-to-border"
        wrap_p = "clamp-to-edge"
        border_color = [0.1, 0.2, 0.3, 0.4]
        texture_matrix = [[1, 2, 3, 4], [5, 6, 7, 8], [9, 10, 11, 12], [13, 14, 15, 16]]
        table = "f32"
        table_filter = "nearest"
        table_colors = "straight"
        environment = "modulate"
        primary_color = [0.5, 0.6, 0.7, 0.8]
        fog_evaluation = "vertex"
        alpha_test = "gequal"
        alpha_reference = 0.25
        blend_arithmetic = "float"
        blend_equation = "reverse-subtract"
        blend_source = "one-minus-constant-color"
        blend_destination = "dst-alpha"
        blend_equation_alpha = "max"
        blend_source_alpha = "src-alpha-saturate"
        blend_destination_alpha = "zero"
        blend_color = [0.9, 0.8, 0.7, 0.6]
        scissor = [1, 2, 3, 4]
        "#,
    );
    let rows = [[1.0, 2.0, 3.0, 4.0], [5.0, 6.0, 7.0, 8.0], [9.0, 10.0, 11.0, 12.0], [13.0, 14.0, 15.0, 16.0]].map(DVec4::from_array);
    let want = OpenGl {
        texture: TextureFormat::F32,
        min_filter: Some(Filter::Linear),
        filter_arithmetic: Arithmetic::Fixed,
        wrap: [Wrap::Repeat, Wrap::ClampToBorder, Wrap::ClampToEdge],
        border: [0.1, 0.2, 0.3, 0.4],
        texture_matrix: DMat4::from_cols(rows[0], rows[1], rows[2], rows[3]).transpose(),
        table: Some(TextureFormat::F32),
        table_filter: Filter::Nearest,
        table_colors: TableColors::Straight,
        environment: Environment::Modulate,
        primary: [0.5, 0.6, 0.7, 0.8],
        fog_evaluation: FogEvaluation::Vertex,
        alpha_test: Some(AlphaTest { compare: Compare::GreaterOrEqual, reference: 0.25 }),
        blend_arithmetic: Arithmetic::Float,
        blend: BlendFunction { equation: Equation::ReverseSubtract, source: Factor::OneMinusConstantColor, destination: Factor::DstAlpha },
        blend_alpha: BlendFunction { equation: Equation::Max, source: Factor::SrcAlphaSaturate, destination: Factor::Zero },
        blend_constant: [0.9, 0.8, 0.7, 0.6],
        scissor: Some(Scissor { x: 1, y: 2, width: 3, height: 4 }),
    };
    assert_eq!(all.opengl(), Some(&want));
    let method = all.method();
    assert_eq!((method.target, method.filter, method.classification), (Target::Unorm16, Filter::Nearest, Classification::Pre));
    assert_eq!((all.order(), all.fog().map(Fog::weighting)), (Order::FrontToBack, Some(FogWeighting::Alpha)));
}

#[test]
fn words_of_opengl_mean_what_they_say() {
    use crate::scene::{Compare, Equation, Factor};
    // The name of a variant, in the letters of a key.
    let kebab = |name: String| {
        let letters = name.chars().enumerate().flat_map(|(i, c)| {
            let hyphen = (c.is_uppercase() && i > 0).then_some('-');
            hyphen.into_iter().chain(c.to_lowercase())
        });
        letters.collect::<String>()
    };
    let state = |key: &str, word: &str| {
        let scene = scene(&format!("[render]\nprofile = \"opengl\"\n[opengl]\n{key} = \"{word}\"\n"));
        *scene.opengl().expect("the profile is opengl")
    };
    for factor in Factor::ALL {
        assert_eq!(state("blend_source", &kebab(format!("{factor:?}"))).blend.source, factor);
    }
    for equation in Equation::ALL {
        assert_eq!(state("blend_equation", &kebab(format!("{equation:?}"))).blend.equation, equation);
    }
    let words = ["never", "less", "equal", "lequal", "greater", "notequal", "gequal", "always"];
    for (word, compare) in words.into_iter().zip(Compare::ALL) {
        assert_eq!(state("alpha_test", word).alpha_test.map(|t| t.compare), Some(compare));
    }
}
