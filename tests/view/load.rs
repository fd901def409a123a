//! Clients that stall, vanish or come in crowds, and the end of the server under all of them.

use crate::client::{SCENE, reply, serve};
use serde_json::{Value, json};
use std::io::{Read, Write};
use std::time::{Duration, Instant};

/// A scene whose picture takes very long.
pub(crate) fn endless(document: &Value) -> Value {
    let mut document = document.clone();
    document["slices"] = json!({ "count": 1 << 16, "terminate": 0.0 });
    document["transfer"] = json!({ "color": [[0, 1, 1, 1]], "opacity": [[-1, 1e-9], [2, 1e-9]] });
    document
}

#[test]
fn of_two_hundred_connections_those_beyond_the_limit_are_turned_away_at_once() {
    let (server, client) = serve(SCENE);
    let start = Instant::now();
    let mut all: Vec<_> = (0..200).map(|_| client.connect()).collect();
    let mut turned_away = 0;
    for stream in &mut all {
        stream.set_read_timeout(Some(Duration::from_millis(30))).unwrap();
        let mut some = [0; 12];
        if stream.read_exact(&mut some).is_ok() {
            assert_eq!(&some, b"HTTP/1.1 503");
            turned_away += 1;
        }
    }
    assert_eq!(turned_away, 200 - 64);
    assert!(start.elapsed() < Duration::from_secs(20), "{:?}", start.elapsed());
    // Those that are in are served.
    let first = &mut all[0];
    first.set_read_timeout(Some(Duration::from_secs(20))).unwrap();
    first.write_all(&client.request("open", &json!({}))).unwrap();
    assert_eq!(reply(first).status, 200);
    drop(all);
    std::thread::sleep(Duration::from_millis(300));
    client.lives();
    server.stop();
}

#[test]
fn a_reader_that_stalls_costs_the_others_nothing_and_is_dropped() {
    let (server, client) = serve(SCENE);
    let (document, _) = client.open();
    let mut stalled = client.connect();
    // Sixteen times as many bytes as fit between the two.
    let wanted = json!({ "document": document, "width": 2048, "height": 2048, "format": "npy" });
    stalled.write_all(&client.request("save", &wanted)).unwrap();
    let start = Instant::now();
    let mut first = [0; 1];
    stalled.read_exact(&mut first).unwrap();
    for seq in 1..20 {
        let reply = client.frame("other", seq, &document, [64, 64], true);
        assert_eq!(reply.status, 200);
    }
    client.lives();
    std::thread::sleep(Duration::from_secs(12));
    let mut rest = Vec::new();
    let _ = stalled.read_to_end(&mut rest);
    assert!(rest.len() < 2048 * 2048 * 16, "all of it was written to somebody who read nothing for {:?}", start.elapsed());
    client.lives();
    server.stop();
}

#[test]
fn whoever_vanishes_is_worked_for_no_longer() {
    let (server, client) = serve(SCENE);
    let (document, _) = client.open();
    // Pixels are probed one after the other: the second waits for as long as the first takes.
    let mut slow = endless(&document);
    slow["render"] = json!({ "algorithm": "rays" });
    let ask =
        |document: &Value| client.request("probe", &json!({ "document": document, "width": 1024, "height": 1024, "x": 500, "y": 500 }));
    let mut gone = client.connect();
    gone.write_all(&ask(&slow)).unwrap();
    std::thread::sleep(Duration::from_millis(300));
    let mut waiting = client.connect();
    waiting.write_all(&ask(&document)).unwrap();
    waiting.set_read_timeout(Some(Duration::from_millis(500))).unwrap();
    assert!(waiting.read(&mut [0; 1]).is_err(), "the first request was no long one");
    drop(gone);
    let start = Instant::now();
    waiting.set_read_timeout(Some(Duration::from_secs(60))).unwrap();
    assert_eq!(reply(&mut waiting).status, 200);
    assert!(start.elapsed() < Duration::from_secs(1), "{:?}", start.elapsed());
    // A frame that nobody waits for any more leaves the renderer to the next.
    let frame = |seq: u64, document: &Value| {
        client.request("frame", &json!({ "client": "a", "seq": seq, "document": document, "width": 1024, "height": 1024 }))
    };
    let mut gone = client.connect();
    gone.write_all(&frame(7, &endless(&document))).unwrap();
    std::thread::sleep(Duration::from_millis(300));
    drop(gone);
    std::thread::sleep(Duration::from_millis(300));
    assert_eq!(client.frame("a", 8, &document, [64, 64], false).status, 200);
    server.stop();
}

#[test]
fn the_server_ends_at_once_whatever_it_does() {
    let (server, client) = serve(SCENE);
    let (document, _) = client.open();
    let mut busy = client.connect();
    let wanted = json!({ "client": "a", "seq": 1, "document": endless(&document), "width": 1024, "height": 1024 });
    busy.write_all(&client.request("frame", &wanted)).unwrap();
    let idle = client.connect();
    std::thread::sleep(Duration::from_millis(300));
    let start = Instant::now();
    server.stop();
    assert!(start.elapsed() < Duration::from_millis(200), "{:?}", start.elapsed());
    let mut rest = Vec::new();
    let _ = busy.read_to_end(&mut rest);
    assert!(rest.is_empty() || rest.starts_with(b"HTTP/1.1 409"), "{}", String::from_utf8_lossy(&rest));
    drop(idle);
    assert!(std::net::TcpStream::connect(("127.0.0.1", client.port)).is_err());
}
