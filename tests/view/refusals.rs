//! Requests that are refused: each with its status, in one line, and the server lives on.

use crate::client::{Client, SCENE, reply, serve};
use serde_json::{Value, json};
use std::io::Write;
use std::time::{Duration, Instant};

/// A request for `path` with `headers` in the place of the good ones named alike, and a body.
fn request(client: &Client, (method, path): (&str, &str), headers: &[(&str, &str)], body: &str) -> Vec<u8> {
    let (host, length) = (format!("127.0.0.1:{}", client.port), body.len().to_string());
    let good = [
        ("Host", host.as_str()),
        ("X-Slicestack-Token", client.token.as_str()),
        ("Content-Type", "application/json"),
        ("Content-Length", length.as_str()),
        ("Connection", "close"),
    ];
    let kept = good.iter().filter(|(name, _)| headers.iter().all(|(other, _)| other != name));
    let lines: String = kept.chain(headers.iter().filter(|(_, value)| !value.is_empty())).map(|(n, v)| format!("{n}: {v}\r\n")).collect();
    format!("{method} {path} HTTP/1.1\r\n{lines}\r\n{body}").into_bytes()
}

#[test]
fn each_wrong_request_has_its_status_and_the_server_lives_on() {
    let (server, client) = serve(SCENE);
    let port = client.port;
    let open = ("POST", "/api/open");
    let wrong_token = format!("{}0", &client.token[..31]).replace("00", "01");
    let other_token = if wrong_token == client.token { "0".repeat(32) } else { wrong_token };
    let (next_port, own) = (format!("127.0.0.1:{}", port.wrapping_add(1)), format!("127.0.0.1:{port}"));
    let far = format!("http://evil.example:{port}");
    let rebound = format!("evil.example:{port}");
    let longer = format!("{own}.evil.example");
    let long = "x".repeat(20 << 10);
    let deep = "[".repeat(100_000);
    let http = |headers: &[(&str, &str)]| request(&client, open, headers, "{}");
    let path = |method, path| request(&client, (method, path), &[], "{}");
    let api = |what: &str, body: &str| request(&client, ("POST", &format!("/api/{what}")), &[], body);
    let frame = |with: Value| {
        let mut body = json!({ "client": "a", "seq": 1, "document": {}, "width": 8, "height": 8 });
        body.as_object_mut().unwrap().extend(with.as_object().unwrap().clone());
        api("frame", &body.to_string())
    };
    let cases: Vec<(&str, u16, Vec<u8>)> = vec![
        ("another Host", 403, http(&[("Host", &rebound)])),
        ("a Host that begins alike", 403, http(&[("Host", &longer)])),
        ("no Host", 403, http(&[("Host", "")])),
        ("another port", 403, http(&[("Host", &next_port)])),
        ("no port", 403, http(&[("Host", "127.0.0.1")])),
        ("another Host for a file", 403, request(&client, ("GET", "/"), &[("Host", &rebound)], "")),
        ("another Origin", 403, http(&[("Origin", &far)])),
        ("an Origin of https", 403, http(&[("Origin", &format!("https://{own}"))])),
        ("no Origin's name", 403, http(&[("Origin", "null")])),
        ("another Origin for a file", 403, request(&client, ("GET", "/"), &[("Origin", &far)], "")),
        ("no token", 403, http(&[("X-Slicestack-Token", "")])),
        ("another token", 403, http(&[("X-Slicestack-Token", &other_token)])),
        ("a short token", 403, http(&[("X-Slicestack-Token", &client.token[..31])])),
        ("GET for work", 405, path("GET", "/api/open")),
        ("PUT for work", 405, path("PUT", "/api/open")),
        ("OPTIONS for work", 405, path("OPTIONS", "/api/open")),
        ("POST for a file", 405, path("POST", "/")),
        ("DELETE of a file", 405, path("DELETE", "/main.js")),
        ("a form", 415, http(&[("Content-Type", "application/x-www-form-urlencoded")])),
        ("plain text", 415, http(&[("Content-Type", "text/plain")])),
        ("no type", 415, http(&[("Content-Type", "")])),
        ("no length", 411, http(&[("Content-Length", "")])),
        ("pieces", 411, http(&[("Transfer-Encoding", "chunked")])),
        ("a long body", 413, http(&[("Content-Length", "4194305")])),
        ("a longer one than numbers", 413, http(&[("Content-Length", "99999999999999999999999")])),
        ("a negative length", 400, http(&[("Content-Length", "-1")])),
        ("two lengths", 400, http(&[("Content-Length", "2\r\nContent-Length: 3")])),
        ("two Hosts", 400, http(&[("Host", &format!("{own}\r\nHost: {rebound}"))])),
        ("a long header", 431, http(&[("X-Long", &long)])),
        ("a long path", 431, path("GET", &format!("/{long}"))),
        ("a header without a colon", 400, b"GET / HTTP/1.1\r\nHost\r\n\r\n".to_vec()),
        ("a space before the colon", 400, http(&[("Content-Length ", "2")])),
        ("no HTTP", 400, b"hello\r\n\r\n".to_vec()),
        ("TLS", 431, [b"\x16\x03\x01".to_vec(), vec![0; 20 << 10]].concat()),
        ("letters of no text", 400, b"GET /\xff HTTP/1.1\r\n\r\n".to_vec()),
        ("HTTP/2", 400, b"PRI * HTTP/2.0\r\n\r\n".to_vec()),
        ("another server's path", 400, path("GET", "http://evil.example/")),
        ("a folder above", 404, path("GET", "/../Cargo.toml")),
        ("a folder above, hidden", 404, path("GET", "/%2e%2e/Cargo.toml")),
        ("a folder above a file", 404, path("GET", "/style.css/../../../../etc/passwd")),
        ("two slashes", 404, path("GET", "//etc/passwd")),
        ("backslashes", 404, path("GET", "/..\\Cargo.toml")),
        ("a file of the source", 404, path("GET", "/server.rs")),
        ("nothing there", 404, path("POST", "/api/nothing")),
        ("no JSON", 400, api("frame", "{")),
        ("deep JSON", 400, api("frame", &deep)),
        ("nothing said", 400, api("frame", "{}")),
        ("no document", 400, frame(json!({ "document": 7 }))),
        ("a negative number", 400, frame(json!({ "seq": -1 }))),
        ("no name", 400, frame(json!({ "client": "" }))),
        ("a long name", 400, frame(json!({ "client": "x".repeat(65) }))),
        ("no pixels", 400, frame(json!({ "width": 0 }))),
        ("a wide picture", 400, frame(json!({ "width": 8193 }))),
        ("a large picture", 400, frame(json!({ "width": 8192, "height": 8192 }))),
        ("too many slices", 400, frame(json!({ "document": { "slices": { "count": 65537 } } }))),
        ("slices too close", 400, frame(json!({ "document": { "slices": { "spacing": 1e-9 } } }))),
        ("an unknown encoding", 400, frame(json!({ "encoding": "gif" }))),
        ("an unknown section", 400, frame(json!({ "document": { "nothing": {} } }))),
        ("an unknown format", 400, api("save", &json!({ "document": {}, "width": 8, "height": 8, "format": "gif" }).to_string())),
        ("an unknown preset", 400, api("preset", &json!({ "document": {}, "preset": "nothing" }).to_string())),
        ("a large small picture", 400, api("thumbnail", &json!({ "document": {}, "preset": "hot-ramp", "size": 513 }).to_string())),
        ("a pixel outside", 400, api("probe", &json!({ "document": {}, "width": 8, "height": 8, "x": 8, "y": 0 }).to_string())),
    ];
    for (what, status, bytes) in cases {
        let reply = client.raw(&bytes);
        assert_eq!(reply.status, status, "{what}: {}", reply.text());
        let told = reply.json()["error"].as_str().unwrap().to_owned();
        assert!(!told.is_empty() && told.lines().count() == 1, "{what}: {told}");
        assert!(!told.contains("Cargo") && !told.contains("root:"), "{what}: {told}");
    }
    client.lives();
    server.stop();
}

#[test]
fn own_names_are_let_through_and_files_are_guarded_by_headers() {
    let (server, client) = serve(SCENE);
    for name in ["127.0.0.1", "localhost", "[::1]"] {
        let host = format!("{name}:{}", client.port);
        let origin = format!("http://{host}");
        let bytes = request(&client, ("POST", "/api/open"), &[("Host", &host), ("Origin", &origin)], "{}");
        assert_eq!(client.raw(&bytes).status, 200, "{name}");
    }
    let page = client.raw(&request(&client, ("GET", "/"), &[("X-Slicestack-Token", "")], ""));
    assert_eq!((page.status, page.header("Content-Type")), (200, Some("text/html; charset=utf-8")));
    let policy = page.header("Content-Security-Policy").unwrap();
    assert!(policy.contains("default-src 'self'") && policy.contains("frame-ancestors 'none'") && !policy.contains("unsafe"), "{policy}");
    for (name, value) in [("X-Content-Type-Options", "nosniff"), ("Cache-Control", "no-store"), ("Referrer-Policy", "no-referrer")] {
        assert_eq!(page.header(name), Some(value));
    }
    assert!(page.text().contains("<title>") && !page.text().contains(&client.token));
    server.stop();
}

#[test]
fn a_notebook_may_frame_the_page_where_the_server_was_told_so() {
    let (file, volume) = crate::client::scene(SCENE);
    let origin = "http://localhost:8888".to_owned();
    let server = slicestack::view::Server::builder(file.clone(), volume.clone()).frame_ancestors(vec![origin.clone()]).start().unwrap();
    let client = Client::of(&server.url());
    let page = client.raw(&request(&client, ("GET", "/"), &[], ""));
    assert!(page.header("Content-Security-Policy").unwrap().ends_with(&format!("frame-ancestors {origin}")));
    server.stop();
    for wrong in ["", "http://a; script-src *", "a\r\nX: y"] {
        let refused = slicestack::view::Server::builder(file.clone(), volume.clone()).frame_ancestors(vec![wrong.to_owned()]).start();
        assert!(refused.err().unwrap().to_string().contains("is no origin"), "{wrong}");
    }
}

#[test]
fn slow_headers_and_bodies_are_told_so() {
    let (server, client) = serve(SCENE);
    let (mut head, mut body) = (client.connect(), client.connect());
    let whole = client.request("open", &json!({}));
    head.write_all(&whole[..40]).unwrap();
    body.write_all(&whole[..whole.len() - 1]).unwrap();
    let start = Instant::now();
    // A letter now and then gains no time.
    for _ in 0..4 {
        std::thread::sleep(Duration::from_secs(1));
        head.write_all(b"x").unwrap();
    }
    client.lives();
    assert_eq!(reply(&mut head).status, 408);
    assert!((4.5..8.0).contains(&start.elapsed().as_secs_f64()), "{:?}", start.elapsed());
    assert_eq!(reply(&mut body).status, 408);
    assert!((9.5..13.0).contains(&start.elapsed().as_secs_f64()), "{:?}", start.elapsed());
    client.lives();
    server.stop();
}
