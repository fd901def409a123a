//! Framebuffers of three depths, and the blend function between a fragment and what is there.

use crate::scene::{Arithmetic, BlendFunction, Equation, Factor, OpenGl};

/// The numbers of a framebuffer. A pixel's component is one f32: the number itself, or its level.
pub(super) trait Framebuffer {
    /// A component as stored, as a number.
    fn load(stored: f32) -> f64;
    /// The same, rounded to f32 alone: for the finished picture.
    fn finished(stored: f32) -> f32;
    /// A number after blending, as it is stored.
    fn store(number: f64) -> f32;
    /// A number within blending, rounded as the arithmetic has it.
    fn round(number: f64, arithmetic: Arithmetic) -> f64;
    /// A component of a fragment on its way into blending, clamped to `[0,1]`.
    #[inline(always)]
    fn fragment(number: f32, arithmetic: Arithmetic) -> f64 {
        Self::round(f64::from(number.clamp(0.0, 1.0)), arithmetic)
    }
}

/// Fixed point of `LEVELS` + 1 levels from 0 to 1: 255 for 8 bits, 65535 for 16. A component is kept as its level.
pub(super) struct Unorm<const LEVELS: u32>;

impl<const LEVELS: u32> Framebuffer for Unorm<LEVELS> {
    /// Times the reciprocal: for each fragment a division would cost more than all the rest, and the last bit of f64 is far from
    /// what decides between levels.
    #[inline(always)]
    fn load(stored: f32) -> f64 {
        f64::from(stored) * (1.0 / f64::from(LEVELS))
    }

    fn finished(stored: f32) -> f32 {
        (f64::from(stored) / f64::from(LEVELS)) as f32
    }

    /// Clamped to `[0,1]` and rounded to the nearest level. Levels times factors that are levels never lie in the middle of two
    /// (their denominator is odd), so what f64 rounds before does not show.
    #[inline(always)]
    fn store(number: f64) -> f32 {
        (number.clamp(0.0, 1.0) * f64::from(LEVELS) + 0.5) as u32 as f32
    }

    #[inline(always)]
    fn round(number: f64, arithmetic: Arithmetic) -> f64 {
        match arithmetic {
            Arithmetic::Fixed => Self::load(Self::store(number)),
            Arithmetic::Float => number,
        }
    }
}

/// 32-bit floats: fragments are clamped to `[0,1]`, sums are not.
pub(super) struct Float;

impl Framebuffer for Float {
    #[inline(always)]
    fn load(stored: f32) -> f64 {
        f64::from(stored)
    }

    fn finished(stored: f32) -> f32 {
        stored
    }

    /// Rounded to f32. Functions that let a pixel grow end at the largest f32, not in infinity, from which a NaN could come.
    #[inline(always)]
    fn store(number: f64) -> f32 {
        number.clamp(f64::from(f32::MIN), f64::from(f32::MAX)) as f32
    }

    #[inline(always)]
    fn round(number: f64, _: Arithmetic) -> f64 {
        number
    }
}

/// Whether a fragment of opacity `alpha` passes the alpha test. The reference is a number of the framebuffer, as alpha is.
#[inline(always)]
pub(super) fn alpha_passes<F: Framebuffer>(state: &OpenGl, alpha: f64) -> bool {
    state.alpha_test.is_none_or(|test| test.compare.passes(alpha, F::fragment(test.reference as f32, state.blend_arithmetic)))
}

/// The constant colour, as it is blended with.
pub(super) fn constant<F: Framebuffer>(state: &OpenGl) -> [f64; 4] {
    state.blend_constant.map(|c| F::round(c, state.blend_arithmetic))
}

/// Fragment `s` blended with pixel `d`, both as numbers; `k` is the constant colour.
#[inline(always)]
pub(super) fn blend<F: Framebuffer>(state: &OpenGl, k: &[f64; 4], s: [f64; 4], d: [f64; 4]) -> [f64; 4] {
    let round = |number: f64| F::round(number, state.blend_arithmetic);
    let color = |c: usize| combine(&state.blend, s[c], d[c], round, |factor| color_factor(factor, c, &s, &d, k));
    let alpha = combine(&state.blend_alpha, s[3], d[3], round, |factor| alpha_factor(factor, s[3], d[3], k[3]));
    [color(0), color(1), color(2), alpha]
}

#[inline(always)]
fn combine(function: &BlendFunction, s: f64, d: f64, round: impl Fn(f64) -> f64, factor: impl Fn(Factor) -> f64) -> f64 {
    let source = || round(s * factor(function.source));
    let destination = || round(d * factor(function.destination));
    match function.equation {
        Equation::Add => source() + destination(),
        Equation::Subtract => source() - destination(),
        Equation::ReverseSubtract => destination() - source(),
        Equation::Min => s.min(d),
        Equation::Max => s.max(d),
    }
}

#[inline(always)]
fn color_factor(factor: Factor, c: usize, s: &[f64; 4], d: &[f64; 4], k: &[f64; 4]) -> f64 {
    match factor {
        Factor::Zero => 0.0,
        Factor::One => 1.0,
        Factor::SrcColor => s[c],
        Factor::OneMinusSrcColor => 1.0 - s[c],
        Factor::DstColor => d[c],
        Factor::OneMinusDstColor => 1.0 - d[c],
        Factor::SrcAlpha => s[3],
        Factor::OneMinusSrcAlpha => 1.0 - s[3],
        Factor::DstAlpha => d[3],
        Factor::OneMinusDstAlpha => 1.0 - d[3],
        Factor::ConstantColor => k[c],
        Factor::OneMinusConstantColor => 1.0 - k[c],
        Factor::ConstantAlpha => k[3],
        Factor::OneMinusConstantAlpha => 1.0 - k[3],
        Factor::SrcAlphaSaturate => s[3].min(1.0 - d[3]),
    }
}

#[inline(always)]
fn alpha_factor(factor: Factor, s: f64, d: f64, k: f64) -> f64 {
    match factor {
        Factor::Zero => 0.0,
        Factor::One | Factor::SrcAlphaSaturate => 1.0,
        Factor::SrcColor | Factor::SrcAlpha => s,
        Factor::OneMinusSrcColor | Factor::OneMinusSrcAlpha => 1.0 - s,
        Factor::DstColor | Factor::DstAlpha => d,
        Factor::OneMinusDstColor | Factor::OneMinusDstAlpha => 1.0 - d,
        Factor::ConstantColor | Factor::ConstantAlpha => k,
        Factor::OneMinusConstantColor | Factor::OneMinusConstantAlpha => 1.0 - k,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{AlphaTest, Compare};

    const S: [f64; 4] = [0.2, 0.4, 0.6, 0.5];
    const D: [f64; 4] = [0.5, 0.25, 0.125, 0.75];
    const K: [f64; 4] = [0.1, 0.3, 0.5, 0.7];

    fn close(a: [f64; 4], b: [f64; 4]) {
        assert!(a.iter().zip(&b).all(|(a, b)| (a - b).abs() < 1e-12), "{a:?} is not {b:?}");
    }

    fn run(function: BlendFunction) -> [f64; 4] {
        blend::<Float>(&OpenGl::default().with_blend(function), &K, S, D)
    }

    #[test]
    fn every_factor_is_opengls() {
        // The table of factors in the specification, worked out by hand for the numbers above.
        let table: [(Factor, [f64; 4]); 15] = [
            (Factor::Zero, [0.0; 4]),
            (Factor::One, [1.0; 4]),
            (Factor::SrcColor, S),
            (Factor::OneMinusSrcColor, [0.8, 0.6, 0.4, 0.5]),
            (Factor::DstColor, D),
            (Factor::OneMinusDstColor, [0.5, 0.75, 0.875, 0.25]),
            (Factor::SrcAlpha, [0.5; 4]),
            (Factor::OneMinusSrcAlpha, [0.5; 4]),
            (Factor::DstAlpha, [0.75; 4]),
            (Factor::OneMinusDstAlpha, [0.25; 4]),
            (Factor::ConstantColor, K),
            (Factor::OneMinusConstantColor, [0.9, 0.7, 0.5, 0.3]),
            (Factor::ConstantAlpha, [0.7; 4]),
            (Factor::OneMinusConstantAlpha, [0.3; 4]),
            (Factor::SrcAlphaSaturate, [0.25, 0.25, 0.25, 1.0]),
        ];
        assert_eq!(table.map(|t| t.0), Factor::ALL);
        for (factor, f) in table {
            close(run(BlendFunction::add(factor, Factor::Zero)), [S[0] * f[0], S[1] * f[1], S[2] * f[2], S[3] * f[3]]);
            close(run(BlendFunction::add(Factor::Zero, factor)), [D[0] * f[0], D[1] * f[1], D[2] * f[2], D[3] * f[3]]);
        }
    }

    #[test]
    fn every_equation_is_opengls() {
        let with = |equation| run(BlendFunction { equation, source: Factor::SrcAlpha, destination: Factor::One });
        close(with(Equation::Add), [0.6, 0.45, 0.425, 1.0]);
        close(with(Equation::Subtract), [-0.4, -0.05, 0.175, -0.5]);
        close(with(Equation::ReverseSubtract), [0.4, 0.05, -0.175, 0.5]);
        close(with(Equation::Min), [0.2, 0.25, 0.125, 0.5]);
        close(with(Equation::Max), [0.5, 0.4, 0.6, 0.75]);
    }

    #[test]
    fn fixed_point_rounds_to_the_nearest_level() {
        type Eight = Unorm<255>;
        assert_eq!(Eight::store(0.4999 / 255.0), 0.0);
        assert_eq!(Eight::store(0.5001 / 255.0), 1.0);
        assert_eq!((Eight::store(-3.0), Eight::store(7.0)), (0.0, 255.0));
        assert!((Eight::fragment(0.3, Arithmetic::Fixed) - 77.0 / 255.0).abs() < 1e-12);
        assert_eq!(Eight::fragment(0.3, Arithmetic::Float), f64::from(0.3f32));
        for level in 0..=65535u16 {
            assert_eq!(Unorm::<65535>::store(Unorm::<65535>::load(f32::from(level))), f32::from(level));
        }
    }

    #[test]
    fn a_constant_colour_has_the_levels_of_the_framebuffer() {
        let state = OpenGl { blend_constant: [0.3; 4], ..OpenGl::default() };
        assert!((constant::<Unorm<255>>(&state)[0] - 77.0 / 255.0).abs() < 1e-12);
        assert_eq!(constant::<Float>(&state), [0.3; 4]);
        let float = OpenGl { blend_arithmetic: Arithmetic::Float, ..state };
        assert_eq!(constant::<Unorm<255>>(&float), [0.3; 4]);
        assert_eq!(Unorm::<255>::finished(77.0), (77.0f64 / 255.0) as f32);
    }

    #[test]
    fn blending_in_8_bits_is_exact_for_every_level() {
        let number = |level: u32| f64::from(level) / 255.0;
        let nearest = |numerator: u32| (2 * numerator + 255) / 510;
        let straight = OpenGl::straight();
        let float = OpenGl { blend_arithmetic: Arithmetic::Float, ..straight };
        for a in (0..=255u32).step_by(3) {
            for s in (0..=255u32).step_by(5) {
                for d in 0..=255u32 {
                    let run =
                        |state: &OpenGl, s: [u32; 4]| Unorm::<255>::store(blend::<Unorm<255>>(state, &K, s.map(number), [number(d); 4])[0]);
                    // In whole numbers: each product to the nearest level; the sum to the nearest level.
                    let products = nearest(s * a) + nearest(d * (255 - a));
                    assert_eq!(run(&straight, [s, s, s, a]), products.min(255) as f32, "{s} with {a} onto {d}");
                    assert_eq!(run(&float, [s, s, s, a]), nearest(s * a + d * (255 - a)) as f32, "{s} with {a} onto {d}");
                    // A premultiplied colour has one product alone.
                    assert_eq!(run(&OpenGl::default(), [s.min(a), s, s, a]), (s.min(a) + nearest(d * (255 - a))).min(255) as f32);
                }
            }
        }
    }

    #[test]
    fn a_float_framebuffer_never_holds_a_nan() {
        let state = OpenGl::default().with_blend(BlendFunction::add(Factor::One, Factor::DstColor));
        let shrink = OpenGl::default().with_blend(BlendFunction {
            equation: Equation::ReverseSubtract,
            source: Factor::One,
            destination: Factor::OneMinusDstColor,
        });
        for state in [state, shrink] {
            let mut pixel = [2.0f32; 4];
            for _ in 0..200 {
                pixel = blend::<Float>(&state, &K, [1.0; 4], pixel.map(Float::load)).map(Float::store);
                assert!(pixel.iter().all(|c| c.is_finite()), "{pixel:?}");
            }
        }
    }

    #[test]
    fn the_alpha_test_compares_levels() {
        let with = |compare| OpenGl { alpha_test: Some(AlphaTest { compare, reference: 0.5 }), ..OpenGl::default() };
        // 0.5 is level 128 of 255, and so is 0.501.
        let alpha = Unorm::<255>::fragment(0.501, Arithmetic::Fixed);
        assert!(alpha_passes::<Unorm<255>>(&with(Compare::Equal), alpha));
        assert!(!alpha_passes::<Unorm<255>>(&with(Compare::Greater), alpha));
        assert!(alpha_passes::<Float>(&with(Compare::Greater), f64::from(0.501f32)));
        assert!(!alpha_passes::<Float>(&with(Compare::Never), 1.0));
    }
}
