//! The eye: where it is, what it looks at, how it projects.
//!
//! ```text
//!  eye space                     window
//!     y up                        (0,0) +-----------> x, pixels
//!     |                                 |  (0.5,0.5) = centre of the first pixel
//!     o---- x right                     |
//!    /                                  v y, pixels; row 0 on top
//!   z towards us; the eye looks down -z; depth d = -z
//! ```

use crate::volume::Grid;
use crate::{Error, Result};
use glam::{DQuat, DVec3};

/// How points are projected onto the picture.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum Projection {
    /// Parallel rays; `height` of the view in world units, or fitted to the box.
    Orthographic {
        /// World height of the view; `None` fits the box's bounding sphere.
        height: Option<f64>,
    },
    /// Rays from the eye; `fov_y` is the full vertical angle in degrees, between 0 and 180.
    Perspective {
        /// Full vertical field of view in degrees.
        fov_y: f64,
    },
}

/// Where the eye is, in one of two forms.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Placement {
    /// Points in the world.
    LookAt {
        /// The eye.
        eye: DVec3,
        /// A point in the middle of the picture.
        target: DVec3,
        /// A direction that points upwards in the picture.
        up: DVec3,
    },
    /// Angles around the box's centre, starting from the subject's front (see [`crate::volume::Space`]).
    Orbit {
        /// Degrees the eye moves to the picture's right around the box.
        azimuth: f64,
        /// Degrees the eye rises.
        elevation: f64,
        /// Degrees the camera turns clockwise about its line of sight.
        roll: f64,
        /// 1 fits the box's bounding sphere into the picture; 2 shows things twice as large.
        zoom: f64,
    },
    /// Along an axis of the volume, before its whole box, along parallel rays.
    ///
    /// Of the two other axes x comes before y and y before z. Columns of the picture, from the left, are voxels along the first of them, rows, from
    /// the top, voxels along the second: looking along z a pixel's column and row are x and y. Seen from the other side, `backwards`, the picture is turned about its
    /// vertical: columns run from the last voxel to the first. This is so whatever the axes are in the world; where those of the volume are left-handed, and for `axis` 1
    /// where they are right-handed, the picture shows the world in a mirror.
    ///
    /// Unless the projection gives a height, the voxels just fit: a picture of as many columns and rows as there are voxels, equally far apart, has one at each pixel.
    Along {
        /// The axis: 0 for x, 1 for y, 2 for z, in index space.
        axis: usize,
        /// False looks towards higher indices, so that the first voxel is the nearest; true towards lower ones.
        backwards: bool,
    },
}

/// A camera as a scene describes it; [`Camera::resolve`] makes it concrete for one box.
///
/// # Guarantees
/// Every number is finite, the field of view lies strictly between 0 and 180 degrees, height and zoom are positive,
/// and `up` is not parallel to the line of sight.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Camera {
    placement: Placement,
    projection: Projection,
    near: Option<f64>,
}

impl Default for Camera {
    /// A three-quarter view from the front and a little above.
    fn default() -> Self {
        Self {
            placement: Placement::Orbit { azimuth: 30.0, elevation: 20.0, roll: 0.0, zoom: 1.2 },
            projection: Projection::Orthographic { height: None },
            near: None,
        }
    }
}

impl Camera {
    /// A camera from its parts.
    ///
    /// # Errors
    /// [`Error::Invalid`] when a number breaks the guarantees above.
    pub fn new(placement: Placement, projection: Projection) -> Result<Self> {
        match projection {
            Projection::Orthographic { height: Some(h) } if !(h > 0.0 && h.is_finite()) => {
                return Err(Error::invalid(format!("camera height {h}: must be positive and finite")));
            }
            Projection::Perspective { fov_y } if !(fov_y > 0.0 && fov_y < 180.0) => {
                return Err(Error::invalid(format!("camera fov_y {fov_y}: must lie between 0 and 180 degrees")));
            }
            _ => {}
        }
        match placement {
            Placement::LookAt { eye, target, up } => {
                for (name, v) in [("eye", eye), ("target", target), ("up", up)] {
                    if !v.is_finite() {
                        return Err(Error::invalid(format!("camera {name} {v}: must be finite")));
                    }
                }
                frame(eye, target, up)?;
            }
            Placement::Along { axis, .. } => {
                if axis > 2 {
                    return Err(Error::invalid(format!("camera along: axis {axis}: there are 0, 1 and 2")));
                }
                if matches!(projection, Projection::Perspective { .. }) {
                    return Err(Error::invalid("camera along: looks along parallel rays; choose the orthographic projection"));
                }
            }
            Placement::Orbit { azimuth, elevation, roll, zoom } => {
                for (name, v) in [("azimuth", azimuth), ("elevation", elevation), ("roll", roll)] {
                    if !v.is_finite() {
                        return Err(Error::invalid(format!("camera {name} {v}: must be finite")));
                    }
                }
                if !(zoom > 0.0 && zoom.is_finite()) {
                    return Err(Error::invalid(format!("camera zoom {zoom}: must be positive and finite")));
                }
            }
        }
        Ok(Self { placement, projection, near: None })
    }

    /// An orthographic camera turned `azimuth` and raised `elevation` degrees around the box, fitted to it.
    ///
    /// # Errors
    /// [`Error::Invalid`] when an angle is not finite.
    pub fn orbit(azimuth: f64, elevation: f64) -> Result<Self> {
        Self::new(Placement::Orbit { azimuth, elevation, roll: 0.0, zoom: 1.2 }, Projection::Orthographic { height: None })
    }

    /// The same camera that sees nothing nearer than depth `near` (world units along the view direction).
    ///
    /// # Errors
    /// [`Error::Invalid`] when `near` is negative, not finite, or 0 in perspective.
    pub fn with_near(mut self, near: f64) -> Result<Self> {
        let perspective = matches!(self.projection, Projection::Perspective { .. });
        if !near.is_finite() || near < 0.0 || (perspective && near == 0.0) {
            return Err(Error::invalid(format!("camera near {near}: must be finite and positive")));
        }
        self.near = Some(near);
        Ok(self)
    }

    /// Where the eye is.
    pub fn placement(&self) -> Placement {
        self.placement
    }

    /// How it projects.
    pub fn projection(&self) -> Projection {
        self.projection
    }

    /// The near plane's depth, where the scene gives one.
    pub fn near(&self) -> Option<f64> {
        self.near
    }

    /// The largest zoom up to `most` at which a picture of `width` x `height` pixels shows the whole box of `grid` in this camera's
    /// direction; `most` for look-at cameras and for those whose numbers fail.
    pub fn zoom_that_fits(&self, grid: &Grid, width: u32, height: u32, most: f64) -> f64 {
        let Placement::Orbit { azimuth, elevation, roll, .. } = self.placement else { return most };
        let at = |zoom: f64| {
            let camera = Self { placement: Placement::Orbit { azimuth, elevation, roll, zoom }, ..*self };
            let view = camera.resolve(grid, width, height).ok()?;
            let outside = |c: &DVec3| {
                let (x, y) = view.window(*c);
                let (x, y) = (x / f64::from(width) - 0.5, y / f64::from(height) - 0.5);
                view.depth(*c) <= 0.0 || x.abs().max(y.abs()) > 0.5
            };
            Some(!grid.corners().iter().any(outside))
        };
        // At zoom 1 the bounding sphere fits; steps of 2 % above it.
        (0..).map(|i| most / (1.0 + 0.02 * f64::from(i))).take_while(|&z| z > 1.0).find(|&z| at(z).unwrap_or(true)).unwrap_or(most.min(1.0))
    }

    /// The camera in numbers for the box of `grid` and a picture of `width` x `height` pixels.
    ///
    /// # Errors
    /// [`Error::Invalid`] when the numbers leave the range of f64 for this box.
    pub fn resolve(&self, grid: &Grid, width: u32, height: u32) -> Result<View> {
        let (center, radius) = (grid.center(), grid.radius());
        let (eye, target, up, zoom) = match self.placement {
            Placement::Along { axis, backwards } => return self.along(grid, (axis, backwards), (width, height)),
            Placement::LookAt { eye, target, up } => (eye, target, up, 1.0),
            Placement::Orbit { azimuth, elevation, roll, zoom } => {
                let (front, up) = grid.space().front_and_up();
                let right = up.cross(front);
                let turn = rotation(up, azimuth) * rotation(right, -elevation);
                let towards_eye = turn * front;
                let up = rotation(towards_eye, roll) * (turn * up);
                let distance = match self.projection {
                    Projection::Orthographic { .. } => 2.0 * radius,
                    // The sphere touches the upper and lower side of the picture at zoom 1.
                    Projection::Perspective { fov_y } => radius / libm::sin(fov_y.to_radians() * 0.5) / zoom,
                };
                (center + towards_eye * distance, center, up, zoom)
            }
        };
        let (right, up, forward) = frame(eye, target, up)?;
        let half_height = match self.projection {
            Projection::Orthographic { height: Some(h) } => 0.5 * h / zoom,
            Projection::Orthographic { height: None } => {
                // Fit the sphere to the shorter side.
                let aspect = f64::from(width) / f64::from(height);
                radius / zoom / aspect.min(1.0)
            }
            Projection::Perspective { fov_y } => libm::tan(fov_y.to_radians() * 0.5),
        };
        let perspective = matches!(self.projection, Projection::Perspective { .. });
        let far = grid.corners().iter().map(|c| (*c - eye).dot(forward)).fold(f64::NEG_INFINITY, f64::max);
        // Without a near plane of the scene's own: nothing behind an orthographic eye, and next to nothing before a perspective one.
        let near = self.near.unwrap_or(if perspective { far.abs() * 1e-6 } else { 0.0 });
        let scale = 2.0 * half_height / f64::from(height);
        View { eye, right, up, forward, perspective, scale, near, width, height }.checked(far)
    }

    /// The view along an axis of `grid`: see [`Placement::Along`].
    fn along(&self, grid: &Grid, (axis, backwards): (usize, bool), (width, height): (u32, u32)) -> Result<View> {
        let directions = grid.directions();
        let [across, down] = [[1, 2], [0, 2], [0, 1]][axis];
        let sign = if backwards { -1.0 } else { 1.0 };
        let (forward, right, up) = (directions.col(axis) * sign, directions.col(across) * sign, -directions.col(down));
        let askew = [forward.dot(right), forward.dot(up), right.dot(up)].into_iter().map(f64::abs).fold(0.0, f64::max);
        if askew > 1e-6 {
            return Err(Error::invalid("camera along: the volume's axes are not at right angles, so none is seen straight on"));
        }
        let (dims, spacing) = (grid.dims(), grid.spacing());
        let per_pixel = |axis: usize, pixels: u32| dims[axis] as f64 * spacing[axis] / f64::from(pixels);
        let fitted = per_pixel(across, width).max(per_pixel(down, height));
        let scale = match self.projection {
            Projection::Orthographic { height: Some(h) } => h / f64::from(height),
            _ => fitted,
        };
        let eye = grid.center() - forward * (2.0 * grid.radius());
        let near = self.near.unwrap_or(0.0);
        View { eye, right, up, forward, perspective: false, scale, near, width, height }.checked(0.0)
    }
}

impl View {
    /// The view itself, if its numbers and the box's largest depth `far` can be computed with.
    fn checked(self, far: f64) -> Result<Self> {
        let Self { eye, scale, .. } = self;
        if !(scale > 0.0 && scale.is_finite() && eye.is_finite() && far.is_finite()) {
            return Err(Error::invalid(format!(
                "camera: a picture {} world units high seen from {eye} cannot be computed",
                scale * f64::from(self.height)
            )));
        }
        Ok(self)
    }
}

/// Right, up and forward unit vectors of a camera.
fn frame(eye: DVec3, target: DVec3, up: DVec3) -> Result<(DVec3, DVec3, DVec3)> {
    let Some(forward) = (target - eye).try_normalize() else {
        return Err(Error::invalid(format!("camera eye {eye} and target {target}: the same point")));
    };
    let sideways = up.try_normalize().map(|u| forward.cross(u));
    match sideways {
        // An up within 1e-9 of the line of sight leaves the roll to rounding.
        Some(s) if s.length() > 1e-9 => {
            let right = s.normalize();
            Ok((right, right.cross(forward), forward))
        }
        _ => Err(Error::invalid(format!("camera up {up}: zero or along the line of sight {forward}"))),
    }
}

/// Right-handed rotation about `axis` by `degrees`. Quarter turns are exact, so that axis-aligned views are.
fn rotation(axis: DVec3, degrees: f64) -> DQuat {
    let half = degrees.rem_euclid(360.0).to_radians() * 0.5;
    let (s, c) = libm::sincos(half);
    DQuat::from_xyzw(axis.x * s, axis.y * s, axis.z * s, c)
}

/// A camera resolved for one box and one picture size: plain numbers.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct View {
    /// The eye in world space.
    pub eye: DVec3,
    /// Unit vector to the picture's right.
    pub right: DVec3,
    /// Unit vector to the picture's top.
    pub up: DVec3,
    /// Unit vector of the view direction.
    pub forward: DVec3,
    /// Whether rays meet in the eye.
    pub perspective: bool,
    /// Size of a pixel: world units (orthographic) or tangent of angle, world units at depth 1 (perspective).
    pub scale: f64,
    /// Nothing nearer than this depth is seen, world units.
    pub near: f64,
    /// Columns of pixels.
    pub width: u32,
    /// Rows of pixels.
    pub height: u32,
}

impl View {
    /// Picture-plane coordinates of window position (x,y): world units (orthographic) or per unit of depth (perspective).
    pub fn plane(&self, x: f64, y: f64) -> (f64, f64) {
        ((x - 0.5 * f64::from(self.width)) * self.scale, (0.5 * f64::from(self.height) - y) * self.scale)
    }

    /// The ray through window position (x,y) as (origin, direction), where origin + d * direction lies at depth d.
    ///
    /// The direction has length 1 / cos(angle to the view direction): 1 for orthographic rays.
    pub fn ray(&self, x: f64, y: f64) -> (DVec3, DVec3) {
        let (px, py) = self.plane(x, y);
        let offset = self.right * px + self.up * py;
        if self.perspective { (self.eye, self.forward + offset) } else { (self.eye + offset, self.forward) }
    }

    /// Depth of a world point along the view direction.
    pub fn depth(&self, world: DVec3) -> f64 {
        (world - self.eye).dot(self.forward)
    }

    /// Window position of a world point. In perspective the point must lie before the eye.
    pub fn window(&self, world: DVec3) -> (f64, f64) {
        let v = world - self.eye;
        let w = if self.perspective { v.dot(self.forward) } else { 1.0 };
        (0.5 * f64::from(self.width) + v.dot(self.right) / w / self.scale, 0.5 * f64::from(self.height) - v.dot(self.up) / w / self.scale)
    }
}
