//! The hydrogen atom's orbital with n = 4, l = 2, m = 0.
//!
//! psi ~ rho^2 (6 - rho) exp(-rho/2) (3 cos^2 theta - 1), where rho = 2 r / (4 a_0) and theta is the angle to the z axis.

/// rho at the faces of the box: the density there is under 0.3 % of its peak.
const EXTENT: f64 = 18.0;

/// The density |psi|^2, scaled so that its peak, on the z axis at rho = 6 - 2 sqrt 3, is 1.
pub(super) fn density([x, y, z]: [f64; 3]) -> f64 {
    let radius2 = x * x + y * y + z * z;
    let rho = EXTENT * radius2.sqrt();
    // rho^2 (3 cos^2 theta - 1) = 3 z^2 - r^2 has no pole at the centre.
    let angular = EXTENT * EXTENT * (3.0 * z * z - radius2);
    let psi = angular * (6.0 - rho) * libm::exp(-0.5 * rho);
    let root3 = 3f64.sqrt();
    let nearest = 6.0 - 2.0 * root3;
    let peak = 2.0 * nearest * nearest * (2.0 * root3) * libm::exp(root3 - 3.0);
    let amplitude = psi / peak;
    (amplitude * amplitude).min(1.0)
}
