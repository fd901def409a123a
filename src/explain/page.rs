//! The page: record, pictures, style and script in one HTML file that asks nothing of a network.

use super::Explanation;
use crate::picture::{Depth, Format};
use crate::{Picture, Result};
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use std::borrow::Cow;

/// Up to the title. Its policy lets nothing be fetched, whatever a volume is called.
const HEAD: &str = include_str!("page/head.html");
const STYLE: &str = include_str!("page/style.css");
const BODY: &str = include_str!("page/body.html");
/// In the order they build on each other.
const SCRIPTS: [&str; 3] = [include_str!("page/tools.js"), include_str!("page/plots.js"), include_str!("page/stages.js")];
/// Steps of scenes with gradients or light; no other page has them.
const LIT: [&str; 2] = [include_str!("page/gradient.js"), include_str!("page/light.js")];
/// The last: it shows what the others have declared.
const MAIN: &str = include_str!("page/main.js");
/// Largest side of the picture on the page.
const SIDE: u32 = 1024;

fn uri(png: &[u8]) -> String {
    format!("data:image/png;base64,{}", STANDARD.encode(png))
}

/// The picture as a PNG, shrunk by a whole factor to at most [`SIDE`] pixels a side.
fn picture_uri(picture: &Picture) -> Result<String> {
    let factor = picture.width().max(picture.height()).div_ceil(SIDE);
    let small = if factor > 1 { Cow::Owned(shrunk(picture, factor)) } else { Cow::Borrowed(picture) };
    Ok(uri(&small.encode(Format::Png, Depth::Eight)?))
}

/// Means over squares of `factor` pixels.
fn shrunk(picture: &Picture, factor: u32) -> Picture {
    let (width, height) = (picture.width().div_ceil(factor), picture.height().div_ceil(factor));
    let mean = |x: u32, y: u32| {
        let (mut sum, mut n) = ([0.0f32; 4], 0.0f32);
        for py in y * factor..(y * factor + factor).min(picture.height()) {
            for px in x * factor..(x * factor + factor).min(picture.width()) {
                let p = picture.pixel(px, py);
                for c in 0..4 {
                    sum[c] += p[c];
                }
                n += 1.0;
            }
        }
        sum.map(|s| s / n)
    };
    let pixels = (0..height).flat_map(|y| (0..width).map(move |x| (x, y))).map(|(x, y)| mean(x, y)).collect();
    Picture::new(width, height, pixels)
}

/// JSON that may stand in a script element: no end tag, no comment.
fn inert(json: &str) -> String {
    json.replace('<', "\\u003c")
}

/// Text that may stand in an element.
fn text(s: &str) -> String {
    s.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}

pub(super) fn page(explanation: &Explanation) -> Result<String> {
    let name = explanation.record.scene.name();
    let mut pictures = serde_json::Map::new();
    pictures.insert("picture".into(), picture_uri(&explanation.picture)?.into());
    pictures.insert("drawing".into(), uri(&explanation.drawing).into());
    if let Some(plane) = &explanation.plane {
        pictures.insert("plane".into(), uri(plane).into());
    }
    if let Some([weighted, literal]) = &explanation.fogs {
        pictures.insert("weighted".into(), picture_uri(weighted)?.into());
        pictures.insert("literal".into(), picture_uri(literal)?.into());
        // What rounds to more than 1 in eight bits.
        let clipped = literal.pixels().iter().any(|p| p[..3].iter().any(|&c| c > 1.0 + 0.5 / 255.0));
        pictures.insert("clipped".into(), clipped.into());
    }
    let pictures = inert(&serde_json::Value::Object(pictures).to_string());
    let lit = explanation.record.gradient.is_some() || explanation.record.light.is_some();
    let scripts = [SCRIPTS.concat(), if lit { LIT.concat() } else { String::new() }, MAIN.to_owned()].concat();
    let record = inert(&explanation.json()?);
    Ok([
        HEAD,
        &format!("<title>{} step by step</title>\n<style>\n{STYLE}</style>\n</head>\n<body>\n{BODY}", text(&name)),
        &format!("<script type=\"application/json\" id=\"record\">{record}</script>\n"),
        &format!("<script type=\"application/json\" id=\"pictures\">{pictures}</script>\n"),
        &format!("<script>\n\"use strict\";\n{scripts}</script>\n</body>\n</html>\n"),
    ]
    .concat())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Straight colours that are not on record: of lights, fogs, regions, the transfer function, and of what the page itself works out.
    const STRAIGHT: [&str; 8] = [
        "fog.color)",
        "scene.example_fog.color)",
        "lamp.color)",
        "r.color)",
        "[r, g, b])",
        "rgb)",
        "after)",
        "shownOf(b.want.slice(0, 3), b.want[3]))",
    ];

    /// The same place of the record has one colour wherever it stands on the page: its swatch is made by one function of the record alone.
    #[test]
    fn swatches_of_the_record_are_made_in_one_place() {
        let [tools, others @ ..] = SCRIPTS;
        assert_eq!(tools.matches("\"swatch\"").count(), 1);
        let (before, after) = tools.split_once("const swatch = ").expect("the script makes swatches");
        let (_, rest) = after.split_once('\n').expect("more than a line");
        // Each function there names the place that it shows, and takes the colour from it.
        let named = rest.matches("swatch(").count();
        assert_eq!((before.matches("swatch(").count(), named, rest.matches("swatch(shownOf(").count()), (0, 4, 4));
        assert_eq!(rest.matches(", pixel ${pixel.x},${pixel.y}").count(), named);
        let mut seen = 0;
        for script in others.iter().chain(&LIT).chain([&MAIN]) {
            assert!(!script.contains("\"swatch\"") && !script.contains("css(straightOf("), "a swatch of its own");
            // With a small s: functions of the record are fragmentSwatch, twinSwatch and the like.
            for (at, call) in script.match_indices("swatch(") {
                let given = &script[at + call.len()..];
                assert!(STRAIGHT.iter().any(|straight| given.starts_with(straight)), "swatch({}", &given[..given.len().min(40)]);
                seen += 1;
            }
        }
        assert!(seen >= STRAIGHT.len(), "{seen} swatches of straight colours");
    }

    /// Wherever a colour is shown, the page says whether it is straight or premultiplied: beside the swatch, or in the head of its table.
    #[test]
    fn every_colour_says_which_it_is() {
        let mut seen = 0;
        for script in SCRIPTS.iter().chain(&LIT).chain([&MAIN]) {
            let (_, script) = script.split_once("const toData").unwrap_or(("", script));
            let lines: Vec<&str> = script.lines().collect();
            for (at, line) in lines.iter().enumerate().filter(|(_, line)| line.contains("watch(")) {
                // A table's rows are made some lines before its head.
                let near = lines[at..(at + 12).min(lines.len())].join("\n");
                assert!(near.contains("straight") || near.contains("premultiplied"), "{line}");
                seen += 1;
            }
        }
        assert!(seen > 15, "{seen} lines with swatches");
    }
}
