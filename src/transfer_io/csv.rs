//! A table with the columns value, red, green, blue, opacity; opacities per one world unit.
//!
//! The first line names the columns, in any order and as `r`, `g`, `b`, `a` too; lines that are empty or begin with `#` are passed over. Two
//! lines of one value make a step.

use super::numbers::{colors, curve, number, shortened, some};
use super::resample::rows;
use super::{Contents, MAX_POINTS, Parsed, VolumeProperty, number as written};

/// Names of the columns: the one that is written, then others that are read.
const COLUMNS: [&[&str]; 5] =
    [&["value", "v", "x", "scalar"], &["r", "red"], &["g", "green"], &["b", "blue"], &["opacity", "a", "alpha", "o"]];

pub(super) fn parse(text: &str) -> Parsed<Contents> {
    let mut lines = text.lines().enumerate().map(|(i, line)| (i + 1, line.trim())).filter(|l| !l.1.is_empty() && !l.1.starts_with('#'));
    let (at, head) = lines.next().ok_or("an empty table; its first line names the columns value,r,g,b,opacity")?;
    let places = columns(head).map_err(|what| format!("line {at}: {what}"))?;
    let width = head.split(',').count();
    let (mut color, mut opacity) = (Vec::new(), Vec::new());
    for (at, line) in lines {
        let cells: Vec<&str> = line.split(',').collect();
        if cells.len() != width {
            return Err(format!("line {at}: {} columns, where the first line has {width}", cells.len()));
        }
        if color.len() == MAX_POINTS {
            return Err(format!("line {at}: more than the limit of {MAX_POINTS} points"));
        }
        let mut row = [0.0; 5];
        for (i, x) in row.iter_mut().enumerate() {
            *x = number(cells[places[i]], &format!("line {at}: {}", COLUMNS[i][0]))?;
        }
        let [v, r, g, b, a] = row;
        color.push([v, r, g, b]);
        opacity.push([v, a]);
    }
    let property = VolumeProperty {
        color: some(colors(color, "colour")?, "the table")?,
        opacity: curve(opacity, "opacity")?,
        ..VolumeProperty::default()
    };
    Ok(Contents { property, warnings: Vec::new() })
}

/// Where each of the five columns stands.
fn columns(head: &str) -> Parsed<[usize; 5]> {
    let names: Vec<String> = head.split(',').map(|n| n.trim().trim_matches('"').to_ascii_lowercase()).collect();
    let mut places = [0; 5];
    for (place, known) in places.iter_mut().zip(COLUMNS) {
        *place = names
            .iter()
            .position(|n| known.contains(&n.as_str()))
            .ok_or_else(|| format!("no column {}; the columns are value,r,g,b,opacity, not {:?}", known[0], shortened(head)))?;
    }
    Ok(places)
}

pub(super) fn write(property: &VolumeProperty) -> String {
    let mut text = COLUMNS.map(|names| names[0]).join(",") + "\n";
    for row in rows(property) {
        text += &row.map(written).join(",");
        text.push('\n');
    }
    text
}
