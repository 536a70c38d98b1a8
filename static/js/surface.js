// A canvas that fits its box at the screen's resolution, carries what it shows, and answers the pointer.

import { clear, message } from "./pen.js";
import { mark } from "./words.js";

/**
 * paint(g, width, height, dpr) draws and returns {state, age, label}: what the drawing shows (for
 * data-state), its age in seconds and a sentence for those who do not see it.
 * probe(x, y) returns lines of text for the pointer, or null.
 * aim(x, y) returns the configuration under the pointer, {machine, joints}, or null.
 */
export function surface(canvas, paint, probe, aim) {
  const g = canvas.getContext("2d", { alpha: false, willReadFrequently: true });
  const s = { canvas, probe, aim, width: 0, height: 0, dirty: true, last: -Infinity, label: null, lastLabel: -Infinity, cost: 0 };

  new ResizeObserver(() => {
    const dpr = window.devicePixelRatio || 1;
    const { width, height } = canvas.getBoundingClientRect();
    s.width = Math.round(width);
    s.height = Math.round(height);
    canvas.width = Math.max(1, Math.round(s.width * dpr));
    canvas.height = Math.max(1, Math.round(s.height * dpr));
    s.dpr = dpr;
    s.dirty = true;
    s.last = -Infinity;
  }).observe(canvas);

  /** Read aloud at most twice a second; the last one is never left out. */
  const tell = (now) => {
    if (s.label === null || now - s.lastLabel <= 500) return;
    canvas.setAttribute("aria-label", s.label);
    s.label = null;
    s.lastLabel = now;
  };

  /** Draws when something changed, at most once per `period` ms. */
  s.draw = (now, period) => {
    tell(now);
    if (!s.dirty || now - s.last < period || s.width < 20 || s.height < 10) return false;
    s.dirty = false;
    s.last = now;
    g.setTransform(s.dpr, 0, 0, s.dpr, 0, 0);
    const start = performance.now();
    let shown;
    try {
      shown = paint(g, s.width, s.height, s.dpr);
    } catch (error) {
      // One plot that fails must neither stop the others nor keep showing an old picture.
      console.error(error);
      g.setTransform(s.dpr, 0, 0, s.dpr, 0, 0);
      clear(g, s.width, s.height);
      message(g, s.width, s.height, "cannot draw");
      shown = { state: { error: String(error) }, age: Infinity, label: "This plot cannot be drawn" };
    }
    s.cost += 0.05 * (performance.now() - start - s.cost); // running mean [ms]
    if (shown) {
      mark(canvas, "state", JSON.stringify(shown.state));
      mark(canvas, "age", Number.isFinite(shown.age) ? shown.age.toFixed(2) : "none");
      s.label = shown.label;
      tell(now);
    }
    return true;
  };
  return s;
}
