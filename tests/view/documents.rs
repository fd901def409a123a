//! Documents: what the page is told and sends back; no file is ever named by it.

use crate::client::{Client, SCENE, rendered, serve};
use serde_json::{Value, json};
use slicestack::volume::io::{Writing, write};
use slicestack::volume::phantom::Phantom;
use slicestack::volume::{Grid, Segment, Voxels};
use slicestack::{Volume, view::Server};

fn text_of(value: &Value) -> String {
    value.to_string()
}

#[test]
fn a_page_is_told_all_that_it_shows() {
    let (server, client) = serve(SCENE);
    let opened = client.ask("open", &json!({}));
    assert_eq!(opened["size"], json!([96, 80]));
    assert_eq!(opened["volume"]["dims"], json!([48, 48, 48]));
    assert_eq!(opened["volume"]["kind"], "values");
    let counts = opened["histogram"]["counts"].as_array().unwrap();
    assert_eq!(counts.iter().map(|n| n.as_u64().unwrap()).sum::<u64>(), 48 * 48 * 48);
    // The map from index to world: the box of cells lies where the grid says.
    let (_, volume) = crate::client::scene(SCENE);
    let at = |p: [f64; 3]| {
        [0, 1, 2].map(|row: usize| {
            let numbers: Vec<f64> =
                opened["volume"]["index_to_world"][row].as_array().unwrap().iter().map(|n| n.as_f64().unwrap()).collect();
            numbers[0] * p[0] + numbers[1] * p[1] + numbers[2] * p[2] + numbers[3]
        })
    };
    let low: Vec<f64> = opened["volume"]["box"]["low"].as_array().unwrap().iter().map(|n| n.as_f64().unwrap()).collect();
    let corner = volume.grid().corners()[0].to_array();
    assert!(at([low[0], low[1], low[2]]).iter().zip(corner).all(|(a, b)| (a - b).abs() < 1e-9), "{low:?} is not at {corner:?}");
    assert!(opened["choices"]["render.blend"].as_array().unwrap().contains(&json!("mip")));
    assert!(opened["about"]["fog.density"].as_str().unwrap().len() > 10);
    let presets = opened["presets"].as_array().unwrap();
    assert!(presets.iter().any(|p| p["fits"] == true) && presets.iter().any(|p| p["fits"] == false && p["why"].is_string()));
    assert!(opened["document"].get("volume").is_none());
    assert_eq!(opened["title"], "shepp-logan (built-in volume)");
    // A window for slices: of values that are no Hounsfield units 1 to 99.5 %.
    let window = &opened["windows"][0];
    let (low, high) = (volume.statistics().percentile(0.01), volume.statistics().percentile(0.995));
    let (center, width) = (window["center"].as_f64().unwrap(), window["width"].as_f64().unwrap());
    assert!((center - 0.5 * (low + high)).abs() < 1e-9 && (width - (high - low)).abs() < 1e-9, "{window}");
    let blend = |name: &str| presets.iter().find(|p| p["name"] == name).unwrap()["blend"].clone();
    assert_eq!((blend("ct-mip"), blend("ct-bone")), (json!("mip"), Value::Null));
    assert_eq!(client.post("here", &json!({})).status, 204);
    server.stop();
}

#[test]
fn documents_that_name_files_are_refused() {
    let (server, client) = serve(SCENE);
    let (document, size) = client.open();
    let before = client.frame("a", 1, &document, size, false).body;
    for (section, keys) in [
        ("transfer", json!({ "file": "/etc/passwd" })),
        ("labels", json!({ "path": "/etc/passwd" })),
        ("labels", json!({ "segment": [{ "value": 1, "path": "/etc/passwd" }] })),
        ("region", json!([{ "file": "/etc/passwd" }])),
        ("image", json!({ "layers": "*.png" })),
    ] {
        let mut named = document.clone();
        named[section] = keys;
        for what in ["frame", "document", "save", "probe", "command", "thumbnail", "preset"] {
            let ask = json!({ "client": "a", "seq": 2, "document": named, "width": 9, "height": 9, "x": 1, "y": 1, "format": "toml",
                              "preset": "hot-ramp", "size": 9 });
            let reply = client.post(what, &ask);
            // A preset comes in the place of the section transfer.
            if section == "transfer" && matches!(what, "thumbnail" | "preset") {
                assert!(!reply.text().contains("passwd"));
                continue;
            }
            assert_eq!(reply.status, 400, "{what}: {section}");
            assert!(reply.text().contains("the page can name no file"), "{what}: {section}: {}", reply.text());
        }
    }
    // Another volume is not looked at: the command's is shown.
    let mut other = document.clone();
    other["volume"] = json!({ "path": "/etc/passwd", "phantom": "cloud", "nothing": 1 });
    assert!(client.frame("a", 3, &other, size, false).body == before);
    server.stop();
}

#[test]
fn errors_name_the_key_and_no_line_of_a_text_that_nobody_sees() {
    let (server, client) = serve(SCENE);
    let (document, size) = client.open();
    for (key, section, keys) in [
        ("transfer.opacity", "transfer", json!({ "opacity": [[0, 7]] })),
        ("fog.mode", "fog", json!({ "mode": "thick" })),
        ("slices.count", "slices", json!({ "count": 0 })),
        ("render.blend", "render", json!({ "blend": 5 })),
    ] {
        let mut wrong = document.clone();
        wrong[section] = keys;
        let reply = client.frame("a", 1, &wrong, size, true);
        assert_eq!((reply.status, reply.json()["key"].as_str()), (400, Some(key)), "{}", reply.text());
        assert!(!reply.json()["error"].as_str().unwrap().starts_with("line"), "{}", reply.text());
    }
    server.stop();
}

#[test]
fn what_a_document_comes_to_is_itself() {
    let (server, client) = serve(SCENE);
    let (document, size) = client.open();
    let again = client.ask("document", &json!({ "document": document }));
    assert_eq!(again["document"], document);
    let mut foggy = document.clone();
    foggy["fog"] = json!({ "mode": "exp2" });
    let resolved = client.ask("document", &json!({ "document": foggy }));
    assert!(resolved["document"]["fog"]["density"].as_f64().unwrap() > 0.0, "{}", text_of(&resolved["document"]["fog"]));
    let preset = client.ask("preset", &json!({ "document": document, "preset": "hot-ramp" }));
    let (hot, plain) = (&preset["document"]["transfer"], &document["transfer"]);
    assert!(hot["color"].as_array().unwrap().len() > 2 && hot != plain);
    assert_eq!(preset["document"]["camera"], document["camera"]);
    let picture = client.frame("a", 1, &preset["document"], size, false).body;
    assert!(picture != client.frame("a", 2, &document, size, false).body);
    let small = client.post("thumbnail", &json!({ "document": document, "preset": "hot-ramp", "size": 40 }));
    let decoded = slicestack::Picture::decode(&small.body, "thumbnail").unwrap();
    assert_eq!((decoded.width(), decoded.height()), (40, 40));
    assert!(decoded.pixels().windows(2).any(|pair| pair[0] != pair[1]));
    server.stop();
}

#[test]
fn files_of_the_command_are_shown_and_saved_but_never_told() {
    let dir = tempfile::tempdir().unwrap();
    let secret = dir.path().join("secret-place");
    std::fs::create_dir(&secret).unwrap();
    let volume = Phantom::SheppLogan.volume(24).unwrap();
    write(&volume, secret.join("head.nrrd"), &Writing::default()).unwrap();
    let labels: Vec<u8> = (0..24 * 24 * 24).map(|n| u8::from(n % 24 > 11) * 3).collect();
    let map = Volume::new(Grid::with_spacing([24; 3], volume.grid().spacing()).unwrap(), Voxels::U8(labels.into())).unwrap();
    let map = map.with_grid(volume.grid().clone()).unwrap().with_segments(vec![Segment::new(3, "half")]).unwrap();
    write(&map, secret.join("labels.nrrd"), &Writing::default()).unwrap();
    let text = format!(
        "[volume]\npath = {:?}\n[labels]\npath = {:?}\nsegment = [{{ value = 3, mode = \"tint\", color = [1, 0, 0] }}]\n\
         [transfer]\ncolor = [[0, 1, 1, 1]]\nopacity = [[0, 0], [1, 0.2]]\n[slices]\ncount = 40\n",
        secret.join("head.nrrd"),
        secret.join("labels.nrrd")
    );
    let (server, client): (Server, Client) = serve(&text);
    let opened = client.ask("open", &json!({}));
    assert!(!text_of(&opened).contains("secret-place"), "{}", text_of(&opened));
    assert_eq!(opened["title"], "head.nrrd");
    let (document, size) = (opened["document"].clone(), [40, 40]);
    let frame = client.frame("a", 1, &document, size, false);
    assert_eq!(frame.status, 200, "{}", frame.text());
    let saved = client.post("save", &json!({ "document": document, "width": 40, "height": 40, "format": "toml" }));
    assert_eq!(saved.header("X-Name"), Some("head.toml"));
    let deep = client.post("save", &json!({ "document": document, "width": 8, "height": 8, "format": "png16" }));
    assert_eq!(deep.header("X-Name"), Some("head-16.png"));
    assert!(rendered(&saved.text()) == frame.body);
    // The tint is seen: without it the picture is another.
    let mut plain = document.clone();
    plain["labels"]["segment"] = json!([{ "value": 3, "mode": "show" }]);
    assert!(client.frame("a", 2, &plain, size, false).body != frame.body);
    // The name of the segment under the middle of the right half.
    let probed = client.ask("probe", &json!({ "document": document, "width": 40, "height": 40, "x": 20, "y": 20 }));
    assert!(probed["label"].is_string(), "{probed}");
    server.stop();
}

#[test]
fn saved_pictures_carry_what_verify_needs() {
    use slicestack::picture::Metadata;
    let (server, client) = serve(SCENE);
    let (document, _) = client.open();
    let save = |format: &str| client.post("save", &json!({ "document": document, "width": 40, "height": 30, "format": format })).body;
    let png = save("png");
    let provenance = slicestack::proof::Provenance::read(&Metadata::decode(&png, "a.png").unwrap()).unwrap();
    let shown = slicestack::Picture::decode(&save("npy"), "a.npy").unwrap();
    assert_eq!(provenance.sha256, shown.sha256());
    assert_eq!(slicestack::Picture::decode(&png, "a.png").unwrap().to_rgba8(), shown.to_rgba8());
    assert_eq!(slicestack::Picture::decode(&save("png16"), "b.png").unwrap().to_rgba16(), shown.to_rgba16());
    assert_eq!(slicestack::Picture::decode(&save("exr"), "a.exr").unwrap().pixels(), shown.pixels());
    server.stop();
}

#[test]
fn a_question_is_answered_where_a_request_is_refused() {
    let (server, client) = serve(SCENE);
    let (mut document, _) = client.open();
    document["slices"] = json!({ "tolerance": 0.004 });
    document["render"]["algorithm"] = json!("rays");
    assert_eq!(client.post("document", &json!({ "document": document })).status, 400);
    let told = client.ask("document", &json!({ "document": document, "trial": true }));
    assert_eq!(told["key"], "slices.tolerance");
    assert!(told["error"].as_str().unwrap().contains("render algorithm rays") && told.get("document").is_none(), "{told}");
    document["slices"] = json!({ "count": 512 });
    assert!(client.ask("document", &json!({ "document": document, "trial": true }))["document"].is_object());
    server.stop();
}
