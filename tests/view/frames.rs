//! Frames: the latest request wins, pages do not disturb each other, and a still frame is the picture that the command makes.

use crate::client::{SCENE, rendered, serve};
use crate::load::endless;
use serde_json::{Value, json};
use slicestack::Picture;
use std::time::{Duration, Instant};

#[test]
fn a_later_request_stops_the_frame_in_the_making() {
    let (server, client) = serve(SCENE);
    let (document, size) = client.open();
    std::thread::scope(|scope| {
        let endless = endless(&document);
        let client = &client;
        let first = scope.spawn(move || (client.frame("a", 5, &endless, [1024, 1024], false), Instant::now()));
        std::thread::sleep(Duration::from_millis(400));
        assert!(!first.is_finished());
        let start = Instant::now();
        assert_eq!(client.frame("a", 6, &document, size, true).status, 200);
        let (stopped, at) = first.join().unwrap();
        assert_eq!(stopped.status, 409, "{}", stopped.text());
        assert!(at - start < Duration::from_millis(200), "{:?}", at - start);
    });
    // One that comes too late is not begun.
    let start = Instant::now();
    assert_eq!(client.frame("a", 3, &endless(&document), [1024, 1024], false).status, 409);
    assert!(start.elapsed() < Duration::from_millis(200));
    // The stop was for that frame alone.
    assert_eq!(client.frame("a", 7, &document, size, false).status, 200);
    server.stop();
}

#[test]
fn of_many_waiting_requests_only_the_latest_is_made() {
    let (server, client) = serve(SCENE);
    let (document, size) = client.open();
    let statuses: Vec<u16> = std::thread::scope(|scope| {
        let (client, document, endless) = (&client, &document, endless(&document));
        let mut all: Vec<_> = (1..9)
            .map(|seq| {
                let endless = endless.clone();
                let asking = scope.spawn(move || client.frame("a", seq, &endless, [1024, 1024], false).status);
                std::thread::sleep(Duration::from_millis(60));
                asking
            })
            .collect();
        all.push(scope.spawn(move || client.frame("a", 9, document, size, false).status));
        all.into_iter().map(|asking| asking.join().unwrap()).collect()
    });
    assert_eq!(statuses, [vec![409; 8], vec![200]].concat());
    server.stop();
}

#[test]
fn pages_get_each_their_own_pictures() {
    let (server, client) = serve(SCENE);
    let (document, size) = client.open();
    // More pages than renderers are kept.
    let pages: Vec<(String, Value, Vec<u8>)> = (0..6)
        .map(|n| {
            let mut document = document.clone();
            document["image"]["background"] = json!([f64::from(n) / 8.0, 0.5, 0.5, 1]);
            document["camera"] = json!({ "azimuth": 20 * n, "elevation": 10 });
            let wanted = json!({ "document": document, "width": size[0], "height": size[1], "format": "toml" });
            let saved = client.post("save", &wanted).text();
            (format!("page {n}").replace(' ', "-"), document, rendered(&saved))
        })
        .collect();
    std::thread::scope(|scope| {
        for (name, document, expected) in &pages {
            let client = &client;
            scope.spawn(move || {
                for seq in 0..8 {
                    let reply = client.frame(name, seq, document, size, seq % 4 < 2);
                    // Of more pages than are kept, one may have to make room.
                    assert!(matches!(reply.status, 200 | 409), "{}", reply.text());
                    if reply.status == 200 && seq % 4 >= 2 {
                        assert!(reply.body == *expected, "{name}, frame {seq}");
                    }
                }
            });
        }
    });
    for (name, document, expected) in &pages {
        assert!(client.frame(name, 100, document, size, false).body == *expected, "{name}");
        assert_eq!(client.post("close", &json!({ "client": name })).status, 204);
    }
    server.stop();
}

#[test]
fn a_still_frame_is_the_picture_of_the_saved_scene() {
    let head = "[volume]\nphantom = \"shepp-logan\"\nsize = 40\n";
    let scenes = [
        "[slices]\ncount = 77\n",
        "[slices]\ntolerance = 0.01\n",
        "[slices]\nspacing = 0.01\n[camera]\nprojection = \"perspective\"\nfov_y = 30\nazimuth = 50\n",
        "[fog]\nmode = \"exp\"\ndensity = 0.5\ncolor = [1, 0, 0]\n[light]\nambient = 0.4\n",
        "[render]\nblend = \"mip\"\n",
        "[render]\nblend = \"iso\"\nlevel = 0.25\n",
        "[render]\nalgorithm = \"rays\"\n[slices]\ncount = 60\n",
        "[annotate]\naxes = true\nscale_bar = true\ntitle = \"A head\"\n[image]\nbackground = [1, 1, 1, 1]\n",
        "[[clip]]\nnormal = [1, 0, 0]\noffset = 0\n[slices]\ncount = 50\n[transfer]\npreset = \"hot-ramp\"\n",
    ];
    for text in scenes {
        let (server, client) = serve(&format!("{head}{text}"));
        let (document, _) = client.open();
        for (seq, size) in [(1, [90, 70]), (2, [33, 64])] {
            let frame = client.frame("a", seq, &document, size, false);
            assert_eq!((frame.status, frame.header("Content-Type")), (200, Some("image/png")), "{text}: {}", frame.text());
            let told = frame.told();
            assert_eq!(
                (told["width"].as_u64(), told["height"].as_u64(), told["final"].as_bool()),
                (Some(size[0]), Some(size[1]), Some(true))
            );
            for format in ["toml", "json"] {
                let wanted = json!({ "document": document, "width": size[0], "height": size[1], "format": format });
                let saved = client.post("save", &wanted);
                assert_eq!(saved.header("X-Name"), Some(format!("shepp-logan.{format}").as_str()));
                assert!(rendered(&saved.text()) == frame.body, "{text} at {size:?}, saved as {format}");
            }
        }
        server.stop();
    }
}

#[test]
fn moving_frames_are_coarse_and_say_so() {
    let (server, client) = serve(&SCENE.replace("size = 48", "size = 96").replace("count = 90", "count = 2000"));
    let (document, _) = client.open();
    let size = [700, 500];
    let told = (1..12).map(|seq| client.frame("a", seq, &document, size, true)).fold(None, |_, told| Some(told)).unwrap();
    let info = told.told();
    assert_eq!((info["seq"].as_u64(), info["final"].as_bool()), (Some(11), Some(false)));
    let slices = info["slices"].as_u64().unwrap();
    assert!((64..2000).contains(&slices), "{slices} slices");
    let shown = Picture::decode(&told.body, "frame").unwrap();
    assert_eq!((Some(u64::from(shown.width())), Some(u64::from(shown.height()))), (info["width"].as_u64(), info["height"].as_u64()));
    // A projection keeps its slices.
    let mut mip = document.clone();
    mip["render"]["blend"] = "mip".into();
    mip["slices"] = json!({ "count": 300 });
    assert_eq!(client.frame("a", 20, &mip, size, true).told()["slices"].as_u64(), Some(300));
    // On thin links.
    let ask = json!({ "client": "b", "seq": 1, "document": document, "width": 64, "height": 64, "moving": true, "encoding": "jpeg" });
    let jpeg = client.post("frame", &ask);
    assert_eq!(jpeg.header("Content-Type"), Some("image/jpeg"));
    assert!(jpeg.body.starts_with(b"\xff\xd8\xff"));
    server.stop();
}

#[test]
fn moving_frames_carry_no_letters_and_still_ones_do() {
    let (server, client) = serve(SCENE);
    let (document, size) = client.open();
    let mut titled = document.clone();
    titled["annotate"] = json!({ "title": "A head", "axes": true });
    // The same level of quality: neither has been measured yet.
    let moving = |name: &str, document: &Value| Picture::decode(&client.frame(name, 1, document, size, true).body, "a.png").unwrap();
    assert_eq!(moving("a", &titled).to_rgba8(), moving("b", &document).to_rgba8());
    assert!(client.frame("a", 2, &titled, size, false).body != client.frame("b", 2, &document, size, false).body);
    server.stop();
}
