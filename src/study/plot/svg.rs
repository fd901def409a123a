//! A drawing as SVG text.

use super::{Anchor, Drawing, FONT, Ink, Shape};
use std::fmt::Write;

impl Drawing {
    /// The drawing on white, a file of its own.
    pub(in crate::study) fn svg(&self) -> String {
        self.text(true)
    }

    /// The drawing for a page that has set the colours of the classes `k-...`.
    pub(in crate::study) fn inline_svg(&self) -> String {
        self.text(false)
    }

    fn text(&self, alone: bool) -> String {
        let (w, h) = (self.width, self.height);
        let mut out = format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {w} {h}\" width=\"{w}\" height=\"{h}\" role=\"img\" \
             font-family=\"system-ui, sans-serif\" font-size=\"{FONT}\"><title>{}</title>\n",
            escape(&self.title)
        );
        if alone {
            let _ = writeln!(out, "<rect width=\"{w}\" height=\"{h}\" fill=\"#ffffff\"/>");
        }
        // A class speaks to a page's own style; without one, the colour itself stands there.
        let paint = |property: &str, ink: Ink| match (alone, ink.rgb()) {
            (true, [r, g, b]) => format!("{property}=\"#{r:02x}{g:02x}{b:02x}\""),
            (false, _) => format!("style=\"{property}:{}\"", ink.style()),
        };
        let both = |fill: Ink, edge: Ink| match (alone, fill.rgb(), edge.rgb()) {
            (true, [r, g, b], [s, t, u]) => {
                format!("fill=\"#{r:02x}{g:02x}{b:02x}\" stroke=\"#{s:02x}{t:02x}{u:02x}\" stroke-width=\"1.3\"")
            }
            (false, ..) => format!("style=\"fill:{};stroke:{};stroke-width:1.3\"", fill.style(), edge.style()),
        };
        for shape in &self.shapes {
            // Writing to a String cannot fail.
            let _ = match shape {
                Shape::Line { points, ink, width, dash } => {
                    let dash = dash.map(|[on, off]| format!(" stroke-dasharray=\"{on} {off}\"")).unwrap_or_default();
                    let stroke = paint("stroke", *ink);
                    writeln!(out, "<polyline points=\"{}\" fill=\"none\" {stroke} stroke-width=\"{width}\"{dash}/>", list(points))
                }
                Shape::Area { points, fill, edge } => {
                    let style = edge.map_or_else(|| paint("fill", *fill), |edge| both(*fill, edge));
                    writeln!(out, "<polygon points=\"{}\" {style}/>", list(points))
                }
                Shape::Text { at: [x, y], text, ink, anchor, bold, up } => {
                    let anchor = match anchor {
                        Anchor::Start => "start",
                        Anchor::Middle => "middle",
                        Anchor::End => "end",
                    };
                    let weight = if *bold { " font-weight=\"600\"" } else { "" };
                    let turn = if *up { format!(" transform=\"rotate(-90 {x:.1} {y:.1})\"") } else { String::new() };
                    let (fill, text) = (paint("fill", *ink), escape(text));
                    writeln!(
                        out,
                        "<text x=\"{x:.1}\" y=\"{y:.1}\" dy=\"0.35em\" text-anchor=\"{anchor}\"{weight}{turn} {fill}>{text}</text>"
                    )
                }
            };
        }
        out.push_str("</svg>\n");
        out
    }
}

fn list(points: &[[f64; 2]]) -> String {
    points.iter().map(|[x, y]| format!("{x:.1},{y:.1}")).collect::<Vec<_>>().join(" ")
}

/// Text for XML and HTML.
pub(in crate::study) fn escape(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            c if c.is_control() && c != '\n' => out.push(' '),
            c => out.push(c),
        }
    }
    out
}
