//! Any box, view and clip planes: slice polygons cover the pixels whose rays meet the plane inside, and no others.

use super::coverage::{Setup, check};
use super::random::Draw;
use glam::{DMat3, DVec3};
use slicestack::scene::{Camera, ClipPlane, Placement, Projection};
use slicestack::volume::{BoxConvention, Grid};

fn direction(draw: &mut Draw<'_>) -> DVec3 {
    let special = [0.0, 1.0, -1.0, f64::EPSILON, 1.0 + f64::EPSILON];
    let axis = draw.chance(0.3);
    DVec3::from_array([0; 3].map(|_| if axis { draw.one(&special) } else { draw.within(-1.0, 1.0) }))
}

fn setup(draw: &mut Draw<'_>) -> Option<Setup> {
    let nodes = draw.chance(0.5);
    let dims = [0; 3].map(|_| draw.one(&[1, 2, 3, 5, 9, 20, 39]).max(if nodes { 2 } else { 1 }));
    let lengths = [0; 3].map(|_| draw.one(&[1.0, -1.0]) * 10f64.powf(draw.within(-1.0, 0.7)));
    let shear = if draw.chance(0.4) { [draw.within(-0.5, 0.5), draw.within(-0.5, 0.5)] } else { [0.0; 2] };
    let turn = DMat3::from_cols(DVec3::X, DVec3::new(shear[0], 1.0, 0.0), DVec3::new(shear[1], shear[0], 1.0));
    let origin = DVec3::from_array([0; 3].map(|_| draw.within(-50.0, 50.0)));
    let grid = Grid::new(dims, origin, turn * DMat3::from_diagonal(DVec3::from_array(lengths))).ok()?;
    let grid = grid.with_convention(if nodes { BoxConvention::Nodes } else { BoxConvention::Cells });
    let towards = direction(draw);
    if towards.length() < 0.2 {
        return None;
    }
    let (center, radius) = (grid.center(), grid.radius());
    let target = if draw.chance(0.5) { center } else { center + DVec3::new(0.3, -0.2, 0.1) * radius };
    let eye = target + towards * radius * draw.within(1e-3, 3.0);
    let up = if towards.normalize().z.abs() < 0.9 { DVec3::Z } else { DVec3::Y };
    let projection = if draw.chance(0.5) {
        Projection::Perspective { fov_y: draw.within(15.0, 110.0) }
    } else {
        Projection::Orthographic { height: Some(2.0 * radius / draw.within(0.3, 3.0)) }
    };
    let camera = Camera::new(Placement::LookAt { eye, target, up }, projection).ok()?;
    let (width, height) = (1 + draw.below(24) as u32, 1 + draw.below(24) as u32);
    let view = camera.resolve(&grid, width, height).ok()?;
    let planes = (0..draw.below(7))
        .filter_map(|_| {
            let normal = direction(draw);
            ClipPlane::new(normal, normal.dot(center) + draw.within(-0.8, 0.8) * radius * normal.length()).ok()
        })
        .collect();
    Some(Setup { grid, view, planes, count: 1 + draw.below(16) as u64 })
}

pub fn run(bytes: &[u8]) {
    if let Some(setup) = setup(&mut Draw::of_bytes(bytes)) {
        check(&setup);
    }
}
