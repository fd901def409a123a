//! Six lessons from a box to a picture: each does one step in code of about a screen, tells what it finds and draws it.
//!
//! ```text
//!  lesson --make--> what it tells, a drawing --png--> Shown
//! ```
//! They use the library's own parts where it has them, and do by hand what the hand teaches. Their drawings carry their own titles, axes and
//! letters, so that they can be read without the text beside them.

mod coverage;
mod fetch;
mod figure;
mod fog;
mod over;
mod polygons;
mod transfer_function;

use super::plot::Drawing;
use crate::Result;

/// A lesson.
#[derive(Debug, Clone, Copy)]
#[non_exhaustive]
pub struct Lesson {
    /// Its number, from 1.
    pub number: u32,
    /// Its name, a word or two joined by `_`.
    pub name: &'static str,
    /// What it shows, in a sentence without its point.
    pub about: &'static str,
    make: fn() -> Result<(String, Drawing)>,
}

/// What a lesson has to show.
#[derive(Debug, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub struct Shown {
    /// What it found, lines of text.
    pub told: String,
    /// What it drew, as a PNG file.
    pub picture: Vec<u8>,
}

/// All lessons, in their order.
pub const LESSONS: [Lesson; 6] = [
    Lesson {
        number: 1,
        name: "polygons",
        about: "planes of constant depth cut a box, and each cut is a convex polygon of 3 to 6 corners",
        make: polygons::make,
    },
    Lesson {
        number: 2,
        name: "coverage",
        about: "a pixel belongs to a polygon if its centre does, and a centre on a shared side belongs to exactly one of two",
        make: coverage::make,
    },
    Lesson {
        number: 3,
        name: "fetch",
        about: "a texture coordinate becomes an index, the index a cell and weights, and eight voxels become one value",
        make: fetch::make,
    },
    Lesson {
        number: 4,
        name: "transfer_function",
        about: "an opacity belongs to a length, so a slab's opacity is 1 - (1 - a)^(thickness / length)",
        make: transfer_function::make,
    },
    Lesson {
        number: 5,
        name: "over",
        about: "slabs are blended front to back or back to front, and both are the same sum",
        make: over::make,
    },
    Lesson {
        number: 6,
        name: "fog",
        about: "on premultiplied colours the fog's part is weighted by the opacity, or empty slices light up",
        make: fog::make,
    },
];

impl Lesson {
    /// Does what the lesson teaches.
    ///
    /// # Errors
    /// [`crate::Error::Invalid`] when its picture cannot be encoded, and as [`crate::render`].
    pub fn run(&self) -> Result<Shown> {
        let (told, drawing) = (self.make)()?;
        Ok(Shown { told, picture: drawing.png()? })
    }

    /// The name of its picture's file: `lesson_1_polygons.png`.
    pub fn file_name(&self) -> String {
        format!("lesson_{}_{}.png", self.number, self.name)
    }

    /// The lesson with this number or name, if there is one.
    pub fn named(name: &str) -> Option<&'static Self> {
        LESSONS.iter().find(|l| l.name == name || l.number.to_string() == name)
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test fails by panicking")]
mod tests;
