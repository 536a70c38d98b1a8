// What happened in a session, as marks whose shapes differ without colour: alarms, notes, near misses, pins, actions, gaps.

import { C, LEVEL_COLOUR, hatch } from "../theme.js";
import { levelMark } from "../glyphs.js";
import { severity } from "../state.js";

// The greater stands on top where marks meet.
const RANK = { gap: 0, action: 1, pin: 2, note: 3, alarm: 4, "near miss": 8 };
export const rank = (e) => (RANK[e.kind] ?? 1) + (e.kind === "alarm" ? severity[e.level] ?? 0 : 0);

/** An interval of an alarm or a gap on the strip from y0 to y1. */
export function interval(g, e, x0, x1, y0, y1, dpr) {
  const w = Math.max(2, x1 - x0), h = y1 - y0;
  if (e.kind === "gap") {
    g.fillStyle = C.outside;
    g.fillRect(x0, y0, w, h);
    g.fillStyle = hatch(g, C.stale, dpr, 0.6, "dots");
    g.fillRect(x0, y0, w, h);
  } else if (e.level === "UNKNOWN") {
    g.fillStyle = C.panel;
    g.fillRect(x0, y0, w, h);
    g.setLineDash([4, 3]);
    g.lineWidth = 2;
    g.strokeStyle = C.unknown;
    g.strokeRect(x0 + 1, y0 + 1, Math.max(1, w - 2), h - 2);
    g.setLineDash([]);
  } else {
    // SLOW fills the lower half: in grey it is still not a STOP.
    g.fillStyle = e.level === "STOP" ? C.stop : LEVEL_COLOUR[e.level] ?? C.second;
    if (e.level === "SLOW") g.fillRect(x0, y0 + h / 2, w, h / 2);
    else g.fillRect(x0, y0, w, h);
  }
}

function path(g, points) {
  g.beginPath();
  for (const [x, y] of points) g.lineTo(x, y);
  g.closePath();
}

function filled(g, fill, stroke) {
  g.lineJoin = "round";
  g.lineWidth = 3;
  g.strokeStyle = C.halo;
  g.stroke();
  g.fillStyle = fill;
  g.fill();
  g.lineWidth = 1.2;
  g.strokeStyle = stroke;
  g.stroke();
}

const SHAPES = {
  // a flag
  note: (g, x, y, r) => {
    path(g, [[x - 1, y - r], [x + 1.5 * r, y - 0.45 * r], [x + 1, y + 0.1 * r], [x + 1, y + r], [x - 1, y + r]]);
    filled(g, C.text, C.halo);
  },
  // a diamond with an exclamation mark
  "near miss": (g, x, y, r) => {
    const d = 1.15 * r;
    path(g, [[x, y - d], [x + d, y], [x, y + d], [x - d, y]]);
    filled(g, C.panel, C.slow);
    g.fillStyle = C.slow;
    g.fillRect(x - 1, y - 0.55 * r, 2, 0.6 * r);
    g.fillRect(x - 1, y + 0.25 * r, 2, 2);
  },
  // a drawing pin
  pin: (g, x, y, r) => {
    g.beginPath();
    g.arc(x, y - 0.35 * r, 0.62 * r, Math.PI * 0.8, Math.PI * 0.2);
    g.lineTo(x, y + r);
    g.closePath();
    filled(g, C.second, C.text);
  },
  // a bar with a foot
  action: (g, x, y, r) => {
    path(g, [[x - 1, y - 0.5 * r], [x + 1, y - 0.5 * r], [x + 1, y + r], [x - 1, y + r]]);
    filled(g, C.edge, C.edge);
  },
  gap: () => {},
};

export function mark(g, e, x, y, r) {
  if (e.level === "UNKNOWN" && e.kind === "alarm") {
    g.beginPath();
    g.arc(x, y, r + 1, 0, 2 * Math.PI);
    g.fillStyle = C.panel; // its own dashes must not mix with the interval's
    g.fill();
  }
  if (e.kind === "alarm") levelMark(g, e.level, x, y, r);
  else (SHAPES[e.kind] ?? SHAPES.action)(g, x, y, r);
}
