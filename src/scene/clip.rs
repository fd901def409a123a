//! Planes that cut the box.

use crate::{Error, Result};
use glam::DVec3;

/// Most clip planes a scene may have (OpenGL promises six).
pub const MAX_CLIP_PLANES: usize = 6;

/// Keeps the half of the world where normal . p >= offset.
///
/// # Guarantees
/// The normal has length 1 and all numbers are finite.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ClipPlane {
    normal: DVec3,
    offset: f64,
}

impl ClipPlane {
    /// The plane normal . p = offset in world space; what lies along `normal` from it is kept.
    ///
    /// # Errors
    /// [`Error::Invalid`] for a zero normal or a number that is not finite.
    pub fn new(normal: DVec3, offset: f64) -> Result<Self> {
        let length = normal.length();
        if !(length > 0.0 && length.is_finite() && offset.is_finite()) {
            return Err(Error::invalid(format!(
                "clip plane with normal {normal}, offset {offset}: the normal must not be 0 and all numbers finite"
            )));
        }
        if super::is_unit(length) {
            return Ok(Self { normal, offset });
        }
        Ok(Self { normal: normal / length, offset: offset / length })
    }

    /// Unit normal, pointing to what is kept.
    pub fn normal(&self) -> DVec3 {
        self.normal
    }

    /// Distance of the plane from the world's origin along the normal.
    pub fn offset(&self) -> f64 {
        self.offset
    }

    /// Signed distance of a point: positive where it is kept.
    pub fn distance(&self, p: DVec3) -> f64 {
        self.normal.dot(p) - self.offset
    }
}
