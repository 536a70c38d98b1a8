// Whether this window has the operator's attention. Lost at once by any sign of it; back by the browser's word or a
// key or pointer on the page.

let focused = true;
let changed = () => {};

export const here = () => focused && document.visibilityState === "visible" && document.hasFocus();

function lose() {
  focused = false;
  changed();
}

function gain() {
  if (focused || document.visibilityState !== "visible") return;
  focused = true;
  changed();
}

/** Focus that goes to the scene stays on the page. */
export function leaveScene() {
  if (!document.hasFocus()) lose();
}

/** Who comes back to the window may come back to the scene in it. */
export const enterScene = gain;

export function startFocus(scene, onChange) {
  changed = onChange;
  addEventListener("blur", () => {
    if (document.activeElement !== scene || !document.hasFocus()) lose();
  });
  addEventListener("pagehide", lose);
  document.addEventListener("visibilitychange", () => (document.visibilityState === "visible" ? document.hasFocus() && gain() : lose()));
  addEventListener("focus", gain);
  for (const type of ["keydown", "pointerdown"]) addEventListener(type, (event) => event.isTrusted && gain(), true);
}
