// The probe: what lies behind a pixel, and how its colour comes about on the way through the volume.

import * as server from "./server.js";
import { byId, hex, make } from "./dom.js";
import { clamp, short } from "./vectors.js";

const WIDTH = 320, HEIGHT = 150, LEFT = 34, RIGHT = 30, TOP = 6, BOTTOM = 20;

/// Fills the section of the probe. `mark` shows the place in the picture.
export function createProbe({ store, volume, size, mark, say, section }) {
  let place = null, busy = false, again = false;

  const words = (point, unit) => (point ? `${point.map((x) => short(x, 5)).join(", ")}${unit ? ` ${unit}` : ""}` : "-");

  async function ask() {
    if (!place) return;
    if (busy) return void (again = true);
    busy = true;
    try {
      const [x, y] = place.map(Math.floor);
      show(await server.probe(store.document, size(), [x, y]), [x, y]);
    } catch (error) {
      say(error.message);
    }
    busy = false;
    if (again) {
      again = false;
      ask();
    }
  }

  function show(found, [x, y]) {
    const [r, g, b, a] = found.pixel ?? [0, 0, 0, 0];
    const rows = [
      ["Pixel", `${x}, ${y}`],
      ["Voxel", words(found.voxel)],
      ["World", words(found.world, volume.length_unit)],
      ["Value", found.value === null ? "-" : `${short(found.value, 6)}${volume.unit ? ` ${volume.unit}` : ""}`],
    ];
    if (found.label) rows.push(["Label", found.label]);
    rows.push(["Colour", `${[r, g, b].map((c) => short(c, 3)).join(", ")} (premultiplied), opacity ${short(a, 3)}`]);
    byId("probe-facts").replaceChildren(...rows.flatMap(([name, text]) => [make("dt", {}, name), make("dd", {}, text)]));
    byId("probe-note").textContent = found.note ?? (found.hit ? "" : "The ray meets nothing there.");
    byId("probe-plot").replaceChildren(...(found.journey?.depth.length ? [plot(found.journey)] : []));
  }

  /// Value (line), opacity of each slice (bars in its colour) and transmittance (dashed), front to back.
  function plot({ depth, value, opacity, color, transmittance }) {
    const wide = WIDTH - LEFT - RIGHT, tall = HEIGHT - TOP - BOTTOM, bottom = TOP + tall;
    const [near, far] = [depth[0], depth.at(-1)], span = far - near || 1;
    const seen = value.filter(Number.isFinite), [low, high] = [Math.min(...seen), Math.max(...seen)];
    const x = (d) => LEFT + (wide * (d - near)) / span, share = (s) => bottom - tall * clamp(s, 0, 1);
    const v = (n) => share((value[n] - low) / (high - low || 1));
    const most = Math.max(1e-9, ...opacity), bar = Math.max(wide / depth.length, 0.6);
    const line = (height) => depth.map((d, n) => `${x(d).toFixed(1)},${height(n).toFixed(1)}`).join(" ");
    const text = (px, py, anchor, words) => make("text", { x: px, y: py, "text-anchor": anchor }, words);
    const bars = depth.map((d, n) => (opacity[n] > 0.002 * most ? make("rect", { x: x(d) - bar / 2, y: share(opacity[n] / most), width: bar, height: bottom - share(opacity[n] / most), fill: color?.[n] ? hex(color[n]) : "currentColor" }) : null));
    return make(
      "svg",
      { viewBox: `0 0 ${WIDTH} ${HEIGHT}`, class: "journey", role: "img", "aria-label": `Along the ray: values from ${short(low)} to ${short(high)}, opacity of a slice up to ${short(most)}, transmittance left ${short(transmittance.at(-1), 3)}` },
      make("line", { class: "tick", x1: LEFT, x2: LEFT + wide, y1: bottom, y2: bottom }),
      make("g", { class: "bars" }, ...bars),
      make("polyline", { class: "value", points: line(v) }),
      make("polyline", { class: "transmittance", points: line((n) => share(transmittance[n])) }),
      text(LEFT - 3, TOP + 8, "end", short(high, 3)),
      text(LEFT - 3, bottom, "end", short(low, 3)),
      text(LEFT + wide + 3, TOP + 8, "start", "1"),
      text(LEFT + wide + 3, bottom, "start", "0"),
      text(LEFT, HEIGHT - 6, "start", short(near)),
      text(LEFT + wide / 2, HEIGHT - 6, "middle", "depth"),
      text(LEFT + wide, HEIGHT - 6, "end", short(far))
    );
  }

  function to(next) {
    const [width, height] = size();
    place = next && [clamp(next[0], 0, width - 1), clamp(next[1], 0, height - 1)];
    mark(place && place.map((p) => Math.floor(p) + 0.5));
    byId("probe-hint").hidden = Boolean(place);
    if (!place) return;
    section.open = true;
    ask();
  }

  return {
    at: to,
    get on() {
      return place !== null;
    },
    /// Begins in the middle, or ends.
    toggle: () => to(place ? null : size().map((n) => n / 2)),
    move: (x, y) => to([place[0] + x, place[1] + y]),
    /// The picture has changed: what lies there now?
    refresh: ask,
  };
}
