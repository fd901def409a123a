// The step Light: for scenes that have some.
const bar = (rgb, most) => make("span", { class: "bars" }, ["red", "green", "blue"].map((c, n) => make("span", { style: `background:var(--${c});width:${num((100 * Math.min(most, Math.max(0, rgb[n]))) / most, 4)}%` })));
const lampName = (lamp, n) => `light ${n + 1}, ` + { head: "at the eye", direction: "from far away", position: "at a point" }[lamp.source];

function lightPanel(place) {
  const { pixel, i } = place, parts = [], light = record.light, l = entry(pixel, "light", i), g = entry(pixel, "gradient", i), depth = light.model === "depth";
  if (depth) parts.push(para("The model of early systems: the deeper in the box, the darker. It needs no gradient: colours are multiplied by what is left between the box's nearest and farthest depth."));
  else {
    parts.push(para("Light makes surfaces seen: bright where they face a light, with a highlight where they mirror it to the eye. On the straight colour c:"));
    parts.push(formula(["c\u2032 = c \u00b7 (emission + ambient + diffuse \u00b7 \u03a3 S c_light) + specular \u00b7 \u03a3 H^shininess \u00b7 c_light", `S = ${light.two_sided ? "|n\u00b7l|" : "max(0, n\u00b7l)"}, H = ${light.two_sided ? "|n\u00b7h|" : "max(0, n\u00b7h)"}, h = (l + v) / |l + v|; clamped to 0..1`]));
  }
  if (i < 0) return [...parts, passed(place)];
  if (!l) return [...parts, note("", !pixel.covered[i] ? "The slice does not cover this pixel." : "This fragment is transparent: there is nothing to light."), lightPlot(pixel, place)];
  const A = l.before[3], c = straightOf(l.before.slice(0, 3), A), after = straightOf(l.lit, A);
  if (depth) {
    const [d0, d1] = light.depths, d = d1 - l.weight * (d1 - d0);
    parts.push(formula([`c\u2032 = c \u00b7 (1 \u2212 (d \u2212 d\u2080) / (d\u2081 \u2212 d\u2080)) = c \u00b7 (1 \u2212 (${num(d, 6)} \u2212 ${num(d0, 6)}) / (${num(d1, 6)} \u2212 ${num(d0, 6)})) = c \u00b7 ${num(l.weight, 5)}`, "d: the fragment's depth; the box reaches from d\u2080 to d\u2081"]));
  } else if (!g || !l.s) parts.push(note("", "The gradient is 0 here: no direction to light from, and the colour stays as it is."));
  else {
    const n = unit3(g.g).map((x) => -x), v = l.to_eye || light.to_eye, arrows = [[n, "n", "var(--bad)"], [v, "v", "var(--accent)"]], vectors = [["n, the normal", n], ["v, to the eye", v]];
    light.lights.forEach((lamp, at) => {
      const to = lamp.source === "head" ? v : lamp.source === "direction" ? lamp.vector : l.to_light[at], half = unit3(to.map((x, k) => x + v[k])), tag = light.lights.length > 1 ? String(at + 1) : "";
      if (lamp.source !== "head") arrows.push([to, "l" + tag, "var(--green)"], [half, "h" + tag, "var(--soft)", "5 3"]);
      vectors.push([`l${tag}, ${lampName(lamp, at)}`, to], [`h${tag}, half way`, half]);
    });
    parts.push(make("div", { class: "pair" }, make("figure", {}, arrowsDrawing(arrows, "normal, eye, lights"), make("figcaption", {}, "Red: the normal; blue: to the eye; green: to the lights; dashed: half way. Seen almost from the eye." + (light.lights.some((x) => x.source === "head") ? " A light at the eye has l = h = v." : ""))),
      table(["<direction, world space", "x", "y", "z"], vectors.map(([name, d]) => [words(name), ...d.map((x) => num(x, 4))]))));
    parts.push(text("h3", "Cosines"));
    parts.push(table(["<light", "straight", "S", "H", `H^${num(light.shininess)}`], light.lights.map((lamp, at) => [words(lampName(lamp, at)), swatch(lamp.color), num(l.s[at], 5), num(l.h[at], 5), num(l.h[at] ** light.shininess, 5)])));
    const sum = (f) => [0, 1, 2].map((k) => light.lights.reduce((s, lamp, at) => s + f(at) * lamp.color[k], 0));
    const own = c.map((x) => x * (light.emission + light.ambient)), surface = sum((at) => l.s[at]).map((x, k) => c[k] * light.diffuse * x), mirror = sum((at) => l.h[at] ** light.shininess).map((x) => x * light.specular);
    const total = own.map((x, k) => x + surface[k] + mirror[k]), clamped = total.map((x) => Math.min(1, x)), most = Math.max(1, ...total);
    parts.push(text("h3", "The terms of the sum, all of them straight colours"));
    const row = (name, rgb) => [words(name), swatch(rgb), bar(rgb, most), ...rgb.map((x) => num(x, 4))];
    const rows = [row("c, before light", c), row(`emission + ambient, c \u00b7 ${num(light.emission + light.ambient, 4)}`, own), row(`diffuse, c \u00b7 ${num(light.diffuse, 4)} \u00b7 \u03a3 S c_light`, surface), row(`specular, ${num(light.specular, 4)} \u00b7 \u03a3 H^${num(light.shininess)} c_light`, mirror), row("their sum", total)];
    if (total.some((x) => x > 1)) rows.push(row("clamped to 1", clamped));
    if (light.floor > 0) rows.push(row(`weighed: ${num(l.weight, 4)} of it, ${num(1 - l.weight, 4)} of c`, after));
    parts.push(table(["<term", "straight", "", "red", "green", "blue"], rows));
    if (light.floor > 0) parts.push(formula([`weight = |g|\u00b2 / (|g|\u00b2 + g\u2080\u00b2) = ${num(Math.hypot(...g.g), 5)}\u00b2 / (${num(Math.hypot(...g.g), 5)}\u00b2 + ${num(light.floor, 5)}\u00b2) = ${num(l.weight, 5)}`, "where the gradient is faint its direction is mostly noise: the lit colour counts less there"]));
  }
  parts.push(text("h3", "Before and after"));
  const left = straightOf(l.left, A);
  parts.push(table(["", "", "<straight", "<premultiplied, A \u00b7 c"], [["before", fragmentSwatch(pixel, i, stageBefore(pixel, "light")), words(list(c, 4)), words(list(l.before.slice(0, 3), 4))], ["recomputed", swatch(after), words(list(after, 4)), words(list(l.lit, 4))], ["recorded", fragmentSwatch(pixel, i, "light"), words(list(left, 4)), words(list(l.left, 4))]]));
  parts.push(para(`Opacity A = ${num(A, 5)} stays: light changes colours, not how much is seen through.`), agreement(pixel, i));
  return [...parts, lightPlot(pixel, place)];
}

function lightPlot(pixel, place) {
  const lit = (f) => alongRay(pixel, (n) => { const l = pixel.light[n]; return l ? f(l) : null; }), mean = (x, A) => straightOf(x.slice(0, 3), A).reduce((s, v) => s + v, 0) / 3;
  if (!pixel.light || !pixel.light.some(Boolean)) return null;
  const phong = record.light.model !== "depth", parts = [];
  if (phong) {
    const plot = new Plot(rayRange(), [0, 1.05], { height: 230, xlabel: "slice", label: "cosines along the ray", keys: record.light.lights.flatMap((_, n) => { const tag = record.light.lights.length > 1 ? " of light " + (n + 1) : ""; return [["S" + tag, shades[n]], ["H" + tag, shades[n], "4 3"]]; }) });
    record.light.lights.forEach((_, n) => { broken(plot, lit((l) => (l.s ? l.s[n] : null)), shades[n]); broken(plot, lit((l) => (l.h ? l.h[n] : null)), shades[n], { dash: "4 3", width: 1.6 }); });
    plot.mark(place.k, "var(--bad)", "slice " + place.k, true);
    parts.push(make("figure", {}, plot.root, make("figcaption", {}, "S and H of the fragments of this ray that are not transparent.")));
  }
  const plot = new Plot(rayRange(), [0, 1.05], { height: 250, xlabel: "slice", label: "colour before and after light along the ray", keys: ["red", "green", "blue"].flatMap((c) => [[c + " before", `var(--${c})`, "4 3"], [c + " after", `var(--${c})`]]) });
  ["red", "green", "blue"].forEach((c, n) => { broken(plot, lit((l) => l.before[n] / l.before[3]), `var(--${c})`, { dash: "4 3", width: 1.4 }); broken(plot, lit((l) => l.left[n] / l.before[3]), `var(--${c})`); });
  plot.mark(place.k, "var(--bad)", "slice " + place.k, true);
  parts.push(make("figure", {}, plot.root, make("figcaption", {}, "Straight colours before light and after it, as recorded.")));
  return parts;
}
const shades = ["var(--accent)", "var(--green)", "var(--red)", "var(--grey)"];
if (record.light) STEPS.splice(stepAt("Fog"), 0, { name: "Light", title: "Light on the fragment", show: lightPanel });
document.head.append(make("style", {}, ".bars { display: inline-block; width: 5rem; } .bars span { display: block; height: 0.3rem; margin: 0.08rem 0; } .small-chart { max-width: 26rem; }"));
document.querySelector("footer p").textContent = document.querySelector("footer p").textContent.replace("1 to 7", "1 to " + STEPS.length);
