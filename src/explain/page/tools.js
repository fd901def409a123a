// The record, and small tools to put it on the page.
const record = JSON.parse(document.getElementById("record").textContent);
const pictures = JSON.parse(document.getElementById("pictures").textContent);
const scene = record.scene, stack = record.stack;
// Whether every slice of the stack is on record.
const whole = record.slices[0] === 0 && record.slices[1] === stack.count;

const byId = (id) => document.getElementById(id);

// An element with attributes and children; strings become text, never markup.
function make(tag, attributes, ...children) {
  const svg = ["svg", "g", "path", "line", "circle", "rect", "polygon", "polyline", "text", "image", "title", "clipPath", "defs", "marker"].includes(tag);
  const node = svg ? document.createElementNS("http://www.w3.org/2000/svg", tag) : document.createElement(tag);
  for (const [key, value] of Object.entries(attributes || {})) if (value !== undefined && value !== null) node.setAttribute(key, value);
  node.append(...children.flat(9).filter((c) => c !== null && c !== undefined && c !== false));
  return node;
}

const text = (tag, words, attributes) => make(tag, attributes, words);
const para = (...words) => make("p", {}, ...words);
const strong = (words, kind) => make("strong", kind ? { class: kind } : {}, words);
const note = (kind, ...words) => make("p", { class: "note " + (kind || "") }, ...words);
const worked = (words) => make("p", { class: "worked" }, words);

// A number in at most so many significant digits.
function num(x, digits = 5) {
  if (x === null || x === undefined) return "\u2013";
  if (!Number.isFinite(x)) return x > 0 ? "\u221e" : x < 0 ? "\u2212\u221e" : "no number";
  if (x === 0) return "0";
  const size = Math.abs(x);
  const s = size >= 1e7 || size < 1e-4 ? x.toExponential(Math.max(0, digits - 2)) : String(Number(x.toPrecision(digits)));
  return s.replace("-", "\u2212");
}
// A further term of a sum.
const plus = (x, unit, digits) => (x < 0 ? " \u2212 " : " + ") + num(Math.abs(x), digits) + unit;
const list = (xs, digits) => "(" + xs.map((x) => num(x, digits)).join(", ") + ")";
const plural = (n, one, many) => n + " " + (n === 1 ? one : many || one + "s");

// A formula: lines of text, each with a gloss if wanted.
function formula(...lines) {
  return make("div", { class: "formula" }, lines.map((l) => (Array.isArray(l) ? [text("div", l[0]), text("div", l[1], { class: "gloss" })] : text("div", l))));
}

// The volume's axes: the same letter in the same colour on the drawn box and in tables.
const AXES = ["x", "y", "z"], AXIS_COLORS = ["var(--red)", "var(--green)", "var(--blue)"];
const axisLetter = (a) => make("b", { style: `color:${AXIS_COLORS[a]}` }, AXES[a]);

// Heads that begin with < stand over words, the others over numbers; a list is put together.
function table(head, rows, options = {}) {
  const body = rows.map((row) => {
    const cells = row.cells || row;
    return make("tr", { class: row.kind }, cells.map((c) => (c instanceof Node && c.tagName === "TD" ? c : make("td", {}, c))));
  });
  const grid = make("table", {}, make("thead", {}, make("tr", {}, head.map((h) => (typeof h === "string" && h.startsWith("<") ? make("th", { scope: "col", class: "text" }, h.slice(1)) : make("th", { scope: "col" }, h))))), make("tbody", {}, body));
  return make("div", { class: "scroll" + (options.tall ? " tall" : ""), tabindex: options.tall ? 0 : undefined }, grid);
}
const words = (s) => text("td", s, { class: "text" });

const clamp01 = (x) => Math.min(1, Math.max(0, x || 0));
const css = (rgb) => "rgb(" + rgb.slice(0, 3).map((c) => Math.round(255 * clamp01(c))).join(" ") + ")";
// Every colour on the page says which of the two it is.
const straight = (rgb, digits = 4) => "straight " + list(rgb, digits);
const premultiplied = (rgb, digits = 4) => "premultiplied " + list(rgb, digits);
// A swatch of straight colour: of lights, fogs and the transfer function. What the record holds is premultiplied and has the swatches below.
const swatch = (rgb, of, title) => make("span", { class: "swatch", style: "background:" + css(rgb), title: title || straight(rgb), "data-of": of });
const straightOf = (rgb, alpha) => (alpha > 0 ? rgb.map((c) => c / alpha) : [0, 0, 0]);
// A premultiplied colour as the page shows it: straight. What is there without any opacity, as literal fog makes it, is shown as it is.
const shownOf = (rgb, alpha) => (alpha > 0 ? straightOf(rgb, alpha) : rgb);
const shownTitle = (rgb, alpha) => (alpha > 0 || rgb.every((c) => c === 0) ? straight(shownOf(rgb, alpha)) : `light without opacity ${list(rgb, 4)}`);

// Colour and opacity of fragment i after a stage (after all of them without one), and the stage that set them last.
function fragmentAfter(pixel, i, stage) {
  let found = { stage: "none", rgb: pixel.color[i], alpha: pixel.alpha[i] };
  for (const s of pixel.stages) {
    const rgb = s.columns.color && s.columns.color[i], alpha = s.columns.alpha && s.columns.alpha[i];
    if (rgb || (alpha !== undefined && alpha !== null)) found = { stage: s.name, rgb: rgb || found.rgb, alpha: alpha ?? found.alpha };
    if (s.name === stage) break;
  }
  return found;
}
// The only swatches of what is on record. The same place of the record has the same colour wherever it stands on the page.
function fragmentSwatch(pixel, i, stage) {
  const { stage: by, rgb, alpha } = fragmentAfter(pixel, i, stage);
  return swatch(shownOf(rgb, alpha), `fragment, ${by}, pixel ${pixel.x},${pixel.y}, slice ${pixel.slice[i]}`, shownTitle(rgb, alpha));
}
const stageBefore = (pixel, stage) => pixel.stages[pixel.stages.findIndex((s) => s.name === stage) - 1].name;
const twinSwatch = (pixel, name, i) => swatch(shownOf(twin(pixel, name).color[i], twin(pixel, name).alpha[i]), `fragment of ${name}, pixel ${pixel.x},${pixel.y}, slice ${twin(pixel, name).slice[i]}`, shownTitle(twin(pixel, name).color[i], twin(pixel, name).alpha[i]));
const gatheredSwatch = (pixel, name) => swatch(shownOf(twin(pixel, name).gathered.slice(0, 3), 1 - twin(pixel, name).gathered[3]), `gathered of ${name}, pixel ${pixel.x},${pixel.y}`, shownTitle(twin(pixel, name).gathered.slice(0, 3), 1 - twin(pixel, name).gathered[3]));
const pictureSwatch = (pixel) => swatch(shownOf(pixel.picture.slice(0, 3), pixel.picture[3]), `picture, pixel ${pixel.x},${pixel.y}`, shownTitle(pixel.picture.slice(0, 3), pixel.picture[3]));

const toData = (x) => (x === null ? null : record.scale * x + record.offset);
const isNumberPlain = record.scale === 1 && record.offset === 0;

// Entry i of a quantity that a stage set, or null.
function column(pixel, stage, quantity, i) {
  const s = pixel.stages.find((s) => s.name === stage);
  const c = s && s.columns[quantity];
  return c ? c[i] : null;
}
// The same after the last of several stages that ran.
function latest(pixel, stages, quantity, i) {
  let found = null;
  for (const name of stages) {
    const x = column(pixel, name, quantity, i);
    if (x !== null && x !== undefined) found = x;
  }
  return found;
}
// Bits of a mask in hex as 64 booleans, first pixel first.
function bits(hex) {
  if (hex === null) return new Array(64).fill(true);
  const all = BigInt("0x" + hex);
  return Array.from({ length: 64 }, (_, i) => ((all >> BigInt(i)) & 1n) === 1n);
}
const geometryOf = (k) => stack.slices[k - record.slices[0]];
const twin = (pixel, name) => pixel.twins[name];
// What a pixel had gathered before entry i of its record or of a twin.
const before = (of, start, i) => (i > 0 ? { sum: of.sum[i - 1], t: of.transmittance[i - 1] } : { sum: start.slice(0, 3), t: start[3] });
