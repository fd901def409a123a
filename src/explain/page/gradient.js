// The step Gradient, and colour and opacity that depend on it: for scenes that take gradients.
Object.assign(MEANINGS, { normal: "n", steepness: "|g|", tau: "\u03c4", ctau: "c\u03c4" });
const slabs = (x) => num(x, 5) + (num(x, 5) === "1" ? " slab" : " slabs");
const minus = (a, b) => a.map((x, c) => x - b[c]);
const dot3 = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const unit3 = (a) => { const l = Math.hypot(...a); return l > 0 ? a.map((x) => x / l) : [0, 0, 0]; };
// Where opacity depends on the gradient classification leaves optical depths.
if (record.by_gradient) for (const p of record.pixels) for (const s of p.stages) if (s.name === "classify") {
  const { color, alpha, ...others } = s.columns;
  s.columns = { ...others, ...(color ? { ctau: color } : {}), ...(alpha ? { tau: alpha } : {}) };
}
const entry = (pixel, key, i) => (pixel[key] && i >= 0 ? pixel[key][i] : null);
// The gradient that the stage left, from its normal and size.
function leftGradient(pixel, i) {
  const n = column(pixel, "gradient", "normal", i), size = column(pixel, "gradient", "steepness", i);
  return n && size !== null ? n.map((x) => -x * size) : null;
}
// What differs by more than rounding at entry i of a pixel, in words.
function differences(pixel, i) {
  const g = entry(pixel, "gradient", i), b = entry(pixel, "by_gradient", i), l = entry(pixel, "light", i), said = [];
  if (g) {
    const left = leftGradient(pixel, i);
    if (g.aside > 1e-3) said.push(`the place of the lookup (by ${num(g.aside, 3)} voxels)`);
    if (!left || !(Math.max(...minus(left, g.g).map(Math.abs)) <= g.rounding)) said.push("the gradient");
  }
  if (b && !(Math.max(...minus(b.left.slice(0, 3), b.want).map(Math.abs), Math.abs(b.left[3] - b.want[3])) <= b.rounding)) said.push("the colour by gradient");
  if (l && !(Math.max(...minus(l.left, l.lit).map(Math.abs)) <= l.rounding)) said.push("the lit colour");
  return said;
}
const faulty = record.pixels.flatMap((p) => p.slice.map((k, i) => ({ p, k, said: differences(p, i) })).filter((f) => f.said.length));
if (faulty.length) {
  const { p, k, said } = faulty[0];
  record.notes.unshift(`Recorded and recomputed numbers differ by more than rounding at ${plural(faulty.length, "fragment")}, first at pixel ${p.x}, ${p.y} on slice ${k}: ${said.join(", ")}.`);
}
function agreement(pixel, i) {
  const said = differences(pixel, i);
  if (said.length) return note("wrong", strong("Recorded and recomputed numbers differ by more than rounding: ", "bad"), said.join(", ") + ".");
  return worked("Recomputed here means: in f64, from the voxels of the volume and the camera's ray, without the pipeline. It agrees with what the stages left, within the rounding of f32.");
}

// Arrows from a point, as the eye sees them: to the right, up, and towards it.
function arrowsDrawing(arrows, label) {
  const forward = unit3(record.axes.forward), right = unit3(record.axes.right), up = unit3(record.axes.up);
  const view = make("svg", { viewBox: "40 25 280 240", class: "chart small-chart", role: "img", "aria-label": label }), o = [180, 145], r = 100;
  view.append(make("circle", { cx: o[0], cy: o[1], r, fill: "none", stroke: "var(--line)" }));
  // Seen from a little to the right and from above, so that what points at the eye has a length too.
  const flat = (v) => { const x = dot3(v, right), y = dot3(v, up), z = -dot3(v, forward); return [o[0] + r * (x * 0.88 - z * 0.47), o[1] - r * (y * 0.95 - z * 0.27 - x * 0.145)]; };
  const room = new Room(42, 27, 318, 263);
  room.take(o[0] - 5, o[1] - 5, o[0] + 5, o[1] + 5);
  for (const [v, name, color, dash] of arrows) {
    const [x, y] = flat(v), dx = x - o[0], dy = y - o[1], l = Math.hypot(dx, dy);
    view.append(make("line", { x1: o[0], y1: o[1], x2: x, y2: y, stroke: color, "stroke-width": dash ? 1.3 : 2.6, "stroke-dasharray": dash }));
    if (l > 6) view.append(make("path", { d: `M${x} ${y}L${x - (dx * 11 + dy * 5) / l} ${y - (dy * 11 - dx * 5) / l}L${x - (dx * 11 - dy * 5) / l} ${y - (dy * 11 + dx * 5) / l}Z`, fill: color }));
    const label = room.beside(name, [x, y], [dx, dy], 4, { class: "halo", fill: color });
    if (label) view.append(label);
  }
  view.append(make("circle", { cx: o[0], cy: o[1], r: 4, fill: "var(--bad)" }));
  return view;
}
const voxelAxes = () => { const m = record.gradient ? record.gradient.matrix : null; return m ? AXES.map((name, a) => [unit3(m.map((row) => row[a])), name, AXIS_COLORS[a], "4 3"]) : []; };
const eyeOf = (pixel, i) => { const l = entry(pixel, "light", i); return (l && l.to_eye) || (record.light && record.light.to_eye) || unit3(record.axes.forward).map((x) => -x); };

function gradientPanel(place) {
  const { pixel, i } = place, parts = [], all = record.gradient;
  parts.push(para("The gradient g says which way the values rise, and how steeply. Where it is steep there is a boundary; n = \u2212g / |g| points from dense to thin, as the normal of a surface does."));
  const need = para(`Gradients cost lookups of their own, so they are taken only of fragments of which something shows. This picture needed ${all.taken.toLocaleString("en")} of them, for ${all.lanes.toLocaleString("en")} lookups of a value (${num((100 * all.taken) / Math.max(1, all.lanes), 3)} %).`);
  if (i < 0) return [...parts, passed(place), need];
  const g = entry(pixel, "gradient", i);
  if (!g) return [...parts, note("", pixel.covered[i] ? "No gradient was taken here: nothing of this fragment shows." : "The slice does not cover this pixel: there is no gradient to tell of."), need];
  parts.push(text("h3", "Differences along the voxel axes"));
  const per = " per voxel";
  if (all.kind === "central") {
    parts.push(para("Central differences: the interpolated values one voxel before and one behind the fragment, along each axis; half of their difference."));
    parts.push(table(["axis", "index", "value before", "value behind", "half of it"], AXES.map((_, n) => [axisLetter(n), num(g.at[n], 6), num(g.around[2 * n], 6), num(g.around[2 * n + 1], 6), num(g.along[n], 5)])));
  } else if (all.kind === "analytic") {
    parts.push(para("The analytic gradient: the derivative of trilinear interpolation itself, from the same eight voxels as the value. Along each axis the four differences of neighbours, weighted as the value is along the other two."));
    parts.push(table(["x, y, z in the cell", "value"], g.around.map((v, n) => [`${n & 1}, ${(n >> 1) & 1}, ${n >> 2}`, num(v, 6)])));
    parts.push(table(["axis", "index", "difference" + per], AXES.map((_, n) => [axisLetter(n), num(g.at[n], 6), num(g.along[n], 5)])));
  } else {
    parts.push(para("Sobel's gradient: central differences smoothed with the weights 1 2 1 along both other axes, 64 voxels in all. Noise that differs from voxel to voxel mostly cancels."));
    parts.push(table(["axis", "index", "difference" + per], AXES.map((_, n) => [axisLetter(n), num(g.at[n], 6), num(g.along[n], 5)])));
  }
  const size = Math.hypot(...g.g), n = unit3(g.g).map((x) => -x), left = leftGradient(pixel, i), leftNormal = column(pixel, "gradient", "normal", i), leftSize = column(pixel, "gradient", "steepness", i);
  parts.push(text("h3", "Into world space"));
  parts.push(para("The volume's axes may be long, short or oblique. A gradient goes through the transposed inverse of the matrix M that turns steps of voxels into steps in space: a difference over a long step is a gentle slope."));
  parts.push(formula(...["X", "Y", "Z"].map((a, r) => `g_${a} = ${all.matrix[r].map((m, c) => (c ? plus(m, "", 4) : num(m, 4)) + " \u00b7 " + (g.along[c] < 0 ? `(${num(g.along[c], 4)})` : num(g.along[c], 4))).join("")} = ${num(g.g[r], 5)}`), [`|g| = ${num(size, 6)}`, "data units per world unit"], size > 0 ? [`n = \u2212g / |g| = ${list(n, 5)}`, "world space"] : "g = 0: there is no direction, and light leaves the colour as it is"));
  parts.push(text("h3", "Recomputed, and as the stage left it"));
  parts.push(table(["", "n, X", "n, Y", "n, Z", "|g|"], [[words("recomputed"), ...n.map((x) => num(x, 6)), num(size, 6)], [words("recorded"), ...(leftNormal || [null, null, null]).map((x) => num(x, 6)), num(leftSize, 6)], [words("difference of g; rounding"), ...(left || [NaN, NaN, NaN]).map((x, c) => num(x - g.g[c], 2)), `\u00b1 ${num(g.rounding, 2)}`]]));
  parts.push(agreement(pixel, i));
  if (size > 0) parts.push(make("figure", {}, arrowsDrawing([...voxelAxes(), [eyeOf(pixel, i), "to the eye", "var(--accent)"], [n, "n", "var(--bad)"]], "the normal, the eye and the axes"), make("figcaption", {}, "The fragment as seen almost from the eye, a little from the right and above. Red: the normal n; blue: the direction to the eye; dashed: the volume's axes x, y, z.")));
  return [...parts, steepnessPlot(pixel, place), need];
}
// A number of each recorded fragment along the ray.
const alongRay = (pixel, f) => pixel.slice.map((k, n) => [k, pixel.covered[n] ? f(n) : null]).filter((p) => p[1] !== null && p[1] !== undefined && Number.isFinite(p[1])).sort((a, b) => a[0] - b[0]);
const rayRange = () => [record.slices[0], Math.max(record.slices[0] + 1, record.slices[1])];
// Lines and dots, broken where slices are missing.
function broken(plot, points, color, options = {}) {
  let run = [];
  const end = () => { if (run.length > 1) plot.line(run, color, options); else if (run.length) plot.dot(run[0][0], run[0][1], color, 2); run = []; };
  for (const p of points) { if (run.length && p[0] > run[run.length - 1][0] + 1) end(); run.push(p); }
  end();
}
function steepnessPlot(pixel, place) {
  const points = alongRay(pixel, (n) => (pixel.gradient[n] ? column(pixel, "gradient", "steepness", n) : null));
  if (!points.length) return null;
  const plot = new Plot(rayRange(), [0, 1.05 * (Math.max(...points.map((p) => p[1])) || 1)], { height: 230, xlabel: "slice", ylabel: "|g|", label: "size of the gradient along the ray" });
  broken(plot, points, "var(--accent)");
  plot.mark(place.k, "var(--bad)", "slice " + place.k, true);
  return make("figure", {}, plot.root, make("figcaption", {}, "|g| along the ray, where it was taken; recorded."));
}

// 4. Colour, where it depends on the gradient.
function byGradientPanel(place) {
  const { pixel, i } = place, parts = [], by = record.by_gradient, b = entry(pixel, "by_gradient", i), g = entry(pixel, "gradient", i), two = !by.points || !by.points.length;
  const size = g ? Math.hypot(...g.g) : null, value = i >= 0 ? toData(pixel.value[i]) : null;
  if (two) {
    parts.push(para("This scene's transfer function is over a plane: values to the right, sizes of gradients upwards. Regions of that plane have a colour and an opacity; where they overlap their extinctions add up, and straight colours weigh by extinction."));
    const plot = new Plot(by.plane[0], by.plane[1], { height: 330, xlabel: "value, in the data's units", ylabel: "|g|", label: "regions of the plane of values and gradients" });
    plot.root.append(make("image", { href: pictures.plane, x: plot.left, y: plot.top, width: plot.w - plot.left - plot.right, height: plot.h - plot.top - plot.bottom, preserveAspectRatio: "none" }));
    pixel.slice.forEach((k, n) => { const o = pixel.gradient && pixel.gradient[n]; if (o && n !== i) plot.dot(toData(pixel.value[n]), Math.hypot(...o.g), "var(--grey)", 2.5, "slice " + k); });
    if (g) plot.mark(value, "var(--bad)", "value " + num(value)).dot(value, size, "var(--bad)", 6);
    parts.push(make("figure", {}, plot.root, make("figcaption", {}, "Colours: what the transfer function gives, more opaque where it is denser. Red: this fragment; grey: the others of this ray.")));
  } else {
    parts.push(para("The transfer function gives each value a straight colour and an opacity per L\u2080; the size of the gradient weakens the extinction by a factor f(|g|), so that boundaries show more than what lies between them."));
    const a = i >= 0 ? pixel.exact[i][3] : null, top = by.plane[1][1], curve = [[0, piecewise(by.points, 0)[0]], ...by.points, [top, piecewise(by.points, top)[0]]];
    const plot = new Plot([0, top], [0, 1.05], { height: 230, xlabel: "|g|, data units per world unit", ylabel: "factor f", label: "gradient opacity" });
    plot.line(curve, "var(--accent)", { width: 2.5 });
    if (g && b) plot.mark(size, "var(--bad)", "|g| = " + num(size, 4)).dot(size, b.shares[0], "var(--bad)", 5);
    parts.push(make("figure", {}, transferPlot(i >= 0 ? [{ value, opacity: a, name: "value " + num(value) }] : []), make("figcaption", {}, "By the value: blue: opacity per L\u2080; the band: the straight colour; grey: how often values occur.")), make("figure", {}, plot.root, make("figcaption", {}, "By the gradient: the factor on the extinction.")));
  }
  if (i < 0) return [...parts, passed(place)];
  if (!b) return [...parts, note("", "No gradient was taken here, so nothing of this fragment shows.")];
  const length = pixel.length[i];
  if (two) {
    if (by.regions) parts.push(table(["region", "straight", "strength here", "opacity per L\u2080"], by.regions.map((r, n) => [`${r.shape} at ${num(r.value, 4)}`, swatch(r.color), num(b.shares[n], 4), num(r.opacity * b.shares[n], 4)])));
    parts.push(formula([`\u03c4 = \u03a3 \u2212ln(1 \u2212 opacity) \u00b7 D / L\u2080, D / L\u2080 = ${num(scene.ratio, 5)}`, "extinctions of the regions, over the thickness of one slab"], [`A = 1 \u2212 exp(\u2212\u03c4 \u00b7 ${num(length, 5)}) = ${num(b.want[3], 6)}`, `this piece of the ray is ${slabs(length)} long`]));
  } else {
    parts.push(formula([`\u03c4 = ${num(b.before[3], 6)}`, "optical depth of one slab by the value alone, as the stage classify left it"], [`f(|g|) = f(${num(size, 5)}) = ${num(b.shares[0], 5)}`, "the factor"], [`A = 1 \u2212 exp(\u2212\u03c4 \u00b7 f \u00b7 length) = 1 \u2212 exp(\u2212${num(b.before[3], 4)} \u00b7 ${num(b.shares[0], 4)} \u00b7 ${num(length, 4)}) = ${num(b.want[3], 6)}`, `this piece of the ray is ${slabs(length)} long; without the factor A would be ${num(-Math.expm1(-b.before[3] * length), 5)}`]));
  }
  parts.push(table(["", "", "<premultiplied colour", "A"], [["recomputed", swatch(shownOf(b.want.slice(0, 3), b.want[3])), words(list(b.want.slice(0, 3), 5)), num(b.want[3], 6)], ["recorded", fragmentSwatch(pixel, i, two ? "classify by gradient" : "gradient opacity"), words(list(b.left.slice(0, 3), 5)), num(b.left[3], 6)]]), agreement(pixel, i));
  return parts;
}
const stepAt = (name) => STEPS.findIndex((s) => s.name === name);
if (record.by_gradient) STEPS[stepAt("Colour")].show = byGradientPanel;
if (record.gradient) STEPS.splice(stepAt("Colour"), 0, { name: "Gradient", title: "Which way the values rise", show: gradientPanel });
