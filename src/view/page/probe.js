// The probe: what lies behind a pixel, and how its colour comes about on the way through the volume.

import * as server from "./server.js";
import { byId, hex, make } from "./dom.js";
import { clamp, short } from "./vectors.js";

const WIDTH = 320, HEIGHT = 150, LEFT = 34, RIGHT = 30, TOP = 6, BOTTOM = 20;

/// Fills the section of the probe. `mark` shows the place in the picture.
export function createProbe({ store, volume, size, mark, say, section }) {
  // The place as shares of the picture's width and height.
  let place = null, busy = false, again = false;

  const words = (point, unit) => (point ? `${point.map((x) => short(x, 5)).join(", ")}${unit ? ` ${unit}` : ""}` : "-");

  async function ask() {
    if (!place) return;
    if (busy) return void (again = true);
    busy = true;
    try {
      const [x, y] = pixel(), found = await server.probe(store.document, size(), [x, y]);
      if (place) {
        show(found, [x, y]);
        tell(found);
      }
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
    byId("probe-note").textContent = found.note ?? (found.hit ? "" : "Nothing here.");
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

  /// The card beside the cross: what is there, in a line or two.
  const card = byId("probe-card"), sentence = byId("probe-words");
  function tell(found) {
    const seen = found.voxel !== null && (found.pixel?.[3] ?? 0) > 0;
    const value = found.value === null ? "" : `${short(found.value, 5)}${volume.unit ? ` ${volume.unit}` : ""}`;
    const rows = seen || value ? [[value && "Value", value], [found.label && "Label", found.label], ["Voxel", words(found.voxel?.map(Math.round))]] : [];
    const lines = rows.filter(([name, text]) => name && text).map(([name, text]) => make("span", {}, `${name} ${text}`));
    sentence.replaceChildren(...(lines.length ? lines : [make("span", {}, "Nothing here.")]));
    put();
  }
  /// The card stands to the right of the cross, or to the left where there is no room.
  function put() {
    card.hidden = !place;
    if (!place) return;
    const frame = byId("frame"), stage = byId("stage");
    const x = frame.offsetLeft + place[0] * frame.clientWidth, y = frame.offsetTop + place[1] * frame.clientHeight;
    const right = x + 16 + card.offsetWidth < stage.clientWidth;
    card.style.left = `${right ? x + 16 : Math.max(4, x - 16 - card.offsetWidth)}px`;
    card.style.top = `${clamp(y + 16, 4, Math.max(4, stage.clientHeight - card.offsetHeight - 4))}px`;
  }

  /// The place as a pixel of the picture at its present size.
  const pixel = () => size().map((n, k) => clamp(Math.floor(place[k] * n), 0, n - 1));
  function refit() {
    mark(place && pixel().map((p) => p + 0.5));
    put();
  }

  function to(next) {
    place = next && size().map((n, k) => (clamp(Math.floor(next[k]), 0, n - 1) + 0.5) / n);
    byId("probe-hint").hidden = Boolean(place);
    if (!place) sentence.replaceChildren();
    refit();
    ask();
  }

  byId("probe-more").addEventListener("click", () => {
    section.open = true;
    section.scrollIntoView({ block: "start" });
    section.querySelector("summary").focus({ preventScroll: true });
  });
  byId("probe-end").addEventListener("click", () => {
    to(null);
    byId("frame").focus();
  });

  return {
    at: to,
    get on() {
      return place !== null;
    },
    /// Begins in the middle, or ends.
    toggle: () => to(place ? null : size().map((n) => n / 2)),
    move: (x, y) => to([pixel()[0] + x, pixel()[1] + y]),
    /// The picture has changed: what lies there now?
    refresh: ask,
    /// The picture has another size: the cross stays where it is in what is seen.
    resized: refit,
  };
}
