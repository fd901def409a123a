// Ready-made transfer functions, each with a small picture of the data as it would look.

import * as server from "./server.js";
import { byId, make } from "./dom.js";

const SIDE = 96;

/// Fills the section of presets. `apply` shows a document; pictures are made while `idle` says that nothing else is.
export function createPresets({ presets, store, apply, say, idle }) {
  const cards = presets.map((preset) => {
    const image = make("img", { alt: "", width: SIDE, height: SIDE, hidden: true });
    const card = make(
      "button",
      { type: "button", class: "preset", title: preset.why ? `${preset.about}. ${preset.why}` : preset.about, "aria-label": `${preset.name}: ${preset.about}`, click: () => choose(preset.name) },
      make("span", { class: "thumb" }, image),
      make("span", {}, preset.name)
    );
    return { preset, card, image };
  });
  const fit = cards.filter((c) => c.preset.fits), rest = cards.filter((c) => !c.preset.fits);
  byId("presets-fit").append(...fit.map((c) => c.card));
  byId("presets-rest").append(...rest.map((c) => c.card));
  byId("presets-more").hidden = rest.length === 0;
  byId("presets-none").hidden = fit.length > 0;
  byId("presets").hidden = presets.length === 0;

  async function choose(name) {
    try {
      const found = await server.preset(store.document, name);
      apply(found.document);
      say([`Preset ${name}.`, ...(found.warnings ?? [])].join(" "));
    } catch (error) {
      say(error.message);
    }
  }

  let filling = false;
  /// Makes the pictures of `some` that have none, one by one. Pictures are of the view at the time.
  async function paint(some, again) {
    if (again) for (const c of some) c.image.hidden = true;
    if (filling) return;
    filling = true;
    for (const c of some.filter((c) => c.image.hidden)) {
      while (!idle()) await new Promise((later) => setTimeout(later, 300));
      try {
        const blob = await server.thumbnail(store.document, c.preset.name, SIDE);
        URL.revokeObjectURL(c.image.src);
        c.image.src = URL.createObjectURL(blob);
        await c.image.decode();
        c.image.hidden = false;
      } catch (error) {
        // One that does not go together with the scene has no picture; its button tells why.
        c.card.title = error.message;
      }
    }
    filling = false;
  }

  const section = byId("presets"), more = byId("presets-more");
  section.addEventListener("toggle", () => section.open && paint(fit, true));
  more.addEventListener("toggle", () => more.open && paint(rest, true));
  byId("presets-again").addEventListener("click", () => paint(more.open ? cards : fit, true));
  if (section.open) paint(fit, false);
}
