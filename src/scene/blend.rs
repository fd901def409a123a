//! How the slabs of a pixel combine, and in which order.

/// Which way the stack is blended.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Order {
    /// Nearest slice first: finished pixels can stop.
    #[default]
    FrontToBack,
    /// Farthest slice first, as OpenGL programs do.
    BackToFront,
}

/// How fragments of one pixel combine.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[non_exhaustive]
pub enum Blend {
    /// Emission and absorption: premultiplied over.
    #[default]
    Over,
    /// Each next slice goes under what its pixel has gathered: C += T c, T *= 1 - a, in the scene's own [`Order`] (Porter and Duff 1984). Front to back
    /// that is [`Blend::Over`]. Back to front far things hide near ones, and the object looks as if seen from behind through its own front: what comes
    /// of taking the one order with the other order's operator.
    Under,
    /// Colour of the largest value on the ray (maximum intensity projection).
    Mip,
    /// Colour of the smallest value on the ray.
    Min,
    /// Colour of the mean value on the ray, weighted by length.
    Average,
    /// Sum of premultiplied slab colours, nothing hidden. Colours and opacity end at 1 each: where more adds up a picture is flat white, unless
    /// [`Scene::with_window`](super::Scene::with_window) tells which sums are black and white.
    Add,
    /// Colour of the largest value after attenuation: in front of a value v lie others, and it counts as n(v) exp(-attenuation S), where n is 0 to 1
    /// over [`Scene::window`](super::Scene::window) (over the data's range, unless given), and S the sum over the slices before of n times the length of ray that each
    /// stands for, in lengths of the box's longest side. The largest of those, as a value of the window again, is shown. Near things stand out from
    /// far ones as bright. As in napari and vispy, whose lengths are steps along the ray
    /// (`_ATTENUATED_MIP_SNIPPETS` in vispy's `visuals/volume.py`).
    AttenuatedMip {
        /// How fast values fade behind others, per longest side of the box full of the window's largest value; 0, as [`Blend::Mip`] within the window, and up.
        attenuation: f64,
    },
    /// Colour of the first local maximum at or above a threshold (in the data's units); without one, of the largest value (Sato et al. 1998).
    ///
    /// Along the slices of a ray, a run of equal values is one maximum where the values before it and behind it are smaller; the ends of the ray count as
    /// smaller. Values that are none (NaN, infinite) are passed over as if they were not there.
    Lmip {
        /// Values below this never stop a ray.
        threshold: f64,
    },
    /// The surface at `level`, opaque and in the transfer function's colour: where a ray first crosses the level, or enters the box above it.
    Iso {
        /// The value of the surface.
        level: f64,
    },
    /// The surfaces of [`Scene::with_levels`](super::Scene::with_levels), all that a ray crosses.
    Surfaces,
}

impl Blend {
    /// Whether values of a ray are compared or averaged, and one of them becomes the pixel's colour.
    pub(crate) fn projects_values(self) -> bool {
        !matches!(self, Self::Over | Self::Under | Self::Add | Self::Iso { .. } | Self::Surfaces)
    }

    /// Whether slabs become colours, which are blended slice by slice.
    pub(crate) fn blends_colors(self) -> bool {
        matches!(self, Self::Over | Self::Under | Self::Add)
    }
}
