//! Which array of a VTK file is read, and which of its components.

use super::super::reading::{Choice, Item, Part, pick};
use super::image::{Array, Image, Piece};
use crate::volume::VoxelType;
use crate::{Error, Result};
use std::path::Path;

/// Most names that a message lists.
const SHOWN: usize = 8;

/// What of an array's components is kept.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Kept {
    /// One of them.
    Channel(usize),
    /// All: they are red, green and blue, perhaps alpha.
    Colors,
}

/// The array that is read.
pub(super) struct Chosen<'i> {
    pub(super) array: &'i Array,
    pub(super) kept: Kept,
    /// What is to be told of it.
    pub(super) notes: Vec<String>,
}

/// What `volume.array` must say for an array: its name, and where points have one of the same name as cells, `cells:` in front of it.
fn id(piece: &Piece, array: &Array) -> String {
    let twice = array.cells && piece.arrays.iter().any(|a| !a.cells && a.name == array.name);
    if twice { format!("cells:{}", array.name) } else { array.name.clone() }
}

/// The array that is taken where none is chosen: points go before cells, scalars that the file calls active before the first array of one
/// component, and that before any other.
fn first(piece: &Piece) -> Option<&Array> {
    let all = || piece.arrays.iter().filter(|a| a.stored.is_some());
    let of = |cells: bool| {
        let active = piece.active[usize::from(cells)].as_deref();
        let active = all().find(|a| a.cells == cells && Some(a.name.as_str()) == active);
        active.or_else(|| all().find(|a| a.cells == cells && a.components == 1))
    };
    of(false).or_else(|| of(true)).or_else(|| all().next())
}

fn named<'i>(path: &Path, piece: &'i Piece, name: &str) -> Result<&'i Array> {
    let fault = |what| Err(Error::format(path, what));
    let Some(array) = piece.arrays.iter().find(|a| id(piece, a) == name) else {
        let ids: Vec<String> = piece.arrays.iter().take(SHOWN).map(|a| format!("{:?}", id(piece, a))).collect();
        let more = if piece.arrays.len() > SHOWN { format!(" and {} more", piece.arrays.len() - SHOWN) } else { String::new() };
        return fault(format!("volume.array is {name:?}: there is no such array, only {}{more}", ids.join(", ")));
    };
    match array.stored {
        Some(_) => Ok(array),
        None => fault(format!("array {} is of the type {:?}: not supported", array.shown(), array.kind)),
    }
}

/// What is read of `image`.
///
/// # Errors
/// When it has nothing of what is chosen, or no array of numbers at all.
pub(super) fn choose<'i>(path: &Path, image: &'i Image, choice: &Choice) -> Result<Chosen<'i>> {
    let none = || Error::format(path, "there is no array of numbers of the points or cells in it");
    let piece = image.pieces.first().ok_or_else(none)?;
    let array = match &choice.array {
        Some(name) => named(path, piece, name)?,
        None => first(piece).ok_or_else(none)?,
    };
    let mut notes = Vec::new();
    let count = piece.arrays.iter().filter(|a| a.stored.is_some()).count();
    if count > 1 && choice.array.is_none() {
        notes.push(format!("of the {count} arrays {} ({}) is read; volume.array chooses another", array.shown(), array.about()));
    }
    let colors = array.stored == Some(VoxelType::U8.into()) && matches!(array.components, 3 | 4) && choice.channel.is_none();
    let kept = if colors {
        let names = if array.components == 3 { "red, green and blue" } else { "red, green, blue and alpha" };
        notes.push(format!("the {} components of {} are taken for {names}", array.components, array.shown()));
        Kept::Colors
    } else {
        let channel = pick(path, Part::Channel, choice.channel, array.components)?;
        if array.components > 1 && choice.channel.is_none() {
            let what = format!("of the {} components of {} the first one is read", array.components, array.shown());
            notes.push(format!("{what}; volume.channel chooses another"));
        }
        Kept::Channel(channel)
    };
    Ok(Chosen { array, kept, notes })
}

/// The arrays, and the components of the one that is taken.
pub(super) fn items(path: &Path, image: &Image, choice: &Choice) -> Result<Vec<Item>> {
    let chosen = choose(path, image, choice)?;
    let mut items = Vec::new();
    if let Some(piece) = image.pieces.first() {
        let arrays: Vec<&Array> = piece.arrays.iter().filter(|a| a.stored.is_some()).collect();
        if arrays.len() > 1 {
            items.extend(arrays.iter().map(|a| Item::new(Part::Array, id(piece, a), a.about(), std::ptr::eq(*a, chosen.array))));
        }
    }
    if chosen.array.components > 1 {
        let taken = match chosen.kept {
            Kept::Colors => "taken as a colour".to_owned(),
            Kept::Channel(c) => format!("number {c} is taken"),
        };
        items.push(Item::row(Part::Channel, chosen.array.components, format!("components of {}, {taken}", chosen.array.shown())));
    }
    Ok(items)
}
