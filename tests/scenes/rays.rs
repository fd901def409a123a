//! Scenes whose rays have samples of their own, or end at opaque planes.

use super::*;
use slicestack::scene::{Algorithm, ColorMap, CutPlane};

const WIDER: Projection = Projection::Perspective { fov_y: 100.0 };

fn shells(scene: Scene) -> Scene {
    scene.with_algorithm(Algorithm::Shells).unwrap()
}

fn jittered(scene: Scene, seed: u32) -> Scene {
    scene.with_jitter(Some(seed)).unwrap()
}

fn cut(volume: &Volume, normal: DVec3, at: f64, colors: ColorMap) -> CutPlane {
    let n = normal.normalize();
    CutPlane::new(n, n.dot(volume.grid().center()) + at * volume.grid().radius()).unwrap().with_colors(colors)
}

fn light(scene: Scene) -> Scene {
    let light = Light::new(LightSource::Direction(DVec3::new(0.4, -1.0, 0.8)), [1.0, 0.95, 0.8]).unwrap();
    scene.with_lighting(Some(Lighting::default().with_lights(vec![light]).unwrap())).unwrap()
}

/// All of them.
pub(super) fn rays(list: &mut Vec<Sample>) {
    let mut add = |name, volume: Volume, scene: Scene| list.push(Sample { name, volume, scene });
    let few = |projection| looked(scene((48, 40), 14), 30.0, 20.0, 0.0, 1.1, projection);
    let fog = |s, distance| foggy(s, FogMode::Exp { density: 0.03 }, distance, FogWeighting::Alpha);
    let v = head();
    add("shells", head(), shells(few(WIDER)));
    add("shells-lit", head(), light(shells(few(WIDER))));
    add("shells-fog", head(), fog(shells(few(WIDER)), FogDistance::Radial));
    add("shells-fog-planar", head(), fog(shells(few(WIDER)), FogDistance::Planar).with_order(Order::BackToFront));
    add("shells-inside", cloud(32, VoxelType::U8), {
        let c = cloud(32, VoxelType::U8);
        let projection = Projection::Perspective { fov_y: 120.0 };
        shells(from(&c, scene((48, 40), 24), DVec3::new(-0.05, -0.3, 0.0), DVec3::new(0.3, 1.0, 0.1), projection)).with_transfer(soft())
    });
    add("shells-clip-average", head(), {
        let planes = vec![plane(&v, DVec3::new(0.2, 1.0, 0.3), 0.0)];
        shells(few(WIDER).with_clip_planes(planes).unwrap()).with_blend(Blend::Average).unwrap().with_transfer(strong())
    });
    add("shells-jitter-cubic", cloud(20, VoxelType::U16), {
        let method = Method::default().with_filter(Filter::CUBIC);
        jittered(shells(few(WIDER)).with_method(method).unwrap().with_transfer(soft()), 9)
    });
    add("jitter", head(), jittered(few(PARALLEL), 1));
    add("jitter-lit-fog", on_oblique_grid(head()), jittered(light(fog(few(WIDE), FogDistance::Radial)), 2));
    add("jitter-nearest-whole-ends", cloud(20, VoxelType::I32), {
        let method = Method::default().with_filter(Filter::Nearest).with_ends(Ends::Whole);
        jittered(few(WIDE).with_method(method).unwrap().with_transfer(soft()), 3)
    });
    add("jitter-mip", cloud(20, VoxelType::F64), jittered(few(PARALLEL), 4).with_blend(Blend::Mip).unwrap().with_transfer(strong()));
    let three = |v: &Volume| {
        let plane = |normal, at, colors| cut(v, normal, at, colors);
        vec![
            plane(DVec3::X, 0.05, ColorMap::Gray),
            plane(DVec3::Y, 0.1, ColorMap::Viridis).with_window(0.3, 0.5).unwrap(),
            plane(DVec3::new(0.1, 0.0, 1.0), 0.0, ColorMap::Coolwarm),
        ]
    };
    let one = |v: &Volume| vec![cut(v, DVec3::new(1.0, -1.0, 0.2), 0.0, ColorMap::Bone)];
    let many = |projection| looked(scene((48, 40), 50), 30.0, 20.0, 0.0, 1.2, projection);
    add("cut-one", head(), many(PARALLEL).with_cuts(one(&v)).unwrap());
    add("cut-three", head(), light(many(WIDE)).with_cuts(three(&v)).unwrap());
    add("cut-fog", head(), fog(many(WIDE), FogDistance::Planar).with_cuts(three(&v)).unwrap());
    add("cut-fog-back-to-front", head(), {
        let scene = fog(many(PARALLEL), FogDistance::Radial).with_order(Order::BackToFront).with_linear_light(true).unwrap();
        scene.with_cuts(three(&v)).unwrap()
    });
    add("cut-clip-shells-jitter", head(), {
        let planes = vec![plane(&v, DVec3::new(-1.0, -0.4, 0.3), 0.1)];
        jittered(shells(few(WIDER)), 5).with_clip_planes(planes).unwrap().with_cuts(three(&v)).unwrap()
    });
}
