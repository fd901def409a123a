// Turning, moving and zooming the view: by mouse, touch and keyboard.

import { anglesOf, cameraOf, panned, rolled, turned, withCamera, zoomed } from "./camera.js";

/// Degrees that a drag across the shorter side of the picture turns.
export const TURN = 200;
/// Degrees and pixels of a press of an arrow key.
const KEY_TURN = 4, KEY_PAN = 24;
/// A press that moved less far is a click.
const CLICK = 4;
/// Pixels by which the distance of two fingers changes before it zooms.
const PINCH = 12;

/// Listens on `stage`. `size` tells the picture's columns and rows, `click` hears of clicks as pixel positions, `home` of the key Home.
export function listen({ stage, store, box, size, click, home }) {
  const pointers = new Map();
  let travelled = 0, pinch = null, waiting = 0;

  const camera = () => cameraOf(store.document, box, size());
  const show = (next) => store.set(withCamera(store.document, next));
  const fogged = () => (store.document.fog?.mode ?? "none") !== "none";
  const turn = (x, y) => show(turned(camera(), box, [x, y], fogged()));
  // Keys stop straight above and straight below; a drag goes on, head over heels.
  const climb = (by) => {
    const now = camera(), { elevation } = anglesOf(now, box);
    if (now.up[2] < -1e-6) turn(0, by);
    else turn(0, by > 0 ? Math.min(by, 90 - elevation) : Math.max(by, -90 - elevation));
  };
  // Picture pixels for a pixel of the screen.
  const ratio = () => size()[1] / stage.clientHeight;
  const pan = (x, y) => show(panned(camera(), size(), [x * ratio(), y * ratio()]));
  const zoom = (factor) => show(zoomed(camera(), factor));

  stage.addEventListener("pointerdown", (event) => {
    if (event.target.closest("[data-handle]")) return;
    event.preventDefault();
    stage.focus({ preventScroll: true });
    stage.setPointerCapture(event.pointerId);
    pointers.set(event.pointerId, [event.clientX, event.clientY]);
    if (pointers.size === 1) travelled = 0;
    pinch = null;
    if (pointers.size === 2) pinched();
  });

  stage.addEventListener("pointermove", (event) => {
    const from = pointers.get(event.pointerId);
    if (!from) return;
    const to = [event.clientX, event.clientY], [x, y] = [to[0] - from[0], to[1] - from[1]];
    pointers.set(event.pointerId, to);
    travelled += Math.hypot(x, y);
    if (pointers.size === 2) return pinched();
    if (pointers.size !== 1 || travelled < CLICK) return;
    const degrees = TURN / Math.min(stage.clientWidth, stage.clientHeight);
    if (event.shiftKey || event.buttons & 6) pan(x, y);
    else turn(-x * degrees, y * degrees);
  });

  // Two fingers: their middle moves the view, their distance zooms once it has changed for certain. Each of them is heard of on its own, so
  // both are looked at together, with the screen's next frame.
  function pinched() {
    if (waiting) return;
    waiting = requestAnimationFrame(() => {
      waiting = 0;
      if (pointers.size !== 2) return;
      const [a, b] = [...pointers.values()];
      const now = { middle: [(a[0] + b[0]) / 2, (a[1] + b[1]) / 2], apart: Math.max(1, Math.hypot(a[0] - b[0], a[1] - b[1])) };
      if (!pinch) return void (pinch = { ...now, first: now.apart, zooms: false });
      const moved = panned(camera(), size(), [0, 1].map((n) => (now.middle[n] - pinch.middle[n]) * ratio()));
      const zooms = pinch.zooms || Math.abs(now.apart - pinch.first) > PINCH;
      show(zooms ? zoomed(moved, now.apart / pinch.apart) : moved);
      pinch = { ...now, first: pinch.first, zooms };
    });
  }

  const release = (event) => {
    if (!pointers.delete(event.pointerId)) return;
    pinch = null;
    if (event.type === "pointerup" && event.button === 0 && pointers.size === 0 && travelled < CLICK) {
      const area = stage.getBoundingClientRect();
      click([(event.clientX - area.left) * ratio(), (event.clientY - area.top) * ratio()]);
    }
  };
  stage.addEventListener("pointerup", release);
  stage.addEventListener("pointercancel", release);
  stage.addEventListener("contextmenu", (event) => event.preventDefault());
  stage.addEventListener(
    "wheel",
    (event) => {
      event.preventDefault();
      const lines = event.deltaMode === 1 ? 16 : 1;
      zoom(Math.exp(-0.0015 * lines * Math.max(-200, Math.min(200, event.deltaY))));
    },
    { passive: false }
  );

  const keys = {
    ArrowLeft: (shift) => (shift ? pan(-KEY_PAN, 0) : turn(-KEY_TURN, 0)),
    ArrowRight: (shift) => (shift ? pan(KEY_PAN, 0) : turn(KEY_TURN, 0)),
    ArrowUp: (shift) => (shift ? pan(0, -KEY_PAN) : climb(KEY_TURN)),
    ArrowDown: (shift) => (shift ? pan(0, KEY_PAN) : climb(-KEY_TURN)),
    "+": () => zoom(1.08),
    "=": () => zoom(1.08),
    "-": () => zoom(1 / 1.08),
    "[": () => show(rolled(camera(), -KEY_TURN)),
    "]": () => show(rolled(camera(), KEY_TURN)),
    Home: home,
  };
  /// Whether the key was one of the view's.
  return function key(event) {
    const act = keys[event.key];
    if (!act || event.ctrlKey || event.metaKey || event.altKey) return false;
    act(event.shiftKey);
    return true;
  };
}
