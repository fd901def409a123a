// Pictures, scenes and the command line to take away.

import * as server from "./server.js";
import { byId, make } from "./dom.js";

/// Hands `blob` to the browser as a file.
export function download(blob, name) {
  const address = URL.createObjectURL(blob);
  make("a", { href: address, download: name }).click();
  // The browser reads the bytes after this; a minute is plenty.
  setTimeout(() => URL.revokeObjectURL(address), 60000);
}

/// Milliseconds after which it is told that a file is in the making.
const SLOW = 300;

/// Makes the buttons of the section work. `gone` tells whether the server has gone, `own` the scene as the page alone can write it: { text, name },
/// or null where it does not know enough.
export function createSave({ store, size, say, gone, own }) {
  function saveOwn() {
    const found = own();
    if (!found) return say("The view ended before the page knew where its data is: there is nothing to save.");
    const { text, name } = found;
    download(new Blob([text], { type: "application/json" }), name);
    say(`${name} saved. To go on: slicestack view ${name}`);
  }

  async function save(format, pressed) {
    if (format === "json" && gone()) return saveOwn();
    const slow = setTimeout(() => say("Saving..."), SLOW);
    pressed.disabled = true;
    try {
      const { blob, name } = await server.save(store.document, size(), format);
      download(blob, name);
      say(`${name} saved.`);
    } catch (error) {
      if (format === "json" && (error.status === server.GONE || error.status === server.OTHER)) saveOwn();
      else say(error.message);
    } finally {
      clearTimeout(slow);
      pressed.disabled = gone() && format !== "json";
    }
  }

  async function copy() {
    try {
      const { command, note } = await server.command(store.document, size());
      const shown = byId("command-line");
      shown.value = command;
      byId("command-row").hidden = false;
      let told = "Command line copied.";
      try {
        await navigator.clipboard.writeText(command);
      } catch {
        shown.focus();
        shown.select();
        told = "The browser does not let the page copy: the command line is marked, Ctrl+C copies it.";
      }
      say(note ? `${told} ${note}` : told);
    } catch (error) {
      say(error.message);
    }
  }

  byId("save-picture").addEventListener("click", (event) => save(byId("picture-format").value, event.currentTarget));
  byId("save-toml").addEventListener("click", (event) => save("toml", event.currentTarget));
  byId("save-json").addEventListener("click", (event) => save("json", event.currentTarget));
  byId("copy-command").addEventListener("click", copy);
  return { saveOwn };
}
