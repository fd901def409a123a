//! A server of a small scene, and requests written by hand.

use serde_json::{Value, json};
use slicestack::scene::{Overrides, SceneFile};
use slicestack::view::Server;
use slicestack::{Limits, Renderer, Settings, Volume};
use std::io::{Read, Write};
use std::net::TcpStream;
use std::time::Duration;

/// A small scene that shows something.
pub(crate) const SCENE: &str = "
[volume]
phantom = \"shepp-logan\"
size = 48
[image]
width = 96
height = 80
background = [0.1, 0.2, 0.3, 1]
[slices]
count = 90
";

/// Who asks a server.
pub(crate) struct Client {
    pub(crate) port: u16,
    pub(crate) token: String,
}

/// What came back.
#[derive(Debug, Clone)]
pub(crate) struct Reply {
    pub(crate) status: u16,
    head: String,
    pub(crate) body: Vec<u8>,
}

/// The scene of `text`, and its volume.
pub(crate) fn scene(text: &str) -> (SceneFile, Volume) {
    let file = SceneFile::parse(text, "", &Overrides::default()).unwrap();
    let volume = file.volume().load(&Limits::default()).unwrap();
    (file, volume)
}

/// A server of the scene of `text`.
pub(crate) fn serve(text: &str) -> (Server, Client) {
    let (file, volume) = scene(text);
    let server = Server::builder(file, volume).settings(Settings::new().threads(2)).start().unwrap();
    let client = Client::of(&server.url());
    (server, client)
}

/// The picture that the command makes of the scene file `text`, as a PNG without metadata.
pub(crate) fn rendered(text: &str) -> Vec<u8> {
    use slicestack::annotate::annotate;
    use slicestack::picture::{Depth, Format};
    let (file, volume) = scene(text);
    let found = file.resolve(&volume).unwrap();
    let picture = Renderer::new(&volume, Settings::default()).render(&found.scene).unwrap().0;
    let annotated = annotate(&picture, &file.annotations(), &found.scene, &volume).unwrap().0;
    let shown = if file.annotations().any() { annotated } else { picture };
    shown.encode(Format::Png, Depth::Eight).unwrap()
}

impl Client {
    pub(crate) fn of(url: &str) -> Self {
        let (place, token) = url.split_once("/#").unwrap();
        Self { port: place.rsplit(':').next().unwrap().parse().unwrap(), token: token.to_owned() }
    }

    pub(crate) fn connect(&self) -> TcpStream {
        let stream = TcpStream::connect(("127.0.0.1", self.port)).unwrap();
        stream.set_read_timeout(Some(Duration::from_secs(60))).unwrap();
        stream
    }

    /// A good request for `what`.
    pub(crate) fn request(&self, what: &str, body: &Value) -> Vec<u8> {
        let body = body.to_string();
        let Self { port, token } = self;
        format!(
            "POST /api/{what} HTTP/1.1\r\nHost: 127.0.0.1:{port}\r\nOrigin: http://127.0.0.1:{port}\r\nX-Slicestack-Token: {token}\r\n\
             Content-Type: application/json\r\nContent-Length: {}\r\nConnection: close\r\n\r\n{body}",
            body.len()
        )
        .into_bytes()
    }

    /// What comes back to `bytes`, sent as they are.
    pub(crate) fn raw(&self, bytes: &[u8]) -> Reply {
        let mut stream = self.connect();
        // A server that refuses the head need not read the rest.
        let _ = stream.write_all(bytes);
        reply(&mut stream)
    }

    pub(crate) fn post(&self, what: &str, body: &Value) -> Reply {
        self.raw(&self.request(what, body))
    }

    /// The JSON that comes back to a request that is granted.
    pub(crate) fn ask(&self, what: &str, body: &Value) -> Value {
        let reply = self.post(what, body);
        assert_eq!(reply.status, 200, "{what}: {}", reply.text());
        reply.json()
    }

    /// The document that the page begins with, and the picture's size.
    pub(crate) fn open(&self) -> (Value, [u64; 2]) {
        let opened = self.ask("open", &json!({}));
        (opened["document"].clone(), [0, 1].map(|n: usize| opened["size"][n].as_u64().unwrap()))
    }

    /// A frame of `document`.
    pub(crate) fn frame(&self, client: &str, seq: u64, document: &Value, [width, height]: [u64; 2], moving: bool) -> Reply {
        self.post(
            "frame",
            &json!({ "client": client, "seq": seq, "document": document, "width": width, "height": height, "moving": moving }),
        )
    }

    /// That the server lives, and answers in time.
    pub(crate) fn lives(&self) {
        let start = std::time::Instant::now();
        assert_eq!(self.post("open", &json!({})).status, 200);
        assert!(start.elapsed() < Duration::from_secs(3), "{:?}", start.elapsed());
    }
}

impl Reply {
    pub(crate) fn text(&self) -> String {
        String::from_utf8_lossy(&self.body).into_owned()
    }

    pub(crate) fn json(&self) -> Value {
        serde_json::from_slice(&self.body).unwrap()
    }

    pub(crate) fn header(&self, name: &str) -> Option<&str> {
        let named = |line: &'_ str| line.split_once(": ").is_some_and(|(n, _)| n.eq_ignore_ascii_case(name));
        self.head.lines().find(|line| named(line)).and_then(|line| line.split_once(": ")).map(|(_, value)| value)
    }

    /// What the header of a frame says.
    pub(crate) fn told(&self) -> Value {
        serde_json::from_str(self.header("X-Frame").unwrap()).unwrap()
    }
}

/// The reply on a connection that is closed after it.
pub(crate) fn reply(stream: &mut TcpStream) -> Reply {
    let mut all = Vec::new();
    // Whoever has sent too much may be cut off after the reply.
    let _ = stream.read_to_end(&mut all);
    let end = all.windows(4).position(|w| w == b"\r\n\r\n").unwrap_or_else(|| panic!("no reply: {:?}", String::from_utf8_lossy(&all)));
    let head = String::from_utf8(all[..end].to_vec()).unwrap();
    let status = head.split(' ').nth(1).unwrap().parse().unwrap();
    let length: usize = head.lines().find_map(|l| l.strip_prefix("Content-Length: ")).unwrap().parse().unwrap();
    let body = all[end + 4..].to_vec();
    assert_eq!(body.len(), length, "{head}");
    Reply { status, head, body }
}
