// Dragging on a plot moves the cursor of a recorded session; a click that lands near an event goes to it.

import { replaying } from "../state.js";

/** at(x) -> seconds or null/false where the plot has no time; drop() when dragging was broken off. */
export function seekable({ canvas }, at, { snapped = (t) => t, seek, drop, redraw }) {
  let from = null; // x where it began [px]
  let moved = false;
  const x = (event) => event.clientX - canvas.getBoundingClientRect().left;

  canvas.addEventListener("pointerdown", (event) => {
    if (!replaying() || event.button !== 0) return;
    const t = at(x(event));
    if (!Number.isFinite(t)) return;
    canvas.setPointerCapture(event.pointerId);
    from = x(event);
    moved = false;
    seek(snapped(t), true);
    redraw();
  });
  canvas.addEventListener("pointermove", (event) => {
    if (from === null) return;
    if (Math.abs(x(event) - from) > 3) moved = true;
    const t = at(x(event));
    if (moved && Number.isFinite(t)) seek(t, true);
    redraw();
  });
  canvas.addEventListener("pointerup", (event) => {
    if (from === null) return;
    from = null;
    const t = at(x(event));
    if (Number.isFinite(t)) seek(moved ? t : snapped(t));
    else drop();
    redraw();
  });
  canvas.addEventListener("pointercancel", () => {
    if (from === null) return;
    from = null;
    drop();
    redraw();
  });
}
