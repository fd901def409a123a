//! The fixed-function pipeline of OpenGL 1.x, fragment by fragment and bit depth by bit depth.
//!
//! ```text
//!  slice polygon --coverage--> fragment --texture matrix, division by q--> (s,t,p)
//!     texture (R8, RGBA8, floats) --filter, wrap--> value --table--> colour     (pre-classified: the colour itself)
//!     --environment--> --fog--> --clamp, round--> --alpha test--> --blend--> framebuffer (8, 16 bits, floats)
//! ```
//! Plain scalar code, a fragment at a time: what counts here is that each step is the one OpenGL describes. Nothing is passed
//! over: every slice and every fragment inside the scissor is drawn.
//!
//! Texture coordinates are f64, so that they are those of the plane and not of some driver's interpolation. Texels are filtered,
//! looked up and fogged in f32. Blending is f64, in which products of any two levels and their sums are exact, and is rounded to
//! the framebuffer's numbers once.

mod blend;
mod coords;
mod draw;
mod fog;
mod table;
mod texture;

pub(crate) use draw::Pipeline;
pub(crate) use table::Table;
pub(crate) use texture::{Texture, TextureKey, Values};

use crate::scene::{Fits, OpenGl, OptionalStage, Scene};
use crate::tally::LeftOut;
use crate::volume::{BoxConvention, Volume};
use crate::{Error, Result};
use glam::DVec4;

/// # Errors
/// [`Error::Invalid`] where q, which divides texture coordinates, vanishes or changes sign within the box, or where a quotient
/// is too large for a coordinate. Both are affine over their denominator, so the box's corners tell.
pub(crate) fn check_matrix(state: &OpenGl, volume: &Volume) -> Result<()> {
    // A coordinate beyond this has no fraction left to filter with.
    const FARTHEST: f64 = 1e9;
    let (lo, hi) = match volume.grid().convention() {
        BoxConvention::Cells => ([0.0; 3], [1.0; 3]),
        BoxConvention::Nodes => {
            let n = volume.grid().dims().map(|n| n as f64);
            (n.map(|n| 0.5 / n), n.map(|n| 1.0 - 0.5 / n))
        }
    };
    let corners: Vec<DVec4> = (0..8)
        .map(|c| {
            let at = |axis: usize| if c >> axis & 1 == 1 { hi[axis] } else { lo[axis] };
            state.texture_matrix * DVec4::new(at(0), at(1), at(2), 1.0)
        })
        .collect();
    let least = corners.iter().map(|c| c.w).fold(f64::INFINITY, f64::min);
    let most = corners.iter().map(|c| c.w).fold(f64::NEG_INFINITY, f64::max);
    if !(least > 0.0 || most < 0.0) {
        return Err(Error::invalid(format!(
            "opengl texture_matrix: q runs from {least} to {most} in the box and must not pass through 0: texture coordinates are divided by it"
        )));
    }
    let farthest = corners.iter().flat_map(|c| c.truncate().to_array()).fold(0.0, |a: f64, x| a.max(x.abs())) / least.abs().min(most.abs());
    if !(farthest <= FARTHEST) {
        return Err(Error::invalid(format!(
            "opengl texture_matrix: texture coordinates reach {farthest:e}, over the limit of {FARTHEST:e}"
        )));
    }
    Ok(())
}

/// What the pipeline leaves out of a scene, or cannot.
pub(crate) fn left_out(scene: &Scene, state: &OpenGl) -> Vec<LeftOut> {
    let mut list = vec![
        ("early termination", "OpenGL draws every slice"),
        ("skipping of empty space", "OpenGL draws every fragment"),
        ("opacity correction", "whole slabs of one thickness: the table holds it"),
        ("vector stages", "fragments are drawn one by one"),
    ];
    let stages = OptionalStage::ALL.into_iter().filter(|stage| stage.option().opengl == Fits::Yes && !(stage.option().wanted)(scene));
    list.extend(stages.map(|stage| (stage.info().name, stage.option().absent)));
    if scene.clip_planes().is_empty() {
        list.push(("clip planes", "the scene has none"));
    }
    let last = state.texture_matrix.row(3);
    if last.truncate() == glam::DVec3::ZERO {
        list.push(("division by q", "q is the same everywhere"));
    }
    if state.alpha_test.is_none() {
        list.push(("alpha test", "the scene has none"));
    }
    list.into_iter().map(|(what, why)| LeftOut::uncounted(what, why)).collect()
}
