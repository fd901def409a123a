//! Framing: a camera that shows what the scene shows of its volume, as large as the picture allows.
//!
//! ```text
//!   +-----------------+        bricks of the volume in which something shows, through the clip planes, bound the view;
//!   |   . . # # .     |        the camera keeps its direction and moves sideways and nearer until they fill the picture
//!   |   . # # # # .   |
//!   +-----------------+
//! ```
//! With r, u and f the unit vectors to the picture's right, to its top and into it, the parallel view needs the extents of p.r and p.u over all corners p of
//! those bricks. In perspective, with t the tangent of half the angle across the picture, a point is inside on the left and right where
//! |(p - e).r| <= t (p - e).f, so with a = max(p.r - t p.f) and b = max(-p.r - t p.f) the nearest eye has e.f = -(a + b) / 2t and e.r = (a - b) / 2;
//! likewise upwards; the eye is the farther of both.

use super::by_place::ByPlace;
use super::{Blend, Camera, LevelSurface, Placement, Projection, Scene, TransferFunction, View};
use crate::Volume;
use crate::volume::bricks::{BRICK, Bricks};
use crate::volume::{Grid, OpacityFrom};
use glam::{DAffine3, DVec3};

/// Share of the picture's width or height that is filled.
const FILLED: f64 = 0.94;

/// Opacity of a brick's length, or of a longer piece in large volumes (see [`USUAL`]), from which on values count as seen.
const SEEN: f64 = 0.05;

/// Voxels along the longest side up to which [`SEEN`] goes by a brick's length; in larger volumes it goes by as large a share of the box as that
/// is of this one, a thirty-second.
const USUAL: f64 = 128.0;

/// A brick with fewer bricks around it that show something counts as noise.
const COMPANY: usize = 3;

/// Brightness of a projected value, over black, from which on it counts as seen.
const BRIGHT: f64 = 0.1;

/// What of a volume a scene shows: bricks of 4 x 4 x 4 cells, in world space.
#[derive(Debug, Clone)]
pub struct Visible {
    /// From index to world space.
    to_world: DAffine3,
    /// Lowest and highest corners, index space.
    bricks: Vec<[DVec3; 2]>,
}

impl Visible {
    /// The bricks of `volume` in which `scene` shows something; `None` where it shows nothing, or everything counts the same (minima); and where a cut
    /// plane shows, which may lie anywhere in the box.
    pub fn of(scene: &Scene, volume: &Volume) -> Option<Self> {
        if !scene.cuts().is_empty() {
            return None;
        }
        let bricks = match opacity_bricks(scene, volume) {
            Some(bricks) => bricks,
            None => volume.bricks(),
        };
        let shows = Shown::of(scene, volume, bricks)?;
        let found = Self::bricks(scene, volume, bricks, &shows);
        (!found.bricks.is_empty()).then_some(found)
    }

    fn bricks(scene: &Scene, volume: &Volume, bricks: &Bricks, shows: &Shown) -> Self {
        let grid = volume.grid();
        let ([nx, ny, nz], to_world) = (bricks.dims, grid.index_to_world());
        let side = BRICK as f64;
        let (slope, intercept) = volume.rescale();
        let of_region = |r: &super::FocusRegion| Shown::opaque(r.transfer(), r.transfer().opacity_length(grid), grid);
        let regions: Vec<Shown> = scene.regions().iter().map(of_region).collect();
        let places = ByPlace::new(scene, volume, least_opacity(scene.opacity_length(grid), grid), 0.0);
        let seen: Vec<bool> = bricks
            .ranges
            .iter()
            .enumerate()
            .map(|(at, &(low, high))| {
                let (a, b) = (slope * f64::from(low) + intercept, slope * f64::from(high) + intercept);
                low <= high && places.show(at, volume, bricks, |n| regions.get(n).unwrap_or(shows).between(a.min(b), a.max(b)))
            })
            .collect();
        // Of volumes that are one brick thin nothing has much company.
        let company = if nx.min(ny).min(nz) > 1 { COMPANY } else { 0 };
        let around = |n: usize, most: usize| n.saturating_sub(1)..(n + 2).min(most);
        let bounds = grid.index_bounds();
        // Bricks at the border reach to the box's faces, which may lie half a voxel farther out.
        let ends = |n: usize, axis: usize, count: usize| {
            let low = if n == 0 { bounds.0[axis] } else { n as f64 * side };
            (low, if n + 1 == count { bounds.1[axis] } else { (n + 1) as f64 * side })
        };
        let mut found = Self { to_world, bricks: Vec::new() };
        for z in 0..nz {
            for y in 0..ny {
                for x in (0..nx).filter(|x| seen[(z * ny + y) * nx + x]) {
                    let count = around(z, nz).flat_map(|k| around(y, ny).map(move |j| (k * ny + j) * nx));
                    let count: usize = count.map(|row| around(x, nx).filter(|i| seen[row + i]).count()).sum();
                    let (x, y, z) = (ends(x, 0, nx), ends(y, 1, ny), ends(z, 2, nz));
                    let brick = [DVec3::new(x.0, y.0, z.0), DVec3::new(x.1, y.1, z.1)];
                    let kept = scene.clip_planes().iter().all(|plane| found.farthest(&brick, plane.normal()) > plane.offset());
                    if kept && count > company {
                        found.bricks.push(brick);
                    }
                }
            }
        }
        found
    }

    /// The greatest n . p over all points p of a brick.
    fn farthest(&self, [low, high]: &[DVec3; 2], n: DVec3) -> f64 {
        // n . (M i + t) = (M^T n) . i + n . t, the greatest of which has each coordinate at one end.
        let along = self.to_world.matrix3.transpose() * n;
        (along * *low).max(along * *high).element_sum() + n.dot(self.to_world.translation)
    }

    /// The least and the greatest n . p over all points p of the bricks.
    pub fn extent(&self, n: DVec3) -> [f64; 2] {
        let most = |n: DVec3| self.bricks.iter().map(|brick| self.farthest(brick, n)).fold(f64::NEG_INFINITY, f64::max);
        [-most(-n), most(n)]
    }

    /// Number of bricks.
    pub fn len(&self) -> usize {
        self.bricks.len()
    }

    /// Never true: a value of this type has bricks.
    pub fn is_empty(&self) -> bool {
        self.bricks.is_empty()
    }
}

/// Bricks of the number that opacities of colours go by; `None` for volumes of values.
fn opacity_bricks<'v>(scene: &Scene, volume: &'v Volume) -> Option<&'v Bricks> {
    Some(&volume.color_bricks(scene.color_opacity(volume)?)?.bricks)
}

/// Opacity per `length` from which on a brick of a volume on `grid` is seen.
fn least_opacity(length: f64, grid: &Grid) -> f64 {
    // 1 - (1 - a)^(side / length) = SEEN, solved for a.
    let most = grid.dims().into_iter().max().unwrap_or(1) as f64;
    let cells = BRICK as f64 * f64::max(1.0, most / USUAL);
    let slabs = cells * grid.smallest_spacing() / length;
    (-libm::expm1(libm::log1p(-SEEN) / slabs)).clamp(f64::MIN_POSITIVE, 1.0)
}

/// For which values something shows.
enum Shown {
    /// Within one of these ranges.
    Ranges(Vec<[f64; 2]>),
    /// Between the ends of a piece, one of these lies.
    Crossings(Vec<f64>),
}

impl Shown {
    fn of(scene: &Scene, volume: &Volume, bricks: &Bricks) -> Option<Self> {
        let grid = volume.grid();
        let stored = bricks.range;
        let (slope, intercept) = volume.rescale();
        let (a, b) = (slope * stored.0 + intercept, slope * stored.1 + intercept);
        let (min, max) = (a.min(b), a.max(b));
        if !(min.is_finite() && max.is_finite()) {
            return None;
        }
        match scene.blend() {
            Blend::Over | Blend::Under | Blend::Add => {
                let by_value = match scene.transfer2d() {
                    _ if scene.color_opacity(volume) == Some(OpacityFrom::Alpha) => scene.transfer().with_own_alpha(),
                    Some(transfer) => transfer.shown(min, max).ok()?,
                    None => scene.transfer().clone(),
                };
                Some(Self::opaque(&by_value, scene.opacity_length(grid), grid))
            }
            Blend::Iso { level } => Some(Self::Ranges(vec![[level, f64::INFINITY]])),
            Blend::Surfaces => {
                Some(Self::Crossings(scene.levels().iter().filter(|l| l.opacity() > 0.0).map(LevelSurface::level).collect()))
            }
            Blend::Mip | Blend::AttenuatedMip { .. } | Blend::Lmip { .. } | Blend::Average => {
                Some(Self::Ranges(bright(scene.transfer(), min, max)))
            }
            // Anything may be the least.
            Blend::Min => None,
        }
    }

    /// Values at which a brick of a volume on `grid` is seen through `transfer`, whose opacities refer to `length`.
    fn opaque(transfer: &TransferFunction, length: f64, grid: &Grid) -> Self {
        Self::Ranges(ranges_above(transfer.opacity(), least_opacity(length, grid), |a| a))
    }

    fn between(&self, low: f64, high: f64) -> bool {
        match self {
            Self::Ranges(ranges) => ranges.iter().any(|[from, to]| low <= *to && high >= *from),
            Self::Crossings(levels) => levels.iter().any(|&level| low <= level && level <= high),
        }
    }
}

/// Ranges of values in which `transfer` makes a projected value stand out from black.
fn bright(transfer: &TransferFunction, min: f64, max: f64) -> Vec<[f64; 2]> {
    let knots = transfer.knots().into_iter().filter(|v| (min..=max).contains(v));
    let mut values: Vec<f64> = knots.chain([min, max]).collect();
    values.sort_by(f64::total_cmp);
    let points: Vec<(f64, f64)> = values
        .into_iter()
        .map(|v| {
            let color = transfer.eval(v);
            (v, color.alpha * color.rgb.into_iter().fold(0.0, f64::max))
        })
        .collect();
    ranges_above(&points, BRIGHT, |x| x)
}

/// Where the function piecewise linear between `points`, constant beyond them, is at least `least`.
fn ranges_above<C: Copy>(points: &[(f64, C)], least: f64, number: impl Fn(C) -> f64) -> Vec<[f64; 2]> {
    let mut ranges = Vec::new();
    let mut add = |from: f64, to: f64| ranges.push([from, to]);
    if let (Some(&(first, a)), Some(&(last, b))) = (points.first(), points.last()) {
        if number(a) >= least {
            add(f64::NEG_INFINITY, first);
        }
        if number(b) >= least {
            add(last, f64::INFINITY);
        }
    }
    for pair in points.windows(2) {
        let [(v0, a), (v1, b)] = [pair[0], pair[1]].map(|(v, c)| (v, number(c)));
        let crossing = || v0 + (v1 - v0) * ((least - a) / (b - a));
        match (a >= least, b >= least) {
            (true, true) => add(v0, v1),
            (true, false) => add(v0, crossing()),
            (false, true) => add(crossing(), v1),
            (false, false) => {}
        }
    }
    ranges
}

impl Scene {
    /// The scene with its camera moved, its direction kept, so that what shows of `volume` (see [`Visible`]) fills the picture but for a small margin;
    /// `zoom` 1 leaves it at that, 2 shows it twice as large. A parallel camera whose height is given is moved sideways alone. Nothing changes for
    /// cameras in the look-at form, and where nothing shows.
    #[must_use]
    pub fn framed(self, volume: &Volume, zoom: f64) -> Self {
        let framed = Visible::of(&self, volume).and_then(|visible| self.camera_for(&visible, volume.grid(), zoom));
        match framed {
            Some(camera) => self.with_camera(camera),
            None => self,
        }
    }

    fn camera_for(&self, visible: &Visible, grid: &Grid, zoom: f64) -> Option<Camera> {
        let camera = self.camera();
        let Placement::Orbit { .. } = camera.placement() else { return None };
        let (width, height) = self.size();
        let view = camera.resolve(grid, width, height).ok()?;
        let (right, up, forward) = (view.right, view.up, view.forward);
        let middle = |[a, b]: [f64; 2]| 0.5 * (a + b);
        let aspect = f64::from(width) / f64::from(height);
        let (eye, target, projection) = match camera.projection() {
            Projection::Orthographic { height: given } => {
                let (x, y) = (visible.extent(right), visible.extent(up));
                let fitted = f64::max(y[1] - y[0], (x[1] - x[0]) / aspect) / FILLED / zoom;
                let height = given.map_or(fitted, |height| height / zoom);
                let target = right * middle(x) + up * middle(y) + forward * middle(visible.extent(forward));
                // Just before the box, of which nothing is cut off: depths, and fog with them, begin where the volume does.
                let nearest = grid.corners().iter().map(|c| (*c - target).dot(forward)).fold(f64::INFINITY, f64::min);
                (target + forward * (nearest - 1e-3 * grid.radius()), target, Projection::Orthographic { height: Some(height) })
            }
            Projection::Perspective { fov_y } => {
                let tangent = libm::tan(fov_y.to_radians() * 0.5) * FILLED;
                let side = |along: DVec3, t: f64| {
                    let (a, b) = (visible.extent(along - forward * t)[1], visible.extent(-along - forward * t)[1]);
                    (0.5 * (a - b), -0.5 * (a + b) / t)
                };
                let ((x, deep_x), (y, deep_y)) = (side(right, tangent * aspect), side(up, tangent));
                let front = visible.extent(forward);
                let target = right * x + up * y + forward * middle(front);
                // Closer by the zoom; not into what shows.
                let away = ((middle(front) - deep_x.min(deep_y)) / zoom).max(0.5 * (front[1] - front[0]) * 1.02);
                (target - forward * away, target, Projection::Perspective { fov_y })
            }
        };
        let framed = Camera::new(Placement::LookAt { eye, target, up }, projection).ok()?;
        let framed = match camera.near() {
            Some(near) => framed.with_near(near).ok()?,
            None => framed,
        };
        framed.resolve(grid, width, height).ok().map(|_| framed)
    }
}

impl Scene {
    /// Depths from the eye, world units along the view direction, at which the box of `volume` begins and ends, and those at which what shows of it does
    /// (see [`Visible`]); none below 0, where the eye is. `None` where the camera does not resolve, or nothing of the box is in front of it.
    pub fn depths(&self, volume: &Volume) -> Option<SceneDepths> {
        let (view, whole) = self.box_depths(volume)?;
        let eye = view.eye.dot(view.forward);
        let seen = Visible::of(self, volume).and_then(|visible| ahead(visible.extent(view.forward).map(|d| d - eye)));
        // Bricks at the border reach half a voxel beyond the box at most.
        let visible = seen.map(|[near, far]| [near.max(whole[0]), far.min(whole[1])]);
        Some(SceneDepths { whole, visible })
    }

    /// The scene's view, and [`SceneDepths::whole`]: all that needs no look at bricks.
    pub(super) fn box_depths(&self, volume: &Volume) -> Option<(View, [f64; 2])> {
        let (width, height) = self.size();
        let view = self.camera().resolve(volume.grid(), width, height).ok()?;
        let corners = volume.grid().corners().map(|c| view.depth(c));
        let whole = ahead(corners.into_iter().fold([f64::INFINITY, f64::NEG_INFINITY], |[a, b], d| [a.min(d), b.max(d)]))?;
        Some((view, whole))
    }
}

/// As much of a range of depths as is in front of the eye.
fn ahead([near, far]: [f64; 2]) -> Option<[f64; 2]> {
    (far > 0.0).then(|| [near.max(0.0), far])
}

/// Depths at which things begin and end: see [`Scene::depths`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SceneDepths {
    /// Of the box.
    pub whole: [f64; 2],
    /// Of what shows in it.
    pub visible: Option<[f64; 2]>,
}

impl Scene {
    /// Cameras around what shows of `volume`, `count` of them at equal angles, the first in the scene's own direction: all at one distance and in one size,
    /// so that the last leads to the first without a jump and everything stays in the picture; `zoom` 2 shows it twice as large. The camera turns to the
    /// picture's right about the axis upwards through the middle of what shows, or of the box where nothing does.
    ///
    /// # Errors
    /// [`crate::Error::Invalid`] for a camera in the look-at form, and for numbers that leave the range of f64.
    pub fn turntable(&self, volume: &Volume, count: u32, zoom: f64) -> crate::Result<Vec<Camera>> {
        let (width, height) = self.size();
        let grid = volume.grid();
        let Placement::Orbit { azimuth, elevation, roll, .. } = self.camera().placement() else {
            return Err(crate::Error::invalid(
                "turntable: turns a camera in the orbit form (azimuth, elevation); this scene's stands at an eye of its own",
            ));
        };
        let corners = grid.corners();
        let whole = |n: DVec3| corners.iter().map(|c| c.dot(n)).fold([f64::INFINITY, f64::NEG_INFINITY], |[a, b], x| [a.min(x), b.max(x)]);
        let visible = Visible::of(self, volume);
        let extent = |n: DVec3| visible.as_ref().map_or_else(|| whole(n), |v| v.extent(n));
        let middle = DVec3::from_array([DVec3::X, DVec3::Y, DVec3::Z].map(|n| 0.5 * extent(n).iter().sum::<f64>()));
        // From the middle to the farthest point along n.
        let reach = |n: DVec3| extent(n)[1] - middle.dot(n);
        let turned = |i: u32| {
            let placement = Placement::Orbit { azimuth: azimuth + 360.0 * f64::from(i) / f64::from(count), elevation, roll, zoom: 1.0 };
            Camera::new(placement, self.camera().projection())?.resolve(grid, width, height)
        };
        let views = (0..count).map(turned).collect::<crate::Result<Vec<_>>>()?;
        let aspect = f64::from(width) / f64::from(height);
        let most = |f: &dyn Fn(&View) -> f64| views.iter().map(f).fold(0.0, f64::max);
        let (size, away) = match self.camera().projection() {
            Projection::Orthographic { height: given } => {
                let sideways = most(&|v| reach(v.right).max(reach(-v.right)));
                let upwards = most(&|v| reach(v.up).max(reach(-v.up)));
                let fitted = 2.0 * upwards.max(sideways / aspect) / FILLED;
                // Before the box, as far off for every frame: fog stays what it is.
                let away = most(&|v| corners.iter().map(|c| (middle - *c).dot(v.forward)).fold(0.0, f64::max)) + 1e-3 * grid.radius();
                (given.unwrap_or(fitted) / zoom, away)
            }
            Projection::Perspective { fov_y } => {
                let tangent = libm::tan(fov_y.to_radians() * 0.5) * FILLED;
                let side = |v: &View, n: DVec3, t: f64| reach(n - v.forward * t) / t;
                let needed = most(&|v| {
                    let (x, y) = (tangent * aspect, tangent);
                    side(v, v.right, x).max(side(v, -v.right, x)).max(side(v, v.up, y)).max(side(v, -v.up, y))
                });
                let deep = most(&|v| reach(-v.forward));
                (0.0, (needed / zoom).max(1.02 * deep))
            }
        };
        let camera = |view: &View| {
            let projection = match self.camera().projection() {
                Projection::Orthographic { .. } => Projection::Orthographic { height: Some(size) },
                other @ Projection::Perspective { .. } => other,
            };
            Camera::new(Placement::LookAt { eye: middle - view.forward * away, target: middle, up: view.up }, projection)
        };
        views.iter().map(camera).collect()
    }
}
