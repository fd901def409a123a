//! Light at one point in f64: for surfaces, which rays meet at few places. Fragments of slices are lit by a stage.

use super::{Gradient, LightSource, Lighting, Shading};
use crate::volume::{Number, Volume, with_voxels};
use glam::DVec3;

/// A point to be lit.
#[derive(Debug, Clone, Copy)]
pub(crate) struct LitPoint {
    /// World space.
    pub(crate) position: DVec3,
    /// Gradient of the values, world space, data units per world unit; 0 where there is none.
    pub(crate) gradient: DVec3,
    /// Direction to the eye, of length 1.
    pub(crate) to_eye: DVec3,
    /// How deep in the box it lies: 0 at its nearest corner, 1 at its farthest.
    pub(crate) deep: f64,
}

/// `v` at length 1; 0 where it has none, or no finite one.
pub(crate) fn unit(v: DVec3) -> DVec3 {
    // Scaled first: squares may leave f64.
    let most = v.abs().max_element();
    if most > 0.0 && most.is_finite() { (v / most).normalize() } else { DVec3::ZERO }
}

/// Weights of four neighbouring voxels along an axis, of which a place lies the share `t` of the way from the second to the third.
struct Weights {
    /// Of the value there, interpolated.
    value: [f64; 4],
    /// Of the mean of the values there (twice) and a voxel before and behind.
    smooth: [f64; 4],
    /// Of half the difference of the values a voxel behind and before.
    central: [f64; 4],
    /// Of the slope of the interpolation.
    slope: [f64; 4],
}

impl Weights {
    fn new(t: f64) -> Self {
        let s = 1.0 - t;
        Self {
            value: [0.0, s, t, 0.0],
            smooth: [0.25 * s, 0.25 * t + 0.5 * s, 0.25 * s + 0.5 * t, 0.25 * t],
            central: [-0.5 * s, -0.5 * t, 0.5 * s, 0.5 * t],
            slope: [0.0, -1.0, 1.0, 0.0],
        }
    }
}

fn dot(a: [f64; 4], b: [f64; 4]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + (a[2] * b[2] + a[3] * b[3])
}

impl Gradient {
    /// The gradient of the values of `volume` at index coordinates `index`, taken this way: world space, data units per world unit. 0 where a
    /// voxel around is NaN or infinite; places beyond the outermost voxels have the gradient at those.
    pub fn at(self, volume: &Volume, index: DVec3) -> DVec3 {
        let [nx, ny, nz] = volume.grid().dims();
        // Along each axis four voxels, those beyond the volume the ones at its edge, and the place between the middle two.
        let around = |u: f64, n: usize| {
            let u = u.clamp(0.0, (n - 1) as f64);
            let cell = (u as usize).min(n.saturating_sub(2));
            ([cell.saturating_sub(1), cell, (cell + 1).min(n - 1), (cell + 2).min(n - 1)], Weights::new(u - cell as f64))
        };
        let ((xs, wx), (ys, wy), (zs, wz)) = (around(index.x, nx), around(index.y, ny), around(index.z, nz));
        let step = |w: &Weights| if self == Self::Analytic { w.slope } else { w.central };
        let beside = |w: &Weights| if self == Self::Sobel { w.smooth } else { w.value };
        // From 64 values to rows, planes and the three slopes.
        let rows: [[[f64; 2]; 4]; 4] = with_voxels!(volume.voxels(), v => zs.map(|z| ys.map(|y| {
            let row = xs.map(|x| v[(z * ny + y) * nx + x].to_f64());
            [dot(row, step(&wx)), dot(row, beside(&wx))]
        })));
        let column = |plane: [[f64; 2]; 4], of: usize, w: [f64; 4]| dot(plane.map(|row| row[of]), w);
        let along_x = dot(rows.map(|plane| column(plane, 0, beside(&wy))), beside(&wz));
        let along_y = dot(rows.map(|plane| column(plane, 1, step(&wy))), beside(&wz));
        let along_z = dot(rows.map(|plane| column(plane, 1, beside(&wy))), step(&wz));
        // A gradient is a covector: it goes through the transpose of the map from world to index.
        let (slope, _) = volume.rescale();
        let gradient = volume.grid().world_to_index().matrix3.transpose() * (slope * DVec3::new(along_x, along_y, along_z));
        if gradient.is_finite() { gradient } else { DVec3::ZERO }
    }
}

impl Lighting {
    /// The straight colour `color` as it is lit at `point`.
    pub(crate) fn shade(&self, color: [f64; 3], point: &LitPoint) -> [f64; 3] {
        if self.shading == Shading::Depth {
            return color.map(|c| c * (1.0 - point.deep));
        }
        let normal = -unit(point.gradient);
        if normal == DVec3::ZERO {
            return color;
        }
        let facing = |direction: DVec3| {
            let cosine = normal.dot(direction);
            (if self.two_sided { cosine.abs() } else { cosine.max(0.0) }).min(1.0)
        };
        let mut glow = [self.emission + self.ambient; 3];
        let mut shine = [0.0; 3];
        for light in self.lights() {
            let to_light = match light.source() {
                LightSource::Head => point.to_eye,
                LightSource::Direction(d) => d,
                LightSource::Position(p) => unit(p - point.position),
            };
            let surface = self.diffuse * facing(to_light);
            let mirror = self.specular * libm::pow(facing(unit(to_light + point.to_eye)), self.shininess);
            for (c, of_light) in light.color().into_iter().enumerate() {
                glow[c] += surface * of_light;
                shine[c] += mirror * of_light;
            }
        }
        // |g|^2 / (|g|^2 + floor^2); the gradient is not 0 here, though its square may be.
        let most = point.gradient.abs().max_element();
        let quotient = self.gradient_floor / most / (point.gradient / most).length();
        let weight = 1.0 / (1.0 + quotient * quotient);
        std::array::from_fn(|c| {
            let lit = (color[c] * glow[c] + shine[c]).clamp(0.0, 1.0);
            color[c] + weight * (lit - color[c])
        })
    }
}
