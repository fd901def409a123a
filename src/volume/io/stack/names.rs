//! Names of image files: their kinds and their order.

use std::cmp::Ordering;
use std::fmt;

/// A kind of image files.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Kind {
    Png,
    Tiff,
    Jpeg,
    Bmp,
    Pnm,
}

impl Kind {
    /// The kind that the extension of `name` tells.
    pub(super) fn of(name: &str) -> Option<Self> {
        let (_, extension) = name.rsplit_once('.')?;
        Some(match extension.to_ascii_lowercase().as_str() {
            "png" => Self::Png,
            "tif" | "tiff" => Self::Tiff,
            "jpg" | "jpeg" => Self::Jpeg,
            "bmp" => Self::Bmp,
            "pgm" | "ppm" | "pnm" => Self::Pnm,
            _ => return None,
        })
    }
}

impl fmt::Display for Kind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Png => "PNG",
            Self::Tiff => "TIFF",
            Self::Jpeg => "JPEG",
            Self::Bmp => "BMP",
            Self::Pnm => "PNM",
        })
    }
}

/// The digits or the other characters that `text` starts with, and the rest.
fn run(text: &str) -> (bool, &str, &str) {
    let digits = text.starts_with(|c: char| c.is_ascii_digit());
    let end = text.find(|c: char| c.is_ascii_digit() != digits).unwrap_or(text.len());
    (digits, &text[..end], &text[end..])
}

/// Order of names in which numbers count as such: `a2` before `a10`. Different names are never equal.
pub(super) fn natural(a: &str, b: &str) -> Ordering {
    let (mut left, mut right) = (a, b);
    while !left.is_empty() && !right.is_empty() {
        let ((digits, x, left_rest), (other, y, right_rest)) = (run(left), run(right));
        let order = if digits && other {
            let (x, y) = (x.trim_start_matches('0'), y.trim_start_matches('0'));
            x.len().cmp(&y.len()).then_with(|| x.cmp(y))
        } else {
            x.cmp(y)
        };
        if order != Ordering::Equal {
            return order;
        }
        (left, right) = (left_rest, right_rest);
    }
    // As many zeros in front of a number as may be: the names themselves decide.
    left.len().min(1).cmp(&right.len().min(1)).then_with(|| a.cmp(b))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_in_names_count_as_numbers() {
        let sorted = [
            "1",
            "2",
            "10",
            "a",
            "a.png",
            "a0",
            "a00",
            "a1",
            "a01b",
            "a2",
            "a2b1",
            "a2b10",
            "a10",
            "a010c",
            "a99999999999999999999999",
            "b",
        ];
        for (i, a) in sorted.iter().enumerate() {
            for (j, b) in sorted.iter().enumerate() {
                assert_eq!(natural(a, b), i.cmp(&j), "{a} and {b}");
            }
        }
    }

    #[test]
    fn kinds_are_told_by_extension() {
        assert_eq!(Kind::of("A.JPG"), Some(Kind::Jpeg));
        assert_eq!((Kind::of("png"), Kind::of("Thumbs.db"), Kind::of("a.png.txt")), (None, None, None));
    }
}
