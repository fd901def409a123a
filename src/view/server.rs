//! The server: connections, each with a thread of its own, and their end.

use super::api::Api;
use super::command::Start;
use super::document::{self, Opened};
use super::export::title_of;
use super::frames::Frames;
use super::guard::Guard;
use super::http::{Connection, Fault, Request, Response};
use super::page;
use super::watch::Watch;
use crate::scene::{ResolvedScene, SceneFile};
use crate::{Error, Renderer, Result, Settings, Volume};
use std::collections::BTreeMap;
use std::io::{Read, Write};
use std::net::{Ipv4Addr, Shutdown, SocketAddr, TcpListener, TcpStream};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::JoinHandle;
use std::time::Duration;

/// Most connections at once.
const CONNECTIONS: usize = 64;
/// Time for those beyond to take the word that they are too many.
const TOO_MANY: Duration = Duration::from_millis(20);

/// What a server is to show, and how: see [`Server::builder`].
pub struct Builder {
    scene: SceneFile,
    volume: Volume,
    settings: Settings,
    port: u16,
    ancestors: Vec<String>,
    title: Option<String>,
    start: Option<Start>,
}

impl Builder {
    /// The server at another port; 0, the default, takes one that is free.
    #[must_use]
    pub fn port(mut self, port: u16) -> Self {
        self.port = port;
        self
    }

    /// The server whose frames are made in another way: threads, tiles, limits.
    #[must_use]
    pub fn settings(mut self, settings: Settings) -> Self {
        self.settings = settings;
        self
    }

    /// The server whose page may be shown in frames of these origins, such as `http://localhost:8888` for a notebook; in none unless given.
    #[must_use]
    pub fn frame_ancestors(mut self, origins: Vec<String>) -> Self {
        self.ancestors = origins;
        self
    }

    /// The server whose page has another title than the volume's file name.
    #[must_use]
    pub fn title(mut self, title: impl Into<String>) -> Self {
        self.title = Some(title.into());
        self
    }

    /// The server whose page can tell a command line for its picture: `arguments` of `slicestack render` that make the scene that it begins with, and
    /// what reads such arguments.
    #[must_use]
    pub fn command_line(mut self, arguments: Vec<String>, read: impl Fn(&[String]) -> Result<SceneFile> + Send + Sync + 'static) -> Self {
        self.start = Some(Start { arguments, read: Box::new(read) });
        self
    }

    /// Starts the server.
    ///
    /// # Errors
    /// [`Error::Invalid`] where the port is taken, and for an origin that is none; as [`SceneFile::resolve`] and [`Renderer::render`]: a scene that
    /// cannot be rendered is found here.
    pub fn start(self) -> Result<Server> {
        let Self { scene: file, volume, settings, port, ancestors, title, start } = self;
        // What ends a header, or one of its parts, would be more than an origin.
        if let Some(origin) =
            ancestors.iter().find(|o| o.is_empty() || !o.bytes().all(|b| b.is_ascii_graphic() && !matches!(b, b';' | b',')))
        {
            return Err(Error::invalid(format!("view: frame ancestor {origin:?}: is no origin")));
        }
        let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, port)).map_err(|e| Error::invalid(format!("view: port {port}: {e}")))?;
        let address = listener.local_addr().map_err(|e| Error::invalid(format!("view: port {port}: {e}")))?;
        let guard = Guard::new(address.port())?;
        let ResolvedScene { scene, warnings, notes } = file.resolve(&volume)?;
        document::check(&scene, &volume)?;
        let source = file.volume().clone();
        let title = title.unwrap_or_else(|| title_of(&source));
        let opened = Opened::new(volume, source, scene, file.annotations())?;
        let frames = Arc::new(Frames::new(Renderer::new(opened.volume.clone(), settings), &opened)?);
        let api = Api { opened, frames, watch: Watch::default(), title, start, notes, warnings };
        let common = vec![
            ("Cache-Control", "no-store".to_owned()),
            ("Content-Security-Policy", page::policy(&ancestors)),
            ("Cross-Origin-Resource-Policy", "same-origin".to_owned()),
            ("Referrer-Policy", "no-referrer".to_owned()),
            ("X-Content-Type-Options", "nosniff".to_owned()),
        ];
        let shared = Arc::new(Shared { api, guard, common, ended: AtomicBool::new(false), connections: Mutex::default() });
        let watching = thread("watch", &shared, |shared| shared.api.watch.run())?;
        let accepting = thread("accept", &shared, move |shared| shared.accept(&listener))?;
        Ok(Server { shared, address, threads: vec![accepting, watching] })
    }
}

/// A thread that works on `shared`.
fn thread(name: &str, shared: &Arc<Shared>, work: impl FnOnce(Arc<Shared>) + Send + 'static) -> Result<JoinHandle<()>> {
    let shared = Arc::clone(shared);
    let made = std::thread::Builder::new().name(format!("view {name}")).spawn(move || work(shared));
    made.map_err(|e| Error::invalid(format!("view: no thread: {e}")))
}

/// A running server; it ends with [`Server::stop`], or when dropped.
pub struct Server {
    shared: Arc<Shared>,
    address: SocketAddr,
    threads: Vec<JoinHandle<()>>,
}

impl Server {
    /// A server that shows `scene` of its `volume`, still to be started.
    pub fn builder(scene: SceneFile, volume: Volume) -> Builder {
        Builder { scene, volume, settings: Settings::new(), port: 0, ancestors: Vec::new(), title: None, start: None }
    }

    /// The address to open in a browser, with the token that lets its page ask.
    pub fn url(&self) -> String {
        format!("http://{}/#{}", self.address, self.shared.guard.token)
    }

    /// The port that it listens at.
    pub fn port(&self) -> u16 {
        self.address.port()
    }

    /// What was decided when the scene was opened, one line each.
    pub fn notes(&self) -> &[String] {
        &self.shared.api.notes
    }

    /// What is likely not meant about the scene, one line each.
    pub fn warnings(&self) -> &[String] {
        &self.shared.api.warnings
    }

    /// Waits until the server ends.
    pub fn wait(mut self) {
        // A thread that ended by a panic has ended all the same.
        self.threads.drain(..).for_each(|thread| drop(thread.join()));
    }

    /// Ends the server: frames in the making stop, connections are closed.
    pub fn stop(self) {
        drop(self);
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        self.shared.end();
        // The thread that accepts connections wakes up by one.
        drop(TcpStream::connect(self.address));
        self.threads.drain(..).for_each(|thread| drop(thread.join()));
    }
}

/// What all threads of a server share.
struct Shared {
    api: Api,
    guard: Guard,
    /// Headers of every response.
    common: Vec<(&'static str, String)>,
    ended: AtomicBool,
    connections: Mutex<Connections>,
}

#[derive(Default)]
struct Connections {
    next: u64,
    open: BTreeMap<u64, TcpStream>,
}

impl Shared {
    fn accept(self: &Arc<Self>, listener: &TcpListener) {
        for stream in listener.incoming() {
            if self.ended.load(Ordering::SeqCst) {
                return;
            }
            let Ok(stream) = stream else {
                // Out of files: some are closed before long.
                std::thread::sleep(TOO_MANY);
                continue;
            };
            let Some(number) = self.enter(&stream) else {
                self.turn_away(stream);
                continue;
            };
            let shared = Arc::clone(self);
            let serving = std::thread::Builder::new().name("view connection".to_owned()).spawn(move || {
                // Pages and files are small, and the next request waits for them.
                drop(stream.set_nodelay(true));
                shared.serve(Connection::new(stream));
                shared.leave(number);
            });
            if serving.is_err() {
                self.leave(number);
            }
        }
    }

    /// A place for a connection, where there is one.
    fn enter(&self, stream: &TcpStream) -> Option<u64> {
        let mut connections = self.connections.lock().unwrap_or_else(PoisonError::into_inner);
        if connections.open.len() >= CONNECTIONS {
            return None;
        }
        connections.next += 1;
        let number = connections.next;
        connections.open.insert(number, stream.try_clone().ok()?);
        Some(number)
    }

    fn leave(&self, number: u64) {
        let stream = self.connections.lock().unwrap_or_else(PoisonError::into_inner).open.remove(&number);
        // Whoever still sends need not.
        drop(stream.map(|stream| stream.shutdown(Shutdown::Both)));
    }

    /// Tells one connection too many so.
    fn turn_away(&self, mut stream: TcpStream) {
        let response = Response::error(503, "too many connections", None).bytes(false, &self.common);
        let told = stream.set_write_timeout(Some(TOO_MANY)).and_then(|()| stream.write_all(&response));
        // A connection that is closed with something unread loses what was written.
        if told.and_then(|()| stream.set_nonblocking(true)).is_ok() {
            drop(stream.read(&mut [0; 4096]));
        }
    }

    /// Answers what comes over a connection, one request after the other.
    fn serve(&self, mut connection: Connection) {
        loop {
            let (response, keep) = match connection.read() {
                Ok(request) => {
                    let answer = catch_unwind(AssertUnwindSafe(|| self.answer(&request, &connection.stream)));
                    (answer.unwrap_or_else(|_| Response::error(500, "the server has failed at this request", None)), request.keep)
                }
                Err(Fault::Refused(status, what)) => (Response::error(status, what, None), false),
                Err(Fault::Gone) => return,
            };
            if self.ended.load(Ordering::SeqCst) || connection.send(&response.bytes(keep, &self.common)).is_err() {
                return;
            }
            if !keep {
                return linger(&mut connection.stream);
            }
        }
    }

    fn answer(&self, request: &Request, stream: &TcpStream) -> Response {
        if let Err(refused) = self.guard.place(request) {
            return refused;
        }
        if let Some(file) = page::file(&request.path) {
            return if request.method == "GET" {
                file
            } else {
                Response::error(405, "files are asked for with GET", None).with("Allow", "GET")
            };
        }
        if !Api::knows(&request.path) {
            return Response::error(404, "there is nothing there", None);
        }
        match self.guard.work(request) {
            Ok(()) => self.api.answer(request, stream),
            Err(refused) => refused,
        }
    }

    /// Stops all work, and closes all connections.
    fn end(&self) {
        self.ended.store(true, Ordering::SeqCst);
        self.api.watch.end();
        self.api.frames.stop();
        let open = std::mem::take(&mut self.connections.lock().unwrap_or_else(PoisonError::into_inner).open);
        open.into_values().for_each(|stream| drop(stream.shutdown(Shutdown::Both)));
    }
}

/// Lets the other side read the last response: a connection that is closed with something unread loses what was written.
fn linger(stream: &mut TcpStream) {
    drop(stream.shutdown(Shutdown::Write));
    drop(stream.set_read_timeout(Some(Duration::from_millis(100))));
    let mut some = [0; 8192];
    // As much as an oversized request may have under way; whoever sends more is cut off.
    for _ in 0..64 {
        match stream.read(&mut some) {
            Ok(n) if n > 0 => {}
            _ => return,
        }
    }
}
