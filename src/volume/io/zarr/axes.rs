//! What the dimensions of an array mean: time, channels, and the axes of space.

use super::array::Array;
use crate::{Error, Result};

/// What a dimension is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Role {
    Time,
    Channel,
    /// An axis of space: 0 for x, 1 for y, 2 for z.
    Space(usize),
    /// Of one number, whatever it means.
    Single,
}

/// What metadata say of a dimension.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub(super) struct Axis {
    pub(super) name: String,
    /// `time`, `channel`, `space`, or nothing.
    pub(super) kind: String,
    pub(super) unit: Option<String>,
}

impl Axis {
    /// An axis of which the name alone is known.
    pub(super) fn named(name: &str) -> Self {
        Self { name: name.to_owned(), ..Self::default() }
    }

    fn role(&self) -> Option<Role> {
        match (self.kind.as_str(), self.name.to_ascii_lowercase().as_str()) {
            ("time", _) | ("", "t" | "time") => Some(Role::Time),
            ("channel", _) | ("", "c" | "channel") => Some(Role::Channel),
            ("space" | "", "x") => Some(Role::Space(0)),
            ("space" | "", "y") => Some(Role::Space(1)),
            ("space" | "", "z") => Some(Role::Space(2)),
            _ => None,
        }
    }
}

/// Dimensions in the order that the format's users agree on where no names are there.
const USUAL: [Role; 5] = [Role::Time, Role::Channel, Role::Space(2), Role::Space(1), Role::Space(0)];

/// What the dimensions of an array are.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Axes {
    pub(super) roles: Vec<Role>,
    /// What was taken for what, where names did not tell.
    pub(super) note: Option<String>,
}

impl Axes {
    /// By `axes`, else by their order.
    ///
    /// # Errors
    /// When there are too few dimensions, or more than are known.
    pub(super) fn new(array: &Array, axes: &[Axis]) -> Result<Self> {
        if let Some(roles) = by_name(&array.shape, axes) {
            return Ok(Self { roles, note: None });
        }
        let roles = by_order(&array.shape).ok_or_else(|| {
            let shape = shown(&array.shape);
            let what = format!("shape is {shape}: a volume has x, y and perhaps z, and besides them one time and one channel axis at most");
            Error::format(&array.path, what)
        })?;
        let letter = |role: &Role| match role {
            Role::Time => "t",
            Role::Channel => "c",
            Role::Space(axis) => ["x", "y", "z"][*axis],
            Role::Single => "one",
        };
        let letters: Vec<&str> = roles.iter().map(letter).collect();
        let why = if axes.is_empty() { "have no names" } else { "have names that do not tell" };
        let note = format!("The dimensions of the array, {}, {why}: taken as {}.", shown(&array.shape), letters.join(", "));
        Ok(Self { roles, note: Some(note) })
    }

    /// The dimension of the array that is `role`.
    pub(super) fn find(&self, role: Role) -> Option<usize> {
        self.roles.iter().position(|&r| r == role)
    }

    /// Numbers along x, y and z, one along an axis that is not there.
    pub(super) fn dims(&self, shape: &[usize]) -> [usize; 3] {
        [0, 1, 2].map(|axis| self.count(shape, Role::Space(axis)))
    }

    /// Numbers along the dimension that is `role`.
    pub(super) fn count(&self, shape: &[usize], role: Role) -> usize {
        self.find(role).map_or(1, |dimension| shape[dimension])
    }
}

/// Sizes with crosses between.
pub(super) fn shown(sizes: &[usize]) -> String {
    sizes.iter().map(usize::to_string).collect::<Vec<_>>().join(" x ")
}

fn by_name(shape: &[usize], axes: &[Axis]) -> Option<Vec<Role>> {
    if axes.len() != shape.len() {
        return None;
    }
    // A dimension that means something else is no obstacle where there is one number along it.
    let role = |(axis, &size): (&Axis, &usize)| axis.role().or((size == 1).then_some(Role::Single));
    let roles: Vec<Role> = axes.iter().zip(shape).map(role).collect::<Option<_>>()?;
    let once = |role: Role| roles.iter().filter(|&&r| r == role).count() == 1;
    let twice = |role: &Role| *role != Role::Single && !once(*role);
    (once(Role::Space(0)) && once(Role::Space(1)) && !roles.iter().any(twice)).then_some(roles)
}

fn by_order(shape: &[usize]) -> Option<Vec<Role>> {
    let mut roles = vec![None; shape.len()];
    let mut left = shape.len();
    // What has one number only is dropped until three dimensions are left.
    for (role, &size) in roles.iter_mut().zip(shape) {
        if left > 3 && size == 1 {
            *role = Some(Role::Single);
            left -= 1;
        }
    }
    if left > 3 && shape.len() == USUAL.len() {
        return Some(USUAL.to_vec());
    }
    if !(2..=USUAL.len()).contains(&left) {
        return None;
    }
    let mut usual = USUAL[USUAL.len() - left..].iter().copied();
    roles.into_iter().map(|role| role.or_else(|| usual.next())).collect()
}

#[cfg(test)]
mod tests {
    use super::Role::{Channel, Single, Space, Time};
    use super::*;

    #[test]
    fn names_tell_what_dimensions_are() {
        let named = |names: &[&str], shape: &[usize]| by_name(shape, &names.iter().map(|n| Axis::named(n)).collect::<Vec<_>>());
        assert_eq!(named(&["Time", "c", "Z", "y", "x"], &[1, 2, 3, 4, 5]), Some(USUAL.to_vec()));
        assert_eq!(named(&["x", "y", "c"], &[9, 9, 3]), Some(vec![Space(0), Space(1), Channel]));
        assert_eq!(named(&["x", "y", "lambda"], &[9, 9, 3]), None);
        assert_eq!(named(&["x", "y", "lambda"], &[9, 9, 1]), Some(vec![Space(0), Space(1), Single]));
        assert_eq!(named(&["x", "x", "y"], &[9, 9, 9]), None);
        assert_eq!(named(&["z", "y"], &[9, 9]), None);
        let axis = |name: &str, kind: &str| Axis { name: name.into(), kind: kind.into(), unit: None };
        assert_eq!(
            by_name(&[7, 8, 9], &[axis("phase", "time"), axis("y", "space"), axis("x", "space")]),
            Some(vec![Time, Space(1), Space(0)])
        );
    }

    #[test]
    fn without_names_the_usual_order_is_taken() {
        assert_eq!(by_order(&[8, 9]), Some(vec![Space(1), Space(0)]));
        assert_eq!(by_order(&[1, 8, 9]), Some(vec![Space(2), Space(1), Space(0)]));
        assert_eq!(by_order(&[1, 7, 8, 9]), Some(vec![Single, Space(2), Space(1), Space(0)]));
        assert_eq!(by_order(&[2, 7, 8, 9]), Some(USUAL[1..].to_vec()));
        assert_eq!(by_order(&[2, 1, 7, 8, 9]), Some(USUAL.to_vec()));
        assert_eq!(by_order(&[1, 2, 1, 7, 8, 9]), Some(vec![Single, Channel, Single, Space(2), Space(1), Space(0)]));
        assert_eq!(by_order(&[2, 2, 2, 7, 8, 9]), None);
        assert_eq!(by_order(&[9]), None);
    }
}
