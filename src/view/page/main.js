// The page: opens the scene, and ties its parts together.

import * as server from "./server.js";
import { boxOf, cameraOf, fittedTo } from "./camera.js";
import { byId, make } from "./dom.js";
import { createFields } from "./fields.js";
import { createFrames } from "./frames.js";
import { createHandles } from "./handles.js";
import { fillPanels } from "./panels.js";
import { listen } from "./pointer.js";
import { createPresets } from "./presets.js";
import { createProbe } from "./probe.js";
import { createSave } from "./save.js";
import { createStore, withKey } from "./store.js";
import { createTransfer } from "./transfer.js";
import { short } from "./vectors.js";

/// Most pixels of a picture that fills the page.
const PIXELS = 1.5e6;

/// Milliseconds that words below the picture stay.
const TOLD = 12000;
let told = 0;

function say(words) {
  byId("message").textContent = words;
  clearTimeout(told);
  told = setTimeout(() => (byId("message").textContent = ""), TOLD);
}

/// Columns and rows of the picture: those that were chosen, else as many as the page has room for.
function createSize(scene) {
  const fixed = new Map([["fill", null], ["scene", scene], ["512", [512, 512]], ["1024", [1024, 1024]], ["1920", [1920, 1080]]]);
  const words = { fill: "as large as the page", scene: `of the scene: ${scene.join(" × ")}`, 512: "512 × 512", 1024: "1024 × 1024", 1920: "1920 × 1080" };
  const select = make("select", { id: "size" }, ...[...fixed.keys()].map((key) => make("option", { value: key }, words[key])));
  const field = make("label", { class: "field" }, make("span", {}, "Size"), select);
  let now = scene;
  function measure() {
    const stage = byId("stage"), [wide, tall] = [Math.max(stage.clientWidth, 64), Math.max(stage.clientHeight, 64)];
    const chosen = fixed.get(select.value), frame = byId("frame").style;
    if (chosen) {
      const factor = Math.min(wide / chosen[0], tall / chosen[1]);
      frame.width = `${chosen[0] * factor}px`;
      frame.height = `${chosen[1] * factor}px`;
      now = chosen;
    } else {
      const dense = Math.min(window.devicePixelRatio, 2, Math.sqrt(PIXELS / (wide * tall)));
      frame.width = `${wide}px`;
      frame.height = `${tall}px`;
      now = [Math.round(wide * dense), Math.round(tall * dense)];
    }
  }
  return { field, select, measure, get: () => now };
}

/// The line below the picture.
function createNumbers() {
  let times = [];
  return (frame, now) => {
    const { info, moving } = frame;
    times = [...times.filter((t) => now - t < 1000), ...(moving ? [now] : [])];
    const parts = [`${info.width} × ${info.height}`, `${info.slices} slices`, `${short(info.render_ms, 3)} ms`];
    if (moving) parts.push(`${times.length} frames a second`);
    else if (info.error !== null && info.error !== undefined) parts.push(`error ${short(info.error, 2)}`);
    byId("numbers").textContent = parts.join(" · ");
  };
}

function theme() {
  const dark = matchMedia("(prefers-color-scheme: dark)"), button = byId("theme");
  let choice = "auto";
  const apply = () => {
    document.documentElement.dataset.theme = choice === "auto" ? (dark.matches ? "dark" : "light") : choice;
    button.textContent = `Theme: ${choice}`;
  };
  button.addEventListener("click", () => {
    choice = { auto: "light", light: "dark", dark: "auto" }[choice];
    apply();
  });
  dark.addEventListener("change", apply);
  apply();
}

function facts(opened) {
  const { volume } = opened, rows = [["Voxels", volume.dims.join(" × ")], ["Spacing", volume.spacing.map((s) => short(s, 4)).join(" × ") + (volume.length_unit ? ` ${volume.length_unit}` : "")]];
  if (volume.range) rows.push(["Values", `${short(volume.range[0], 6)} to ${short(volume.range[1], 6)}${volume.unit ? ` ${volume.unit}` : ""}`]);
  rows.push(["slicestack", opened.version]);
  byId("data-facts").append(...rows.flatMap(([name, text]) => [make("dt", {}, name), make("dd", {}, text)]));
  byId("notes").append(...[...opened.warnings, ...opened.notes].map((text) => make("li", {}, text)));
  byId("about").open = opened.warnings.length > 0;
}

function begin(opened) {
  const { volume } = opened, box = boxOf(volume);
  document.title = `${opened.title} - slicestack`;
  byId("title").textContent = opened.title;
  facts(opened);

  const sizes = createSize(opened.size), size = sizes.get;
  sizes.measure();
  const first = withKey(opened.document, "image", { ...opened.document.image, width: opened.size[0], height: opened.size[1] });
  const fit = (scene) => fittedTo(scene, box, size());
  const store = createStore(fit(first), fit);
  const home = () => store.set(fit({ ...store.document, camera: first.camera, image: { ...first.image, background: store.document.image.background } }));

  const numbers = createNumbers();
  let complaint = null;
  const frames = createFrames({
    store, canvas: byId("canvas"), size,
    shown: (frame, now) => {
      numbers(frame, now);
      if (frame.moving) return;
      const told = frame.info.warnings ?? [];
      if (told.length || complaint === "warnings") say(told.join(" "));
      complaint = told.length ? "warnings" : null;
      probe.refresh();
    },
    failed: (error) => {
      complaint = null;
      say(error.message);
    },
  });

  /// Shows what the server makes of `next`.
  async function resolve(next) {
    try {
      const found = await server.resolve(next);
      store.set(fit(found.document));
      say((found.warnings ?? []).join(" "));
    } catch (error) {
      say(error.message);
      update(store.document);
    }
  }

  const handles = createHandles({ overlay: byId("overlay"), store, box, size, full: () => say("There are six planes already: take one away first.") });
  const fields = createFields({ store, resolve, about: opened.about, choices: opened.choices });
  fillPanels({ fields, store, box, volume, size, resolve, say, handles, sizes: sizes.field, home });
  const transfer = createTransfer({ host: byId("transfer-fields"), store, volume, histogram: opened.histogram });
  const probe = createProbe({ store, volume, size, mark: handles.mark, say, section: byId("probe") });
  createSave({ store, size, say });

  // The picture is asked for at once; what the controls show follows with the screen's next frame.
  let drawn = store.document, waiting = false;
  function update(scene) {
    if (scene !== drawn) frames.change();
    if (scene.transfer !== drawn.transfer) transfer.update();
    drawn = scene;
    if (waiting) return;
    waiting = true;
    requestAnimationFrame(() => {
      waiting = false;
      fields.update(store.document);
      handles.update();
      byId("undo").disabled = !store.canUndo;
      byId("redo").disabled = !store.canRedo;
    });
  }
  store.subscribe(update);
  byId("sections").addEventListener("toggle", () => update(store.document), true);
  update(store.document);
  transfer.update();
  frames.begin();
  createPresets({ presets: opened.presets, store, apply: (scene) => store.set(fit(scene)), say, idle: frames.idle });

  const resized = () => {
    sizes.measure();
    store.refit();
  };
  new ResizeObserver(resized).observe(byId("stage"));
  sizes.select.addEventListener("change", resized);

  const key = listen({ stage: byId("frame"), store, box, size, click: probe.at, home });
  keyboard({ key, probe, store });
  // Whatever is dragged is one step of undo; heard before anybody else is.
  const down = new Set();
  const hold = (event) => {
    down.add(event.pointerId);
    store.hold();
  };
  const release = (event) => {
    down.delete(event.pointerId);
    if (!down.size) store.release();
  };
  addEventListener("pointerdown", hold, true);
  for (const end of ["pointerup", "pointercancel"]) addEventListener(end, release);
  byId("undo").addEventListener("click", store.undo);
  byId("redo").addEventListener("click", store.redo);
  addEventListener("pagehide", server.close);

  // For scripts that drive the page.
  window.slicestack = {
    document: () => store.document,
    show: store.set,
    camera: () => cameraOf(store.document, box, size()),
    size, counts: frames.counts, idle: frames.idle, still: frames.still,
  };
}

/// Keys that work wherever the focus is, and those of the picture.
function keyboard({ key, probe, store }) {
  let probing = false;
  const help = byId("help");
  const cross = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] };
  document.addEventListener("keydown", (event) => {
    if (help.open) return;
    const { target } = event, typing = target.matches("textarea, select, input:not([type=range], [type=checkbox], [type=color])");
    const control = event.ctrlKey || event.metaKey;
    if (control && !typing && event.key.toLowerCase() === "z") (event.shiftKey ? store.redo : store.undo)();
    else if (control && !typing && event.key.toLowerCase() === "y") store.redo();
    else if (control || event.altKey || typing) return;
    else if (event.key === "?") help.showModal();
    else if (event.key.toLowerCase() === "p") {
      probing = !(probing && probe.on);
      if (probing !== probe.on) probe.toggle();
      byId("frame").focus();
    } else if (event.key === "Escape" && probe.on) {
      probing = false;
      probe.toggle();
    } else if (target !== document.body && target.id !== "frame") return;
    else if (probing && probe.on && cross[event.key]) probe.move(...cross[event.key].map((n) => n * (event.shiftKey ? 10 : 1)));
    else if (!key(event)) return;
    event.preventDefault();
  });
  byId("help-open").addEventListener("click", () => help.showModal());
}

function drawer() {
  const button = byId("drawer");
  button.addEventListener("click", () => {
    const alone = document.body.classList.toggle("alone");
    button.textContent = alone ? "Show" : "Hide";
    button.setAttribute("aria-expanded", String(!alone));
  });
}

theme();
drawer();
if (server.hasToken) server.open().then(begin, (error) => say(error.message));
else say("The address lacks its token: open the whole line that the command printed.");
