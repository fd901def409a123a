use super::*;

fn parsed(kind: FileKind, text: &str, name: Option<&str>) -> Contents {
    parse(text.as_bytes(), Path::new("a.file"), kind, name).expect("good file")
}

/// The one line that `text` is refused with, without the file's name.
fn refused(kind: FileKind, text: &[u8], name: Option<&str>) -> String {
    let line = parse(text, Path::new("a.file"), kind, name).expect_err("accepted").to_string();
    assert!(!line.contains('\n') && line.chars().count() < 400, "{line}");
    line.strip_prefix("a.file: ").unwrap_or_else(|| panic!("no file name: {line}")).to_owned()
}

fn sample() -> VolumeProperty {
    VolumeProperty {
        name: "Bone & <\"marrow\">".into(),
        color: vec![(-1000.0, [0.0, 0.1, 0.25]), (150.5, [0.3, 0.2, 0.1]), (3071.0, [1.0, 0.999, 1.0])],
        opacity: vec![(-1000.0, 0.0), (120.0, 0.0), (300.25, 0.7), (3071.0, 1.0)],
        gradient_opacity: vec![(0.0, 0.0), (40.0, 0.5), (200.0, 1.0)],
        opacity_unit: Some(1.0),
        material: Some(Material { ambient: 0.1, diffuse: 0.85, specular: 0.3, shininess: 12.5 }),
    }
}

/// What is left of `property` in a file of `kind`.
fn kept(mut property: VolumeProperty, kind: FileKind) -> VolumeProperty {
    if matches!(kind, FileKind::SlicerProperty | FileKind::Csv) {
        property.name.clear();
    }
    if matches!(kind, FileKind::ParaView | FileKind::Csv) {
        property.gradient_opacity.clear();
        property.material = None;
    }
    property
}

#[test]
fn what_is_written_reads_back_as_it_was() {
    for kind in FileKind::ALL {
        for lit in [true, false] {
            let mut property = sample();
            if !lit {
                property.material = None;
                property.gradient_opacity.clear();
            }
            let (text, lost) = write(&property, kind);
            let again = parsed(kind, &text, None);
            assert!(again.warnings.is_empty(), "{kind:?}: {:?}", again.warnings);
            let mut want = kept(property.clone(), kind);
            assert_eq!(lost.len(), 2 * usize::from(lit && want.material.is_none()), "{kind:?}: {lost:?}");
            if kind == FileKind::Csv {
                // A table has both curves at the values of both.
                assert_eq!(again.property.color.len(), 5);
                for (x, rgb) in &want.color {
                    assert!(again.property.color.contains(&(*x, *rgb)), "{x}");
                }
                for point in &want.opacity {
                    assert!(again.property.opacity.contains(point), "{point:?}");
                }
                (want.color, want.opacity) = (again.property.color.clone(), again.property.opacity.clone());
            }
            assert_eq!(again.property, want, "{kind:?}");
            assert_eq!(write(&again.property, kind).0, write(&want, kind).0, "{kind:?}");
        }
    }
}

#[test]
fn steps_and_numbers_at_the_ends_of_f64_survive() {
    let far = f64::MAX;
    let property = VolumeProperty {
        color: vec![(-far, [0.0; 3]), (5e-324, [1e-300, 0.5, 1.0]), (1.0, [0.25; 3]), (1.0, [0.75; 3]), (far, [1.0; 3])],
        opacity: vec![(-1e300, 0.0), (-2.0, 0.5), (-2.0, 0.0), (7.0, 0.1), (7.0, 0.2), (7.0, 0.3), (1e300, 1.0)],
        opacity_unit: Some(1.0),
        ..VolumeProperty::default()
    };
    // Tables of VTK cannot hold two points of one value: Slicer's files have them a hair apart.
    let again = parsed(FileKind::SlicerProperty, &write(&property, FileKind::SlicerProperty).0, None).property;
    for (a, b) in again.opacity.iter().zip(&property.opacity) {
        assert!(a.1 == b.1 && (a.0 - b.0).abs() <= 3e-7 * b.0.abs(), "{a:?} {b:?}");
    }
    assert!(again.opacity.windows(2).all(|w| w[0].0 < w[1].0), "{:?}", again.opacity);
    assert_eq!(again.color[2].1, [0.25; 3]);
    let again = parsed(FileKind::ParaView, &write(&property, FileKind::ParaView).0, None).property;
    assert_eq!((again.color, again.opacity), (property.color.clone(), property.opacity.clone()));
    let again = parsed(FileKind::Csv, &write(&property, FileKind::Csv).0, None).property;
    let at = |x: f64| again.opacity.iter().filter(|p| p.0 == x).map(|p| p.1).collect::<Vec<_>>();
    assert_eq!((at(-2.0), at(7.0)), (vec![0.5, 0.0], vec![0.1, 0.3]));
}

#[test]
fn opacities_of_another_length_are_converted() {
    let property = VolumeProperty {
        color: vec![(0.0, [1.0; 3])],
        opacity: vec![(0.0, 0.0), (100.0, 0.9), (200.0, 1.0)],
        opacity_unit: Some(2.0),
        ..VolumeProperty::default()
    };
    let again = parsed(FileKind::SlicerProperty, &write(&property, FileKind::SlicerProperty).0, None).property;
    assert_eq!(again.opacity_unit, Some(1.0));
    assert!(again.opacity.len() > 4 && again.opacity.len() < 200, "{}", again.opacity.len());
    for i in 0..=2000 {
        let x = f64::from(i) / 10.0;
        let per_two = if x < 100.0 { 0.009 * x } else { 0.9 + 0.001 * (x - 100.0) };
        // Two lengths of the converted opacity are one of the original's.
        let per_one = 1.0 - (1.0f64 - per_two).sqrt();
        let after = again.opacity.partition_point(|p| p.0 <= x).clamp(1, again.opacity.len() - 1);
        let ((x0, a), (x1, b)) = (again.opacity[after - 1], again.opacity[after]);
        let got = a + (b - a) * (x - x0) / (x1 - x0);
        assert!((got - per_one).abs() < 0.001, "{x}: {got}, not {per_one}");
    }
    let (text, lost) = write(&VolumeProperty { opacity_unit: None, ..property }, FileKind::SlicerProperty);
    assert!(text.contains("6 0 0 100 0.9 200 1") && lost.len() == 1 && lost[0].contains("per smallest voxel spacing"), "{text} {lost:?}");
}

#[test]
fn a_volume_property_of_nine_lines_or_eight() {
    let text = "1\n1\n0.9\n0.2\n0.3\n10\n6 -3024 0 67 0.5 3071 0.8\n4 0 1 255 1\n8 -3024 0 0 0 3071 1 1 1\n";
    let c = parsed(FileKind::SlicerProperty, text, None);
    assert_eq!(c.property.opacity, [(-3024.0, 0.0), (67.0, 0.5), (3071.0, 0.8)]);
    assert_eq!(c.property.color, [(-3024.0, [0.0; 3]), (3071.0, [1.0; 3])]);
    assert!(c.property.gradient_opacity.is_empty() && c.warnings.is_empty());
    assert_eq!(c.property.material, Some(Material { ambient: 0.2, diffuse: 0.9, specular: 0.3, shininess: 10.0 }));
    assert_eq!(c.property.opacity_unit, Some(1.0));
    let short = text.replace("4 0 1 255 1\n", "").replace("1\n1\n", "0\r\n0\r\n");
    let c = parsed(FileKind::SlicerProperty, &short, None);
    assert!(c.property.material.is_none() && c.property.gradient_opacity.is_empty());
    assert!(c.warnings.len() == 1 && c.warnings[0].contains("nearest"), "{:?}", c.warnings);
    for line in ["0", ""] {
        assert!(parsed(FileKind::SlicerProperty, &text.replace("4 0 1 255 1", line), None).property.gradient_opacity.is_empty());
    }
    let factor = parsed(FileKind::SlicerProperty, &text.replace("4 0 1 255 1", "4 0 0 255 1"), None).property.gradient_opacity;
    assert_eq!(factor, [(0.0, 0.0), (255.0, 1.0)]);
    // Rounded numbers a hair outside are taken as meant, and a byte order mark is no number.
    let c = parsed(FileKind::SlicerProperty, &format!("\u{feff}{}more\n", text.replace("0.8", "1.0004")), None);
    assert_eq!(c.property.opacity[2].1, 1.0);
    assert!(c.warnings.len() == 1 && c.warnings[0].starts_with("line 10"), "{:?}", c.warnings);
}

#[test]
fn volume_properties_that_are_none() {
    let good = ["1", "1", "0.9", "0.2", "0.3", "10", "4 0 0 10 1", "4 0 1 255 1", "8 0 0 0 0 10 1 1 1"];
    let says = |line: usize, text: &str, want: &str| {
        let mut lines = good;
        lines[line - 1] = text;
        let got = refused(FileKind::SlicerProperty, lines.join("\n").as_bytes(), None);
        assert!(got.contains(want), "{text}: {got}");
    };
    says(1, "one", "line 1: interpolation: \"one\" is no number");
    says(2, "1 1", "line 2: shade is one number");
    says(3, "nan", "line 3: diffuse: \"nan\" is not finite");
    says(4, "-1", "ambient -1: must not be negative");
    says(7, "5 0 0 10 1", "line 7: scalar opacity: 5 numbers are announced and 4 follow");
    says(7, "99999999999999999999 0 0", "the count \"99999999999999999999\" is no whole number");
    says(7, "18446744073709551615 0 0", "18446744073709551615 numbers are announced and 2 follow");
    says(7, "-4 0 0 10 1", "the count \"-4\" is no whole number");
    says(7, "3 0 0 10", "3 numbers are not a multiple of 2");
    says(7, "4 10 0 0 1", "0 comes after 10; points must rise");
    says(7, "4 0 0 1e999 1", "\"1e999\" is not finite");
    says(7, "4 0 0 10 2", "2 at 10 is outside [0,1]");
    says(7, "0", "line 7: scalar opacity: no points");
    says(7, "", "line 7: scalar opacity: no points");
    says(8, "2 0 -0.5", "line 8: gradient opacity: -0.5 at 0 is outside [0,1]");
    says(8, "4 -3 0 1 1", "line 8: gradient opacity: the magnitude -3 is negative");
    says(9, "0", "line 9: colour: no points");
    says(9, "4 0 0 0 7", "line 9: colour: 7 at 0 is outside [0,1]");
    says(9, "6 0 0 0 0 1 1", "line 9: colour: 6 numbers are not a multiple of 4");
    let bad = |bytes: &[u8]| refused(FileKind::SlicerProperty, bytes, None);
    assert!(bad(b"").contains("before interpolation"));
    assert!(bad(b"1\n1\n0\n0\n0\n0\n").contains("before scalar opacity"));
    assert!(bad(b"1\n1\n0\n0\n0\n0\n2 0 1\n").contains("before colour"));
    assert!(bad(b"1\n\xff").contains("byte 2 is no text"));
    let long = format!("1\n1\n0\n0\n0\n1\n{}{}", 2 * (MAX_POINTS + 1), " 0 0".repeat(MAX_POINTS + 1));
    assert!(bad(format!("{long}\n4 0 1 1 1\n4 0 0 0 0").as_bytes()).contains("65537 points are over the limit of 65536"));
    let line = refused(FileKind::SlicerProperty, good.join("\n").as_bytes(), Some("Bone"));
    assert!(line.contains("leave the name \"Bone\" out"), "{line}");
    let mut huge = good.join("\n").into_bytes();
    huge.resize(MAX_BYTES as usize + 1, b'\n');
    assert!(bad(&huge).contains("longer than the 16777216 bytes"));
}

const PRESETS: &str = r#"<?xml version="1.0"?>
<MRML version="x" userTags="">
 <VolumeProperty id="v1" name="One" hideFromEditors="true" shade="1" ambient="0.1" diffuse="0.9" specular="0.2" specularPower="10"
  effectiveRange="0 1" scalarOpacity="4 0 0 100 0.5" gradientOpacity="4 0 1 255 1" colorTransfer="8 0 0 0 0 100 1 1 1" interpolation="1"/>
 <View/>
 <VolumeProperty name="Two" scalarOpacity="2 7 1" colorTransfer="4 7 0.5 0.5 0.5" scalarOpacityUnitDistance="0.5"></VolumeProperty>
</MRML>"#;

#[test]
fn presets_are_chosen_by_name() {
    let one = parsed(FileKind::SlicerPresets, PRESETS, Some("One")).property;
    assert_eq!((one.name.as_str(), one.opacity.len(), one.opacity_unit), ("One", 2, Some(1.0)));
    assert_eq!(one.material, Some(Material { ambient: 0.1, diffuse: 0.9, specular: 0.2, shininess: 10.0 }));
    let two = parsed(FileKind::SlicerPresets, PRESETS, Some("Two")).property;
    assert_eq!((two.material, two.opacity_unit, two.color[0]), (None, Some(0.5), (7.0, [0.5; 3])));
    let bad = |text: &str, name| refused(FileKind::SlicerPresets, text.as_bytes(), name);
    assert_eq!(bad(PRESETS, None), "holds 2 transfer functions, name one of them: One, Two");
    assert_eq!(bad(PRESETS, Some("Three")), "holds no \"Three\"; there are One, Two");
    assert!(bad("<MRML/>", None).contains("no element VolumeProperty"));
    assert!(bad("<MRML>", None).starts_with("not XML"));
    assert!(bad("not at all", None).starts_with("not XML"));
    assert!(bad(&PRESETS.replace("scalarOpacity=\"2 7 1\"", ""), Some("Two")).contains("line 6: the attribute scalarOpacity is missing"));
    assert!(bad(&PRESETS.replace("2 7 1", "3 7 1"), Some("Two")).contains("line 6: scalarOpacity: 3 numbers are announced and 2 follow"));
    assert!(bad(&PRESETS.replace("=\"0.5\"", "=\"0\""), Some("Two")).contains("must be positive"));
    assert!(bad(&PRESETS.replace("4 7 0.5", "4 7 5"), Some("Two")).contains("colorTransfer: 5 at 7 is outside"));
    // Entities that unfold to gigabytes are no way in: a DTD is refused.
    let bomb = "<!DOCTYPE a [<!ENTITY b \"bbbb\">]><MRML>&b;</MRML>";
    assert!(bad(bomb, None).contains("DTD"), "{}", bad(bomb, None));
    let many: String = (0..500).map(|i| format!("<VolumeProperty name=\"preset {i}\"/>")).collect();
    let line = parse(format!("<a>{many}</a>").as_bytes(), Path::new("a"), FileKind::SlicerPresets, None).expect_err("no name").to_string();
    assert!(line.ends_with("and 440 more"), "{line}");
}

#[test]
fn colour_maps_are_chosen_by_name() {
    let text = r#"[
      {"Name": "Plain", "ColorSpace": "RGB", "NanColor": [1, 1, 0], "RGBPoints": [0, 0, 0, 0, 10, 1, 0.5, 0.25]},
      {"Name": "Curved", "ColorSpace": "Diverging", "Creator": "x", "RGBPoints": [-1, 0.23, 0.3, 0.75, 1, 0.7, 0.02, 0.15],
       "Points": [-1, 0, 0.5, 0, 0, 0.5, 0.25, 0, 1, 1, 0.5, 1, 2, 0.2, 0.5, 0.5, 3, 0.9, 0.5, 0]}]"#;
    let plain = parsed(FileKind::ParaView, text, Some("Plain"));
    assert_eq!(plain.property.color, [(0.0, [0.0; 3]), (10.0, [1.0, 0.5, 0.25])]);
    assert_eq!(plain.property.opacity, [(0.0, 0.0), (10.0, 1.0)]);
    assert!(plain.warnings.len() == 2 && plain.warnings[0].contains("NanColor"), "{:?}", plain.warnings);
    let curved = parsed(FileKind::ParaView, text, Some("Curved"));
    // A midpoint is a point of its own, a sharpness of 1 a step in the middle.
    let want = [(-1.0, 0.0), (0.0, 0.5), (0.25, 0.75), (1.0, 1.0), (1.5, 1.0), (1.5, 0.2), (2.0, 0.2), (3.0, 0.9)];
    assert_eq!(curved.property.opacity, want);
    assert!(curved.warnings.len() == 1 && curved.warnings[0].contains("sharpness between 0 and 1 is left out at 1 points"));
    assert!(curved.property.color.len() > 16);
    // One object without a list around it will do.
    let one = r#"{"RGBPoints": [0, 0, 0, 0, 1, 1, 1, 1], "ColorSpace": "Step", "Points": [0, 0.5, 0.5, 0]}"#;
    assert_eq!(parsed(FileKind::ParaView, one, None).property.color[1], (0.0, [1.0; 3]));
    let bad = |text: &str, name| refused(FileKind::ParaView, text.as_bytes(), name);
    assert_eq!(bad(text, None), "holds 2 transfer functions, name one of them: Plain, Curved");
    assert_eq!(bad(text, Some("plain")), "holds no \"plain\"; there are Plain, Curved");
    assert!(bad("{", None).starts_with("not JSON"));
    assert!(bad("7", None).contains("a list of objects"));
    assert!(bad("[]", None).contains("holds no transfer function"));
    assert!(bad("[7]", None).contains("entry 0 is no object"));
    assert!(
        bad(r#"[{"Name": "a", "IndexedColors": [1, 0, 0]}]"#, None).contains("a: RGBPoints are missing; IndexedColors are for categories")
    );
    assert!(bad(r#"[{"RGBPoints": [0, 0, 0]}]"#, None).contains("3 numbers are not a multiple of 4"));
    assert!(bad(r#"[{"RGBPoints": []}]"#, None).contains("no points"));
    assert!(bad(r#"[{"RGBPoints": "0 1 2 3"}]"#, None).contains("must be a list of numbers"));
    assert!(bad(r#"[{"RGBPoints": [0, null, 0, 0]}]"#, None).contains("entry 1, null, is no number"));
    assert!(bad(r#"[{"RGBPoints": [0, 1e999, 0, 0]}]"#, None).starts_with("not JSON"));
    assert!(bad(&one.replace("Step", "CMYK"), None).contains("ColorSpace \"CMYK\" is unknown"));
    assert!(bad(&one.replace("0.5, 0]", "1.5, 0]"), None).contains("midpoint 1.5"));
    // Deep nesting ends the reading, not the process.
    assert!(bad(&"[".repeat(100_000), None).starts_with("not JSON"));
}

#[test]
fn tables_have_their_columns_in_any_order() {
    let text = "# made by hand\n\nopacity, Value ,red,G,blue\n0,-5,0,0,0\n0.5,3,1,0.5,0.25\n";
    let c = parsed(FileKind::Csv, text, None).property;
    assert_eq!((c.opacity, c.color[1]), (vec![(-5.0, 0.0), (3.0, 0.5)], (3.0, [1.0, 0.5, 0.25])));
    let bad = |text: &str| refused(FileKind::Csv, text.as_bytes(), None);
    assert!(bad("").contains("an empty table"));
    assert!(bad("value,r,g,b\n").contains("line 1: no column opacity"));
    assert!(bad("0,0,0,0,0\n").contains("line 1: no column value"));
    assert!(bad("value,r,g,b,opacity\n").contains("no points"));
    assert!(bad("value,r,g,b,opacity\n1,2\n").contains("line 2: 2 columns, where the first line has 5"));
    assert!(bad("value,r,g,b,opacity\n0,0,0,x,1\n").contains("line 2: b: \"x\" is no number"));
    assert!(bad("value,r,g,b,opacity\n0,0,0,0,1\n-1,0,0,0,1\n").contains("-1 comes after 0"));
    assert!(bad("value,r,g,b,opacity\n0,0,0,0,1.5\n").contains("opacity: 1.5 at 0 is outside [0,1]"));
    assert!(bad("value,r,g,b,opacity\ninf,0,0,0,1\n").contains("is not finite"));
    let long = "value,r,g,b,opacity\n".to_owned() + &"0,0,0,0,0\n".repeat(MAX_POINTS + 1);
    assert!(bad(&long).contains("more than the limit of 65536 points"));
    let line = refused(FileKind::Csv, b"value,r,g,b,opacity\n0,0,0,0,0", Some("x"));
    assert!(line.contains("without a name"), "{line}");
}

#[test]
fn extensions_tell_the_kind() {
    assert_eq!(FileKind::of_path(Path::new("a/B.VP")), Some(FileKind::SlicerProperty));
    assert_eq!(FileKind::of_path(Path::new("a.toml")), None);
    let line = read(Path::new("a.tf"), None).expect_err("unknown").to_string();
    assert!(line.starts_with("a.tf: the extension tells no kind"), "{line}");
    assert!(read(Path::new("/nowhere/a.vp"), None).is_err_and(|e| e.to_string().starts_with("/nowhere/a.vp: ")));
    assert!(is_paraview(b" [{}]") && is_paraview(b"{\"RGBPoints\": []}") && !is_paraview(b"{\"transfer\": {}}"));
}
