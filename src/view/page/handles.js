// What lies over the picture: the box, and handles to crop it, to move slices through it and to turn planes that cut it.

import { cameraOf, pixelOf } from "./camera.js";
import { AXES, anchorOf, cropOf, polygon, reach, slicesOf, turnedPlane, withCrop, withSlice } from "./clips.js";
import { byId, follow, make, put } from "./dom.js";
import { add, clamp, rotate, scale, short, unit } from "./vectors.js";

/// Edges of a box whose corners are numbered by bits.
const EDGES = [0, 1, 2, 3, 4, 5, 6, 7].flatMap((n) => [1, 2, 4].filter((bit) => !(n & bit)).map((bit) => [n, n | bit]));

/// Draws on `overlay`, an SVG element over the picture. `planes` are the clip planes, `full` hears when there is no room for another.
export function createHandles({ overlay, store, box, size, planes, full }) {
  const lines = make("g", { class: "lines" }), dots = make("g", {});
  const cross = make("path", { class: "crosshair", d: "" });
  overlay.append(lines, cross, dots);
  let on = false, crosshair = null;

  const camera = () => cameraOf(store.document, box, size());
  const pixel = (p) => pixelOf(camera(), size(), p);
  // Picture pixels for a pixel of the screen.
  const ratio = () => size()[1] / Math.max(overlay.clientHeight, 1);
  const apply = (next) => (next ? store.set(next) : full());

  /// A handle: `point` tells where it is in the world, `moved` takes a drag from where it began, `stepped` a number of steps by keys.
  function handle({ look, label, value, point, along, at, limits, set }) {
    const dot_ = make("circle", { class: `handle ${look}`, "data-handle": "", role: "slider", tabindex: 0, "aria-label": label, r: 8 });
    let begun = null;
    follow(dot_, {
      begin: (event) => {
        begun = { pointer: [event.clientX, event.clientY], at: at(), base: pixel(point()), tip: pixel(add(point(), along())) };
      },
      move: (event) => {
        // How far the pointer went along the handle's own direction in the picture.
        const way = [begun.tip[0] - begun.base[0], begun.tip[1] - begun.base[1]], square = Math.max(way[0] ** 2 + way[1] ** 2, 0.01);
        const went = [(event.clientX - begun.pointer[0]) * ratio(), (event.clientY - begun.pointer[1]) * ratio()];
        set(clamp(begun.at + (went[0] * way[0] + went[1] * way[1]) / square, ...limits()));
      },
    });
    dot_.addEventListener("keydown", (event) => {
      const [low, high] = limits(), step = value.step?.() ?? 1;
      const steps = { ArrowUp: 1, ArrowRight: 1, ArrowDown: -1, ArrowLeft: -1, PageUp: 10, PageDown: -10 }[event.key];
      const to = event.key === "Home" ? low : event.key === "End" ? high : steps ? at() + steps * step : null;
      if (to === null) return;
      event.preventDefault();
      event.stopPropagation();
      set(clamp(to, low, high));
    });
    const update = () => {
      const [x, y] = pixel(point()), [low, high] = limits();
      put(dot_, { cx: x, cy: y, r: 8 * ratio(), "aria-valuenow": short(at()), "aria-valuemin": short(low), "aria-valuemax": short(high), "aria-valuetext": value.words(at()) });
    };
    return { element: dot_, update };
  }

  /// The middle of face `side` of `axis` of the crop box.
  function faceMiddle(axis, side) {
    const crop = cropOf(store.document, box);
    return box.toWorld(crop.map((sides, n) => (n === axis ? sides[side] : 0.5 * (sides[0] + sides[1]))));
  }

  const crops = AXES.flatMap((name, axis) =>
    [0, 1].map((side) =>
      handle({
        look: "crop",
        label: `Crop, ${side ? "high" : "low"} ${name}`,
        value: { words: (at) => `voxel ${short(at)}` },
        point: () => faceMiddle(axis, side),
        along: () => box.columns[axis],
        at: () => cropOf(store.document, box)[axis][side],
        limits: () => {
          const other = cropOf(store.document, box)[axis][1 - side];
          return side ? [Math.min(other + 1, box.high[axis]), box.high[axis]] : [box.low[axis], Math.max(other - 1, box.low[axis])];
        },
        set: (at) => {
          const crop = cropOf(store.document, box);
          crop[axis][side] = at;
          apply(withCrop(store.document, crop, box));
        },
      })
    )
  );

  const middleOf = (points) => (points.length ? scale(points.reduce(add), 1 / points.length) : box.center);
  const slices = AXES.map((name, axis) => {
    const there = () => slicesOf(store.document, box)[axis];
    return {
      there,
      ...handle({
        look: "slice",
        label: `Slice along ${name}`,
        value: { words: (at) => `voxel ${short(at)}` },
        point: () => middleOf(polygon(there().plane, box)),
        along: () => box.columns[axis],
        at: () => there().at,
        limits: () => [box.low[axis], box.high[axis]],
        set: (at) => apply(withSlice(store.document, axis, at, box)),
      }),
    };
  });

  /// Handles of the plane that is chosen: one moves it, one turns it.
  const free = () => planes.chosen(store.document);
  const change = (plane) => apply(planes.changed(store.document, plane));
  const reachOfTip = () => 0.25 * box.radius;
  const mover = handle({
    look: "free",
    label: "Clip plane, position",
    value: { words: (at) => `offset ${short(at)}`, step: () => box.radius / 100 },
    point: () => anchorOf(free(), box),
    along: () => unit(free().normal),
    at: () => free().offset,
    limits: () => reach(free().normal, box),
    set: (offset) => change({ ...free(), offset }),
  });
  const tip = make("circle", { class: "handle free tip", "data-handle": "", role: "slider", tabindex: 0, r: 7, "aria-label": "Clip plane, direction: arrow keys turn it", "aria-valuenow": 0 });
  function tilt(rightwards, upwards) {
    const { right, up } = camera(), plane = free();
    change(turnedPlane(plane, rotate(rotate(plane.normal, up, rightwards), right, -upwards), box));
  }
  let from = null;
  follow(tip, {
    begin: (event) => (from = [event.clientX, event.clientY]),
    move: (event) => {
      tilt(0.5 * (event.clientX - from[0]), 0.5 * (from[1] - event.clientY));
      from = [event.clientX, event.clientY];
    },
  });
  tip.addEventListener("keydown", (event) => {
    const way = { ArrowLeft: [-3, 0], ArrowRight: [3, 0], ArrowUp: [0, 3], ArrowDown: [0, -3] }[event.key];
    if (!way) return;
    event.preventDefault();
    event.stopPropagation();
    tilt(...way);
  });

  /// The children of the group of handles are those that stand for something now; one that keeps its place keeps its focus.
  function present(wanted) {
    const there = [...dots.children];
    if (there.length === wanted.length && there.every((element, n) => element === wanted[n])) return;
    const focused = document.activeElement;
    dots.replaceChildren(...wanted);
    if (wanted.includes(focused)) focused.focus();
  }

  const crossAt = ([x, y], arm) => `M${x - arm} ${y}H${x + arm}M${x} ${y - arm}V${y + arm}`;

  function update() {
    const [width, height] = size();
    put(overlay, { viewBox: `0 0 ${width} ${height}` });
    const points = (list) => list.map((p) => pixel(p).map((x) => x.toFixed(1)).join(",")).join(" ");
    const shapes = [], wanted = [];
    // Handles belong to the sections of crop and slices: with both of them folded they are out of the way.
    const shown = on && ["crop", "cuts"].some((id) => byId(id).open);
    if (shown) {
      const crop = cropOf(store.document, box);
      const corner = (n) => box.toWorld(crop.map((sides, axis) => sides[(n >> axis) & 1]));
      shapes.push(...EDGES.map(([a, b]) => make("polyline", { class: "edge", points: points([corner(a), corner(b)]) })));
      for (const h of crops) wanted.push(h);
    }
    for (const slice of slices) {
      const cut = slice.there();
      if (!cut || !shown) continue;
      shapes.push(make("polygon", { class: "cut", points: points(polygon(cut.plane, box)) }));
      wanted.push(slice);
    }
    if (free() && shown) {
      const middle = anchorOf(free(), box), end = add(middle, scale(unit(free().normal), reachOfTip()));
      for (const plane of planes.all(store.document)) if (plane !== free()) shapes.push(make("polygon", { class: "free other", points: points(polygon(plane, box)) }));
      shapes.push(make("polygon", { class: "free", points: points(polygon(free(), box)) }), make("polyline", { class: "free", points: points([middle, end]) }));
      const [cx, cy] = pixel(end), normal = unit(free().normal);
      put(tip, { cx, cy, r: 7 * ratio(), "aria-valuetext": `normal ${normal.map((x) => short(x, 2)).join(", ")}` });
      wanted.push(mover, { element: tip, update: () => {} });
    }
    lines.replaceChildren(...shapes);
    present(wanted.map((h) => h.element));
    wanted.forEach((h) => h.update());
    put(cross, { d: crosshair ? crossAt(crosshair, 10 * ratio()) : "" });
  }

  return {
    update,
    /// Whether handles are shown.
    show(wanted) {
      on = wanted;
      update();
    },
    /// The probe's place, or null.
    mark(place) {
      crosshair = place;
      update();
    },
  };
}
