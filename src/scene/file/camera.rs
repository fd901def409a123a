//! The section `[camera]`: where the eye is and how it projects.

use super::section::{Context, Given, Rivals, choices};
use crate::scene::{Camera, Placement, Projection, Scene};
use crate::volume::Grid;
use crate::{Error, Result, Volume};
use glam::DVec3;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

#[derive(Debug, Clone, Default, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub(super) struct CameraKeys {
    /// Parallel rays (orthographic, the default) or rays from the eye (perspective).
    pub projection: Option<ProjectionKey>,
    /// Look-at form: the eye, world units.
    pub eye: Option<[f64; 3]>,
    /// Look-at form: the point in the middle of the picture; the box's centre unless given.
    pub target: Option<[f64; 3]>,
    /// Look-at form: a direction that points upwards in the picture; the subject's up unless given.
    pub up: Option<[f64; 3]>,
    /// Orbit form: degrees around the box to the right, from the subject's front; 30 unless given.
    pub azimuth: Option<f64>,
    /// Orbit form: degrees upwards; 20 unless given.
    pub elevation: Option<f64>,
    /// Orbit form: degrees the camera turns clockwise about its line of sight.
    pub roll: Option<f64>,
    /// Orbit form: 2 shows things twice as large as they fit; 1 unless given.
    pub zoom: Option<f64>,
    /// Orbit form: what fits into the picture at zoom 1: what the transfer function shows, through the clip planes (visible, the default), or the
    /// box's bounding sphere, about whose centre the camera turns then (box; its zoom is 1.2 unless given, or as much as shows all of a long box).
    pub fit: Option<FitKey>,
    /// Along an axis of the volume, towards higher indices (x, y, z) or lower ones (-x, -y, -z), instead of the other forms: columns of the picture are voxels along the first of the
    /// two other axes, rows, from the top, along the second; from the other side columns run backwards.
    pub along: Option<AlongKey>,
    /// Orthographic: world height of the view; fitted to the box unless given.
    pub height: Option<f64>,
    /// Perspective: full vertical angle of the view in degrees; 30 unless given.
    pub fov_y: Option<f64>,
    /// Depth of the near plane, world units.
    pub near: Option<f64>,
}

choices! {
    ProjectionKey { Orthographic, Perspective }
}

choices! {
    FitKey { Visible, Box }
}

/// An axis of the volume, and the way along it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
pub(super) enum AlongKey {
    #[serde(rename = "x")]
    X,
    #[serde(rename = "-x")]
    MinusX,
    #[serde(rename = "y")]
    Y,
    #[serde(rename = "-y")]
    MinusY,
    #[serde(rename = "z")]
    Z,
    #[serde(rename = "-z")]
    MinusZ,
}

impl AlongKey {
    const ALL: [Self; 6] = [Self::X, Self::MinusX, Self::Y, Self::MinusY, Self::Z, Self::MinusZ];

    /// The axis, and whether it is followed backwards.
    fn axis(self) -> (usize, bool) {
        match self {
            Self::X => (0, false),
            Self::MinusX => (0, true),
            Self::Y => (1, false),
            Self::MinusY => (1, true),
            Self::Z => (2, false),
            Self::MinusZ => (2, true),
        }
    }
}

pub(super) const RIVALS: &[Rivals] = &[
    (&["camera.eye"], &["camera.azimuth", "camera.elevation", "camera.roll", "camera.zoom", "camera.fit", "camera.along"]),
    (&["camera.azimuth", "camera.elevation"], &["camera.eye", "camera.target", "camera.up", "camera.along"]),
    (
        &["camera.along"],
        &["camera.eye", "camera.target", "camera.up", "camera.azimuth", "camera.elevation", "camera.roll", "camera.zoom", "camera.fit"],
    ),
    (&["camera.height"], &["camera.fov_y"]),
    (&["camera.fov_y"], &["camera.height"]),
];

impl CameraKeys {
    /// The keys that say what `camera` is.
    pub(super) fn of(camera: &Camera) -> Self {
        let (projection, height, fov_y) = match camera.projection() {
            Projection::Orthographic { height } => (ProjectionKey::Orthographic, height, None),
            Projection::Perspective { fov_y } => (ProjectionKey::Perspective, None, Some(fov_y)),
        };
        let (eye, target, up, orbit) = match camera.placement() {
            Placement::LookAt { eye, target, up } => (Some(eye), Some(target), Some(up), None),
            Placement::Orbit { azimuth, elevation, roll, zoom } => (None, None, None, Some([azimuth, elevation, roll, zoom])),
            Placement::Along { .. } => (None, None, None, None),
        };
        let along = match camera.placement() {
            Placement::Along { axis, backwards } => AlongKey::ALL.into_iter().find(|key| key.axis() == (axis, backwards)),
            _ => None,
        };
        Self {
            projection: Some(projection),
            eye: eye.map(|p| p.to_array()),
            target: target.map(|p| p.to_array()),
            up: up.map(|p| p.to_array()),
            azimuth: orbit.map(|o| o[0]),
            elevation: orbit.map(|o| o[1]),
            roll: orbit.map(|o| o[2]),
            zoom: orbit.map(|o| o[3]),
            // Scenes hold what a camera came to: its zoom is that of the box.
            fit: orbit.map(|_| FitKey::Box),
            along,
            height,
            fov_y,
            near: camera.near(),
        }
    }

    /// A camera as far as it can be made without the volume, so that a mistake is found before one is loaded.
    pub(super) fn before_data(&self, cx: &Context<'_>) -> Result<Camera> {
        // A look-at camera whose defaults come from the box is checked when there is one.
        match (self.eye, self.target, self.up) {
            (Some(_), Some(_), Some(_)) | (None, ..) => self.camera(cx, &Grid::with_spacing([1; 3], [1.0; 3])?, (64, 64)),
            _ => {
                self.refuse_mixed(cx)?;
                self.projection(cx).map(|_| Camera::default())
            }
        }
    }

    /// How many times as large as they fit things are shown.
    pub(super) fn zoom(&self) -> f64 {
        self.zoom.unwrap_or(1.0)
    }

    /// `scene` with the camera for its volume.
    pub(super) fn apply(&self, cx: &Context<'_>, scene: Scene, volume: &Volume) -> Result<Scene> {
        let camera = self.camera(cx, volume.grid(), scene.size())?;
        let scene = scene.with_camera(camera);
        // The near plane is told in depths of the camera about the box.
        let visible = self.eye.is_none() && self.along.is_none() && self.fit != Some(FitKey::Box) && self.near.is_none();
        Ok(if visible { scene.framed(volume, self.zoom()) } else { scene })
    }

    /// The camera for the box of `grid` and a picture of so many columns and rows.
    pub(super) fn camera(&self, cx: &Context<'_>, grid: &Grid, (width, height): (u32, u32)) -> Result<Camera> {
        let projection = self.projection(cx)?;
        let placement = match self.placement(cx, grid)? {
            // A height that is given is the height of the view, so nothing is zoomed.
            Placement::Orbit { azimuth, elevation, roll, .. }
                if self.zoom.is_none() && matches!(projection, Projection::Orthographic { height: Some(_) }) =>
            {
                Placement::Orbit { azimuth, elevation, roll, zoom: 1.0 }
            }
            // Unless the scene says how large, no corner of a long box is cut off.
            placement @ Placement::Orbit { azimuth, elevation, roll, zoom } if self.zoom.is_none() => {
                let zoom = Camera::new(placement, projection).map_or(zoom, |camera| camera.zoom_that_fits(grid, width, height, zoom));
                Placement::Orbit { azimuth, elevation, roll, zoom }
            }
            placement => placement,
        };
        let camera = Camera::new(placement, projection).and_then(|camera| match self.near {
            Some(near) => camera.with_near(near),
            None => Ok(camera),
        });
        camera.map_err(|e| cx.places.locate(e))
    }

    fn projection(&self, cx: &Context<'_>) -> Result<Projection> {
        if self.projection == Some(ProjectionKey::Perspective) {
            let why = "belongs to orthographic cameras; a perspective one has camera.fov_y";
            cx.refuse(&[("camera.height", self.height.is_some())], why)?;
            return Ok(Projection::Perspective { fov_y: self.fov_y.unwrap_or(30.0) });
        }
        let why = "needs camera.projection = \"perspective\"; an orthographic one has height";
        cx.refuse(&[("camera.fov_y", self.fov_y.is_some())], why)?;
        Ok(Projection::Orthographic { height: self.height })
    }

    /// Refuses keys of the orbit form beside an eye.
    fn refuse_mixed(&self, cx: &Context<'_>) -> Result<()> {
        self.refuse_orbit(cx, "mixes the orbit form (azimuth, elevation, roll, zoom, fit) with the look-at form (eye, target, up)")
    }

    /// Refuses keys of the orbit form, for the reason `why`.
    fn refuse_orbit(&self, cx: &Context<'_>, why: &str) -> Result<()> {
        let orbit: [Given; 5] = [
            ("camera.fit", self.fit.is_some()),
            ("camera.azimuth", self.azimuth.is_some()),
            ("camera.elevation", self.elevation.is_some()),
            ("camera.roll", self.roll.is_some()),
            ("camera.zoom", self.zoom.is_some()),
        ];
        cx.refuse(&orbit, why)
    }

    fn placement(&self, cx: &Context<'_>, grid: &Grid) -> Result<Placement> {
        if let Some(along) = self.along {
            let look = [("camera.eye", self.eye.is_some()), ("camera.target", self.target.is_some()), ("camera.up", self.up.is_some())];
            cx.refuse(&look, "camera.along looks along an axis; give one of them")?;
            self.refuse_orbit(cx, "camera.along looks along an axis; give one of them")?;
            let (axis, backwards) = along.axis();
            return Ok(Placement::Along { axis, backwards });
        }
        let Some(eye) = self.eye else {
            let look = [("camera.target", self.target.is_some()), ("camera.up", self.up.is_some())];
            cx.refuse(&look, "belongs to the look-at form, which needs camera.eye")?;
            let Placement::Orbit { azimuth, elevation, roll, zoom } = Camera::default().placement() else {
                return Err(Error::invalid("camera: the default camera is not in the orbit form"));
            };
            return Ok(Placement::Orbit {
                azimuth: self.azimuth.unwrap_or(azimuth),
                elevation: self.elevation.unwrap_or(elevation),
                roll: self.roll.unwrap_or(roll),
                zoom: self.zoom.unwrap_or(zoom),
            });
        };
        self.refuse_mixed(cx)?;
        let eye = DVec3::from_array(eye);
        let target = self.target.map_or(grid.center(), DVec3::from_array);
        let (front, up) = grid.space().front_and_up();
        // Seen from straight above or below, the subject's front points upwards.
        let steep = (target - eye).try_normalize().is_some_and(|d| d.cross(up).length() < 1e-6);
        Ok(Placement::LookAt { eye, target, up: self.up.map_or(if steep { front } else { up }, DVec3::from_array) })
    }
}
