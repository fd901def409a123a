use super::*;
use crate::volume::Grid;

fn transfer() -> TransferFunction {
    TransferFunction::new(vec![(0.0, [1.0; 3])], vec![(0.0, 0.0), (1.0, 0.5)]).expect("transfer function")
}

#[test]
fn opacities_are_per_voxel_unless_a_length_is_given() {
    let grid = Grid::with_spacing([4, 5, 6], [2.0, 0.5, 3.0]).expect("grid");
    assert_eq!((transfer().unit(), transfer().opacity_length(&grid)), (None, 0.5));
    let given = transfer().with_unit(4.0).expect("length");
    assert_eq!((given.unit(), given.opacity_length(&grid)), (Some(4.0), 4.0));
    for length in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        let line = transfer().with_unit(length).expect_err("accepted").to_string();
        assert_eq!(line, format!("transfer opacity_unit {length}: must be positive and finite"));
    }
}

#[test]
fn a_scene_has_the_length_of_its_transfer_function() {
    let scene = Scene::new(transfer().with_unit(4.0).expect("length"));
    assert_eq!(scene.transfer().unit(), Some(4.0));
    let scene = scene.with_opacity_unit(2.0).expect("length");
    assert_eq!(scene.transfer(), &transfer().with_unit(2.0).expect("length"));
    // Another function brings its own.
    assert_eq!(scene.with_transfer(transfer()).transfer().unit(), None);
    assert!(Scene::new(transfer()).with_opacity_unit(0.0).is_err());
}

#[test]
fn only_over_without_pre_integration_is_blended_in_the_order_asked_for() {
    let back = Scene::new(transfer()).with_order(Order::BackToFront);
    assert_eq!(Scene::new(transfer()).blending_order(), Order::FrontToBack);
    assert_eq!(back.blending_order(), Order::BackToFront);
    for blend in [
        Blend::Mip,
        Blend::Min,
        Blend::Average,
        Blend::AttenuatedMip { attenuation: 1.0 },
        Blend::Add,
        Blend::Lmip { threshold: 0.5 },
        Blend::Iso { level: 0.5 },
    ] {
        let scene = back.clone().with_blend(blend).expect("blend");
        assert_eq!((scene.order(), scene.blending_order()), (Order::BackToFront, Order::FrontToBack), "{blend:?}");
    }
    for (classification, order) in [
        (Classification::Post, Order::BackToFront),
        (Classification::Pre, Order::BackToFront),
        (Classification::PreIntegrated, Order::FrontToBack),
        (Classification::SecondOrder, Order::FrontToBack),
    ] {
        let scene = back.clone().with_method(Method::default().with_classification(classification)).expect("method");
        assert_eq!(scene.blending_order(), order, "{classification:?}");
    }
}
