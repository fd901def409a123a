//! What all sections share: the document around them, the making of messages, and the words of a choice.

use super::table::nearest;
use super::{Document, Places};
use crate::scene::Scene;
use crate::{Error, Result, Volume};
use std::path::Path;

/// Keys given on the command line, and the keys of the file that they drop: other ways to say the same thing.
pub(super) type Rivals = (&'static [&'static str], &'static [&'static str]);

/// A key, and whether it is given.
pub(super) type Given = (&'static str, bool);

/// The document that a section stands in, and what messages about its keys need.
pub(super) struct Context<'a> {
    pub(super) document: &'a Document,
    pub(super) places: &'a Places,
    /// Directory that paths in the file are relative to.
    pub(super) base: &'a Path,
}

impl Context<'_> {
    /// The error `what` about the key `path`.
    pub(super) fn error(&self, path: &str, what: impl AsRef<str>) -> Error {
        self.places.error(path, what.as_ref())
    }

    /// The member of `all` called `name`.
    pub(super) fn named<T: Copy>(&self, path: &str, name: &str, all: &[T], name_of: impl Fn(T) -> &'static str) -> Result<T> {
        let names: Vec<&str> = all.iter().map(|&t| name_of(t)).collect();
        all.iter().copied().find(|&t| name_of(t) == name).ok_or_else(|| {
            let best = nearest(name, &names).unwrap_or_default();
            self.error(path, format!("unknown \"{name}\"; the nearest known one is \"{best}\", all are {}", names.join(", ")))
        })
    }

    /// An error when one of `keys` is given, for the reason `why`.
    pub(super) fn refuse(&self, keys: &[(&str, bool)], why: &str) -> Result<()> {
        keys.iter().find(|k| k.1).map_or(Ok(()), |(key, _)| Err(self.error(key, why)))
    }
}

/// A volume that has been loaded, and what the user should hear about the scene of it.
pub(super) struct Data<'a> {
    pub(super) volume: &'a Volume,
    pub(super) scene: Scene,
    pub(super) warnings: Vec<String>,
    /// What was decided for the user, and why.
    pub(super) notes: Vec<String>,
}

/// The words of keys that take one of several: an enumeration for each key, whose variants are the words in kebab case.
///
/// `WrapKey => Wrap { ClampToEdge, Repeat }` also makes each word the variant of [`Wrap`](crate::scene::Wrap) that it stands
/// for: the one of the same name, or the one behind `as`; and each variant the word for it. Where there are variants without a word,
/// `FilterKey =>? Filter { Linear, Nearest }`, the word for a variant is an `Option`.
macro_rules! choices {
    ($($name:ident $(=> $scene:ident)? $(=> ? $partly:ident)? { $($word:ident $(as $variant:ident)?),* $(,)? })*) => {
        $(
            #[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Deserialize, serde::Serialize, schemars::JsonSchema)]
            #[serde(rename_all = "kebab-case")]
            pub(super) enum $name { $($word),* }
            choices!(@into $name [$($scene)? $($partly)?] $($word [$($variant)?])*);
            choices!(@all $name [$($scene)?] $($word [$($variant)?])*);
            choices!(@some $name [$($partly)?] $($word [$($variant)?])*);
        )*
    };
    (@into $name:ident [] $($word:ident $variant:tt)*) => {};
    (@into $name:ident [$scene:ident] $($word:ident $variant:tt)*) => {
        impl From<$name> for $scene {
            fn from(word: $name) -> Self {
                match word {
                    $($name::$word => choices!(@variant $scene $word $variant)),*
                }
            }
        }
    };
    (@all $name:ident [] $($word:ident $variant:tt)*) => {};
    (@all $name:ident [$scene:ident] $($word:ident $variant:tt)*) => {
        impl From<$scene> for $name {
            fn from(value: $scene) -> Self {
                match value {
                    $(choices!(@variant $scene $word $variant) => Self::$word),*
                }
            }
        }
    };
    (@some $name:ident [] $($word:ident $variant:tt)*) => {};
    (@some $name:ident [$scene:ident] $($word:ident $variant:tt)*) => {
        impl $name {
            /// The word for `value`, where there is one.
            fn of(value: $scene) -> Option<Self> {
                match value {
                    $(choices!(@variant $scene $word $variant) => Some(Self::$word),)*
                    _ => None,
                }
            }
        }
    };
    (@variant $scene:ident $word:ident []) => { $scene::$word };
    (@variant $scene:ident $word:ident [$variant:ident]) => { $scene::$variant };
}
pub(super) use choices;
