//! What is drawn on a finished picture: plain data. The drawing is the room `annotate`'s.

/// What is written and drawn on a picture once it is finished; nothing unless asked for.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
#[non_exhaustive]
pub struct Annotations {
    /// The transfer function's colours over the data's units, its opacity beside them.
    pub colorbar: bool,
    /// A bar of a round length in world units.
    pub scale_bar: bool,
    /// Where the picture's sides lie: letters R L A P S I where the file says so, else the world's axes.
    pub axes: bool,
    /// The edges of the volume's box; those behind it dashed.
    pub box_edges: bool,
    /// In cut pictures: where each cut lies.
    pub position: bool,
    /// A line of text at the top.
    pub title: Option<String>,
}

impl Annotations {
    /// None of them.
    pub fn new() -> Self {
        Self::default()
    }

    /// Whether anything is to be drawn.
    pub fn any(&self) -> bool {
        *self != Self::default()
    }
}
