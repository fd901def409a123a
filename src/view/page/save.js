// Pictures, scenes and the command line to take away.

import * as server from "./server.js";
import { byId, make } from "./dom.js";

function download(blob, name) {
  const address = URL.createObjectURL(blob);
  make("a", { href: address, download: name }).click();
  // The browser reads the bytes after this; a minute is plenty.
  setTimeout(() => URL.revokeObjectURL(address), 60000);
}

/// Makes the buttons of the section work.
export function createSave({ store, size, say }) {
  async function save(format) {
    try {
      const { blob, name } = await server.save(store.document, size(), format);
      download(blob, name);
      say(`${name} saved.`);
    } catch (error) {
      say(error.message);
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

  byId("save-picture").addEventListener("click", () => save(byId("picture-format").value));
  byId("save-toml").addEventListener("click", () => save("toml"));
  byId("save-json").addEventListener("click", () => save("json"));
  byId("copy-command").addEventListener("click", copy);
}
