// The place at hand, and the controls that change it.
const state = { at: record.chosen, k: record.slices[0], step: 0 };
const last = record.slices[1] - 1;
const extra = () => (record.pixels[state.at].slice.includes(stack.count) ? 1 : 0);

function whyNothing(pixel, k) {
  if (!pixel.span) {
    if (!pixel.through) return `The ray of pixel ${pixel.x}, ${pixel.y} passes the box by.`;
    const [a, b] = pixel.through;
    return `No slice covers pixel ${pixel.x}, ${pixel.y}. Its ray runs through the box from depth ${num(a, 6)} to ${num(b, 6)}, ` + (scene.clip_planes ? "but the clip planes cut all of that away, or no plane of the stack lies in what they leave." : "and no plane of the stack lies between: it only grazes an edge or a corner.");
  }
  if (k < pixel.span[0] || k > pixel.span[1]) return `Slice ${k} does not cover this pixel; slices ${pixel.span[0]} to ${pixel.span[1]} do.`;
  const run = pixel.skipped.find((s) => k >= s[0] && k < s[1]);
  if (run && run[2]) return `Slice ${k} was passed over: every pixel of the block was finished, no light gets through any more.`;
  if (run) return `Slices ${run[0]} to ${run[1] - 1} were passed over in one go: the transfer function shows nothing in the bricks of the volume that they cross here (A = 0).`;
  return `Slice ${k} is not in the record of this pixel; the page holds slices ${record.slices[0]} to ${last}.`;
}

function placeNow() {
  const pixel = record.pixels[state.at], k = state.k, i = pixel.slice.indexOf(k);
  return { pixel, k, i, slice: k <= last ? geometryOf(k) : null, why: whyNothing(pixel, k) };
}

function stateWords(place) {
  const { pixel, k, i } = place;
  if (i < 0) return place.why;
  if (!pixel.covered[i]) return `Slice ${k} leaves no fragment in this pixel; it ran for others of its block.`;
  const was = before(pixel, pixel.start, i);
  if (scene.blend === "over" && scene.order === "front-to-back" && scene.method.slab !== "riemann" && was.t < scene.terminate) return "Covered, but the pixel had finished before.";
  if (scene.blend !== "over") return `Covered: value ${num(toData(pixel.value[i]), 5)}.`;
  return `Covered: value ${num(toData(pixel.value[i]), 5)}, opacity ${num(pixel.alpha[i], 4)}.`;
}

// Slices that change the pixel.
function events(pixel) {
  return pixel.slice.filter((k, i) => {
    const was = before(pixel, pixel.start, i);
    return pixel.covered[i] && (was.t !== pixel.transmittance[i] || was.sum.some((x, c) => x !== pixel.sum[i][c]));
  }).sort((a, b) => a - b);
}

// All slices in a strip: what each adds to the pixel.
function strip(place) {
  const { pixel } = place, n = last - record.slices[0] + 1 + extra(), view = make("svg", { viewBox: `0 0 ${n} 20`, preserveAspectRatio: "none", role: "img", "aria-label": "slices that change the pixel" });
  view.append(make("rect", { x: 0, y: 0, width: n, height: 20, fill: "var(--card)" }));
  if (pixel.span) view.append(make("rect", { x: pixel.span[0] - record.slices[0], y: 17, width: pixel.span[1] - pixel.span[0] + 1, height: 3, fill: "var(--soft)" }));
  for (const k of events(pixel)) {
    const i = pixel.slice.indexOf(k), A = ["over", "under", "add"].includes(scene.blend) ? pixel.alpha[i] : 1;
    view.append(make("rect", { x: k - record.slices[0], y: 16 - 15 * Math.max(0.08, Math.sqrt(clamp01(A))), width: 1.02, height: 15 * Math.max(0.08, Math.sqrt(clamp01(A))), fill: scene.blend === "over" ? css(shownOf(pixel.color[i], A)) : "var(--accent)", stroke: "var(--soft)", "stroke-width": 0.4, "vector-effect": "non-scaling-stroke" }));
  }
  view.append(make("rect", { x: state.k - record.slices[0], y: 0, width: 1, height: 20, fill: "none", stroke: "var(--bad)", "stroke-width": 2, "vector-effect": "non-scaling-stroke" }));
  return view;
}

function drawPicture(place) {
  const unit = Math.max(scene.width, scene.height) / 320, marks = record.pixels.map((p, n) => make("circle", { cx: p.x + 0.5, cy: p.y + 0.5, r: (n === state.at ? 5 : 2) * unit, fill: n === state.at ? "none" : "var(--paper)", "fill-opacity": 0.8, stroke: n === state.at ? "var(--bad)" : "var(--ink)", "stroke-width": (n === state.at ? 2 : 0.6) * unit }));
  byId("picture").replaceChildren(picturesvg(place, marks, "the picture; dots are pixels on record"));
  const { pixel } = place;
  byId("pictured").replaceChildren(`Pixel ${pixel.x}, ${pixel.y}: `, pictureSwatch(pixel), `${premultiplied(pixel.picture.slice(0, 3))}, opacity ${num(pixel.picture[3], 4)}. Dots: the ${plural(record.pixels.length, "pixel")} on record; click to choose one.`);
}

function fill(panel, place) {
  const step = STEPS[panel.index];
  panel.node.replaceChildren(make("h2", {}, `${panel.index + 1}. ${step.title}`), ...step.show(place).flat(9).filter(Boolean));
}

const panels = STEPS.map((step, index) => ({ index, node: make("section", { class: "panel", id: "step" + (index + 1) }) }));
let later = 0;

function show(pictureToo) {
  const place = placeNow();
  const slider = byId("slice");
  slider.max = last + extra();
  slider.value = state.k;
  byId("label").replaceChildren(state.k > last ? "Behind the last slice" : `Slice ${state.k} of 0 to ${stack.count - 1}`);
  byId("state").textContent = stateWords(place);
  byId("strip").replaceChildren(strip(place));
  byId("fragment").replaceChildren(...fragmentList(place));
  if (pictureToo) drawPicture(place);
  const aside = document.querySelector("aside");
  aside.style.setProperty("--rest", Math.min(8, window.innerHeight - aside.offsetHeight - 8) + "px");
  panels.forEach((p, n) => p.node.classList.toggle("shown", n === state.step));
  [...byId("tabs").children].forEach((b, n) => (n === state.step ? b.setAttribute("aria-current", "step") : b.removeAttribute("aria-current")));
  fill(panels[state.step], place);
  // The others are there for printing; they can wait.
  clearTimeout(later);
  later = setTimeout(() => panels.forEach((p, n) => n !== state.step && fill(p, place)), 150);
  history.replaceState(null, "", `#x=${record.pixels[state.at].x}&y=${record.pixels[state.at].y}&slice=${state.k}&step=${state.step + 1}`);
}

function toSlice(k) {
  state.k = Math.min(last + extra(), Math.max(record.slices[0], k));
  show(false);
}
function toStep(n) {
  state.step = Math.min(STEPS.length - 1, Math.max(0, n));
  show(false);
}
function toEvent(direction) {
  const all = events(record.pixels[state.at]);
  const next = direction > 0 ? all.find((k) => k > state.k) : all.findLast((k) => k < state.k);
  if (next !== undefined) toSlice(next);
}
function toPixel(at) {
  state.at = at;
  state.k = Math.min(state.k, last + extra());
  show(true);
}

// The slice that takes most light from a pixel.
function heaviest(pixel) {
  let best = null, most = -1;
  pixel.slice.forEach((k, i) => {
    const was = before(pixel, pixel.start, i), taken = ["over", "under", "surfaces"].includes(scene.blend) ? Math.abs(was.t - pixel.transmittance[i]) : ["iso", "lmip", "attenuated-mip"].includes(scene.blend) ? was.t - pixel.transmittance[i] : Math.abs(toData(pixel.value[i]));
    if (pixel.covered[i] && taken > most) [best, most] = [k, taken];
  });
  // Of part of a stack the first slice says why nothing was recorded.
  if (best !== null || !whole) return best ?? record.slices[0];
  return pixel.span ? pixel.span[0] : Math.floor(last / 2);
}

function begin() {
  const name = (scene.volume.split(/[\\/]/).pop() || "volume");
  byId("title").textContent = `How a picture of ${name} comes about`;
  byId("about").textContent = `${scene.dims.join(" \u00d7 ")} voxels of ${scene.voxel_type}, ${stack.count} slices, ${scene.width} \u00d7 ${scene.height} pixels, ${stack.perspective ? "perspective" : "parallel rays"}, blended ${scene.blend === "over" ? scene.order.replaceAll("-", " ") : "as " + scene.blend}. Every number on this page was recorded between the stages of the pipeline, or is marked as worked out from the record.`;
  byId("notes").replaceChildren(...record.notes.map((n) => note("", n)));
  byId("origin").textContent = `Written by slicestack ${record.version}. The page is complete in itself: nothing is fetched.`;
  byId("tabs").replaceChildren(...STEPS.map((s, n) => {
    const b = make("button", { type: "button" }, `${n + 1} ${s.name}`);
    b.addEventListener("click", () => toStep(n));
    return b;
  }));
  byId("panels").replaceChildren(...panels.map((p) => p.node));
  byId("slice").min = record.slices[0];
  byId("slice").addEventListener("input", (e) => toSlice(Number(e.target.value)));
  byId("back").addEventListener("click", () => toSlice(state.k - 1));
  byId("forth").addEventListener("click", () => toSlice(state.k + 1));
  byId("previous").addEventListener("click", () => toEvent(-1));
  byId("next").addEventListener("click", () => toEvent(1));
  byId("strip").addEventListener("click", (e) => {
    const box = byId("strip").getBoundingClientRect(), n = last - record.slices[0] + 1 + extra();
    toSlice(record.slices[0] + Math.floor(((e.clientX - box.left) / box.width) * n));
  });
  byId("picture").addEventListener("click", (e) => {
    const box = byId("picture").getBoundingClientRect();
    const x = ((e.clientX - box.left) / box.width) * scene.width, y = ((e.clientY - box.top) / box.height) * scene.height;
    let best = 0, least = Infinity;
    record.pixels.forEach((p, n) => {
      const d = Math.hypot(p.x + 0.5 - x, p.y + 0.5 - y);
      if (d < least) [best, least] = [n, d];
    });
    toPixel(best);
  });
  document.addEventListener("keydown", (e) => {
    if (e.ctrlKey || e.metaKey || e.altKey) return;
    const keys = { ArrowLeft: () => (e.shiftKey ? toEvent(-1) : toSlice(state.k - 1)), ArrowRight: () => (e.shiftKey ? toEvent(1) : toSlice(state.k + 1)), ArrowUp: () => toStep(state.step - 1), ArrowDown: () => toStep(state.step + 1) };
    const digit = Number(e.key) - 1;
    if (keys[e.key]) keys[e.key]();
    else if (digit >= 0 && digit < STEPS.length) toStep(digit);
    else return;
    e.preventDefault();
  });
  let resized = 0;
  window.addEventListener("resize", () => {
    clearTimeout(resized);
    resized = setTimeout(() => show(false), 200);
  });
  const asked = new URLSearchParams(location.hash.slice(1));
  const at = record.pixels.findIndex((p) => String(p.x) === asked.get("x") && String(p.y) === asked.get("y"));
  if (at >= 0) state.at = at;
  const k = Number(asked.get("slice")), step = Number(asked.get("step"));
  state.k = asked.has("slice") && k >= record.slices[0] && k <= last ? k : heaviest(record.pixels[state.at]);
  state.step = step >= 1 && step <= STEPS.length ? step - 1 : 0;
  show(true);
}
begin();
