//! Fog: every mode, distance and weighting, and the values at their ends.

use super::oracle::{Oracle, slab};
use super::{PARALLEL, WIDE, constant, difference, field, orbit, render, simple};
use slicestack::scene::{Fog, FogDistance, FogMode, FogWeighting, Order, Slicing, Straight};
use slicestack::{Scene, Volume};

fn scenes(volume: &Volume) -> Vec<Scene> {
    [orbit(35.0, 15.0, 1.2, PARALLEL), orbit(-100.0, 40.0, 1.2, WIDE)]
        .map(|camera| {
            let scene = Scene::new(simple(0.0, 1.0)).with_camera(camera).with_size(19, 17).unwrap();
            let scene = scene.with_slices(Slicing::Count(25)).unwrap().with_terminate(0.0).unwrap();
            let unit = slab(volume, &scene);
            scene.with_opacity_unit(unit).unwrap()
        })
        .to_vec()
}

/// Depth range of a scene's slices.
fn depths(volume: &Volume, scene: &Scene) -> (f64, f64) {
    let stack = Oracle::new(volume, scene).stack;
    (stack.near, stack.far)
}

#[test]
fn every_kind_of_fog_is_its_formula() {
    let volume = field([10, 11, 9]);
    let mut kinds = 0;
    for scene in scenes(&volume) {
        let (near, far) = depths(&volume, &scene);
        let at = |t: f64| near + (far - near) * t;
        for mode in [
            FogMode::Linear { start: at(0.1), end: at(0.8) },
            FogMode::Linear { start: at(0.8), end: at(0.1) },
            FogMode::Linear { start: -1e30, end: 1e30 },
            FogMode::Linear { start: at(0.512), end: at(0.512) },
            FogMode::Exp { density: 1.3 / far },
            FogMode::Exp2 { density: 1.1 / far },
        ] {
            for distance in [FogDistance::Planar, FogDistance::Radial] {
                for weighting in [FogWeighting::Alpha, FogWeighting::Literal] {
                    let fog = Fog::new(mode, [0.3, 0.9, 0.6]).unwrap().with_distance(distance).with_weighting(weighting);
                    let foggy = scene.clone().with_fog(Some(fog));
                    let (picture, _) = render(&volume, &foggy);
                    let step = matches!(mode, FogMode::Linear { start, end } if start == end);
                    let want = Oracle::new(&volume, &foggy).picture();
                    if step && distance == FogDistance::Radial {
                        // A fragment within rounding of the step may fall on either side: few do.
                        let off = picture.pixels().iter().zip(&want).filter(|(a, b)| (0..4).any(|c| (f64::from(a[c]) - b[c]).abs() > 2e-5));
                        assert!(off.count() <= 2);
                    } else {
                        let e = difference(&picture, &want);
                        assert!(e < 2e-5, "{fog:?}: {e}");
                    }
                    kinds += 1;
                }
            }
        }
    }
    assert_eq!(kinds, 48);
}

#[test]
fn no_density_is_no_fog_and_a_huge_one_nothing_else() {
    let volume = field([8, 8, 8]);
    for scene in scenes(&volume) {
        let (clear, _) = render(&volume, &scene);
        for distance in [FogDistance::Planar, FogDistance::Radial] {
            let with = |mode, scene: &Scene| {
                let fog = Fog::new(mode, [1.0, 0.5, 0.25]).unwrap().with_distance(distance);
                render(&volume, &scene.clone().with_fog(Some(fog))).0
            };
            for mode in [FogMode::Exp { density: 0.0 }, FogMode::Exp2 { density: 0.0 }, FogMode::Linear { start: 1e30, end: 1e30 }] {
                assert_eq!(with(mode, &scene).sha256(), clear.sha256(), "{mode:?} {distance:?}");
            }
            for mode in [FogMode::Exp { density: 1e30 }, FogMode::Exp2 { density: 1e30 }, FogMode::Linear { start: -2.0, end: -2.0 }] {
                for (a, b) in with(mode, &scene).pixels().iter().zip(clear.pixels()) {
                    assert_eq!(a[3], b[3], "alpha is never fogged");
                    for (c, fog) in [1.0, 0.5, 0.25].into_iter().enumerate() {
                        assert!((a[c] - fog * b[3]).abs() < 2e-6, "{mode:?} {distance:?}: {a:?}");
                    }
                }
            }
        }
    }
}

#[test]
fn literal_fog_lights_up_empty_slices_and_weighted_fog_does_not() {
    let volume = field([8, 8, 8]);
    for scene in scenes(&volume) {
        let empty = scene.with_transfer(constant([1.0; 3], 0.0));
        let fog = Fog::new(FogMode::Exp { density: 0.05 }, [0.5; 3]).unwrap();
        let (weighted, stats) = render(&volume, &empty.clone().with_fog(Some(fog)));
        assert!(weighted.pixels().iter().all(|p| *p == [0.0; 4]));
        assert_eq!(stats.fetches, 0, "nothing shows, nothing is looked up");
        let (literal, stats) = render(&volume, &empty.with_fog(Some(fog.with_weighting(FogWeighting::Literal))));
        assert!(stats.fetches > 0);
        let lit = literal.pixels().iter().filter(|p| p[0] > 0.1 && p[3] == 0.0).count();
        assert!(lit > 50, "{lit} pixels");
    }
}

#[test]
fn weighted_fog_is_what_opengl_does_to_straight_colours() {
    let volume = field([10, 10, 10]);
    for scene in scenes(&volume) {
        let (_, far) = depths(&volume, &scene);
        let fog = Fog::new(FogMode::Exp { density: 1.0 / far }, [0.2, 0.4, 0.9]).unwrap();
        let scene = scene.with_fog(Some(fog)).with_order(Order::BackToFront);
        let (picture, _) = render(&volume, &scene);
        let oracle = Oracle::new(&volume, &scene);
        for y in 0..17 {
            for x in 0..19 {
                // glBlendFunc(SRC_ALPHA, ONE_MINUS_SRC_ALPHA), farthest first, fog on the straight colour.
                let mut rgb = [0.0; 3];
                for fragment in oracle.fragments(x, y).iter().rev() {
                    let color = oracle.classified(fragment);
                    let f = fog.factor(fragment.depth);
                    rgb = std::array::from_fn(|c| {
                        let source = f * color.rgb[c] + (1.0 - f) * fog.color()[c];
                        color.alpha * source + (1.0 - color.alpha) * rgb[c]
                    });
                }
                let got = picture.pixel(x, y);
                assert!((0..3).all(|c| (f64::from(got[c]) - rgb[c]).abs() < 1e-5), "({x},{y}): {got:?} not {rgb:?}");
            }
        }
    }
}

#[test]
fn the_background_is_fogged_where_asked_for_only() {
    let volume = field([6, 6, 6]);
    let back = Straight { rgb: [1.0, 0.0, 0.0], alpha: 1.0 };
    let fog = Fog::new(FogMode::Exp { density: 0.01 }, [0.0, 0.0, 1.0]).unwrap();
    let scene = scenes(&volume)[0].clone().with_transfer(constant([0.0; 3], 0.0)).with_background(back).unwrap().with_fog(Some(fog));
    assert!(render(&volume, &scene).0.pixels().iter().all(|p| *p == [1.0, 0.0, 0.0, 1.0]));
    let fogged = scene.with_fogged_background(true);
    assert!(render(&volume, &fogged).0.pixels().iter().all(|p| *p == [0.0, 0.0, 1.0, 1.0]));
}
