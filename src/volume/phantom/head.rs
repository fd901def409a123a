//! The Shepp-Logan head in three dimensions (Shepp and Logan 1974; Kak and Slaney, "Principles of computerized tomographic
//! imaging", 1988), with the higher contrast that Toft (1996) gave it so that its insides can be seen.

/// An ellipsoid that adds `value` to what it covers, turned about the z axis.
struct Ellipsoid {
    value: f64,
    center: [f64; 3],
    half_axes: [f64; 3],
    /// Cosine and sine of the turn.
    turn: (f64, f64),
}

/// cos and sin of 18 degrees.
const TURN: (f64, f64) = (0.951_056_516_295_153_5, 0.309_016_994_374_947_45);
const STRAIGHT: (f64, f64) = (1.0, 0.0);

const fn ellipsoid(value: f64, center: [f64; 3], half_axes: [f64; 3], turn: (f64, f64)) -> Ellipsoid {
    Ellipsoid { value, center, half_axes, turn }
}

/// Skull, brain, two ventricles, and six small bodies; the face looks along -y.
const HEAD: [Ellipsoid; 10] = [
    ellipsoid(1.0, [0.0, 0.0, 0.0], [0.69, 0.92, 0.81], STRAIGHT),
    ellipsoid(-0.8, [0.0, -0.0184, 0.0], [0.6624, 0.874, 0.78], STRAIGHT),
    ellipsoid(-0.2, [0.22, 0.0, 0.0], [0.11, 0.31, 0.22], (TURN.0, -TURN.1)),
    ellipsoid(-0.2, [-0.22, 0.0, 0.0], [0.16, 0.41, 0.28], TURN),
    ellipsoid(0.1, [0.0, 0.35, -0.15], [0.21, 0.25, 0.41], STRAIGHT),
    ellipsoid(0.1, [0.0, 0.1, 0.25], [0.046, 0.046, 0.05], STRAIGHT),
    ellipsoid(0.1, [0.0, -0.1, 0.25], [0.046, 0.046, 0.05], STRAIGHT),
    ellipsoid(0.1, [-0.08, -0.605, 0.0], [0.046, 0.023, 0.05], STRAIGHT),
    ellipsoid(0.1, [0.0, -0.606, 0.0], [0.023, 0.023, 0.02], STRAIGHT),
    ellipsoid(0.1, [0.06, -0.605, 0.0], [0.023, 0.046, 0.02], STRAIGHT),
];

/// The head's value at a point, in `[0,1]`; edges are spread evenly over `soft` to either side, as a voxel that straddles one sees it.
pub(super) fn value(point: [f64; 3], soft: f64) -> f64 {
    let sum: f64 = HEAD.iter().map(|e| e.value * e.share(point, soft)).sum();
    sum.clamp(0.0, 1.0)
}

impl Ellipsoid {
    fn share(&self, point: [f64; 3], soft: f64) -> f64 {
        let [dx, dy, dz]: [f64; 3] = std::array::from_fn(|i| point[i] - self.center[i]);
        let (c, s) = self.turn;
        let [a, b, h] = self.half_axes;
        let scaled = [(c * dx + s * dy) / a, (c * dy - s * dx) / b, dz / h];
        let level = scaled.iter().map(|x| x * x).sum::<f64>().sqrt();
        if soft == 0.0 || level == 0.0 {
            return f64::from(u8::from(level <= 1.0));
        }
        // First-order distance to the surface level = 1: (level - 1) / |gradient of level|.
        let slope = [scaled[0] / a, scaled[1] / b, scaled[2] / h].iter().map(|x| x * x).sum::<f64>().sqrt() / level;
        (0.5 - 0.5 * (level - 1.0) / (slope * soft)).clamp(0.0, 1.0)
    }
}
