// Plots as SVG: axes, lines, marks.
class Plot {
  constructor(x, y, options = {}) {
    // Narrow screens get a narrow plot, not a small one.
    const keys = options.keys || [], w = byId("panels").clientWidth < 520 ? 400 : 620, across = Math.floor((w - 60) / 165);
    Object.assign(this, { x, y, w, h: options.height || 260, left: 58, right: 14, top: 12 + 18 * Math.ceil(keys.length / across), bottom: options.bottom || 42 });
    this.root = make("svg", { viewBox: `0 0 ${this.w} ${this.h}`, class: "chart", role: "img", "aria-label": options.label || "plot" });
    Plot.made = (Plot.made || 0) + 1;
    this.clip = `url(#plot${Plot.made})`;
    this.root.append(make("defs", {}, make("clipPath", { id: "plot" + Plot.made }, make("rect", { x: this.left, y: this.top - 2, width: this.w - this.left - this.right, height: this.h - this.top - this.bottom + 4 }))));
    this.axes(options.xlabel, options.ylabel);
    keys.forEach(([name, color, dash], n) => {
      const kx = this.left + (n % across) * 175, ky = 14 + Math.floor(n / across) * 18;
      this.root.append(make("line", { x1: kx, x2: kx + 24, y1: ky - 4, y2: ky - 4, stroke: color, "stroke-width": 3, "stroke-dasharray": dash }), make("text", { x: kx + 30, y: ky, class: "small" }, name));
    });
  }
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
    const g = make("g", { stroke: "var(--line)" }), t = make("g", {});
    for (const v of Plot.ticks(...this.x, this.w / 90)) {
      g.append(make("line", { x1: this.px(v), x2: this.px(v), y1: this.top, y2: this.h - this.bottom, "stroke-opacity": 0.6 }));
      t.append(make("text", { x: this.px(v), y: this.h - this.bottom + 15, "text-anchor": "middle", class: "small soft" }, num(v, 5)));
    }
    for (const v of Plot.ticks(...this.y, 5)) {
      g.append(make("line", { x1: this.left, x2: this.w - this.right, y1: this.py(v), y2: this.py(v), "stroke-opacity": 0.6 }));
      t.append(make("text", { x: this.left - 6, y: this.py(v) + 4, "text-anchor": "end", class: "small soft" }, num(v, 4)));
    }
    if (xlabel) t.append(make("text", { x: (this.left + this.w - this.right) / 2, y: this.h - 8, "text-anchor": "middle", class: "soft" }, xlabel));
    if (ylabel) t.append(make("text", { x: 14, y: (this.top + this.h - this.bottom) / 2, "text-anchor": "middle", transform: `rotate(-90 14 ${(this.top + this.h - this.bottom) / 2})`, class: "soft" }, ylabel));
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
    const end = this.px(x) > this.w - 150;
    this.root.append(make("line", { x1: this.px(x), x2: this.px(x), y1: this.top, y2: this.h - this.bottom, stroke: color, "stroke-width": 1.5, "stroke-dasharray": "5 3" }));
    if (name) this.root.append(make("text", { x: this.px(x) + (end ? -5 : 5), y: high ? this.top + 11 : this.h - this.bottom - 7, "text-anchor": end ? "end" : "start", class: "small halo" }, name));
    return this;
  }
  level(y, color, name, below = false) {
    if (y < this.y[0] || y > this.y[1]) return this;
    this.root.append(make("line", { x1: this.left, x2: this.w - this.right, y1: this.py(y), y2: this.py(y), stroke: color, "stroke-dasharray": "2 3" }));
    if (name) this.root.append(make("text", { x: this.w - this.right - 4, y: this.py(y) + (below ? 13 : -5), "text-anchor": "end", class: "small halo" }, name));
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
