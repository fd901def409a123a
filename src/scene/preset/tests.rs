use super::*;
use crate::volume::{Grid, Voxels};

fn volume(values: Vec<i16>) -> Volume {
    let n = values.len();
    Volume::new(Grid::with_spacing([n, 1, 1], [1.0, 1.0, 1.0]).expect("grid"), Voxels::I16(values.into())).expect("volume")
}

/// Mostly air, then fat, tissue and bone, in Hounsfield units plus `offset`.
fn ct(offset: i16) -> Volume {
    let mut v = vec![-1000 + offset; 1000];
    v.extend((0..400).map(|i| 20 + i % 60 + offset));
    v.extend((0..100).map(|i| 300 + 12 * i + offset));
    volume(v)
}

/// Two thirds background noise, one third signal around 150 of 255.
fn mr() -> Volume {
    volume((0..2000).map(|i| i % 8).chain((0..1000).map(|i| 100 + i % 120)).collect())
}

#[test]
fn every_preset_that_is_suggested_shows_something() {
    for v in [ct(0), mr(), volume(vec![0, 255]), volume(vec![7; 30]), volume((0..4000).collect())] {
        let s = v.statistics();
        let suggested = Preset::suggest(&v);
        assert!(!suggested.is_empty());
        for p in suggested {
            let t = p.transfer(&v).expect("transfer");
            assert!(t.opaque_within(s.min, s.max), "{} on {} to {}", p.name(), s.min, s.max);
        }
    }
}

#[test]
fn background_stays_empty() {
    let v = mr();
    for p in [Preset::MrBrain, Preset::MrAngio, Preset::GreyRamp, Preset::HotRamp, Preset::ViridisRamp] {
        let t = p.transfer(&v).expect("transfer");
        assert_eq!(t.eval(4.0).alpha, 0.0, "{}", p.name());
        assert!(t.eval(200.0).alpha > 0.0, "{}", p.name());
    }
    for p in Preset::ALL.into_iter().filter(|p| p.is_ct()) {
        let t = p.transfer(&ct(0)).expect("transfer");
        // Air is the same all around: its gradient is 0.
        assert_eq!(t.eval(-1000.0).alpha * t.gradient_factor(0.0), 0.0, "{}: air", p.name());
    }
    let bone = Preset::CtBone.transfer(&ct(0)).expect("transfer");
    assert_eq!(bone.eval(60.0).alpha, 0.0, "muscle");
    assert!(bone.eval(900.0).alpha > 0.2, "bone");
}

#[test]
fn senseless_presets_say_why() {
    let why = |p: Preset, v: &Volume| p.suits(v).expect_err("senseless");
    assert!(Preset::CtBone.suits(&ct(0)).is_ok());
    assert!(why(Preset::CtBone, &ct(1024)).contains("set volume.intercept = -1024"), "{}", why(Preset::CtBone, &ct(1024)));
    assert!(why(Preset::CtBone, &mr()).contains("run from 0 to 219"), "{}", why(Preset::CtBone, &mr()));
    assert!(why(Preset::MrBrain, &ct(0)).contains("looks like CT"));
    assert!(why(Preset::MrBrain, &mr().with_modality(Modality::Ct)).contains("is CT"));
    assert!(why(Preset::CtLung, &ct(0).with_modality(Modality::Mr)).contains("is MR"));
    assert!(Preset::MrBrain.suits(&mr()).is_ok());
    for p in Preset::ALL {
        if let Err(line) = p.suits(&mr()) {
            assert!(!line.contains('\n') && line.starts_with(p.name()));
        }
    }
}

#[test]
fn suggestions_follow_the_data() {
    assert!(Preset::suggest(&ct(0))[0].is_ct());
    assert!(!Preset::suggest(&ct(1024)).iter().any(|p| p.is_ct()));
    assert_eq!(Preset::suggest(&mr().with_modality(Modality::Mr))[0], Preset::MrBrain);
    assert!(!Preset::suggest(&mr())[0].is_ct());
}

#[test]
fn landmarks_split_background_from_object() {
    let m = Landmarks::of(mr().statistics());
    assert!(m.background < 8.0 && m.split > 7.0 && m.split <= 101.0 && m.high > 200.0, "{m:?}");
    let one = Landmarks::of(volume(vec![7; 30]).statistics());
    assert!(one.background < one.split && one.split < one.high);
}

#[test]
fn names_are_found_again() {
    for p in Preset::ALL {
        assert_eq!(Preset::from_name(p.name()), Some(p));
        assert!(!p.about().is_empty());
    }
}

/// Where each preset shows much and where nothing: what its name says.
#[test]
fn ct_presets_show_what_they_are_named_for() {
    let at = |p: Preset, value: f64| p.at_fixed_values().expect("a CT preset").eval(value).alpha;
    for (preset, shown, hidden) in [
        (Preset::CtAaa, 300.0, 50.0),
        (Preset::CtBones, 700.0, 60.0),
        (Preset::CtCardiac, 300.0, 0.0),
        (Preset::CtChestContrast, 300.0, 0.0),
        (Preset::CtCoronary, 350.0, 100.0),
        (Preset::CtFat, -100.0, 60.0),
        (Preset::CtLiverVessels, 180.0, 30.0),
        (Preset::CtMip, 600.0, -1000.0),
        (Preset::CtMuscle, 60.0, -100.0),
        (Preset::CtPulmonary, -680.0, 40.0),
        (Preset::CtAir, -850.0, 40.0),
    ] {
        assert!(at(preset, shown) >= 0.015 && at(preset, hidden) == 0.0, "{}", preset.name());
        assert!(preset.is_ct() && preset.suits(&ct(0)).is_ok(), "{}", preset.name());
        assert_eq!(preset.transfer(&ct(0)).ok(), preset.at_fixed_values());
    }
    // What lies in the air around the body has no gradient, and is not shown.
    assert_eq!(Preset::CtAir.at_fixed_values().map(|t| t.gradient_factor(0.0)), Some(0.0));
    // A projection shows the greatest value by its colour: the ramp must rise, and be opaque where it is bright.
    for (t, values) in [(Preset::CtMip.transfer(&ct(0)), [0.0, 300.0, 1000.0]), (Preset::MrMip.transfer(&mr()), [60.0, 130.0, 215.0])] {
        let [a, b, c] = values.map(|v| t.as_ref().expect("transfer").eval(v));
        assert!(a.rgb[0] < b.rgb[0] && b.rgb[0] < c.rgb[0] && c.alpha > 0.95 && a.rgb[0] == a.rgb[1]);
    }
    assert!(Preset::MrDefault.at_fixed_values().is_none());
}

#[test]
fn anisotropy_is_a_fraction() {
    let fractions = |top: f32| {
        let values: Vec<f32> = (0..1000).map(|i| i as f32 / 1000.0 * top).collect();
        Volume::new(Grid::with_spacing([1000, 1, 1], [1.0; 3]).expect("grid"), Voxels::F32(values.into())).expect("volume")
    };
    assert!(Preset::DtiFa.suits(&fractions(1.0)).is_ok() && Preset::suggest(&fractions(1.0)).contains(&Preset::DtiFa));
    assert!(Preset::DtiFa.suits(&fractions(3.0)).expect_err("too great").contains("fractions between 0 and 1"));
}

/// A body of values around a sphere in a box of `n` voxels a side, and what is around it.
fn body(n: usize, radius: f64, inside: impl Fn(usize) -> i16, around: impl Fn(usize) -> i16) -> Volume {
    let middle = 0.5 * (n - 1) as f64;
    let voxels: Vec<i16> = (0..n * n * n)
        .map(|i| {
            let at = [i % n, i / n % n, i / n / n].map(|k| k as f64 - middle);
            if at.iter().map(|x| x * x).sum::<f64>() < radius * radius { inside(i) } else { around(i) }
        })
        .collect();
    let grid = Grid::with_spacing([n; 3], [1.0; 3]).expect("grid").with_space(crate::volume::Space::Ras);
    Volume::new(grid, Voxels::I16(voxels.into())).expect("volume")
}

/// Numbers that look like noise, 0 to below `n`.
fn noise(i: usize, n: usize) -> i16 {
    ((i.wrapping_mul(2_654_435_761) >> 7) % n) as i16
}

/// What volumes are taken for where their files do not say.
#[test]
fn kinds_are_told_by_values_and_axes() {
    let tissue = |i: usize| if i % 50 == 0 { 900 } else { 20 + noise(i, 60) };
    let air = |i: usize| -1010 + noise(i, 20);
    let plain = body(24, 9.0, tissue, air);
    let guess = Guess::of(&plain);
    assert_eq!((guess.kind, guess.preset), (Kind::Hounsfield, Preset::CtBone), "{}", guess.reason);
    // What fills the corners of a scanner's field is no tissue, and told.
    for padding in [-32768, -2000, -3024] {
        let around = |i: usize| if i % 3 == 0 { padding } else { air(i) };
        let guess = Guess::of(&body(24, 9.0, tissue, around));
        assert_eq!(guess.kind, Kind::Hounsfield, "{padding}: {}", guess.reason);
        assert!(guess.reason.contains(&padding.to_string()), "{}", guess.reason);
    }
    // MR whose background rings below 0, far above CT's range.
    let ringing = Guess::of(&body(24, 10.0, |i| 9000 + noise(i, 20000), |i| noise(i, 1200) - 600));
    assert_eq!((ringing.kind, ringing.preset), (Kind::Mr, Preset::MrBrain), "{}", ringing.reason);
    // Phases: as many below 0 as above, as far.
    let phase = Guess::of(&body(24, 10.0, |i| noise(i, 8192) - 4096, |i| noise(i, 8192) - 4096));
    assert_eq!(phase.kind, Kind::Other, "{}", phase.reason);
    // A tree in an empty room, and a head that fills its box.
    let tree = Guess::of(&body(40, 8.0, |i| 100 + noise(i, 100), |_| 0));
    assert_eq!((tree.kind, tree.preset), (Kind::Other, Preset::HotRamp), "{}", tree.reason);
    let head = Guess::of(&body(24, 10.0, |i| 100 + noise(i, 100), |i| noise(i, 5)));
    assert_eq!((head.kind, head.preset), (Kind::Mr, Preset::MrBrain), "{}", head.reason);
    // Hounsfield units of which nothing below 0 is left: said, with what mends it.
    let cut = body(24, 7.0, |i| 150 + noise(i, 1850), |_| 0);
    let guess = Guess::of(&cut);
    assert_eq!(guess.kind, Kind::HounsfieldCut, "{}", guess.reason);
    assert!(guess.advice.as_deref().is_some_and(|a| a.contains("volume.modality = \"ct\"")));
    assert!(Preset::CtBone.suits(&cut).expect_err("no air").contains("set volume.modality = \"ct\""));
    assert!(Preset::CtBone.suits(&cut.with_modality(Modality::Ct)).is_ok());
    // What the file says decides.
    assert_eq!(Guess::of(&plain.with_modality(Modality::Mr)).kind, Kind::Mr);
}
