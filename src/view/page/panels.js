// The sections of the panel that are made of fields: view, crop, slices, light, fog, method and picture.

import { anglesOf, cameraOf, onWholeBox, placed, projected, withCamera, direction } from "./camera.js";
import { withBlend } from "./agree.js";
import { AXES, anglesOfNormal, cropOf, slicesOf, withCrop, withSlice } from "./clips.js";
import { button, byId, make } from "./dom.js";
import { planeControls } from "./planes.js";
import { at, withKey, withKeys } from "./store.js";
import { length, scale, short } from "./vectors.js";

/// Keys of the section render that belong to one algorithm alone.
const OWN = ["connectivity", "plane", "spacing_correction", "games", "seed"];

/// Fills the sections. `tools` holds what they share; `home` shows the view that the page began with. What it returns is told each document.
export function fillPanels({ fields, store, box, volume, windows, size, say, handles, planes, sizes, home, redraw }) {
  const { field } = fields;
  const fill = (id, ...children) => byId(id).append(...children);
  const camera = (document) => cameraOf(document, box, size());
  const fogged = (document) => (document.fog?.mode ?? "none") !== "none";
  const full = () => say("There are six clip planes already: take one away first.");
  const row = (...children) => make("div", { class: "row" }, ...children);

  // View.
  const angle = (name, label, more = {}) =>
    field({
      type: "number", label, digits: 5, ...more, help: "Degrees",
      get: (d) => anglesOf(camera(d), box)[name],
      set: (d, value) => withCamera(d, placed(camera(d), box, { ...anglesOf(camera(d), box), [name]: value }, fogged(d))),
    });
  const letters = (direction, plain) => volume.directions?.[direction] ?? plain;
  const front = box.front[1] > 0 ? 0 : 1;
  const views = [
    [letters(front ? "-y" : "+y", "Front"), 0, 0], [letters(front ? "+y" : "-y", "Back"), 180, 0],
    [letters(front ? "+x" : "-x", "Right"), 90, 0], [letters(front ? "-x" : "+x", "Left"), -90, 0],
    [letters("+z", "Top"), 0, 90], [letters("-z", "Bottom"), 0, -90],
  ];
  const names = { R: "right", L: "left", A: "front", P: "back", S: "above", I: "below" };
  const look = ([letter, azimuth, elevation]) =>
    button(letter, () => store.set(withCamera(store.document, placed(camera(store.document), box, { azimuth, elevation, roll: 0 }, fogged(store.document)))), {
      "aria-label": `View from ${names[letter] ?? `the ${letter.toLowerCase()}`}`,
      title: `From ${names[letter] ?? `the ${letter.toLowerCase()}`}`,
    });
  fill(
    "view-fields",
    make("div", { class: "row letters", role: "group", "aria-label": "Standard views" }, ...views.map(look)),
    row(button("As it was", home, { title: "The view that the page began with (Home)" }), button("Whole box", () => store.set(withCamera(store.document, onWholeBox(camera(store.document), box, size()))))),
    field({
      type: "select", label: "Projection", options: [["orthographic", "parallel rays"], ["perspective", "perspective"]],
      get: (d) => (camera(d).perspective ? "perspective" : "orthographic"),
      set: (d, value) => withCamera(d, projected(camera(d), value === "perspective", camera(d).fovY)),
    }),
    field({
      type: "range", label: "Angle of view", min: 5, max: 120, step: 1, words: (x) => `${short(x, 3)}°`,
      get: (d) => (camera(d).perspective ? camera(d).fovY : undefined),
      set: (d, value) => withCamera(d, projected(camera(d), true, value)),
    }),
    field({
      type: "range", label: "Zoom", scale: "log", min: 0.2, max: 50, words: (x) => `× ${short(x, 3)}`, help: "1 is the size of the view that the page began with",
      get: (d) => began() / seen(camera(d)),
      set: (d, value) => withCamera(d, magnified(camera(d), (seen(camera(d)) * value) / began())),
    }),
    row(angle("azimuth", "Azimuth"), angle("elevation", "Elevation", { min: -90, max: 90 }), angle("roll", "Roll"))
  );
  // World units along the picture's shorter side: a picture of another shape shows as much there.
  function began() {
    const document = home.document();
    return seen(camera(document));
  }
  function seen(c) {
    return c.perspective ? 2 * length([0, 1, 2].map((n) => c.target[n] - c.eye[n])) * Math.tan((c.fovY * Math.PI) / 360) : c.height;
  }
  function magnified(c, factor) {
    if (!c.perspective) return { ...c, height: c.height / factor };
    return { ...c, eye: c.target.map((t, n) => t + (c.eye[n] - t) / factor) };
  }

  // Crop box and free plane.
  const crop = (axis, side) =>
    field({
      type: "range", label: `${AXES[axis]} ${side ? "to" : "from"}`, min: box.low[axis], max: box.high[axis], step: 0.5, words: (x) => short(x, 4),
      get: (d) => cropOf(d, box)[axis][side],
      set: (d, value) => {
        const sides = cropOf(d, box);
        sides[axis][side] = side ? Math.max(value, sides[axis][0] + 1) : Math.min(value, sides[axis][1] - 1);
        return withCrop(d, sides, box) ?? full();
      },
    });
  const toggle = make("input", { type: "checkbox", id: "show-handles", change: () => handles.show(toggle.checked) });
  const clips = planeControls({
    planes, fields, store, box, size, say, redraw,
    shown: () => {
      toggle.checked = true;
      handles.show(true);
    },
  });
  fill(
    "crop-fields",
    make("label", { class: "check" }, toggle, "Handles in the picture"),
    ...AXES.flatMap((_, axis) => [crop(axis, 0), crop(axis, 1)]),
    row(button("No crop", () => store.set(withCrop(store.document, AXES.map((_, n) => [box.low[n], box.high[n]]), box)))),
    ...clips.rows
  );

  // Slices that show the data.
  const noSlices = () => say("There are six slices already.");
  const slices = AXES.flatMap((name, axis) => [
    field({
      type: "check", label: `Slice along ${name}`, ask: true, owns: ["cut"], get: (d) => slicesOf(d, box)[axis] !== null,
      set: (d, on) => {
        const next = withSlice(d, axis, on ? 0.5 * (box.low[axis] + box.high[axis]) : null, box);
        if (!next) return noSlices();
        // The first one has the window that the command takes; others have that of those that are there.
        return on && !d.cut && usual ? every("window")(next, usual) : next;
      },
    }),
    field({
      type: "range", label: `at ${name}`, min: box.low[axis], max: box.high[axis], step: 0.5, words: (x) => short(x, 4),
      get: (d) => slicesOf(d, box)[axis]?.at, set: (d, value) => withSlice(d, axis, value, box),
    }),
  ]);
  const every = (key) => (d, value) => withKey(d, "cut", d.cut.map((plane) => ({ ...plane, [key]: value })));
  const [low, high] = volume.range ?? [0, 1];
  // A cut without a window of its own shows the whole range.
  const windowed = (d) => d.cut?.[0]?.window ?? [0.5 * (low + high), high - low];
  const usual = windows[0] && [windows[0].center, windows[0].width];
  const named = (d) => windows.find((w) => w.center === windowed(d)[0] && w.width === windowed(d)[1])?.name ?? "own";
  const maps = ["gray", "bone", "viridis", "inferno", "magma", "plasma", "cividis", "turbo", "hot", "coolwarm"];
  const unit = volume.unit ? ` (${volume.unit})` : "";
  fill(
    "slice-fields",
    ...slices,
    field({ type: "select", label: "Colours", options: maps.map((m) => [m, m]), get: (d) => (d.cut ? d.cut[0].colormap ?? "gray" : undefined), set: every("colormap") }),
    field({
      type: "select", label: "Window", options: [...windows.map((w) => [w.name, w.name]), ["own", "as typed below"]],
      get: (d) => (d.cut && windows.length ? named(d) : undefined),
      set: (d, name) => {
        const found = windows.find((w) => w.name === name);
        return found ? every("window")(d, [found.center, found.width]) : null;
      },
    }),
    row(
      field({ type: "number", label: `Window centre${unit}`, get: (d) => (d.cut ? windowed(d)[0] : undefined), set: (d, v) => every("window")(d, [v, windowed(d)[1]]) }),
      field({ type: "number", label: `Window width${unit}`, min: (high - low) * 1e-6, get: (d) => (d.cut ? windowed(d)[1] : undefined), set: (d, v) => every("window")(d, [windowed(d)[0], v]) })
    )
  );

  // Light.
  const lit = (d) => d.light?.model !== undefined && d.light.model !== "none";
  const amount = (name, label, max) => field({ type: "range", key: `light.${name}`, label, min: 0, max, step: 0.01, when: lit });
  const lamp = (name, label, min, max) =>
    field({
      type: "range", label, min, max, step: 1, words: (x) => `${short(x, 3)}°`,
      get: (d) => (lit(d) && Array.isArray(d.light.direction) ? anglesOfNormal(d.light.direction, box)[name] : undefined),
      set: (d, value) => {
        const to = { ...anglesOfNormal(d.light.direction, box), [name]: value };
        return withKey(d, "light.direction", direction(to.azimuth, to.elevation, box.front));
      },
    });
  fill(
    "light-fields",
    field({
      type: "select", key: "light.model", label: "Light", ask: true,
      get: (d) => (lit(d) ? d.light.model : "none"),
      set: (d, value) => (value === "none" ? withKeys(d, { light: { model: "none" }, lights: undefined }) : withKey(d, "light", { ...d.light, model: value })),
    }),
    amount("ambient", "Ambient", 1),
    amount("diffuse", "Diffuse", 1),
    amount("specular", "Specular", 1),
    field({ type: "range", key: "light.shininess", label: "Shininess", min: 1, max: 200, step: 1, when: lit }),
    amount("emission", "Emission", 1),
    field({
      type: "select", label: "Comes from", options: [["head", "the eye"], ["fixed", "a fixed direction"]],
      get: (d) => (lit(d) && !d.lights && !d.light.position ? (Array.isArray(d.light.direction) ? "fixed" : "head") : undefined),
      set: (d, value) => withKey(d, "light.direction", value === "head" ? "head" : scale(camera(d).forward, -1)),
    }),
    lamp("azimuth", "Light azimuth", -180, 180),
    lamp("elevation", "Light elevation", -90, 90),
    field({ type: "color", key: "light.color", label: "Colour", when: lit }),
    field({ type: "select", key: "light.gradient", label: "Gradients", when: lit })
  );

  // Fog.
  const foggy = fogged;
  fill(
    "fog-fields",
    field({
      type: "select", key: "fog.mode", label: "Fog", ask: true,
      get: (d) => d.fog?.mode ?? "none",
      set: (d, mode) => (mode === "none" ? withKey(d, "fog", { background: false }) : withKeys(d, { "fog.mode": mode, "fog.density": undefined, "fog.start": undefined, "fog.end": undefined })),
    }),
    field({ type: "range", key: "fog.density", label: "Density", scale: "log", min: 0.02 / box.radius, max: 20 / box.radius, when: foggy }),
    field({ type: "number", key: "fog.start", label: "Begins at", when: foggy }),
    field({ type: "number", key: "fog.end", label: "Ends at", when: foggy }),
    field({ type: "color", key: "fog.color", label: "Colour", when: foggy }),
    field({ type: "select", key: "fog.distance", label: "Measured", when: foggy }),
    field({ type: "check", key: "fog.background", label: "Fog on the background too", when: foggy })
  );

  // Method.
  fill(
    "method-fields",
    field({
      type: "select", key: "render.blend", label: "Blend", ask: true,
      owns: ["render.blend", "render.level"],
      set: (d, blend, trying) => withBlend(d, blend, (low + high) / 2, trying),
    }),
    field({ type: "range", key: "render.level", label: "Surface at", min: low, max: high }),
    field({ type: "range", key: "render.threshold", label: "Threshold", min: low, max: high }),
    field({ type: "range", key: "render.attenuation", label: "Attenuation", min: 0, max: 20, step: 0.1 }),
    field({ type: "select", key: "render.algorithm", label: "Algorithm", ask: true, set: (d, v) => withKeys(d, { ...Object.fromEntries(OWN.map((key) => [`render.${key}`, undefined])), "render.algorithm": v }) }),
    field({ type: "select", key: "transfer.classification", label: "Classification", ask: true }),
    field({ type: "select", key: "render.filter", label: "Between voxels", ask: true, set: (d, v) => withKeys(d, { "render.filter": v, "render.prefilter": undefined }) }),
    field({
      type: "select", label: "Slices by", ask: true, options: [["tolerance", "allowed error"], ["count", "number"], ["spacing", "distance"]],
      owns: ["slices.tolerance", "slices.count", "slices.spacing"], help: "Allowed error: as many slices as keep the colours this near to those of very many. Number, distance: so many, or so far apart.",
      get: (d) => ["tolerance", "count", "spacing"].find((key) => d.slices?.[key] !== undefined && d.slices[key] !== null) ?? "count",
      set: (d, by) => withKeys(d, { "slices.tolerance": undefined, "slices.count": undefined, "slices.spacing": undefined, [`slices.${by}`]: { tolerance: 0.004, count: 256, spacing: box.radius / 128 }[by] }),
    }),
    field({ type: "range", key: "slices.tolerance", label: "Error below", scale: "log", min: 0.0005, max: 0.05, words: (x) => short(x, 2) }),
    field({ type: "number", key: "slices.count", label: "Slices", step: 1, min: 1, max: 65536 }),
    field({ type: "number", key: "slices.spacing", label: "Distance", min: 1e-9 })
  );

  // Picture.
  const background = (d) => at(d, "image.background") ?? [0, 0, 0, 0];
  const drawn = (key, label) =>
    field({ type: "check", key: `annotate.${key}`, label, get: (d) => at(d, `annotate.${key}`) ?? false, set: (d, on) => withKey(d, `annotate.${key}`, on || undefined) });
  fill(
    "picture-fields",
    field({ type: "color", label: "Background", get: background, set: (d, rgb) => withKey(d, "image.background", [...rgb, background(d)[3] || 1]) }),
    field({ type: "range", label: "Its opacity", min: 0, max: 1, step: 0.01, get: (d) => background(d)[3], set: (d, a) => withKey(d, "image.background", [...background(d).slice(0, 3), a]) }),
    sizes,
    drawn("axes", "Orientation letters"),
    drawn("scale_bar", "Scale bar"),
    drawn("colorbar", "Colour bar"),
    drawn("box", "Edges of the box"),
    field({ type: "text", label: "Title", get: (d) => at(d, "annotate.title") ?? null, set: (d, words) => withKey(d, "annotate.title", words) })
  );

  return clips;
}
