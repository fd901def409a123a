//! Homogeneous texture coordinates on one slice: (s,t,p,q) = texture matrix * (s,t,p,1), divided by q.

use crate::proxy::Stack;
use glam::DMat4;

/// Texture coordinates as functions of window position.
///
/// On a view-aligned slice each of s, t, p and q is affine in window x and y, in perspective too. Where q is one number on the
/// slice the quotients are affine as well, and are divided here once; else each fragment divides.
pub(super) struct Coords {
    /// a + b x + c y of s, t, p, q.
    affine: [[f64; 3]; 4],
    /// Whether q is 1 by now.
    divided: bool,
}

/// [`Coords`] along one row of pixels.
pub(super) struct Row {
    start: [f64; 4],
    step: [f64; 4],
    divided: bool,
}

impl Coords {
    /// The coordinates on the slice at depth `d`. `matrix` keeps q away from 0 in the box.
    pub(super) fn new(stack: &Stack, d: f64, matrix: &DMat4) -> Self {
        let plane: [[f64; 3]; 3] = std::array::from_fn(|axis| {
            let n = stack.dims[axis] as f64;
            let [a, b, c] = stack.index[axis].at_depth(stack.perspective, d);
            [(a + 0.5) / n, b / n, c / n]
        });
        if *matrix == DMat4::IDENTITY {
            return Self { affine: [plane[0], plane[1], plane[2], [1.0, 0.0, 0.0]], divided: true };
        }
        let mut affine: [[f64; 3]; 4] = std::array::from_fn(|row| {
            let m = matrix.row(row);
            std::array::from_fn(|i| {
                let constant = if i == 0 { m.w } else { 0.0 };
                m.x * plane[0][i] + m.y * plane[1][i] + m.z * plane[2][i] + constant
            })
        });
        let [q, qx, qy] = affine[3];
        // What rounding leaves of a slope of 0 moves no coordinate by more than rounding itself does.
        let (w, h) = (f64::from(stack.view.width), f64::from(stack.view.height));
        let divided = qx.abs() * w + qy.abs() * h <= 1e-14 * q.abs();
        if divided {
            affine = affine.map(|f| f.map(|x| x / q));
        }
        Self { affine, divided }
    }

    /// The row at window `y`.
    pub(super) fn row(&self, y: f64) -> Row {
        Row { start: self.affine.map(|[a, _, c]| a + c * y), step: self.affine.map(|f| f[1]), divided: self.divided }
    }

    /// The larger of the lengths, in texels, that one pixel in x and one in y cover at window (x,y): above 1 texels are smaller than
    /// pixels. OpenGL's rho.
    pub(super) fn texels_per_pixel(&self, x: f64, y: f64, dims: [usize; 3]) -> f64 {
        let value = |f: &[f64; 3]| f[0] + f[1] * x + f[2] * y;
        let q = if self.divided { 1.0 } else { value(&self.affine[3]) };
        let length = |i: usize| {
            let square = |axis: usize| {
                let f = &self.affine[axis];
                // Derivative of the quotient.
                let along = if self.divided { f[i] } else { (f[i] - value(f) / q * self.affine[3][i]) / q };
                let texels = along * dims[axis] as f64;
                texels * texels
            };
            square(0) + square(1) + square(2)
        };
        length(1).max(length(2)).sqrt()
    }
}

impl Row {
    /// (s/q, t/q, p/q) at window `x`.
    #[inline(always)]
    pub(super) fn at(&self, x: f64) -> [f64; 3] {
        let f = |i: usize| self.start[i] + self.step[i] * x;
        let at = [f(0), f(1), f(2)];
        if self.divided {
            return at;
        }
        let q = f(3);
        [at[0] / q, at[1] / q, at[2] / q]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Camera, Placement, Projection};
    use crate::volume::Grid;
    use glam::{DVec3, DVec4};

    fn stack(projection: Projection) -> Stack {
        let grid = Grid::with_spacing([5, 7, 3], [1.0, 0.5, 2.0]).expect("grid");
        let camera = Camera::new(Placement::Orbit { azimuth: 30.0, elevation: 20.0, roll: 10.0, zoom: 1.0 }, projection).expect("camera");
        let view = camera.resolve(&grid, 40, 30).expect("view");
        Stack::new(&grid, &view, &[], 9)
    }

    fn both() -> [Stack; 2] {
        [stack(Projection::Orthographic { height: None }), stack(Projection::Perspective { fov_y: 40.0 })]
    }

    #[test]
    fn each_fragment_is_the_matrix_times_its_place_in_the_box() {
        let projective = DMat4::from_cols_array(&[1.1, 0.2, 0.0, 0.3, 0.0, 0.9, 0.1, 0.2, 0.1, 0.0, 1.0, -0.1, 0.05, 0.0, -0.02, 1.3]);
        for stack in both() {
            for matrix in [DMat4::IDENTITY, DMat4::from_scale(DVec3::new(2.0, 1.0, 0.5)), projective] {
                let d = stack.depth(4);
                let coords = Coords::new(&stack, d, &matrix);
                assert_eq!(coords.divided, matrix != projective);
                for (x, y) in [(0.5, 0.5), (17.5, 12.5), (39.5, 29.5)] {
                    let at = (stack.index_at(x, y, d) + 0.5) / DVec3::new(5.0, 7.0, 3.0);
                    let h = matrix * DVec4::new(at.x, at.y, at.z, 1.0);
                    let want = h.truncate() / h.w;
                    let found = DVec3::from_array(coords.row(y).at(x));
                    assert!((found - want).length() < 1e-12, "{found} is not {want}");
                }
            }
        }
    }

    #[test]
    fn a_q_that_is_one_number_on_the_slice_is_divided_by_once() {
        let grid = Grid::with_spacing([4; 3], [1.0; 3]).expect("grid");
        // Looking along z, with q = 1 + p.
        let (c, up) = (grid.center(), DVec3::Y);
        let camera = Camera::new(Placement::LookAt { eye: c + DVec3::Z * 9.0, target: c, up }, Projection::Perspective { fov_y: 40.0 });
        let view = camera.expect("camera").resolve(&grid, 16, 16).expect("view");
        let stack = Stack::new(&grid, &view, &[], 4);
        let mut matrix = DMat4::IDENTITY;
        matrix.z_axis.w = 1.0;
        let coords = Coords::new(&stack, stack.depth(0), &matrix);
        assert!(coords.divided);
        // The first slab's middle lies at p = 7/8.
        let [_, _, p] = coords.row(8.0).at(8.0);
        assert!((p - 0.875 / 1.875).abs() < 1e-12, "{p}");
    }

    #[test]
    fn texels_per_pixel_is_the_difference_to_the_next_pixel() {
        let projective = DMat4::from_cols_array(&[1.0, 0.0, 0.0, 0.4, 0.0, 1.0, 0.0, 0.2, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0]);
        for stack in both() {
            for matrix in [DMat4::IDENTITY, projective] {
                let coords = Coords::new(&stack, stack.depth(3), &matrix);
                let texels = |x: f64, y: f64| DVec3::from_array(coords.row(y).at(x)) * DVec3::new(5.0, 7.0, 3.0);
                let (x, y, h) = (20.0, 15.0, 1e-4);
                let dx = (texels(x + h, y) - texels(x - h, y)).length() / (2.0 * h);
                let dy = (texels(x, y + h) - texels(x, y - h)).length() / (2.0 * h);
                let rho = coords.texels_per_pixel(x, y, [5, 7, 3]);
                assert!((rho - dx.max(dy)).abs() < 1e-6, "{rho} {dx} {dy}");
            }
        }
    }
}
