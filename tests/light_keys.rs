//! Light in scene files: what is refused, in one line that names the key, and what the keys come to.
#![cfg(feature = "scene-file")]
#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use slicestack::scene::{Gradient, LightSource, Overrides, SceneFile, Shading};
use slicestack::volume::phantom::Phantom;
use slicestack::{Result, Scene};

fn open(sections: &str) -> Result<Scene> {
    let text = format!("[volume]\nphantom = \"marschner-lobb\"\nsize = 8\n{sections}\n");
    let file = SceneFile::parse(&text, "", &Overrides::default())?;
    Ok(file.to_scene(&Phantom::MarschnerLobb.volume(8).unwrap())?.0)
}

/// Refused in one line that holds every part of `says`.
#[track_caller]
fn refused(sections: &str, says: &[&str]) {
    let line = open(sections).expect_err(sections).to_string();
    assert_eq!(line.lines().count(), 1, "{sections}: {line}");
    for part in says {
        assert!(line.contains(part), "{sections}: {line} does not say {part}");
    }
}

#[test]
fn every_bad_number_is_one_line_that_names_its_key() {
    for key in ["ambient", "diffuse", "specular", "emission", "gradient_floor"] {
        for bad in ["-0.1", "nan", "inf", "-inf", "-1e300"] {
            refused(&format!("[light]\n{key} = {bad}"), &["light", key]);
        }
        refused(&format!("[light]\n{key} = \"much\""), &["light", key]);
    }
    for bad in ["0", "0.999", "1000.001", "-20", "nan", "inf"] {
        refused(&format!("[light]\nshininess = {bad}"), &["light", "shininess"]);
    }
    for bad in ["[0, 0, 0]", "[nan, 0, 1]", "[1, inf, 0]", "[1, 2]", "\"heed\"", "3", "true"] {
        refused(&format!("[light]\ndirection = {bad}"), &["light", "direction"]);
    }
    for bad in ["[nan, 0, 1]", "[1, -inf, 0]", "[1, 2, 3, 4]", "\"head\""] {
        refused(&format!("[light]\nposition = {bad}"), &["light", "position"]);
    }
    for bad in ["[1.1, 0, 0]", "[0, -0.1, 0]", "[0, 0, nan]", "[1, 1]"] {
        refused(&format!("[light]\ncolor = {bad}"), &["light", "color"]);
        refused(&format!("[[lights]]\ncolor = {bad}"), &["lights[0]", "color"]);
    }
    refused("[[lights]]\ndirection = \"head\"\n[[lights]]\ndirection = [0, 0, 0]", &["lights[1]", "direction"]);
    refused("[[lights]]\nposition = [1, nan, 0]", &["lights[0]", "position"]);
    refused("[light]\ngradient = \"centrel\"", &["light.gradient", "centrel"]);
    refused("[light]\nmodel = \"phong\"", &["light.model", "phong"]);
    refused("[light]\ntwo_sided = 2", &["light.two_sided"]);
    refused("[light]\nshinyness = 2", &["light.shinyness", "light.shininess"]);
    for bad in
        ["[[-1, 0.5]]", "[[nan, 0.5]]", "[[inf, 0.5]]", "[[3, 0.5], [2, 0.5]]", "[[1, 1.5]]", "[[1, -0.5]]", "[[1, nan]]", "[[1]]", "[3]"]
    {
        refused(&format!("[transfer]\ngradient_opacity = {bad}"), &["transfer", "gradient_opacity"]);
    }
}

#[test]
fn what_does_not_go_together_is_one_line() {
    refused("[light]\ndirection = [0, 0, 1]\nposition = [1, 2, 3]", &["light.position", "light.direction"]);
    refused("[[lights]]\ndirection = [0, 0, 1]\nposition = [1, 2, 3]", &["lights[0].position", "lights[0].direction"]);
    refused("[light]\ncolor = [1, 0, 0]\n[[lights]]\ndirection = \"head\"", &["light.color", "[[lights]]"]);
    refused(&"[[lights]]\ndirection = \"head\"\n".repeat(5), &["lights", "5"]);
    for blend in ["mip", "min", "average", "lmip"] {
        refused(&format!("[light]\nambient = 0.2\n[render]\nblend = \"{blend}\""), &["light", "projection"]);
        refused(
            &format!("[transfer]\ngradient_opacity = [[0, 0], [1, 1]]\n[render]\nblend = \"{blend}\""),
            &["gradient_opacity", "projection"],
        );
    }
    refused("[light]\nambient = 0.2\n[render]\nprofile = \"opengl\"", &["light", "opengl"]);
    refused("[light]\nambient = 0.2\n[slices]\nmerge = true", &["light", "merge"]);
    let slopes = "gradient_opacity = [[0, 0], [1, 1]]";
    for classification in ["pre-integrated", "second-order"] {
        refused(&format!("[transfer]\n{slopes}\nclassification = \"{classification}\""), &["gradient_opacity", "pre-integrated"]);
    }
    refused(&format!("[transfer]\n{slopes}\n[slices]\nslab = \"riemann\""), &["gradient_opacity", "riemann"]);
    refused(&format!("[transfer]\n{slopes}\n[slices]\nmerge = true"), &["gradient_opacity", "merge"]);
    refused(&format!("[transfer]\n{slopes}\n[render]\nprofile = \"opengl\""), &["gradient_opacity", "opengl"]);
}

#[test]
fn keys_come_to_what_they_say() {
    assert!(open("").unwrap().lighting().is_none());
    // A kind of gradient alone lights nothing.
    let kind = open("[light]\ngradient = \"sobel\"").unwrap();
    assert!(kind.lighting().is_none() && kind.gradient() == Gradient::Sobel);
    let scene = open("[light]\nambient = 0.3\nshininess = 1000\ntwo_sided = false\ndirection = [0, 0, 5]\ncolor = [1, 0.5, 0]").unwrap();
    let lighting = scene.lighting().unwrap();
    assert_eq!((lighting.ambient, lighting.diffuse, lighting.specular, lighting.emission), (0.3, 0.75, 0.2, 0.0));
    assert_eq!((lighting.shininess, lighting.two_sided, lighting.gradient_floor), (1000.0, false, 0.0));
    assert_eq!(lighting.lights().len(), 1);
    assert_eq!(lighting.lights()[0].source(), LightSource::Direction(glam::DVec3::Z));
    assert_eq!(lighting.lights()[0].color(), [1.0, 0.5, 0.0]);
    let two = open("[light]\nmodel = \"blinn-phong\"\n[[lights]]\ndirection = \"head\"\n[[lights]]\nposition = [1, 2, 3]").unwrap();
    let sources: Vec<LightSource> = two.lighting().unwrap().lights().iter().map(slicestack::scene::Light::source).collect();
    assert_eq!(sources, [LightSource::Head, LightSource::Position(glam::DVec3::new(1.0, 2.0, 3.0))]);
    assert_eq!(open("[light]\nmodel = \"depth\"").unwrap().lighting().unwrap().shading, Shading::Depth);
    assert!(open("[light]\nmodel = \"none\"\nambient = 0.3").unwrap().lighting().is_none());
    let weighted = open("[transfer]\ngradient_opacity = [[0, 0.25], [2, 1]]").unwrap();
    assert_eq!(weighted.transfer().gradient_factor(1.0), 0.625);
}
