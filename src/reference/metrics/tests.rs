#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]
use super::*;

fn picture(width: usize, height: usize, f: impl Fn(usize, usize) -> [f64; 3]) -> Displayed {
    let pixels: Vec<[f64; 4]> = (0..width * height)
        .map(|i| {
            let [r, g, b] = f(i % width, i / width);
            [r, g, b, 1.0]
        })
        .collect();
    Displayed::over_black(width, &pixels).unwrap()
}

fn plain(rgb: [f64; 3]) -> Displayed {
    picture(40, 30, |_, _| rgb)
}

/// Something with edges, slopes and colours.
fn scenery(shift: f64) -> Displayed {
    picture(40, 30, |x, y| {
        let (x, y) = (x as f64, y as f64);
        [(0.5 + 0.5 * libm::sin(0.4 * x + shift)), f64::from(u8::from(x + y > 35.0)) * 0.8, y / 40.0]
    })
}

#[test]
fn differences_are_counted() {
    let a = plain([0.5, 0.25, 0.0]);
    let b = picture(40, 30, |x, y| if (x, y) == (3, 4) { [0.5, 0.25, 0.6] } else { [0.5, 0.25 + 1.0 / 255.0, 0.0] });
    let d = difference(&a, &b).unwrap();
    assert!((d.max - 0.6).abs() < 1e-15);
    assert!((d.p999 - 1.0 / 255.0).abs() < 1e-15);
    let squares = (1199.0 / 255.0 / 255.0 + 0.36) / 3600.0;
    assert!((d.rms - f64::sqrt(squares)).abs() < 1e-15);
    assert!((d.psnr + 10.0 * libm::log10(squares)).abs() < 1e-12);
    assert_eq!((d.steps.len(), d.steps[0], d.steps[1], d.steps[153]), (154, 2400, 1199, 1));
    let none = difference(&a, &a).unwrap();
    assert_eq!((none.rms, none.max, none.p999, none.psnr, none.steps), (0.0, 0.0, 0.0, f64::INFINITY, vec![3600]));
}

#[test]
fn pictures_are_checked() {
    assert!(Displayed::over_black(3, &[[0.0f32; 4]; 7]).is_err());
    assert!(Displayed::over_black::<f32>(0, &[]).is_err());
    let error = Displayed::over_black(2, &[[0.0; 4], [0.0; 4], [f64::NAN; 4], [0.0; 4]]).unwrap_err();
    assert_eq!(error.to_string(), "pixel 0,1 is NaN");
    let (a, b) = (plain([0.0; 3]), picture(30, 40, |_, _| [0.0; 3]));
    assert!(difference(&a, &b).is_err() && ssim(&a, &b).is_err() && flip(&a, &b, 67.0).is_err());
    assert!(flip(&a, &a, f64::NAN).is_err());
    // Colours beyond white are shown as white.
    assert_eq!(Displayed::over_black(1, &[[2.0f32, -1.0, 0.5, 1.0]]).unwrap().rgb(), [[1.0, 0.0, 0.5]]);
}

#[test]
fn ssim_has_its_known_values() {
    let a = scenery(0.0);
    assert!((ssim(&a, &a).unwrap() - 1.0).abs() < 1e-12);
    // Flat pictures: only the means count.
    let (x, y) = (0.2, 0.9);
    let want = (2.0 * x * y + 1e-4) / (x * x + y * y + 1e-4);
    assert!((ssim(&plain([x; 3]), &plain([y; 3])).unwrap() - want).abs() < 1e-9);
    // Black against white: C1 / (1 + C1).
    assert!((ssim(&plain([0.0; 3]), &plain([1.0; 3])).unwrap() - 1e-4 / 1.0001).abs() < 1e-12);
    let (near, far) = (ssim(&a, &scenery(0.1)).unwrap(), ssim(&a, &scenery(1.5)).unwrap());
    assert!(far < near && near < 1.0, "{far} {near}");
    assert_eq!(ssim(&a, &scenery(1.5)).unwrap(), ssim(&scenery(1.5), &a).unwrap());
    // Smaller than the window.
    let tiny = picture(3, 2, |x, _| [x as f64 / 2.0; 3]);
    assert!((ssim(&tiny, &tiny).unwrap() - 1.0).abs() < 1e-12);
}

#[test]
fn flip_has_its_known_values() {
    let ppd = DEFAULT_PIXELS_PER_DEGREE;
    assert!((ppd - 67.02).abs() < 0.01);
    let a = scenery(0.0);
    assert_eq!(flip(&a, &a, ppd).unwrap(), 0.0);
    // Green against blue is the largest difference there is: 1 by definition.
    assert!((flip(&plain([0.0, 1.0, 0.0]), &plain([0.0, 0.0, 1.0]), ppd).unwrap() - 1.0).abs() < 1e-9);
    // Black against white: 100^0.7 on the upper branch of the mapping, the largest difference being 203.3^0.7.
    let (off, largest) = (libm::pow(100.0, 0.7), libm::pow(203.3, 0.7));
    let want = 0.95 + 0.05 * (off - 0.4 * largest) / (0.6 * largest);
    assert!((flip(&plain([0.0; 3]), &plain([1.0; 3]), ppd).unwrap() - want).abs() < 1e-4);
    let (near, far) = (flip(&a, &scenery(0.1), ppd).unwrap(), flip(&a, &scenery(1.5), ppd).unwrap());
    assert!(0.0 < near && near < far && far < 1.0, "{near} {far}");
    let back = flip(&scenery(1.5), &a, ppd).unwrap();
    assert!((far - back).abs() < 1e-12);
}

#[test]
fn a_filter_meets_the_direct_sum() {
    let a = scenery(0.3);
    let plane = Plane::of(&a, |c| c[0] + c[2]);
    let (across, down) = (vec![0.1, 0.5, 0.2], vec![0.3, -0.2, 0.4, 0.1, 0.7]);
    let got = plane.filter(&across, &down);
    for (x, y) in [(0i64, 0i64), (39, 29), (17, 0), (5, 11)] {
        let mut want = 0.0;
        for (j, wy) in down.iter().enumerate() {
            for (i, wx) in across.iter().enumerate() {
                let (u, v) = ((x + i as i64 - 1).clamp(0, 39) as usize, (y + j as i64 - 2).clamp(0, 29) as usize);
                want += wx * wy * plane.values[v * 40 + u];
            }
        }
        assert!((got.values[y as usize * 40 + x as usize] - want).abs() < 1e-14);
    }
}

#[test]
fn flip_agrees_with_its_authors_tool() {
    let make = |s: f64| {
        picture(96, 64, |x, y| {
            let (x, y) = (x as f64, y as f64);
            let step = if x + y > 70.0 + 3.0 * s { 0.8 } else { 0.1 };
            [0.5 + 0.5 * libm::sin(0.2 * x + s), step, y / 64.0 + 0.3 * s * libm::cos(0.7 * y)]
        })
    };
    // The means that the FLIP authors' evaluator gives for these pictures; its colour matrix has other digits past the fourth.
    for (s, want) in [(0.1, 0.121126), (0.5, 0.384408), (1.5, 0.713443)] {
        let got = flip(&make(0.0), &make(s), DEFAULT_PIXELS_PER_DEGREE).unwrap();
        assert!((got - want).abs() < 5e-5, "shift {s}: {got} for {want}");
    }
}
