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
        assert_eq!(t.eval(-1000.0).alpha, 0.0, "{}: air", p.name());
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
    assert!(why(Preset::CtBone, &mr()).contains("run from 0 to 219"));
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
