//! Names of image files: their kinds, and what is odd about their numbers.

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

/// The last number in `name`, and the name without it.
fn number(name: &str) -> Option<(u64, String)> {
    let stem = name.rsplit_once('.').map_or(name, |(stem, _)| stem);
    let end = stem.rfind(|c: char| c.is_ascii_digit())? + 1;
    let start = stem[..end].rfind(|c: char| !c.is_ascii_digit()).map_or(0, |at| at + stem[at..].chars().next().map_or(1, char::len_utf8));
    Some((stem[start..end].parse().ok()?, format!("{}{}", &stem[..start], &name[end..])))
}

/// What is to be told of the names of slices, sorted: that they are of several kinds, or that numbers are missing among them.
pub(super) fn oddities(names: &[String]) -> Option<String> {
    let numbers: Vec<(u64, String)> = names.iter().map(|name| number(name)).collect::<Option<_>>()?;
    if let Some(other) = numbers.iter().position(|(_, rest)| *rest != numbers[0].1) {
        return Some(format!(
            "The names are of several kinds, such as {:?} and {:?}: a pattern, such as \"name*.png\", takes some of them.",
            names[0], names[other]
        ));
    }
    let gaps: Vec<u64> = numbers.windows(2).map(|pair| pair[1].0.saturating_sub(pair[0].0)).collect();
    let step = gaps.iter().copied().min().filter(|&step| step > 0)?;
    let holes: Vec<String> = numbers
        .windows(2)
        .filter(|pair| pair[1].0 - pair[0].0 > step)
        .map(|pair| match pair[0].0 + step {
            low if low + step == pair[1].0 => low.to_string(),
            low => format!("{low} to {}", pair[1].0 - step),
        })
        .collect();
    match holes.len() {
        0 => None,
        n if n > 3 => Some(format!("Numbers are missing among the names: {} and others.", holes[..3].join(", "))),
        _ => Some(format!("Numbers are missing among the names: {}.", holes.join(", "))),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn missing_numbers_and_several_kinds_are_told() {
        let told = |names: &[&str]| oddities(&names.iter().map(|&n| n.to_owned()).collect::<Vec<_>>());
        assert_eq!(told(&["a1.png", "a2.png", "a3.png"]), None);
        assert_eq!(told(&["a2.png", "a4.png", "a6.png"]), None);
        assert_eq!(told(&["a.png", "b.png"]), None);
        assert_eq!(told(&["a1.png", "a2.png", "a5.png", "a7.png"]).as_deref(), Some("Numbers are missing among the names: 3 to 4, 6."));
        assert_eq!(told(&["x1y1.png", "x1y1.png"]), None);
        assert!(told(&["ct1.png", "ct2.png", "mask1.png"]).is_some_and(|t| t.contains("\"ct1.png\" and \"mask1.png\"")));
        assert_eq!(number("scan\u{e9}12.x.png"), Some((12, "scan\u{e9}.x.png".to_owned())));
    }

    #[test]
    fn kinds_are_told_by_extension() {
        assert_eq!(Kind::of("A.JPG"), Some(Kind::Jpeg));
        assert_eq!((Kind::of("png"), Kind::of("Thumbs.db"), Kind::of("a.png.txt")), (None, None, None));
    }
}
