//! A logarithmic axis: what it spans, where its ticks stand and how they read.

/// Where ticks stand, and what they say.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(in crate::study) enum Ticks {
    /// Powers of ten, `1e-3`.
    Decades,
    /// Powers of ten of a second: `1 ms`, `10 s`.
    Seconds,
    /// Powers of two: `64`.
    Octaves,
    /// Powers of ten of a count: `1 k`, `10 M`.
    Counts,
}

/// A logarithmic axis.
#[derive(Debug, Clone, PartialEq)]
pub(in crate::study) struct Axis {
    pub(in crate::study) label: String,
    pub(in crate::study) ticks: Ticks,
}

/// An axis over the numbers that it has to show, `low` below `high`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Span {
    pub(super) low: f64,
    pub(super) high: f64,
}

impl Span {
    /// The range of all positive numbers among `values`, with some air; one decade around 1 when there are none.
    pub(super) fn of(values: impl Iterator<Item = f64>) -> Self {
        let (low, high) =
            values.filter(|v| *v > 0.0 && v.is_finite()).fold((f64::INFINITY, 0.0), |(a, b): (f64, f64), v| (a.min(v), b.max(v)));
        if low > high {
            return Self { low: 0.3, high: 3.0 };
        }
        let air = (high / low).powf(0.05).max(1.15);
        Self { low: low / air, high: high * air }
    }

    /// Where `value` lies, 0 to 1 from `low` to `high`.
    pub(super) fn place(&self, value: f64) -> f64 {
        (value / self.low).ln() / (self.high / self.low).ln()
    }

    /// (value, label) of the ticks: labels on as many as fit, `most`, lines without on the others.
    pub(super) fn ticks(&self, ticks: Ticks, most: usize) -> Vec<(f64, Option<String>)> {
        let base: f64 = if ticks == Ticks::Octaves { 2.0 } else { 10.0 };
        let (first, last) = ((self.low.ln() / base.ln()).ceil() as i32, (self.high.ln() / base.ln()).floor() as i32);
        let count = (last - first + 1).max(0) as usize;
        let every = count.div_ceil(most.max(1)).max(1) as i32;
        let mut list: Vec<(f64, Option<String>)> = (first..=last)
            .map(|e| {
                let value = base.powi(e);
                (value, (e.rem_euclid(every) == 0).then(|| label(value, e, ticks)))
            })
            .collect();
        // Too short for powers: 2 and 5 between them, named where there is room.
        if base == 10.0 && count < 3 {
            let between: Vec<(i32, f64, f64)> = (first - 1..=last)
                .flat_map(|e| [2.0, 5.0].map(|step: f64| (e, step, step * base.powi(e))))
                .filter(|b| b.2 >= self.low && b.2 <= self.high)
                .collect();
            let named = list.len() + between.len() <= most.max(2);
            list.extend(between.into_iter().map(|(e, step, value)| {
                let text = if ticks == Ticks::Decades { format!("{step}e{e}") } else { label(value, e, ticks) };
                (value, named.then_some(text))
            }));
        }
        list
    }
}

fn label(value: f64, exponent: i32, ticks: Ticks) -> String {
    match ticks {
        Ticks::Decades if exponent == 0 => "1".into(),
        Ticks::Decades => format!("1e{exponent}"),
        Ticks::Octaves => short(value),
        Ticks::Seconds => seconds(value),
        Ticks::Counts => short(value),
    }
}

/// A count in few letters.
pub(in crate::study) fn short(value: f64) -> String {
    match value {
        v if v >= 1e9 => format!("{} G", round(v / 1e9)),
        v if v >= 1e6 => format!("{} M", round(v / 1e6)),
        v if v >= 1e5 => format!("{} k", round(v / 1e3)),
        v => round(v),
    }
}

/// A time in the unit that suits it, to three digits.
pub(in crate::study) fn seconds(value: f64) -> String {
    match value {
        v if v >= 1.0 => format!("{} s", round(v)),
        v if v >= 1e-3 => format!("{} ms", round(v * 1e3)),
        v => format!("{} us", round(v * 1e6)),
    }
}

/// Three significant digits, without trailing zeros.
fn round(value: f64) -> String {
    let digits = (2 - value.abs().log10().floor().clamp(-9.0, 2.0) as i32).max(0) as usize;
    let text = format!("{value:.digits$}");
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_owned() } else { text }
}
