//! As much of HTTP/1.1 as a page on the same machine needs, each part of a request bounded in size and time.
//!
//! ```text
//!  bytes --head, at most 16 KiB within 5 s--> method, path, headers --body, at most 4 MiB by Content-Length--> Request
//!  Response --head and body, at most 10 s for a reader that takes nothing--> bytes
//! ```

use std::io::{ErrorKind, Read, Write};
use std::net::TcpStream;
use std::time::{Duration, Instant};

/// Most bytes of request line and headers.
const HEAD: usize = 16 << 10;
/// Most bytes of a body.
const BODY: usize = 4 << 20;
/// Time for request line and headers, from the first byte to the last.
const HEAD_TIME: Duration = Duration::from_secs(5);
/// Time for a body.
const BODY_TIME: Duration = Duration::from_secs(10);
/// Time that a connection may wait for its next request.
const IDLE: Duration = Duration::from_secs(60);
/// Time for a whole response, however slowly its reader takes it.
const WRITE_TIME: Duration = Duration::from_secs(10);

/// A request that was read to its end.
#[derive(Debug, Default)]
pub(super) struct Request {
    pub(super) method: String,
    /// The path without what follows a question mark.
    pub(super) path: String,
    headers: Vec<(String, String)>,
    pub(super) body: Vec<u8>,
    /// Whether the connection may serve another request.
    pub(super) keep: bool,
}

impl Request {
    /// The value of a header that was given once, whatever the case of its name.
    pub(super) fn header(&self, name: &str) -> Option<&str> {
        self.headers.iter().find(|(known, _)| known == name).map(|(_, value)| value.as_str())
    }
}

/// Why there is no request.
#[derive(Debug, PartialEq, Eq)]
pub(super) enum Fault {
    /// Nobody is there any more, or has asked for nothing for a while.
    Gone,
    /// To be told with this status.
    Refused(u16, &'static str),
}

/// A connection, and the bytes that have come beyond the last request.
pub(super) struct Connection {
    pub(super) stream: TcpStream,
    ahead: Vec<u8>,
}

impl Connection {
    pub(super) fn new(stream: TcpStream) -> Self {
        Self { stream, ahead: Vec::new() }
    }

    /// The next request.
    ///
    /// # Errors
    /// Why there is none. The connection is of no further use then.
    pub(super) fn read(&mut self) -> Result<Request, Fault> {
        let mut deadline = Instant::now() + IDLE;
        let mut begun = false;
        let end = loop {
            if !self.ahead.is_empty() && !begun {
                (begun, deadline) = (true, Instant::now() + HEAD_TIME);
            }
            let within = &self.ahead[..self.ahead.len().min(HEAD)];
            match (within.windows(4).position(|w| w == b"\r\n\r\n"), within.len() == HEAD) {
                (Some(at), _) => break at,
                (None, true) => return Err(Fault::Refused(431, "request line and headers are longer than 16 KiB")),
                (None, false) => {}
            }
            let late = if begun { Fault::Refused(408, "the headers took longer than 5 s") } else { Fault::Gone };
            self.more(deadline, late)?;
        };
        let rest = self.ahead.split_off(end + 4);
        let head = std::mem::replace(&mut self.ahead, rest);
        let (mut request, length) = parse(&head[..end])?;
        let deadline = Instant::now() + BODY_TIME;
        // Whoever waits to be told so before it sends a body is told.
        if self.ahead.len() < length && request.header("expect").is_some_and(|e| e.eq_ignore_ascii_case("100-continue")) {
            self.send(b"HTTP/1.1 100 Continue\r\n\r\n").map_err(|_| Fault::Gone)?;
        }
        while self.ahead.len() < length {
            self.more(deadline, Fault::Refused(408, "the body took longer than 10 s"))?;
        }
        let rest = self.ahead.split_off(length);
        request.body = std::mem::replace(&mut self.ahead, rest);
        Ok(request)
    }

    /// Waits for further bytes until `deadline`.
    fn more(&mut self, deadline: Instant, late: Fault) -> Result<(), Fault> {
        let left = deadline.saturating_duration_since(Instant::now());
        if left.is_zero() {
            return Err(late);
        }
        let mut some = [0; 8192];
        self.stream.set_read_timeout(Some(left)).map_err(|_| Fault::Gone)?;
        match self.stream.read(&mut some) {
            Ok(0) => Err(Fault::Gone),
            Ok(n) => {
                self.ahead.extend_from_slice(&some[..n]);
                Ok(())
            }
            Err(e) if e.kind() == ErrorKind::Interrupted => Ok(()),
            Err(e) if matches!(e.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut) => Err(late),
            Err(_) => Err(Fault::Gone),
        }
    }

    /// Writes all of `bytes`, or gives up on a reader that does not take them.
    pub(super) fn send(&mut self, bytes: &[u8]) -> std::io::Result<()> {
        let deadline = Instant::now() + WRITE_TIME;
        let mut left = bytes;
        while !left.is_empty() {
            let time = deadline.saturating_duration_since(Instant::now());
            if time.is_zero() {
                return Err(ErrorKind::TimedOut.into());
            }
            self.stream.set_write_timeout(Some(time))?;
            match self.stream.write(left) {
                Ok(0) => return Err(ErrorKind::WriteZero.into()),
                Ok(n) => left = &left[n..],
                Err(e) if e.kind() == ErrorKind::Interrupted => {}
                Err(e) => return Err(e),
            }
        }
        Ok(())
    }
}

/// Method, path and headers of `head`, and the length of the body that follows it.
fn parse(head: &[u8]) -> Result<(Request, usize), Fault> {
    let text = std::str::from_utf8(head).map_err(|_| Fault::Refused(400, "the headers are no text"))?;
    let mut lines = text.split("\r\n");
    let first: Vec<&str> = lines.next().unwrap_or_default().split(' ').collect();
    let [method, target, version] = first[..] else { return Err(Fault::Refused(400, "the request line is not METHOD PATH HTTP/1.1")) };
    if !matches!(version, "HTTP/1.1" | "HTTP/1.0") || method.is_empty() || !target.starts_with('/') {
        return Err(Fault::Refused(400, "the request line is not METHOD PATH HTTP/1.1"));
    }
    let mut request = Request {
        method: method.to_owned(),
        path: target.split('?').next().unwrap_or_default().to_owned(),
        keep: version == "HTTP/1.1",
        ..Request::default()
    };
    for line in lines {
        let (name, value) = line.split_once(':').ok_or(Fault::Refused(400, "a header without a colon"))?;
        // A name with a space in it could be read in two ways.
        if name.is_empty()
            || name.contains(|c: char| c.is_whitespace() || c.is_control())
            || value.contains(|c: char| c.is_control() && c != '\t')
        {
            return Err(Fault::Refused(400, "a header that is none"));
        }
        let name = name.to_ascii_lowercase();
        let once = matches!(name.as_str(), "host" | "origin" | "content-length" | "content-type" | "x-slicestack-token");
        if once && request.header(&name).is_some() {
            return Err(Fault::Refused(400, "a header is given twice"));
        }
        request.headers.push((name, value.trim().to_owned()));
    }
    if request.header("transfer-encoding").is_some() {
        return Err(Fault::Refused(411, "a body needs a Content-Length; pieces are not taken"));
    }
    if request.header("connection").is_some_and(|c| c.to_ascii_lowercase().contains("close")) {
        request.keep = false;
    }
    let length = match request.header("content-length") {
        None if request.method == "POST" => return Err(Fault::Refused(411, "a body needs a Content-Length")),
        None => 0,
        Some(digits) if !digits.is_empty() && digits.bytes().all(|b| b.is_ascii_digit()) => {
            digits.parse().ok().filter(|&n| n <= BODY).ok_or(Fault::Refused(413, "the body is longer than 4 MiB"))?
        }
        Some(_) => return Err(Fault::Refused(400, "Content-Length is no number")),
    };
    Ok((request, length))
}

/// What is sent back.
#[derive(Debug)]
pub(super) struct Response {
    pub(super) status: u16,
    pub(super) content_type: &'static str,
    /// Further headers.
    pub(super) headers: Vec<(&'static str, String)>,
    pub(super) body: Vec<u8>,
}

impl Response {
    /// A response of `body`, of the type `content_type`.
    pub(super) fn new(content_type: &'static str, body: impl Into<Vec<u8>>) -> Self {
        Self { status: 200, content_type, headers: Vec::new(), body: body.into() }
    }

    /// A response of JSON.
    pub(super) fn json(value: &serde_json::Value) -> Self {
        Self::new("application/json", value.to_string())
    }

    /// An error in one line, and the key of the scene that is at fault where one is.
    pub(super) fn error(status: u16, what: &str, key: Option<&str>) -> Self {
        let mut told = serde_json::json!({ "error": what });
        if let Some(key) = key {
            told["key"] = key.into();
        }
        Self { status, ..Self::json(&told) }
    }

    #[must_use]
    pub(super) fn with(mut self, name: &'static str, value: impl Into<String>) -> Self {
        self.headers.push((name, value.into()));
        self
    }

    /// Head and body as they are sent; the body is left out for HEAD.
    pub(super) fn bytes(&self, keep: bool, common: &[(&'static str, String)]) -> Vec<u8> {
        let mut head = format!("HTTP/1.1 {} {}\r\nContent-Length: {}\r\n", self.status, reason(self.status), self.body.len());
        if !self.body.is_empty() {
            head += &format!("Content-Type: {}\r\n", self.content_type);
        }
        for (name, value) in common.iter().chain(&self.headers) {
            // What a header cannot hold must not end it.
            let value: String = value.chars().map(|c| if (' '..='~').contains(&c) { c } else { '?' }).collect();
            head += &format!("{name}: {value}\r\n");
        }
        head += if keep { "Connection: keep-alive\r\n\r\n" } else { "Connection: close\r\n\r\n" };
        let mut bytes = head.into_bytes();
        bytes.extend_from_slice(&self.body);
        bytes
    }
}

fn reason(status: u16) -> &'static str {
    match status {
        200 => "OK",
        204 => "No Content",
        400 => "Bad Request",
        403 => "Forbidden",
        404 => "Not Found",
        405 => "Method Not Allowed",
        408 => "Request Timeout",
        409 => "Conflict",
        411 => "Length Required",
        413 => "Content Too Large",
        415 => "Unsupported Media Type",
        431 => "Request Header Fields Too Large",
        503 => "Service Unavailable",
        _ => "Internal Server Error",
    }
}
