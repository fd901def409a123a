//! Round numbers, and how they read.

/// The largest of 1, 2 and 5 times a power of ten that is not above `most`; `None` unless `most` is positive and has a power of ten of its own.
pub(super) fn round_below(most: f64) -> Option<f64> {
    if !(most > 0.0 && most.is_finite()) {
        return None;
    }
    let exponent = libm::floor(libm::log10(most) + 1e-12);
    // Powers below one are quotients, which are the nearest numbers to what they are called.
    let power = |e: f64| if e < 0.0 { 1.0 / libm::exp10(-e) } else { libm::exp10(e) };
    let base = power(exponent);
    base.is_normal().then(|| [5.0, 2.0].into_iter().map(|s| s * base).find(|s| *s <= most * (1.0 + 1e-12)).unwrap_or(base))
}

/// The round numbers from `low` to `high`, `most` at most, and the step between them. Only the ends where the range has no round numbers.
pub(super) fn ticks(low: f64, high: f64, most: usize) -> (Vec<f64>, f64) {
    let range = 0.5 * high - 0.5 * low;
    let rough = 2.0 * (range / most.max(1) as f64);
    let Some(below) = round_below(rough) else { return (vec![low, high], (high - low).min(f64::MAX)) };
    let steps = [below, 2.0 * below, 2.5 * below, 5.0 * below];
    let step = steps.into_iter().find(|s| *s >= rough * (1.0 - 1e-9) && round_below(*s) == Some(*s)).unwrap_or(5.0 * below);
    let (first, last) = (libm::ceil(low / step - 1e-9), libm::floor(high / step + 1e-9));
    let count = (last - first).clamp(0.0, most as f64) as usize;
    // Whole multiples of one over ten to some power, so that 3 steps of 0.1 are 0.3.
    let tick = |n: f64| if step < 1.0 { n / libm::round(1.0 / step) } else { n * step };
    let exact = |n: f64| if step < 1.0 && libm::round(1.0 / step) * step != 1.0 { n * step } else { tick(n) };
    ((0..=count).map(|i| exact(first + i as f64)).filter(|t| *t <= high + 1e-9 * step).collect(), step)
}

/// How the number `x` reads among such as are `step` apart.
pub(super) fn said(x: f64, step: f64) -> String {
    if x == 0.0 || x.abs() < 1e-6 * step {
        return "0".into();
    }
    if !(1e-4..1e6).contains(&x.abs()) {
        let text = format!("{x:.2e}");
        return match text.split_once('e') {
            Some((digits, power)) if digits.contains('.') => {
                format!("{}e{power}", digits.trim_end_matches('0').trim_end_matches('.'))
            }
            _ => text,
        };
    }
    let digits = (-libm::floor(libm::log10(step.abs()) + 1e-9)).clamp(0.0, 9.0) as usize;
    format!("{x:.digits$}")
}

/// A number to two digits, as short as it goes.
pub(super) fn roughly(x: f64) -> String {
    let step = round_below(x.abs()).map_or(1.0, |b| 0.1 * b);
    let text = said(x, step);
    if text.contains('.') && !text.contains('e') { text.trim_end_matches('0').trim_end_matches('.').to_owned() } else { text }
}
