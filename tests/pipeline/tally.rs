//! The numbers that a picture tells of its work add up, and none of them is what the others leave by definition alone.

use super::{PARALLEL, WIDE, fill, oblique, orbit, render, simple};
use slicestack::scene::{
    Blend, Classification, ClipPlane, Ends, Fog, FogMode, FogWeighting, Lighting, Method, Order, Slicing, TransferFunction,
};
use slicestack::{RenderStats, Scene, Volume};

fn adds_up(stats: &RenderStats, case: &str) {
    let t = &stats.tally;
    assert_eq!(t.fragments, stats.fragments, "{case}");
    assert_eq!(t.fragments + t.corners, t.looked_up + t.empty + t.finished + t.merged, "{case}: {t:?}");
    assert_eq!(stats.fetches, t.looked_up + t.beside + t.between, "{case}: {t:?}");
    assert!(t.whole_batches <= t.batches && t.missed_blocks <= t.blocks && t.beside < 64 * t.batches.max(1), "{case}: {t:?}");
    assert!(t.empty == 0 || t.empty_batches > 0, "{case}: {t:?}");
    assert!(t.finished == 0 || t.finished_batches > 0, "{case}: {t:?}");
    for left in &stats.left_out {
        assert!(left.saved.is_none_or(|s| s.count <= s.of && s.of > 0), "{case}: {left:?}");
    }
}

#[test]
fn fragments_and_lookups_add_up() {
    let dims = [40, 33, 28];
    let half = Volume::new(oblique(dims), fill::<u8>(dims, &|[x, y, z]| if x + 0.2 * y > 0.1 { 150.0 + 50.0 * z } else { 0.0 })).unwrap();
    let step = TransferFunction::new(vec![(100.0, [1.0, 0.5, 0.1])], vec![(60.0, 0.0), (60.0, 0.3)]).unwrap();
    let by = |classification| Method::default().with_classification(classification);
    let merged = Method::default().with_merge(true);
    let methods = [merged, by(Classification::Post), by(Classification::SecondOrder), Method::default().with_ends(Ends::Whole)];
    let literal = Fog::new(FogMode::Exp { density: 0.0 }, [1.0; 3]).unwrap().with_weighting(FogWeighting::Literal);
    let (mut finished, mut empty, mut corners) = (0, 0, 0);
    for camera in
        [orbit(30.0, 20.0, 1.3, PARALLEL), orbit(0.0, 0.0, 1.0, PARALLEL), orbit(200.0, -30.0, 0.1, WIDE), orbit(45.0, 60.0, 0.9, WIDE)]
    {
        for (order, blend) in [(Order::FrontToBack, Blend::Over), (Order::BackToFront, Blend::Over), (Order::FrontToBack, Blend::Add)] {
            for method in methods {
                let cut = vec![ClipPlane::new(glam::DVec3::new(0.3, -0.5, 1.0), 2.0).unwrap()];
                for planes in if blend == Blend::Add { vec![cut] } else { vec![vec![]] } {
                    let case = format!("{camera:?} {order:?} {blend:?} {method:?} {planes:?}");
                    let scene = Scene::new(step.clone()).with_camera(camera).with_size(45, 38).unwrap().with_order(order);
                    let scene = scene.with_slices(Slicing::Count(60)).unwrap().with_blend(blend).unwrap();
                    let scene = scene.with_method(method).unwrap().with_clip_planes(planes).unwrap();
                    let (_, stats) = render(&half, &scene);
                    adds_up(&stats, &case);
                    (finished, empty, corners) =
                        (finished + stats.tally.finished, empty + stats.tally.empty, corners + stats.tally.corners);
                    // Literal fog passes nothing over as empty: finished fragments, counted by themselves, must be all the rest.
                    let (_, stats) = render(&half, &scene.clone().with_fog(Some(literal)));
                    adds_up(&stats, &case);
                    assert_eq!((stats.tally.empty, stats.tally.empty_batches), (0, 0), "{case}");
                    // And without an end nothing is passed over at all.
                    let (_, stats) = render(&half, &scene.with_fog(Some(literal)).with_terminate(0.0).unwrap());
                    adds_up(&stats, &case);
                    assert_eq!((stats.tally.finished, stats.tally.looked_up), (0, stats.fragments + stats.tally.corners), "{case}");
                }
            }
        }
    }
    assert!(finished > 0 && empty > 0 && corners > 0, "{finished} finished, {empty} empty, {corners} corners: a case is missing");
}

#[test]
fn pictures_of_several_frames_add_theirs() {
    let dims = [20, 20, 20];
    let volume = Volume::new(oblique(dims), fill::<u8>(dims, &|[x, y, z]| 100.0 + 50.0 * (x * y + z))).unwrap();
    let scene = Scene::new(simple(0.0, 200.0)).with_size(32, 32).unwrap().with_slices(Slicing::Tolerance(1e-3)).unwrap();
    let (_, stats) = render(&volume, &scene);
    adds_up(&stats, "tolerance");
    assert!(stats.tally.frames >= 2, "{:?}", stats.tally);
}

/// Gradient and light count as savings only where they could have run, and only for what would have had them: fragments in rows that show.
#[test]
fn stages_count_as_saved_only_where_they_could_have_run() {
    let dims = [24, 20, 22];
    // Values rise along x alone, and only the upper half of them shows.
    let volume = Volume::new(oblique(dims), fill::<u8>(dims, &|[x, _, _]| 100.0 + 90.0 * x)).unwrap();
    let half = TransferFunction::new(vec![(0.0, [1.0, 0.5, 0.1])], vec![(150.0, 0.0), (190.0, 0.4)]).unwrap();
    let scene = || {
        let scene = Scene::new(half.clone()).with_camera(orbit(10.0, 20.0, 1.3, PARALLEL)).with_size(40, 40).unwrap();
        scene.with_slices(Slicing::Count(48)).unwrap()
    };
    let method = |method: Method| scene().with_method(method).unwrap();
    let saved = |scene: &Scene, what: &str| {
        let (_, stats) = render(&volume, scene);
        let left = stats.left_out.iter().find(|l| l.what == what).unwrap_or_else(|| panic!("{what} is not told of"));
        (left.saved, stats)
    };
    let (light, stats) = saved(&scene(), "light");
    let (light, shown) = (light.unwrap(), stats.tally.lanes - stats.tally.hidden);
    assert!(stats.tally.hidden > 0, "a row without anything is missing: {:?}", stats.tally);
    assert_eq!((light.count, light.of), (shown, shown));
    let gradient = saved(&scene(), "gradient").0.unwrap();
    assert_eq!((gradient.count, gradient.of), (6 * shown, 6 * shown + stats.tally.lanes));
    // With light as many gradients are taken at most: nothing is told that would not have been done.
    let lit = scene().with_lighting(Some(Lighting::default())).unwrap();
    let taken = render(&volume, &lit).1.tally.gradients;
    assert!(taken > 0 && taken <= shown, "{taken} of {shown}");
    // Each of these scenes is refused with light, or would not run it.
    let projected = |blend| scene().with_blend(blend).unwrap();
    let levels = projected(Blend::Iso { level: 160.0 });
    for (name, scene) in [
        ("mip", projected(Blend::Mip)),
        ("average", projected(Blend::Average)),
        ("iso", levels),
        ("merge", method(Method::default().with_merge(true))),
    ] {
        for what in ["light", "gradient", "gradient opacity", "classify by gradient"] {
            assert_eq!(saved(&scene, what).0, None, "{name}: {what}");
        }
        assert!(name == "iso" || scene.clone().with_lighting(Some(Lighting::default())).is_err(), "{name} can be lit");
    }
    // Slabs between two values are lit, but have no gradient opacity.
    let pairs = method(Method::default().with_classification(Classification::PreIntegrated));
    assert!(saved(&pairs, "light").0.is_some() && saved(&pairs, "gradient opacity").0.is_none());
}
