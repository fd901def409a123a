// The frames: one request under way at a time, the newest state next, older ones dropped.
//
// While something changes, frames are coarse (moving). Shortly after the last change a still one follows, in full quality. A moving frame
// does not wait for a still one: that request is given up.

import * as server from "./server.js";

/// Milliseconds after the last change at which the still frame is asked for.
const REST = 60;
/// Milliseconds on the way, beside rendering and encoding, from which on moving frames are sent as JPEG.
const THIN = 60;
/// Milliseconds of work on a still frame after which that is told.
const SLOW = 400;
/// Times that are kept of each kind.
const KEPT = 1000;

/// Draws frames of `store` on `canvas`. `size` tells columns and rows of the picture; `shown` hears of each frame on the screen, `failed` of refusals.
/// `slow` hears of a still frame that takes a while.
export function createFrames({ store, canvas, size, shown, failed, slow }) {
  const context = canvas.getContext("bitmaprenderer");
  const counts = { frames: 0, stills: 0, latencies: [], stillAfter: [] };
  let seq = 0, last = 0, want = null, underWay = null, timer = 0, thin = false;
  // When the changes happened that no frame has been asked for, and when the newest of all did.
  let changes = [], restedFrom = performance.now();
  let still = null, lastShown = null;

  function change() {
    // When the hand moved, not when the page came to hear of it.
    const now = window.event?.timeStamp || performance.now();
    changes.push(now);
    restedFrom = now;
    want = "moving";
    clearTimeout(timer);
    timer = setTimeout(rest, REST);
    pump();
  }

  function rest() {
    want = "still";
    store.settle();
    pump();
  }

  function pump() {
    if (!want) return;
    if (underWay) {
      if (underWay.moving || want === "still") return;
      underWay.abort.abort();
    }
    const moving = want === "moving";
    want = null;
    ask(moving);
  }

  async function ask(moving) {
    const document = store.document, [width, height] = size(), since = changes, rested = restedFrom;
    const mine = { moving, abort: new AbortController(), document };
    underWay = mine;
    changes = [];
    const sent = performance.now();
    const slowly = moving ? 0 : setTimeout(slow, SLOW);
    const opaque = (document.image?.background?.[3] ?? 0) === 1;
    const encoding = moving && thin && opaque ? "jpeg" : "png";
    try {
      const { blob, info } = await server.frame({ seq: ++seq, document, width, height, moving, encoding }, mine.abort.signal);
      const way = performance.now() - sent - (info.render_ms ?? 0) - (info.encode_ms ?? 0);
      if (moving) thin = way > THIN;
      store.accept(document);
      done(mine);
      await draw(blob, info, { moving, since, rested, document });
    } catch (error) {
      done(mine);
      // 409: a newer request has stopped this one.
      if (error.name === "AbortError" || error.status === 409) return;
      if (error.status === 400) store.refuse(document);
      failed(error);
    } finally {
      clearTimeout(slowly);
    }
  }

  function done(mine) {
    if (underWay !== mine) return;
    underWay = null;
    pump();
  }

  async function draw(blob, info, { moving, since, rested, document }) {
    const bitmap = await createImageBitmap(blob);
    if (info.seq < last) return bitmap.close();
    last = info.seq;
    context.transferFromImageBitmap(bitmap);
    still = moving ? null : { blob, document, info };
    const frame = { info, moving };
    lastShown = frame;
    // Counted when it comes to the screen: two frames before one of the screen's are one.
    requestAnimationFrame((now) => {
      if (moving) counts.latencies.push(...since.map((then) => now - then));
      else counts.stillAfter.push(now - rested);
      for (const times of [counts.latencies, counts.stillAfter]) times.splice(0, times.length - KEPT);
      if (lastShown !== frame) return;
      counts[moving ? "frames" : "stills"] += 1;
      shown(frame, now);
    });
  }

  return {
    change,
    /// The still frame on the screen, or null while there is a coarse one.
    still: () => still,
    /// Whether everything asked for is on the screen.
    idle: () => underWay === null && want === null && still !== null && still.document === store.document,
    counts,
  };
}
