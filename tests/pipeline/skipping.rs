//! Passing over empty space changes no bit.
//!
//! Literal fog needs every slice, empty or not, so nothing is passed over with it. At density 0 its factor is exactly 1 and the
//! colour times 1 plus 0 is the colour: the same picture, made without skipping.

use super::{PARALLEL, WIDE, fill, oblique, orbit, render, simple};
use slicestack::scene::{Blend, Classification, Filter, Fog, FogMode, FogWeighting, Method, Order, SampleAt, Slicing, TransferFunction};
use slicestack::volume::phantom::Phantom;
use slicestack::{Scene, Volume};

#[test]
fn skipping_changes_no_bit() {
    let dims = [70, 40, 61];
    // Small bright bodies in the dark, some of them thinner than a voxel.
    let bodies =
        |[x, y, z]: [f64; 3]| if (4.0 * x).sin() * (3.0 * y).cos() * (4.0 * z).sin() > 0.8 { 200.0 } else { 20.0 * (x * y * z).abs() };
    let volumes = [
        Volume::new(oblique(dims), fill::<u8>(dims, &bodies)).unwrap(),
        Volume::new(oblique(dims), fill::<f32>(dims, &|p| -bodies(p))).unwrap().with_rescale(-1.0, 0.0).unwrap(),
        Phantom::SheppLogan.volume(64).unwrap().with_rescale(200.0, 0.0).unwrap(),
    ];
    let spike = TransferFunction::new(vec![(0.0, [1.0; 3])], vec![(99.9, 0.0), (100.0, 0.9), (100.1, 0.0)]).unwrap();
    let step = TransferFunction::new(vec![(100.0, [1.0, 0.5, 0.1])], vec![(60.0, 0.0), (60.0, 0.3)]).unwrap();
    let by = |classification| Method::default().with_classification(classification);
    let methods = [
        by(Classification::Post),
        by(Classification::PreIntegrated),
        by(Classification::SecondOrder),
        by(Classification::Pre),
        Method::default().with_sample(SampleAt::End),
        by(Classification::SecondOrder).with_filter(Filter::Nearest),
        Method::default().with_filter(Filter::CUBIC),
        by(Classification::PreIntegrated).with_filter(Filter::Cubic { prefilter: false }),
    ];
    let mut saved = 0;
    for volume in &volumes {
        for transfer in [simple(0.0, 200.0), spike.clone(), step.clone()] {
            for (camera, order, blend) in [
                (orbit(30.0, 20.0, 1.3, PARALLEL), Order::FrontToBack, Blend::Over),
                (orbit(-10.0, 60.0, 1.0, WIDE), Order::BackToFront, Blend::Over),
                (orbit(90.0, 0.0, 2.0, PARALLEL), Order::FrontToBack, Blend::Add),
                (orbit(200.0, -30.0, 0.1, WIDE), Order::FrontToBack, Blend::Over),
            ] {
                let scene = Scene::new(transfer.clone()).with_camera(camera).with_size(91, 77).unwrap().with_order(order);
                let scene = scene.with_slices(Slicing::Count(90)).unwrap().with_blend(blend).unwrap();
                for method in methods {
                    let scene = scene.clone().with_method(method).unwrap();
                    let fog = Fog::new(FogMode::Exp { density: 0.0 }, [1.0; 3]).unwrap().with_weighting(FogWeighting::Literal);
                    let (skipped, few) = render(volume, &scene);
                    let (whole, many) = render(volume, &scene.with_fog(Some(fog)));
                    assert_eq!(skipped.sha256(), whole.sha256(), "{camera:?} {order:?} {blend:?} {method:?}");
                    assert_eq!(few.fragments, many.fragments);
                    assert!(few.fetches <= many.fetches);
                    saved += usize::from(few.fetches * 2 < many.fetches);
                }
            }
        }
    }
    assert!(saved >= 40, "skipping saved half the lookups in {saved} scenes only");
}
