// Controls that show a part of the document and change it.
//
// A field has `get` (its value in a document, undefined where it has none: then it is hidden) and `set` (a document with another value). A
// field with `ask` sends what comes of it through the server, which decides what the document then leaves open.

import { hex, make, rgbOf } from "./dom.js";
import { at, withKey } from "./store.js";
import { clamp, short } from "./vectors.js";

/// An input of a number. What is typed is taken when it is done, and then the input shows what is in force, `now`; a number beyond `min` or `max`
/// is told.
export function numberInput({ label, step = "any", min, max, say, set, now }) {
  const input = make("input", { type: "number", step, min, max });
  let typing = false;
  input.show = (text) => {
    if (!typing && input.value !== text) input.value = text;
  };
  input.addEventListener("input", () => (typing = true));
  input.addEventListener("change", () => {
    typing = false;
    const value = input.valueAsNumber, whole = step === 1 ? Math.round(value) : value, kept = clamp(whole, min ?? -Infinity, max ?? Infinity);
    if (Number.isFinite(value)) set(kept);
    input.show(now());
    if (!Number.isFinite(value)) say(`${label}: that is no number; it stays ${now() || "as it was"}.`);
    else if (kept !== whole) say(`${label}: ${short(value, 6)} is too ${value > kept ? "large" : "small"}; it is ${short(kept, 6)} now.`);
  });
  input.addEventListener("blur", () => {
    typing = false;
    input.show(now());
  });
  return input;
}

/// Fields of one page: they share the store, the way to ask the server, the words of help, and `say` for numbers that cannot be taken.
export function createFields({ store, resolve, about, choices, say }) {
  const all = [], asking = [];

  /// A field for `key`, or with a `get` and a `set` of its own.
  function field(spec) {
    const get = spec.get ?? ((document) => at(document, spec.key));
    const set = spec.set ?? ((document, value) => withKey(document, spec.key, value)), owns = spec.owns ?? [spec.key];
    const change = (value) => {
      const next = set(store.document, value);
      if (!next) return;
      if (spec.ask) resolve(next, owns);
      else store.set(next);
    };
    const { row, show, options } = kinds[spec.type](spec, change, () => get(store.document));
    if (spec.ask) asking.push({ row, options, own: owns, change: (document, value) => set(document, value, true), current: (document) => String(get(document)) });
    const help = spec.help ?? about[spec.key];
    if (help) row.title = help;
    let section = null;
    const update = (document) => {
      // Nobody sees what a folded section says; it is brought up to date when it opens.
      section ??= row.closest("details");
      if (section && !section.open) return;
      const value = get(document);
      row.hidden = value === undefined || (spec.when && !spec.when(document));
      if (!row.hidden) show(value, document);
    };
    all.push(update);
    return row;
  }

  const kinds = {
    number({ label, step = "any", min, max, digits = 6 }, change, now) {
      const input = numberInput({ label, step, min, max, say, set: change, now: () => textOf(now()) });
      const textOf = (value) => (value === null || value === undefined ? "" : short(value, digits));
      return { row: make("label", { class: "field" }, make("span", {}, label), input), show: (value) => input.show(textOf(value)) };
    },
    /// A slider; `scale: "log"` gives small numbers as much room as large ones.
    range({ label, min, max, step, scale, words }, change) {
      const log = scale === "log", to = (value) => (log ? Math.log10(Math.max(value, 1e-30)) : value), from = (place) => (log ? 10 ** place : place);
      const limits = (document) => [min, max].map((limit) => to(typeof limit === "function" ? limit(document) : limit));
      const input = make("input", { type: "range" }), told = make("output", {});
      input.addEventListener("input", () => change(from(input.valueAsNumber)));
      const show = (value, document_) => {
        const [low, high] = limits(document_);
        input.min = low;
        input.max = high;
        input.step = step ?? (high - low) / 200;
        if (document.activeElement !== input || Math.abs(input.valueAsNumber - to(value)) > 0.51 * Number(input.step)) input.value = to(value);
        told.value = words ? words(value) : short(value, 3);
        input.setAttribute("aria-valuetext", told.value);
      };
      return { row: make("label", { class: "field" }, make("span", {}, label), input, told), show };
    },
    select({ label, key, options }, change) {
      const input = make("select", { change: () => change(input.value) });
      const names = options ?? (choices[key] ?? []).map((name) => [name, name]);
      input.append(...names.map(([value, words]) => make("option", { value }, words)));
      const show = (value) => {
        const text = String(value);
        if (![...input.options].some((option) => option.value === text)) input.append(make("option", { value: text }, text));
        input.value = text;
      };
      return { row: make("label", { class: "field" }, make("span", {}, label), input), show, options: () => [...input.options] };
    },
    check({ label }, change) {
      const input = make("input", { type: "checkbox", change: () => change(input.checked) });
      return { row: make("label", { class: "check" }, input, label), show: (value) => (input.checked = Boolean(value)) };
    },
    color({ label }, change) {
      const input = make("input", { type: "color", input: () => change(rgbOf(input.value)) });
      return { row: make("label", { class: "field" }, make("span", {}, label), input), show: (value) => (input.value = hex(value)) };
    },
    text({ label }, change) {
      const input = make("input", { type: "text", maxlength: 200, change: () => change(input.value.trim() || undefined) });
      const show = (value) => document.activeElement !== input && (input.value = value ?? "");
      return { row: make("label", { class: "field" }, make("span", {}, label), input), show };
    },
  };

  /// What `createLimits` looks at: the lists that are in sight.
  const limited = () => asking.filter(({ row, options }) => options && !row.hidden && row.closest("details").open);
  return { field, limited, update: (document) => all.forEach((update) => update(document)) };
}
