#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]
use super::*;
use sha2::{Digest, Sha256};

fn digest(volume: &Volume) -> String {
    let mut voxels = volume.voxels().clone();
    if cfg!(target_endian = "big") {
        voxels.swap_bytes();
    }
    let hash = Sha256::digest(voxels.as_bytes_mut());
    hash.iter().take(8).map(|b| format!("{b:02x}")).collect()
}

#[test]
fn bytes_are_pinned() {
    let want: [(Phantom, usize, &str); 10] = [
        (Phantom::MarschnerLobb, 1, "8e215ece122cf70e"),
        (Phantom::MarschnerLobb, 17, "bad624c35cf5032b"),
        (Phantom::Hydrogen, 2, "66687aadf862bd77"),
        (Phantom::Hydrogen, 16, "77c78dfd5469edc2"),
        (Phantom::SheppLogan, 3, "64961c4f495380f7"),
        (Phantom::SheppLogan, 24, "c5a880f434554701"),
        (Phantom::DistanceField, 4, "5ce18edf508d1571"),
        (Phantom::DistanceField, 15, "7c00b07a68095f4c"),
        (Phantom::Cloud, 5, "993a28355652af3a"),
        (Phantom::Cloud, 20, "26de8e5ad4aa4792"),
    ];
    let got = want.map(|(p, n, _)| (p, n, digest(&p.volume(n).unwrap())));
    assert!(got.iter().zip(&want).all(|(g, w)| g.2 == w.2), "{got:#?}");
}

#[test]
fn names_lead_back() {
    for p in Phantom::ALL {
        assert_eq!(Phantom::from_name(p.name()), Some(p));
        assert_eq!(p.volume(2).unwrap().name(), p.name());
        assert!(!p.about().is_empty());
    }
    assert_eq!(Phantom::from_name("teapot"), None);
}

#[test]
fn sizes_are_checked_before_memory_is_taken() {
    assert!(matches!(Phantom::Cloud.volume(0), Err(Error::Invalid(_))));
    assert!(matches!(Phantom::Hydrogen.volume(usize::MAX), Err(Error::Limit { .. })));
    let limits = Limits { voxel_bytes: 4 * 27, ..Limits::default() };
    assert!(Phantom::Hydrogen.volume_as(3, VoxelType::F32, &limits).is_ok());
    let error = Phantom::Hydrogen.volume_as(3, VoxelType::F64, &limits).unwrap_err();
    assert_eq!(error.to_string(), "bytes of the hydrogen phantom at size 3: 216 is over the limit of 108");
}

#[test]
fn values_stay_in_range_and_reach_it() {
    for p in Phantom::ALL {
        let volume = p.volume_as(33, VoxelType::F64, &Limits::default()).unwrap();
        let (low, high) = p.range();
        let s = volume.statistics();
        assert!(s.min >= low && s.max <= high, "{p:?}: {} to {}", s.min, s.max);
        assert!(s.max - s.min > 0.85 * (high - low), "{p:?}: {} to {}", s.min, s.max);
    }
}

#[test]
fn every_type_keeps_the_values() {
    for p in Phantom::ALL {
        let exact = p.volume_as(9, VoxelType::F64, &Limits::default()).unwrap();
        let (low, high) = p.range();
        for kind in VoxelType::ALL {
            let volume = p.volume_as(9, kind, &Limits::default()).unwrap();
            assert_eq!(volume.voxels().voxel_type(), kind);
            let step = if is_float(kind) { 1e-7 } else { (high - low) / (kind.limits().1 - kind.limits().0) };
            for i in 0..9 * 9 * 9 {
                let at = [i % 9, i / 9 % 9, i / 81];
                let off = (volume.value(at) - exact.value(at)).abs();
                assert!(off <= 0.5 * step + 1e-15, "{p:?} {kind} {at:?}: {off}");
            }
        }
    }
}

#[test]
fn marschner_lobb_meets_its_formula() {
    let p = Phantom::MarschnerLobb;
    // At the centre: (1 + alpha (1 + cos 12 pi)) / 2.5 = 1.5 / 2.5.
    assert!((p.value([0.0; 3]) - 0.6).abs() < 1e-14);
    // At r = 1 the rings' cosine is cos(12 pi cos(pi/2)) = 1, at z = 1 the slope's sine is 1.
    assert!((p.value([1.0, 0.0, 1.0]) - 0.2).abs() < 1e-14);
    assert!((p.value([0.6, 0.8, -1.0]) - 1.0).abs() < 1e-14);
    let v = p.volume(41).unwrap();
    assert_eq!(v.value([20, 20, 20]), f64::from(0.6f32));
    for k in 0..41 {
        for (i, j) in [(0, 3), (7, 19), (40, 11)] {
            assert_eq!(v.value([i, j, k]), v.value([40 - i, j, k]));
            assert_eq!(v.value([i, j, k]), v.value([j, i, k]));
        }
    }
}

#[test]
fn hydrogen_has_its_nodes() {
    let p = Phantom::Hydrogen;
    assert_eq!(p.value([0.0; 3]), 0.0);
    // Peak on the axis, a node at rho = 6, and the cone where cos^2 theta = 1/3.
    assert!((p.value([0.0, 0.0, (6.0 - 2.0 * 3f64.sqrt()) / 18.0]) - 1.0).abs() < 1e-12);
    assert!(p.value([0.0, 0.0, 6.0 / 18.0]) < 1e-25);
    assert!(p.value([0.2, 0.2, 0.2]) < 1e-25);
    // On the equator psi is half of what it is on the axis.
    assert!((p.value([0.0, 0.5, 0.0]) * 4.0 - p.value([0.0, 0.0, 0.5])).abs() < 1e-14);
    assert!((0..100).all(|i| p.value([1.0, f64::from(i) / 50.0 - 1.0, 0.3]) < 0.003));
}

#[test]
fn shepp_logan_has_its_constants() {
    let v = Phantom::SheppLogan.volume_as(101, VoxelType::F64, &Limits::default()).unwrap();
    let at = |x: f64, y: f64, z: f64| v.value([x, y, z].map(|c| ((c + 1.0) * 50.0).round() as usize));
    for (point, want) in
        [((0.0, -0.7, 0.3), 0.2), ((0.68, 0.0, 0.0), 1.0), ((0.22, 0.0, 0.0), 0.0), ((-0.22, 0.0, 0.0), 0.0), ((0.0, 0.46, -0.2), 0.3)]
    {
        assert!((at(point.0, point.1, point.2) - want).abs() < 1e-12, "{point:?}: {}", at(point.0, point.1, point.2));
    }
    assert_eq!(at(0.9, 0.9, 0.9), 0.0);
    // The sum over the voxels is that of the ellipsoids' volumes, 4/3 pi a b c each.
    let third = 4.0 / 3.0 * std::f64::consts::PI;
    let skull_and_brain = third * (0.69 * 0.92 * 0.81 - 0.8 * 0.6624 * 0.874 * 0.78);
    let ventricles = -0.2 * third * (0.11 * 0.31 * 0.22 + 0.16 * 0.41 * 0.28);
    let want = skull_and_brain + ventricles + 0.1 * third * 0.21 * 0.25 * 0.41;
    let sum = v.statistics().mean * (101f64 / 50.0).powi(3);
    assert!((sum - want).abs() < 0.005 * want, "{sum} for {want}");
}

#[test]
fn the_rings_are_a_distance_field() {
    let p = Phantom::DistanceField;
    // On a ring's axis, on its surface, and at the centre of all three.
    assert!((p.value([0.8, 0.0, 0.0]) + rings::TUBE).abs() < 1e-15);
    assert!(p.value([0.8, 0.0, rings::TUBE]).abs() < 1e-15);
    assert!(p.value([0.8 + rings::TUBE, 0.05, 0.0]).abs() < 1e-15);
    assert!((p.value([0.0; 3]) - (0.42 - rings::TUBE)).abs() < 1e-15);
    let mut state = 1u64;
    let mut random = || {
        state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (state >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    };
    let h = 1e-6;
    let mut unit = 0;
    for _ in 0..2000 {
        let q: [f64; 3] = [random(), random(), random()];
        // The rings turn into each other.
        assert_eq!(p.value(q), p.value([q[1], q[2], q[0]]));
        // A distance never changes faster than the way it is measured along, and exactly so away from creases.
        let slope: f64 = (0..3)
            .map(|axis| {
                let moved = |by: f64| p.value(std::array::from_fn(|i| q[i] + if i == axis { by } else { 0.0 }));
                ((moved(h) - moved(-h)) / (2.0 * h)).powi(2)
            })
            .sum::<f64>()
            .sqrt();
        assert!(slope < 1.0 + 1e-6, "{q:?}: {slope}");
        unit += usize::from((slope - 1.0).abs() < 1e-6);
    }
    assert!(unit > 1980, "{unit}");
}

#[test]
fn the_cloud_is_soft_and_stays_inside() {
    let v = Phantom::Cloud.volume(64).unwrap();
    let mut steepest: f64 = 0.0;
    for i in 0..64usize.pow(3) {
        let at = [i % 64, i / 64 % 64, i / 4096];
        if at.iter().any(|&c| c == 0 || c == 63) {
            assert_eq!(v.value(at), 0.0, "{at:?}");
        } else {
            steepest = steepest.max((v.value(at) - v.value([at[0] - 1, at[1], at[2]])).abs());
        }
    }
    assert!(steepest < 0.4, "{steepest}");
    let filled = v.statistics().mean;
    assert!((0.05..0.4).contains(&filled), "{filled}");
}

#[test]
fn transfer_functions_are_valid_and_show_something() {
    for p in Phantom::ALL {
        let transfer = p.default_transfer(256);
        let (low, high) = p.range();
        assert!(transfer.opaque_within(low, high), "{p:?}");
        assert!(transfer.eval(low).alpha < 1.0, "{p:?}");
        assert_eq!(transfer.unit(), Some(2.0), "{p:?}");
        assert_eq!(p.default_transfer(0), p.default_transfer(1));
    }
}
