//! Rendering in parts: each part of a volume gives a partial picture, and partial pictures combine to the whole one.
//!
//! ```text
//!   part 0 --render_part--> Partial --+
//!   part 1 --render_part--> Partial --+- over, over, ... (nearest first) --> Partial --finish--> Picture
//!   part 2 --render_part--> Partial --+
//! ```
//! A part renders on the slices of the whole, with the tables of the whole, the fragments whose samples it owns (see [`Domain`]). So no slab is
//! cut where two parts meet, and each fragment has the bits that it has in the whole; only the sums over fragments run in another order.

use super::job::{Clock, Output, RenderJob};
use super::layer::{before, check, count};
use super::partial::{Kind, Partial};
use super::rectangle::Rectangle;
use super::slices::Request;
use super::{Renderer, canvas, slice_count};
use crate::plan::{Detail, start_values};
use crate::proxy::{Domain, Stack};
use crate::raster::Owned;
use crate::scene::{Algorithm, Blend, Classification, Filter, Gradient, Scene, Target};
use crate::volume::{Grid, VoxelType};
use crate::{Error, Result};

/// Voxels beyond the corners of its own cells that a part of a volume on the grid `whole` takes for `scene`, along x, y and z, where it has
/// such: one for lookups, whose positions are rounded; one more for gradients; and as many as a step from slice to slice spans where slabs lie
/// between two values (twice as many for those of second order).
///
/// # Errors
/// [`Error::Invalid`] for scenes that are not rendered in parts, with the reason; as [`Renderer::render_layer`].
pub fn halo(scene: &Scene, whole: &Grid) -> Result<[usize; 3]> {
    refuse(scene)?;
    let gradient = usize::from(scene.needs_gradient() && scene.gradient() != Gradient::Analytic);
    let steps = match crate::plan::method(scene).classification {
        Classification::Post | Classification::Pre => return Ok([1 + gradient; 3]),
        Classification::PreIntegrated => 1.0,
        Classification::SecondOrder => 2.0,
    };
    let stack = stack(scene, whole)?;
    let (width, height) = scene.size();
    let (right, bottom) = (f64::from(width), f64::from(height));
    Ok(std::array::from_fn(|axis| {
        // Voxels along a ray from slice to slice: the largest are in a corner of the picture.
        let corners = [(0.0, 0.0), (right, 0.0), (0.0, bottom), (right, bottom)];
        let fastest = corners.map(|(x, y)| stack.index[axis].along(stack.perspective, x, y).1.abs()).into_iter().fold(0.0, f64::max);
        let voxels = libm::ceil(steps * fastest * stack.spacing);
        // No part has more of them than the whole.
        1 + gradient + voxels.min(whole.dims()[axis] as f64) as usize
    }))
}

/// The slices of `scene` through a volume on the grid `whole`.
fn stack(scene: &Scene, whole: &Grid) -> Result<Stack> {
    let (width, height) = scene.size();
    let view = scene.camera().resolve(whole, width, height)?;
    let count = count(scene, |spacing| slice_count(spacing, scene, whole, &view))?;
    Ok(Stack::new(whole, &view, scene.clip_planes(), count))
}

/// # Errors
/// [`Error::Invalid`] for scenes that cannot be shared out slice by slice, with the reason.
fn refuse(scene: &Scene) -> Result<()> {
    check(scene, "a part of a volume")?;
    let refused = |why: &str| Err(Error::invalid(why));
    let method = scene.method();
    if method.filter.is_cubic() {
        return refused("render filter cubic: a spline depends on voxels all around, of which a part of a volume has not all");
    }
    if method.target != Target::F32 {
        return refused("render target: sums that are rounded slice by slice depend on where they begin; parts of a volume take f32");
    }
    match scene.blend() {
        Blend::Over | Blend::Mip | Blend::Min | Blend::Average | Blend::Add => {}
        Blend::Under => {
            return refused("render blend under: parts of a volume combine by over, mip, min, average or add; back to front choose over");
        }
        Blend::Lmip { .. } => {
            return refused("render blend lmip: which maximum is the first depends on the values before it, in other parts of the volume");
        }
        Blend::AttenuatedMip { .. } => {
            return refused("render blend attenuated-mip: how a value fades depends on the values before it, in other parts of the volume");
        }
        Blend::Iso { .. } | Blend::Surfaces => {
            return refused("render blend iso: a surface between two slices may lie between two parts of the volume");
        }
    }
    if scene.algorithm() == Algorithm::Shells || scene.jitter().is_some() {
        return refused("a part of a volume: its fragments lie on the flat slices of the whole; choose slices without jitter");
    }
    if !scene.cuts().is_empty() {
        return refused("cut: a part of a volume does not know which planes rays meet in other parts");
    }
    if scene.uses_labels() || !scene.regions().is_empty() {
        return refused("labels and regions: a part of a volume is rendered without them");
    }
    Ok(())
}

/// What pixels of `scene` gather.
fn kind(scene: &Scene) -> Kind {
    match scene.blend() {
        Blend::Mip => Kind::Largest,
        Blend::Min => Kind::Smallest,
        Blend::Average => Kind::Mean,
        Blend::Add => Kind::Sum,
        _ => Kind::Over,
    }
}

impl Renderer {
    /// The share of a scene's picture that comes from this renderer's volume, where that is a part of a larger one: the fragments that
    /// `domain` says it owns, on the slices of the whole. Shares of all parts, put over one another in the order of their depth
    /// ([`crate::proxy::order`]), make up the picture of the whole: see [`Partial`]. The scene is rendered as [`Scene::in_parts`] says.
    ///
    /// # Errors
    /// As [`Renderer::render_layer`]; [`Error::Invalid`] where the volume is not the one that `domain` tells of, where the part lacks voxels
    /// that the scene takes ([`halo`]), and for what cannot be shared out slice by slice: blends other than over, mip, min, average and add,
    /// the cubic filter, rounded targets, labels, regions, cut planes, voxels that are colours.
    pub fn render_part(&mut self, scene: &Scene, domain: &Domain) -> Result<Partial> {
        refuse(scene)?;
        self.volume.check_scalars("a part of a volume")?;
        scene.check_with(&self.volume)?;
        let (grid, voxels) = (self.volume.grid(), domain.voxels());
        let told = voxels.clone().map(|v| v.len());
        if grid.dims() != told {
            return Err(Error::invalid(format!("domain: voxels {told:?} along x, y, z: the volume has {:?}", grid.dims())));
        }
        if grid.index_to_world().matrix3 != domain.whole().index_to_world().matrix3 {
            return Err(Error::invalid("domain: the volume's axes or spacing are not those of the whole; see Domain::grid"));
        }
        domain.check_halo(halo(scene, domain.whole())?)?;
        let wide = self.volume.voxels().voxel_type() == VoxelType::F64 || domain.range().1 - domain.range().0 > f64::from(1 << 14);
        if kind(scene).holds_values() && scene.method().filter == Filter::Nearest && wide {
            return Err(Error::invalid(
                "render filter nearest: a projection of values that span more than 16384 is not rendered in parts; choose linear",
            ));
        }
        let parts = scene.in_parts()?;
        let scene = &parts.blended();
        let size = scene.size();
        let stack = stack(scene, domain.whole())?;
        let kind = kind(scene);
        self.pooled(|r| {
            let mut pixels = canvas(size.0, size.1)?;
            // Blocks that lie beside the part are left as they are.
            pixels.fill(start_values(scene));
            let observer = Owned::new(domain, &stack);
            let mut job = RenderJob { scene, view: stack.view, clock: Clock::default(), observer, output: Output::Gathered };
            let request = Request { stack: stack.clone(), terminate: 0.0, detail: Detail::Usual, blocks: None, domain: Some(domain) };
            let done = r.requested(&mut job, request, &mut pixels)?;
            let rectangle = Rectangle::cropped(size, &pixels, start_values(scene));
            // What colours stand for needs no number.
            let numbers = if kind.holds_values() { done.numbers } else { [1.0, 0.0, 0.0] };
            Ok(Partial::new(kind, rectangle, numbers, done.counters.looked_up))
        })
    }
}

/// What pixels of a picture in parts gather, one part before another.
pub(super) fn combined(kind: Kind, front: [f32; 4], back: [f32; 4]) -> [f32; 4] {
    let sum = |c: usize| (f64::from(front[c]) + f64::from(back[c])) as f32;
    match kind {
        Kind::Over => before(front, back),
        // Where neither has anything both are minus infinity.
        Kind::Largest => [front[0].max(back[0]), front[1], front[2], front[3]],
        Kind::Smallest => {
            let unset = |v: [f32; 4]| v[0] == f32::NEG_INFINITY;
            if unset(front) || !unset(back) && back[0] < front[0] { back } else { front }
        }
        Kind::Mean | Kind::Sum => std::array::from_fn(sum),
    }
}
