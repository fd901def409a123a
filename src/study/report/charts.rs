//! The plots of both reports.

use super::super::methods::METHODS;
use super::super::plot::{Axis, Bar, Bars, Chart, Curve, Ticks, seconds};
use super::super::record::{Point, Record};
use super::super::stability::Stability;
use super::Plot;

/// Colour and marker of a method: the same in every plot.
fn look(name: &str) -> usize {
    METHODS.iter().position(|m| m.name == name).unwrap_or(0)
}

fn axis(label: &str, ticks: Ticks) -> Axis {
    Axis { label: label.into(), ticks }
}

/// Most curves to look at.
const BEST: usize = 4;

/// The methods to look at: the default, those that are the cheapest way to an error, smaller errors first, and the ones that come nearest to
/// them. All where there are few.
pub(super) fn best(record: &Record) -> Vec<&str> {
    if record.methods.len() <= BEST {
        return record.methods.iter().map(|m| m.name.as_str()).collect();
    }
    // A curve of order 2 has one product of error and squared time: that of its finest picture tells how far to the left it lies.
    let product = |name: &str| {
        let of_method = record.points.iter().filter(|p| p.method == name);
        of_method.min_by(|a, b| a.rms.total_cmp(&b.rms)).map_or(f64::INFINITY, |p| p.rms * p.seconds * p.seconds)
    };
    let mut choices: Vec<&str> = METHODS.iter().filter(|m| m.is_a_choice() && m.other_limit.is_none()).map(|m| m.name).collect();
    choices.retain(|name| product(name).is_finite());
    choices.sort_by(|a, b| product(a).total_cmp(&product(b)));
    let cheapest = record.advice.iter().rev().filter_map(|a| a.method.as_deref());
    let mut best: Vec<&str> = Vec::new();
    for name in std::iter::once(METHODS[0].name).chain(cheapest).chain(choices) {
        if best.len() < BEST && !best.contains(&name) && record.methods.iter().any(|m| m.name == name) {
            best.push(name);
        }
    }
    best
}

/// What a caption says of the curves in grey, where there are any.
pub(super) fn in_grey(record: &Record) -> &'static str {
    if record.methods.len() <= BEST {
        return "";
    }
    " In colour: the default, the cheapest ways to the errors of the table above, and those that come nearest to them. The others are grey: point \
     at a curve or its name, or click it, to see it."
}

fn curves(record: &Record, place: impl Fn(&Point) -> Option<[f64; 2]>) -> Vec<Curve> {
    let best = best(record);
    let curve = |name: &String| {
        let of_method = record.points.iter().filter(|p| p.method == *name);
        let faint = !best.contains(&name.as_str());
        Curve { name: name.clone(), points: of_method.filter_map(&place).collect(), look: look(name), guide: false, faint }
    };
    record.methods.iter().map(|m| curve(&m.name)).filter(|c| !c.points.is_empty()).collect()
}

/// Error against run time.
pub(super) fn work_precision(record: &Record) -> Plot {
    Plot::Chart(Chart {
        title: "Error against time: down and to the left is better".into(),
        x: axis("time of a frame", Ticks::Seconds),
        y: axis("RMS error", Ticks::Decades),
        curves: curves(record, |p| Some([p.seconds, p.rms])),
    })
}

/// Error against slice count, with the slopes to expect.
pub(super) fn convergence(record: &Record) -> Plot {
    let mut curves = curves(record, |p| p.tolerance.is_none().then_some([p.slices as f64, p.rms]));
    let points = || record.points.iter().filter(|p| p.tolerance.is_none() && p.rms > 0.0);
    let ends = points().fold(None, |ends: Option<[f64; 3]>, p| {
        let [first, last, least] = ends.unwrap_or([p.slices as f64, p.slices as f64, p.rms]);
        Some([first.min(p.slices as f64), last.max(p.slices as f64), least.min(p.rms)])
    });
    if let Some([first, last, least]) = ends {
        let top = points().filter(|p| p.slices as f64 == first).map(|p| p.rms).fold(0.0, f64::max);
        for order in [1, 2, 3] {
            // Down to the least error or out to the finest picture, whichever comes first.
            let far = last.min(first * (top / least).powf(1.0 / f64::from(order)));
            let down = top * (far / first).powi(-order);
            curves.push(Curve {
                name: format!("order {order}"),
                points: vec![[first, top], [far, down]],
                look: 0,
                guide: true,
                faint: false,
            });
        }
    }
    Plot::Chart(Chart {
        title: "Error against the number of slices".into(),
        x: axis("slices", Ticks::Octaves),
        y: axis("RMS error", Ticks::Decades),
        curves,
    })
}

/// Where the time of a frame goes.
pub(super) fn stages(record: &Record) -> Option<Plot> {
    let mut groups: Vec<(String, usize, Vec<Bar>)> = Vec::new();
    for s in &record.stages {
        let said = format!("{}, {:.0} %", seconds(s.seconds), 100.0 * s.share);
        let bar = Bar { name: s.stage.clone(), value: s.seconds, said };
        match groups.last_mut().filter(|g| g.0 == s.method) {
            Some(group) => group.2.push(bar),
            None => groups.push((s.method.clone(), look(&s.method), vec![bar])),
        }
    }
    (!groups.is_empty())
        .then(|| Plot::Bars(Bars { title: format!("Where the time of a frame goes, {} slices", record.setting.slices), groups }))
}

/// Time of a frame against the size of the picture or of the volume.
pub(super) fn cost(record: &Record, of: &str) -> Plot {
    let list = || record.costs.iter().filter(|c| c.of == of);
    let curve = |name: &str, look: usize, f: &dyn Fn(&super::super::record::Cost) -> f64| Curve {
        name: name.into(),
        points: list().map(|c| [c.size as f64, f(c)]).collect(),
        look,
        guide: false,
        faint: false,
    };
    let mut curves = vec![curve("frame", 0, &|c| c.seconds)];
    if of == "volume" {
        curves.push(curve("kept between frames", 1, &|c| c.prepare_seconds));
    }
    let ends: Vec<[f64; 2]> = list().map(|c| [c.size as f64, c.seconds]).collect();
    if let (Some(first), Some(last), "image") = (ends.first(), ends.last(), of) {
        let points = vec![*first, [last[0], first[1] * last[0] / first[0]]];
        curves.push(Curve { name: "in proportion".into(), points, look: 0, guide: true, faint: false });
    }
    let (unit, title) =
        if of == "image" { ("pixels", "Time against the size of the picture") } else { ("voxels", "Time against the size of the volume") };
    Plot::Chart(Chart { title: title.into(), x: axis(unit, Ticks::Counts), y: axis("time", Ticks::Seconds), curves })
}

/// Error of a uniform medium against the number of slices, measured and predicted.
pub(super) fn counts(stability: &Stability, opacity: f64) -> Plot {
    let mut curves = Vec::new();
    for (i, target) in ["f32", "plain f32", "8 bits"].into_iter().enumerate() {
        let list = || stability.counts.iter().filter(|c| c.target == target && c.opacity == opacity);
        let points = |f: &dyn Fn(&super::super::stability::CountPoint) -> f64| list().map(|c| [c.slices as f64, f(c)]).collect::<Vec<_>>();
        let name = if target == "f32" { "f32 as it is used" } else { target };
        curves.push(Curve { name: name.into(), points: points(&|c| c.error.max(1e-9)), look: i, guide: false, faint: false });
        let said = if target == "8 bits" { "predicted, 8 bits".into() } else { format!("bound, {target}") };
        curves.push(Curve { name: said, points: points(&|c| c.predicted), look: i, guide: true, faint: false });
    }
    Plot::Chart(Chart {
        title: format!("Error of a uniform medium of opacity {opacity}"),
        x: axis("slices", Ticks::Counts),
        y: axis("largest error", Ticks::Decades),
        curves,
    })
}

/// Least transmittance that f32 pictures tell from none.
const LEAST: f64 = 1e-7;

/// What explicit Euler steps make of the light behind a medium.
pub(super) fn riemann(stability: &Stability) -> Plot {
    let curve = |name: &str, look: usize, guide: bool, f: &dyn Fn(&super::super::stability::RiemannPoint) -> f64| Curve {
        name: name.into(),
        // Where points are close every fourth will do.
        points: stability
            .riemann
            .iter()
            .enumerate()
            .filter(|(i, p)| p.slab_depth <= 10.0 && (p.slab_depth > 3.0 || i % 4 == 3))
            .map(|(_, p)| [p.slab_depth, f(p).abs().max(LEAST)])
            .collect(),
        look,
        guide,
        faint: false,
    };
    let slices = stability.riemann.first().map_or(0, |p| p.slices);
    Plot::Chart(Chart {
        title: format!("What {slices} slabs leave of the light behind them"),
        x: axis("optical depth of a slab, kappa D", Ticks::Decades),
        y: axis("|transmittance|, 1e-7 at least", Ticks::Decades),
        curves: vec![
            curve("riemann", look("riemann"), false, &|p| p.riemann),
            curve("exponential", 0, false, &|p| p.exponential),
            curve("|1 - kappa D|^N", 0, true, &|p| p.predicted),
        ],
    })
}
