//! Stored values that show nothing, as whole numbers: cheaper to tell than what they classify to.

use crate::volume::VoxelType;

/// The largest stored integer such that it and all values interpolated between smaller ones show nothing: they lie below position
/// `first_visible` of a table that begins at value `low` and has the product of `scale` entries a unit. `None` for voxels of over 16 bits,
/// and for tables that run from high values to low ones.
pub(super) fn hidden_up_to(kind: VoxelType, low: f32, scale: [f32; 2], first_visible: f32) -> Option<i32> {
    let bits = match kind {
        VoxelType::U8 | VoxelType::I8 => 8,
        VoxelType::U16 | VoxelType::I16 => 16,
        _ => return None,
    };
    let per_unit = f64::from(scale[0]) * f64::from(scale[1]);
    if !(per_unit > 0.0 && first_visible > 0.0) {
        return None;
    }
    // Interpolation may round a value up by a few units in the last place of the largest there are.
    let margin = libm::scalbn(1.0, bits - 20);
    let end = f64::from(low) + f64::from(first_visible) * (1.0 - 1e-6) / per_unit - margin;
    let (least, most) = kind.limits();
    // Where every value shows nothing, the whole frame is passed over before.
    let last = libm::ceil(end) - 1.0;
    (last >= least && last < most).then_some(last as i32)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lanes::tests::Numbers;

    /// Where a value lies in the table, as classification computes it.
    fn position(value: f32, low: f32, scale: [f32; 2]) -> f32 {
        (value - low) * scale[0] * scale[1]
    }

    #[test]
    fn dark_numbers_show_nothing_and_few_others_do() {
        let mut n = Numbers::new(5);
        let mut found = 0;
        for round in 0..20_000 {
            let kind = [VoxelType::U8, VoxelType::I8, VoxelType::U16, VoxelType::I16][(n.bits() % 4) as usize];
            let (least, most) = kind.limits();
            let low = n.between(least - 10.0, most) as f32;
            let high = n.between(f64::from(low) + 1e-3, most + 10.0);
            let last = (64 + n.bits() % 1000) as f32;
            let factor = f64::from(last) / (high - f64::from(low));
            let scale = if n.bits() % 2 == 0 { [factor as f32, 1.0] } else { [(factor * 0.25) as f32, 4.0] };
            let clear = (n.bits() % 60) as f32;
            let Some(limit) = hidden_up_to(kind, low, scale, clear) else { continue };
            found += 1;
            // A few units in the last place above the number, as interpolation may round.
            let value = limit as f32;
            for value in [value, value + value.abs() * 4e-7, value - 1.0] {
                assert!(position(value, low, scale) < clear, "round {round}: {value}");
            }
            // The one after the next is over: no more is given away.
            assert!(position(value + 2.0, low, scale) >= clear, "round {round}: {value} + 2");
            assert!(f64::from(value) >= least && f64::from(value) < most);
        }
        assert!(found > 5000, "{found} found");
    }

    #[test]
    fn there_is_none_without_a_clear_beginning_or_for_wide_voxels() {
        assert_eq!(hidden_up_to(VoxelType::U8, 20.0, [1.0, 1.0], 30.0), Some(49));
        assert_eq!(hidden_up_to(VoxelType::U8, 20.0, [1.0, 1.0], 0.0), None);
        assert_eq!(hidden_up_to(VoxelType::U8, 20.0, [-1.0, 1.0], 30.0), None);
        assert_eq!(hidden_up_to(VoxelType::U8, 20.0, [0.0, 1.0], 30.0), None);
        assert_eq!(hidden_up_to(VoxelType::F32, 20.0, [1.0, 1.0], 30.0), None);
        assert_eq!(hidden_up_to(VoxelType::U32, 20.0, [1.0, 1.0], 30.0), None);
    }
}
