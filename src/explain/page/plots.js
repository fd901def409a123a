// Room for labels, of which none lies on another. Widths are measured as the page writes them.
const ruler = document.createElement("canvas").getContext("2d");
// The page's own style would win over attributes.
const textStyle = (size, bold, fill) => `font-size:${size}px` + (bold ? ";font-weight:600" : "") + (fill ? `;fill:${fill}` : "");
const narrow = () => byId("panels").clientWidth < 520;
class Room {
  // The four sides: left, top, right, bottom.
  constructor(...sides) { Object.assign(this, { sides, taken: [] }); }
  static width(words, size, bold) {
    ruler.font = `${bold ? "600 " : ""}${size}px system-ui, "Liberation Sans", sans-serif`;
    return ruler.measureText(words).width;
  }
  // Whether the rectangle is free; it is taken then.
  take(left, top, right, bottom) {
    if (left < this.sides[0] || top < this.sides[1] || right > this.sides[2] || bottom > this.sides[3]) return false;
    if (this.taken.some((t) => left < t[2] && t[0] < right && top < t[3] && t[1] < bottom)) return false;
    this.taken.push([left, top, right, bottom]);
    return true;
  }
  // Text at the first of places [x, y, anchor] where it is free; nothing where none is.
  label(words, places, { fill, ...attributes } = {}, size = 13, bold = false) {
    const width = Room.width(words, size, bold);
    for (const [x, y, anchor = "start"] of places) {
      const left = anchor === "middle" ? x - width / 2 : anchor === "end" ? x - width : x;
      if (this.take(left - 2, y - 0.85 * size, left + width + 2, y + 0.27 * size)) return make("text", { x, y, "text-anchor": anchor, style: textStyle(size, bold, fill), ...attributes }, words);
    }
    return null;
  }
  // The same beside a point: first in the direction given, then around it, then farther away.
  beside(words, [x, y], [dx, dy], gap, attributes, size = 13, bold = false) {
    const width = Room.width(words, size, bold), l = Math.hypot(dx, dy), start = l > 0 ? Math.atan2(dy, dx) : -Math.PI / 2, places = [];
    for (let ring = 0; ring < 24; ring++) for (let n = 0; n < 16; n++) {
      const angle = start + ((n % 2 ? n + 1 : -n) / 2) * (Math.PI / 8), u = Math.cos(angle), v = Math.sin(angle), out = gap + 5 * ring + (Math.abs(u) * width + Math.abs(v) * size) / 2;
      places.push([x + u * out, y + v * out + 0.29 * size, "middle"]);
    }
    return this.label(words, places, attributes, size, bold);
  }
}

// Plots as SVG: axes, lines, marks.
class Plot {
  constructor(x, y, options = {}) {
    // Narrow screens get a narrow plot, not a small one.
    const keys = options.keys || [], w = narrow() ? 400 : 620, h = options.height || 260, room = new Room(0, 0, w, h);
    // Keys in lines, as many as fit into each.
    let kx = 58, lines = keys.length ? 1 : 0;
    const places = keys.map(([name]) => {
      const need = 46 + Room.width(name, 11);
      if (kx > 58 && kx + need > w) { kx = 58; lines += 1; }
      kx += need;
      return [kx - need, 14 + 18 * (lines - 1)];
    });
    Object.assign(this, { x, y, w, h, room, left: 58, right: 14, top: 12 + 18 * lines, bottom: options.bottom || 42 });
    this.root = make("svg", { viewBox: `0 0 ${this.w} ${this.h}`, class: "chart", role: "img", "aria-label": options.label || "plot" });
    Plot.made = (Plot.made || 0) + 1;
    this.clip = `url(#plot${Plot.made})`;
    this.root.append(make("defs", {}, make("clipPath", { id: "plot" + Plot.made }, make("rect", { x: this.left, y: this.top - 2, width: this.w - this.left - this.right, height: this.h - this.top - this.bottom + 4 }))));
    this.axes(options.xlabel, options.ylabel);
    keys.forEach(([name, color, dash], n) => {
      const [x, y] = places[n];
      this.add(make("line", { x1: x, x2: x + 24, y1: y - 4, y2: y - 4, stroke: color, "stroke-width": 3, "stroke-dasharray": dash }), room.label(name, [[x + 30, y]], { class: "small" }, 11));
    });
  }
  add(...nodes) { this.root.append(...nodes.filter(Boolean)); }
  px(v) { return this.left + ((v - this.x[0]) / (this.x[1] - this.x[0])) * (this.w - this.left - this.right); }
  py(v) { return this.h - this.bottom - ((v - this.y[0]) / (this.y[1] - this.y[0])) * (this.h - this.top - this.bottom); }
  static ticks(lo, hi, most) {
    const raw = (hi - lo) / most, power = 10 ** Math.floor(Math.log10(raw));
    const step = [1, 2, 5, 10].map((m) => m * power).find((s) => s >= raw * 0.999);
    const list = [];
    for (let v = Math.ceil(lo / step - 1e-9) * step; v <= hi + step * 1e-6; v += step) list.push(Math.abs(v) < step * 1e-9 ? 0 : v);
    return list;
  }
  axes(xlabel, ylabel) {
    const g = make("g", { stroke: "var(--line)" }), t = make("g", {}), put = (node) => node && t.append(node);
    const middle = [(this.left + this.w - this.right) / 2, (this.top + this.h - this.bottom) / 2];
    if (xlabel) put(this.room.label(xlabel, [[middle[0], this.h - 8, "middle"]], { class: "soft" }));
    if (ylabel && this.room.take(0, middle[1] - Room.width(ylabel, 13) / 2, 18, middle[1] + Room.width(ylabel, 13) / 2)) put(make("text", { x: 14, y: middle[1], "text-anchor": "middle", transform: `rotate(-90 14 ${middle[1]})`, class: "soft" }, ylabel));
    for (const v of Plot.ticks(...this.x, this.w / 90)) {
      g.append(make("line", { x1: this.px(v), x2: this.px(v), y1: this.top, y2: this.h - this.bottom, "stroke-opacity": 0.6 }));
      put(this.room.label(num(v, 5), [[this.px(v), this.h - this.bottom + 15, "middle"]], { class: "small soft" }, 11));
    }
    for (const v of Plot.ticks(...this.y, 5)) {
      g.append(make("line", { x1: this.left, x2: this.w - this.right, y1: this.py(v), y2: this.py(v), "stroke-opacity": 0.6 }));
      put(this.room.label(num(v, 4), [[this.left - 6, this.py(v) + 4, "end"]], { class: "small soft" }, 11));
    }
    this.root.append(g, t);
  }
  inside(v) { return Math.min(this.h - this.bottom + 1, Math.max(this.top - 1, this.py(v))); }
  line(points, color, options = {}) {
    const d = points.filter((p) => Number.isFinite(p[0]) && Number.isFinite(p[1]));
    const path = d.map((p, i) => (i ? "L" : "M") + this.px(p[0]).toFixed(2) + " " + Math.max(-1e4, Math.min(1e4, this.py(p[1]))).toFixed(2)).join("");
    this.root.append(make("path", { d: path || "M0 0", fill: "none", stroke: color, "stroke-width": options.width || 2, "stroke-dasharray": options.dash, "clip-path": this.clip }));
    return this;
  }
  steps(points, color, options) {
    const all = [];
    points.forEach((p, i) => { if (i) all.push([p[0], points[i - 1][1]]); all.push(p); });
    return this.line(all, color, options);
  }
  bar(x0, x1, v, color, opacity = 1) {
    const y = this.inside(v), zero = this.inside(0);
    this.root.append(make("rect", { x: this.px(x0), width: Math.max(0.5, this.px(x1) - this.px(x0)), y: Math.min(y, zero), height: Math.abs(zero - y), fill: color, "fill-opacity": opacity }));
    return this;
  }
  dot(x, y, color, r = 4, title) {
    if (Number.isFinite(x) && Number.isFinite(y)) this.root.append(make("circle", { cx: this.px(x), cy: this.inside(y), r, fill: color, stroke: "var(--paper)" }, title ? make("title", {}, title) : null));
    return this;
  }
  mark(x, color, name, high = false) {
    if (!Number.isFinite(x) || x < this.x[0] || x > this.x[1]) return this;
    const at = this.px(x), top = this.top + 11, bottom = this.h - this.bottom - 7, end = at > this.w - 150;
    this.add(make("line", { x1: at, x2: at, y1: this.top, y2: this.h - this.bottom, stroke: color, "stroke-width": 1.5, "stroke-dasharray": "5 3" }, name ? make("title", {}, name) : null));
    const heights = Array.from({ length: Math.floor((bottom - top) / 15) + 1 }, (_, n) => (high ? top + 15 * n : bottom - 15 * n));
    const right = heights.map((y) => [at + 5, y, "start"]), left = heights.map((y) => [at - 5, y, "end"]);
    if (name) this.add(this.room.label(name, end ? [...left, ...right] : [...right, ...left], { class: "small halo" }, 11));
    return this;
  }
  level(y, color, name, below = false) {
    if (y < this.y[0] || y > this.y[1]) return this;
    const at = this.py(y), above = at - 5, under = at + 13, right = this.w - this.right - 4;
    this.add(make("line", { x1: this.left, x2: this.w - this.right, y1: at, y2: at, stroke: color, "stroke-dasharray": "2 3" }, name ? make("title", {}, name) : null));
    const sides = (y) => [[right, y, "end"], [this.left + 4, y], [(this.left + right) / 2, y, "middle"]];
    if (name) this.add(this.room.label(name, below ? [...sides(under), ...sides(above)] : [...sides(above), ...sides(under)], { class: "small halo" }, 11));
    return this;
  }
}

// Linear interpolation in points [x, y...] at x; constant beyond the ends.
function piecewise(points, x) {
  if (x < points[0][0]) return points[0].slice(1);
  for (let i = points.length - 1; i >= 0; i--) {
    if (points[i][0] > x) continue;
    if (i === points.length - 1) return points[i].slice(1);
    const t = (x - points[i][0]) / (points[i + 1][0] - points[i][0]);
    return points[i].slice(1).map((v, c) => v + t * (points[i + 1][c + 1] - v));
  }
  return points[0].slice(1);
}

// The transfer function with the data's histogram, and marks at values.
function transferPlot(marks) {
  const points = [...scene.opacity, ...scene.color].map((p) => p[0]);
  let lo = Math.min(scene.range[0], ...points), hi = Math.max(scene.range[1], ...points);
  if (lo === hi) { lo -= 1; hi += 1; }
  const plot = new Plot([lo, hi], [0, 1], { height: 310, bottom: 60, xlabel: "value, in the data's units", ylabel: "opacity per L\u2080", label: "transfer function" });
  const most = Math.max(1e-12, ...scene.histogram.slice(1, -1)), n = scene.histogram.length;
  const width = (scene.range[1] - scene.range[0]) / n;
  scene.histogram.forEach((h, i) => plot.bar(scene.range[0] + i * width, scene.range[0] + (i + 1) * width, Math.min(1, Math.sqrt(h / most)) * 0.9, "var(--grey)", 0.22));
  // The colours as a band under the curve.
  const bands = 160;
  for (let i = 0; i < bands; i++) {
    const a = lo + ((hi - lo) * i) / bands, b = lo + ((hi - lo) * (i + 1)) / bands;
    plot.root.append(make("rect", { x: plot.px(a), width: plot.px(b) - plot.px(a) + 0.5, y: plot.h - plot.bottom + 19, height: 9, fill: css(piecewise(scene.color, (a + b) / 2)) }));
  }
  const curve = [[lo, piecewise(scene.opacity, lo)[0]], ...scene.opacity, [hi, piecewise(scene.opacity, hi)[0]]];
  plot.line(curve, "var(--accent)", { width: 2.5 });
  scene.opacity.forEach((p) => plot.dot(p[0], p[1], "var(--accent)", 3));
  for (const m of marks) {
    plot.mark(m.value, "var(--bad)", m.name);
    if (m.opacity !== undefined) plot.dot(m.value, m.opacity, "var(--bad)", 5);
  }
  return plot.root;
}
