//! Where polynomials change sign: kinks of an integrand, to be cut at.
//!
//! A polynomial lies between the least and the greatest of its Bernstein coefficients, and has no more sign changes than they have. Intervals
//! are halved until one sign change is left in each, or none.

/// Product of two polynomials, coefficients from the constant one on.
pub(super) fn product(a: &[f64], b: &[f64]) -> Vec<f64> {
    let mut out = vec![0.0; a.len() + b.len() - 1];
    for (i, x) in a.iter().enumerate() {
        for (j, y) in b.iter().enumerate() {
            out[i + j] += x * y;
        }
    }
    out
}

/// Adds `more` to `sum`, which is at least as long.
pub(super) fn add(sum: &mut [f64], more: &[f64]) {
    sum.iter_mut().zip(more).for_each(|(a, b)| *a += b);
}

/// Value of a polynomial.
pub(super) fn value(polynomial: &[f64], s: f64) -> f64 {
    polynomial.iter().rev().fold(0.0, |sum, c| sum * s + c)
}

/// Coefficients of the derivative.
pub(super) fn derivative(polynomial: &[f64]) -> Vec<f64> {
    polynomial.iter().enumerate().skip(1).map(|(i, c)| i as f64 * c).collect()
}

/// Halvings of an interval, after which several sign changes in it are taken for one.
const HALVINGS: u32 = 40;

/// Adds the places in (0,1) where `polynomial` changes sign to `found`. What lies below `noise` counts as 0.
pub(super) fn sign_changes(polynomial: &[f64], noise: f64, found: &mut Vec<f64>) {
    // A constant has none.
    let n = polynomial.len().saturating_sub(1);
    if n == 0 {
        return;
    }
    let binomial = |n: usize, k: usize| (0..k).fold(1.0, |b, i| b * (n - i) as f64 / (i + 1) as f64);
    let bernstein: Vec<f64> = (0..=n).map(|j| (0..=j).map(|i| binomial(j, i) / binomial(n, i) * polynomial[i]).sum()).collect();
    isolate(polynomial, &bernstein, noise, (0.0, 1.0), HALVINGS, found);
}

fn isolate(polynomial: &[f64], bernstein: &[f64], noise: f64, (low, high): (f64, f64), left: u32, found: &mut Vec<f64>) {
    let signs = || bernstein.iter().copied().filter(|b| b.abs() > noise).map(|b| b > 0.0);
    let changes = signs().zip(signs().skip(1)).filter(|(a, b)| a != b).count();
    if changes == 0 {
        return;
    }
    if changes == 1 || left == 0 {
        let rising = signs().next() == Some(false);
        let (mut a, mut b) = (low, high);
        for _ in 0..60 {
            let middle = 0.5 * (a + b);
            if (value(polynomial, middle) > 0.0) == rising { b = middle } else { a = middle }
        }
        found.push(0.5 * (a + b));
        return;
    }
    // De Casteljau: the coefficients of both halves.
    let mut row = bernstein.to_vec();
    let (mut first, mut second) = (vec![row[0]], vec![row[row.len() - 1]]);
    while row.len() > 1 {
        row = row.windows(2).map(|w| 0.5 * (w[0] + w[1])).collect();
        first.push(row[0]);
        second.push(row[row.len() - 1]);
    }
    second.reverse();
    let middle = 0.5 * (low + high);
    isolate(polynomial, &first, noise, (low, middle), left - 1, found);
    if second[0].abs() <= noise {
        found.push(middle);
    }
    isolate(polynomial, &second, noise, (middle, high), left - 1, found);
}

#[cfg(test)]
mod tests {
    use super::*;

    fn roots_of(polynomial: &[f64]) -> Vec<f64> {
        let mut found = Vec::new();
        sign_changes(polynomial, 1e-14, &mut found);
        found
    }

    #[test]
    fn roots_are_found_in_order() {
        for roots in [vec![0.5], vec![0.25, 0.5, 0.75], vec![0.1, 0.11, 0.9], vec![0.001, 0.3, 0.31, 0.6, 0.999], vec![-0.2, 0.4, 1.7]] {
            let polynomial = roots.iter().fold(vec![2.0], |p, r| product(&p, &[-r, 1.0]));
            let found = roots_of(&polynomial);
            let inside: Vec<f64> = roots.iter().copied().filter(|r| (0.0..1.0).contains(r)).collect();
            assert_eq!(found.len(), inside.len(), "{roots:?}: {found:?}");
            assert!(found.iter().zip(&inside).all(|(f, r)| (f - r).abs() < 1e-9), "{roots:?}: {found:?}");
        }
        assert!(roots_of(&[1.0, 0.0, 1.0]).is_empty() && roots_of(&[0.0; 5]).is_empty() && roots_of(&[1e-16, -3e-16]).is_empty());
    }

    #[test]
    fn derivatives_and_sums() {
        assert_eq!(derivative(&[5.0, 1.0, 2.0, 3.0]), [1.0, 4.0, 9.0]);
        let mut sum = vec![1.0, 2.0, 3.0];
        add(&mut sum, &[1.0, 1.0]);
        assert_eq!((value(&sum, 2.0), sum), (20.0, vec![2.0, 3.0, 3.0]));
    }
}
