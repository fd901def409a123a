//! A drawing as SVG text.

use super::{Anchor, Drawing, FONT, Ink, Shape};
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
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
        for shape in &self.shapes {
            write(&mut out, shape, Place { alone, faint: false });
        }
        out.push_str("</svg>\n");
        out
    }
}

/// Where a shape is written, and how.
#[derive(Clone, Copy)]
struct Place {
    /// A file of its own, in literal colours; else on a page whose style has variables for them.
    alone: bool,
    /// In a faint curve.
    faint: bool,
}

impl Place {
    fn color(self, ink: Ink) -> String {
        let [r, g, b] = if self.faint { ink.faint() } else { ink }.rgb();
        if self.alone { format!("#{r:02x}{g:02x}{b:02x}") } else { ink.style() }
    }

    /// A class speaks to a page's own style; without one, the colour itself stands there.
    fn paint(self, property: &str, ink: Ink) -> String {
        if self.alone { format!("{property}=\"{}\"", self.color(ink)) } else { format!("style=\"{property}:{}\"", self.color(ink)) }
    }

    fn both(self, fill: Ink, edge: Ink) -> String {
        let (fill, edge) = (self.color(fill), self.color(edge));
        if self.alone {
            format!("fill=\"{fill}\" stroke=\"{edge}\" stroke-width=\"1.3\"")
        } else {
            format!("style=\"fill:{fill};stroke:{edge};stroke-width:1.3\"")
        }
    }
}

fn write(out: &mut String, shape: &Shape, place: Place) {
    // Writing to a String cannot fail.
    let _ = match shape {
        Shape::Line { points, ink, width, dash } => {
            let dash = dash.map(|[on, off]| format!(" stroke-dasharray=\"{on} {off}\"")).unwrap_or_default();
            let stroke = place.paint("stroke", *ink);
            writeln!(out, "<polyline points=\"{}\" fill=\"none\" {stroke} stroke-width=\"{width}\"{dash}/>", list(points))
        }
        Shape::Area { points, fill, edge } => {
            let style = edge.map_or_else(|| place.paint("fill", *fill), |edge| place.both(*fill, edge));
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
            let (fill, text) = (place.paint("fill", *ink), escape(text));
            writeln!(out, "<text x=\"{x:.1}\" y=\"{y:.1}\" dy=\"0.35em\" text-anchor=\"{anchor}\"{weight}{turn} {fill}>{text}</text>")
        }
        Shape::Image { at: [x, y], size: [w, h], png } => {
            let data = STANDARD.encode(png);
            writeln!(
                out,
                "<image x=\"{x:.1}\" y=\"{y:.1}\" width=\"{w:.1}\" height=\"{h:.1}\" preserveAspectRatio=\"none\" \
                 style=\"image-rendering:pixelated\" href=\"data:image/png;base64,{data}\"/>"
            )
        }
        Shape::Curve { faint, shapes } => {
            // On a page a faint curve shows its colour where it is pointed at, clicked or reached by the tabulator.
            out.push_str(if *faint { "<g class=\"curve faint\" tabindex=\"0\">\n" } else { "<g class=\"curve\">\n" });
            shapes.iter().for_each(|shape| write(out, shape, Place { faint: *faint || place.faint, ..place }));
            writeln!(out, "</g>")
        }
    };
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
