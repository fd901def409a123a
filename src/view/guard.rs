//! Who may ask: pages of this very server alone, with the token that the command printed.
//!
//! A page of another site cannot send these requests unseen: its Origin is not this server's. A name of another site that is made to lead to
//! this machine (DNS rebinding) comes with that name as Host. Other users of the machine lack the token.

use super::http::{Request, Response};
use crate::{Error, Result};

/// Bytes of a token: 128 bits.
const BYTES: usize = 16;

/// What is asked of requests.
#[derive(Debug)]
pub(super) struct Guard {
    /// The token, in hex.
    pub(super) token: String,
    port: u16,
}

impl Guard {
    /// One with a token of its own, for the server at `port`.
    ///
    /// # Errors
    /// [`Error::Invalid`] where the system gives no random numbers.
    pub(super) fn new(port: u16) -> Result<Self> {
        let mut bytes = [0; BYTES];
        getrandom::fill(&mut bytes).map_err(|e| Error::invalid(format!("view: no random numbers for the token: {e}")))?;
        Ok(Self { token: bytes.iter().map(|b| format!("{b:02x}")).collect(), port })
    }

    /// Refuses requests under another name, and from pages of other sites.
    pub(super) fn place(&self, request: &Request) -> Result<(), Response> {
        if !request.header("host").is_some_and(|host| self.is_own(host)) {
            return Err(Response::error(403, "the Host is not this server's", None));
        }
        let foreign = |origin: &str| !origin.strip_prefix("http://").is_some_and(|host| self.is_own(host));
        if request.header("origin").is_some_and(foreign) {
            return Err(Response::error(403, "the Origin is not this server's", None));
        }
        Ok(())
    }

    /// Refuses requests for work that do not come from the page: in method, token and type.
    pub(super) fn work(&self, request: &Request) -> Result<(), Response> {
        if request.method != "POST" {
            return Err(Response::error(405, "this is asked for with POST", None).with("Allow", "POST"));
        }
        if !request.header("x-slicestack-token").is_some_and(|token| same(token.as_bytes(), self.token.as_bytes())) {
            return Err(Response::error(403, "the token is wrong: open the whole address that the command printed", None));
        }
        let kind = request.header("content-type").and_then(|kind| kind.split(';').next()).unwrap_or_default();
        if !kind.trim().eq_ignore_ascii_case("application/json") {
            return Err(Response::error(415, "the Content-Type is not application/json", None));
        }
        Ok(())
    }

    fn is_own(&self, host: &str) -> bool {
        let name = host.strip_suffix(&format!(":{}", self.port));
        name.is_some_and(|name| matches!(name.to_ascii_lowercase().as_str(), "127.0.0.1" | "localhost" | "[::1]"))
    }
}

/// Whether both are the same, in a time that does not tell where they differ.
fn same(a: &[u8], b: &[u8]) -> bool {
    a.len() == b.len() && std::hint::black_box(a.iter().zip(b).fold(0, |found, (x, y)| found | (x ^ y))) == 0
}
