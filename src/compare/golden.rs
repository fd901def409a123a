//! Pictures on record for the tests of a crate: see [`assert_golden`](crate::assert_golden).

use super::{Comparison, Tolerance, difference_map};
use crate::files::write_whole;
use crate::picture::{Depth, Format};
use crate::{Picture, Result};
use std::path::{Path, PathBuf};

/// What became of a picture that was held against one on record.
#[derive(Debug, Clone, PartialEq)]
pub enum Golden {
    /// It is within the tolerance.
    Same,
    /// It was put on record: `SLICESTACK_BLESS=1` is set.
    Blessed(PathBuf),
    /// It is not; a message of several lines that names the files to look at.
    Differs(String),
}

/// Holds `picture`, rounded to 8 bits, against `NAME.png` in `folder`. With `bless` it is put there in its place. Where it differs beyond
/// `tolerance`, or there is none, `NAME.png` and `NAME-diff.png` are written into `found`, which is made.
///
/// # Errors
/// [`crate::Error::Io`] when a file cannot be read or written; [`crate::Error::Format`] when the one on record is no picture.
pub fn golden(picture: &Picture, name: &str, folder: &Path, found: &Path, tolerance: &Tolerance, bless: bool) -> Result<Golden> {
    let (record, actual, diff) =
        (folder.join(format!("{name}.png")), found.join(format!("{name}.png")), found.join(format!("{name}-diff.png")));
    let parent = |path: &Path| {
        let folder = path.parent().unwrap_or(path);
        std::fs::create_dir_all(folder).map_err(|e| crate::Error::io(folder, e))
    };
    let bytes = picture.encode(Format::Png, Depth::Eight)?;
    if bless {
        parent(&record)?;
        write_whole(&record, &bytes)?;
        return Ok(Golden::Blessed(record));
    }
    let shown = |message: String| {
        parent(&actual)?;
        write_whole(&actual, &bytes)?;
        Ok(Golden::Differs(format!("{message}\nfound: {}\nSLICESTACK_BLESS=1 puts it on record", actual.display())))
    };
    if !record.exists() {
        return shown(format!("{name}: there is no {}", record.display()));
    }
    let (before, now) = (Picture::open(&record)?, Picture::decode(&bytes, &actual)?);
    if (before.width(), before.height()) != (now.width(), now.height()) {
        let ((w, h), (v, g)) = ((before.width(), before.height()), (now.width(), now.height()));
        return shown(format!("{name}: {v} x {g} pixels, on record {w} x {h}\non record: {}", record.display()));
    }
    let comparison = Comparison::of(&before, &now)?;
    let Some(beyond) = tolerance.exceeded(&comparison) else { return Ok(Golden::Same) };
    parent(&diff)?;
    difference_map(&before, &now)?.save(&diff, Depth::Eight)?;
    let (x, y) = comparison.worst.unwrap_or_default();
    shown(format!(
        "{name}: {beyond}; largest difference {:.3e} at pixel {x},{y}\non record: {}\ndifference: {}",
        comparison.max,
        record.display(),
        diff.display()
    ))
}

/// Holds a picture against `tests/goldens/NAME.png` of the crate that calls it, rounded to 8 bits.
///
/// `assert_golden!(picture, "name")` wants the same pixels; `assert_golden!(picture, "name", tolerance)` lets them differ within a
/// [`Tolerance`](crate::compare::Tolerance). With `SLICESTACK_BLESS=1` in the environment the picture is put on record instead.
///
/// # Panics
/// When the pictures differ, or none is on record: the message names the picture found and a picture of the differences, both in
/// `target/goldens/` of that crate, or in `CARGO_TARGET_DIR`.
///
/// ```no_run
/// # fn main() -> slicestack::Result<()> {
/// use slicestack::volume::phantom::Phantom;
/// use slicestack::{Scene, assert_golden, render};
///
/// let scene = Scene::new(Phantom::Cloud.default_transfer(16)).with_size(64, 64)?;
/// assert_golden!(render(&Phantom::Cloud.volume(16)?, &scene)?, "cloud");
/// # Ok(())
/// # }
/// ```
#[macro_export]
macro_rules! assert_golden {
    ($picture:expr, $name:expr $(,)?) => {
        $crate::assert_golden!($picture, $name, $crate::compare::Tolerance::exact())
    };
    ($picture:expr, $name:expr, $tolerance:expr $(,)?) => {{
        let here = ::std::path::Path::new(env!("CARGO_MANIFEST_DIR"));
        let target = ::std::env::var_os("CARGO_TARGET_DIR").map_or_else(|| here.join("target"), ::std::path::PathBuf::from);
        let bless = ::std::env::var_os("SLICESTACK_BLESS").is_some_and(|on| on == "1");
        let (folder, found) = (here.join("tests").join("goldens"), target.join("goldens"));
        match $crate::compare::golden(&$picture, $name, &folder, &found, &$tolerance, bless) {
            Ok($crate::compare::Golden::Differs(message)) => panic!("{message}"),
            Ok(_) => {}
            Err(error) => panic!("{}: {error}", $name),
        }
    }};
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, clippy::panic, reason = "a test fails by panicking")]
    use super::*;

    fn picture(width: u32, off: f32) -> Picture {
        let pixel = |i: u32| [if i == 11 { off } else { 0.5 }, 0.25, 0.125, 1.0];
        Picture::from_pixels(width, 8, (0..width * 8).map(pixel).collect()).unwrap()
    }

    #[test]
    fn pictures_are_put_on_record_compared_and_shown() {
        let dir = tempfile::tempdir().unwrap();
        let (folder, found) = (dir.path().join("tests/goldens"), dir.path().join("target/goldens"));
        let held = |p: &Picture, t: Tolerance, bless: bool| golden(p, "sub/a", &folder, &found, &t, bless).unwrap();
        let message = |held: Golden| match held {
            Golden::Differs(message) => message,
            other => panic!("{other:?}"),
        };
        let none = message(held(&picture(9, 0.5), Tolerance::exact(), false));
        assert!(none.contains("sub/a: there is no ") && found.join("sub/a.png").is_file(), "{none}");
        assert_eq!(held(&picture(9, 0.5), Tolerance::exact(), true), Golden::Blessed(folder.join("sub/a.png")));
        assert_eq!(held(&picture(9, 0.5), Tolerance::exact(), false), Golden::Same);
        // Less than 8 bits can tell is the same.
        assert_eq!(held(&picture(9, 0.5001), Tolerance::exact(), false), Golden::Same);
        let off = message(held(&picture(9, 0.75), Tolerance::exact(), false));
        assert!(off.contains("1 pixels differ, over 0; largest difference 2.4") && off.contains("at pixel 2,1"), "{off}");
        assert!(off.contains("sub/a-diff.png") && Picture::open(found.join("sub/a-diff.png")).unwrap().width() == 9);
        assert_eq!(held(&picture(9, 0.75), Tolerance::new().max_rms(0.1), false), Golden::Same);
        let sizes = message(held(&picture(10, 0.5), Tolerance::new(), false));
        assert!(sizes.contains("10 x 8 pixels, on record 9 x 8"), "{sizes}");
    }
}
