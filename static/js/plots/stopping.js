// Stopping distances on joint images: a line from the star to a T for the present rate, a dashed box for full speed.

import { C } from "../theme.js";
import { segment } from "../pen.js";
import { stopsInBlocked } from "../exact.js";

const clamp = (v, a, b) => Math.min(Math.max(v, Math.min(a, b)), Math.max(a, b));
const STILL = 0.002; // rad; below it nothing is drawn

/** A line with a T at its end, black-edged so that it is seen on every layer; what is red has a second bar, too. */
export function tee(g, x0, y0, x1, y1, red, half = 6) {
  const along = Math.abs(x1 - x0) > Math.abs(y1 - y0);
  const back = 6 * Math.sign(along ? x0 - x1 : y0 - y1);
  for (const [w, colour] of [[6, "#000000"], [3, red ? C.stopLine : "#FFFFFF"]]) {
    segment(g, x0, y0, x1, y1, colour, w);
    for (const shift of red ? [0, back] : [0]) {
      if (along) segment(g, x1 + shift, y1 - half, x1 + shift, y1 + half, colour, w);
      else segment(g, x1 - half, y1 + shift, x1 + half, y1 + shift, colour, w);
    }
  }
}

/** Draws both joints' distances of a slice; returns {joint: {now, red}} for those that move. */
export function stopping(g, box, mapX, mapY, slice, { q, stopping: distances }, byteAt) {
  const { across, up } = slice;
  const u = q[across], v = q[up];
  const full = [distances?.[across]?.full, distances?.[up]?.full].map(Math.abs);
  if (full.every(Number.isFinite)) {
    const [x0, x1] = [u - full[0], u + full[0]].map((a) => clamp(mapX(a), box.left, box.right));
    const [y0, y1] = [v + full[1], v - full[1]].map((a) => clamp(mapY(a), box.top, box.bottom));
    for (const [w, colour, dash] of [[3, "#000000", null], [1.2, C.text, [4, 3]]]) {
      g.setLineDash(dash ?? []);
      g.lineWidth = w;
      g.strokeStyle = colour;
      g.strokeRect(Math.round(x0) + 0.5, Math.round(y0) + 0.5, Math.round(x1 - x0), Math.round(y1 - y0));
    }
    g.setLineDash([]);
  }
  const drawn = {};
  for (const [role, at] of [[across, (a) => byteAt(a, v)], [up, (a) => byteAt(u, a)]]) {
    const by = distances?.[role]?.now;
    if (!Number.isFinite(by) || Math.abs(by) < STILL) continue;
    const red = stopsInBlocked(at, q[role], by);
    const x1 = role === across ? clamp(mapX(u + by), box.left, box.right) : mapX(u);
    const y1 = role === up ? clamp(mapY(v + by), box.top, box.bottom) : mapY(v);
    tee(g, mapX(u), mapY(v), x1, y1, red);
    drawn[role] = { now: Math.round(by * 1e4) / 1e4, red };
  }
  return drawn;
}
