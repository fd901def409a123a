// Ready-made transfer functions, each with a small picture of the data as it would look.

import * as server from "./server.js";
import { withBlend } from "./agree.js";
import { byId, make } from "./dom.js";

const SIDE = 96;

/// Fills the section of presets. `apply` shows a document; pictures are made while `idle` says that nothing else is.
export function createPresets({ presets, store, apply, say, idle }) {
  const cards = presets.map((preset) => {
    const image = make("img", { alt: "", width: SIDE, height: SIDE, hidden: true });
    const thumb = make("span", { class: "thumb" }, image);
    const card = make(
      "button",
      { type: "button", class: "preset", title: preset.why ? `${preset.about}. ${preset.why}` : preset.about, "aria-label": `${preset.name}: ${preset.about}`, click: () => choose(preset) },
      thumb,
      make("span", {}, preset.name)
    );
    return { preset, card, image, thumb };
  });
  const fit = cards.filter((c) => c.preset.fits), rest = cards.filter((c) => !c.preset.fits);
  byId("presets-fit").append(...fit.map((c) => c.card));
  byId("presets-rest").append(...rest.map((c) => c.card));
  byId("presets-more").hidden = rest.length === 0;
  byId("presets-none").hidden = fit.length > 0;
  byId("presets").hidden = presets.length === 0;

  // The blend that a preset has brought with it, and the one that it came for.
  let brought = null;
  /// The document with the blend that `preset` is made for, or with the one from before another such preset.
  function blended({ blend }) {
    const document = store.document, now = document.render?.blend ?? "over";
    if (blend) return { scene: withBlend(document, blend, 0, true), to: blend };
    if (brought && brought.blend === now) return { scene: withBlend(document, brought.before, 0, true), to: brought.before };
    return { scene: document, to: now };
  }

  async function choose(preset) {
    const { name, blend } = preset, now = store.document.render?.blend ?? "over", { scene, to } = blended(preset);
    try {
      const found = await server.preset(scene, name);
      brought = blend ? { blend, before: brought?.blend === now ? brought.before : now } : null;
      apply(found.document);
      say([`Preset ${name}.`, ...(to !== now ? [blend ? `Blend is ${to} now, which it is made for.` : `Blend is ${to} again.`] : []), ...(found.warnings ?? [])].join(" "));
    } catch (error) {
      say(error.message);
    }
  }

  let waiting = [], filling = false;
  /// Makes the pictures of `some`, one by one, in the place of those that they have. They are of the view at the time.
  async function paint(some) {
    waiting = [...waiting.filter((c) => !some.includes(c)), ...some];
    if (filling) return;
    filling = true;
    while (waiting.length) {
      if (!idle()) {
        await new Promise((later) => setTimeout(later, 300));
        continue;
      }
      const { preset, card, image, thumb } = waiting.shift();
      try {
        const blob = await server.thumbnail(blended(preset).scene, preset.name, SIDE);
        URL.revokeObjectURL(image.src);
        image.src = URL.createObjectURL(blob);
        await image.decode();
        image.hidden = thumb.hidden = false;
      } catch (error) {
        // One that does not go together with the scene has no picture; its button tells why.
        card.title = error.message;
        thumb.hidden = true;
      }
    }
    filling = false;
  }

  const section = byId("presets"), more = byId("presets-more");
  section.addEventListener("toggle", () => section.open && paint(fit));
  more.addEventListener("toggle", () => more.open && paint(rest));
  byId("presets-again").addEventListener("click", () => paint(more.open ? cards : fit));
}
