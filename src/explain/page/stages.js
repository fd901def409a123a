// The steps of the pipeline, each a function from the place (pixel, slice) to what is shown.
// place: pixel, k (slice), i (entry of the pixel's record, or -1), slice (geometry), why (words, where nothing was recorded)

function vertexName(v) {
  const [a, b] = v.on.map((s) => stack.sides[s]);
  return v.on.every((s) => s < 6) ? `box edge ${a} / ${b}` : `${a} meets ${b}`;
}

function picturesvg(place, extra, label) {
  const view = make("svg", { viewBox: `0 0 ${scene.width} ${scene.height}`, role: "img", "aria-label": label, preserveAspectRatio: "none" }, extra);
  return make("div", { class: "stack checker" }, make("img", { src: pictures.picture, alt: "", width: scene.width, height: scene.height }), view);
}

// An arrow from a to b.
function arrow(a, b, color, width) {
  const dx = b[0] - a[0], dy = b[1] - a[1], l = Math.hypot(dx, dy) || 1;
  return make("g", {}, make("line", { x1: a[0], y1: a[1], x2: b[0], y2: b[1], stroke: color, "stroke-width": width }),
    make("path", { d: `M${b[0]} ${b[1]}L${b[0] - (dx * 11) / l - (dy * 5) / l} ${b[1] - (dy * 11) / l + (dx * 5) / l}L${b[0] - (dx * 11) / l + (dy * 5) / l} ${b[1] - (dy * 11) / l - (dx * 5) / l}Z`, fill: color }));
}
// Text around a place that the record has found for it.
const labelAt = (words, [x, y], size, bold, fill) => make("text", { x, y: y + 0.35 * size, "text-anchor": "middle", class: "halo", style: textStyle(size, bold, fill) }, words);

// 1. The box and the planes.
function slicesPanel(place) {
  const { pixel, k, slice } = place, parts = [];
  const [w, h] = stack.drawing, small = narrow() ? 1 : 0, { text: size, letter } = stack.sizes[small];
  const overlay = make("svg", { viewBox: `0 0 ${w} ${h}`, role: "img", "aria-label": "the box, the slice at hand and the ray of the pixel" });
  const [from, to] = pixel.drawn;
  const at = (d) => { const t = (d - stack.near) / (stack.far - stack.near); return [from[0] + t * (to[0] - from[0]), from[1] + t * (to[1] - from[1])]; };
  AXES.forEach((_, axis) => overlay.append(arrow(stack.corners[0], stack.corners[1 << axis], AXIS_COLORS[axis], 2.5)));
  if (slice && slice.vertices.length) overlay.append(make("polygon", { points: slice.vertices.map((v) => v.drawn.join(",")).join(" "), fill: "var(--accent)", "fill-opacity": 0.22, stroke: "var(--accent)", "stroke-width": 2.5 }));
  overlay.append(make("line", { x1: from[0], y1: from[1], x2: to[0], y2: to[1], stroke: "var(--bad)", "stroke-width": 1.5, "stroke-dasharray": "6 4" }));
  if (pixel.through) {
    const [a, b] = pixel.through.map(at);
    overlay.append(make("line", { x1: a[0], y1: a[1], x2: b[0], y2: b[1], stroke: "var(--bad)", "stroke-width": 2.5 }));
  }
  if (slice && pixel.through && slice.depth >= pixel.through[0] && slice.depth <= pixel.through[1]) {
    const [x, y] = at(slice.depth);
    overlay.append(make("circle", { cx: x, cy: y, r: 5, fill: "var(--bad)", stroke: "var(--paper)" }));
  }
  overlay.append(arrow(...stack.arrow, "var(--ink)", 2));
  for (const label of stack.labels[small]) {
    const axis = label.axis !== undefined;
    if (label.at) overlay.append(labelAt(label.text, label.at, axis ? letter : size, axis, axis ? AXIS_COLORS[label.axis] : undefined));
  }
  for (const v of slice ? slice.vertices : []) overlay.append(make("circle", { cx: v.drawn[0], cy: v.drawn[1], r: 4, fill: "var(--paper)", stroke: "var(--accent)", "stroke-width": 2 }));
  for (const [i, v] of (slice ? slice.vertices : []).entries()) {
    const at = v.labels[small];
    if (at) overlay.append(labelAt(String(i + 1), at, size, true));
  }
  parts.push(make("figure", { class: "drawing" }, make("div", { class: "stack" }, make("img", { src: pictures.drawing, alt: "", width: w, height: h }), overlay),
    make("figcaption", {}, "The box seen from the side. Grey: its edges; blue-grey: outlines of the stack's slices; blue: the slice at hand; red: the ray of the chosen pixel. ", axisLetter(0), ", ", axisLetter(1), ", ", axisLetter(2), ": the volume's axes, along which s, t and p grow from 0 at the corner 0 to 1. Numbers: the corners of the polygon, as in the table below.")));
  parts.push(para(`Depth d is the distance from the eye along its line of sight. The box reaches from d = ${num(stack.near)} to ${num(stack.far)}; ${plural(stack.count, "plane")} of constant depth cut it, D = ${num(stack.spacing)} apart.`));
  if (!slice) return [...parts, para("The piece at hand lies behind the last plane: from its value to that where the ray leaves the box.")];
  parts.push(formula([`d = ${num(stack.near)} + (${k} + \u00bd) \u00b7 ${num(stack.spacing)} = ${num(slice.depth, 6)}`, `plane ${k} stands in the middle of its slab, which reaches from ${num(slice.depth - stack.spacing / 2, 6)} to ${num(slice.depth + stack.spacing / 2, 6)}`]));
  if (!slice.vertices.length) return [...parts, note("", "The clip planes leave nothing of the box on this plane: it has no polygon and no fragments.")];
  const cuts = slice.vertices.filter((v) => v.on.some((s) => s >= 6)).length, edges = slice.vertices.length - cuts;
  parts.push(para(`Plane and box share a convex polygon. This one has ${plural(slice.vertices.length, "corner")}${cuts ? `: ${edges} on edges of the box, ${cuts} on clip planes` : ", one for each edge of the box that the plane meets"}. Counter-clockwise as the eye sees them:`));
  parts.push(table(["corner", "<where", "window: column, row", ...["s", "t", "p"].map((name, axis) => [`${name}, along `, axisLetter(axis)])], slice.vertices.map((v, i) => [strong(String(i + 1)), words(vertexName(v)), v.window.map((x) => num(x, 6)).join(", "), ...v.texture.map((x) => num(Math.abs(x) < 1e-12 ? 0 : x, 4))])));
  parts.push(para(stack.perspective
    ? "On a plane of constant depth the texture coordinates are affine in the window's column and row, in perspective too: between corners they need no division, and q stays 1."
    : "Parallel rays: the texture coordinates are affine in the window's column and row, and q stays 1."));
  return parts;
}

// Eight by eight pixels, enlarged.
function magnifier(x0, y0, covered, slice, chosen, label) {
  const size = 40, pad = 2, view = make("svg", { viewBox: `${-pad} ${-pad} ${8 * size + 2 * pad} ${8 * size + 2 * pad}`, class: "chart", role: "img", "aria-label": label });
  const clip = "c" + Math.random().toString(36).slice(2);
  view.append(make("defs", {}, make("clipPath", { id: clip }, make("rect", { x: 0, y: 0, width: 8 * size, height: 8 * size }))));
  for (let i = 0; i < 64; i++) view.append(make("rect", { x: (i % 8) * size, y: Math.floor(i / 8) * size, width: size, height: size, fill: covered[i] ? "var(--accent)" : "none", "fill-opacity": 0.25, stroke: "var(--line)" }));
  if (slice && slice.vertices.length) view.append(make("polygon", { points: slice.vertices.map((v) => `${(v.window[0] - x0) * size},${(v.window[1] - y0) * size}`).join(" "), fill: "none", stroke: "var(--bad)", "stroke-width": 2.5, "clip-path": `url(#${clip})` }));
  for (let i = 0; i < 64; i++) view.append(make("circle", { cx: ((i % 8) + 0.5) * size, cy: (Math.floor(i / 8) + 0.5) * size, r: 4.5, fill: covered[i] ? "var(--accent)" : "var(--paper)", stroke: "var(--accent)" }));
  if (chosen) view.append(make("rect", { x: (chosen[0] - x0) * size, y: (chosen[1] - y0) * size, width: size, height: size, fill: "none", stroke: "var(--bad)", "stroke-width": 3 }));
  return view;
}

// 2. Coverage.
function coveragePanel(place) {
  const { pixel, k, i, slice } = place, parts = [];
  if (!slice) return [para("The piece behind the last plane belongs to every pixel that the last plane covers.")];
  const bx = pixel.x & ~7, by = pixel.y & ~7, unit = Math.max(scene.width, scene.height) / 400;
  const grid = [];
  for (let x = 32; x < scene.width; x += 32) grid.push(make("line", { x1: x, x2: x, y1: 0, y2: scene.height }));
  for (let y = 32; y < scene.height; y += 32) grid.push(make("line", { y1: y, y2: y, x1: 0, x2: scene.width }));
  const overlay = [
    make("g", { stroke: "var(--soft)", "stroke-opacity": 0.55, "stroke-width": 0.7 * unit }, grid),
    slice.vertices.length ? make("polygon", { points: slice.vertices.map((v) => v.window.join(",")).join(" "), fill: "var(--accent)", "fill-opacity": 0.12, stroke: "var(--accent)", "stroke-width": 2 * unit }) : null,
    make("rect", { x: bx - 2 * unit, y: by - 2 * unit, width: 8 + 4 * unit, height: 8 + 4 * unit, fill: "none", stroke: "var(--bad)", "stroke-width": 2 * unit }),
  ];
  parts.push(para("A fragment is what a slice leaves in one pixel. The polygon decides which pixels get one:"));
  const figures = [make("figure", {}, picturesvg(place, overlay, "tiles and the polygon in the picture"), make("figcaption", {}, "The picture in tiles of 32 pixels, the slice's polygon over it, and the block of 8 \u00d7 8 pixels that holds the chosen one."))];
  const state = i >= 0 ? bits(pixel.mask[i]) : null;
  if (state) figures.push(make("figure", {}, magnifier(bx, by, state, slice, [pixel.x, pixel.y], "the pixel's block"), make("figcaption", {}, `The block at ${bx}, ${by} as it was rendered: ${state.filter(Boolean).length} of 64 centres covered. Red: pixel ${pixel.x}, ${pixel.y}.`)));
  if (slice.corner) {
    const c = slice.corner;
    figures.push(make("figure", {}, magnifier(c.x, c.y, bits(c.covered), slice, null, "a corner of the polygon"), make("figcaption", {}, `Eight by eight pixels at a corner of the polygon, near ${c.x + 4}, ${c.y + 4}: a pixel is covered if its centre is, however much of its square is not.`)));
  }
  parts.push(make("div", { class: "pair three" }, figures));
  if (!slice.edges.length) return [...parts, note("", "No polygon on this plane: nothing is covered.")];
  const x = pixel.x + 0.5, y = pixel.y + 0.5;
  parts.push(text("h3", "Edge functions at the pixel's centre"));
  parts.push(para(`Each side of the polygon is a line e = a + b column + c row, positive inside. The centre of pixel ${pixel.x}, ${pixel.y} lies at column ${x}, row ${y} of the window. It is covered where no side says no:`));
  let inside = true;
  const rows = slice.edges.map(([a, b, c], n) => {
    const e = a + (b * x + c * y), owner = b > 0 || (b === 0 && c >= 0), yes = e > 0 || (e === 0 && owner);
    inside = inside && yes;
    return [`${n + 1} to ${((n + 1) % slice.edges.length) + 1}`, words(stack.sides[slice.sides[n]]), `${num(a)}${plus(b, " column")}${plus(c, " row")}`, num(e), yes ? strong("inside", "good") : strong("outside", "bad"), owner ? "yes" : "no"];
  });
  parts.push(table(["side", "<lies on", "edge function", "at the centre", "", "left or top side"], rows));
  parts.push(para(inside ? "All of them say inside: this slice leaves a fragment in this pixel." : "One says outside: this slice leaves no fragment in this pixel."));
  parts.push(note("", strong("The fill rule. "), "A centre exactly on a side (e = 0) belongs to the polygon only if it is a left or a top side. Two polygons that share a side then share no pixel and lose none: of the two, it is a left or top side for exactly one."));
  if (pixel.span) parts.push(para(`The box is convex, so the slices that cover a pixel follow each other: for this one, slices ${pixel.span[0]} to ${pixel.span[1]}. The pipeline finds these two numbers from the ray and asks edge functions only where rounding leaves one in doubt.`));
  return parts;
}

// What to say where a slice has no record for the pixel.
const passed = (place) => note("", place.why);

// 3. Lookup.
function lookupPanel(place) {
  const { pixel, i } = place;
  if (i < 0) return [passed(place)];
  const parts = [], cell = latest(pixel, ["texcoord"], "cell", i), w = latest(pixel, ["texcoord"], "weight", i);
  const value = pixel.value[i], c = pixel.corners[i], rounds = pixel.rounds[i];
  if (!cell || !w) return [para("This piece takes its value where the ray leaves the box: ", strong(num(toData(value))), ".")];
  const index = cell.map((v, a) => v + w[a]), tex = index.map((u, a) => (u + 0.5) / scene.dims[a]);
  parts.push(para("Where is the fragment in the volume? Voxel centres lie at whole numbers of the index, so texture coordinate s in a volume of n voxels means index u = s n \u2212 \u00bd. Its whole part (rounded down, never towards zero) is the cell, the rest is the weight."));
  parts.push(table(["axis", "texture: s, t, p", "index u = s n \u2212 \u00bd", "cell \u230au\u230b", "weight"], AXES.map((_, n) => [axisLetter(n), num(tex[n], 6), num(index[n], 7), String(cell[n]), num(w[n], 6)])));
  if (scene.method.sample === "end") parts.push(para("This scene takes its values at the far side of each slab, not in its middle: an error of first order in the slab's thickness."));
  const nearest = scene.method.filter === "nearest", post = scene.method.classification !== "pre";
  const wx = [1 - w[0], w[0]], wy = [1 - w[1], w[1]], wz = [1 - w[2], w[2]];
  const weights = c.map((_, n) => wx[n & 1] * wy[(n >> 1) & 1] * wz[n >> 2]);
  // The cell as a cube; its weights as dots.
  const o = [70, 250], ax = [190, 0], ay = [0, -170], az = [85, -55];
  const p = (x, y, z) => [o[0] + ax[0] * x + ay[0] * y + az[0] * z, o[1] + ax[1] * x + ay[1] * y + az[1] * z];
  const cube = make("svg", { viewBox: "0 -26 440 336", class: "chart", role: "img", "aria-label": "the cell of eight voxels" });
  for (const [a, b] of [[0, 1], [2, 3], [4, 5], [6, 7], [0, 2], [1, 3], [4, 6], [5, 7], [0, 4], [1, 5], [2, 6], [3, 7]]) {
    const [s, e] = [a, b].map((n) => p(n & 1, (n >> 1) & 1, n >> 2));
    cube.append(make("line", { x1: s[0], y1: s[1], x2: e[0], y2: e[1], stroke: "var(--soft)", "stroke-dasharray": a === 4 || b === 4 ? "4 4" : undefined }));
  }
  const path = [p(0, 0, 0), p(w[0], 0, 0), p(w[0], w[1], 0), p(w[0], w[1], w[2])];
  cube.append(make("polyline", { points: path.map((q) => q.join(",")).join(" "), fill: "none", stroke: "var(--bad)", "stroke-width": 1.5, "stroke-dasharray": "3 3" }));
  c.forEach((v, n) => {
    const [x, y] = p(n & 1, (n >> 1) & 1, n >> 2);
    cube.append(make("circle", { cx: x, cy: y, r: 4 + 12 * Math.sqrt(weights[n]), fill: "var(--accent)", "fill-opacity": 0.35, stroke: "var(--accent)" }));
  });
  const [fx, fy] = p(...w), room = new Room(0, -26, 440, 310), put = (label) => label && cube.append(label);
  cube.append(make("circle", { cx: fx, cy: fy, r: 6, fill: "var(--bad)", stroke: "var(--paper)" }));
  room.take(fx - 7, fy - 7, fx + 7, fy + 7);
  put(room.beside(num(value, 5), [fx, fy], [1, 0], 8, { class: "halo" }, 13, true));
  [["x \u2192", 150, 300], ["\u2191 y", 30, 170], ["\u2197 z", 330, 250]].forEach(([words, x, y], axis) => put(room.beside(words, [x, y], [0, 1], 0, { class: "halo", fill: AXIS_COLORS[axis] }, 13, true)));
  c.forEach((v, n) => put(room.beside(num(v, 5), p(n & 1, (n >> 1) & 1, n >> 2), [0, (n >> 1) & 1 ? -1 : 1], 17, { class: "halo" })));
  const rows = c.map((v, n) => [String(cell[0] + (n & 1)) + ", " + (cell[1] + ((n >> 1) & 1)) + ", " + (cell[2] + (n >> 2)), num(v), num(weights[n], 4)]);
  parts.push(make("div", { class: "pair" }, make("figure", {}, cube, make("figcaption", {}, "The cell. Discs: the eight voxels, their size by weight; red: the fragment.")), table([["voxel along ", axisLetter(0), ", ", axisLetter(1), ", ", axisLetter(2)], "number", "weight"], rows)));
  if (rounds) {
    const f = (a, b, t, r) => `${num(a)} + ${num(t, 4)} \u00b7 (${num(b)} \u2212 ${num(a)}) = ${num(r)}`;
    parts.push(text("h3", "Three rounds of interpolation"));
    parts.push(formula(["along x: " + f(c[0], c[1], w[0], rounds[0]), "four pairs become four numbers"], f(c[2], c[3], w[0], rounds[1]), f(c[4], c[5], w[0], rounds[2]), f(c[6], c[7], w[0], rounds[3])));
    parts.push(formula(["along y: " + f(rounds[0], rounds[1], w[1], rounds[4]), "four become two"], f(rounds[2], rounds[3], w[1], rounds[5])));
    parts.push(formula(["along z: " + f(rounds[4], rounds[5], w[2], rounds[6]), "two become one: the number that the stage fetch left in the batch, to the last bit"]));
  } else if (nearest) {
    parts.push(para(`The scene takes the nearest voxel instead of interpolating: ${num(value)}.`));
  } else if (!post) {
    parts.push(para("The scene classifies before it interpolates: the eight voxels become premultiplied colours, and those are interpolated. See the next step."));
  }
  if (post) parts.push(para("The value here: ", strong(num(toData(value), 6)), isNumberPlain ? "." : ` in the data's units = ${num(record.scale)} \u00b7 ${num(value)}${plus(record.offset, "")}.`, " All arithmetic is in f32; voxels stay in their own type, here ", scene.voxel_type, "."));
  return parts;
}

// The pieces a slab could be cut into, and the light they let through.
function layersPlot(alpha) {
  const w = byId("panels").clientWidth < 520 ? 400 : 620, x0 = 0.2 * w, x1 = 0.7 * w, x2 = 0.86 * w, side = 46;
  const view = make("svg", { viewBox: `0 0 ${w} 190`, class: "chart", role: "img", "aria-label": "light through one slab, and through the same slab in four layers" });
  const draw = (y, parts, label) => {
    const left = 1 - alpha, width = (x1 - x0) / parts, middle = y + side / 2;
    view.append(make("text", { x: 4, y: y - 9, class: "small soft" }, label));
    view.append(make("rect", { x: 4, y, width: x0 - 4, height: side, fill: "var(--accent)", "fill-opacity": 0.75 }), make("text", { x: x0 / 2, y: middle + 4, "text-anchor": "middle", class: "halo" }, "light 1"));
    for (let n = 0; n < parts; n++) {
      const h0 = (side / 2) * left ** (n / parts), h1 = (side / 2) * left ** ((n + 1) / parts), x = x0 + n * width;
      view.append(make("path", { d: `M${x} ${middle - h0}L${x + width} ${middle - h1}L${x + width} ${middle + h1}L${x} ${middle + h0}Z`, fill: "var(--accent)", "fill-opacity": 0.45 }),
        make("rect", { x, y: y - 3, width, height: side + 6, fill: "none", stroke: "var(--soft)" }),
        make("text", { x: x + width / 2, y: middle + 4, "text-anchor": "middle", class: "small halo" }, "\u00d7 " + num(left ** (1 / parts), 3)));
    }
    view.append(make("rect", { x: x1, y: middle - (side / 2) * left, width: x2 - x1, height: Math.max(1, side * left), fill: "var(--accent)", "fill-opacity": 0.75 }), make("text", { x: x2 + 5, y: middle + 4, class: "halo" }, num(left, 4)));
  };
  draw(24, 1, `the slab as one piece: it lets 1 \u2212 A = ${num(1 - alpha, 4)} of the light through`);
  draw(118, 4, "the same slab as four layers: each lets the fourth root through");
  return view;
}

// 4. Colour.
function colourPanel(place) {
  const { pixel, i } = place;
  if (!["over", "under", "add"].includes(scene.blend)) return [para(`This scene shows values (${scene.blend}): fragments are not coloured one by one. The value that is found along the ray is classified once a pixel.`), transferPlot([])];
  if (i < 0) return [passed(place), transferPlot([])];
  const parts = [], value = toData(pixel.value[i]), [r, g, b, a] = pixel.exact[i], m = scene.method;
  const pre = m.classification === "pre" && m.filter === "linear", pair = pixel.front !== undefined;
  const marks = pre ? [] : pair ? [{ value: toData(pixel.front[i]), name: "front" }, { value, name: "back" }] : [{ value, opacity: a, name: "value " + num(value) }];
  parts.push(para("The transfer function gives each value a straight colour, and an opacity a for a length L\u2080 = " + num(scene.opacity_unit) + " of such material. A length, not a slice: that is what makes the picture independent of the number of slices."));
  parts.push(make("figure", {}, transferPlot(marks), make("figcaption", {}, "Blue: opacity per L\u2080; the band below: the straight colour; grey: how often values occur (square roots).")));
  const length = pixel.length[i], ratio = scene.ratio * length;
  const cC = latest(pixel, ["classify"], "color", i), cA = latest(pixel, ["classify"], "alpha", i);
  if (pre) parts.push(para("This scene classifies the eight voxels first and interpolates their premultiplied colours. Interpolating straight colours would let invisible voxels bleed into visible ones."));
  else if (pair) parts.push(para(`The slab lies between two values, ${num(toData(pixel.front[i]))} in front and ${num(value)} behind; a table over both of them holds the integral of the transfer function between them.`));
  else {
    parts.push(make("div", { class: "pair big" },
      make("div", {}, text("h3", "Straight"), para(swatch([r, g, b]), straight([r, g, b])), para(`opacity a = ${num(a, 6)} per L\u2080`)),
      make("div", {}, text("h3", "Premultiplied, for this slab"), para(fragmentSwatch(pixel, i, "classify"), premultiplied(cC || pixel.color[i])), para(`opacity A = ${num(cA ?? pixel.alpha[i], 6)} for one slab of thickness D`))));
  }
  const A = pixel.alpha[i], corrected = column(pixel, "correct", "alpha", i);
  if (!pair && !pre && m.slab === "exponential") {
    const exact = a >= 1 ? 1 : -Math.expm1(scene.ratio * Math.log1p(-a));
    parts.push(text("h3", "From a length to this slab"));
    parts.push(formula(
      [`D / L\u2080 = ${num(stack.spacing)} / ${num(scene.opacity_unit)} = ${num(scene.ratio)}`, "how many reference lengths one slab is thick"],
      [`A = 1 \u2212 (1 \u2212 a)^(D/L\u2080) = 1 \u2212 (1 \u2212 ${num(a, 4)})^${num(scene.ratio, 4)} = ${num(exact, 6)}`, `the table that the pipeline looks it up in gave ${num(cA ?? 0, 6)}`],
      [`C = A \u00b7 c = ${premultiplied([r, g, b].map((x) => x * exact))}`, `from the table: ${premultiplied(cC || [0, 0, 0])}`]));
  }
  if (!pair && !pre && m.slab === "riemann") parts.push(formula([`A = \u03baL = \u2212ln(1 \u2212 a) \u00b7 D / L\u2080; the table gave ${num(cA ?? 0, 6)}`, "this scene takes the explicit Euler step, which is of first order: see the step Blending"]));
  if (corrected !== null && m.slab === "riemann") parts.push(formula([`A\u2032 = A \u00b7 ${num(length, 5)} = ${num(corrected, 6)}`, `the stage correct: this piece of the ray is ${num(length, 5)} slabs long`]));
  else if (corrected !== null) parts.push(formula([`A\u2032 = 1 \u2212 (1 \u2212 A)^${num(length, 5)} = ${num(corrected, 6)}`, `the stage correct: this piece of the ray is ${num(length, 5)} slabs long${pixel.slant !== 1 ? `; rays slant by ${num(pixel.slant, 6)} here` : ""}${pixel.span && (place.k === pixel.span[0] || place.k === pixel.span[1]) ? "; the first and last piece reach to the face of the box" : ""}`]));
  else if (cA !== null && cA !== undefined) parts.push(para("No correction was needed: this piece of the ray is one slab long, and the table is made for that."));
  parts.push(text("h3", "Why 1 \u2212 (1 \u2212 a)^N, and not N a"));
  const show = A > 0.02 && A < 1 ? A : 0.4;
  parts.push(para(A > 0.02 && A < 1 ? `This fragment's A = ${num(A, 4)}:` : "With A = 0.4, since this fragment's own opacity leaves little to see:"));
  parts.push(layersPlot(show));
  const half = 1 - Math.sqrt(1 - show);
  parts.push(para("Each layer takes a share of what is left, not of what there was. So what is let through multiplies: two halves of the slab let \u221a(1 \u2212 A) through each, and together exactly 1 \u2212 A."));
  parts.push(formula([`each half: A\u00bd = 1 \u2212 \u221a(1 \u2212 ${num(show, 4)}) = ${num(half, 5)}, not A/2 = ${num(show / 2, 5)}`, "half the thickness is more than half the opacity"], [`both: 1 \u2212 (1 \u2212 ${num(half, 5)})\u00b2 = ${num(show, 5)}; with A/2: 1 \u2212 (1 \u2212 ${num(show / 2, 4)})\u00b2 = ${num(1 - (1 - show / 2) ** 2, 5)}`, "halving opacities makes the picture fainter with every doubling of the slices"]));
  const most = Math.max(4, Math.min(40, Math.ceil(3 / show))), plot = new Plot([0, most], [0, 1.6], { height: 230, xlabel: "N equal slabs", ylabel: "opacity", label: "opacity of N slabs", keys: [["N A", "var(--bad)", "6 4"], ["1 \u2212 (1 \u2212 A)^N", "var(--accent)"]] });
  plot.level(1, "var(--soft)", "nothing is more than opaque");
  plot.line([[0, 0], [most, most * show]], "var(--bad)", { dash: "6 4" });
  plot.line(Array.from({ length: most + 1 }, (_, n) => [n, 1 - (1 - show) ** n]), "var(--accent)");
  parts.push(plot.root);
  return parts;
}

// 5. Fog.
function fogPanel(place) {
  const { pixel, i } = place;
  if (scene.blend !== "over") return [para("This scene projects values or adds colours; the comparison of fogs is for blended colours.")];
  const parts = [], own = scene.fog !== null, fog = scene.fog || scene.example_fog;
  if (!own) parts.push(note("", strong("This scene has no fog: the stage is left out of its pipeline. "), "What follows is the same scene rendered by the same pipeline with an example: ", `linear from ${num(fog.start)} to ${num(fog.end)}. It is not in the picture above.`));
  const step = fog.mode === "linear" && fog.start === fog.end;
  const f = step ? `f = 1 for z < ${num(fog.end)}, 0 from there on: start = end, so fog sets in at once` : { linear: `f = (end \u2212 z) / (end \u2212 start), start = ${num(fog.start)}, end = ${num(fog.end)}`, exp: `f = exp(\u2212density z), density = ${num(fog.density)}`, exp2: `f = exp(\u2212(density z)\u00b2), density = ${num(fog.density)}` }[fog.mode];
  const z = own && i >= 0 && pixel.fog ? pixel.fog[i][0] : place.slice ? place.slice.depth : null;
  const lo = fog.curve[0][0], hi = fog.curve[fog.curve.length - 1][0], cut = Math.min(hi, Math.max(lo, fog.end));
  const curve = step ? [[lo, fog.end > lo ? 1 : 0], [cut, fog.end > lo ? 1 : 0], [cut, fog.end > hi ? 1 : 0], [hi, fog.end > hi ? 1 : 0]] : fog.curve, plot = new Plot([curve[0][0], curve[curve.length - 1][0]], [0, 1.05], { height: 230, xlabel: "distance z from the eye", ylabel: "fog factor f", label: "fog curve" });
  plot.line(curve, "var(--accent)", { width: 2.5 });
  plot.mark(stack.near, "var(--soft)", "box begins").mark(stack.far, "var(--soft)", "box ends");
  const factor = z === null ? null : own && i >= 0 && pixel.fog ? pixel.fog[i][1] : piecewise(curve, z)[0];
  if (z !== null) plot.mark(z, "var(--bad)", null).dot(z, factor, "var(--bad)", 5);
  parts.push(para("Fog mixes what is far with a colour of its own, ", swatch(fog.color), straight(fog.color, 3), ". The factor f says how much of the object is left: 1 near the eye, 0 where only fog is seen. f multiplies the object, 1 \u2212 f the fog."));
  parts.push(formula([f, `${step ? "" : "clamped to 0..1; "}at z = ${num(z)}: f = ${num(factor, 6)}${fog.distance === "planar" ? ", one number for the whole slice" : ", by the fragment's own distance"}`]), plot.root);
  if (fog.mode === "linear" && !step) parts.push(para("Some notes write linear fog as 1 \u2212 z. That is right only if fog begins at 0 and ends at 1; (end \u2212 z) / (end \u2212 start) is 1 at the start and 0 at the end, wherever they are."));
  const weighted = twin(pixel, "fog-weighted"), literal = twin(pixel, "fog-literal");
  const at = (t) => (t ? t.slice.indexOf(place.k) : -1), iw = at(weighted), il = at(literal);
  parts.push(text("h3", "Why premultiplied colours need weighted fog"));
  parts.push(para("The colour that reaches the blend is premultiplied: C = A c, the colour c of the material times how much of it is there. Fog changes the colour of the material, not its amount:"));
  parts.push(formula(["c\u2032 = f c + (1 \u2212 f) c_fog", "fog on the straight colour, as OpenGL has it"], ["C\u2032 = A c\u2032 = f C + (1 \u2212 f) A c_fog", "the same, multiplied by A: the fog's part is weighted by the opacity too"], ["C\u2032 = f C + (1 \u2212 f) c_fog", "the formula taken literally on premultiplied colour: the A is missing. Where A = 0 there is nothing to see, and yet it adds (1 \u2212 f) c_fog"]));
  const black = own && fog.color.every((c) => c === 0);
  if (black) parts.push(note("", strong("Black hides the mistake: "), `(1 \u2212 f) c_fog is (0, 0, 0) in this scene's black fog, so both formulas give the same. The comparison below is the same fog in an example colour, `, swatch(scene.example_fog.color), `${straight(scene.example_fog.color, 3)}. It is not in the picture above.`));
  if (il >= 0) {
    const A = literal.alpha[il], stage = own && i >= 0 ? pixel.stages.findIndex((s) => s.name === "fog") : -1;
    const rows = [];
    if (own && i >= 0 && stage >= 0) {
      const C = latest(pixel, pixel.stages.slice(0, stage).map((s) => s.name), "color", i);
      if (C) rows.push(["before fog", fragmentSwatch(pixel, i, stageBefore(pixel, "fog")), words(list(C, 4)), num(A, 4)]);
    }
    if (!own && i >= 0) rows.push(["no fog", fragmentSwatch(pixel, i), words(list(pixel.color[i], 4)), num(A, 4)]);
    rows.push(["weighted", iw >= 0 ? twinSwatch(pixel, "fog-weighted", iw) : null, words(iw >= 0 ? list(weighted.color[iw], 4) : "passed over: nothing here shows"), num(iw >= 0 ? weighted.alpha[iw] : 0, 4)]);
    rows.push(["literal", twinSwatch(pixel, "fog-literal", il), words(list(literal.color[il], 4)), num(A, 4)]);
    parts.push(text("h3", "This fragment in both fogs, as rendered"), table(["fog", "", "<premultiplied colour that goes into the blend", "A"], rows));
    if (A === 0) parts.push(note("wrong", `This fragment is empty, A = 0. Weighted fog leaves it black and invisible. Literal fog hands ${premultiplied(literal.color[il])} to the blend: light out of nothing.`));
  }
  if (literal && weighted) {
    let lit = [0, 0, 0], empty = 0;
    literal.slice.forEach((_, n) => {
      if (!literal.covered[n] || literal.alpha[n] !== 0) return;
      const was = before(literal, literal.start, n).sum, now = literal.sum[n];
      const more = now.map((x, c) => x - was[c]);
      if (scene.order === "front-to-back") lit = lit.map((x, c) => x + more[c]);
      empty += 1;
    });
    parts.push(text("h3", "The whole pixel in both fogs, as rendered"));
    parts.push(table(["fog", "", "<premultiplied colour gathered", "opacity"], [["weighted", gatheredSwatch(pixel, "fog-weighted"), words(list(weighted.gathered.slice(0, 3), 5)), num(1 - weighted.gathered[3], 5)], ["literal", gatheredSwatch(pixel, "fog-literal"), words(list(literal.gathered.slice(0, 3), 5)), num(1 - literal.gathered[3], 5)]]));
    if (empty) parts.push(para(`The ray crosses ${plural(empty, "slice")} where nothing is (A = 0)${scene.order === "front-to-back" ? `; in literal fog they add ${premultiplied(lit)} of light` : ""}. ${scene.order === "front-to-back" && lit.every((x) => x === 0) ? "Fog has not set in there (f = 1), or nothing gets past what lies before: it does no harm in this pixel." : "More slices would add more: the picture would depend on how finely it is cut, as no right picture does."}`));
  }
  if (pictures.weighted) parts.push(make("div", { class: "pair" },
    make("figure", {}, make("img", { src: pictures.weighted, alt: "the scene in weighted fog", class: "chart checker" }), make("figcaption", {}, strong("Weighted: ", "good"), "fog lies on the object alone. Both pictures over an opaque background.")),
    make("figure", {}, make("img", { src: pictures.literal, alt: "the scene in literal fog", class: "chart checker" }), make("figcaption", {}, strong("Literal: ", "bad"), pictures.literal === pictures.weighted ? "the same here: no empty slice lies where f < 1." : "empty slices of the box glow where f < 1.", pictures.clipped ? " Brighter than 1 in places: clipped at 1." : ""))));
  parts.push(para("Opacity is never fogged: fog does not make the object more or less see-through. Literal fog is right for straight colours that are multiplied by A in the blend itself; the result is then the same as weighted fog here."));
  return parts;
}

// How the pixel's colour grew.
function journeyPlot(pixel, place) {
  const s = pixel, range = record.slices, top = Math.max(0.05, 1, ...s.sum.flat().filter(Number.isFinite));
  const plot = new Plot([range[0], Math.max(range[0] + 1, range[1])], [0, Math.min(1.2, top * 1.02)], { height: 290, xlabel: "slice", ylabel: "premultiplied", label: "the pixel's premultiplied colour, opacity and transmittance, slice by slice", keys: [["red gathered", "var(--red)"], ["green gathered", "var(--green)"], ["blue gathered", "var(--blue)"], ["transmittance T", "var(--ink)", "5 3"], ["opacity 1 \u2212 T", "var(--soft)"]] });
  const order = s.slice.map((_, n) => n), back = scene.order === "back-to-front";
  if (back) order.reverse();
  const at = (f) => {
    const points = order.map((n) => [s.slice[n], f(n)]);
    const start = f(-1);
    return back ? [...points, [range[1], start]] : [[range[0], start], ...points, [range[1], points.length ? points[points.length - 1][1] : start]];
  };
  const names = ["red", "green", "blue"];
  names.forEach((c, n) => plot.steps(at((m) => (m < 0 ? s.start[n] : s.sum[m][n])), `var(--${c})`, { width: 2 }));
  plot.steps(at((m) => (m < 0 ? s.start[3] : s.transmittance[m])), "var(--ink)", { dash: "5 3", width: 1.6 });
  plot.steps(at((m) => 1 - (m < 0 ? s.start[3] : s.transmittance[m])), "var(--soft)", { width: 1.6 });
  if (scene.terminate > 0 && !back) plot.level(scene.terminate, "var(--bad)", null);
  plot.mark(place.k, "var(--bad)", "slice " + place.k, true);
  return plot.root;
}

function valuePlot(pixel, place) {
  const points = pixel.slice.map((k, n) => [k, toData(pixel.value[n]), n]).filter((p) => pixel.covered[p[2]]).sort((a, b) => a[0] - b[0]);
  const values = points.map((p) => p[1]), lo = Math.min(...values, scene.range[0]), hi = Math.max(...values, scene.range[1]);
  const kept = ["mip", "min", "lmip", "iso"].includes(scene.blend);
  const plot = new Plot([record.slices[0], Math.max(record.slices[0] + 1, record.slices[1])], [lo, hi > lo ? hi : lo + 1], { height: 290, xlabel: "slice", ylabel: "value", label: "values along the ray", keys: [["value looked up", "var(--accent)"], ["kept so far", "var(--green)", "5 3"]].slice(0, kept ? 2 : 1) });
  plot.line(points, "var(--accent)");
  if (kept) plot.steps(pixel.slice.map((k, n) => [k, toData(pixel.sum[n][0])]), "var(--green)", { dash: "5 3" });
  if (scene.level !== undefined) plot.level(scene.level, "var(--bad)", scene.blend === "iso" ? "the surface's value" : "threshold");
  for (const [level] of scene.levels || []) plot.level(level, "var(--bad)", "a surface's value");
  plot.mark(place.k, "var(--bad)", "slice " + place.k, true);
  return plot.root;
}

const PROJECTIONS = {
  mip: "The greatest value on the ray is kept; its colour is the pixel's.",
  min: "The smallest value on the ray is kept; its colour is the pixel's.",
  average: "Values are added, each weighted by its piece's length; the mean's colour is the pixel's.",
  add: "Premultiplied colours and opacities are added, and nothing hides anything; opacity ends at 1.",
  under: "Each next slice goes under what the pixel has gathered, whichever comes first: colour = colour + T \u00b7 C, T = T \u00b7 (1 \u2212 A). Back to front, far things hide near ones.",
  "attenuated-mip": "Each value counts as its place n in the window, 0 to 1, times exp(\u2212S), where S adds up n times attenuation and length before it; the greatest is kept, and its colour as a value of the window is the pixel's.",
  lmip: "The first local maximum at or above the threshold is kept; its colour is the pixel's.",
  surfaces: "Where the values of neighbouring slices lie on both sides of a level the ray crosses its surface: the crossing is sought between the two, lit there, and blended, nearest first.",
  iso: "The first place where the value crosses the level is kept, refined between slices, and lit from the eye.",
};

// What the pixel's numbers stand for in each projection.
const same = (x) => x;
const KEPT = {
  mip: [["greatest value", toData]],
  min: [["smallest value", toData]],
  average: [["sum of (number \u2212 table's first) \u00b7 length", same], ["sum of lengths", same]],
  add: [["premultiplied red", same], ["green", same], ["blue", same]],
  under: [["premultiplied red", same], ["green", same], ["blue", same], ["transmittance", same]],
  "attenuated-mip": [["greatest n exp(\u2212S)", same], ["S", same]],
  lmip: [["last value", toData], ["greatest value", toData]],
  surfaces: [["premultiplied red", same], ["green", same], ["blue", same], ["transmittance", same]],
  iso: [["last value", toData], ["crossing, in slices", same]],
};

// 6. Blending.
function blendPanel(place) {
  const { pixel, i } = place, parts = [];
  if (scene.blend !== "over") {
    parts.push(para(PROJECTIONS[scene.blend] || ""), valuePlot(pixel, place));
    if (i < 0) parts.push(passed(place));
    const kept = KEPT[scene.blend] || [], ends = ["iso", "lmip", "attenuated-mip"].includes(scene.blend), adds = scene.blend === "add";
    const numbers = (sum, t) => [...kept.map(([, f], c) => { const x = c < 3 ? sum[c] : t; return num(x === null ? null : f(x)); }), ...(ends ? [t > 0 ? "looking on" : "found"] : adds ? [num(t)] : [])];
    const heads = [...kept.map(([name]) => name), ...(ends ? [""] : adds ? ["opacity"] : [])];
    const rows = pixel.slice.map((k, n) => ({ kind: k === place.k ? "here" : "minor", cells: [String(k), num(toData(pixel.value[n])), pixel.covered[n] ? "yes" : "no", ...numbers(pixel.sum[n], pixel.transmittance[n])] }));
    const end = numbers(pixel.gathered, pixel.gathered[3]);
    parts.push(text("h3", "What the pixel kept, slice by slice"), table(["slice", "value", "covered", ...heads], rows, { tall: true }), para(`In the end: ${heads.map((h, n) => (h ? h + " " : "") + end[n]).join(", ")}; the picture's pixel is ${premultiplied(pixel.picture, 5)}.`));
    return parts;
  }
  const back = scene.order === "back-to-front";
  if (i < 0) parts.push(passed(place));
  else {
    const was = before(pixel, pixel.start, i), C = pixel.color[i], A = pixel.alpha[i];
    const done = !back && scene.terminate > 0 && scene.method.slab !== "riemann" && was.t < scene.terminate;
    parts.push(para("All numbers of colours in this step are premultiplied, gathered sums too; swatches show the straight colour."), para(`Slice ${place.k === stack.count ? "behind the last" : place.k} is blended ${back ? "over what lies behind it" : "under what lies before it"}:`));
    if (done) parts.push(note("", `This pixel had finished before: T = ${num(was.t)} lies below ${num(scene.terminate)}. The slice ran for other pixels of its block and changed nothing here.`));
    else if (back) parts.push(formula([`colour = C + (1 \u2212 A) \u00b7 colour = ${list(C, 4)} + ${num(1 - A, 5)} \u00b7 ${list(was.sum, 4)} = ${list(pixel.sum[i], 5)}`, "what is nearer hides the share A of all that is behind it"], [`T = (1 \u2212 A) \u00b7 T = ${num(1 - A, 5)} \u00b7 ${num(was.t, 5)} = ${num(pixel.transmittance[i], 6)}`, "light of the background that comes through"]));
    else parts.push(formula([`colour = colour + T \u00b7 C = ${list(was.sum, 4)} + ${num(was.t, 5)} \u00b7 ${list(C, 4)} = ${list(pixel.sum[i], 5)}`, "of this slab's light, the share T gets past what lies before it"], [`T = T \u00b7 (1 \u2212 A) = ${num(was.t, 5)} \u00b7 ${num(1 - A, 5)} = ${num(pixel.transmittance[i], 6)}`, "what is left for the slabs behind it"]));
  }
  if (scene.method.target === "unorm8") parts.push(para("This scene blends in 8 bits: after every slice colour and transmittance are rounded to multiples of 1/255, so a contribution under half of that vanishes."));
  parts.push(text("h3", "The pixel's whole journey"), whole || pixel.slice.length ? journeyPlot(pixel, place) : null);
  const rows = [], stops = !back && scene.terminate > 0 && scene.method.slab !== "riemann";
  let over = 0;
  pixel.slice.forEach((k, n) => {
    const was = before(pixel, pixel.start, n), here = k === place.k, finished = stops && was.t < scene.terminate;
    if (!pixel.covered[n] && !here) return;
    if (pixel.alpha[n] === 0 && !here && pixel.color[n].every((c) => c === 0)) return;
    const weight = back ? pixel.alpha[n] : was.t * pixel.alpha[n];
    if (finished && !over++) rows.push({ kind: "after", cells: [make("td", { class: "text", colspan: 8 }, `not blended: the pixel was finished, T = ${num(was.t, 4)} < ${num(scene.terminate)}`)] });
    rows.push({ kind: (here ? "here" : weight > 0.01 ? "" : "minor") + (finished ? " after" : ""), cells: [String(k), num(toData(pixel.value[n])), [fragmentSwatch(pixel, n), num(pixel.alpha[n], 4)], num(was.t, 4), ...pixel.sum[n].map((x) => num(x, 4)), num(pixel.transmittance[n], 4)] });
  });
  if (rows.length) parts.push(para(`Slices that show something here, the swatch their straight colour, the gathered red, green and blue premultiplied, in the order they ${over ? "came; those in grey ran for other pixels of the block and were not blended here" : "were blended"}:`), table(["slice", "value", "straight colour, A", "T before", "red gathered", "green", "blue", "T after"], rows, { tall: true }));
  else if (whole) parts.push(note("", "No recorded slice shows anything in this pixel: it keeps what it starts from."));
  else parts.push(note("", `None of the slices on this page, ${record.slices[0]} to ${record.slices[1] - 1} of 0 to ${stack.count - 1}, shows anything in this pixel. What the others gave it is in its result:`));
  const bg = scene.background, T = pixel.gathered[3];
  parts.push(formula([`pixel = colour + T \u00b7 background = ${list(pixel.gathered.slice(0, 3), 6)} + ${num(T, 5)} \u00b7 ${list(bg.slice(0, 3).map((c) => c * bg[3]), 4)} = ${list(pixel.picture.slice(0, 3), 6)}`, `opacity = 1 \u2212 T \u00b7 (1 \u2212 ${num(bg[3])}) = ${num(pixel.picture[3], 6)}; these are the picture's own numbers`]));
  parts.push(...orderParts(pixel), ...stopParts(pixel), ...stiffParts(place));
  return parts;
}

function orderParts(pixel) {
  const ftb = twin(pixel, "front-to-back"), btf = twin(pixel, "back-to-front"), parts = [text("h3", "Front to back, back to front, and the closed sum")];
  if (!ftb) return [];
  const row = (name, v) => [words(name), ...v.slice(0, 3).map((x) => num(x, 9)), num(v[3], 6)];
  const rows = [row("front to back, to the end", ftb.gathered)];
  if (btf) rows.push(row("back to front", btf.gathered));
  if (ftb.closed) rows.push(row("closed sum, in f64", ftb.closed));
  parts.push(table(["<premultiplied", "red", "green", "blue", "T"], rows));
  const apart = Math.max(0, ...[btf && btf.gathered, ftb.closed].filter(Boolean).flatMap((v) => v.slice(0, 3).map((x, c) => Math.abs(x - ftb.gathered[c]))));
  parts.push(formula(["colour = \u03a3 C\u2096 \u00b7 (1 \u2212 A\u2081)(1 \u2212 A\u2082) \u2026 (1 \u2212 A\u2096\u208b\u2081)", `each slab's light times what all slabs before it let through. They differ by ${num(apart, 2)} at most: by rounding${scene.method.target === "unorm8" ? " to 8 bits" : ""}, for they are one sum, worked out in different orders`]));
  return parts;
}

function stopParts(pixel) {
  const ftb = twin(pixel, "front-to-back");
  if (!ftb || !ftb.slice.length) return [];
  const limit = scene.terminate || 1 / 1024, at = ftb.transmittance.findIndex((t) => t < limit), parts = [text("h3", "Where it can stop early")];
  if (ftb.start[3] < limit) return [...parts, para(`T = ${num(ftb.start[3], 3)} lies below ${num(limit)} before the first slice on this page.`)];
  if (at < 0 && ftb.gathered[3] < limit) return [...parts, para(`T falls below ${num(limit)} behind the slices on this page (it ends at ${num(ftb.gathered[3])}).`)];
  if (at < 0) return [...parts, para(`T never falls below ${num(limit)} on this ray (it ends at ${num(ftb.gathered[3])}): every slice is needed.`)];
  const rest = ftb.slice.slice(at + 1).filter((_, n) => ftb.covered[at + 1 + n]).length;
  const lost = [0, 1, 2].map((c) => ftb.gathered[c] - ftb.sum[at][c]);
  parts.push(para(`At slice ${ftb.slice[at]} the transmittance falls to ${num(ftb.transmittance[at], 3)}, below ${num(limit)}: whatever comes behind can change the pixel by no more than that. ${rest ? `The ${plural(rest, "slice")} recorded behind it would add ${premultiplied(lost, 2)}.` : "Nothing is recorded behind it."}`));
  if (scene.order === "back-to-front") parts.push(para("Back to front there is no early stop: the slice that hides all others comes last."));
  else if (!scene.terminate) parts.push(para("This scene asks for every slice (terminate = 0)."));
  return parts;
}

function stiffParts(place) {
  const { pixel } = place, ftb = twin(pixel, "front-to-back"), euler = twin(pixel, "riemann");
  if (!ftb || !ftb.slice.length) return [];
  const parts = [text("h3", "Stiff places: why 1 \u2212 exp(\u2212\u03baL) and not \u03baL")];
  const depth = (A) => (A >= 1 ? Infinity : -Math.log1p(-A));
  const riemann = scene.method.slab === "riemann";
  const kl = ftb.alpha.map((A, n) => (riemann ? A : depth(A))).filter((_, n) => ftb.covered[n]);
  const worst = Math.max(0, ...kl);
  parts.push(para("Extinction \u03ba = \u2212ln(1 \u2212 a)/L\u2080 is how fast light fades: dT/ds = \u2212\u03baT. Over a piece of length L the exact solution for constant \u03ba is T \u00b7 exp(\u2212\u03baL), so A = 1 \u2212 exp(\u2212\u03baL). The Riemann sum, which is the explicit Euler step, takes A = \u03baL and C = \u03baL c: the straight line where the curve should be. It forgets that the slab attenuates its own light."));
  const plot = new Plot([0, 3], [-2.1, 1.1], { height: 260, xlabel: "\u03baL of a slab", ylabel: "1 \u2212 A: what it lets through", label: "exponential and Euler step", keys: [["exp(\u2212\u03baL)", "var(--accent)"], ["1 \u2212 \u03baL, the Euler step", "var(--bad)", "6 4"]] });
  plot.level(0, "var(--soft)", "below: negative light", true).level(-1, "var(--bad)", "below: it grows from slab to slab", true);
  plot.line(Array.from({ length: 61 }, (_, n) => [n / 20, Math.exp(-n / 20)]), "var(--accent)");
  plot.line([[0, 1], [3, -2]], "var(--bad)", { dash: "6 4" });
  if (!riemann) ftb.alpha.forEach((A, n) => ftb.covered[n] && A > 0 && plot.dot(Math.min(3, depth(A)), 1 - A, "var(--accent)", 3, "slice " + ftb.slice[n]));
  if (euler) euler.alpha.forEach((A, n) => euler.covered[n] && A > 0 && plot.dot(Math.min(3, A), 1 - A, "var(--bad)", 3, "slice " + euler.slice[n]));
  parts.push(make("figure", {}, plot.root, make("figcaption", {}, "Dots: the recorded fragments of this pixel in both forms; those beyond 3 stand at the right side.")));
  if (euler) {
    const row = (name, g) => [words(name), ...g.slice(0, 3).map((x) => num(x, 5)), num(g[3], 5)];
    const least = Math.min(1, ...euler.transmittance.filter((t) => t !== null));
    parts.push(table(["<this pixel, as rendered, premultiplied", "red", "green", "blue", "T at the end"], [row("1 \u2212 exp(\u2212\u03baL)", ftb.gathered), row("\u03baL (riemann)", euler.gathered)]));
    parts.push(para(`The greatest \u03baL of a slab on this ray is ${num(worst, 4)}. `, worst > 2 ? strong("Past 2 the Euler step's transmittance grows instead of fading. ", "bad") : worst > 1 ? strong("Past 1 the Euler step's transmittance turns negative. ", "bad") : "It stays below 1, so the Euler step is stable here, and only inexact (of first order). ", least < 0 ? `Its transmittance falls to ${num(least, 4)} on the way.` : ""));
  }
  if (worst > 0 && Number.isFinite(worst)) {
    const rows = [1, 4, 16, 64].filter((m) => stack.count / m >= 1).map((m) => [num(Math.round(stack.count / m)), num(worst * m, 4), num(Math.exp(-worst * m), 4), worst * m > 1 ? strong(num(1 - worst * m, 4), "bad") : num(1 - worst * m, 4)]);
    parts.push(para("With fewer slices each is thicker, and its \u03baL larger in proportion:"), table(["slices", "\u03baL", "exp(\u2212\u03baL)", "1 \u2212 \u03baL"], rows), worked("Worked out here from the recorded \u03baL, for comparison; the exponential form stays between 0 and 1 for any thickness."));
  }
  return parts;
}

// 7. What was left out.
function leftOutPanel(place) {
  const { pixel } = place, parts = [];
  parts.push(para("A stage that a scene does not need is not in its pipeline, and work that cannot show is not done. For this scene:"));
  parts.push(table(["left out", "<why"], record.left_out.map(([what, why]) => [words(what), words(why)])));
  const empty = pixel.skipped.filter((s) => !s[2]).reduce((n, s) => n + s[1] - s[0], 0), done = pixel.skipped.filter((s) => s[2]).reduce((n, s) => n + s[1] - s[0], 0);
  parts.push(text("h3", "In the chosen pixel's block"));
  if (!pixel.span) parts.push(para("No slice covers the pixel: there was nothing to do."));
  else parts.push(table(["slices", "<what became of them"], [[String(pixel.slice.length), words("recorded: they went through all stages")], [String(empty), words("passed over: the transfer function shows nothing in the bricks of the volume that they cross there")], [String(done), words("passed over: every pixel of the block was finished")]]));
  parts.push(para(`In all, the picture took ${record.fragments.toLocaleString("en")} fragments of slice polygons and ${record.fetches.toLocaleString("en")} lookups of a value.`));
  return parts;
}

const STEPS = [
  { name: "Slices", title: "The box and its slices", show: slicesPanel },
  { name: "Coverage", title: "Which pixels a slice covers", show: coveragePanel },
  { name: "Lookup", title: "One fragment looks up its value", show: lookupPanel },
  { name: "Colour", title: "From a value to colour and opacity", show: colourPanel },
  { name: "Fog", title: "Fog", show: fogPanel },
  { name: "Blending", title: "Blending: the pixel's journey", show: blendPanel },
  { name: "Left out", title: "What this scene did not need", show: leftOutPanel },
];

const MEANINGS = { covered: "covered", length: "length of the piece, in slabs", cell: "cell", weight: "weights", value: "value", color: "C", alpha: "A", sum: ["over", "under", "add", "surfaces"].includes(scene.blend) ? "pixel" : "kept", transmittance: "T" };
// What a projection keeps, in the names of the step Blending.
function keptWords(quantity, x) {
  if (quantity === "sum") return (KEPT[scene.blend] || []).slice(0, 3).map(([name, f], c) => `${name} ${num(x[c] === null ? null : f(x[c]))}`);
  if (scene.blend === "add") return [`opacity ${num(x)}`];
  if (scene.blend === "surfaces" || scene.blend === "under") return [`T ${num(x)}`];
  return ["iso", "lmip", "attenuated-mip"].includes(scene.blend) ? [x > 0 ? "looking on" : "found"] : [];
}
// Every stage that ran on the slice, what it does in its own words, and what it set: whatever stages there are.
function fragmentList(place) {
  const { pixel, i } = place;
  if (i < 0) return [passed(place)];
  const rows = [];
  for (const stage of pixel.stages) {
    const said = [];
    for (const [quantity, entries] of Object.entries(stage.columns)) {
      const x = entries[i];
      if (x === null || x === undefined) continue;
      if (quantity === "color") said.push(make("span", {}, fragmentSwatch(pixel, i, stage.name), "C = " + premultiplied(x)));
      else if (quantity === "covered") said.push(x ? "covered" : "not covered");
      else if (scene.blend !== "over" && (quantity === "sum" || quantity === "transmittance")) said.push(...keptWords(quantity, x));
      else if (quantity === "value") said.push("value " + num(toData(x), 6));
      else said.push(`${MEANINGS[quantity]} ${quantity === "alpha" || quantity === "transmittance" ? "= " : ""}${Array.isArray(x) ? list(x, 4) : num(x, 5)}`);
    }
    if (said.length) rows.push(make("dt", {}, stage.name), make("dd", {}, text("div", stage.about, { class: "soft" }), said.flatMap((s, n) => (n ? [make("br", {}), s] : [s]))));
  }
  return [make("dl", {}, rows)];
}
