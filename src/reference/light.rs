//! Light along one ray: colours and their derivatives, and where they have kinks.
//!
//! The formula is that of [`crate::scene::Lighting`]. Between cell faces the gradient is a polynomial in the ray's parameter, so lit colours are
//! smooth but for places that are polynomials' roots, and for the clamp to 1. The former are cut at, the latter is left to quadrature.

use super::field::Along;
use super::gradient::Gradients;
use super::regions;
use super::roots::{add, derivative, product, sign_changes, value};
use super::spline::{Nonic, Spline};
use crate::scene::{LightSource, Lighting, Scene, Shading, Transfer2d, View};
use crate::volume::{Grid, Volume};
use glam::DVec3;
use std::ops::{Add, Div, Mul, Sub};

/// A number and its derivative by the ray's parameter.
#[derive(Debug, Clone, Copy)]
pub(super) struct Dual {
    pub(super) v: f64,
    pub(super) d: f64,
}

impl Dual {
    pub(super) const fn fixed(v: f64) -> Self {
        Self { v, d: 0.0 }
    }

    fn sqrt(self) -> Self {
        let root = self.v.sqrt();
        Self { v: root, d: if root > 0.0 { 0.5 * self.d / root } else { 0.0 } }
    }

    /// Its power, from 0 up, to an exponent of 1 or more.
    fn power(self, exponent: f64) -> Self {
        Self { v: libm::pow(self.v, exponent), d: exponent * libm::pow(self.v, exponent - 1.0) * self.d }
    }

    fn at_most_1(self) -> Self {
        if self.v < 1.0 { self } else { Self::fixed(1.0) }
    }

    pub(super) fn times(self, factor: f64) -> Self {
        Self { v: self.v * factor, d: self.d * factor }
    }
}

impl Add for Dual {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        Self { v: self.v + other.v, d: self.d + other.d }
    }
}

impl Sub for Dual {
    type Output = Self;
    fn sub(self, other: Self) -> Self {
        Self { v: self.v - other.v, d: self.d - other.d }
    }
}

impl Mul for Dual {
    type Output = Self;
    fn mul(self, other: Self) -> Self {
        Self { v: self.v * other.v, d: self.d * other.v + self.v * other.d }
    }
}

impl Div for Dual {
    type Output = Self;
    fn div(self, other: Self) -> Self {
        let v = self.v / other.v;
        Self { v, d: (self.d - v * other.d) / other.v }
    }
}

type Vector = [Dual; 3];

fn dot(a: Vector, b: Vector) -> Dual {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// `a` at length 1; 0 where it has none.
fn unit(a: Vector) -> Vector {
    let length = dot(a, a).sqrt();
    if length.v > 0.0 { a.map(|x| x / length) } else { [Dual::fixed(0.0); 3] }
}

/// Coefficients beyond this are this: products stay finite, and any colour is as bright as can be.
const MOST: f64 = 1e100;

/// A light.
#[derive(Debug, Clone, Copy)]
struct Lamp {
    source: LightSource,
    color: [f64; 3],
}

/// What light does to a colour.
#[derive(Debug, Clone)]
enum Model {
    BlinnPhong {
        material: Lighting,
        lamps: Vec<Lamp>,
    },
    /// Depths at which the box begins and ends.
    Depth(f64, f64),
}

/// Light, and opacity that depends on the gradient, of one scene over one volume.
#[derive(Debug, Clone)]
pub(super) struct Lights<'a> {
    gradients: Option<Gradients<'a>>,
    model: Option<Model>,
    /// Sizes of gradients and the factors on the extinction there.
    opacity: Vec<(f64, f64)>,
    /// Colour and opacity by value and gradient, in the place of those by value.
    transfer: Option<Transfer2d>,
}

impl<'a> Lights<'a> {
    /// Those of `scene`, its lights' colours turned by `turn`; nothing where it asks for neither.
    pub(super) fn new(scene: &Scene, volume: &'a Volume, view: &View, turn: impl Fn(f64) -> f64) -> Option<Self> {
        let transfer = scene.transfer2d().map(|t| t.with_colors(&turn));
        let opacity = if transfer.is_some() { Vec::new() } else { scene.transfer().gradient_opacity().to_vec() };
        let model = scene.lighting().map(|lighting| match lighting.shading {
            Shading::Depth => {
                let (near, far) = depths(volume.grid(), view);
                Model::Depth(near, far)
            }
            Shading::BlinnPhong => {
                let lamp = |l: &crate::scene::Light| Lamp { source: within_f64(l.source()), color: l.color().map(&turn) };
                Model::BlinnPhong { lamps: lighting.lights().iter().map(lamp).collect(), material: lighting.clone() }
            }
        });
        if model.is_none() && opacity.is_empty() && transfer.is_none() {
            return None;
        }
        let needed = !opacity.is_empty() || transfer.is_some() || matches!(model, Some(Model::BlinnPhong { .. }));
        Some(Self { gradients: needed.then(|| Gradients::new(volume, scene.gradient())), model, opacity, transfer })
    }

    /// Light on the piece of `ray` in the cell whose lower corner is voxel `low`, which goes from `place` in the cell over `step`.
    pub(super) fn on(&self, ray: &LitRay, low: [i64; 3], place: [f64; 3], step: [f64; 3], spline: Option<&Spline>) -> Lit<'_> {
        let found = self.gradients.as_ref().and_then(|g| g.along(low, place, step, spline));
        // Scaled first: squares may leave f64.
        let scale = found.iter().flatten().flat_map(|c| c.0).fold(0.0, |most: f64, c| most.max(c.abs()));
        let gradient = found.filter(|_| scale > 0.0).map(|g| g.map(|c| Nonic(c.0.map(|c| c / scale))));
        let mut lit = Lit { lights: self, ray: *ray, gradient, scale, factor: (1.0, 0.0) };
        lit.enter(0.5);
        lit
    }
}

/// The same light, near enough for squares of its distance.
fn within_f64(source: LightSource) -> LightSource {
    const FAR: f64 = 1e100;
    match source {
        LightSource::Position(p) if p.abs().max_element() > FAR => LightSource::Position(p * (FAR / p.abs().max_element())),
        other => other,
    }
}

/// Least and greatest depth of the box before the eye.
fn depths(grid: &Grid, view: &View) -> (f64, f64) {
    let depths = grid.corners().map(|c| (c - view.eye).dot(view.forward));
    let (near, far) = depths.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), &d| (a.min(d), b.max(d)));
    (near.max(view.near), far)
}

/// A piece of ray: where it starts in the world, its way, and its depth and what that grows by.
#[derive(Debug, Clone, Copy)]
pub(super) struct LitRay {
    pub(super) start: DVec3,
    pub(super) way: DVec3,
    pub(super) depth: f64,
    pub(super) depth_step: f64,
}

/// Light on one piece of ray within one cell.
#[derive(Debug, Clone, Copy)]
pub(super) struct Lit<'a> {
    lights: &'a Lights<'a>,
    ray: LitRay,
    /// The gradient in units of `scale`, which makes its largest coefficient 1; nothing where it is 0 or none.
    gradient: Option<[Nonic; 3]>,
    scale: f64,
    /// The factor on the extinction at gradient 0, and its change with the gradient's size in units of `scale`, as on the part of the
    /// piece that was last entered.
    factor: (f64, f64),
}

impl Lit<'_> {
    /// The places in (0,1) at which colour or extinction has a kink, rising.
    pub(super) fn cuts(&self, field: &dyn Along) -> Vec<f64> {
        let mut cuts = Vec::new();
        let Some(gradient) = &self.gradient else {
            self.lights.transfer.iter().for_each(|t| regions::cuts(t, field, &[0.0], 0.0, &mut cuts));
            cuts.sort_by(f64::total_cmp);
            return cuts;
        };
        const NOISE: f64 = 1e-14;
        // Trailing zeros cost time alone.
        let degree = gradient.iter().map(Nonic::degree).fold(0, usize::max);
        let gradient = gradient.each_ref().map(|g| &g.0[..=degree]);
        let mut squared = vec![0.0; 2 * degree + 1];
        gradient.iter().for_each(|g| add(&mut squared, &product(g, g)));
        // Beside a gradient of next to nothing its direction turns fast.
        let mut turns = Vec::new();
        sign_changes(&derivative(&squared), NOISE, &mut turns);
        let most = value(&squared, 0.0).max(value(&squared, 1.0));
        cuts.extend(turns.into_iter().filter(|&s| value(&squared, s) < 0.05 * most));
        self.lights.transfer.iter().for_each(|t| regions::cuts(t, field, &squared, self.scale, &mut cuts));
        for &(size, _) in &self.lights.opacity {
            let size = size / self.scale;
            // No size on the piece comes near sqrt(3) times 4.
            if size < 10.0 {
                let mut beyond = squared.clone();
                beyond[0] -= size * size;
                sign_changes(&beyond, NOISE, &mut cuts);
            }
        }
        if let Some(Model::BlinnPhong { lamps, .. }) = &self.lights.model {
            let view = self.view();
            // The gradient along a fixed direction.
            let along = |direction: DVec3| {
                let mut sum = vec![0.0; degree + 1];
                for (g, x) in gradient.iter().zip(direction.to_array()) {
                    add(&mut sum, &g.iter().map(|c| c * x).collect::<Vec<_>>());
                }
                sum
            };
            for lamp in lamps {
                match lamp.source {
                    LightSource::Head => sign_changes(&along(view), NOISE, &mut cuts),
                    LightSource::Direction(d) => {
                        sign_changes(&along(d), NOISE, &mut cuts);
                        sign_changes(&along(d + view), NOISE, &mut cuts);
                    }
                    LightSource::Position(p) => {
                        let from = p - self.ray.start;
                        let mut sum = vec![0.0; degree + 2];
                        for (axis, g) in gradient.iter().enumerate() {
                            add(&mut sum, &product(g, &[from[axis], -self.ray.way[axis]]));
                        }
                        sign_changes(&sum, NOISE * from.abs().max_element().max(1e-300), &mut cuts);
                    }
                }
            }
        }
        cuts.sort_by(f64::total_cmp);
        cuts.dedup();
        cuts
    }

    /// Takes the factor on the extinction from the segment that the gradient at `s` lies on: the piece up to the next cut.
    pub(super) fn enter(&mut self, s: f64) {
        let points = &self.lights.opacity;
        if points.is_empty() {
            return;
        }
        let size = self.size(s) * self.scale;
        let after = points.partition_point(|p| p.0 <= size);
        self.factor = match (after.checked_sub(1).map(|i| points[i]), points.get(after)) {
            (Some((g0, f0)), Some(&(g1, f1))) => {
                let slope = (f1 - f0) / (g1 - g0);
                (f0 - slope * g0, slope * self.scale)
            }
            (Some((_, f)), None) | (None, Some(&(_, f))) => (f, 0.0),
            (None, None) => (1.0, 0.0),
        };
    }

    /// The factor on the extinction.
    pub(super) fn factor(&self, s: f64) -> f64 {
        let (zero, slope) = self.factor;
        // Without a slope infinities play no part.
        if slope == 0.0 { zero } else { (zero + slope * self.size(s)).clamp(0.0, 1.0) }
    }

    /// Straight colour with its derivative by s, and opacity, where they depend on value and gradient.
    pub(super) fn by_gradient(&self, s: f64, field: &dyn Along) -> Option<([f64; 3], [f64; 3], f64)> {
        let transfer = self.lights.transfer.as_ref()?;
        let size = self.gradient.map_or(Dual::fixed(0.0), |g| {
            let g = g.map(|c| Dual { v: c.at(s), d: c.slope(s) });
            dot(g, g).sqrt().times(self.scale)
        });
        let (color, opacity) = regions::at(transfer, Dual { v: field.at(s), d: field.slope(s) }, size);
        Some((color.map(|c| c.v), color.map(|c| c.d), opacity.v))
    }

    /// Size of the gradient in units of `scale`.
    fn size(&self, s: f64) -> f64 {
        self.gradient.map_or(0.0, |g| g.map(|c| c.at(s)).iter().map(|x| x * x).sum::<f64>().sqrt())
    }

    /// Towards the eye, of length 1: the same all along a ray.
    fn view(&self) -> DVec3 {
        -self.ray.way.normalize()
    }

    /// Straight colour and its derivative by s in the light, from those out of it.
    pub(super) fn color(&self, s: f64, color: [f64; 3], slope: [f64; 3]) -> ([f64; 3], [f64; 3]) {
        let own: Vector = [0, 1, 2].map(|i: usize| Dual { v: color[i], d: slope[i] });
        let lit = match &self.lights.model {
            None => own,
            Some(Model::Depth(near, far)) => {
                let depth = Dual { v: self.ray.depth + s * self.ray.depth_step, d: self.ray.depth_step };
                let left = Dual::fixed(1.0) - (depth - Dual::fixed(*near)).times(1.0 / (far - near));
                // Beyond the box, by rounding.
                let left = if left.v > 0.0 { left.at_most_1() } else { Dual::fixed(0.0) };
                own.map(|c| c * left)
            }
            Some(Model::BlinnPhong { material, lamps }) => self.blinn_phong(s, own, material, lamps),
        };
        (lit.map(|c| c.v), lit.map(|c| c.d))
    }

    fn blinn_phong(&self, s: f64, own: Vector, material: &Lighting, lamps: &[Lamp]) -> Vector {
        let Some(gradient) = self.gradient else { return own };
        let gradient = gradient.map(|g| Dual { v: g.at(s), d: g.slope(s) });
        let squared = dot(gradient, gradient);
        let size = squared.sqrt();
        if size.v == 0.0 {
            return own;
        }
        let normal = gradient.map(|g| (g / size).times(-1.0));
        let view = self.view().to_array().map(Dual::fixed);
        let facing = |cosine: Dual| {
            let cosine = if cosine.v >= 0.0 || material.two_sided { cosine.times(cosine.v.signum()) } else { Dual::fixed(0.0) };
            cosine.at_most_1()
        };
        let at_most = |x: f64| x.min(MOST);
        let mut glow = [Dual::fixed(at_most(material.emission) + at_most(material.ambient)); 3];
        let mut shine = [Dual::fixed(0.0); 3];
        for lamp in lamps {
            let light = match lamp.source {
                LightSource::Head => view,
                LightSource::Direction(d) => d.to_array().map(Dual::fixed),
                LightSource::Position(p) => {
                    let from = p - self.ray.start;
                    unit([0, 1, 2].map(|axis: usize| Dual { v: from[axis] - s * self.ray.way[axis], d: -self.ray.way[axis] }))
                }
            };
            let half = unit([0, 1, 2].map(|axis: usize| light[axis] + view[axis]));
            let diffuse = facing(dot(normal, light)).times(at_most(material.diffuse));
            let specular = facing(dot(normal, half)).power(material.shininess).times(at_most(material.specular));
            for channel in 0..3 {
                glow[channel] = glow[channel] + diffuse.times(lamp.color[channel]);
                shine[channel] = shine[channel] + specular.times(lamp.color[channel]);
            }
        }
        let floor = material.gradient_floor / self.scale;
        let weight = if floor > 0.0 {
            // |g|^2 / (|g|^2 + floor^2), by a quotient that cannot leave f64 where it matters.
            let quotient = Dual::fixed(floor.min(MOST)) / size;
            Dual::fixed(1.0) / (Dual::fixed(1.0) + quotient * quotient)
        } else {
            Dual::fixed(1.0)
        };
        [0, 1, 2].map(|c: usize| {
            let lit = (own[c] * glow[c] + shine[c]).at_most_1();
            own[c] + weight * (lit - own[c])
        })
    }
}
