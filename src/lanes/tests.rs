//! Every level against the scalar one, bit for bit, and the scalar one against f64.

use super::*;
use crate::lanes::scalar::Scalar;

/// Numbers without end, the same on every machine (xorshift).
pub(crate) struct Numbers(u64);

impl Numbers {
    pub(crate) fn new(seed: u64) -> Self {
        Self(seed | 1)
    }
    pub(crate) fn bits(&mut self) -> u64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        self.0
    }
    /// Uniform in `[0,1)`.
    pub(crate) fn unit(&mut self) -> f64 {
        (self.bits() >> 11) as f64 / (1u64 << 53) as f64
    }
    pub(crate) fn unit32(&mut self) -> f32 {
        (self.bits() >> 40) as f32 / (1u64 << 24) as f32
    }
    pub(crate) fn between(&mut self, lo: f64, hi: f64) -> f64 {
        lo + self.unit() * (hi - lo)
    }
}

struct Inputs {
    a: [f32; WIDTH],
    b: [f32; WIDTH],
    i: [i32; WIDTH],
    j: [i32; WIDTH],
    c: [f64; WIDTH],
    d: [f64; WIDTH],
    bits: u8,
    table: LookupTable,
}

#[derive(Default)]
struct Outputs {
    floats: Vec<u32>,
    doubles: Vec<u64>,
    ints: Vec<i32>,
    masks: Vec<u8>,
}

/// Runs every operation once.
struct EveryOperation;

impl Kernel<Inputs, Outputs> for EveryOperation {
    #[inline(always)]
    fn run<L: Lanes>(input: &Inputs, out: &mut Outputs) {
        let (a, b, i, j) = (L::load(&input.a), L::load(&input.b), L::load_i(&input.i), L::load_i(&input.j));
        let m = L::from_bits(input.bits);
        let (c, d) = (L::load_d(&input.c), L::load_d(&input.d));
        let in_range = L::min(L::max(a, L::splat(-1e9)), L::splat(1e9));
        let [r, g, bl, al] = L::lookup(&input.table, i, b);
        let floats = [
            L::add(a, b),
            L::sub(a, b),
            L::mul(a, b),
            L::div(a, b),
            L::sqrt(a),
            L::min(a, b),
            L::max(a, b),
            L::keep(m, a),
            L::select(m, a, b),
            L::apart(a, input.bits),
            L::to_f(i),
            L::of_bits(L::add_i(L::to_bits(a), L::splat_i(1))),
            L::narrow(c),
            L::whole(L::max(in_range, L::splat(0.0))),
            L::byte::<0>(i),
            L::byte::<1>(i),
            L::byte::<2>(i),
            L::byte::<3>(i),
            r,
            g,
            bl,
            al,
            math::expm1_negative::<L>(L::min(in_range, L::splat(0.0))),
            math::exp_negative::<L>(L::min(in_range, L::splat(0.0))),
            math::log1p_negated::<L>(L::min(L::max(a, L::splat(0.0)), L::splat(1.0))),
            math::opacity_for_ratio::<L>(
                L::min(L::max(a, L::splat(0.0)), L::splat(1.0)),
                L::max(L::min(b, L::splat(50.0)), L::splat(1e-3)),
            ),
        ];
        for f in floats {
            let mut to = [0.0; WIDTH];
            L::store(f, &mut to);
            // Which NaN an operation gives is not promised.
            out.floats.extend(to.map(|x: f32| if x.is_nan() { f32::NAN.to_bits() } else { x.to_bits() }));
        }
        let ints = [
            L::trunc(in_range),
            L::add_i(i, j),
            L::sub_i(i, j),
            L::min_i(i, j),
            L::max_i(i, j),
            L::or_i(i, j),
            L::mul_i(i, j),
            L::select_i(m, i, j),
            L::trunc_d(L::min_d(L::max_d(c, L::splat_d(-1e9)), L::splat_d(1e9))),
            L::and_i(i, j),
            L::shl::<23>(i),
            L::sar::<8>(i),
            L::load_u16(&input.i.map(|v| v as u16)),
            L::together(i, input.bits),
        ];
        let pairs = L::set_pairs(input.c.map(f64::to_bits));
        for x in ints.into_iter().chain(pairs) {
            let mut to = [0; WIDTH];
            L::store_i(x, &mut to);
            out.ints.extend(to);
        }
        for x in [L::add_d(c, d), L::sub_d(c, d), L::mul_d(c, d), L::div_d(c, d), L::min_d(c, d), L::max_d(c, d), L::to_d(i)] {
            let mut to = [0.0; WIDTH];
            L::store_d(x, &mut to);
            out.doubles.extend(to.map(|x: f64| if x.is_nan() { f64::NAN.to_bits() } else { x.to_bits() }));
        }
        out.masks.extend([L::lt_d(c, d), L::le_d(c, d)]);
        for x in [L::lt(a, b), L::le(a, b), L::eq_i(i, j), L::gt_i(i, j), L::and(m, L::lt(a, b)), m] {
            out.masks.push(L::bits(x));
        }
    }
}

#[test]
fn every_level_gives_the_bits_of_the_scalar_one() {
    let mut n = Numbers::new(7);
    let special = [0.0, -0.0, 1.0, -1.0, f32::MIN_POSITIVE, 1e-40, f32::MAX, f32::INFINITY, f32::NEG_INFINITY, f32::NAN, 0.5, 16_777_216.0];
    let float = |n: &mut Numbers| match n.bits() % 5 {
        0 => special[(n.bits() % special.len() as u64) as usize],
        1 => n.unit() as f32,
        // Signalling NaN comes from no operation, and LLVM's minimum on aarch64 gives another number for it.
        2 => Some(f32::from_bits(n.bits() as u32)).filter(|x| !x.is_nan()).unwrap_or(f32::NAN),
        _ => n.between(-300.0, 300.0) as f32,
    };
    let colors: Vec<[f32; 4]> = (0..37).map(|_| std::array::from_fn(|_| n.unit() as f32)).collect();
    let table = LookupTable::new(&colors);
    for round in 0..4000 {
        let input = Inputs {
            a: std::array::from_fn(|_| float(&mut n)),
            b: std::array::from_fn(|_| float(&mut n)),
            i: std::array::from_fn(|_| n.bits() as i32),
            j: std::array::from_fn(|_| if n.bits() % 3 == 0 { 5 } else { n.bits() as i32 % 100 }),
            c: std::array::from_fn(|_| f64::from(float(&mut n)) * 1.000_000_001),
            d: std::array::from_fn(|i| if n.bits() % 3 == 0 { f64::from(i as u32) } else { f64::from(float(&mut n)) }),
            bits: n.bits() as u8,
            table: table.clone(),
        };
        let run = |level: Level| {
            let mut out = Outputs::default();
            level.kernel::<EveryOperation, _, _>()(&input, &mut out);
            out
        };
        let want = run(Level::SCALAR);
        for level in Level::available() {
            let got = run(level);
            assert_eq!(got.floats, want.floats, "{} round {round}: {:?} {:?}", level.name(), input.a, input.b);
            assert_eq!(got.doubles, want.doubles, "{} round {round}: {:?} {:?}", level.name(), input.c, input.d);
            assert_eq!(got.ints, want.ints, "{} round {round}", level.name());
            assert_eq!(got.masks, want.masks, "{} round {round}", level.name());
        }
    }
}

fn scalar(f: impl Fn([f32; WIDTH]) -> [f32; WIDTH], x: f32) -> f64 {
    f64::from(f([x; WIDTH])[3])
}

#[test]
fn transcendentals_are_within_their_bounds() {
    // One unit in the last place is at most 2^-23 of the value.
    let ulp = 1.0 / f64::from(1 << 23);
    for k in 0..200_000 {
        let x = -libm::pow(10.0, f64::from(k) / 200_000.0 * 11.0 - 9.0) as f32;
        let want = libm::expm1(f64::from(x));
        let got = scalar(math::expm1_negative::<Scalar>, x);
        assert!((got - want).abs() <= 2.0 * ulp * want.abs(), "expm1({x}): {got} not {want}");
        let want = libm::exp(f64::from(x));
        let got = scalar(math::exp_negative::<Scalar>, x);
        assert!((got - want).abs() <= 3.0 * ulp * want || x < -86.9, "exp({x}): {got} not {want}");
        let a = (f64::from(k) + 0.5) / 200_000.0;
        let a = if k % 2 == 0 { a as f32 } else { libm::pow(a, 8.0) as f32 };
        // What 1 - a rounds to is all that can be known of it.
        let known = if a < 0.25 { 1.0 - f64::from(a) } else { f64::from(1.0 - a) };
        let want = if a < 0.25 { libm::log1p(-f64::from(a)) } else { libm::log(known) };
        let got = scalar(math::log1p_negated::<Scalar>, a);
        assert!((got - want).abs() <= 3.0 * ulp * want.abs(), "log1p(-{a}): {got} not {want}");
    }
    assert_eq!(scalar(math::expm1_negative::<Scalar>, f32::NEG_INFINITY), -1.0);
    assert_eq!(scalar(math::expm1_negative::<Scalar>, 0.0), 0.0);
    assert_eq!(scalar(math::exp_negative::<Scalar>, f32::NEG_INFINITY), 0.0);
    assert_eq!(scalar(math::exp_negative::<Scalar>, 0.0), 1.0);
}

#[test]
fn opacity_one_stays_one_for_every_length() {
    for length in [1e-6f32, 0.5, 1.0, 1.5, 1e6] {
        let a = math::opacity_for_ratio::<Scalar>([1.0; WIDTH], [length; WIDTH]);
        assert_eq!(a, [1.0; WIDTH], "length {length}");
        let none = math::opacity_for_ratio::<Scalar>([0.0; WIDTH], [length; WIDTH]);
        assert_eq!(none, [0.0; WIDTH], "length {length}");
    }
}

#[test]
fn levels_are_found_by_name_and_scalar_and_wide_are_everywhere() {
    let names: Vec<_> = Level::available().iter().map(|l| l.name()).collect();
    assert!(names.contains(&"scalar") && names.contains(&"wide"));
    for name in names {
        assert_eq!(Level::from_name(name).map(Level::name), Some(name));
    }
    assert_eq!(Level::from_name("mmx"), None);
}

/// Whether any of three vectors holds a number above the limits: of 8 bits without and with sign, of 16 bits without and with.
struct AnyAbove;

impl Kernel<[[i32; WIDTH]; 4], [bool; 4]> for AnyAbove {
    #[inline(always)]
    fn run<L: Lanes>([a, b, c, limit]: &[[i32; WIDTH]; 4], found: &mut [bool; 4]) {
        let (x, limit) = ([L::load_i(a), L::load_i(b), L::load_i(c)], L::load_i(limit));
        *found = [
            L::any_above::<8, false>(&x, limit),
            L::any_above::<8, true>(&x, limit),
            L::any_above::<16, false>(&x, limit),
            L::any_above::<16, true>(&x, limit),
        ];
    }
}

#[test]
fn numbers_above_a_limit_are_never_overlooked() {
    let mut n = Numbers::new(11);
    let mut without = 0;
    for round in 0..20_000 {
        // Small numbers and limits near them, so that some vectors have none above.
        let most = 1 << (n.bits() % 15);
        let number = |n: &mut Numbers| n.bits() % (most + 1);
        let pack = |n: &mut Numbers| {
            let (a, b) = (number(n), number(n));
            let sign = if n.bits() % 4 == 0 { 0x8000_8080 } else { 0 };
            (a as u32 | (b as u32) << 16 | sign) as i32
        };
        let mut input: [[i32; WIDTH]; 4] = std::array::from_fn(|_| std::array::from_fn(|_| pack(&mut n)));
        input[3] = [if n.bits() % 2 == 0 { (most | most << 16) as i32 } else { input[3][0] }; WIDTH];
        let bytes = |x: i32| x.to_le_bytes();
        let halves = |x: i32| [x as u16, (x >> 16) as u16];
        let any = |above: &dyn Fn(i32, i32) -> bool| input[..3].iter().any(|v| v.iter().zip(input[3]).any(|(&x, l)| above(x, l)));
        let want = [
            any(&|x, l| bytes(x).into_iter().zip(bytes(l)).any(|(x, l)| x > l)),
            any(&|x, l| bytes(x).into_iter().zip(bytes(l)).any(|(x, l)| x as i8 > l as i8)),
            any(&|x, l| halves(x).into_iter().zip(halves(l)).any(|(x, l)| x > l)),
            any(&|x, l| halves(x).into_iter().zip(halves(l)).any(|(x, l)| x as i16 > l as i16)),
        ];
        without += want.iter().filter(|&&w| !w).count();
        for level in Level::available() {
            let mut got = [false; 4];
            level.kernel::<AnyAbove, _, _>()(&input, &mut got);
            // Levels that do not look say that there may be.
            let looks = matches!(level.name(), "avx2" | "avx512");
            for (kind, (got, want)) in got.into_iter().zip(want).enumerate() {
                assert!(got == want || got && !looks, "{} round {round}, kind {kind}: {got}", level.name());
            }
        }
    }
    assert!(without > 5000, "{without} without");
}

/// Packs and unpacks an array of numbers.
struct PackAndUnpack;

/// What is packed; two arrays of numbers, together, and apart.
type Packed = (u64, [[i32; BATCH]; 4], [[f32; BATCH]; 2]);

impl Kernel<(), Packed> for PackAndUnpack {
    #[inline(always)]
    fn run<L: Lanes>(_: &(), (lanes, [from, more, packed, packed_more], apart): &mut Packed) {
        let packing = Packing::new(*lanes);
        assert_eq!(packing.count(), u64::from(lanes.count_ones()));
        packing.pack::<L, 2>([&*from, &*more], [&mut *packed, &mut *packed_more]);
        let [first, second] = apart;
        packing.unpack::<L, 2>([&packed.map(|x| x as f32), &packed_more.map(|x| x as f32)], [first, second]);
    }
}

#[test]
fn packed_numbers_lie_together_and_come_back() {
    let mut n = Numbers::new(12);
    let from: [i32; BATCH] = std::array::from_fn(|i| 1 + i as i32);
    for round in 0..2000_u64 {
        // One lane, all lanes, few, many, whole rows.
        let lanes = match round % 6 {
            0 => 1 << (n.bits() % 64),
            1 => u64::MAX,
            2 => n.bits() & n.bits() & n.bits(),
            3 => n.bits() | n.bits() | n.bits(),
            4 => spread(n.bits() as u8),
            _ => n.bits(),
        };
        if lanes == 0 {
            continue;
        }
        let listed: Vec<usize> = (0..BATCH).filter(|i| lanes >> i & 1 == 1).collect();
        let packing = Packing::new(lanes);
        let filled = 8 * packing.packed_rows().count_ones() as usize;
        assert_eq!(filled, listed.len().next_multiple_of(8));
        for level in Level::available() {
            let mut all = (lanes, [from, from.map(|x| -x), [-200; BATCH], [-300; BATCH]], [[-1.0; BATCH]; 2]);
            level.kernel::<PackAndUnpack, _, _>()(&(), &mut all);
            let (_, [_, _, packed, more], apart) = all;
            for k in 0..filled {
                match listed.get(k) {
                    Some(&i) => assert_eq!(packed[k], from[i], "{}", level.name()),
                    // The rest of the last row: one of those packed, whose places are safe to look up.
                    None => assert!(listed.iter().any(|&i| from[i] == packed[k]), "{} at {}", packed[k], level.name()),
                }
                assert_eq!(more[k], -packed[k], "{}", level.name());
            }
            for i in 0..BATCH {
                let (packed, touched) = (lanes >> i & 1 == 1, rows_of(lanes) >> (i / SIDE) & 1 == 1);
                let number = if packed { from[i] as f32 } else { 0.0 };
                assert_eq!([apart[0][i], apart[1][i]], if touched { [number, -number] } else { [-1.0; 2] }, "{}", level.name());
            }
        }
    }
}
