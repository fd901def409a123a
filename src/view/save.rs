//! What the page's user takes away: the picture in full, as `slicestack render` writes it, or the scene.

use super::document::{Asked, Opened};
use super::export::title_of;
use crate::annotate::annotate;
use crate::picture::{Depth, Format, Metadata};
use crate::proof::Provenance;
use crate::scene::SceneFormat;
use crate::volume::{Origin, VolumeSource};
use crate::{Error, Renderer, Result};
use serde::Deserialize;

/// The first line of a scene in TOML.
const HEAD: &str = "# Written by slicestack; render it with: slicestack render FILE\n";

/// What is wanted.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub(super) enum Kind {
    Toml,
    Json,
    Png,
    Png16,
    Exr,
    Npy,
}

impl Kind {
    pub(super) fn extension(self) -> &'static str {
        match self {
            Self::Toml => "toml",
            Self::Json => "json",
            Self::Png | Self::Png16 => "png",
            Self::Exr => "exr",
            Self::Npy => "npy",
        }
    }

    /// What tells its file from that of another kind with the same extension.
    fn suffix(self) -> &'static str {
        if self == Self::Png16 { "-16" } else { "" }
    }

    pub(super) fn content_type(self) -> &'static str {
        match self {
            Self::Toml => "application/toml",
            Self::Json => "application/json",
            Self::Png | Self::Png16 => "image/png",
            Self::Exr => "image/x-exr",
            Self::Npy => "application/octet-stream",
        }
    }
}

/// The name that a file of `kind` is suggested: that of the volume's file without what says its format, or that of the formula.
pub(super) fn name(source: &VolumeSource, title: &str, kind: Kind) -> String {
    let name = match &source.origin {
        Origin::Phantom(phantom, _) if title == title_of(source) => phantom.name(),
        _ => title,
    };
    format!("{}{}.{}", stem(name), kind.suffix(), kind.extension())
}

/// `name` without its extension, and without the one that it packs: head.nii.gz is head.
fn stem(name: &str) -> &str {
    let cut = |name: &'_ str, at: Option<usize>| at.filter(|&at| at > 0).map_or(name.len(), |at| at);
    let first = &name[..cut(name, name.rfind('.'))];
    let packed = name[first.len()..].eq_ignore_ascii_case(".gz") || name[first.len()..].eq_ignore_ascii_case(".zip");
    if packed { &first[..cut(first, first.rfind('.'))] } else { first }
}

/// The bytes of `asked` as `kind`; `renderer` makes the picture.
///
/// # Errors
/// As [`Renderer::render`] and the writers.
pub(super) fn bytes(opened: &Opened, renderer: &mut Renderer, asked: &Asked, kind: Kind) -> Result<Vec<u8>> {
    let (format, depth) = match kind {
        Kind::Toml => return Ok((HEAD.to_owned() + &opened.save(asked, SceneFormat::Toml)?).into_bytes()),
        Kind::Json => return Ok(opened.save(asked, SceneFormat::Json)?.into_bytes()),
        Kind::Png => (Format::Png, Depth::Eight),
        Kind::Png16 => (Format::Png, Depth::Sixteen),
        Kind::Exr => (Format::Exr, Depth::Eight),
        Kind::Npy => (Format::Npy, Depth::Eight),
    };
    let Asked { scene, annotations, .. } = asked;
    if annotations.any() && kind == Kind::Npy {
        return Err(Error::invalid("annotate: a .npy file holds numbers to compute with, nothing is drawn on them"));
    }
    let (picture, _) = renderer.render(scene)?;
    if annotations.any() {
        return annotate(&picture, annotations, scene, &opened.volume)?.0.encode(format, depth);
    }
    if !format.carries_metadata() {
        return picture.encode(format, depth);
    }
    let metadata = match Provenance::of(scene, &opened.source, &opened.volume, &picture) {
        // A table too large for a scene file is the one thing that a picture cannot carry.
        Err(Error::Limit { .. }) => Metadata::new(),
        provenance => provenance?.metadata()?,
    };
    picture.encode_with(format, depth, &metadata)
}

#[cfg(test)]
mod tests {
    use super::stem;

    #[test]
    fn names_of_pictures_do_not_carry_the_format_of_the_volume() {
        let cases = [
            ("head.nrrd", "head"),
            ("example_ct.nii.gz", "example_ct"),
            ("a.b.nrrd", "a.b"),
            ("head", "head"),
            (".hidden", ".hidden"),
            ("x.GZ", "x"),
        ];
        for (name, wanted) in cases {
            assert_eq!(stem(name), wanted);
        }
    }
}
