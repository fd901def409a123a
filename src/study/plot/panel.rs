//! A rectangle with two linear axes.

use super::{Anchor, Ink, Shape, text};

/// Where a plot lies in the drawing, and the numbers at its edges.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::study) struct Panel {
    pub(in crate::study) left: f64,
    pub(in crate::study) top: f64,
    pub(in crate::study) right: f64,
    pub(in crate::study) bottom: f64,
    /// Numbers at the left and the right edge.
    pub(in crate::study) x: [f64; 2],
    /// Numbers at the lower and the upper edge.
    pub(in crate::study) y: [f64; 2],
}

/// Round numbers between `lo` and `hi`, `most` at most, and the step between them.
pub(in crate::study) fn ticks([lo, hi]: [f64; 2], most: usize) -> (Vec<f64>, f64) {
    let rough = 2.0 * ((0.5 * hi - 0.5 * lo) / most.max(1) as f64);
    let power = 10f64.powf(rough.log10().floor());
    // Ranges at the ends of f64 have no round numbers that it can tell.
    if !(rough > 0.0 && rough.is_finite() && power.is_normal()) {
        return (vec![lo], (hi - lo).clamp(f64::MIN_POSITIVE, f64::MAX));
    }
    let step = [1.0, 2.0, 5.0, 10.0].into_iter().map(|s| s * power).find(|s| *s >= rough * 0.999).unwrap_or(10.0 * power);
    let (first, last) = ((lo / step - 1e-9).ceil(), (hi / step + 1e-9).floor());
    let count = ((last - first) as usize).min(most);
    ((0..=count).map(|i| (first + i as f64) * step).collect(), step)
}

/// How the tick at `x` reads among ticks that are `step` apart.
fn tick_label(x: f64, step: f64) -> String {
    if x == 0.0 {
        return "0".into();
    }
    if !(1e-5..1e7).contains(&x.abs()) {
        let text = format!("{x:.2e}");
        return match text.split_once('e') {
            Some((digits, power)) => format!("{}e{power}", digits.trim_end_matches('0').trim_end_matches('.')),
            None => text,
        };
    }
    let digits = (-step.abs().log10().floor()).clamp(0.0, 9.0) as usize;
    format!("{x:.digits$}")
}

impl Panel {
    /// Where (x, y) lies in the drawing; what is outside lies on the edge.
    pub(in crate::study) fn place(&self, x: f64, y: f64) -> [f64; 2] {
        let part = |v: f64, [lo, hi]: [f64; 2]| {
            let (done, all) = if (hi - lo).is_finite() { (v - lo, hi - lo) } else { (0.5 * v - 0.5 * lo, 0.5 * hi - 0.5 * lo) };
            if all > 0.0 { (done / all).clamp(0.0, 1.0) } else { 0.0 }
        };
        [self.left + part(x, self.x) * (self.right - self.left), self.bottom - part(y, self.y) * (self.bottom - self.top)]
    }

    /// Grid and numbers along the left side, and the label beside them.
    pub(in crate::study) fn left_axis(&self, label: &str, shapes: &mut Vec<Shape>) {
        let (list, step) = ticks(self.y, ((self.bottom - self.top) / 34.0) as usize);
        for y in list {
            let at = self.place(self.x[0], y);
            shapes.push(line(at, [self.right, at[1]], Ink::Grid));
            shapes.push(text([self.left - 7.0, at[1]], &tick_label(y, step), Ink::Muted, Anchor::End, false));
        }
        let at = [11.0, 0.5 * (self.top + self.bottom)];
        shapes.push(Shape::Text { at, text: label.into(), ink: Ink::Text, anchor: Anchor::Middle, bold: false, up: true });
    }

    /// Grid along the lower side, numbers `below` it, and the label under them.
    pub(in crate::study) fn lower_axis(&self, label: &str, below: f64, shapes: &mut Vec<Shape>) {
        let (list, step) = ticks(self.x, ((self.right - self.left) / 70.0) as usize);
        for x in list {
            let at = self.place(x, self.y[0]);
            shapes.push(line([at[0], self.top], at, Ink::Grid));
            shapes.push(text([at[0], self.bottom + below + 13.0], &tick_label(x, step), Ink::Muted, Anchor::Middle, false));
        }
        let at = [0.5 * (self.left + self.right), self.bottom + below + 31.0];
        shapes.push(text(at, label, Ink::Text, Anchor::Middle, false));
    }

    /// The left and the lower edge.
    pub(in crate::study) fn edges(&self, shapes: &mut Vec<Shape>) {
        let points = vec![[self.left, self.top], [self.left, self.bottom], [self.right, self.bottom]];
        shapes.push(Shape::Line { points, ink: Ink::Muted, width: 1.0, dash: None });
    }
}

fn line(a: [f64; 2], b: [f64; 2], ink: Ink) -> Shape {
    Shape::Line { points: vec![a, b], ink, width: 1.0, dash: None }
}
