use super::axis::{Span, seconds, short};
use super::*;
use crate::picture::png::rgb8;

fn chart() -> Chart {
    let curve =
        |name: &str, look, points: &[[f64; 2]]| Curve { name: name.into(), points: points.to_vec(), look, guide: false, faint: false };
    Chart {
        title: "Error & time".into(),
        x: Axis { label: "time".into(), ticks: Ticks::Seconds },
        y: Axis { label: "error".into(), ticks: Ticks::Decades },
        curves: vec![curve("first", 0, &[[1e-3, 1e-2], [1e-2, 1e-4]]), curve("second <b>", 9, &[[2e-3, 1e-2], [3e-2, 1.1e-4], [0.0, 1.0]])],
    }
}

#[test]
fn ticks_stand_at_powers_and_say_so() {
    let span = Span { low: 0.5e-3, high: 2.0 };
    let ticks = span.ticks(Ticks::Seconds, 10);
    assert_eq!(ticks.iter().map(|t| t.1.clone().unwrap()).collect::<Vec<_>>(), ["1 ms", "10 ms", "100 ms", "1 s"]);
    assert_eq!(
        Span { low: 30.0, high: 300.0 }.ticks(Ticks::Octaves, 9).iter().map(|t| t.0).collect::<Vec<_>>(),
        [32.0, 64.0, 128.0, 256.0]
    );
    assert_eq!(span.ticks(Ticks::Decades, 2).iter().filter(|t| t.1.is_some()).count(), 2);
    assert_eq!(
        Span { low: 2e-4, high: 6e-4 }.ticks(Ticks::Decades, 9).iter().filter_map(|t| t.1.clone()).collect::<Vec<_>>(),
        ["2e-4", "5e-4"]
    );
    assert!((span.place(1.0 / 31.6227766) - 0.5).abs() < 1e-6);
    assert_eq!(Span::of([0.0, -1.0, f64::NAN].into_iter()), Span { low: 0.3, high: 3.0 });
}

#[test]
fn numbers_read_well() {
    let said: Vec<String> = [1.5e-6, 0.00125, 0.0123456, 0.5, 12.345, 100.0].map(seconds).to_vec();
    assert_eq!(said, ["1.5 us", "1.25 ms", "12.3 ms", "500 ms", "12.3 s", "100 s"]);
    assert_eq!([64.0, 65536.0, 131072.0, 2.5e6].map(short), ["64", "65536", "131 k", "2.5 M"]);
}

#[test]
fn names_do_not_lie_on_each_other() {
    let mut crowded = chart();
    crowded.curves = (0..14)
        .map(|i| Curve { name: format!("curve {i}"), points: vec![[1.0, 1.0], [2.0, 1.0]], look: i, guide: false, faint: false })
        .collect();
    let drawing = crowded.draw(Layout::Wide);
    let mut heights: Vec<f64> = drawing
        .shapes
        .iter()
        .flat_map(Shape::parts)
        .filter_map(|s| match s {
            Shape::Text { at, text, .. } if text.starts_with("curve") => Some(at[1]),
            _ => None,
        })
        .collect();
    heights.sort_by(f64::total_cmp);
    assert_eq!(heights.len(), 14);
    assert!(heights.windows(2).all(|w| w[1] - w[0] > 15.9), "{heights:?}");
    assert!(heights[0] > 20.0 && heights[13] < drawing.height);
}

#[test]
fn every_layout_becomes_svg_and_png() {
    let bars = Bars {
        title: "Where time goes".into(),
        groups: vec![("midpoint".into(), 0, vec![Bar { name: "fetch".into(), value: 2.0, said: "2 ms".into() }])],
    };
    for layout in [Layout::Wide, Layout::Narrow] {
        for drawing in [chart().draw(layout), bars.draw(layout)] {
            let svg = drawing.svg();
            assert!(svg.starts_with("<svg") && svg.ends_with("</svg>\n") && !svg.contains("NaN") && !svg.contains("<b>"));
            assert!(drawing.inline_svg().contains("var(--k-"));
            let bytes = drawing.png().unwrap();
            let picture = crate::Picture::decode(&bytes, "drawing").unwrap();
            assert_eq!(f64::from(picture.width()), 2.0 * drawing.width);
            let ink = picture.pixels().iter().filter(|p| **p != [1.0; 4]).count();
            assert!(ink > 500, "{ink} pixels of ink");
        }
    }
}

#[test]
fn every_method_has_a_mark_of_its_own() {
    let marks: Vec<Shape> = (0..crate::study::METHODS.len()).map(|i| marker(i, [0.0, 0.0], 4.0)).collect();
    for i in 0..marks.len() {
        for j in 0..i {
            assert_ne!(marks[i], marks[j], "{i} and {j}");
        }
    }
}

/// Everything that is written in a drawing.
pub(in crate::study) fn read(drawing: &Drawing) -> Vec<String> {
    rectangles(drawing).into_iter().map(|r| r.0).collect()
}

/// The room that each text of a drawing takes: left, right, top, bottom.
fn rectangles(drawing: &Drawing) -> Vec<(String, [f64; 4])> {
    let place = |shape: &Shape| match shape {
        Shape::Text { at: [x, y], text, anchor, up, .. } => {
            // The bitmap font's letters are half as wide as a line is high.
            let (length, half) = (text.chars().count() as f64 * 0.5 * FONT, 0.4 * FONT);
            let before = match anchor {
                Anchor::Start => 0.0,
                Anchor::Middle => 0.5 * length,
                Anchor::End => length,
            };
            let along = [-before, length - before];
            let area =
                if *up { [x - half, x + half, y - along[1], y - along[0]] } else { [x + along[0], x + along[1], y - half, y + half] };
            Some((text.clone(), area))
        }
        _ => None,
    };
    drawing.shapes.iter().flat_map(Shape::parts).filter_map(place).collect()
}

/// No text of the drawing lies on another or leaves it.
pub(in crate::study) fn no_text_on_another(drawing: &Drawing) {
    let all = rectangles(drawing);
    for (i, (text, a)) in all.iter().enumerate() {
        let title = &drawing.title;
        assert!(a[0] >= 0.0 && a[1] <= drawing.width && a[2] >= 0.0 && a[3] <= drawing.height, "{title}: {text:?} leaves the drawing");
        for (other, b) in &all[..i] {
            assert!(!(a[0] < b[1] && b[0] < a[1] && a[2] < b[3] && b[2] < a[3]), "{title}: {text:?} lies on {other:?}");
        }
    }
}

#[test]
fn no_text_of_a_plot_lies_on_another() {
    for count in [1, 2, 7, 16, 30] {
        for spread in [0.0, 0.01, 3.0] {
            for decades in [0.2, 1.0, 6.0] {
                let end = |i: usize| 10f64.powf(-decades * (i as f64 * spread).sin().abs());
                let curve = |i: usize| Curve {
                    name: format!("a curve called {i}"),
                    points: vec![[1.0, 1.0], [1.0 + 10f64.powf(decades), end(i)]],
                    look: i,
                    guide: i % 5 == 4,
                    faint: i % 3 == 2,
                };
                for ticks in [Ticks::Seconds, Ticks::Octaves, Ticks::Counts, Ticks::Decades] {
                    let mut chart = chart();
                    (chart.x.ticks, chart.curves) = (ticks, (0..count).map(curve).collect());
                    [Layout::Wide, Layout::Narrow].into_iter().for_each(|layout| no_text_on_another(&chart.draw(layout)));
                }
            }
        }
    }
}

#[test]
fn faint_curves_are_grey_until_they_are_pointed_at() {
    let mut chart = chart();
    chart.curves[1].faint = true;
    let drawing = chart.draw(Layout::Wide);
    let order: Vec<bool> =
        drawing.shapes.iter().filter_map(|s| if let Shape::Curve { faint, .. } = s { Some(*faint) } else { None }).collect();
    assert_eq!(order, [true, false], "faint curves lie below");
    // Curve 9 has colour 2; in a file it is grey, on a page its own colour, which the style of faint groups takes away.
    let (file, page) = (drawing.svg(), drawing.inline_svg());
    assert!(!file.contains("#008060") && file.contains("#b0b6bc") && file.contains("#0060a0"));
    assert!(page.contains("<g class=\"curve faint\" tabindex=\"0\">") && page.contains("var(--k-2)"));
    let pixels = crate::Picture::decode(&drawing.png().unwrap(), "drawing").unwrap().to_rgba8();
    let count = |rgb: [u8; 3]| pixels.chunks(4).filter(|p| p[..3] == rgb).count();
    assert!(count([0, 128, 96]) == 0 && count([176, 182, 188]) > 50 && count([0, 96, 160]) > 50);
}

#[test]
fn a_picture_in_a_drawing_keeps_its_pixels() {
    let png = rgb8(2, 1, &[255, 0, 0, 0, 0, 255]).unwrap();
    let image = Shape::Image { at: [1.0, 2.0], size: [4.0, 3.0], png };
    let drawing = Drawing { width: 6.0, height: 6.0, title: "two pixels".into(), shapes: vec![image] };
    let picture = crate::Picture::decode(&drawing.png().unwrap(), "drawing").unwrap();
    for (x, y) in (0..12).flat_map(|y| (0..12).map(move |x| (x, y))) {
        let inside = (2..10).contains(&x) && (4..10).contains(&y);
        let want = if !inside {
            [1.0; 4]
        } else if x < 6 {
            [1.0, 0.0, 0.0, 1.0]
        } else {
            [0.0, 0.0, 1.0, 1.0]
        };
        assert_eq!(picture.pixel(x, y), want, "{x},{y}");
    }
    assert!(drawing.svg().contains("<image x=\"1.0\"") && drawing.svg().contains("data:image/png;base64,"));
}
