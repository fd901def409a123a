// What was made of the scene, kept by the browser as long as its tab is open: a reload does not lose it.

import { token } from "./server.js";

const NAME = `slicestack ${token}`;

/// What was kept of this view: { document, data, title }, or null.
export function kept() {
  try {
    return JSON.parse(sessionStorage.getItem(NAME));
  } catch {
    // The browser keeps nothing, or nothing that can be read: the page begins anew.
    return null;
  }
}

/// Keeps `record` in the place of what was kept before.
export function keep(record) {
  try {
    sessionStorage.setItem(NAME, JSON.stringify(record));
  } catch {
    // Then a reload begins anew.
  }
}

/// Keys of the section labels that say where a label map is.
const MAP = ["path", "series", "array", "level", "frame", "channel"];

/// What a whole scene says of its data, and the page's document does not.
export function dataOf(scene) {
  const labels = Object.fromEntries(Object.entries(scene.labels ?? {}).filter(([key]) => MAP.includes(key)));
  return { volume: scene.volume, labels };
}

/// The scene file of `record`: what the server would save, without it.
export function sceneOf({ document, data }) {
  const labels = { ...document.labels, ...data.labels };
  const sections = Object.keys(labels).length ? { ...document, labels } : document;
  return `${JSON.stringify({ volume: data.volume, ...sections }, null, 2)}\n`;
}
