//! Colour maps that are straight lines in another space than RGB, as points that lie close to them in RGB.
//!
//! Colours of a file are sRGB (IEC 61966-2-1, white D65). L*a*b* is that of CIE 1976. Msh is its polar form, magnitude, saturation and hue,
//! in which diverging maps are interpolated by way of white (Moreland, "Diverging Color Maps for Scientific Visualization", 2009).

use super::ColorPoints;
use std::f64::consts::PI;

/// A space that colours are interpolated in.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Space {
    /// Red, green and blue.
    Rgb,
    /// Hue, saturation, value; the hue does not pass through 0.
    Hsv,
    /// As `Hsv`, the hue going the shorter way around.
    HsvWrapped,
    /// CIE L*a*b*.
    Lab,
    /// Msh, by way of white where two saturated colours differ much.
    Diverging,
    /// Not at all: between two points stands the second one's colour.
    Step,
}

/// How far a straight line in RGB may lie from the curve.
const CLOSE: f64 = 1.0 / 512.0;

/// Most pieces between two points.
const PIECES: u32 = 64;

/// The map through `points` as points to be joined by straight lines in RGB.
pub(super) fn in_rgb(points: &ColorPoints, space: Space) -> ColorPoints {
    let mut out: ColorPoints = Vec::with_capacity(points.len());
    for (i, &(x, rgb)) in points.iter().enumerate() {
        let before = i.checked_sub(1).map(|i| points[i]).filter(|b| b.0 < x);
        match before {
            Some((x0, _)) if space == Space::Step => out.push((x0, rgb)),
            Some((x0, from)) if space != Space::Rgb => {
                let curve = Curve::new(from, rgb, space);
                let pieces = pieces(&curve);
                out.extend((1..pieces).map(|k| {
                    let t = f64::from(k) / f64::from(pieces);
                    (x0 + (x - x0) * t, curve.at(t))
                }));
            }
            _ => {}
        }
        out.push((x, rgb));
    }
    out
}

/// How many pieces it takes.
fn pieces(curve: &Curve) -> u32 {
    let far = |n: u32| {
        (0..n).any(|k| {
            let at = |k: f64| curve.at(k / f64::from(n));
            let (a, m, b) = (at(f64::from(k)), at(f64::from(k) + 0.5), at(f64::from(k + 1)));
            (0..3).any(|c| (m[c] - 0.5 * (a[c] + b[c])).abs() > CLOSE)
        })
    };
    // Never one piece: a curve may lie far from its chord and meet it in the middle.
    let mut n = 4;
    while n < PIECES && far(n) {
        n *= 2;
    }
    n
}

/// The way from one colour to another.
struct Curve {
    space: Space,
    /// Coordinates in the space, and for diverging maps those on the other side of white.
    ends: [[f64; 3]; 2],
    middle: Option<[[f64; 3]; 2]>,
}

impl Curve {
    fn new(from: [f64; 3], to: [f64; 3], space: Space) -> Self {
        let mut ends = [from, to].map(|rgb| match space {
            Space::Hsv | Space::HsvWrapped => hsv(rgb),
            Space::Lab => lab(rgb),
            Space::Diverging => msh(rgb),
            Space::Rgb | Space::Step => rgb,
        });
        let mut middle = None;
        if space == Space::HsvWrapped {
            let turn = ends[1][0] - ends[0][0];
            if turn.abs() > 0.5 {
                let lower = usize::from(turn > 0.0);
                // The greater hue is one turn back.
                ends[lower][0] -= 1.0;
            }
        }
        if space == Space::Diverging {
            let apart = angle(ends[0][2], ends[1][2]);
            let saturated = |c: [f64; 3]| c[1] > 0.05;
            if saturated(ends[0]) && saturated(ends[1]) && apart > PI / 3.0 {
                let white = ends[0][0].max(ends[1][0]).max(88.0);
                middle = Some(ends.map(|end| [white, 0.0, spun(end, white)]));
            } else if !saturated(ends[0]) && saturated(ends[1]) {
                ends[0][2] = spun(ends[1], ends[0][0]);
            } else if saturated(ends[0]) && !saturated(ends[1]) {
                ends[1][2] = spun(ends[0], ends[1][0]);
            }
        }
        Self { space, ends, middle }
    }

    /// The colour at `t` of the way, 0 to 1.
    fn at(&self, t: f64) -> [f64; 3] {
        let mix = |a: [f64; 3], b: [f64; 3], t: f64| -> [f64; 3] { std::array::from_fn(|i| a[i] + (b[i] - a[i]) * t) };
        let point = match self.middle {
            Some([first, _]) if t < 0.5 => mix(self.ends[0], first, 2.0 * t),
            Some([_, second]) => mix(second, self.ends[1], 2.0 * t - 1.0),
            None => mix(self.ends[0], self.ends[1], t),
        };
        let rgb = match self.space {
            Space::Hsv | Space::HsvWrapped => of_hsv(point),
            Space::Lab => of_lab(point),
            Space::Diverging => of_msh(point),
            Space::Rgb | Space::Step => point,
        };
        rgb.map(|c| c.clamp(0.0, 1.0))
    }
}

/// The smaller angle between two hues.
fn angle(a: f64, b: f64) -> f64 {
    let d = (a - b).abs();
    if d > PI { 2.0 * PI - d } else { d }
}

/// The hue that an unsaturated colour of magnitude `m` should have, so that the way to `end` looks straight.
fn spun([magnitude, saturation, hue]: [f64; 3], m: f64) -> f64 {
    if magnitude >= m {
        return hue;
    }
    let spin = saturation * (m * m - magnitude * magnitude).sqrt() / (magnitude * libm::sin(saturation));
    if hue > -PI / 3.0 { hue + spin } else { hue - spin }
}

/// Hue (1 is a whole turn), saturation and value.
fn hsv([r, g, b]: [f64; 3]) -> [f64; 3] {
    let (most, least) = (r.max(g).max(b), r.min(g).min(b));
    let chroma = most - least;
    if chroma <= 0.0 {
        return [0.0, 0.0, most];
    }
    let sector = if most == r {
        (g - b) / chroma
    } else if most == g {
        (b - r) / chroma + 2.0
    } else {
        (r - g) / chroma + 4.0
    };
    let hue = sector / 6.0;
    [if hue < 0.0 { hue + 1.0 } else { hue }, chroma / most, most]
}

fn of_hsv([hue, saturation, value]: [f64; 3]) -> [f64; 3] {
    let turn = 6.0 * (hue - hue.floor());
    // A component rises over one sixth of a turn, stays, falls, stays.
    let part = |shift: f64| {
        let at = (turn + shift) % 6.0;
        value - value * saturation * at.min(4.0 - at).clamp(0.0, 1.0)
    };
    [part(5.0), part(3.0), part(1.0)]
}

/// White of D65 in XYZ.
const WHITE: [f64; 3] = [0.950_47, 1.0, 1.088_83];

fn lab(rgb: [f64; 3]) -> [f64; 3] {
    let [r, g, b] = rgb.map(|c| if c <= 0.040_45 { c / 12.92 } else { libm::pow((c + 0.055) / 1.055, 2.4) });
    let xyz = [
        0.412_456_4 * r + 0.357_576_1 * g + 0.180_437_5 * b,
        0.212_672_9 * r + 0.715_152_2 * g + 0.072_175 * b,
        0.019_333_9 * r + 0.119_192 * g + 0.950_304_1 * b,
    ];
    let [x, y, z] = std::array::from_fn(|i| {
        let t = xyz[i] / WHITE[i];
        if t > 216.0 / 24389.0 { libm::cbrt(t) } else { (24389.0 / 27.0 * t + 16.0) / 116.0 }
    });
    [116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)]
}

fn of_lab([l, a, b]: [f64; 3]) -> [f64; 3] {
    let y = (l + 16.0) / 116.0;
    let f = [y + a / 500.0, y, y - b / 200.0];
    let [x, y, z]: [f64; 3] = std::array::from_fn(|i| {
        let cube = f[i] * f[i] * f[i];
        WHITE[i] * if cube > 216.0 / 24389.0 { cube } else { (116.0 * f[i] - 16.0) * 27.0 / 24389.0 }
    });
    let linear = [
        3.240_454_2 * x - 1.537_138_5 * y - 0.498_531_4 * z,
        -0.969_266 * x + 1.876_010_8 * y + 0.041_556 * z,
        0.055_643_4 * x - 0.204_025_9 * y + 1.057_225_2 * z,
    ];
    linear.map(|c| if c <= 0.003_130_8 { 12.92 * c } else { 1.055 * libm::pow(c, 1.0 / 2.4) - 0.055 })
}

/// Magnitude, saturation (angle from the grey axis) and hue of L*a*b*.
fn msh(rgb: [f64; 3]) -> [f64; 3] {
    let [l, a, b] = lab(rgb);
    let magnitude = (l * l + a * a + b * b).sqrt();
    let saturation = if magnitude > 0.001 { libm::acos((l / magnitude).clamp(-1.0, 1.0)) } else { 0.0 };
    let hue = if saturation > 0.001 { libm::atan2(b, a) } else { 0.0 };
    [magnitude, saturation, hue]
}

fn of_msh([magnitude, saturation, hue]: [f64; 3]) -> [f64; 3] {
    let out = magnitude * libm::sin(saturation);
    of_lab([magnitude * libm::cos(saturation), out * libm::cos(hue), out * libm::sin(hue)])
}

#[cfg(test)]
mod tests {
    use super::*;

    const COLORS: [[f64; 3]; 7] =
        [[0.0; 3], [1.0; 3], [0.5; 3], [1.0, 0.0, 0.0], [0.1, 0.7, 0.3], [0.229_8, 0.298_7, 0.753_7], [0.9, 0.05, 0.6]];

    #[test]
    fn every_space_undoes_itself() {
        for rgb in COLORS {
            for back in [of_hsv(hsv(rgb)), of_lab(lab(rgb)), of_msh(msh(rgb))] {
                assert!((0..3).all(|c| (back[c] - rgb[c]).abs() < 1e-5), "{rgb:?} {back:?}");
            }
        }
    }

    /// Known places: sRGB's red in L*a*b*, white at L* 100.
    #[test]
    fn lab_is_that_of_the_cie() {
        let near = |got: [f64; 3], want: [f64; 3]| assert!((0..3).all(|i| (got[i] - want[i]).abs() < 0.02), "{got:?} {want:?}");
        near(lab([1.0, 0.0, 0.0]), [53.24, 80.09, 67.20]);
        near(lab([1.0; 3]), [100.0, 0.0, 0.0]);
        near(lab([0.0, 0.0, 1.0]), [32.30, 79.19, -107.86]);
    }

    #[test]
    fn hues_go_the_way_that_is_asked_for() {
        let (red, violet) = ([1.0, 0.0, 0.0], [1.0, 0.0, 1.0]);
        let middle = |space| Curve::new(red, violet, space).at(0.5);
        let near = |got: [f64; 3], want: [f64; 3]| assert!((0..3).all(|i| (got[i] - want[i]).abs() < 1e-9), "{got:?} {want:?}");
        // Violet is 5/6 of a turn: half of that is 5/12, between green and cyan; the shorter way is over 11/12.
        near(middle(Space::Hsv), [0.0, 1.0, 0.5]);
        near(middle(Space::HsvWrapped), [1.0, 0.0, 0.5]);
        near(Curve::new(violet, red, Space::HsvWrapped).at(0.5), [1.0, 0.0, 0.5]);
    }

    /// The map that the publication and many programs call cool to warm: its middle is a light grey.
    #[test]
    fn diverging_maps_pass_white() {
        let ends = vec![(-1.0, [0.230, 0.299, 0.754]), (1.0, [0.706, 0.016, 0.150])];
        let points = in_rgb(&ends, Space::Diverging);
        let middle = points.iter().find(|p| p.0 == 0.0).expect("a point in the middle").1;
        assert!((0..3).all(|c| (middle[c] - [0.865, 0.865, 0.865][c]).abs() < 0.003), "{middle:?}");
        // And it is the map of that name among our own, which comes from its published table.
        let own = crate::scene::ColorMap::Coolwarm.spread(-1.0, 1.0);
        for (x, rgb) in own {
            let after = points.partition_point(|p| p.0 < x).clamp(1, points.len() - 1);
            let ((x0, a), (x1, b)) = (points[after - 1], points[after]);
            let t = ((x - x0) / (x1 - x0)).clamp(0.0, 1.0);
            for c in 0..3 {
                assert!((a[c] + (b[c] - a[c]) * t - rgb[c]).abs() < 0.012, "{x}: {rgb:?}");
            }
        }
    }

    #[test]
    fn steps_show_the_second_colour() {
        let points = in_rgb(&vec![(0.0, [0.0; 3]), (1.0, [0.5; 3]), (2.0, [1.0; 3])], Space::Step);
        assert_eq!(points, [(0.0, [0.0; 3]), (0.0, [0.5; 3]), (1.0, [0.5; 3]), (1.0, [1.0; 3]), (2.0, [1.0; 3])]);
        let kept = vec![(0.0, [0.1, 0.2, 0.3]), (0.0, [0.4; 3]), (2.0, [1.0; 3])];
        assert_eq!(in_rgb(&kept, Space::Rgb), kept);
    }
}
