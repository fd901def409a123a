//! Colours as people write them, and as light adds up.
//!
//! Colours of a scene are sRGB numbers: a half looks about half as bright as 1, and is a fifth of its light (IEC 61966-2-1). They are blended
//! as they are, as OpenGL 1.x and other renderers do, unless a scene asks for [`Scene::with_linear_light`]: then they are turned into amounts
//! of light first, blended as such, and the picture's colours are turned back.

use super::{Blend, Order, Scene, Straight};

/// How the numbers of a scene's colours are meant.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) enum ColorNumbers {
    /// sRGB, blended as they are.
    #[default]
    Display,
    /// sRGB, to be blended as amounts of light.
    ToBeLinear,
    /// Amounts of light.
    Linear,
}

/// The amount of light of an sRGB component, both 0 to 1.
pub(crate) fn to_linear(c: f64) -> f64 {
    if c <= 0.04045 { c / 12.92 } else { libm::pow((c + 0.055) / 1.055, 2.4) }
}

/// The sRGB component of an amount of light, both 0 to 1.
pub(crate) fn to_display(c: f64) -> f64 {
    if c <= 0.003_130_8 { 12.92 * c } else { 1.055 * libm::pow(c, 1.0 / 2.4) - 0.055 }
}

impl Scene {
    /// Whether colours are blended as amounts of light.
    pub fn linear_light(&self) -> bool {
        self.colors != ColorNumbers::Display
    }

    /// The scene as it is blended: its colours are amounts of light where it asks for that, and under is over where it comes to the same. Points of the
    /// transfer function are converted; between them it is linear in light.
    #[must_use]
    pub(crate) fn blended(&self) -> Self {
        let mut scene = self.clone();
        if scene.blend == Blend::Under && scene.blending_order() == Order::FrontToBack {
            scene.blend = Blend::Over;
        }
        if self.colors == ColorNumbers::ToBeLinear {
            scene.colors = ColorNumbers::Linear;
            scene.transfer = self.transfer.with_colors(|rgb| rgb.map(to_linear));
            scene.transfer2d = self.transfer2d.as_ref().map(|t| t.with_colors(to_linear));
            scene.background = Straight { rgb: self.background.rgb.map(to_linear), alpha: self.background.alpha };
            scene.fog = self.fog.map(|fog| fog.with_color_turned(to_linear));
            scene.levels = self.levels_in_light();
            scene.segments = self.segments_in_light();
            scene.regions = self.regions_in_light();
            scene.lighting = self.lighting.as_ref().map(|lighting| lighting.with_colors_turned(to_linear));
        }
        scene
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn both_ways_undo_each_other_and_keep_the_ends() {
        for i in 0..=1000 {
            let c = f64::from(i) / 1000.0;
            assert!((to_display(to_linear(c)) - c).abs() < 1e-7, "{c}");
        }
        assert_eq!((to_linear(0.0), to_display(0.0)), (0.0, 0.0));
        assert!((to_linear(1.0) - 1.0).abs() < 1e-12 && (to_display(1.0) - 1.0).abs() < 1e-12);
        // A well-known pair: half the number is 21.4 % of the light.
        assert!((to_linear(0.5) - 0.214_041_14).abs() < 1e-8);
    }
}
