//! The sections `[transfer]` and `[light]` of a scene file. (They are read by [`crate::scene::SceneFile`].)

use super::VolumeProperty;
use std::fmt::Write;

/// `property` as the sections `[transfer]` and, where it is lit, `[light]` of a scene file in TOML.
pub fn write(property: &VolumeProperty) -> String {
    let mut text = String::from("[transfer]\n");
    let pairs = |points: &[(f64, f64)]| points.iter().map(|(x, y)| format!("[{x:?}, {y:?}]")).collect::<Vec<_>>();
    let colors: Vec<String> = property.color.iter().map(|(x, [r, g, b])| format!("[{x:?}, {r:?}, {g:?}, {b:?}]")).collect();
    list(&mut text, "color", &colors);
    list(&mut text, "opacity", &pairs(&property.opacity));
    if !property.gradient_opacity.is_empty() {
        list(&mut text, "gradient_opacity", &pairs(&property.gradient_opacity));
    }
    // Writing to a String cannot fail.
    if let Some(unit) = property.opacity_unit {
        let _ = writeln!(text, "opacity_unit = {unit:?}");
    }
    if let Some(m) = &property.material {
        let _ = write!(
            text,
            "\n[light]\nambient = {:?}\ndiffuse = {:?}\nspecular = {:?}\nshininess = {:?}\n",
            m.ambient, m.diffuse, m.specular, m.shininess
        );
    }
    text
}

fn list(text: &mut String, key: &str, points: &[String]) {
    let _ = writeln!(text, "{key} = [");
    for point in points {
        let _ = writeln!(text, "  {point},");
    }
    text.push_str("]\n");
}
