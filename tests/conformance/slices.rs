//! The slices as a GL program cuts them: its own camera, its own planes, its own polygons.

use glam::{DMat4, DVec2, DVec3, DVec4};
use slicestack::scene::{Placement, Projection};
use slicestack::volume::BoxConvention;
use slicestack::{Scene, Volume};

/// A camera as matrices.
pub(crate) struct Eye {
    pub(crate) modelview: DMat4,
    /// Half the width and height of the view: at the eye's distance 1 in perspective.
    pub(crate) half: DVec2,
    pub(crate) perspective: bool,
    size: DVec2,
}

impl Eye {
    pub(crate) fn new(scene: &Scene) -> Self {
        let Placement::LookAt { eye, target, up } = scene.camera().placement() else { panic!("these scenes look at a point") };
        // gluLookAt.
        let f = (target - eye).normalize();
        let s = f.cross(up).normalize();
        let u = s.cross(f);
        let modelview = DMat4::from_cols(
            DVec4::new(s.x, u.x, -f.x, 0.0),
            DVec4::new(s.y, u.y, -f.y, 0.0),
            DVec4::new(s.z, u.z, -f.z, 0.0),
            DVec4::new(-s.dot(eye), -u.dot(eye), f.dot(eye), 1.0),
        );
        let (w, h) = scene.size();
        let size = DVec2::new(f64::from(w), f64::from(h));
        let (half_height, perspective) = match scene.camera().projection() {
            Projection::Orthographic { height } => (0.5 * height.expect("these scenes say how high the view is"), false),
            Projection::Perspective { fov_y } => ((0.5 * fov_y.to_radians()).tan(), true),
            other => panic!("OpenGL has no projection {other:?}"),
        };
        Self { modelview, half: DVec2::new(half_height * size.x / size.y, half_height), perspective, size }
    }

    /// Window position of a point in eye space, y downwards.
    pub(crate) fn window(&self, p: DVec3) -> DVec2 {
        let p2 = p.truncate() / if self.perspective { -p.z } else { 1.0 } / self.half;
        DVec2::new((p2.x + 1.0) * 0.5, (1.0 - p2.y) * 0.5) * self.size
    }
}

impl Eye {
    /// The point in eye space at depth `d` behind window position (x,y).
    pub(crate) fn unproject(&self, x: f64, y: f64, d: f64) -> DVec3 {
        let p = DVec2::new(2.0 * x / self.size.x - 1.0, 1.0 - 2.0 * y / self.size.y) * self.half * if self.perspective { d } else { 1.0 };
        p.extend(-d)
    }
}

/// A corner of a slice.
#[derive(Clone, Copy)]
pub(crate) struct Corner {
    pub(crate) world: DVec3,
    pub(crate) eye: DVec3,
    pub(crate) texture: DVec3,
}

impl Corner {
    pub(crate) fn mean(corners: &[Self]) -> Self {
        let n = corners.len() as f64;
        let mean = |of: fn(&Self) -> DVec3| corners.iter().map(of).sum::<DVec3>() / n;
        Self { world: mean(|c| c.world), eye: mean(|c| c.eye), texture: mean(|c| c.texture) }
    }
}

/// Depths of the planes from the nearest on, their distance, and the box's depths.
pub(crate) struct Planes {
    pub(crate) depths: Vec<f64>,
    pub(crate) spacing: f64,
    pub(crate) near: f64,
    pub(crate) far: f64,
}

fn corners(volume: &Volume, eye: &Eye) -> [Corner; 8] {
    let n = DVec3::from_array(volume.grid().dims().map(|n| n as f64));
    std::array::from_fn(|c| {
        let bits = DVec3::from_array([0, 1, 2].map(|axis| f64::from(c as u32 >> axis & 1)));
        let texture = match volume.grid().convention() {
            BoxConvention::Cells => bits,
            BoxConvention::Nodes => (bits * (n - 1.0) + 0.5) / n,
        };
        let world = volume.grid().index_to_world().transform_point3(texture * n - 0.5);
        Corner { world, eye: eye.modelview.transform_point3(world), texture }
    })
}

pub(crate) fn planes(volume: &Volume, eye: &Eye, count: usize) -> Planes {
    let depths = corners(volume, eye).map(|c| -c.eye.z);
    let (near, far) = (depths.iter().copied().fold(f64::MAX, f64::min), depths.iter().copied().fold(f64::MIN, f64::max));
    let spacing = (far - near) / count as f64;
    Planes { depths: (0..count).map(|k| near + (k as f64 + 0.5) * spacing).collect(), spacing, near, far }
}

/// The corners of the cut at depth `d`, around it.
pub(crate) fn cut(volume: &Volume, eye: &Eye, d: f64) -> Vec<Corner> {
    let c = corners(volume, eye);
    let mut found = Vec::new();
    for a in 0..8usize {
        for axis in 0..3 {
            let b = a | 1 << axis;
            if b == a {
                continue;
            }
            let (za, zb) = (-c[a].eye.z - d, -c[b].eye.z - d);
            if (za < 0.0) != (zb < 0.0) {
                let t = za / (za - zb);
                let mix = |of: fn(&Corner) -> DVec3| of(&c[a]) + (of(&c[b]) - of(&c[a])) * t;
                found.push(Corner { world: mix(|c| c.world), eye: mix(|c| c.eye), texture: mix(|c| c.texture) });
            }
        }
    }
    if found.len() < 3 {
        return Vec::new();
    }
    let center = Corner::mean(&found).eye;
    let angle = |c: &Corner| (c.eye.y - center.y).atan2(c.eye.x - center.x);
    found.sort_by(|a, b| angle(a).total_cmp(&angle(b)));
    found
}
