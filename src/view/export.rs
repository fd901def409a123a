//! A page of pictures from all around, rendered beforehand: it turns in any browser without a server.
//!
//! ```text
//!  elevation  60  o o o o o o o ...     a picture for each direction of a grid: columns go once around the volume,
//!              0  o o o o o o o         rows go from below to above it; a drag shows the next picture
//!            -60  o o o o o o o
//!                 0  10  20  azimuth
//! ```

use crate::scene::{Camera, Placement, Projection};
use crate::volume::{Grid, Origin, VolumeSource};
use crate::{Error, Result};
use glam::DVec3;
use std::str::FromStr;

const HEAD: &str = include_str!("page/export-head.html");
const STYLE: &str = include_str!("page/export.css");
const BODY: &str = include_str!("page/export-body.html");
const SCRIPT: &str = include_str!("page/export.js");

/// What the page begins with, so that an export knows its own.
pub const START: &[u8] = b"<!doctype html>\n<!-- slicestack view --export -->";

/// What stands before the list of a page's pictures.
const TOLD: &str = "<script type=\"application/json\" id=\"told\">";

/// Elevations lie between this many degrees below and above.
const STEEPEST: f64 = 60.0;

/// Most pictures of an export.
const MOST: u32 = 5000;

/// How many directions pictures are made from: columns around the volume, rows from below to above.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Views {
    columns: u32,
    rows: u32,
}

impl Default for Views {
    /// 36 around, in 5 rows.
    fn default() -> Self {
        Self { columns: 36, rows: 5 }
    }
}

impl FromStr for Views {
    type Err = Error;

    /// `COLUMNSxROWS`, such as 36x5.
    fn from_str(text: &str) -> Result<Self> {
        let parts = text.split_once('x').map(|(a, b)| (a.trim().parse::<u32>(), b.trim().parse::<u32>()));
        let Some((Ok(columns), Ok(rows))) = parts else {
            return Err(Error::invalid(format!("views {text}: write how many around and how many upwards, such as 36x5")));
        };
        if columns == 0 || rows == 0 || u64::from(columns) * u64::from(rows) > u64::from(MOST) {
            return Err(Error::invalid(format!(
                "views {text}: makes {} pictures; there can be 1 to {MOST}",
                u64::from(columns) * u64::from(rows)
            )));
        }
        Ok(Self { columns, rows })
    }
}

impl Views {
    /// Directions around the volume.
    pub fn columns(&self) -> u32 {
        self.columns
    }

    /// Degrees upwards, from the lowest row to the highest: -60 to 60, or 0 for one row.
    pub fn elevations(&self) -> Vec<f64> {
        let last = self.rows - 1;
        let at = |row: u32| if last == 0 { 0.0 } else { STEEPEST * (2.0 * f64::from(row) / f64::from(last) - 1.0) };
        (0..=last).map(at).collect()
    }

    /// The name of the picture in this column and row.
    pub fn name(&self, column: usize, row: usize) -> String {
        format!("view-{row:02}-{column:03}.webp")
    }

    /// Cameras about the target of `camera`, a row after the other from below, each row from the camera's own azimuth on to the picture's right, all at its
    /// distance and of its size. Upwards is the subject's up, or its down where the camera stands on its head.
    ///
    /// # Errors
    /// [`Error::Invalid`] for numbers that leave the range of f64.
    pub fn around(&self, camera: &Camera, grid: &Grid, (width, height): (u32, u32)) -> Result<Vec<Vec<Camera>>> {
        let view = camera.resolve(grid, width, height)?;
        let (front, up) = grid.space().front_and_up();
        let target = match camera.placement() {
            Placement::LookAt { target, .. } => target,
            _ => grid.center(),
        };
        let pole = if view.up.dot(up) < 0.0 { -up } else { up };
        let towards = target - view.eye;
        // Seen from straight above the picture's top is where the front would be.
        let level = |v: DVec3| (v - pole * v.dot(pole)).try_normalize();
        let first = level(-towards).filter(|_| view.forward.dot(pole).abs() < 0.9999).or_else(|| level(-view.up)).unwrap_or(front);
        let beside = pole.cross(first);
        let projection = match camera.projection() {
            Projection::Orthographic { .. } => Projection::Orthographic { height: Some(view.scale * f64::from(height)) },
            other => other,
        };
        // Parallel rays begin before the box from every side.
        let reach = grid.corners().iter().map(|c| c.distance(target)).fold(0.0, f64::max) * 1.001;
        let distance = if view.perspective { towards.length() } else { towards.length().max(reach) };
        let at = |elevation: f64, column: u32| {
            let (rise, run) = libm::sincos(elevation.to_radians());
            let (aside, ahead) = libm::sincos((360.0 * f64::from(column) / f64::from(self.columns)).to_radians());
            let direction = (first * ahead + beside * aside) * run + pole * rise;
            Camera::new(Placement::LookAt { eye: target + direction * distance, target, up: pole }, projection)
        };
        self.elevations().into_iter().map(|e| (0..self.columns).map(|c| at(e, c)).collect()).collect()
    }
}

/// The same cameras at one distance and of one size, the largest that any of them has: nothing jumps from row to row.
///
/// # Errors
/// [`Error::Invalid`] for numbers that leave the range of f64.
pub fn of_one_size(rows: &[Vec<Camera>]) -> Result<Vec<Vec<Camera>>> {
    let all = || rows.iter().flatten();
    let tallest = all()
        .map(|c| match c.projection() {
            Projection::Orthographic { height } => height.unwrap_or(0.0),
            Projection::Perspective { .. } => 0.0,
        })
        .fold(0.0, f64::max);
    let farthest = all()
        .map(|c| match c.placement() {
            Placement::LookAt { eye, target, .. } => eye.distance(target),
            _ => 0.0,
        })
        .fold(0.0, f64::max);
    let one = |camera: &Camera| {
        let Placement::LookAt { eye, target, up } = camera.placement() else { return Ok(*camera) };
        let eye = target + (eye - target).normalize_or_zero() * farthest;
        let projection = match camera.projection() {
            Projection::Orthographic { .. } => Projection::Orthographic { height: Some(tallest) },
            other => other,
        };
        Camera::new(Placement::LookAt { eye, target, up }, projection)
    };
    rows.iter().map(|row| row.iter().map(one).collect()).collect()
}

/// The row whose first camera looks most nearly as `camera` does.
///
/// # Errors
/// [`Error::Invalid`] for numbers that leave the range of f64.
pub fn nearest_row(rows: &[Vec<Camera>], camera: &Camera, grid: &Grid, (width, height): (u32, u32)) -> Result<usize> {
    let forward = camera.resolve(grid, width, height)?.forward;
    let mut best = (0, f64::NEG_INFINITY);
    for (n, first) in rows.iter().enumerate().filter_map(|(n, row)| Some((n, row.first()?))) {
        let likeness = first.resolve(grid, width, height)?.forward.dot(forward);
        if likeness > best.1 {
            best = (n, likeness);
        }
    }
    Ok(best.0)
}

/// What a view of `source` is called: the name of its file, or of its formula.
pub fn title_of(source: &VolumeSource) -> String {
    match (&source.origin, source.path()) {
        (Origin::Phantom(phantom, _), _) => format!("{} (built-in volume)", phantom.name()),
        (_, Some(path)) => path.file_name().unwrap_or(path.as_os_str()).to_string_lossy().into_owned(),
        (_, None) => "slicestack".to_owned(),
    }
}

/// Names of the pictures that the page of an export shows; none where `html` is no such page.
pub fn pictures_of(html: &str) -> Vec<String> {
    let told = html.split_once(TOLD).and_then(|(_, rest)| rest.split_once("</script>")).map(|(told, _)| told);
    let told: Option<serde_json::Value> = told.and_then(|told| serde_json::from_str(told).ok());
    let rows = told.as_ref().and_then(|told| told["names"].as_array());
    let names = rows.into_iter().flatten().filter_map(|row| row.as_array()).flatten().filter_map(|name| name.as_str());
    names.filter(|name| is_picture(name)).map(str::to_owned).collect()
}

/// Whether `name` is one that [`Views::name`] gives.
fn is_picture(name: &str) -> bool {
    let numbers = name.strip_prefix("view-").and_then(|rest| rest.strip_suffix(".webp")).and_then(|rest| rest.split_once('-'));
    numbers.is_some_and(|(row, column)| [row, column].iter().all(|n| !n.is_empty() && n.bytes().all(|b| b.is_ascii_digit())))
}

/// What a page shows.
#[derive(Debug, Clone)]
pub struct Page<'a> {
    /// What the pictures are of, for the heading and for those who do not see them.
    pub title: &'a str,
    /// The directions.
    pub views: Views,
    /// Columns and rows of pixels.
    pub size: (u32, u32),
    /// The row that is shown first; the first column is.
    pub first_row: usize,
}

impl Page<'_> {
    /// The page, with its style and its script in it; pictures lie beside it.
    pub fn html(&self) -> String {
        let Self { title, views, size: (width, height), first_row } = self;
        let names: Vec<Vec<String>> =
            (0..views.rows as usize).map(|row| (0..views.columns as usize).map(|column| views.name(column, row)).collect()).collect();
        let told = serde_json::json!({
            "title": title, "width": width, "height": height, "row": first_row, "elevations": views.elevations(), "names": names,
        });
        // No end tag may stand in a script element, nor a tag in a title.
        let told = told.to_string().replace('<', "\\u003c");
        let heading = title.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;");
        [
            HEAD,
            &format!("<title>{heading}</title>\n<style>\n{STYLE}</style>\n</head>\n<body>\n{BODY}"),
            &format!("{TOLD}{told}</script>\n<script>\n\"use strict\";\n{SCRIPT}</script>\n</body>\n</html>\n"),
        ]
        .concat()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn views(text: &str) -> Views {
        text.parse().expect("views")
    }

    #[test]
    fn grids_are_read_and_bounded() {
        assert_eq!(views("36x5"), Views { columns: 36, rows: 5 });
        assert_eq!(views("36x5").elevations(), [-60.0, -30.0, 0.0, 30.0, 60.0]);
        assert_eq!(views("8x1").elevations(), [0.0]);
        for wrong in ["", "36", "0x5", "36x0", "-1x5", "4294967295x4294967295", "5001x1", "axb"] {
            assert!(wrong.parse::<Views>().is_err(), "{wrong}");
        }
    }

    #[test]
    fn cameras_go_once_around_the_target_at_one_distance() {
        let grid = Grid::with_spacing([40, 20, 10], [1.0, 1.0, 2.0]).expect("a grid");
        let placement = Placement::LookAt { eye: DVec3::new(20.0, -80.0, 50.0), target: DVec3::new(20.0, 10.0, 9.0), up: DVec3::Z };
        let camera = Camera::new(placement, Projection::Perspective { fov_y: 30.0 }).expect("a camera");
        let rows = views("4x3").around(&camera, &grid, (100, 80)).expect("cameras");
        assert_eq!((rows.len(), rows[0].len()), (3, 4));
        let eye = |c: &Camera| c.resolve(&grid, 100, 80).expect("a view").eye;
        let target = DVec3::new(20.0, 10.0, 9.0);
        let distance = DVec3::new(0.0, 90.0, 41.0).length();
        // The level row: first where the camera stands, then to its right.
        let level: Vec<DVec3> = rows[1].iter().map(|c| (eye(c) - target) / distance).collect();
        for (got, want) in level.iter().zip([DVec3::NEG_Y, DVec3::X, DVec3::Y, DVec3::NEG_X]) {
            assert!(got.distance(want) < 1e-12, "{got} {want}");
        }
        let high = (eye(&rows[2][0]) - target).normalize();
        assert!((high.z - libm::sin(60f64.to_radians())).abs() < 1e-12, "{high}");
        // The camera itself looks down by 24 degrees: nearer to the level row than to that at 60.
        assert_eq!(nearest_row(&rows, &camera, &grid, (100, 80)).expect("a row"), 1);
        assert!(rows.iter().flatten().all(|c| (eye(c).distance(target) - distance).abs() < 1e-9));
    }

    #[test]
    fn rows_of_several_sizes_become_one() {
        let camera = |height: f64, away: f64| {
            let placement = Placement::LookAt { eye: DVec3::new(0.0, -away, 0.0), target: DVec3::ZERO, up: DVec3::Z };
            Camera::new(placement, Projection::Orthographic { height: Some(height) }).expect("a camera")
        };
        let rows = of_one_size(&[vec![camera(10.0, 50.0)], vec![camera(30.0, 20.0)]]).expect("cameras");
        assert_eq!(rows, [vec![camera(30.0, 50.0)], vec![camera(30.0, 50.0)]]);
    }

    #[test]
    fn pages_name_every_picture_and_no_title_becomes_markup() {
        let page = Page { title: "a<b></script>", views: views("3x2"), size: (64, 48), first_row: 1 };
        let html = page.html();
        assert!(html.as_bytes().starts_with(START));
        for row in 0..2 {
            for column in 0..3 {
                assert!(html.contains(&page.views.name(column, row)));
            }
        }
        assert!(html.contains("<title>a&lt;b&gt;") && !html.contains("a<b"));
        assert_eq!(html.matches("</script>").count(), 2);
        let named = pictures_of(&html);
        assert_eq!((named.len(), named[0].as_str()), (6, "view-00-000.webp"));
        // A page that was written by another hand names nothing that lies elsewhere.
        assert_eq!(pictures_of(&html.replace("view-00-000.webp", "../letter.webp")).len(), 5);
        assert!(pictures_of("<!doctype html>").is_empty());
    }
}
