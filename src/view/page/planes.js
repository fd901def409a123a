// Clip planes of any direction: which of them is being edited, and the part of the panel that does so.

import { cameraOf, direction } from "./camera.js";
import { MOST, anglesOfNormal, freePlanes, newPlane, reach, turnedPlane, withFreePlane } from "./clips.js";
import { button, make } from "./dom.js";
import { short } from "./vectors.js";

/// The planes of the document in view, one of which is chosen.
export function createPlanes(box) {
  let n = 0;
  const all = (document) => freePlanes(document, box);
  const index = (document) => Math.max(0, Math.min(n, all(document).length - 1));
  return {
    all, index,
    chosen: (document) => all(document)[index(document)],
    choose: (to) => (n = to),
    /// `document` with `plane` in the place of the one that is chosen; null where there is no room.
    changed: (document, plane) => withFreePlane(document, box, index(document), plane),
  };
}

/// The controls. `shown` is told when handles are wanted, `redraw` when another plane is chosen.
export function planeControls({ planes, fields, store, box, size, say, shown, redraw }) {
  const { field } = fields;
  const which = make("p", { class: "soft", "aria-live": "polite", id: "plane-count" });
  const step = (by) => () => {
    const document = store.document, count = planes.all(document).length;
    planes.choose((planes.index(document) + by + count) % count);
    redraw();
  };
  const previous = button("Previous", step(-1), { "aria-label": "Previous plane" }), next = button("Next", step(1), { "aria-label": "Next plane" });
  const add = button("Add a plane", () => {
    const document = store.document, count = planes.all(document).length;
    const made = withFreePlane(document, box, count, newPlane(cameraOf(document, box, size()), box));
    if (!made) return say("There are six clip planes already, sides of the crop box included: take one away first.");
    planes.choose(count);
    store.set(made);
    shown();
    say("Drag the filled red dot in the picture to move the plane, the hollow one to turn it.");
  });
  const remove = button("Remove this plane", () => {
    store.set(planes.changed(store.document, null));
    // A button that goes must not take the focus with it.
    if (!planes.all(store.document).length) add.focus();
  });
  const tilt = (name, label, min, max) =>
    field({
      type: "range", label, min, max, step: 1, words: (x) => `${short(x, 3)}°`,
      get: (d) => (planes.chosen(d) ? anglesOfNormal(planes.chosen(d).normal, box)[name] : undefined),
      set: (d, value) => {
        const plane = planes.chosen(d), to = { ...anglesOfNormal(plane.normal, box), [name]: value };
        return planes.changed(d, turnedPlane(plane, direction(to.azimuth, to.elevation, box.front), box));
      },
    });
  /// What the buttons say of `document`.
  function update(document) {
    const count = planes.all(document).length, n = planes.index(document);
    const words = count ? `Plane ${n + 1} of ${count}` : "No clip plane besides the crop box.";
    if (which.textContent !== words) which.textContent = words;
    previous.hidden = next.hidden = count < 2;
    remove.disabled = count === 0;
    remove.title = count ? "" : "There is none.";
    add.disabled = (document.clip ?? []).length >= MOST;
    add.title = add.disabled ? "There are six clip planes already, sides of the crop box included." : "";
  }
  const rows = [
    make("div", { class: "row" }, which, previous, next),
    make("div", { class: "row" }, add, remove),
    field({
      type: "range", label: "Plane at", min: (d) => reach(planes.chosen(d).normal, box)[0], max: (d) => reach(planes.chosen(d).normal, box)[1],
      get: (d) => planes.chosen(d)?.offset,
      set: (d, value) => planes.changed(d, { ...planes.chosen(d), offset: value }),
    }),
    tilt("azimuth", "Plane azimuth", -180, 180),
    tilt("elevation", "Plane elevation", -90, 90),
  ];
  return { rows, update };
}
