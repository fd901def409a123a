//! A view that is turned for long takes no more memory than one that has just begun. Alone in its process: it measures the whole of it.

#![cfg(target_os = "linux")]
#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use serde_json::{Value, json};
use slicestack::scene::{Overrides, SceneFile};
use slicestack::view::Server;
use slicestack::{Limits, Settings};
use std::io::{Read, Write};
use std::net::TcpStream;

const SCENE: &str = "
[volume]
phantom = \"shepp-logan\"
size = 32
[slices]
count = 64
[render]
blend = \"over\"
";

/// Bytes of this process in memory now.
fn resident() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap();
    let line = status.lines().find(|l| l.starts_with("VmRSS:")).unwrap();
    line.split_whitespace().nth(1).unwrap().parse::<u64>().unwrap() * 1024
}

/// One request over a connection that stays; status and body.
fn ask(stream: &mut TcpStream, (port, token): (u16, &str), what: &str, body: &Value) -> (String, Vec<u8>) {
    let body = body.to_string();
    let head = format!(
        "POST /api/{what} HTTP/1.1\r\nHost: 127.0.0.1:{port}\r\nX-Slicestack-Token: {token}\r\nContent-Type: application/json\r\n\
         Content-Length: {}\r\n\r\n",
        body.len()
    );
    stream.write_all((head + &body).as_bytes()).unwrap();
    let mut head = Vec::new();
    while !head.ends_with(b"\r\n\r\n") {
        let mut byte = [0];
        stream.read_exact(&mut byte).unwrap();
        head.push(byte[0]);
    }
    let head = String::from_utf8(head).unwrap();
    let length = head.lines().find_map(|l| l.strip_prefix("Content-Length: ")).unwrap().parse().unwrap();
    let mut body = vec![0; length];
    stream.read_exact(&mut body).unwrap();
    (head.split(' ').nth(1).unwrap().to_owned(), body)
}

#[test]
fn two_thousand_frames_take_no_more_memory_than_three_hundred() {
    let file = SceneFile::parse(SCENE, "", &Overrides::default()).unwrap();
    let volume = file.volume().load(&Limits::default()).unwrap();
    let server = Server::builder(file, volume).settings(Settings::new().threads(2)).start().unwrap();
    let url = server.url();
    let me = (server.port(), url.split_once('#').unwrap().1);
    let mut stream = TcpStream::connect(("127.0.0.1", me.0)).unwrap();
    let opened: Value = serde_json::from_slice(&ask(&mut stream, me, "open", &json!({})).1).unwrap();
    let mut document = opened["document"].clone();
    let mut before = 0;
    for n in 0..2000 {
        // A hand that turns, pages that come and go, a transfer function that changes, and now and then a rest.
        document["camera"] = json!({ "azimuth": n % 360, "elevation": n % 90 });
        document["transfer"]["opacity"] = json!([[0, 0], [1, 0.1 + f64::from(n % 97) * 0.005]]);
        let frame = json!({ "client": format!("page-{}", n / 50), "seq": n, "document": document, "width": 96, "height": 96, "moving": n % 10 != 9 });
        assert_eq!(ask(&mut stream, me, "frame", &frame).0, "200");
        if n % 100 == 50 {
            let probe = json!({ "document": document, "width": 96, "height": 96, "x": 48, "y": 48 });
            assert_eq!(ask(&mut stream, me, "probe", &probe).0, "200");
        }
        if n == 300 {
            before = resident();
        }
    }
    let grown = resident().saturating_sub(before);
    assert!(grown < 24 << 20, "{grown} bytes more after 2000 frames than after 300");
    server.stop();
}
