// The editor of the transfer function: points of opacity over the histogram, points of colour below it.
//
// Opacity is drawn on a scale of square roots unless that is turned off: most of the opacities in use are small.

import { button, follow, hex, make, put, rgbOf } from "./dom.js";
import { numberInput } from "./fields.js";
import { at, withKey } from "./store.js";
import { clamp, short } from "./vectors.js";

const WIDTH = 320, HEIGHT = 150, STRIP = 18, LEFT = 26, RIGHT = 8, TOP = 8;
const INNER = WIDTH - LEFT - RIGHT;

/// The place of `value` between points that are sorted by their first number.
function between(points, value) {
  const n = points.findIndex((p) => p[0] > value);
  if (n < 0) return points.at(-1).slice(1);
  if (n === 0) return points[0].slice(1);
  const [a, b] = [points[n - 1], points[n]], t = (value - a[0]) / (b[0] - a[0]);
  return a.slice(1).map((x, k) => x + t * (b[k + 1] - x));
}

/// Builds the editor in `host`.
export function createTransfer({ host, store, volume, histogram, say }) {
  const range = histogram ? [histogram.low, histogram.high] : volume.range ?? [0, 1];
  const view = { logCounts: true, roots: true };
  let chosen = { list: "opacity", n: 0 };

  const plot = make("svg", { viewBox: `0 0 ${WIDTH} ${HEIGHT + STRIP + 30}`, class: "transfer", role: "group", "aria-label": "Transfer function" });
  const under = make("g", {}), curve = make("polyline", { class: "curve" }), dots = make("g", {});
  const stops = make("linearGradient", { id: "strip-colors" });
  const strip = make("rect", { x: LEFT, y: HEIGHT + 6, width: INNER, height: STRIP, fill: "url(#strip-colors)", class: "strip" });
  const field = make("rect", { x: LEFT, y: TOP, width: INNER, height: HEIGHT - TOP, fill: "transparent", class: "field" });
  plot.append(make("defs", {}, stops), under, field, strip, curve, dots);

  const list = (name) => at(store.document, `transfer.${name}`) ?? [];
  // Points may lie outside the data; they stay reachable.
  const span = () => {
    const values = [...list("opacity"), ...list("color")].map((p) => p[0]);
    const [low, high] = [Math.min(range[0], ...values), Math.max(range[1], ...values)];
    return high > low ? [low, high] : [low - 0.5, low + 0.5];
  };
  const x = (value) => LEFT + (INNER * (value - span()[0])) / (span()[1] - span()[0]);
  const valueAt = (px) => span()[0] + ((px - LEFT) / INNER) * (span()[1] - span()[0]);
  const up = (opacity) => (view.roots ? Math.sqrt(opacity) : opacity);
  const y = (opacity) => HEIGHT - (HEIGHT - TOP) * up(clamp(opacity, 0, 1));
  const opacityAt = (py) => {
    const share = clamp((HEIGHT - py) / (HEIGHT - TOP), 0, 1);
    return view.roots ? share * share : share;
  };
  const place = (event) => {
    const area = plot.getBoundingClientRect(), unit = area.width / WIDTH;
    return [(event.clientX - area.left) / unit, (event.clientY - area.top) / unit];
  };

  const write = (name, points) => store.set(withKey(store.document, `transfer.${name}`, points));

  /// Moves point `n` of a list to `value`, between its neighbours, with other numbers in the place of its own where given.
  function move(name, n, value, others) {
    const points = list(name).map((p) => [...p]);
    const low = points[n - 1]?.[0] ?? -Infinity, high = points[n + 1]?.[0] ?? Infinity;
    points[n] = [clamp(value, low, high), ...(others ?? points[n].slice(1))];
    write(name, points);
  }

  function insert(name, value, others) {
    const points = list(name), n = points.filter((p) => p[0] <= value).length;
    chosen = { list: name, n };
    write(name, [...points.slice(0, n), [value, ...others], ...points.slice(n)]);
    dots.querySelector(`[data-point="${name}-${n}"]`)?.focus();
  }

  /// A point halfway to the next one, on the line.
  function addBeside() {
    const { list: name, n } = chosen, points = list(name);
    if (!points.length) return;
    const next = points[n + 1] ?? points[n - 1], value = next ? 0.5 * (points[n][0] + next[0]) : points[n][0] + 1;
    insert(name, value, between(points, value));
  }

  function remove() {
    const { list: name, n } = chosen, points = list(name);
    if (points.length < 2) return;
    chosen = { list: name, n: Math.max(0, n - 1) };
    write(name, points.filter((_, k) => k !== n));
    dots.querySelector(`[data-point="${name}-${chosen.n}"]`)?.focus();
  }

  /// The element of point `n`, made once for each place in the list.
  const elements = new Map();
  function element(name, n) {
    const id = `${name}-${n}`;
    if (elements.has(id)) return elements.get(id);
    const shape = name === "opacity" ? make("circle", { r: 6 }) : make("path", {});
    put(shape, { class: `point ${name}`, "data-point": id, role: "slider", tabindex: 0 });
    follow(shape, {
      begin: () => choose(name, n),
      move: (event) => {
        const [px, py] = place(event);
        move(name, n, valueAt(clamp(px, LEFT, LEFT + INNER)), name === "opacity" ? [opacityAt(py)] : null);
      },
    });
    shape.addEventListener("focus", () => choose(name, n));
    shape.addEventListener("keydown", (event) => {
      const point = list(name)[n], step = ((span()[1] - span()[0]) / 200) * (event.shiftKey ? 10 : 1);
      const rise = (by) => name === "opacity" && move(name, n, point[0], [opacityAt(y(point[1]) - by)]);
      const act = {
        ArrowLeft: () => move(name, n, point[0] - step),
        ArrowRight: () => move(name, n, point[0] + step),
        ArrowUp: () => rise(event.shiftKey ? 15 : 1.5),
        ArrowDown: () => rise(event.shiftKey ? -15 : -1.5),
        Delete: remove,
        Backspace: remove,
        Enter: addBeside,
        Insert: addBeside,
        " ": () => {
          value.input.focus();
          value.input.select();
        },
      }[event.key];
      if (!act) return;
      event.preventDefault();
      event.stopPropagation();
      act();
    });
    elements.set(id, shape);
    return shape;
  }

  plot.addEventListener("dblclick", (event) => {
    const [px, py] = place(event), value = valueAt(clamp(px, LEFT, LEFT + INNER));
    if (event.target === field && list("opacity").length) insert("opacity", value, [opacityAt(py)]);
    if (event.target === strip && list("color").length) insert("color", value, between(list("color"), value));
  });

  const number = (label, more) => {
    const input = numberInput({ label, say, ...more });
    return { input, row: make("label", { class: "exact" }, label, input) };
  };
  const point = () => list(chosen.list)[chosen.n] ?? [0, 0];
  const value = number("Value", {
    now: () => short(point()[0], 6),
    set: (v) => {
      move(chosen.list, chosen.n, v);
      if (point()[0] !== v) say(`Value: a point lies between its neighbours; it is at ${short(point()[0], 6)} now.`);
    },
  });
  const opacity = number("Opacity", { min: 0, max: 1, now: () => short(point()[1], 3), set: (a) => move("opacity", chosen.n, point()[0], [a]) });
  const color = make("input", { type: "color", input: () => move("color", chosen.n, list("color")[chosen.n][0], rgbOf(color.value)) });
  const colorRow = make("label", { class: "exact" }, "Colour", color);
  const perUnit = () => at(store.document, "transfer.opacity_unit");
  const unit = number("Opacity is per", {
    now: () => (perUnit() === undefined ? "" : short(perUnit(), 4)),
    set: (length) => {
      if (length > 0) store.set(withKey(store.document, "transfer.opacity_unit", length));
      else say(`Opacity is per: a length is above 0; it stays ${short(perUnit(), 4)}.`);
    },
  });
  unit.row.title = "The length that opacities refer to, in the world's units";
  const addButton = button("Add a point", addBeside), removeButton = button("Remove it", remove);
  const toggle = (label, key) => {
    const box = make("input", { type: "checkbox", change: () => ((view[key] = box.checked), update()) });
    box.checked = view[key];
    return make("label", { class: "check" }, box, label);
  };
  const none = make("p", { class: "soft" }, "This scene has no points of its own here. A preset gives it some.");
  const tools = make("div", { class: "row" }, value.row, opacity.row, colorRow, addButton, removeButton);
  const which = make("p", { class: "soft", id: "chosen-point" });
  host.append(plot, none, which, tools, make("div", { class: "row" }, unit.row, toggle("Counts on a log scale", "logCounts"), toggle("Opacity on a root scale", "roots")));

  function choose(name, n) {
    chosen = { list: name, n };
    showChosen();
  }

  function showChosen() {
    const points = list(chosen.list);
    if (!points.length && list("opacity").length + list("color").length) chosen = { list: list("opacity").length ? "opacity" : "color", n: 0 };
    const shown = list(chosen.list)[Math.min(chosen.n, list(chosen.list).length - 1)];
    chosen.n = Math.max(0, Math.min(chosen.n, list(chosen.list).length - 1));
    tools.hidden = which.hidden = !shown;
    if (!shown) return;
    const isColor = chosen.list === "color";
    which.textContent = `Point ${chosen.n + 1} of ${list(chosen.list).length} of ${isColor ? "colour" : "opacity"}`;
    opacity.row.hidden = isColor;
    colorRow.hidden = !isColor;
    value.input.show(short(shown[0], 6));
    if (isColor) {
      if (document.activeElement !== color) color.value = hex(shown.slice(1));
    } else opacity.input.show(short(shown[1], 3));
    removeButton.disabled = list(chosen.list).length < 2;
    for (const [id, shape] of elements) shape.classList.toggle("chosen", id === `${chosen.list}-${chosen.n}`);
  }

  function drawUnder() {
    const parts = [], counts = histogram?.counts ?? [];
    const tall = (count) => (view.logCounts ? Math.log1p(count) : count);
    const most = Math.max(1e-9, ...counts.map(tall)), wide = (histogram ? histogram.high - histogram.low : 0) / Math.max(counts.length, 1);
    if (counts.length) {
      const steps = counts.map((count, n) => {
        const top = HEIGHT - (HEIGHT - TOP) * (tall(count) / most);
        return `L${x(histogram.low + n * wide)} ${top}L${x(histogram.low + (n + 1) * wide)} ${top}`;
      });
      parts.push(make("path", { class: "histogram", d: `M${x(histogram.low)} ${HEIGHT}${steps.join("")}L${x(histogram.high)} ${HEIGHT}Z` }));
    }
    for (const tick of view.roots ? [0, 0.01, 0.1, 0.3, 0.6, 1] : [0, 0.25, 0.5, 0.75, 1]) {
      parts.push(make("line", { class: "tick", x1: LEFT, x2: LEFT + INNER, y1: y(tick), y2: y(tick) }));
      parts.push(make("text", { x: LEFT - 3, y: y(tick) + 3, "text-anchor": "end" }, String(tick)));
    }
    const [low, high] = span(), base = HEIGHT + STRIP + 24;
    parts.push(make("text", { x: LEFT, y: base }, short(low)));
    parts.push(make("text", { x: LEFT + INNER / 2, y: base, "text-anchor": "middle" }, volume.unit ?? "value"));
    parts.push(make("text", { x: LEFT + INNER, y: base, "text-anchor": "end" }, short(high)));
    under.replaceChildren(...parts);
  }

  function update() {
    const opacities = list("opacity"), colors = list("color");
    none.hidden = opacities.length + colors.length > 0;
    plot.toggleAttribute("hidden", !none.hidden);
    drawUnder();
    const ends = opacities.length ? [[span()[0], opacities[0][1]], ...opacities, [span()[1], opacities.at(-1)[1]]] : [];
    put(curve, { points: ends.map(([v, a]) => `${x(v)},${y(a)}`).join(" ") });
    const offset = (v) => clamp((v - span()[0]) / (span()[1] - span()[0]), 0, 1);
    stops.replaceChildren(...colors.map(([v, ...rgb]) => make("stop", { offset: offset(v), "stop-color": hex(rgb) })));
    strip.toggleAttribute("hidden", !colors.length);
    const shapes = [];
    opacities.forEach(([v, a], n) => {
      const label = { "aria-label": `Opacity point ${n + 1}`, "aria-valuenow": short(v), "aria-valuetext": `value ${short(v)}, opacity ${short(a, 3)}` };
      shapes.push(put(element("opacity", n), { cx: x(v), cy: y(a), ...label }));
    });
    colors.forEach(([v, ...rgb], n) => {
      const top = HEIGHT + 6 + STRIP, d = `M${x(v)} ${top - 8}l6 9v7h-12v-7Z`;
      const label = { "aria-label": `Colour point ${n + 1}`, "aria-valuenow": short(v), "aria-valuetext": `value ${short(v)}, ${hex(rgb)}` };
      shapes.push(put(element("color", n), { d, fill: hex(rgb), ...label }));
    });
    const there = [...dots.children];
    if (there.length !== shapes.length || there.some((e, n) => e !== shapes[n])) dots.replaceChildren(...shapes);
    unit.row.hidden = perUnit() === undefined;
    if (perUnit() !== undefined) unit.input.show(short(perUnit(), 4));
    showChosen();
  }

  return { update };
}
