//! The emission-absorption integral along the ray of one pixel.

use super::colors::{ColorField, ColorQuadrature};
use super::cuts::Cuts;
use super::field::{Along, Corners, corners, cubic, solve};
use super::light::{Lights, LitRay};
use super::panel::{DARK, Distance, Gathered, Haze, Piece, PieceFog, Quadrature};
use super::places::{Look, Places};
use super::spline::Spline;
use crate::scene::{Blend, Fog, FogDistance, FogMode, FogWeighting, OptionalStage, Premultiplied, Scene, Straight, TransferFunction, View};
use crate::volume::Volume;
use crate::{Error, Result};
use glam::DVec3;
use std::sync::Arc;

/// Error that quadrature is steered to, in colour: well under the bound promised by [`RayResult::error_bound`].
const TOLERANCE: f64 = 1e-11;

/// What the eye sees along one ray.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RayResult {
    /// Premultiplied colour of the volume alone, fog included, the background not.
    pub rgb: [f64; 3],
    /// How much of what lies behind the volume shines through, in `[0,1]`.
    pub transmittance: f64,
    /// Bound on the error of each number above, from quadrature (below 1e-10) and the rounding of its sums. The voxels and the
    /// ray are taken as exact.
    pub error_bound: f64,
    /// Depths at which the ray enters and leaves what is visible of the box, or ends at a cut plane; `None` where it misses.
    pub span: Option<(f64, f64)>,
    /// Smooth panels integrated.
    pub pieces: u32,
}

impl RayResult {
    /// The ray's colour over a background.
    pub fn over(&self, background: Premultiplied) -> Premultiplied {
        let rgb = std::array::from_fn(|i| self.rgb[i] + self.transmittance * background.rgb[i]);
        Premultiplied { rgb, alpha: 1.0 - self.transmittance * (1.0 - background.alpha) }
    }
}

/// Computes pixels of one scene over one volume, one ray at a time.
///
/// Slices, their order and early termination play no part: this is the limit of ever more slices. Values are interpolated
/// trilinearly between voxel centres, constant from the outermost centres to the faces of the box, then classified by the exact
/// transfer function. Cells that touch a NaN or infinite voxel are transparent. Light and gradient opacity see the exact gradient of the
/// scene's kind; it is 0 where a voxel that it needs is NaN or infinite. Segments end halfway between voxels, where the nearest one changes.
///
/// Of voxels that are colours extinction -ln(1 - a) / L0 and emission, that times the colour, are interpolated: what interpolated premultiplied
/// colours of ever thinner slabs come to. A voxel with a number that is NaN or infinite is transparent, others are clamped to `[0,1]`.
#[derive(Debug, Clone)]
pub struct Integrator<'a> {
    volume: &'a Volume,
    /// The spline over the voxels, where the scene looks that up.
    spline: Option<Arc<Spline>>,
    view: View,
    /// What values look like, place by place.
    places: Places<'a>,
    /// Half-spaces normal . p >= offset, the scene's clip planes.
    planes: Vec<(DVec3, f64)>,
    /// Opaque planes that end rays.
    cuts: Cuts,
    fog: Option<Fog>,
    background: Premultiplied,
    /// Whether colours are integrated as amounts of light, and pixels turned back into sRGB numbers.
    linear_light: bool,
    /// Light, and opacity by the gradient, where the scene asks for either.
    lights: Option<Lights<'a>>,
    quadrature: Quadrature,
    /// Where voxels are colours: what they mean, and how rays through them are integrated.
    colors: Option<(ColorField, ColorQuadrature)>,
}

impl<'a> Integrator<'a> {
    /// An integrator for `scene` over `volume`.
    ///
    /// # Errors
    /// [`Error::Invalid`] when the scene asks for what the volume does not have ([`Scene::check_with`]), such as labels, when the camera cannot be resolved, when the blend mode is not [`Blend::Over`], or for fog of literal
    /// weighting: it adds the fog's colour once a slice, which has no limit as slices become many.
    pub fn new(scene: &Scene, volume: &'a Volume) -> Result<Self> {
        scene.check_with(volume)?;
        if scene.blend() != Blend::Over {
            return Err(Error::invalid(
                "render blend: rays are integrated for \"over\" alone; of the others only render.levels have a reference",
            ));
        }
        let mut fog = follow(scene)?;
        let mut transfer = scene.transfer().clone();
        if scene.transfer2d().is_some() {
            // Every value may show something: light and gradients tell what.
            transfer = TransferFunction::new(vec![(0.0, [0.0; 3])], vec![(0.0, 0.5)])?;
        }
        let mut background = background(scene);
        if scene.linear_light() {
            let color = transfer.color().iter().map(|&(value, rgb)| (value, rgb.map(light_of))).collect();
            transfer = TransferFunction::new(color, transfer.opacity().to_vec())?;
            if let Some(display) = fog {
                let color = display.color().map(light_of);
                fog = Some(Fog::new(display.mode(), color)?.with_distance(display.distance()).with_weighting(display.weighting()));
            }
            let straight = scene.background();
            let lit = Straight { rgb: straight.rgb.map(light_of), alpha: straight.alpha };
            background = fogged(lit.premultiply(), fog.filter(|_| scene.fogged_background()).as_ref());
        }
        let (width, height) = scene.size();
        let view = scene.camera().resolve(volume.grid(), width, height)?;
        Ok(Self {
            volume,
            lights: Lights::new(scene, volume, &view, |c| if scene.linear_light() { light_of(c) } else { c }),
            view,
            spline: Spline::of(scene, volume)?.map(Arc::new),
            places: Places::new(scene, volume, (&transfer, scene.opacity_length(volume.grid())), |c| {
                if scene.linear_light() { light_of(c) } else { c }
            })?,
            planes: scene.clip_planes().iter().map(|p| (p.normal(), p.offset())).collect(),
            cuts: Cuts::new(scene, volume)?,
            fog,
            background,
            linear_light: scene.linear_light(),
            quadrature: Quadrature::new(),
            colors: ColorField::of(scene, volume, if scene.linear_light() { light_of } else { |c| c }).map(|c| (c, ColorQuadrature::new())),
        })
    }

    /// The camera in numbers.
    pub fn view(&self) -> &View {
        &self.view
    }

    /// The colour of the pixel in column `x` and row `y` over the scene's background, and the ray it comes from.
    pub fn pixel(&self, x: u32, y: u32) -> (Premultiplied, RayResult) {
        let ray = self.ray(f64::from(x) + 0.5, f64::from(y) + 0.5);
        let color = ray.over(self.background);
        (if self.linear_light { in_srgb(color) } else { color }, ray)
    }

    /// The integral along the ray through window position (x,y).
    pub fn ray(&self, x: f64, y: f64) -> RayResult {
        let (origin, direction) = self.view.ray(x, y);
        let mut gathered = Gathered { rgb: [0.0; 3], transmittance: 1.0, error: 0.0, panels: 0 };
        let mut span = self.span(origin, direction);
        if let Some((entry, exit)) = span {
            let cut = self.cuts.nearest((self.volume, self.spline.as_deref()), (origin, direction), (entry, exit));
            let end = cut.map_or(exit, |(depth, _)| depth);
            self.march(origin, direction, entry, end, &mut gathered);
            if let Some((depth, color)) = cut {
                self.end(&mut gathered, color, self.fog_distance(origin, direction.length()).at(depth).0);
                span = Some((entry, end));
            }
        }
        let Gathered { rgb, transmittance, mut error, panels } = gathered;
        if transmittance <= DARK {
            // What was not looked at any more.
            error += transmittance;
        }
        RayResult { rgb, transmittance, error_bound: error, span, pieces: panels }
    }

    /// Adds an opaque `color`, seen through fog of distance `z`, behind what is gathered.
    fn end(&self, gathered: &mut Gathered, color: [f64; 3], z: f64) {
        for (i, sum) in gathered.rgb.iter_mut().enumerate() {
            let color = if self.linear_light { light_of(color[i]) } else { color[i] };
            let seen = self.fog.as_ref().map_or(color, |fog| {
                let f = fog.factor(z);
                f * color + (1.0 - f) * fog.color()[i]
            });
            *sum += gathered.transmittance * seen;
        }
        gathered.transmittance = 0.0;
    }

    /// The depths between which the ray is before the near plane, in the box and on the kept side of every clip plane.
    pub(super) fn span(&self, origin: DVec3, direction: DVec3) -> Option<(f64, f64)> {
        let grid = self.volume.grid();
        let (at, step) = (grid.world_to_index().transform_point3(origin), grid.world_to_index().transform_vector3(direction));
        let (low, high) = grid.index_bounds();
        let (mut entry, mut exit) = (self.view.near, f64::INFINITY);
        // Keeps the depths d with height + d * rate >= 0.
        let mut keep = |height: f64, rate: f64| {
            if rate > 0.0 {
                entry = entry.max(-height / rate);
            } else if rate < 0.0 {
                exit = exit.min(-height / rate);
            } else if height < 0.0 {
                exit = f64::NEG_INFINITY;
            }
        };
        for axis in 0..3 {
            keep(at[axis] - low[axis], step[axis]);
            keep(high[axis] - at[axis], -step[axis]);
        }
        for &(normal, offset) in &self.planes {
            keep(normal.dot(origin) - offset, normal.dot(direction));
        }
        (entry < exit).then_some((entry, exit))
    }

    /// Walks the ray from cut to cut: cell faces of the field, and the depths where fog has a kink.
    fn march(&self, origin: DVec3, direction: DVec3, entry: f64, exit: f64, gathered: &mut Gathered) {
        let grid = self.volume.grid();
        let (at, step) = (grid.world_to_index().transform_point3(origin), grid.world_to_index().transform_vector3(direction));
        let stretch = direction.length();
        let distance = self.fog_distance(origin, stretch);
        let mut faces: [Faces; 3] = std::array::from_fn(|axis| Faces::new(at[axis], step[axis], entry, grid.dims()[axis]));
        let mut kinks = self.fog_kinks(distance);
        let cuts = self.places.cuts((origin, direction), grid, (entry, exit));
        let mut cuts = cuts.into_iter().peekable();
        let mut near = entry;
        while near < exit && gathered.transmittance > DARK {
            let mut far = exit;
            for face in &mut faces {
                face.skip_to(near);
                far = far.min(face.next);
            }
            for kink in &mut kinks {
                if *kink > near {
                    far = far.min(*kink);
                }
            }
            while cuts.next_if(|&cut| cut <= near).is_some() {}
            if let Some(&cut) = cuts.peek() {
                far = far.min(cut);
            }
            let middle = at + step * (0.5 * (near + far));
            let Some(look) = self.places.look(origin + direction * (0.5 * (near + far)), middle) else {
                near = far;
                continue;
            };
            let low: [i64; 3] = std::array::from_fn(|axis| (middle[axis].floor() as i64).clamp(-1, grid.dims()[axis] as i64 - 1));
            let place = at + step * near - DVec3::new(low[0] as f64, low[1] as f64, low[2] as f64);
            let way = step * (far - near);
            let walk = Walk {
                near,
                far,
                share: (far - near) / (exit - entry),
                look,
                length: (far - near) * stretch / look.unit,
                low,
                place: place.to_array(),
                way: way.to_array(),
                ray: LitRay { start: origin + direction * near, way: direction * (far - near), depth: near, depth_step: far - near },
            };
            if let Some((colors, quadrature)) = &self.colors {
                if let Some(piece) = colors.along(self.volume, low, walk.place, walk.way) {
                    quadrature.gather(&piece, (walk.length, self.fog_on(&walk, distance)), TOLERANCE * walk.share, gathered);
                }
                near = far;
                continue;
            }
            match &self.spline {
                None => self.cell(&corners(self.volume, low), &walk, distance, gathered),
                Some(spline) => {
                    if let Some((field, least, most)) = spline.along(low, walk.place, walk.way, None) {
                        self.piece(&field, (least, most), &walk, distance, gathered);
                    }
                }
            }
            near = far;
        }
    }

    /// Adds one piece of ray within one cell.
    fn cell(&self, cell: &Corners, walk: &Walk<'_>, distance: Distance, gathered: &mut Gathered) {
        let (mut least, mut most, mut finite) = (f64::INFINITY, f64::NEG_INFINITY, true);
        for &v in cell {
            least = least.min(v);
            most = most.max(v);
            finite &= v.is_finite();
        }
        if !finite {
            return;
        }
        let field = cubic(cell, walk.place, walk.way);
        if field.0.iter().all(|c| c.is_finite()) {
            self.piece(&field, (least, most), walk, distance, gathered);
        }
    }

    /// Adds one piece of ray with this field along it, whose values lie between `least` and `most`.
    fn piece(&self, field: &dyn Along, (least, most): (f64, f64), walk: &Walk<'_>, distance: Distance, gathered: &mut Gathered) {
        let segments = &walk.look.segments;
        let (first, last) = (segments.position(least), segments.position(most));
        if segments.transparent(first, last) {
            return;
        }
        let mut lit = self.lights.as_ref().map(|lights| lights.on(&walk.ray, walk.low, walk.place, walk.way, self.spline.as_deref()));
        let cuts = lit.as_ref().map_or_else(Vec::new, |lit| lit.cuts(field));
        let mut add = |position: usize, a: f64, b: f64| {
            if segments.transparent(position, position) || b <= a {
                return;
            }
            let fog = self.fog_on(walk, distance);
            let mut start = a;
            for end in cuts.iter().copied().filter(|&s| s > a && s < b).chain([b]) {
                if let Some(lit) = &mut lit {
                    lit.enter(0.5 * (start + end));
                }
                let piece = Piece { field, segment: segments.segment(position), length: walk.length, fog, lit: lit.as_ref() };
                self.quadrature.gather(&piece, start, end, TOLERANCE * walk.share, gathered);
                start = end;
            }
        };
        if first == last && segments.segment(first).most < 1.0 {
            add(first, 0.0, 1.0);
            return;
        }
        let mut start = 0.0;
        for end in field.turns().iter().chain([1.0]) {
            let (v0, v1) = (field.at(start), field.at(end));
            let knots = segments.knots_between(v0.min(v1), v0.max(v1));
            let mut a = start;
            for i in 0..=knots.len() {
                // In the order in which the ray meets them.
                let b = match knots.len() - i {
                    0 => end,
                    left => solve(|s| field.at(s), |s| field.slope(s), knots[if v0 < v1 { i } else { left - 1 }], a, end),
                };
                add(segments.position(field.at(0.5 * (a + b))), a, b);
                a = b;
            }
            start = end;
        }
    }

    /// Fog on a piece of ray, if there is any.
    fn fog_on(&self, walk: &Walk, distance: Distance) -> Option<PieceFog> {
        self.fog.as_ref().map(|fog| PieceFog {
            haze: haze(fog, distance.at(0.5 * (walk.near + walk.far)).0),
            color: fog.color(),
            distance,
            depth: walk.near,
            depth_step: walk.far - walk.near,
        })
    }

    /// How the fog's distance grows along the ray.
    fn fog_distance(&self, origin: DVec3, stretch: f64) -> Distance {
        match self.fog.map(|f| f.distance()) {
            Some(FogDistance::Radial) => Distance { aside: origin.distance(self.view.eye), rate: stretch },
            _ => Distance { aside: 0.0, rate: 1.0 },
        }
    }

    /// Depths at which linear fog starts and ends.
    fn fog_kinks(&self, distance: Distance) -> [f64; 2] {
        match self.fog.map(|f| f.mode()) {
            Some(FogMode::Linear { start, end }) => [start, end].map(|z| {
                let along = z * z - distance.aside * distance.aside;
                if z > 0.0 && along > 0.0 { along.sqrt() / distance.rate } else { f64::NEG_INFINITY }
            }),
            _ => [f64::NEG_INFINITY; 2],
        }
    }
}

/// What the integrator does for the stages that `scene` asks for: its fog, if it has any; light and gradients are [`Lights`], regions and labels [`Places`]. The match has no
/// wildcard, so that a stage without an answer here does not compile.
///
/// # Errors
/// [`Error::Invalid`] for what the integral has no limit of.
fn follow(scene: &Scene) -> Result<Option<Fog>> {
    let mut fog = None;
    for stage in OptionalStage::wanted(scene) {
        match stage {
            OptionalStage::Fog if scene.fog().is_some_and(|f| f.weighting() == FogWeighting::Literal) => {
                return Err(Error::invalid("fog weighting literal depends on the number of slices: there is no reference for it"));
            }
            OptionalStage::Fog => fog = scene.fog().copied(),
            OptionalStage::Gradient | OptionalStage::GradientOpacity | OptionalStage::Transfer2d | OptionalStage::Light => {}
            // See `Places`.
            OptionalStage::Regions | OptionalStage::Labels => {}
        }
    }
    Ok(fog)
}

/// A piece of ray between two cuts.
struct Walk<'l> {
    /// What values look like on it.
    look: &'l Look,
    /// Depth of its ends.
    near: f64,
    far: f64,
    /// Its share of the ray's path through the box.
    share: f64,
    /// Its length in reference lengths.
    length: f64,
    /// The lower corner of its cell; where in that it starts, and its way, in voxels.
    low: [i64; 3],
    place: [f64; 3],
    way: [f64; 3],
    /// Where it is in the world.
    ray: LitRay,
}

/// The depths at which a ray passes voxel centres 0 to n-1 of one axis.
pub(super) struct Faces {
    at: f64,
    step: f64,
    /// Number of the next centre, as a whole number in f64, and the number past the last.
    number: f64,
    limit: f64,
    /// Depth of the next centre; infinite when there is none.
    next: f64,
}

impl Faces {
    pub(super) fn new(at: f64, step: f64, entry: f64, n: usize) -> Self {
        let here = at + step * entry;
        let last = (n - 1) as f64;
        let mut faces = if step > 0.0 {
            Self { at, step, number: here.floor().max(0.0), limit: last, next: 0.0 }
        } else {
            Self { at, step, number: here.ceil().min(last), limit: 0.0, next: 0.0 }
        };
        faces.place();
        faces
    }

    fn place(&mut self) {
        let over = if self.step > 0.0 { self.number > self.limit } else { self.number < self.limit };
        self.next = if over || self.step == 0.0 { f64::INFINITY } else { (self.number - self.at) / self.step };
    }

    /// Depth of the next centre; infinite when there is none.
    pub(super) fn next(&self) -> f64 {
        self.next
    }

    /// Passes every centre at or before `depth`.
    pub(super) fn skip_to(&mut self, depth: f64) {
        while self.next <= depth {
            self.number += if self.step > 0.0 { 1.0 } else { -1.0 };
            self.place();
        }
    }
}

/// The smooth form of fog around distance `z`, between its kinks.
fn haze(fog: &Fog, z: f64) -> Haze {
    match fog.mode() {
        FogMode::Linear { .. } if fog.factor(z) >= 1.0 => Haze::Clear,
        FogMode::Linear { .. } if fog.factor(z) <= 0.0 => Haze::Full,
        FogMode::Linear { start, end } => Haze::Linear { end, scale: 1.0 / (end - start) },
        FogMode::Exp { density } => Haze::Exp { density },
        FogMode::Exp2 { density } => Haze::Exp2 { density },
    }
}

/// The scene's background, in the fog of the greatest distance where it asks for that.
fn background(scene: &Scene) -> Premultiplied {
    fogged(scene.background().premultiply(), scene.fog().filter(|_| scene.fogged_background()))
}

/// A colour as seen through the greatest distance of `fog`.
fn fogged(plain: Premultiplied, fog: Option<&Fog>) -> Premultiplied {
    match fog {
        Some(fog) => {
            let f = fog.factor(f64::MAX);
            let rgb = std::array::from_fn(|i| f * plain.rgb[i] + (1.0 - f) * plain.alpha * fog.color()[i]);
            Premultiplied { rgb, alpha: plain.alpha }
        }
        None => plain,
    }
}

/// The amount of light of an sRGB number (IEC 61966-2-1).
fn light_of(number: f64) -> f64 {
    if number > 0.04045 { libm::pow((number + 0.055) / 1.055, 12.0 / 5.0) } else { number / 12.92 }
}

/// A premultiplied colour of amounts of light, its straight components as sRGB numbers.
fn in_srgb(color: Premultiplied) -> Premultiplied {
    let number = |light: f64| if light > 0.003_130_8 { 1.055 * libm::exp(libm::log(light) / 2.4) - 0.055 } else { light * 12.92 };
    let alpha = color.alpha;
    let rgb = color.rgb.map(|c| if alpha > 0.0 { alpha * number((c / alpha).clamp(0.0, 1.0)) } else { 0.0 });
    Premultiplied { rgb, alpha }
}

#[cfg(test)]
mod lit;
#[cfg(test)]
mod tests;
