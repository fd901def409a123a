//! What the page can ask for: from a path and JSON to an answer.

use super::command::{self, Start};
use super::document::{Asked, Document, Opened, told};
use super::frames::{Frame, Frames, Wanted};
use super::http::{Request, Response};
use super::save::{self, Kind};
use super::watch::Watch;
use super::{open, presets, probe};
use crate::{Error, Renderer, Result};
use serde::Deserialize;
use serde::de::DeserializeOwned;
use serde_json::json;
use std::net::TcpStream;
use std::sync::Arc;

/// Most letters of the name that a page gives itself.
const NAME: usize = 64;
/// Most lines of warnings that are told of one frame.
const LINES: usize = 8;

/// All that answers come from.
pub(super) struct Api {
    pub(super) opened: Opened,
    pub(super) frames: Arc<Frames>,
    pub(super) watch: Watch,
    pub(super) title: String,
    /// How the view was started, where a command did that.
    pub(super) start: Option<Start>,
    /// What was decided when the scene was opened, and what is likely not meant.
    pub(super) notes: Vec<String>,
    pub(super) warnings: Vec<String>,
}

/// Why there is no answer.
enum Refusal {
    /// What the page sent is wrong.
    Wrong(Error),
    /// A later request has come.
    Superseded,
}

impl From<Error> for Refusal {
    fn from(error: Error) -> Self {
        if matches!(error, Error::Stopped) { Self::Superseded } else { Self::Wrong(error) }
    }
}

type Answer = Result<Response, Refusal>;

#[derive(Deserialize)]
struct FrameBody {
    client: String,
    seq: u64,
    document: Document,
    width: u32,
    height: u32,
    #[serde(default)]
    moving: bool,
    #[serde(default)]
    encoding: Encoding,
}

#[derive(Deserialize, Default, PartialEq, Eq)]
#[serde(rename_all = "lowercase")]
enum Encoding {
    #[default]
    Png,
    Jpeg,
}

#[derive(Deserialize)]
struct DocumentBody {
    document: Document,
    /// Whether this is a question, to which a refusal is an answer like another.
    #[serde(default)]
    trial: bool,
}

#[derive(Deserialize)]
struct PictureBody {
    document: Document,
    width: u32,
    height: u32,
}

#[derive(Deserialize)]
struct ProbeBody {
    document: Document,
    width: u32,
    height: u32,
    x: u32,
    y: u32,
}

#[derive(Deserialize)]
struct PresetBody {
    document: Document,
    preset: String,
}

#[derive(Deserialize)]
struct ThumbnailBody {
    document: Document,
    preset: String,
    size: u32,
}

#[derive(Deserialize)]
struct SaveBody {
    document: Document,
    width: u32,
    height: u32,
    format: Kind,
}

#[derive(Deserialize)]
struct CloseBody {
    client: String,
}

/// Everything that there is to ask for.
const PATHS: [&str; 10] = [
    "/api/open",
    "/api/here",
    "/api/frame",
    "/api/probe",
    "/api/thumbnail",
    "/api/preset",
    "/api/document",
    "/api/save",
    "/api/command",
    "/api/close",
];

impl Api {
    /// Whether there is something at `path`.
    pub(super) fn knows(path: &str) -> bool {
        PATHS.contains(&path)
    }

    /// The answer to `request`, which the guard has let through and which came over `stream`.
    pub(super) fn answer(&self, request: &Request, stream: &TcpStream) -> Response {
        let body = &request.body;
        let answer = match request.path.as_str() {
            "/api/open" => self.open(),
            // Whether there is still a server, and the same one.
            "/api/here" => return nothing(),
            "/api/frame" => self.frame(body, stream),
            "/api/probe" => self.probe(body, stream),
            "/api/thumbnail" => self.thumbnail(body, stream),
            "/api/preset" => self.preset(body),
            "/api/document" => self.document(body),
            "/api/save" => self.save(body, stream),
            "/api/command" => self.command(body),
            "/api/close" => self.close(body),
            _ => return Response::error(404, "there is nothing there", None),
        };
        answer.unwrap_or_else(|refusal| match refusal {
            Refusal::Superseded => Response::error(409, "a later request has come", None),
            Refusal::Wrong(error) => {
                let (text, key) = told(&error);
                Response::error(400, &text, key)
            }
        })
    }

    fn open(&self) -> Answer {
        Ok(Response::json(&open::answer(&self.opened, &self.title, &self.notes, &self.warnings)?))
    }

    fn frame(&self, body: &[u8], stream: &TcpStream) -> Answer {
        let FrameBody { client, seq, document, width, height, moving, encoding } = read(body)?;
        let page = self.frames.page(name(&client)?);
        let leaving = Arc::clone(&page);
        let watching = self.watch.over(stream, move || leaving.leave(seq)).map_err(|_| Refusal::Superseded)?;
        let wanted = Wanted { seq, moving, jpeg: encoding == Encoding::Jpeg };
        let frame = page.frame(&wanted, &self.opened, || self.opened.read(document, Some((width, height))))?;
        drop(watching);
        let Some(frame) = frame else { return Err(Refusal::Superseded) };
        let told = told_of(&frame, &wanted);
        Ok(Response::new(frame.content_type, frame.bytes).with("X-Frame", told))
    }

    fn document(&self, body: &[u8]) -> Answer {
        let DocumentBody { document, trial } = read(body)?;
        match self.opened.read(document, None) {
            Err(error) if trial => {
                let (text, key) = told(&error);
                Ok(Response::json(&json!({ "error": text, "key": key })))
            }
            asked => self.resolved(&asked?),
        }
    }

    fn preset(&self, body: &[u8]) -> Answer {
        let PresetBody { document, preset } = read(body)?;
        self.resolved(&presets::with_preset(&self.opened, document, &preset, None)?)
    }

    fn thumbnail(&self, body: &[u8], stream: &TcpStream) -> Answer {
        let ThumbnailBody { document, preset, size } = read(body)?;
        let mut renderer = self.frames.aside();
        let png = self.watched(stream, &mut renderer, |renderer| presets::thumbnail(&self.opened, renderer, document, &preset, size))?;
        Ok(Response::new("image/png", png))
    }

    fn probe(&self, body: &[u8], stream: &TcpStream) -> Answer {
        let ProbeBody { document, width, height, x, y } = read(body)?;
        let asked = self.opened.read(document, Some((width, height)))?;
        let mut renderer = self.frames.aside();
        Ok(Response::json(&self.watched(stream, &mut renderer, |renderer| probe::answer(&self.opened, renderer, &asked, (x, y)))?))
    }

    fn save(&self, body: &[u8], stream: &TcpStream) -> Answer {
        let SaveBody { document, width, height, format } = read(body)?;
        let asked = self.opened.read(document, Some((width, height)))?;
        // One of its own: a picture in full may take long.
        let mut renderer = self.frames.aside().beside();
        let bytes = self.watched(stream, &mut renderer, |renderer| save::bytes(&self.opened, renderer, &asked, format))?;
        let name = save::name(&self.opened.source, &self.title, format);
        Ok(Response::new(format.content_type(), bytes).with("X-Name", ascii(&name)))
    }

    fn command(&self, body: &[u8]) -> Answer {
        let PictureBody { document, width, height } = read(body)?;
        let asked = self.opened.read(document, Some((width, height)))?;
        Ok(Response::json(&command::answer(&self.opened, self.start.as_ref(), &asked)?))
    }

    /// What `work` makes with `renderer`, which stops once the other side of `stream` has gone.
    fn watched<T>(&self, stream: &TcpStream, renderer: &mut Renderer, work: impl FnOnce(&mut Renderer) -> Result<T>) -> Result<T> {
        let stopper = renderer.stopper();
        let watching = self.watch.over(stream, move || stopper.stop()).map_err(|_| Error::Stopped)?;
        let done = work(renderer);
        drop(watching);
        // Whoever went away as the work was done must not stop the next.
        renderer.stopper().reset();
        done
    }

    /// The document of `asked`, and what there is to tell of it.
    fn resolved(&self, asked: &Asked) -> Answer {
        let document = self.opened.write(&asked.scene, &asked.annotations)?;
        Ok(Response::json(&json!({ "document": document, "warnings": asked.warnings, "notes": asked.notes })))
    }

    fn close(&self, body: &[u8]) -> Answer {
        let CloseBody { client } = read(body)?;
        self.frames.close(name(&client)?);
        Ok(nothing())
    }
}

/// The answer that says no more than that there is one.
fn nothing() -> Response {
    Response { status: 204, ..Response::new("", Vec::new()) }
}

/// The JSON of a body.
fn read<T: DeserializeOwned>(body: &[u8]) -> Result<T> {
    serde_json::from_slice(body).map_err(|e| Error::invalid(format!("the request: {e}")))
}

/// The name of a page, if it is one.
fn name(client: &str) -> Result<&str> {
    let fine = (1..=NAME).contains(&client.len()) && client.bytes().all(|b| b.is_ascii_graphic());
    if fine { Ok(client) } else { Err(Error::invalid(format!("client: is no name of 1 to {NAME} letters"))) }
}

/// What the header says of a frame.
fn told_of(frame: &Frame, wanted: &Wanted) -> String {
    let warnings: Vec<&String> = frame.warnings.iter().take(LINES).collect();
    let value = json!({
        "seq": wanted.seq,
        "width": frame.picture.width(),
        "height": frame.picture.height(),
        "render_ms": frame.render_ms,
        "encode_ms": frame.encode_ms,
        "slices": frame.stats.slices,
        "error": frame.stats.error_estimate,
        "square": frame.divisor,
        "final": !wanted.moving,
        "warnings": warnings,
    });
    ascii(&value.to_string())
}

/// JSON with letters of ASCII alone, as a header holds them.
fn ascii(json: &str) -> String {
    let mut out = String::with_capacity(json.len());
    for c in json.chars() {
        if c.is_ascii() {
            out.push(c);
        } else {
            c.encode_utf16(&mut [0; 2]).iter().for_each(|unit| out += &format!("\\u{unit:04x}"));
        }
    }
    out
}
