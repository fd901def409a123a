//! Light at recorded fragments, worked out a second time: in f64, from the gradient of the volume's own values, the camera and the lights.
//!
//! Of the record only the colour before the stage is taken, so that the colour behind it can be compared.

use super::gradient::{GradientAt, ray_at, sample_depth};
use super::record::Context;
use crate::proxy::Stack;
use crate::scene::{LightSource, Lighting, Shading};
use glam::DVec3;
use serde::Serialize;

/// A light of the scene.
#[derive(Debug, Clone, PartialEq, Serialize)]
struct LampRecord {
    source: &'static str,
    /// Direction towards it, or its position; none at the eye.
    #[serde(skip_serializing_if = "Option::is_none")]
    vector: Option<[f64; 3]>,
    color: [f64; 3],
}

/// The light of a scene.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(super) struct LightRecord {
    model: &'static str,
    ambient: f64,
    diffuse: f64,
    specular: f64,
    shininess: f64,
    emission: f64,
    two_sided: bool,
    floor: f64,
    lights: Vec<LampRecord>,
    /// Towards the eye, where rays are parallel.
    #[serde(skip_serializing_if = "Option::is_none")]
    to_eye: Option<[f64; 3]>,
    /// Depths at which the box begins and ends.
    depths: [f64; 2],
}

/// Depths at which the box begins and ends, whatever part of it the slices fill.
fn box_depths(context: Context<'_>, stack: &Stack) -> [f64; 2] {
    Stack::depth_range(context.volume.grid(), &stack.view).map_or([stack.near, stack.far], |(near, far)| [near, far])
}

impl LightRecord {
    pub(super) fn new(light: &Lighting, context: Context<'_>, stack: &Stack) -> Self {
        let lamp = |light: &crate::scene::Light| {
            let (source, vector) = match light.source() {
                LightSource::Head => ("head", None),
                LightSource::Direction(d) => ("direction", Some(d.to_array())),
                LightSource::Position(p) => ("position", Some(p.to_array())),
            };
            LampRecord { source, vector, color: light.color() }
        };
        Self {
            model: if light.shading == Shading::Depth { "depth" } else { "blinn-phong" },
            ambient: light.ambient,
            diffuse: light.diffuse,
            specular: light.specular,
            shininess: light.shininess,
            emission: light.emission,
            two_sided: light.two_sided,
            floor: light.gradient_floor,
            lights: light.lights().iter().map(lamp).collect(),
            to_eye: (!stack.perspective).then(|| (-stack.view.forward).to_array()),
            depths: box_depths(context, stack),
        }
    }
}

/// Light at one fragment.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(super) struct LightAt {
    /// Premultiplied colour and opacity that the stage found.
    pub(super) before: [f32; 4],
    /// Premultiplied colour that the stage left.
    pub(super) left: [f32; 3],
    /// Premultiplied colour as it is worked out here.
    pub(super) lit: [f32; 3],
    /// What the rounding of a stage may change each of its components by.
    pub(super) rounding: f32,
    /// Share of the lit colour; of the unlit colour in the model depth.
    pub(super) weight: f32,
    /// Towards the eye, where rays meet there.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) to_eye: Option<[f32; 3]>,
    /// Towards each light that has a position; else nothing.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub(super) to_light: Vec<Option<[f32; 3]>>,
    /// S and H of each light.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub(super) s: Vec<f32>,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub(super) h: Vec<f32>,
}

/// Where light falls on: the fragment of a pixel on a slice.
pub(super) struct Lit<'l> {
    pub(super) light: &'l Lighting,
    pub(super) context: Context<'l>,
    pub(super) stack: &'l Stack,
    pub(super) pixel: (u32, u32),
    pub(super) slice: u64,
    pub(super) gradient: Option<&'l GradientAt>,
    /// Premultiplied colour and opacity before the stage, colour behind it.
    pub(super) before: [f32; 4],
    pub(super) left: [f32; 3],
}

impl Lit<'_> {
    /// What light does there; nothing where the fragment is transparent, or has no gradient and needs one.
    pub(super) fn shade(&self) -> Option<LightAt> {
        if self.before[3] <= 0.0 {
            return None;
        }
        match (self.light.shading, self.gradient) {
            (Shading::Depth, _) => Some(self.cue()),
            (_, Some(gradient)) => Some(self.phong(gradient)),
            (_, None) => None,
        }
    }

    fn cue(&self) -> LightAt {
        let method = self.context.scene.method();
        // Whole slabs have the light of their middle, wherever their values are taken; what lies behind the last slice that of its end.
        let d = if self.slice < self.stack.count {
            self.stack.depth(self.slice) - if method.is_pre_integrated() { 0.5 * self.stack.spacing } else { 0.0 }
        } else {
            sample_depth(self.stack, self.pixel, self.slice, method.sample)
        };
        let place = ray_at(self.stack, self.pixel, d);
        let [near, far] = box_depths(self.context, self.stack);
        let factor = (1.0 - (self.stack.view.depth(place) - near) / (far - near)).clamp(0.0, 1.0);
        // Depths are kept in f32. Behind the last slice the stage goes by the place of the lookup, half a voxel inside the box at most.
        let longest = self.context.volume.grid().spacing().into_iter().fold(0.0, f64::max);
        let coarse = if self.slice < self.stack.count { 0.0 } else { longest };
        let rounding = (4e-7 * (1.0 + far.abs() / (far - near)) + coarse / (far - near)) * f64::from(self.before[3]);
        self.record(factor, rounding, self.color().map(|c| c * factor))
    }

    fn color(&self) -> [f64; 3] {
        [0, 1, 2].map(|c: usize| f64::from(self.before[c]))
    }

    fn record(&self, weight: f64, rounding: f64, lit: [f64; 3]) -> LightAt {
        LightAt {
            before: self.before,
            left: self.left,
            lit: lit.map(|c| c as f32),
            rounding: rounding as f32,
            weight: weight as f32,
            to_eye: None,
            to_light: Vec::new(),
            s: Vec::new(),
            h: Vec::new(),
        }
    }

    fn phong(&self, gradient: &GradientAt) -> LightAt {
        let (light, view, exact) = (self.light, &self.stack.view, &gradient.exact);
        let size = exact.gradient.length();
        if size == 0.0 {
            return self.record(0.0, f64::from(f32::EPSILON), self.color());
        }
        let normal = -exact.gradient / size;
        let radius = self.context.volume.grid().radius();
        // What rounding may turn a direction to a point by.
        let turned = |way: DVec3| (2e-6 * radius + exact.moved) / way.length().max(1e-6 * radius);
        let (to_eye, eye_turned) = if self.stack.perspective {
            ((view.eye - exact.position).normalize_or_zero(), turned(view.eye - exact.position))
        } else {
            (-view.forward, 1e-6)
        };
        let facing = |d: DVec3| {
            let cosine = normal.dot(d);
            (if light.two_sided { cosine.abs() } else { cosine.max(0.0) }).min(1.0)
        };
        let normal_turned = 2.0 * exact.rounding / size + 1e-6;
        let (mut glow, mut shine) = ([light.emission + light.ambient; 3], [0.0; 3]);
        let (mut s, mut h, mut to_light) = (Vec::new(), Vec::new(), Vec::new());
        // What a colour of the greatest brightness may be off by.
        let mut off = 1e-6 * (light.emission + light.ambient + 1.0);
        for lamp in light.lights() {
            let (towards, light_turned) = match lamp.source() {
                LightSource::Head => (to_eye, eye_turned),
                LightSource::Direction(d) => (d, 1e-6),
                LightSource::Position(p) => ((p - exact.position).normalize_or_zero(), turned(p - exact.position)),
            };
            let between = towards + to_eye;
            let half_turned = (light_turned + eye_turned) / between.length().max(1e-9);
            let (surface, mirror) = (facing(towards), facing(between.normalize_or_zero()));
            let highlight = light.specular * libm::pow(mirror, light.shininess);
            off += light.diffuse * (normal_turned + light_turned) + light.specular * light.shininess * (normal_turned + half_turned);
            for (c, of_light) in lamp.color().into_iter().enumerate() {
                glow[c] += light.diffuse * surface * of_light;
                shine[c] += highlight * of_light;
            }
            s.push(surface as f32);
            h.push(mirror as f32);
            let position = matches!(lamp.source(), LightSource::Position(_));
            to_light.push(position.then(|| towards.as_vec3().to_array()));
        }
        let ratio = light.gradient_floor / size;
        let weight = 1.0 / (1.0 + ratio * ratio);
        off += 2.0 * weight * (1.0 - weight) * exact.rounding / size;
        let (color, alpha) = (self.color(), f64::from(self.before[3]));
        let lit = std::array::from_fn(|c| {
            let whole = (color[c] * glow[c] + alpha * shine[c]).min(alpha);
            color[c] + weight * (whole - color[c])
        });
        if to_light.iter().all(Option::is_none) {
            to_light.clear();
        }
        let to_eye = self.stack.perspective.then(|| to_eye.as_vec3().to_array());
        LightAt { to_eye, to_light, s, h, ..self.record(weight, off * alpha, lit) }
    }
}
