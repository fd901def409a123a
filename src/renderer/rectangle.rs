//! A rectangle of a picture that holds all of its pixels in which there is something.

/// A rectangle of a picture's pixels; those beside it are all the same.
///
/// # Guarantees
/// There are `width * height` pixels, row by row from the top; the rectangle lies in the picture.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Rectangle {
    /// Columns and rows of the whole picture.
    pub(super) picture: (u32, u32),
    /// First column and row of the rectangle.
    pub(super) first: (u32, u32),
    pub(super) size: (u32, u32),
    pub(super) pixels: Vec<[f32; 4]>,
}

impl Rectangle {
    /// The smallest one that holds all of a picture's pixels that are not `nothing`.
    pub(super) fn cropped(picture: (u32, u32), pixels: &[[f32; 4]], nothing: [f32; 4]) -> Self {
        let width = picture.0 as usize;
        let some = |row: &[[f32; 4]]| row.iter().any(|p| *p != nothing);
        let rows: Vec<usize> = pixels.chunks(width).enumerate().filter(|(_, row)| some(row)).map(|(y, _)| y).collect();
        let (Some(&top), Some(&bottom)) = (rows.first(), rows.last()) else {
            return Self { picture, first: (0, 0), size: (0, 0), pixels: Vec::new() };
        };
        let inside = &pixels[top * width..(bottom + 1) * width];
        let column = |x: &usize| inside.iter().skip(*x).step_by(width).any(|p| *p != nothing);
        let left = (0..width).find(column).unwrap_or(0);
        let right = (0..width).rev().find(column).unwrap_or(0);
        let pixels = inside.chunks(width).flat_map(|row| &row[left..=right]).copied().collect();
        let size = ((right + 1 - left) as u32, (bottom + 1 - top) as u32);
        Self { picture, first: (left as u32, top as u32), size, pixels }
    }

    /// The smallest rectangle that holds this one and `other`, with what `join` makes of their pixels; `nothing` is beside each of them.
    pub(super) fn joined(&self, other: &Self, nothing: [f32; 4], join: impl Fn([f32; 4], [f32; 4]) -> [f32; 4]) -> Self {
        if other.pixels.is_empty() || self.pixels.is_empty() {
            return if self.pixels.is_empty() { other.clone() } else { self.clone() };
        }
        let end = |r: &Self| (r.first.0 + r.size.0, r.first.1 + r.size.1);
        let (a, b) = (end(self), end(other));
        let first = (self.first.0.min(other.first.0), self.first.1.min(other.first.1));
        let size = (a.0.max(b.0) - first.0, a.1.max(b.1) - first.1);
        let mut pixels = vec![nothing; size.0 as usize * size.1 as usize];
        other.put(first, size.0, &mut pixels, |theirs, _| theirs);
        self.put(first, size.0, &mut pixels, join);
        Self { picture: self.picture, first, size, pixels }
    }

    /// Each pixel of a picture's rectangle that begins at `first`, `width` pixels wide, becomes what `join` makes of the one here and the one
    /// there.
    pub(super) fn put(&self, first: (u32, u32), width: u32, to: &mut [[f32; 4]], join: impl Fn([f32; 4], [f32; 4]) -> [f32; 4]) {
        let (width, columns) = (width as usize, self.size.0 as usize);
        let (left, top) = ((self.first.0 - first.0) as usize, (self.first.1 - first.1) as usize);
        for (y, row) in (top..).zip(self.pixels.chunks(columns.max(1))) {
            for (to, &here) in to[y * width + left..][..columns].iter_mut().zip(row) {
                *to = join(here, *to);
            }
        }
    }
}
