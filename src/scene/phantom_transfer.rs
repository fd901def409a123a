//! The transfer functions of the built-in volumes.

use super::TransferFunction;
use crate::volume::phantom::Phantom;

/// Points of colour, then points of opacity.
type Points = (&'static [(f64, [f64; 3])], &'static [(f64, f64)]);

impl Phantom {
    /// A transfer function in the phantom's units that shows it well when it is sampled with `size` voxels along each axis.
    ///
    /// Its opacities are per 1/128 of the side of the box (`size` world units, as [`Phantom::volume`] makes it), so that a phantom
    /// looks the same at every size. A size of 0, of which there is no volume, counts as 1.
    pub fn default_transfer(self, size: usize) -> TransferFunction {
        let (color, opacity) = points(self);
        let transfer = TransferFunction::new(color.to_vec(), opacity.to_vec()).and_then(|t| t.with_unit(size.max(1) as f64 / 128.0));
        transfer.expect("the points below are in order and within [0,1], and the length is positive")
    }
}

fn points(phantom: Phantom) -> Points {
    match phantom {
        // Thin shells around the middle value: the crests of the rings.
        Phantom::MarschnerLobb => (
            &[
                (0.0, [0.05, 0.1, 0.4]),
                (0.35, [0.1, 0.55, 0.8]),
                (0.5, [0.95, 0.9, 0.7]),
                (0.65, [0.95, 0.45, 0.1]),
                (1.0, [0.6, 0.0, 0.1]),
            ],
            &[(0.44, 0.0), (0.5, 0.35), (0.56, 0.02), (0.75, 0.0), (0.8, 0.1), (0.85, 0.0)],
        ),
        Phantom::Hydrogen => (
            &[
                (0.0, [0.1, 0.2, 0.9]),
                (0.02, [0.15, 0.45, 1.0]),
                (0.08, [0.5, 0.2, 0.9]),
                (0.2, [1.0, 0.35, 0.35]),
                (0.6, [1.0, 0.85, 0.3]),
                (1.0, [1.0; 3]),
            ],
            &[(0.002, 0.0), (0.02, 0.012), (0.08, 0.03), (0.2, 0.12), (1.0, 0.6)],
        ),
        // The skull translucent, the brain faint, the small ellipsoids dense.
        Phantom::SheppLogan => (
            &[
                (0.1, [0.25, 0.45, 0.9]),
                (0.22, [0.35, 0.6, 0.95]),
                (0.28, [1.0, 0.55, 0.15]),
                (0.45, [1.0, 0.8, 0.3]),
                (0.7, [0.95, 0.93, 0.88]),
                (1.0, [1.0, 0.98, 0.95]),
            ],
            &[(0.0, 0.0), (0.02, 0.004), (0.18, 0.012), (0.27, 0.012), (0.29, 0.2), (0.31, 0.2), (0.33, 0.004), (0.9, 0.02), (1.0, 0.05)],
        ),
        // A dense core in a translucent halo.
        Phantom::DistanceField => (
            &[
                (-0.14, [1.0, 0.95, 0.75]),
                (-0.08, [1.0, 0.7, 0.2]),
                (-0.01, [0.85, 0.2, 0.1]),
                (0.02, [0.4, 0.1, 0.5]),
                (0.15, [0.1, 0.2, 0.7]),
                (0.4, [0.05, 0.1, 0.4]),
            ],
            &[(-0.1, 0.5), (-0.06, 0.12), (-0.01, 0.08), (0.01, 0.015), (0.15, 0.003), (0.3, 0.0)],
        ),
        Phantom::Cloud => {
            (&[(0.0, [0.55, 0.62, 0.75]), (0.4, [0.8, 0.84, 0.9]), (1.0, [1.0, 0.99, 0.97])], &[(0.02, 0.0), (0.5, 0.06), (1.0, 0.25)])
        }
    }
}
