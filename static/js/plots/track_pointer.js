// The pointer on the timeline of a session.

import { replaying } from "../state.js";
import { current, drop, seek, setLoop } from "../player.js";
import { events } from "../session.js";
import { geometry, loop, marking } from "./track.js";
import { seekable } from "./seekable.js";

const GRIP = 8; // px around a handle
const SNAP = 6; // px around the beginning of an event: a click lands on it

export function trackPointer(surface) {
  const { canvas } = surface;
  const redraw = () => Object.assign(surface, { dirty: true, last: -Infinity });
  let fixed = null; // the end of the loop that stays [s]

  const time = (event) => {
    const x = event.clientX - canvas.getBoundingClientRect().left;
    return Math.min(Math.max(geometry.map.inverse(x), geometry.map.from), geometry.map.to);
  };
  const handle = (event) => {
    const ends = loop();
    if (!ends) return null;
    const x = event.clientX - canvas.getBoundingClientRect().left;
    const near = ends.map((t) => Math.abs(geometry.map(t) - x));
    const i = near[0] <= near[1] ? 0 : 1;
    return near[i] <= GRIP ? i : null;
  };

  canvas.addEventListener("pointerdown", (event) => {
    if (!replaying() || !geometry.map || event.button !== 0) return;
    const i = handle(event);
    if (!event.shiftKey && i === null) return;
    canvas.setPointerCapture(event.pointerId);
    fixed = event.shiftKey ? time(event) : current("loop")[1 - i];
    Object.assign(marking, { from: fixed, to: time(event) });
    event.stopImmediatePropagation();
    redraw();
  });
  canvas.addEventListener("pointermove", (event) => {
    if (!replaying() || !geometry.map) return;
    canvas.style.cursor = handle(event) === null ? "" : "ew-resize";
    if (fixed === null) return;
    marking.to = time(event);
    redraw();
  });
  const end = (event) => {
    if (fixed === null) return;
    if (event.type === "pointerup") setLoop([fixed, time(event)]);
    fixed = null;
    Object.assign(marking, { from: null, to: null });
    redraw();
  };
  canvas.addEventListener("pointerup", end);
  canvas.addEventListener("pointercancel", end);

  // An event is hard to hit to the pixel; who clicks its mark wants its beginning.
  const snapped = (t) => {
    const near = events().map((e) => e.start).filter((start) => Math.abs(start - t) * geometry.map.k <= SNAP);
    return near.sort((a, b) => Math.abs(a - t) - Math.abs(b - t))[0] ?? t;
  };
  seekable(surface, (x) => geometry.map && fixed === null && geometry.map.inverse(x), { snapped, seek, drop, redraw });
}
