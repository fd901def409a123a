//! A build without what a plain scene does not need, to measure what the default build pays for having it: `--cfg slicestack_lean`.
//!
//! Such a build has no fog, no clip planes, no slabs between slices and no check for voxels that are NaN, neither as stages nor
//! as questions asked on the way; it refuses scenes that want them. It is for `.ci/instructions.py` and for nobody else.

use crate::scene::{Algorithm, OptionalStage, Scene};
use crate::{Error, Result};

/// Whether this is such a build.
pub(crate) const LEAN: bool = cfg!(slicestack_lean);

/// What only scenes that are not plain have: nothing here, known to the compiler.
#[inline(always)]
pub(crate) fn extra<T>(part: Option<T>) -> Option<T> {
    if LEAN { None } else { part }
}

/// Refuses what a lean build would draw wrongly.
pub(crate) fn check(scene: &Scene, non_finite: usize) -> Result<()> {
    let plain = OptionalStage::wanted(scene).next().is_none()
        && scene.clip_planes().is_empty()
        && scene.cuts().is_empty()
        && scene.jitter().is_none()
        && scene.algorithm() == Algorithm::Slices
        && !scene.method().is_pre_integrated()
        && !scene.method().merge
        && scene.surfaces().is_none()
        && non_finite == 0;
    if LEAN && !plain {
        return Err(Error::invalid(
            "this build (slicestack_lean) draws plain scenes alone: no fog or other stages of the kind, clip planes or pre-integration",
        ));
    }
    Ok(())
}
