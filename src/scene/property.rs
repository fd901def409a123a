//! Between a scene's transfer function and light and what other programs' files hold of them.

use super::{Lighting, Shading, TransferFunction};
use crate::Result;
use crate::transfer_io::{Material, VolumeProperty};

impl VolumeProperty {
    /// `transfer`, and of `lighting` the material; a light that only darkens with depth has none.
    pub fn of(transfer: &TransferFunction, lighting: Option<&Lighting>) -> Self {
        let material = lighting.filter(|l| l.shading == Shading::BlinnPhong).map(|l| Material {
            ambient: l.ambient,
            diffuse: l.diffuse,
            specular: l.specular,
            shininess: l.shininess,
        });
        Self {
            name: String::new(),
            color: transfer.color().to_vec(),
            opacity: transfer.opacity().to_vec(),
            gradient_opacity: transfer.gradient_opacity().to_vec(),
            opacity_unit: transfer.unit(),
            material,
        }
    }

    /// The transfer function of these curves.
    ///
    /// # Errors
    /// [`crate::Error::Invalid`] for points that break the guarantees of [`TransferFunction`]; those of a file that was read do not.
    pub fn transfer(&self) -> Result<TransferFunction> {
        let transfer = TransferFunction::new(self.color.clone(), self.opacity.clone())?;
        let transfer = transfer.with_gradient_opacity(self.gradient_opacity.clone())?;
        match self.opacity_unit {
            Some(length) => transfer.with_unit(length),
            None => Ok(transfer),
        }
    }

    /// The material in a light from the eye, its shininess brought into 1 to 1000; `None` where the volume is not lit.
    pub fn lighting(&self) -> Option<Lighting> {
        let m = self.material?;
        let mut lighting = Lighting::default();
        (lighting.ambient, lighting.diffuse, lighting.specular) = (m.ambient, m.diffuse, m.specular);
        lighting.shininess = m.shininess.clamp(1.0, 1000.0);
        Some(lighting)
    }
}

/// What of `lighting` a [`Material`] has no place for, by the names of its keys.
pub(super) fn beyond_material(lighting: &Lighting) -> Vec<&'static str> {
    let plain = Lighting::default();
    let list = [
        ("model", lighting.shading != plain.shading),
        ("emission", lighting.emission != 0.0),
        ("gradient_floor", lighting.gradient_floor != 0.0),
        ("two_sided", !lighting.two_sided),
        ("lights", lighting.lights() != plain.lights()),
    ];
    list.into_iter().filter(|k| k.1).map(|k| k.0).collect()
}
