// The page: opens the scene, and ties its parts together.

import * as server from "./server.js";
import { agreed, createLimits, plain } from "./agree.js";
import { boxOf, cameraOf, fittedTo } from "./camera.js";
import { byId, make } from "./dom.js";
import { createFields } from "./fields.js";
import { createFrames } from "./frames.js";
import { createHandles } from "./handles.js";
import { fillPanels } from "./panels.js";
import { watchServer } from "./here.js";
import { createPlanes } from "./planes.js";
import { listen } from "./pointer.js";
import { createPresets } from "./presets.js";
import { createProbe } from "./probe.js";
import { createSave, download } from "./save.js";
import { dataOf, keep, kept, sceneOf } from "./session.js";
import { createStore, withKey } from "./store.js";
import { createTransfer } from "./transfer.js";
import { short } from "./vectors.js";

/// Most pixels of a picture that fills the page.
const PIXELS = 1.5e6;

/// Milliseconds that words over the picture stay, where nothing changes before.
const TOLD = 10000;
let told = 0;

function say(words) {
  byId("message").textContent = words;
  clearTimeout(told);
  told = setTimeout(() => (byId("message").textContent = ""), TOLD);
}

/// Milliseconds after a turn of the wheel in which another belongs to it.
const TICKS = 800;

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
  const line = byId("numbers");
  let times = [];
  function numbers(frame, now) {
    const { info, moving } = frame;
    times = [...times.filter((t) => now - t < 1000), ...(moving ? [now] : [])];
    const parts = [`${info.width} × ${info.height}`, `${info.slices} slices`, `${short(info.render_ms, 3)} ms`];
    if (moving) parts.push(`${times.length} frames a second`);
    else if (info.error !== null && info.error !== undefined) parts.push(`error ${short(info.error, 2)}`);
    line.textContent = parts.join(" · ");
    line.title = parts.at(-1).startsWith("error") ? "Error: an estimate of how far colours, from 0 to 1, may be from those of very many slices. 0.004 is one step of 255." : "";
  }
  /// The picture in full is on its way, and takes a while.
  numbers.drawing = () => {
    if (!line.textContent.toLowerCase().endsWith("drawing...")) line.textContent += " · drawing...";
  };
  return numbers;
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
  const record = kept();
  const store = createStore(fit(first), fit, record?.document ? fit(record.document) : null);
  if (record?.document) say("What you made before the reload is back. Undo shows the scene as it was opened.");
  const home = () => store.set(fit({ ...store.document, camera: first.camera, image: { ...first.image, background: store.document.image.background } }));
  home.document = () => fit(first);

  const numbers = createNumbers();
  let complaint = "";
  const frames = createFrames({
    store, canvas: byId("canvas"), size,
    shown: (frame, now) => {
      numbers(frame, now);
      if (frame.moving) return;
      const told = frame.info.warnings ?? [];
      // Told once, not with every frame that is drawn.
      const words = told.join(" "), said = byId("message").textContent;
      if (words && words !== complaint && !said.includes(words)) tell([said, words].join(" "));
      complaint = words;
      probe.refresh();
      if (data) keepAll();
      else learn().catch(() => {});
    },
    failed: (error) => {
      // Of a view that has ended another place tells.
      if (error.status !== server.GONE && error.status !== server.OTHER) tell(plain(error.message));
    },
    slow: numbers.drawing,
  });

  // Words about the scene go when it changes.
  let about = store.document;
  function tell(words) {
    about = store.document;
    say(words);
  }

  /// Shows what the server makes of `next`, in which the keys `own` were chosen.
  async function resolve(next, own) {
    try {
      const lit = (scene) => (scene.light?.model ?? "none") !== "none", before = store.document, found = await agreed(next, own);
      if (own.includes("render.blend") && lit(before) && !lit(next)) found.said.unshift("Light is off with this blend: values that are projected have no surface to light.");
      store.set(fit(found.document));
      store.settle();
      tell([...found.said, ...(found.warnings ?? [])].join(" "));
    } catch (error) {
      tell(error.message);
      update(store.document);
    }
  }

  const planes = createPlanes(box);
  const handles = createHandles({ overlay: byId("overlay"), store, box, size, planes, full: () => tell("There are six planes already: take one away first.") });
  const fields = createFields({ store, resolve, about: opened.about, choices: opened.choices, say: tell });
  const clips = fillPanels({ fields, store, box, volume, windows: opened.windows ?? [], size, say: tell, handles, planes, sizes: sizes.field, home, redraw: () => update(store.document) });
  const limits = createLimits({ store, entries: fields.limited, idle: frames.idle });
  const transfer = createTransfer({ host: byId("transfer-fields"), store, volume, histogram: opened.histogram, say: tell });
  const probe = createProbe({ store, volume, size, mark: handles.mark, say: tell, section: byId("probe") });

  // What a reload, and the end of the view, would lose. The document says nothing of where the data is; the server's own scene does.
  let data = record?.data ?? null, name = record?.name ?? null;
  const keepAll = () => keep({ document: store.canUndo ? store.document : null, data, name });
  const own = () => data && { text: sceneOf({ document: store.document, data }), name };
  async function learn() {
    const saved = await server.save(store.document, size(), "json");
    data = dataOf(JSON.parse(await saved.blob.text()));
    name = saved.name;
    keepAll();
  }
  const save = createSave({ store, size, say: tell, gone: () => here.gone, own });
  const here = watchServer(save.saveOwn);
  addEventListener("pagehide", keepAll);

  // The picture is asked for at once; what the controls show follows with the screen's next frame.
  let drawn = store.document, waiting = false;
  function update(scene) {
    if (scene !== drawn) frames.change();
    if (scene !== about) byId("message").textContent = "";
    about = scene;
    if (scene.transfer !== drawn.transfer) transfer.update();
    drawn = scene;
    if (waiting) return;
    waiting = true;
    requestAnimationFrame(() => {
      waiting = false;
      fields.update(store.document);
      handles.update();
      clips.update(store.document);
      limits();
      byId("undo").disabled = !store.canUndo;
      byId("redo").disabled = !store.canRedo;
    });
  }
  store.subscribe(update);
  byId("sections").addEventListener("toggle", () => update(store.document), true);
  update(store.document);
  transfer.update();
  frames.change();
  createPresets({ presets: opened.presets, store, apply: (scene) => store.set(fit(scene)), say: tell, idle: frames.idle });

  const resized = () => {
    sizes.measure();
    store.refit();
    probe.resized();
  };
  new ResizeObserver(resized).observe(byId("stage"));
  sizes.select.addEventListener("change", resized);

  const key = listen({ stage: byId("frame"), store, box, size, click: probe.at, home });
  keyboard({ key, probe, store });
  steps(store);
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

/// Whatever is dragged, turned with the wheel or held down on the keyboard is one step of undo.
function steps(store) {
  const down = new Set();
  const hold = (what) => {
    down.add(what);
    store.hold();
  };
  const release = (what) => {
    if (down.delete(what) && !down.size) store.release();
  };
  // Heard before anybody else does something about it, and let go after all have.
  // Lists and menus of the browser's own may keep the end of a press to themselves.
  const ours = ({ target, button }) => (button === 0 && !target.closest("select, input[type=color]")) || target.closest("#frame");
  addEventListener("pointerdown", (event) => ours(event) && hold(event.pointerId), true);
  for (const end of ["pointerup", "pointercancel"]) addEventListener(end, (event) => release(event.pointerId));
  addEventListener("keydown", (event) => !event.ctrlKey && !event.metaKey && !event.altKey && hold(event.code), true);
  addEventListener("keyup", (event) => release(event.code));
  addEventListener("blur", () => [...down].forEach(release));
  let ticking = 0;
  byId("frame").addEventListener("wheel", () => {
    hold("wheel");
    clearTimeout(ticking);
    ticking = setTimeout(() => release("wheel"), TICKS);
  }, { capture: true, passive: true });
  // The system's own chooser of colours says when it is done.
  addEventListener("input", (event) => event.target.type === "color" && hold("color"), true);
  addEventListener("change", () => release("color"));
}

/// Keys that work wherever the focus is, and those of the picture.
function keyboard({ key, probe, store }) {
  let probing = false;
  const help = byId("help");
  const open = () => {
    help.showModal();
    help.scrollTop = 0;
  };
  const cross = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] };
  document.addEventListener("keydown", (event) => {
    if (help.open) return;
    const { target } = event, typing = target.matches("textarea, select, input:not([type=range], [type=checkbox], [type=color])");
    const control = event.ctrlKey || event.metaKey;
    if (control && !typing && event.key.toLowerCase() === "z") (event.shiftKey ? store.redo : store.undo)();
    else if (control && !typing && event.key.toLowerCase() === "y") store.redo();
    else if (control || event.altKey || typing) return;
    else if (event.key === "?") open();
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
  byId("help-open").addEventListener("click", open);
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
/// A page that does not open: of an earlier view it still has what was made there.
function closed(error) {
  byId("numbers").textContent = "";
  const record = kept();
  const saved = record?.data && (() => download(new Blob([sceneOf(record)], { type: "application/json" }), record.name));
  if (error.status === server.GONE || error.status === server.OTHER) watchServer(saved || null).tell(error.status);
  else say(error.message);
}

if (server.hasToken) server.open().then(begin, closed);
else say("The address lacks its token: open the whole line that the command printed.");
