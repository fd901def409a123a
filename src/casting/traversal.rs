//! Voxel by voxel: where a ray enters and leaves each voxel that it passes, and two coarser ways to make voxels of a ray.
//!
//! A voxel reaches half a step to both sides of its centre along each axis. A ray that runs along a face of voxels belongs to those of the
//! higher index; one that leaves a voxel through an edge or a corner passes none of those that it only touches there.
//!
//! Sources: J. Amanatides and A. Woo, A fast voxel traversal algorithm for ray tracing, 1987; connectedness: R. Peikert, Scientific
//! Visualization, 2008, 3-5.

use super::Piece;
use super::sight::Ray;
use crate::proxy::Stack;

/// The voxel nearest to `u` along an axis of `n` voxels.
fn nearest(u: f64, n: usize) -> i64 {
    (libm::floor(u + 0.5).clamp(0.0, (n - 1) as f64)) as i64
}

/// A voxel as a place.
fn center(voxel: [i64; 3]) -> [f64; 3] {
    voxel.map(|v| v as f64)
}

/// Every voxel that a ray passes, with the length of the ray in it: neighbours share a face.
pub(super) struct Passed<'s> {
    ray: &'s Ray,
    dims: [usize; 3],
    thickness: f64,
    /// Whether voxels' own values are looked up; else values in the middle of pieces are.
    own: bool,
    voxel: [i64; 3],
    /// Depth at which the ray leaves the voxel along each axis.
    leaves: [f64; 3],
    /// Where it has come to.
    depth: f64,
}

impl<'s> Passed<'s> {
    /// The voxels of `ray`, whose lengths are told in slabs of `stack`.
    pub(super) fn new(stack: &Stack, ray: &'s Ray, own: bool) -> Self {
        let at = ray.at(ray.entry);
        let voxel = [0, 1, 2].map(|axis: usize| nearest(at[axis], stack.dims[axis]));
        let mut passed = Self { ray, dims: stack.dims, thickness: stack.spacing, own, voxel, leaves: [f64::INFINITY; 3], depth: ray.entry };
        for axis in 0..3 {
            passed.leaves[axis] = passed.face(axis);
            passed.pass(axis);
        }
        passed
    }

    /// Depth at which the ray leaves its voxel along `axis`; none where it leaves the volume there, or runs along the faces.
    fn face(&self, axis: usize) -> f64 {
        let (v, slope) = (self.voxel[axis], self.ray.slope[axis]);
        if slope > 0.0 && v + 1 < self.dims[axis] as i64 {
            self.ray.reaches(axis, v as f64 + 0.5)
        } else if slope < 0.0 && v > 0 {
            self.ray.reaches(axis, v as f64 - 0.5)
        } else {
            f64::INFINITY
        }
    }

    /// Passes the faces along `axis` that lie no deeper than the ray has come.
    fn pass(&mut self, axis: usize) {
        while self.leaves[axis] <= self.depth {
            self.voxel[axis] += if self.ray.slope[axis] > 0.0 { 1 } else { -1 };
            self.leaves[axis] = self.face(axis);
        }
    }
}

impl Iterator for Passed<'_> {
    type Item = Piece;

    fn next(&mut self) -> Option<Piece> {
        let near = self.depth;
        let far = self.leaves.iter().copied().fold(self.ray.exit, f64::min);
        let place = if self.own { center(self.voxel) } else { self.ray.at(0.5 * (near + far)) };
        let piece = self.ray.piece((near, far), self.thickness, place)?;
        self.depth = far;
        (0..3).for_each(|axis| self.pass(axis));
        Some(piece)
    }
}

/// Voxels of a ray of which neighbours share a corner at least: one of each layer along the ray's main axis, the one nearest to where the
/// ray meets the middle of the layer. With `edges` neighbours share an edge at least: where a step changes all three coordinates, the voxel
/// that the ray passes first is put between, up to the last of the three faces.
pub(super) struct Voxelized<'s> {
    ray: &'s Ray,
    dims: [usize; 3],
    thickness: f64,
    own: bool,
    edges: bool,
    /// The main axis, and the way along it.
    axis: usize,
    ahead: i64,
    layer: i64,
    /// Depth at which the voxel of the layer begins.
    depth: f64,
    /// The voxel between this layer's and the next one's, and the depth at which it ends.
    between: Option<([i64; 3], f64)>,
}

impl<'s> Voxelized<'s> {
    /// The voxels of `ray`, whose lengths are told in slabs of `stack`.
    pub(super) fn new(stack: &Stack, ray: &'s Ray, edges: bool, own: bool) -> Self {
        let axis = ray.major();
        let ahead = if ray.slope[axis] < 0.0 { -1 } else { 1 };
        let last = stack.dims[axis] as i64 - 1;
        // A layer earlier: a voxel between two layers may reach into the box.
        let layer = (nearest(ray.at(ray.entry)[axis], stack.dims[axis]) - ahead).clamp(0, last);
        Self { ray, dims: stack.dims, thickness: stack.spacing, own, edges, axis, ahead, layer, depth: f64::NEG_INFINITY, between: None }
    }

    /// The voxel of a layer.
    fn voxel(&self, layer: i64) -> [i64; 3] {
        let at = self.ray.at(self.ray.reaches(self.axis, layer as f64));
        let mut voxel = [0, 1, 2].map(|axis: usize| nearest(at[axis], self.dims[axis]));
        voxel[self.axis] = layer;
        voxel
    }

    /// Whether there is a layer behind this one.
    fn has_next(&self) -> bool {
        (0..self.dims[self.axis] as i64).contains(&(self.layer + self.ahead))
    }

    /// Depth at which the ray passes from voxel `from` to `to`, neighbours along `axis`.
    fn face(&self, axis: usize, from: i64, to: i64) -> f64 {
        self.ray.reaches(axis, 0.5 * (from + to) as f64)
    }

    /// The voxel between those of this layer and the next, and where it begins and ends.
    fn inserted(&self) -> Option<([i64; 3], f64, f64)> {
        let (here, there) = (self.voxel(self.layer), self.voxel(self.layer + self.ahead));
        if !self.edges || (0..3).any(|axis| here[axis] == there[axis]) {
            return None;
        }
        let faces = [0, 1, 2].map(|axis: usize| self.face(axis, here[axis], there[axis]));
        // Of faces at one depth the first axis's is passed first.
        let first = (1..3).fold(0, |first: usize, axis| if faces[axis] < faces[first] { axis } else { first });
        let mut voxel = here;
        voxel[first] = there[first];
        Some((voxel, faces[first], faces.iter().copied().fold(f64::NEG_INFINITY, f64::max)))
    }

    fn piece(&self, voxel: [i64; 3], near: f64, far: f64) -> Option<Piece> {
        let middle = 0.5 * (near.max(self.ray.entry) + far.min(self.ray.exit));
        self.ray.piece((near, far), self.thickness, if self.own { center(voxel) } else { self.ray.at(middle) })
    }
}

impl Iterator for Voxelized<'_> {
    type Item = Piece;

    fn next(&mut self) -> Option<Piece> {
        while (0..self.dims[self.axis] as i64).contains(&self.layer) && self.depth < self.ray.exit {
            if let Some((voxel, far)) = self.between.take() {
                let near = self.depth;
                self.depth = far;
                self.layer += self.ahead;
                if let Some(piece) = self.piece(voxel, near, far) {
                    return Some(piece);
                }
                continue;
            }
            let (near, voxel) = (self.depth, self.voxel(self.layer));
            let far = if !self.has_next() {
                self.layer += self.ahead;
                f64::INFINITY
            } else if let Some((between, begin, end)) = self.inserted() {
                self.between = Some((between, end));
                begin
            } else {
                let face = self.face(self.axis, self.layer, self.layer + self.ahead);
                self.layer += self.ahead;
                face
            };
            self.depth = far;
            if let Some(piece) = self.piece(voxel, near, far) {
                return Some(piece);
            }
        }
        None
    }
}

#[cfg(test)]
mod tests {
    use super::super::sight::Sight;
    use super::*;
    use crate::scene::{Camera, Placement, Projection};
    use crate::volume::Grid;
    use glam::DVec3;

    /// How many coordinates change from each voxel of a ray to the next, counted over the rays of many views: how often none, one, two, three.
    fn changes(way: impl Fn(&Stack, &Ray) -> Vec<Piece>) -> [u32; 4] {
        let grid = Grid::with_spacing([9, 12, 7], [1.0, 0.8, 1.3]).expect("grid");
        let mut found = [0; 4];
        for (x, y, z) in [(3.0, 2.0, 1.0), (-1.0, 2.0, 1.9), (1.0, -0.95, 1.05), (0.3, 0.2, -1.0), (-2.0, -3.0, -2.5)] {
            let eye = grid.center() + DVec3::new(x, y, z) * 6.0;
            let placement = Placement::LookAt { eye, target: grid.center(), up: DVec3::new(0.1, 0.2, 1.0) };
            let camera = Camera::new(placement, Projection::Perspective { fov_y: 60.0 }).expect("camera");
            let stack = Stack::new(&grid, &camera.resolve(&grid, 40, 40).expect("view"), &[], 10);
            let sight = Sight::new(&stack, &grid);
            for pixel in 0..40 * 40 {
                let Some(ray) = sight.ray(f64::from(pixel % 40) + 0.5, f64::from(pixel / 40) + 0.5) else { continue };
                let pieces = way(&stack, &ray);
                let length: f64 = pieces.iter().map(|p| p.length * stack.spacing).sum();
                assert!((length - (ray.exit - ray.entry) * ray.stretch).abs() < 1e-9, "pixel {pixel}");
                for pair in pieces.windows(2) {
                    let steps = [0, 1, 2].map(|axis: usize| (pair[1].place[axis] - pair[0].place[axis]).abs());
                    assert!(steps.iter().all(|&s| s <= 1.0), "pixel {pixel}: {steps:?}");
                    found[steps.iter().filter(|&&s| s == 1.0).count()] += 1;
                }
            }
        }
        found
    }

    #[test]
    fn neighbours_share_what_they_should() {
        let [none, faces, edges, corners] = changes(|stack, ray| Passed::new(stack, ray, true).collect());
        assert!(none == 0 && faces > 10_000 && edges == 0 && corners == 0, "6: {none}, {faces}, {edges}, {corners}");
        let [none, faces, edges, corners] = changes(|stack, ray| Voxelized::new(stack, ray, true, true).collect());
        assert!(none == 0 && faces > 1000 && edges > 1000 && corners == 0, "18: {none}, {faces}, {edges}, {corners}");
        let [none, faces, edges, corners] = changes(|stack, ray| Voxelized::new(stack, ray, false, true).collect());
        assert!(none == 0 && faces > 1000 && edges > 1000 && corners > 100, "26: {none}, {faces}, {edges}, {corners}");
    }
}
