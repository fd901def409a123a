//! The section `[annotate]`: what is drawn on the finished picture.

use crate::scene::Annotations;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

#[derive(Debug, Clone, Default, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub(super) struct AnnotateKeys {
    /// Whether a bar shows the transfer function's colours and opacity over the data's units.
    pub colorbar: Option<bool>,
    /// Whether a bar shows a length in world units: exact in parallel views, at the depth of the box's centre in perspective.
    pub scale_bar: Option<bool>,
    /// Whether letters at the sides tell right, left, anterior, posterior, superior, inferior (R L A P S I) where the file gives anatomy; else a cross of the axes x, y, z.
    pub axes: Option<bool>,
    /// A line of text at the top of the picture.
    pub title: Option<String>,
    /// Whether the edges of the volume's box are drawn, those behind it dashed.
    #[serde(rename = "box")]
    pub box_edges: Option<bool>,
}

impl AnnotateKeys {
    /// The section that asks for `annotations`, with what it asks for alone.
    pub(super) fn of(annotations: &Annotations) -> Self {
        let set = |on: bool| on.then_some(true);
        let Annotations { colorbar, scale_bar, axes, box_edges, title, .. } = annotations;
        Self { colorbar: set(*colorbar), scale_bar: set(*scale_bar), axes: set(*axes), title: title.clone(), box_edges: set(*box_edges) }
    }

    /// What the section asks for.
    pub(super) fn annotations(&self) -> Annotations {
        Annotations {
            colorbar: self.colorbar == Some(true),
            scale_bar: self.scale_bar == Some(true),
            axes: self.axes == Some(true),
            box_edges: self.box_edges == Some(true),
            position: false,
            title: self.title.clone().filter(|t| !t.trim().is_empty()),
        }
    }
}
