// Elements of the page.

const SVG = "http://www.w3.org/2000/svg";
const SVG_TAGS = new Set(["svg", "g", "path", "circle", "rect", "line", "text", "polygon", "polyline", "linearGradient", "stop", "defs", "title"]);

export const byId = (id) => document.getElementById(id);

/// An element with attributes; an attribute that is false, null or undefined is left out, and a function is a listener of that event.
export function make(tag, attributes = {}, ...children) {
  const element = SVG_TAGS.has(tag) ? document.createElementNS(SVG, tag) : document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) {
    if (typeof value === "function") element.addEventListener(name, value);
    else if (value === true) element.setAttribute(name, "");
    else if (value !== false && value !== null && value !== undefined) element.setAttribute(name, value);
  }
  element.append(...children.filter((child) => child !== null && child !== undefined));
  return element;
}

/// Sets attributes of an element that is there.
export function put(element, attributes) {
  for (const [name, value] of Object.entries(attributes)) {
    if (element.getAttribute(name) !== String(value)) element.setAttribute(name, value);
  }
  return element;
}

/// A button with words on it.
export const button = (words, press, attributes = {}) => make("button", { type: "button", click: press, ...attributes }, words);

/// Follows a pointer from where it went down on `element` until it is let go: `begin`, `move` and `end` get the event.
export function follow(element, { begin, move, end }) {
  element.addEventListener("pointerdown", (event) => {
    if (event.button !== 0) return;
    event.stopPropagation();
    event.preventDefault();
    element.focus({ preventScroll: true });
    element.setPointerCapture(event.pointerId);
    begin?.(event);
    const moved = (e) => e.pointerId === event.pointerId && move(e);
    const ended = (e) => {
      if (e.pointerId !== event.pointerId) return;
      element.removeEventListener("pointermove", moved);
      element.removeEventListener("pointerup", ended);
      element.removeEventListener("pointercancel", ended);
      end?.(e);
    };
    element.addEventListener("pointermove", moved);
    element.addEventListener("pointerup", ended);
    element.addEventListener("pointercancel", ended);
  });
}

/// #rrggbb of a colour from 0 to 1.
export function hex(rgb) {
  return "#" + rgb.slice(0, 3).map((c) => Math.round(255 * Math.min(1, Math.max(0, c))).toString(16).padStart(2, "0")).join("");
}

/// The colour from 0 to 1 of #rrggbb.
export const rgbOf = (text) => [1, 3, 5].map((at) => parseInt(text.slice(at, at + 2), 16) / 255);
