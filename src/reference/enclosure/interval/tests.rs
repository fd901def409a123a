//! Every operation against exact whole-number arithmetic, on random numbers: the exact result lies within.

use super::*;

/// Repeatable random numbers.
struct Random(u64);

impl Random {
    fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        self.0 ^ (self.0 >> 29)
    }

    fn unit(&mut self) -> f64 {
        (self.bits() >> 11) as f64 / (1u64 << 53) as f64
    }

    /// Of either sign, with an exponent from -8 to 8; sometimes a small whole number.
    fn number(&mut self) -> f64 {
        let kind = self.bits() >> 60;
        if kind < 3 {
            return (self.bits() >> 60) as f64 - 7.0;
        }
        let exponent = 1015 + (self.bits() >> 59) % 17;
        f64::from_bits((self.bits() >> 63 << 63) | (exponent << 52) | (self.bits() >> 12))
    }

    fn interval(&mut self) -> Interval {
        let (a, b) = (self.number(), self.number());
        match self.bits() >> 62 {
            0 => Interval::point(a),
            1 if a != 0.0 => Interval::new(a, step_up(step_up(a))),
            _ => Interval::new(a.min(b), a.max(b)),
        }
    }

    /// A number within an interval.
    fn inside(&mut self, x: Interval) -> f64 {
        match self.bits() >> 62 {
            0 => x.lo,
            1 => x.hi,
            _ => {
                let y = (x.lo + (x.hi - x.lo) * self.unit()).clamp(x.lo, x.hi);
                // Far smaller ones are no whole multiples of 2^-FINE.
                if y.abs() < 1e-12 { x.hi } else { y }
            }
        }
    }
}

/// A number as a whole multiple of 2^-FINE: exact for numbers of the exponents used here.
const FINE: i32 = 110;

fn whole(x: f64) -> i128 {
    let bits = x.to_bits();
    let (exponent, mantissa) = ((bits >> 52 & 0x7ff) as i32, i128::from(bits & ((1 << 52) - 1)));
    if exponent < 900 {
        // 0, or the bound next to it.
        return if x > 0.0 { 1 } else { -i128::from(u8::from(x < 0.0)) };
    }
    // The value is (mantissa + 2^52) 2^(exponent - 1075).
    let shift = exponent - 1075 + FINE;
    let all = mantissa | 1 << 52;
    let size = if shift >= 0 {
        all << shift
    } else {
        let down = all >> -shift;
        assert_eq!(down << -shift, all, "{x} needs finer multiples");
        down
    };
    if x < 0.0 { -size } else { size }
}

/// Sign of x y - z, exactly: mantissas of 53 bits make a product of 106.
fn product_less(x: f64, y: f64, z: f64) -> i128 {
    let parts = |x: f64| {
        let bits = x.to_bits();
        let mantissa = i128::from(bits & ((1 << 52) - 1) | 1 << 52);
        let sign = if x < 0.0 { -1 } else { 1 };
        (if x == 0.0 { 0 } else { sign * mantissa }, (bits >> 52 & 0x7ff) as i32 - 1075)
    };
    let ((a, i), (b, j), (c, k)) = (parts(x), parts(y), parts(z));
    let product = a * b;
    let apart = k - (i + j);
    // As multiples of 2^(i+j); what is far smaller than the product does not turn its sign.
    if c == 0 || product == 0 {
        return product - c;
    }
    if apart >= 70 {
        return -c;
    }
    if apart < -60 {
        return product;
    }
    if apart >= 0 { product - (c << apart) } else { (product << 2).signum() * ((product.abs() << 2) - (1 << 1)) - (c.signum()) }
}

#[test]
fn sums_and_differences_hold_theirs() {
    let mut r = Random(1);
    let mut points = 0;
    for _ in 0..200_000 {
        let (a, b) = (r.interval(), r.interval());
        let (x, y) = (r.inside(a), r.inside(b));
        for (got, want) in [(a + b, whole(x) + whole(y)), (a - b, whole(x) - whole(y)), (-a + b, whole(y) - whole(x))] {
            assert!(whole(got.lo) <= want && want <= whole(got.hi), "{a:?} {b:?}: {got:?}");
        }
        // Rounded as little as can be: a sum of points is a point, or two neighbours.
        if a.lo == a.hi && b.lo == b.hi {
            let sum = a + b;
            assert!(sum.hi == sum.lo || sum.hi == step_up(sum.lo), "{sum:?}");
            points += u32::from(sum.lo == sum.hi);
        }
    }
    assert!(points > 500, "{points}");
}

#[test]
fn products_and_quotients_hold_theirs() {
    let mut r = Random(2);
    for _ in 0..200_000 {
        let (a, b) = (r.interval(), r.interval());
        let (x, y) = (r.inside(a), r.inside(b));
        let got = a * b;
        assert!(product_less(x, y, got.lo) >= 0 && product_less(x, y, got.hi) <= 0, "{x} {y}: {got:?}");
        let square = a.squared();
        assert!(product_less(x, x, square.lo) >= 0 && product_less(x, x, square.hi) <= 0 && square.lo >= 0.0, "{x}: {square:?}");
        let root = Interval::new(x.abs(), x.abs()).sqrt();
        assert!(product_less(root.lo, root.lo, x.abs()) <= 0 && product_less(root.hi, root.hi, x.abs()) >= 0, "{x}: {root:?}");
        let quotient = a / b;
        if b.holds(0.0) {
            assert_eq!(quotient, Interval::WHOLE);
            continue;
        }
        // q <= x / y where q y <= x for y > 0, and the other way round for y < 0.
        let sign = if y > 0.0 { 1 } else { -1 };
        assert!(sign * product_less(quotient.lo, y, x) <= 0 && sign * product_less(quotient.hi, y, x) >= 0, "{x} / {y}: {quotient:?}");
    }
    // What is exact stays a point.
    let (three, seven) = (Interval::point(3.0), Interval::point(7.0));
    assert_eq!(three * seven, Interval::point(21.0));
    assert_eq!(Interval::point(21.0) / seven, three);
    assert_eq!(Interval::point(0.1) * Interval::point(0.25), Interval::point(0.025));
    assert_eq!(Interval::WHOLE * Interval::ZERO, Interval::ZERO);
    assert!((Interval::ONE / three).width() > 0.0);
}

#[test]
fn the_test_of_products_can_fail() {
    assert!(product_less(3.0, 7.0, 21.0) == 0 && product_less(3.0, 7.0, step_up(21.0)) < 0 && product_less(3.0, 7.0, step_down(21.0)) > 0);
    assert!(product_less(0.1, 0.1, 0.1 * 0.1) != 0);
    assert!(product_less(-3.0, 7.0, 0.0) < 0 && product_less(0.0, 7.0, 1.0) < 0 && product_less(-3.0, 7.0, -300.0) > 0);
}

/// exp(x) for |x| <= 1 in multiples of 2^-120, by its series; right to 2^-110.
fn exp_fixed(x: f64) -> i128 {
    // Products of two such numbers are formed from halves of 60 bits.
    let times = |a: i128, b: i128| {
        let (ah, al, bh, bl) = (a >> 60, a & ((1 << 60) - 1), b >> 60, b & ((1 << 60) - 1));
        ah * bh + ((ah * bl + al * bh) >> 60)
    };
    let x = whole(x) << (120 - FINE);
    let (mut term, mut sum) = (1i128 << 120, 1i128 << 120);
    for k in 1..40 {
        term = times(term, x) / k;
        sum += term;
    }
    sum
}

fn fixed(x: f64) -> i128 {
    whole(x) << (120 - FINE)
}

#[test]
fn exponentials_and_logarithms_hold_theirs() {
    let mut r = Random(3);
    for _ in 0..20_000 {
        // A whole multiple of 2^-50.
        let x = (r.unit() * 2.0 - 1.0).clamp(-1.0, 1.0);
        let x = (x * (1u64 << 50) as f64).round() / (1u64 << 50) as f64;
        let (want, off) = (exp_fixed(x), 1i128 << 12);
        let got = Interval::point(x).exponential();
        assert!(fixed(got.lo) <= want + off && want - off <= fixed(got.hi), "exp {x}: {got:?}");
        assert!(got.width() < 6e-15);
        // The logarithm of exp(x)'s bounds surrounds x; so does the extinction of 1 - exp(-x).
        let back = got.logarithm();
        assert!(back.lo <= x && x <= back.hi && back.width() < 1e-14, "ln exp {x}: {back:?}");
        if x > 0.0 {
            let opacity = Interval::ONE - Interval::point(x).exp_minus();
            let back = opacity.extinction();
            assert!(back.lo <= x && x <= back.hi && back.width() < 1e-13, "{x}: {back:?}");
        }
    }
    assert_eq!(Interval::new(0.0, f64::INFINITY).exp_minus(), Interval::new(0.0, Interval::ONE.hi));
    assert_eq!(Interval::ONE.extinction(), Interval::point(f64::INFINITY));
    assert_eq!(Interval::ZERO.extinction(), Interval::ZERO);
    assert_eq!(Interval::UNIT.logarithm().lo, f64::NEG_INFINITY);
}

#[test]
fn numbers_at_the_ends_of_f64_stay_bounds() {
    let huge = Interval::point(f64::MAX);
    for grown in [huge + huge, huge * huge, huge / Interval::point(0.5), huge.times(3.0)] {
        assert_eq!(grown, Interval::new(f64::MAX, f64::INFINITY));
    }
    let tiny = Interval::point(f64::MIN_POSITIVE);
    assert_eq!(tiny * tiny, Interval::new(0.0, f64::MIN_POSITIVE));
    assert_eq!((-tiny) * tiny, Interval::new(-f64::MIN_POSITIVE, 0.0));
    assert_eq!(tiny.times(0.5), Interval::new(0.0, f64::MIN_POSITIVE));
    assert_eq!(Interval::WHOLE + huge, Interval::WHOLE);
    assert_eq!(Interval::WHOLE - Interval::WHOLE, Interval::WHOLE);
    assert_eq!(Interval::new(f64::NAN, 1.0), Interval::WHOLE);
    assert_eq!(
        (step_up(f64::MAX), step_up(f64::INFINITY), step_down(f64::NEG_INFINITY)),
        (f64::INFINITY, f64::INFINITY, f64::NEG_INFINITY)
    );
    assert_eq!((step_up(-f64::MIN_POSITIVE), step_up(0.0), step_down(0.0)), (0.0, f64::MIN_POSITIVE, -f64::MIN_POSITIVE));
    assert_eq!((step_up(1.0), step_down(1.0), step_up(-1.0)), (1.0 + f64::EPSILON, 1.0 - 0.5 * f64::EPSILON, -1.0 + 0.5 * f64::EPSILON));
    assert_eq!((Interval::WHOLE.middle(), Interval::new(2.0, f64::INFINITY).middle()), (0.0, 2.0));
}
