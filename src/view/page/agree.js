// Choices that need others: what the server refuses alone is tried with the change that it asks for. The server decides; the page knows
// only what to change for which refusal, and says what it has changed.

import * as server from "./server.js";
import { at, withKeys } from "./store.js";

/// Blends that show a value and no colours go without light.
export const PROJECTIONS = new Set(["mip", "attenuated-mip", "min", "lmip", "average"]);
/// Algorithms that go by a number of samples.
const STEPPED = { rays: "Rays go", "coin-flips": "Coin flips go" };
const COUNT = 512;

/// What to change when a refusal reads like `when`: the keys that it sets, and one sentence. It never takes back what was chosen.
const remedies = [
  {
    when: /^slices[ .](tolerance|spacing)/,
    change: (d) => ({ "slices.tolerance": undefined, "slices.spacing": undefined, "slices.count": STEPPED[d.render?.algorithm] ? COUNT : undefined }),
    words: (d) => (STEPPED[d.render?.algorithm] ? `${STEPPED[d.render.algorithm]} by a number of slices: ${COUNT} now.` : "Its samples lie where the voxels do: no error and no number is chosen for it."),
  },
  {
    when: /pre-integrated|second-order|classification/,
    change: () => ({ "transfer.classification": "post" }),
    words: () => "Classification is post now, which this needs.",
  },
  { when: /^lights?:|^light[ .]/, change: () => ({ light: { model: "none" }, lights: undefined }), words: () => "Light is off now: values that are projected have no surface to light." },
  { when: /^lights?:|^light[ .]/, change: () => ({ "render.blend": "over" }), words: () => "Blend is over now: light needs the colours of surfaces." },
  { when: /slices[ .]merge|do not merge/, change: () => ({ "slices.merge": undefined }), words: () => "Slabs are not merged now." },
  { when: /slices[ .]extrapolate/, change: () => ({ "slices.extrapolate": undefined }), words: () => "Pictures are not extrapolated now." },
  { when: /slices[ .]jitter/, change: () => ({ "slices.jitter": undefined }), words: () => "Slices are not shifted by chance now." },
  { when: /^slices[ .]order/, change: () => ({ "slices.order": undefined }), words: () => "The order is that of the method now." },
  { when: /^slices[ .](slab|sample|ends|accumulation)/, change: () => ({ "slices.slab": undefined, "slices.sample": undefined, "slices.ends": undefined, "slices.accumulation": undefined }), words: () => "Slabs are as plain as this method has them now." },
  { when: /^render[ .]filter/, change: () => ({ "render.filter": "linear", "render.prefilter": undefined }), words: () => "Between voxels is linear now, which this needs." },
  { when: /^render[ .]hit/, change: () => ({ "render.hit": "first-sample" }), words: () => "The surface is the first sample beyond it now." },
  { when: /^render[ .]window/, change: () => ({ "render.window": undefined }), words: () => "The window is left open now." },
  { when: /^cut:.*render[ .]blend/, change: () => ({ "render.blend": "over" }), words: () => "Blend is over now: slices hide what is behind them." },
  { when: /^cut:.*for the algorithms/, change: () => ({ "render.algorithm": "slices" }), words: () => "Algorithm is slices now, which slices through the data need." },
  { when: /^render[ .](blend|level)/, change: () => ({ "render.blend": "over", "render.level": undefined, "render.hit": undefined }), words: () => "Blend is over now, which this needs." },
  { when: /render[ .]algorithm|^labels and regions/, change: () => ({ "render.algorithm": "slices" }), words: () => "Algorithm is slices now, which this needs." },
];

/// Names of keys as the page's own controls have them.
const LABELS = [
  [/; give camera\.along/, "; choose another algorithm to turn it freely"], [/^camera: /, ""],
  [/\(?transfer[ .]classification( pre-integrated and second-order)?\)?/g, "classification"], [/slices[ .]tolerance( [\d.e-]+)?/g, "an allowed error"], [/slices[ .](count|spacing)/g, "a number of slices"],
  [/render[ .]algorithm/g, "the algorithm"], [/render[ .]blend/g, "the blend"], [/render[ .]filter/g, "“Between voxels”"], [/fog[ .](weighting|mode)/g, "fog"], [/[a-z]+\.([a-z_]+)/g, "$1"],
  [/^cut: planes inside the picture/, "slices through the data"],
];

/// A refusal in the page's words: one sentence.
export function plain(text) {
  const words = LABELS.reduce((said, [from, to]) => said.replace(from, to), text).replace(/: does not go together with /, " does not go together with ");
  return words[0].toUpperCase() + words.slice(1) + (words.endsWith(".") ? "" : ".");
}

/// The axis of the volume that a camera looks along most nearly.
function nearestAxis({ eye, target } = {}) {
  const way = eye && target ? target.map((t, n) => t - eye[n]) : [0, 1, 0];
  const axis = [0, 1, 2].reduce((best, n) => (Math.abs(way[n]) > Math.abs(way[best]) ? n : best), 0);
  return `${way[axis] < 0 ? "-" : ""}${"xyz"[axis]}`;
}

/// What the server makes of `next`, with further changes where it needs them: { document, warnings, said }. `own` are the keys that were chosen.
export async function agreed(next, own) {
  const said = [], used = new Set();
  if (next.render?.algorithm === "grid" && own.includes("render.algorithm") && !next.camera?.along) {
    next = withKeys(next, { camera: { along: nearestAxis(next.camera) } });
    said.push("Grid looks along an axis of the volume: the view is turned to the nearest one.");
  }
  for (;;) {
    try {
      const found = await server.resolve(next);
      return { ...found, said };
    } catch (error) {
      if (error.status !== 400) throw error;
      const remedy = remedies.find((r) => {
        if (used.has(r) || !r.when.test(error.message)) return false;
        return Object.entries(r.change(next)).some(([key, value]) => at(next, key) !== value) && !Object.keys(r.change(next)).some((key) => own.some((k) => k === key || k.startsWith(`${key}.`)));
      });
      if (!remedy) throw new server.Refused(400, plain(error.message));
      used.add(remedy);
      said.push(remedy.words(next));
      next = withKeys(next, remedy.change(next));
    }
  }
}

/// The light that a projection has put out.
let parked = null;

/// `document` with another blend. What belongs to one blend alone is decided anew; light comes back with the colours that it shone on, unless
/// this is only `trying`.
export function withBlend(document, blend, level, trying = false) {
  const own = ["level", "levels", "threshold", "window", "attenuation", "hit"].map((key) => [`render.${key}`, undefined]);
  let next = withKeys(document, { ...Object.fromEntries(own), "render.blend": blend });
  if (blend === "iso") next = withKeys(next, { "render.level": level });
  if (PROJECTIONS.has(blend) && (next.light?.model ?? "none") !== "none") {
    if (!trying) parked = { light: next.light, lights: next.lights };
    next = withKeys(next, { light: { model: "none" }, lights: undefined });
  } else if (blend === "over" && parked && (next.light?.model ?? "none") === "none") next = withKeys(next, parked);
  return next;
}

/// Keeps disabled, in the lists of `selects` that are open, what cannot be chosen, with the reason as its title. `entries` tells
/// { options, change(document, value), own } of each; the server is asked while `idle` says that nothing else is.
export function createLimits({ store, entries, idle }) {
  let asked = "", running = false;
  // What decides: none of it is the camera, and of the transfer function only how it is looked up.
  const state = ({ render, slices, light, lights, fog, cut, labels, region, transfer, transfer2d }) =>
    JSON.stringify([render, slices, light?.model, Boolean(lights), fog?.mode, Boolean(cut), Boolean(labels), Boolean(region), transfer?.classification, Boolean(transfer2d)]);
  const seen = () => state(store.document) + entries().map(({ own }) => own[0]).join();
  async function look() {
    if (running) return;
    running = true;
    for (;;) {
      const document = store.document, now = seen();
      if (now === asked) break;
      for (const { options, change, own, current } of entries()) {
        for (const option of options()) {
          while (!idle()) await new Promise((later) => setTimeout(later, 200));
          if (seen() !== now) break;
          let why = "";
          if (option.value !== current(document)) {
            try {
              await agreed(change(document, option.value), own);
            } catch (error) {
              if (error.status !== 400) return void (running = false);
              why = error.message;
            }
          }
          option.disabled = why !== "";
          option.title = why;
        }
      }
      if (seen() === now) asked = now;
    }
    running = false;
  }
  return look;
}
