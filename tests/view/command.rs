//! `slicestack view` as a user meets it: the address, the way it ends, and the command line that it tells.

use crate::client::Client;
use serde_json::{Value, json};
use std::io::{BufRead, BufReader, Read};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

const PROGRAM: &str = env!("CARGO_BIN_EXE_slicestack");

/// A running view, ended when dropped.
struct View {
    child: Child,
    client: Client,
}

impl View {
    fn new(dir: &Path, arguments: &[&str]) -> Self {
        let mut child = Command::new(PROGRAM)
            .args(["view", "--no-browser"])
            .args(arguments)
            .current_dir(dir)
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        let mut line = String::new();
        BufReader::new(child.stdout.as_mut().unwrap()).read_line(&mut line).unwrap();
        if line.is_empty() {
            let mut told = String::new();
            child.stderr.take().unwrap().read_to_string(&mut told).unwrap();
            panic!("{arguments:?}: {told}");
        }
        Self { client: Client::of(line.trim_end()), child }
    }
}

impl Drop for View {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

const SMALL: [&str; 8] = ["--volume.phantom", "shepp-logan", "--volume.size", "24", "--size", "48x40", "--count", "40"];

#[test]
fn the_command_line_that_is_told_makes_the_picture() {
    let dir = tempfile::tempdir().unwrap();
    std::fs::write(
        dir.path().join("a scene.toml"),
        "[volume]\nphantom = \"shepp-logan\"\nsize = 24\n[fog]\nmode = \"exp\"\ndensity = 0.4\n[slices]\ncount = 40\n",
    )
    .unwrap();
    for arguments in
        [SMALL.to_vec(), [&SMALL[..], &["--azimuth", "-38", "--preset=hot-ramp"]].concat(), vec!["a scene.toml", "--threads", "2"]]
    {
        let view = View::new(dir.path(), &arguments);
        let (document, size) = view.client.open();
        let mut turned = document.clone();
        turned["camera"] =
            json!({ "eye": [3.0, -4.0, 1.5], "target": [0, 0, 0], "up": [0, 0, 1], "projection": "perspective", "fov_y": 30 });
        let mut cut = turned.clone();
        cut["clip"] = json!([{ "normal": [1, 0, 0], "offset": -0.1 }]);
        cut["image"]["background"] = json!([0, 0.5, 1, 1]);
        cut["light"] = json!({ "ambient": 0.4, "direction": [1, -2, 0.5] });
        let mut colored = document.clone();
        colored["transfer"] = json!({ "color": [[0, 1, 0, 0], [1, 0, 0, 1]], "opacity": [[0, 0], [1, 0.5]] });
        colored["annotate"] = json!({ "axes": true, "title": "It's a head" });
        for (seq, document, size) in [(1, &document, size), (2, &turned, size), (3, &cut, [64, 50]), (4, &colored, size)] {
            let told = view.client.ask("command", &json!({ "document": document, "width": size[0], "height": size[1] }));
            assert_eq!((told["complete"].as_bool(), &told["note"]), (Some(true), &Value::Null), "{told}");
            let line = told["command"].as_str().unwrap().replacen("slicestack", PROGRAM, 1) + " --no-metadata -o out.png";
            let out = Command::new("sh").args(["-c", &line]).current_dir(dir.path()).output().unwrap();
            assert!(out.status.success(), "{line}: {}", String::from_utf8_lossy(&out.stderr));
            let frame = view.client.frame("a", seq, document, size, false);
            assert!(std::fs::read(dir.path().join("out.png")).unwrap() == frame.body, "{line}");
        }
    }
}

#[test]
fn what_flags_cannot_say_is_told() {
    let dir = tempfile::tempdir().unwrap();
    std::fs::write(
        dir.path().join("cut.toml"),
        "[volume]\nphantom = \"shepp-logan\"\nsize = 16\n[slices]\ncount = 20\n[[clip]]\nnormal = [1, 0, 0]\noffset = 0\n",
    )
    .unwrap();
    let view = View::new(dir.path(), &["cut.toml"]);
    let (mut document, size) = view.client.open();
    document.as_object_mut().unwrap().remove("clip");
    let told = view.client.ask("command", &json!({ "document": document, "width": size[0], "height": size[1] }));
    assert_eq!(told["complete"], false);
    assert!(told["note"].as_str().unwrap().contains("save the scene"), "{told}");
}

#[test]
fn a_saved_scene_rendered_by_the_command_is_the_still_frame() {
    let dir = tempfile::tempdir().unwrap();
    let view = View::new(dir.path(), &SMALL);
    let (document, size) = view.client.open();
    let ask = json!({ "document": document, "width": size[0], "height": size[1], "format": "toml" });
    std::fs::write(dir.path().join("saved.toml"), view.client.post("save", &ask).body).unwrap();
    let out =
        Command::new(PROGRAM).args(["render", "saved.toml", "--no-metadata", "-o", "out.png"]).current_dir(dir.path()).output().unwrap();
    assert!(out.status.success(), "{}", String::from_utf8_lossy(&out.stderr));
    assert!(std::fs::read(dir.path().join("out.png")).unwrap() == view.client.frame("a", 1, &document, size, false).body);
}

#[test]
fn a_port_that_is_taken_is_one_clear_line() {
    let dir = tempfile::tempdir().unwrap();
    let view = View::new(dir.path(), &SMALL);
    let port = view.client.port.to_string();
    let out = Command::new(PROGRAM).args(["view", "--no-browser", "--port", &port]).args(SMALL).output().unwrap();
    let told = String::from_utf8(out.stderr).unwrap();
    assert_eq!((out.status.code(), told.lines().count()), (Some(1), 1), "{told}");
    assert!(told.starts_with(&format!("error: view: port {port}: ")) && out.stdout.is_empty(), "{told}");
}

#[test]
#[cfg(unix)]
fn a_signal_ends_it_at_once() {
    let dir = tempfile::tempdir().unwrap();
    for signal in ["INT", "TERM"] {
        let mut view = View::new(dir.path(), &SMALL);
        let idle = view.client.connect();
        let start = Instant::now();
        assert!(Command::new("kill").args([format!("-{signal}"), view.child.id().to_string()]).status().unwrap().success());
        let status = view.child.wait().unwrap();
        assert!(start.elapsed() < Duration::from_millis(400), "{:?}", start.elapsed());
        assert!(!status.success());
        drop(idle);
    }
}

#[test]
fn views_without_an_export_are_wrong_usage() {
    let done = Command::new(PROGRAM).args(["view", "--no-browser", "--views", "8x3"]).output().unwrap();
    assert_eq!(done.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&done.stderr).contains("--export"));
}
