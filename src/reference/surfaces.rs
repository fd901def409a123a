//! Level surfaces along one ray: every crossing of every level, from the cubic polynomial of each cell, and what is seen of them.

use super::field::{corners, cubic, solve};
use super::integrate::{Faces, Integrator};
use crate::scene::{Blend, Gradient, LightSource, Lighting, Premultiplied, Scene, Shading};
use crate::volume::Volume;
use crate::{Error, Result};
use glam::DVec3;

/// Where a ray crosses a level.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Crossing {
    /// Distance from the eye along the view direction, world units.
    pub depth: f64,
    /// The level, data units.
    pub level: f64,
    /// Direction against the gradient of the values, world space, of length 1; 0 where there is no gradient.
    pub normal: DVec3,
    /// Straight colour of the surface as it is lit there.
    pub color: [f64; 3],
    /// Opacity of the surface.
    pub opacity: f64,
}

/// Finds what rays of one scene meet of its level surfaces, one ray at a time.
///
/// Values are interpolated trilinearly, so along a ray they are a cubic polynomial in each cell, whose crossings are found one by one. Cells
/// that touch a NaN or infinite voxel hold none; the box's faces are none.
#[derive(Debug, Clone)]
pub struct SurfaceTracer<'a> {
    volume: &'a Volume,
    /// For the ray's way through the box.
    rays: Integrator<'a>,
    /// Level, straight colour and opacity.
    levels: Vec<(f64, [f64; 3], f64)>,
    gradient: Gradient,
    lighting: Option<Lighting>,
    flat: bool,
    background: Premultiplied,
    /// Depths of the box's nearest and farthest corners.
    box_depths: (f64, f64),
}

impl<'a> SurfaceTracer<'a> {
    /// For the surfaces of `scene` over `volume`.
    ///
    /// # Errors
    /// [`Error::Invalid`] when the volume holds colours, when the camera cannot be resolved, when the scene draws no level surfaces
    /// ([`Blend::Surfaces`]), and for colours that are blended as amounts of light.
    pub fn new(scene: &Scene, volume: &'a Volume) -> Result<Self> {
        if scene.blend() != Blend::Surfaces || scene.linear_light() {
            return Err(Error::invalid("render blend: this reference is for level surfaces in display numbers"));
        }
        volume.check_scalars("level surfaces")?;
        let rays = Integrator::new(&scene.clone().with_fog(None).with_lighting(None)?.with_blend(Blend::Over)?, volume)?;
        let view = rays.view();
        let depths = volume.grid().corners().map(|c| view.forward.dot(c - view.eye));
        let near = depths.into_iter().fold(f64::INFINITY, f64::min).max(view.near);
        let own = |level: f64| scene.transfer().eval(level).rgb;
        Ok(Self {
            volume,
            levels: scene.levels().iter().map(|s| (s.level(), s.color().unwrap_or_else(|| own(s.level())), s.opacity())).collect(),
            gradient: scene.gradient(),
            lighting: scene.lighting().cloned(),
            flat: scene.flat_surfaces(),
            background: scene.background().premultiply(),
            box_depths: (near, depths.into_iter().fold(f64::NEG_INFINITY, f64::max)),
            rays,
        })
    }

    /// All crossings of the ray through the middle of the pixel in column `x` and row `y`, nearest first.
    pub fn crossings(&self, x: u32, y: u32) -> Vec<Crossing> {
        let (origin, direction) = self.rays.view().ray(f64::from(x) + 0.5, f64::from(y) + 0.5);
        let Some((entry, exit)) = self.rays.span(origin, direction) else { return Vec::new() };
        let grid = self.volume.grid();
        let (at, step) = (grid.world_to_index().transform_point3(origin), grid.world_to_index().transform_vector3(direction));
        let mut faces: [Faces; 3] = std::array::from_fn(|axis| Faces::new(at[axis], step[axis], entry, grid.dims()[axis]));
        let mut found = Vec::new();
        // On which side of each level the ray is; nowhere at the box's face, and behind what is not finite.
        let mut above: Vec<Option<bool>> = vec![None; self.levels.len()];
        let mut near = entry;
        while near < exit {
            let mut far = exit;
            for face in &mut faces {
                face.skip_to(near);
                far = far.min(face.next());
            }
            let middle = at + step * (0.5 * (near + far));
            let low: [i64; 3] = std::array::from_fn(|axis| (middle[axis].floor() as i64).clamp(-1, grid.dims()[axis] as i64 - 1));
            let place = at + step * near - DVec3::new(low[0] as f64, low[1] as f64, low[2] as f64);
            let field = cubic(&corners(self.volume, low), place.to_array(), (step * (far - near)).to_array());
            if field.0.iter().all(|c| c.is_finite()) {
                let mut start = 0.0;
                for end in field.turns().chain([1.0]) {
                    for (side, &(level, ..)) in above.iter_mut().zip(&self.levels) {
                        let was = side.unwrap_or_else(|| field.at(start) >= level);
                        let is = field.at(end) >= level;
                        *side = Some(is);
                        if was != is {
                            // Between two cells rounding may leave the level just before this piece.
                            let met = (field.at(start) >= level) != is;
                            let s = if met { solve(|s| field.at(s), |s| field.slope(s), level, start, end) } else { start };
                            found.push((near + s * (far - near), level));
                        }
                    }
                    start = end;
                }
            } else {
                above.fill(None);
            }
            near = far;
        }
        found.sort_by(|a, b| a.0.total_cmp(&b.0));
        found.into_iter().map(|(depth, level)| self.crossing(depth, level, origin, direction)).collect()
    }

    /// The premultiplied colour of the pixel in column `x` and row `y`, over the scene's background.
    pub fn pixel(&self, x: u32, y: u32) -> Premultiplied {
        // From back to front.
        let back = (self.background.rgb, self.background.alpha);
        let (rgb, alpha) = self.crossings(x, y).iter().rev().fold(back, |(rgb, alpha), c| {
            let a = c.opacity;
            (std::array::from_fn(|n| a * c.color[n] + (1.0 - a) * rgb[n]), a + (1.0 - a) * alpha)
        });
        Premultiplied { rgb, alpha }
    }

    fn crossing(&self, depth: f64, level: f64, origin: DVec3, direction: DVec3) -> Crossing {
        let position = origin + direction * depth;
        let gradient = self.slope(self.volume.grid().world_to_index().transform_point3(position));
        let normal = if gradient.length() > 0.0 { -gradient / gradient.length() } else { DVec3::ZERO };
        let (color, opacity) = self.levels.iter().find(|l| l.0 == level).map_or(([0.0; 3], 0.0), |l| (l.1, l.2));
        let to_eye = -direction / direction.length();
        let color = match &self.lighting {
            None if self.flat => color,
            None if normal == DVec3::ZERO => color,
            None => color.map(|c| c * (0.2 + 0.8 * normal.dot(to_eye).abs())),
            Some(light) if light.shading == Shading::Depth => {
                let (near, far) = self.box_depths;
                color.map(|c| c * ((far - depth) / (far - near)))
            }
            Some(light) => lit(light, color, position, normal, gradient.length(), to_eye),
        };
        Crossing { depth, level, normal, color, opacity }
    }

    /// The gradient at index coordinates `p`, world space: differences of interpolated values.
    fn slope(&self, p: DVec3) -> DVec3 {
        let top = DVec3::from_array(self.volume.grid().dims().map(|n| (n - 1) as f64));
        let p = p.clamp(DVec3::ZERO, top);
        let axes = [DVec3::X, DVec3::Y, DVec3::Z];
        let half = |a: DVec3, at: DVec3| 0.5 * (self.volume.sample(at + a) - self.volume.sample(at - a));
        let along = |axis: usize| {
            let (a, b, c) = (axes[axis], axes[(axis + 1) % 3], axes[(axis + 2) % 3]);
            match self.gradient {
                Gradient::Central => half(a, p),
                Gradient::Analytic if top[axis] == 0.0 => 0.0,
                // Interpolation is linear along an axis of a cell: any two places of it will do.
                Gradient::Analytic => {
                    let cell = p[axis].floor().min(top[axis] - 1.0);
                    let [low, high] = [0.25, 0.75].map(|t| self.volume.sample(p + a * (cell + t - p[axis])));
                    (high - low) / 0.5
                }
                Gradient::Sobel => {
                    let row = |at: DVec3| 0.25 * half(a, at - b) + 0.5 * half(a, at) + 0.25 * half(a, at + b);
                    0.25 * row(p - c) + 0.5 * row(p) + 0.25 * row(p + c)
                }
            }
        };
        let slope = DVec3::new(along(0), along(1), along(2));
        let world = self.volume.grid().world_to_index().matrix3.transpose() * slope;
        if world.is_finite() { world } else { DVec3::ZERO }
    }
}

/// Blinn and Phong's light on a surface that faces `normal`.
fn lit(light: &Lighting, color: [f64; 3], position: DVec3, normal: DVec3, steepness: f64, to_eye: DVec3) -> [f64; 3] {
    if normal == DVec3::ZERO {
        return color;
    }
    let facing = |to: DVec3| if light.two_sided { normal.dot(to).abs() } else { normal.dot(to).max(0.0) };
    let (mut matte, mut gloss) = ([0.0; 3], [0.0; 3]);
    for source in light.lights() {
        let to_light = match source.source() {
            LightSource::Head => to_eye,
            LightSource::Direction(d) => d,
            LightSource::Position(p) => (p - position).normalize_or_zero(),
        };
        let half = (to_light + to_eye).normalize_or_zero();
        for c in 0..3 {
            matte[c] += facing(to_light) * source.color()[c];
            gloss[c] += libm::pow(facing(half), light.shininess) * source.color()[c];
        }
    }
    let square = steepness * steepness;
    let weight = square / (square + light.gradient_floor * light.gradient_floor);
    std::array::from_fn(|c| {
        let full = color[c] * (light.emission + light.ambient + light.diffuse * matte[c]) + light.specular * gloss[c];
        weight * full.clamp(0.0, 1.0) + (1.0 - weight) * color[c]
    })
}
