//! What lookups ask of a voxel.

/// A number that lookups turn into floating point.
pub trait Number: Copy {
    /// The value in f32, rounded to nearest.
    fn to_f32(self) -> f32;
    /// The value in f64, exact.
    fn to_f64(self) -> f64;
}
