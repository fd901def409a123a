//! The order in which parts of a volume lie before one another.
//!
//! Parts that cuts along the three axes make can always be ordered, from any eye. Along a ray each index coordinate only rises, or only
//! falls, or stays. Seen in parallel, every ray moves the same way along an axis, so the parts follow each other by where they lie on it. In
//! perspective rays move away from the eye on both sides of it, so parts follow each other by their distance from the eye along the axis; no
//! ray meets parts on both sides. Two parts that lie the other way round along two axes are never met by one ray: their order does not matter.

use super::Domain;
use crate::scene::View;
use std::cmp::Ordering;

/// The places in `parts` of a volume's parts, nearest first as `view` sees them: layers put over one another in this order make up the whole.
///
/// The parts are some or all of those that cuts along the axes make (see [`Domain::tiles`]), of one whole.
pub fn order(parts: &[Domain], view: &View) -> Vec<usize> {
    let keys: Vec<[f64; 3]> = parts.iter().map(|part| key(part, view)).collect();
    let mut places: Vec<usize> = (0..parts.len()).collect();
    places.sort_by(|&a, &b| keys[a].iter().zip(&keys[b]).map(|(a, b)| a.total_cmp(b)).find(|o| o.is_ne()).unwrap_or(Ordering::Equal));
    places
}

/// How far along each axis a ray goes before it meets `part`: only comparisons count.
fn key(part: &Domain, view: &View) -> [f64; 3] {
    let map = part.whole().world_to_index();
    let (eye, towards) = (map.transform_point3(view.eye), map.matrix3 * view.forward);
    std::array::from_fn(|axis| {
        let (low, high) = part.owned()[axis];
        if view.perspective {
            (low - eye[axis]).max(eye[axis] - high).max(0.0)
        } else if towards[axis] < 0.0 {
            -high
        } else {
            low
        }
    })
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test fails by panicking")]
mod tests {
    use super::*;
    use crate::proxy::Stack;
    use crate::scene::{Camera, Placement, Projection};
    use crate::volume::Grid;
    use glam::{DMat3, DVec3};

    /// Whoever owns the samples of a ray, from the eye on: each part once, in the order told.
    #[test]
    fn along_every_ray_owners_follow_each_other_in_the_order_told() {
        let steps = DMat3::from_cols(DVec3::new(1.0, 0.1, 0.0), DVec3::new(-0.1, 0.8, 0.2), DVec3::new(0.0, -0.1, -1.7));
        let whole = Grid::new([20, 17, 9], DVec3::new(5.0, -3.0, 2.0), steps).unwrap();
        let parts = Domain::tiles(&whole, &[vec![5, 6, 13], vec![8, 9], vec![3]], [1; 3], (0.0, 1.0), 0).unwrap();
        let corner = whole.index_to_world().transform_point3(DVec3::new(7.3, 8.5, 3.0));
        let mut crossings = 0;
        for case in 0..80 {
            let degrees = f64::from(case) * 37.0;
            let projection =
                if case % 2 == 0 { Projection::Orthographic { height: None } } else { Projection::Perspective { fov_y: 70.0 } };
            let placement = if case % 8 == 7 {
                // From inside a part, near others.
                let target = corner + DVec3::new(libm::cos(degrees), libm::sin(degrees), 0.3);
                Placement::LookAt { eye: corner, target, up: DVec3::Z }
            } else {
                Placement::Orbit { azimuth: degrees, elevation: f64::from(case % 7) * 25.0 - 75.0, roll: 10.0, zoom: 1.0 }
            };
            let view = Camera::new(placement, projection).unwrap().resolve(&whole, 32, 32).unwrap();
            let stack = Stack::new(&whole, &view, &[], 300);
            let told = order(&parts, &view);
            let mut rank = vec![0; parts.len()];
            told.iter().enumerate().for_each(|(at, &part)| rank[part] = at);
            for pixel in 0..32 * 32 {
                let (x, y) = (f64::from(pixel % 32) + 0.5, f64::from(pixel / 32) + 0.5);
                let mut last = None;
                for k in 0..300 {
                    let at = stack.index_at(x, y, stack.depth(k)).to_array();
                    let owners: Vec<usize> = (0..parts.len()).filter(|&p| parts[p].owns(at)).collect();
                    assert_eq!(owners.len(), 1, "{at:?}");
                    let now = rank[owners[0]];
                    assert!(last.is_none_or(|last| last <= now), "case {case}, pixel {x},{y}, slice {k}");
                    crossings += usize::from(last.is_some_and(|last| last != now));
                    last = Some(now);
                }
            }
        }
        assert!(crossings > 50_000, "{crossings}");
    }
}
