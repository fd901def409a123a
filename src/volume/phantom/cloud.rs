//! A cumulus: puffs that carry five octaves of value noise from an integer hash.

/// Octaves of the noise, each twice as fine and half as strong as the one before.
const OCTAVES: u32 = 5;
/// Cells of the coarsest octave along the box's side.
const CELLS: f64 = 5.0;
/// How far the noise pushes the edge, in half sides of the box.
const RAGGED: f64 = 0.75;
/// The noise's value that leaves the edge where it is.
const LEVEL: f64 = 0.42;
/// Over how much of the shape's depth the density rises to 1.
const SOFT: f64 = 0.45;

/// Centres and radii of the puffs.
const PUFFS: [([f64; 3], f64); 6] = [
    ([0.0, 0.0, -0.05], 0.62),
    ([-0.42, 0.1, -0.18], 0.45),
    ([0.44, -0.08, -0.16], 0.47),
    ([0.12, 0.22, 0.28], 0.42),
    ([-0.2, -0.24, 0.16], 0.42),
    ([0.22, -0.34, -0.12], 0.4),
];

/// Density in `[0,1]`; 0 at the faces of the box.
pub(super) fn density(point: [f64; 3]) -> f64 {
    // How deep within the puffs, in half sides; flat underneath.
    let mut depth = f64::NEG_INFINITY;
    for (center, radius) in PUFFS {
        let d2: f64 = (0..3).map(|i| (point[i] - center[i]) * (point[i] - center[i])).sum();
        depth = depth.max(radius - d2.sqrt());
    }
    depth = depth.min(point[2] + 0.52);
    // The noise lies in [0,1]: it lifts the shape by at most (1 - LEVEL) RAGGED. Fade that out towards the faces.
    let wall = point.iter().map(|c| 1.0 - c.abs()).fold(f64::INFINITY, f64::min);
    if depth < (LEVEL - 1.0) * RAGGED || wall <= 0.0 {
        return 0.0;
    }
    let lifted = depth + RAGGED * (fractal(point) - LEVEL);
    fade((lifted.min(3.0 * wall) / SOFT).clamp(0.0, 1.0))
}

/// Sum of [`OCTAVES`] octaves of value noise, scaled to `[0,1]`.
fn fractal(point: [f64; 3]) -> f64 {
    let (mut sum, mut total, mut weight, mut scale) = (0.0, 0.0, 1.0, 0.5 * CELLS);
    for octave in 0..OCTAVES {
        sum += weight * noise(point.map(|c| c * scale), octave);
        total += weight;
        weight *= 0.5;
        scale *= 2.0;
    }
    sum / total
}

/// Value noise in `[0,1]`: hashes at whole numbers, between them a blend with continuous second derivative.
fn noise(point: [f64; 3], seed: u32) -> f64 {
    let low = point.map(f64::floor);
    let [fx, fy, fz]: [f64; 3] = std::array::from_fn(|i| fade(point[i] - low[i]));
    let [x, y, z] = low.map(|c| c as i32);
    let corner = |dx, dy, dz| lattice([x + dx, y + dy, z + dz], seed);
    let mix = |a: f64, b: f64, t: f64| a + (b - a) * t;
    let edge = |dy, dz| mix(corner(0, dy, dz), corner(1, dy, dz), fx);
    mix(mix(edge(0, 0), edge(1, 0), fy), mix(edge(0, 1), edge(1, 1), fy), fz)
}

/// 6 t^5 - 15 t^4 + 10 t^3.
fn fade(t: f64) -> f64 {
    t * t * t * (t * (6.0 * t - 15.0) + 10.0)
}

/// A number in `[0,1]` for a point of the lattice: odd multipliers spread the coordinates, two rounds of xor-shift and multiply mix them.
fn lattice([x, y, z]: [i32; 3], seed: u32) -> f64 {
    let spread = |c: i32, odd: u32| (c as u32).wrapping_mul(odd);
    let mut h = spread(x, 0x9e37_79b1) ^ spread(y, 0x85eb_ca77) ^ spread(z, 0xc2b2_ae3d) ^ seed.wrapping_mul(0x27d4_eb2f);
    h = (h ^ (h >> 15)).wrapping_mul(0x2c1b_3c6d);
    h = (h ^ (h >> 12)).wrapping_mul(0x297a_2d39);
    h ^= h >> 15;
    f64::from(h) / f64::from(u32::MAX)
}
