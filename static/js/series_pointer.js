// Trends of a recorded session: click or drag to seek, wheel to zoom, buttons for window and right chart.

import { $, write } from "./words.js";
import { replaying } from "./state.js";
import { drop, playback, seek } from "./player.js";
import { session, zoom } from "./session.js";
import { choice, timeAt } from "./plots/series.js";
import { shown as people } from "./plots/people.js";
import { seekable } from "./plots/seekable.js";

const SPANS = [null, 600, 60]; // s

// People in its place are of the last seconds only.
const at = (x) => (people() ? NaN : timeAt(x));

export function startSeries(surface) {
  const redraw = () => Object.assign(surface, { dirty: true, last: -Infinity });
  const words = () => {
    const s = session.span;
    write($("trends-span"), s === null ? "All" : s >= 120 ? `${Math.round(s / 60)} min` : `${Math.round(s)} s`);
    write($("trends-what"), choice.angles ? "Angles" : "Ages");
    redraw();
  };
  $("trends-span").addEventListener("click", () => {
    // The next window that is shorter than this one and than the session, else all of it.
    const now = session.span ?? Infinity;
    zoom(SPANS.find((s) => s !== null && s < now && s < (playback()?.duration ?? 0)) ?? null);
    words();
  });
  $("trends-what").addEventListener("click", () => {
    choice.angles = !choice.angles;
    words();
  });
  surface.canvas.addEventListener("wheel", (event) => {
    const t = at(event.offsetX);
    if (!replaying() || !Number.isFinite(t)) return;
    event.preventDefault();
    zoom((session.span ?? playback().duration) * 2 ** (Math.sign(event.deltaY) * 0.5), t);
    words();
  }, { passive: false });
  surface.canvas.addEventListener("dblclick", () => {
    if (!replaying() || people()) return;
    zoom(null);
    words();
  });
  seekable(surface, at, { seek, drop, redraw });
}
