//! Whoever has gone is worked for no longer: connections are looked at while their answer is made.

use std::collections::BTreeMap;
use std::io::ErrorKind;
use std::net::TcpStream;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

/// Time between two looks.
const PAUSE: Duration = Duration::from_millis(40);

/// Connections whose answers are being made.
#[derive(Default)]
pub(super) struct Watch {
    watched: Mutex<Watched>,
    more: Condvar,
    ended: AtomicBool,
}

/// What is to be done once the other side has gone.
type Gone = Box<dyn FnOnce() + Send>;

#[derive(Default)]
struct Watched {
    next: u64,
    all: BTreeMap<u64, (TcpStream, Gone)>,
}

/// A connection under watch, until this is dropped.
pub(super) struct Watching<'w> {
    watch: &'w Watch,
    number: u64,
    stream: TcpStream,
}

impl Watch {
    /// Watches `stream`, which nobody reads or writes meanwhile; calls `gone` once the other side has closed it.
    pub(super) fn over(&self, stream: &TcpStream, gone: impl FnOnce() + Send + 'static) -> std::io::Result<Watching<'_>> {
        let (stream, peeked) = (stream.try_clone()?, stream.try_clone()?);
        stream.set_nonblocking(true)?;
        let mut watched = self.lock();
        watched.next += 1;
        let number = watched.next;
        watched.all.insert(number, (peeked, Box::new(gone)));
        self.more.notify_all();
        Ok(Watching { watch: self, number, stream })
    }

    /// Looks on until the watch is ended.
    pub(super) fn run(&self) {
        let mut watched = self.lock();
        while !self.ended.load(Ordering::SeqCst) {
            if watched.all.is_empty() {
                watched = self.more.wait(watched).unwrap_or_else(PoisonError::into_inner);
                continue;
            }
            let left: Vec<u64> = watched.all.iter().filter(|(_, (stream, _))| has_gone(stream)).map(|(&number, _)| number).collect();
            for number in left {
                if let Some((_, gone)) = watched.all.remove(&number) {
                    gone();
                }
            }
            watched = self.more.wait_timeout(watched, PAUSE).unwrap_or_else(PoisonError::into_inner).0;
        }
    }

    /// Ends the watch: for all that are left it is as if they had gone.
    pub(super) fn end(&self) {
        self.ended.store(true, Ordering::SeqCst);
        let mut watched = self.lock();
        std::mem::take(&mut watched.all).into_values().for_each(|(_, gone)| gone());
        self.more.notify_all();
    }

    fn lock(&self) -> MutexGuard<'_, Watched> {
        self.watched.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Drop for Watching<'_> {
    fn drop(&mut self) {
        self.watch.lock().all.remove(&self.number);
        // A connection that cannot block again is found broken by whoever writes next.
        drop(self.stream.set_nonblocking(false));
    }
}

/// Whether the other side has closed `stream`, which does not block.
fn has_gone(stream: &TcpStream) -> bool {
    match stream.peek(&mut [0]) {
        Ok(n) => n == 0,
        Err(e) => !matches!(e.kind(), ErrorKind::WouldBlock | ErrorKind::Interrupted),
    }
}
