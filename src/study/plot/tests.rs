use super::axis::{Span, seconds, short};
use super::*;

fn chart() -> Chart {
    let curve = |name: &str, look, points: &[[f64; 2]]| Curve { name: name.into(), points: points.to_vec(), look, guide: false };
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
    crowded.curves =
        (0..14).map(|i| Curve { name: format!("curve {i}"), points: vec![[1.0, 1.0], [2.0, 1.0]], look: i, guide: false }).collect();
    let drawing = crowded.draw(Layout::Wide);
    let mut heights: Vec<f64> = drawing
        .shapes
        .iter()
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
