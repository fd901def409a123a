//! From voxels to the coefficients of the cubic B-spline that goes through them (Unser, Aldroubi, Eden 1993).
//!
//! At a voxel the spline is (c(k-1) + 4 c(k) + c(k+1)) / 6. The filter that undoes this has the poles z and 1/z; it runs along each line of voxels
//! forwards, then backwards, and starts from the sum over the line as it is mirrored at its ends without end.

/// sqrt(3) - 2.
const POLE: f64 = -0.267_949_192_431_122_7;

/// Terms of a geometric series of [`POLE`] after which the rest is below the rounding of f64.
const HORIZON: usize = 30;

/// Columns that are filtered together: a line of the cache holds them.
const COLUMNS: usize = 16;

/// Turns the numbers of a line into coefficients.
pub(super) fn line(numbers: &mut [f64]) {
    let mut columns: Vec<[f64; 1]> = numbers.iter().map(|&x| [x]).collect();
    recursion(&mut columns);
    numbers.iter_mut().zip(columns).for_each(|(to, [c])| *to = c);
}

/// Turns the columns of `rows`, all equally long, into coefficients. A single row is left as it is.
pub(super) fn across(rows: &mut [&mut [f32]]) {
    let width = rows.first().map_or(0, |row| row.len());
    let mut columns = vec![[0.0f64; COLUMNS]; rows.len()];
    for first in (0..width).step_by(COLUMNS) {
        let end = (first + COLUMNS).min(width);
        for (column, row) in columns.iter_mut().zip(rows.iter()) {
            column.iter_mut().zip(&row[first..end]).for_each(|(to, &x)| *to = f64::from(x));
        }
        recursion(&mut columns);
        for (column, row) in columns.iter().zip(rows.iter_mut()) {
            row[first..end].iter_mut().zip(column).for_each(|(to, &c)| *to = c as f32);
        }
    }
}

/// The recursive filter along `lines`, `W` lines side by side.
fn recursion<const W: usize>(lines: &mut [[f64; W]]) {
    let n = lines.len();
    if n < 2 {
        return;
    }
    // The forward filter's first value: the series over the mirrored line, which repeats after 2 n - 2 voxels.
    let mut first = lines[0];
    let mut power = POLE;
    if n > HORIZON {
        for line in &lines[1..HORIZON] {
            add(&mut first, power, line);
            power *= POLE;
        }
    } else {
        for k in 1..2 * n - 2 {
            let mirrored = if k < n { k } else { 2 * n - 2 - k };
            let line = lines[mirrored];
            add(&mut first, power, &line);
            power *= POLE;
        }
        // `power` is the pole to the 2 n - 2 now.
        first.iter_mut().for_each(|x| *x /= 1.0 - power);
    }
    lines[0] = first;
    for k in 1..n {
        let before = lines[k - 1];
        add(&mut lines[k], POLE, &before);
    }
    let before = lines[n - 2];
    let last = &mut lines[n - 1];
    for i in 0..W {
        // The gain of 6, and the pole that both filters share.
        last[i] = 6.0 * POLE / (POLE * POLE - 1.0) * (last[i] + POLE * before[i]);
    }
    for k in (0..n - 1).rev() {
        let after = lines[k + 1];
        let line = &mut lines[k];
        for i in 0..W {
            line[i] = POLE * (after[i] - 6.0 * line[i]);
        }
    }
}

/// Adds `factor` times `x` to `sum`.
fn add<const W: usize>(sum: &mut [f64; W], factor: f64, x: &[f64; W]) {
    for i in 0..W {
        sum[i] += factor * x[i];
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_spline_of_a_filtered_line_goes_through_its_numbers() {
        for n in [1, 2, 3, 4, 7, 29, 30, 31, 32, 100] {
            let numbers: Vec<f64> = (0..n).map(|i: usize| (i * 2_654_435_761 % 1000) as f64 - 300.0).collect();
            let mut c = numbers.clone();
            line(&mut c);
            for k in 0..n {
                let mirrored = |k: i64| if n == 1 { c[0] } else { c[(if k < 0 { -k } else { k.min(2 * n as i64 - 2 - k) }) as usize] };
                let k = k as i64;
                let value = (mirrored(k - 1) + 4.0 * mirrored(k) + mirrored(k + 1)) / 6.0;
                assert!((value - numbers[k as usize]).abs() < 1e-11, "number {k} of {n}: {value} not {}", numbers[k as usize]);
            }
        }
    }

    #[test]
    fn columns_are_filtered_like_lines() {
        let (n, width) = (9, 37);
        let mut rows: Vec<Vec<f32>> = (0..n).map(|j| (0..width).map(|i| ((i * 31 + j * 17) % 23) as f32).collect()).collect();
        let mut lines: Vec<Vec<f64>> = (0..width).map(|i| (0..n).map(|j| f64::from(rows[j][i])).collect()).collect();
        lines.iter_mut().for_each(|l| line(l));
        across(&mut rows.iter_mut().map(|r| &mut r[..]).collect::<Vec<_>>());
        for i in 0..width {
            for j in 0..n {
                assert_eq!(rows[j][i], lines[i][j] as f32);
            }
        }
    }
}
