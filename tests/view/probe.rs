//! The probe against numbers of our own: the value where it says it is, and the sum of the slabs against the pixel.

use crate::client::{Client, scene, serve};
use glam::DVec3;
use serde_json::{Value, json};
use slicestack::scene::{Overrides, SceneFile};
use slicestack::{Limits, Renderer, Settings, Volume};

const HEAD: &str = "
[volume]
phantom = \"shepp-logan\"
size = 40
[image]
width = 60
height = 50
background = [0.2, 0.4, 0.6, 1]
[transfer]
color = [[0, 0.2, 0.1, 0], [0.3, 1, 0.8, 0.5], [1, 1, 1, 1]]
opacity = [[0, 0], [0.1, 0.05], [1, 0.6]]
";

const SIZE: [u32; 2] = [60, 50];
const PIXELS: [[u32; 2]; 5] = [[30, 25], [22, 20], [35, 31], [28, 12], [40, 26]];

fn probe(client: &Client, document: &Value, [x, y]: [u32; 2]) -> Value {
    client.ask("probe", &json!({ "document": document, "width": SIZE[0], "height": SIZE[1], "x": x, "y": y }))
}

fn numbers(value: &Value) -> Vec<f64> {
    value.as_array().unwrap().iter().map(|n| n.as_f64().unwrap()).collect()
}

fn point(value: &Value) -> DVec3 {
    DVec3::from_slice(&numbers(value))
}

/// Trilinear interpolation, written anew: the weighted sum over the eight voxels around.
fn trilinear(volume: &Volume, p: DVec3) -> f64 {
    let dims = volume.grid().dims();
    let mut sum = 0.0;
    for corner in 0..8 {
        let (mut weight, mut voxel) = (1.0, [0; 3]);
        for axis in 0..3 {
            let place = p[axis].clamp(0.0, (dims[axis] - 1) as f64);
            let (low, up) = (place.floor(), corner >> axis & 1 == 1);
            weight *= if up { place - low } else { 1.0 - (place - low) };
            voxel[axis] = (low as usize + usize::from(up)).min(dims[axis] - 1);
        }
        sum += weight * volume.value(voxel);
    }
    sum
}

#[test]
fn what_is_told_of_a_place_is_so() {
    let views = [
        "[slices]\ncount = 120\n",
        "[slices]\ncount = 120\n[camera]\nprojection = \"perspective\"\nfov_y = 40\nazimuth = 60\nelevation = -10\n",
        "[slices]\ntolerance = 0.01\n",
        "[slices]\ncount = 120\n[light]\nambient = 0.5\n[[clip]]\nnormal = [0, 1, 0]\noffset = -0.2\n",
        "[render]\nalgorithm = \"rays\"\n[slices]\ncount = 120\n",
        "[render]\nblend = \"mip\"\n[slices]\ncount = 120\n",
    ];
    let mut places = 0;
    for view in views {
        let (server, client) = serve(&format!("{HEAD}{view}"));
        let (document, _) = client.open();
        let (file, volume) = scene(&format!("{HEAD}{view}"));
        let resolved = file.resolve(&volume).unwrap().scene;
        let camera = resolved.camera().resolve(volume.grid(), SIZE[0], SIZE[1]).unwrap();
        for pixel in PIXELS {
            let found = probe(&client, &document, pixel);
            assert_eq!(found["hit"], true, "{view}: {pixel:?}: {found}");
            let (origin, direction) = camera.ray(f64::from(pixel[0]) + 0.5, f64::from(pixel[1]) + 0.5);
            assert!(
                (point(&found["ray"]["origin"]) - origin).length() < 1e-9
                    && (point(&found["ray"]["direction"]) - direction).length() < 1e-9
            );
            if found["world"].is_null() {
                continue;
            }
            places += 1;
            let world = point(&found["world"]);
            assert!((world - origin).cross(direction).length() < 1e-6, "{view}: {pixel:?}: {world} is not on the ray");
            let voxel = volume.grid().world_to_index().transform_point3(world);
            assert!((voxel - point(&found["voxel"])).length() < 1e-6);
            let value = found["value"].as_f64().unwrap();
            assert!((value - trilinear(&volume, voxel)).abs() < 1e-9, "{view}: {pixel:?}: {value} at {voxel}");
        }
        assert_eq!(probe(&client, &document, [0, 0])["hit"], false);
        server.stop();
    }
    assert!(places >= 25, "{places} places were found");
}

#[test]
fn slabs_of_a_journey_add_up_to_the_pixel() {
    for view in [
        "[slices]\ncount = 150\n",
        "[slices]\ncount = 90\n[light]\nambient = 0.5\n[fog]\nmode = \"exp\"\ndensity = 0.3\ncolor = [1, 1, 1]\n",
    ] {
        let text = format!("{HEAD}{view}");
        let (server, client) = serve(&text);
        let (document, _) = client.open();
        let (file, volume) = scene(&text);
        let resolved = file.resolve(&volume).unwrap().scene;
        let picture = Renderer::new(&volume, Settings::default()).render(&resolved).unwrap().0;
        for pixel in PIXELS {
            let found = probe(&client, &document, pixel);
            let shown = picture.pixel(pixel[0], pixel[1]);
            let told: Vec<f64> = numbers(&found["pixel"]);
            assert!(told.iter().zip(shown).all(|(a, b)| *a as f32 == b), "{view}: {pixel:?}: {told:?} is not {shown:?}");
            let journey = &found["journey"];
            let (depth, opacity, left) = (numbers(&journey["depth"]), numbers(&journey["opacity"]), numbers(&journey["transmittance"]));
            assert!(depth.windows(2).all(|pair| pair[0] < pair[1]) && depth.len() > 10);
            let (mut sum, mut through) = ([0.0; 3], 1.0);
            for (k, alpha) in opacity.iter().enumerate() {
                let color = numbers(&journey["color"][k]);
                (0..3).for_each(|c| sum[c] += through * alpha * color[c]);
                through *= 1.0 - alpha;
                assert!((through - left[k]).abs() < 1e-6, "{view}: {pixel:?}: slab {k}");
            }
            // The background shines through what is left.
            let background = [0.2, 0.4, 0.6];
            for c in 0..3 {
                let whole = sum[c] + through * background[c];
                assert!((whole - f64::from(shown[c])).abs() < 2e-5, "{view}: {pixel:?}: {whole} is not {}", shown[c]);
            }
            // What is seen lies where the light that is left passes a half.
            if let (Some(after), false) = (left.iter().position(|&t| t < 0.5), found["world"].is_null()) {
                let camera = resolved.camera().resolve(volume.grid(), SIZE[0], SIZE[1]).unwrap();
                let (at, spacing) = (camera.depth(point(&found["world"])), depth[1] - depth[0]);
                assert!((at - depth[after]).abs() <= 0.51 * spacing, "{view}: {pixel:?}: {at} is not in the slab at {}", depth[after]);
            }
        }
        server.stop();
    }
}

#[test]
fn projections_are_probed_at_the_value_that_they_show() {
    for (blend, largest) in [("mip", true), ("min", false)] {
        let text = format!("{HEAD}[render]\nblend = \"{blend}\"\n[slices]\ncount = 200\n");
        let (server, client) = serve(&text);
        let (document, _) = client.open();
        let file = SceneFile::parse(&text, "", &Overrides::default()).unwrap();
        let volume = file.volume().load(&Limits::default()).unwrap();
        let camera = file.resolve(&volume).unwrap().scene.camera().resolve(volume.grid(), SIZE[0], SIZE[1]).unwrap();
        let found = probe(&client, &document, PIXELS[0]);
        let (origin, direction) = camera.ray(f64::from(PIXELS[0][0]) + 0.5, f64::from(PIXELS[0][1]) + 0.5);
        let range = numbers(&found["journey"]["depth"]);
        let along = (0..4000).map(|k| {
            let depth = range[0] + (range[range.len() - 1] - range[0]) * f64::from(k) / 3999.0;
            trilinear(&volume, volume.grid().world_to_index().transform_point3(origin + direction * depth))
        });
        let best = if largest { along.fold(f64::MIN, f64::max) } else { along.fold(f64::MAX, f64::min) };
        let value = found["value"].as_f64().unwrap();
        assert!((value - best).abs() < 0.02, "{blend}: {value} is not {best}");
        server.stop();
    }
}
