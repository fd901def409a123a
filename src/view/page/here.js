// Whether the view is still there: a page at rest asks every few seconds, and says so when nobody answers.

import * as server from "./server.js";
import { byId } from "./dom.js";

/// Milliseconds of silence after which the page asks.
const QUIET = 3000;

const WORDS = {
  [server.GONE]: "The view has ended. What you made is still here: Save scene, then start slicestack view with that file.",
  [server.OTHER]: "This page belongs to an earlier view: open the new address that the command printed. What you made is still here: Save scene.",
};

/// Watches the server from now on. `save` keeps the scene without it, or is null where there is none to keep.
export function watchServer(save) {
  let gone = null;
  const box = byId("ended"), keep = byId("ended-save");
  keep.hidden = !save;
  keep.addEventListener("click", () => save?.());

  function answered(status) {
    const now = status === server.GONE || status === server.OTHER ? status : null;
    if (now === gone) return;
    gone = now;
    byId("ended-words").textContent = now === null ? "" : save ? WORDS[now] : WORDS[now].split(" What")[0];
    box.hidden = now === null;
    if (now !== null) byId("message").textContent = "";
    for (const id of ["save-picture", "save-toml", "copy-command"]) {
      byId(id).disabled = now !== null;
      byId(id).title = now === null ? "" : "The view has ended: only Save scene (JSON) works without it.";
    }
  }
  server.onAnswer(answered);
  setInterval(() => {
    if (document.visibilityState === "visible" && performance.now() - server.lastHeard() >= QUIET) server.here().catch(() => {});
  }, QUIET / 2);
  return {
    get gone() {
      return gone !== null;
    },
    /// What the server has answered to a page that was not there yet.
    tell: answered,
  };
}
