//! A ray template: one voxelized ray, made once, that by translation becomes all of them.
//!
//! ```text
//!   base plane: the ray's first voxel lies in the outermost layer      image plane: it is rounded where the pixel lies
//!    o . . . .   o     rays that start side by side stay so:             o
//!    . o o . .   .o    no voxel is missed and none is met twice            o      rays are shifted along their own direction too,
//!    . . . o o   ...                                                     o          by different parts of a step: holes and doubles
//! ```
//! The template has exactly one voxel of each layer along the axis that rays are most along, so neighbours share a corner at least. Samples are
//! voxels: their values are their own.
//!
//! Source: R. Yagel, Template-based volume viewing, 1991; R. Peikert, Scientific Visualization, 2008, 3-6 and 3-7.

use super::Piece;
use super::sight::Ray;
use crate::proxy::Stack;

/// The template of a view along parallel rays.
pub(super) struct Template {
    /// The axis that rays are most along, the way along it, and the two others.
    axis: usize,
    ahead: i64,
    others: [usize; 2],
    /// Steps along the two others from the first voxel to that of each layer.
    steps: Vec<[i64; 2]>,
    /// Whether it starts from the base plane; else from the image plane.
    base: bool,
    /// Depth of the image plane: where the box begins.
    depth: f64,
}

fn rounded(u: f64) -> i64 {
    libm::floor(u + 0.5) as i64
}

impl Template {
    /// The template of the rays of `stack`.
    pub(super) fn new(stack: &Stack, base: bool) -> Self {
        let slope = stack.index.map(|f| f.g);
        let of = |start: [f64; 3]| Ray {
            start,
            slope,
            stretch: 1.0,
            aside: 0.0,
            entry: stack.near,
            exit: stack.far,
            error: 0.0,
            window: (0.0, 0.0),
        };
        let axis = of([0.0; 3]).major();
        let others = [0, 1, 2].into_iter().filter(|&a| a != axis);
        let mut pair = [0; 2];
        pair.iter_mut().zip(others).for_each(|(to, axis)| *to = axis);
        let per_layer = pair.map(|other| slope[other] / slope[axis].abs());
        // From the image plane rays may have farther to go.
        let deep = libm::ceil((stack.far - stack.near) * slope[axis].abs()) as usize + 2;
        let layers = stack.dims[axis].max(deep);
        Self {
            axis,
            ahead: if slope[axis] < 0.0 { -1 } else { 1 },
            others: pair,
            steps: (0..layers).map(|n| per_layer.map(|step| rounded(n as f64 * step))).collect(),
            base,
            depth: stack.near,
        }
    }

    /// The first voxel of `ray`.
    fn first(&self, stack: &Stack, ray: &Ray) -> [i64; 3] {
        let layer = if self.ahead > 0 { 0 } else { stack.dims[self.axis] as i64 - 1 };
        let depth = if self.base { ray.reaches(self.axis, layer as f64) } else { self.depth };
        let mut voxel = ray.at(depth).map(rounded);
        if self.base {
            voxel[self.axis] = layer;
        }
        voxel
    }

    /// The voxel in the `n`th layer from `first` on.
    fn voxel(&self, first: [i64; 3], n: usize) -> [i64; 3] {
        let mut voxel = first;
        voxel[self.axis] += self.ahead * n as i64;
        for (&axis, step) in self.others.iter().zip(self.steps[n]) {
            voxel[axis] += step;
        }
        voxel
    }

    /// The samples of `ray`, each as long as the ray is in its layer.
    pub(super) fn along<'t>(&'t self, stack: &'t Stack, ray: &'t Ray) -> impl Iterator<Item = Piece> + use<'t> {
        let first = self.first(stack, ray);
        (0..self.steps.len()).filter_map(move |n| {
            let voxel = self.voxel(first, n);
            let inside = (0..3).all(|axis| (0..stack.dims[axis] as i64).contains(&voxel[axis]));
            if !inside {
                return None;
            }
            let (layer, half) = (voxel[self.axis] as f64, 0.5 * self.ahead as f64);
            let (near, far) = (ray.reaches(self.axis, layer - half), ray.reaches(self.axis, layer + half));
            // The outermost layers reach as far as the box does.
            let last = stack.dims[self.axis] as i64 - 1;
            let (begins, ends) = if self.ahead > 0 { (0, last) } else { (last, 0) };
            let near = if voxel[self.axis] == begins { f64::NEG_INFINITY } else { near };
            let far = if voxel[self.axis] == ends { f64::INFINITY } else { far };
            ray.piece((near, far), stack.spacing, voxel.map(|v| v as f64))
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Camera, Placement, Projection};
    use crate::volume::Grid;
    use glam::DVec3;
    use std::collections::BTreeMap;

    /// How often each voxel of a cube is met by the rays through the voxels of its base plane, extended as far as rays come from.
    fn visits(direction: DVec3, base: bool) -> BTreeMap<[i64; 3], u32> {
        const N: i64 = 12;
        let grid = Grid::with_spacing([N as usize; 3], [1.0; 3]).expect("grid");
        let center = grid.center();
        let placement = Placement::LookAt { eye: center - direction * 40.0, target: center, up: DVec3::new(0.1, 1.0, 0.3) };
        let camera = Camera::new(placement, Projection::Orthographic { height: None }).expect("camera");
        let stack = Stack::new(&grid, &camera.resolve(&grid, 8, 8).expect("view"), &[], 16);
        let template = Template::new(&stack, base);
        let mut met = BTreeMap::new();
        for a in -2 * N..3 * N {
            for b in -2 * N..3 * N {
                let mut through = [0.0; 3];
                through[template.axis] = if template.ahead > 0 { 0.0 } else { (N - 1) as f64 };
                through[template.others[0]] = a as f64;
                through[template.others[1]] = b as f64;
                let slope = stack.index.map(|f| f.g);
                // The ray whose depth at that voxel is the one that the view gives it.
                let depth = stack.view.depth(grid.index_to_world().transform_point3(DVec3::from_array(through)));
                let start = [0, 1, 2].map(|i: usize| through[i] - depth * slope[i]);
                // No piece is cut by the box: visits are what is counted.
                let ray = Ray { start, slope, stretch: 1.0, aside: 0.0, entry: -1e9, exit: 1e9, error: 0.0, window: (0.0, 0.0) };
                for piece in template.along(&stack, &ray) {
                    *met.entry(piece.place.map(|v| v as i64)).or_insert(0) += 1;
                }
            }
        }
        met
    }

    #[test]
    fn from_the_base_plane_every_voxel_is_met_once_and_from_the_image_plane_it_is_not() {
        let mut mistakes = 0;
        for direction in [
            DVec3::new(0.3, -0.2, 1.0),
            DVec3::new(-0.9, 0.4, 1.0),
            DVec3::new(1.0, 0.77, -0.1),
            DVec3::new(0.2, -1.0, 0.95),
            DVec3::new(0.5, 0.6, -1.0),
        ] {
            let direction = direction.normalize();
            let base = visits(direction, true);
            assert_eq!(base.len(), 12 * 12 * 12, "{direction}: voxels met");
            assert!(base.values().all(|&n| n == 1), "{direction}: one is met twice");
            let image = visits(direction, false);
            let (missed, twice) = (12 * 12 * 12 - image.len(), image.values().filter(|&&n| n > 1).count());
            assert!(missed > 0 && twice > 0, "{direction}: {missed} missed, {twice} met twice");
            mistakes += missed;
        }
        assert!(mistakes > 100, "{mistakes}");
    }
}
