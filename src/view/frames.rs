//! Frames: each page has a renderer of its own, the latest request wins, and a moving frame is as coarse as its time asks for.
//!
//! ```text
//!  request, seq 8 --> page --is 8 the latest? no: 409--> renderer free? --> render --> encode --> picture
//!                      |                                   ^  |
//!  request, seq 9 -----+-- stops the frame of 8 -----------+  +-- stopped: 409
//! ```

use super::document::{Asked, Opened};
use super::quality::{Quality, Subject};
use crate::annotate::annotate;
use crate::picture::{Depth, Format, Picture};
use crate::scene::Scene;
use crate::settings::Stopper;
use crate::{Error, RenderStats, Renderer, Result};
use std::collections::BTreeMap;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::Instant;

/// Most pages whose renderers are kept.
const PAGES: usize = 4;

/// The renderers of the pages.
pub(super) struct Frames {
    /// All others begin with what it holds of the volume. It makes what is no frame of a page.
    first: Mutex<Renderer>,
    pages: Mutex<Pages>,
}

#[derive(Default)]
struct Pages {
    /// Counts requests, so that the page that has not asked for longest is known.
    clock: u64,
    all: BTreeMap<String, (u64, Arc<Page>)>,
}

/// What is kept for a page.
pub(super) struct Page {
    state: Mutex<State>,
    free: Condvar,
    stopper: Stopper,
}

struct State {
    /// The latest request.
    latest: u64,
    /// There while no frame is made.
    renderer: Option<Renderer>,
    quality: Quality,
}

/// The right to render, given back when dropped.
struct Turn<'p> {
    page: &'p Page,
    renderer: Option<Renderer>,
}

/// A frame, and what there is to tell of it.
pub(super) struct Frame {
    pub(super) picture: Picture,
    pub(super) stats: RenderStats,
    pub(super) warnings: Vec<String>,
    pub(super) render_ms: f64,
    pub(super) encode_ms: f64,
    /// What the picture's sides are divided by.
    pub(super) divisor: f64,
    pub(super) bytes: Vec<u8>,
    pub(super) content_type: &'static str,
}

/// What a page asks for.
pub(super) struct Wanted {
    pub(super) seq: u64,
    pub(super) moving: bool,
    pub(super) jpeg: bool,
}

impl Frames {
    /// Those of `opened`, which `renderer` renders. What depends on the volume alone is made here, so that the first frame need not wait for it.
    ///
    /// # Errors
    /// As [`Renderer::render`]: a scene that cannot be rendered is found here.
    pub(super) fn new(mut renderer: Renderer, opened: &Opened) -> Result<Self> {
        let small = opened.scene.clone().with_size(16, 16)?;
        renderer.render(&small)?;
        Ok(Self { first: Mutex::new(renderer), pages: Mutex::default() })
    }

    /// What is kept for the page `client`; the one that has asked for nothing for longest makes room.
    pub(super) fn page(&self, client: &str) -> Arc<Page> {
        let mut pages = lock(&self.pages);
        pages.clock += 1;
        let now = pages.clock;
        if let Some((used, page)) = pages.all.get_mut(client) {
            *used = now;
            return Arc::clone(page);
        }
        if pages.all.len() >= PAGES {
            let oldest = pages.all.iter().min_by_key(|(_, (used, _))| *used).map(|(name, _)| name.clone());
            if let Some((_, page)) = oldest.and_then(|name| pages.all.remove(&name)) {
                page.leave(u64::MAX);
            }
        }
        let renderer = lock(&self.first).beside();
        let stopper = renderer.stopper();
        let state = State { latest: 0, quality: Quality::default(), renderer: Some(renderer) };
        let page = Arc::new(Page { stopper, state: Mutex::new(state), free: Condvar::new() });
        pages.all.insert(client.to_owned(), (now, Arc::clone(&page)));
        page
    }

    /// Forgets the page `client`.
    pub(super) fn close(&self, client: &str) {
        let page = lock(&self.pages).all.remove(client);
        if let Some((_, page)) = page {
            page.leave(u64::MAX);
        }
    }

    /// Stops whatever is in the making.
    pub(super) fn stop(&self) {
        lock(&self.pages).all.values().for_each(|(_, page)| page.leave(u64::MAX));
    }

    /// The renderer for what is no frame of a page: small pictures and single pixels.
    pub(super) fn aside(&self) -> MutexGuard<'_, Renderer> {
        lock(&self.first)
    }
}

impl Page {
    /// The frame that `wanted` asks for, of what `asked` reads; `None` where a later request has come.
    ///
    /// # Errors
    /// As `asked`, [`Renderer::render`] and the encoders.
    pub(super) fn frame(&self, wanted: &Wanted, opened: &Opened, asked: impl FnOnce() -> Result<Asked>) -> Result<Option<Frame>> {
        let Some(mut turn) = self.turn(wanted.seq) else { return Ok(None) };
        let Some(renderer) = &mut turn.renderer else { return Ok(None) };
        let start = Instant::now();
        let Asked { scene, annotations, mut warnings, .. } = asked()?;
        let (scene, divisor) = if wanted.moving { self.coarse(&scene, opened)? } else { (scene, 1.0) };
        let (mut picture, stats) = match renderer.render(&scene) {
            Err(Error::Stopped) => return Ok(None),
            done => done?,
        };
        // The next frame need not wait for the encoder.
        drop(turn);
        let rendered = start.elapsed();
        // Letters as coarse as a moving frame are no letters: they come with the still one.
        if annotations.any() && !wanted.moving {
            let (annotated, left_out) = annotate(&picture, &annotations, &scene, &opened.volume)?;
            picture = annotated;
            warnings.extend(left_out);
        }
        warnings.extend(stats.warnings.iter().cloned());
        let (bytes, content_type) = encoded(&picture, wanted)?;
        let whole = start.elapsed();
        if wanted.moving {
            lock(&self.state).quality.measured(whole.as_secs_f64());
        }
        let (render_ms, encode_ms) = (1e3 * rendered.as_secs_f64(), 1e3 * (whole - rendered).as_secs_f64());
        Ok(Some(Frame { picture, stats, warnings, render_ms, encode_ms, divisor, bytes, content_type }))
    }

    /// `scene` as coarse as its frames have to be to come in time.
    fn coarse(&self, scene: &Scene, opened: &Opened) -> Result<(Scene, f64)> {
        let subject = Subject::of(scene, &opened.volume)?;
        let level = lock(&self.state).quality.choose(subject);
        Ok((level.coarse(scene, subject)?, level.divisor))
    }

    /// Waits until the renderer is free, and stops what it does for an earlier request; `None` where a later one comes.
    fn turn(&self, seq: u64) -> Option<Turn<'_>> {
        let mut state = lock(&self.state);
        if seq < state.latest {
            return None;
        }
        state.latest = seq;
        if state.renderer.is_none() {
            self.stopper.stop();
            self.free.notify_all();
        }
        loop {
            if state.latest > seq {
                return None;
            }
            if let Some(renderer) = state.renderer.take() {
                return Some(Turn { page: self, renderer: Some(renderer) });
            }
            state = self.free.wait(state).unwrap_or_else(PoisonError::into_inner);
        }
    }

    /// The page does not want the frame of `seq` any more, nor any before it.
    pub(super) fn leave(&self, seq: u64) {
        let mut state = lock(&self.state);
        if state.latest <= seq {
            state.latest = seq.saturating_add(1);
            if state.renderer.is_none() {
                self.stopper.stop();
            }
            self.free.notify_all();
        }
    }
}

impl Drop for Turn<'_> {
    fn drop(&mut self) {
        let mut state = lock(&self.page.state);
        // What was to stop is over: the next frame is another.
        self.page.stopper.reset();
        state.renderer = self.renderer.take();
        self.page.free.notify_all();
    }
}

/// The bytes of a frame, and their type. A still frame is the file that the command writes; a moving one is encoded in little time.
fn encoded(picture: &Picture, wanted: &Wanted) -> Result<(Vec<u8>, &'static str)> {
    if !wanted.moving {
        return Ok((picture.encode(Format::Png, Depth::Eight)?, "image/png"));
    }
    // A JPEG holds no transparency.
    if wanted.jpeg && picture.pixels().iter().all(|p| p[3] >= 1.0) {
        return Ok((picture.encode(Format::Jpeg, Depth::Eight)?, "image/jpeg"));
    }
    Ok((crate::picture::png::rgba8_fast(picture.width(), picture.height(), &picture.to_rgba8())?, "image/png"))
}

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
