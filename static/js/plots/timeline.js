// A strip of the last 60 s with every alarm's beginning and end.

import { C, LEVEL_COLOUR, size } from "../theme.js";
import { number, scale, ticks } from "../axis.js";
import { clear, label, segment } from "../pen.js";
import { levelMark } from "../glyphs.js";
import { $ } from "../words.js";
import { replaying, severity, silence, snapshotAge, state } from "../state.js";
import { surface } from "../surface.js";
import * as track from "./track.js";
import { trackPointer } from "./track_pointer.js";

const SPAN = 60;
let map = null;

function paint(g, width, height) {
  clear(g, width, height);
  if (!state.snapshot) return { state: { events: 0 }, age: Infinity, label: "Alarms of the last 60 s: no data yet" };
  const now = state.snapshot.time + Math.min(silence(), SPAN);
  map = scale(-SPAN, 0, 8, width - 46);
  const y = height / 2, t = size("tick");
  const thick = Math.round(height * 0.36);
  g.fillStyle = C.free;
  g.fillRect(map(-SPAN), y - thick / 2, map(0) - map(-SPAN), thick);
  for (const value of ticks(-SPAN, 0, 13, [5, 10])) {
    const x = Math.round(map(value)) + 0.5;
    segment(g, x, y - thick / 2, x, y + thick / 2, C.grid);
  }
  label(g, "now", width - 6, y, { align: "right", base: "middle" });
  for (const value of [-60, -40, -20]) label(g, `−${-value} s`, map(value) + 4, y + 0.5, { base: "middle", halo: true });
  const events = [...state.events].sort((a, b) => severity[a.level] - severity[b.level]);
  for (const e of events) {
    const x0 = map(Math.max(-SPAN, e.start - now)), x1 = map((e.end ?? now) - now);
    if (e.level === "UNKNOWN") {
      g.fillStyle = C.panel;
      g.fillRect(x0, y - thick / 2, Math.max(2, x1 - x0), thick);
      g.setLineDash([4, 3]);
      g.lineWidth = 2;
      g.strokeStyle = C.unknown;
      g.strokeRect(x0 + 1, y - thick / 2 + 1, Math.max(1, x1 - x0 - 2), thick - 2);
      g.setLineDash([]);
    } else {
      g.fillStyle = e.level === "STOP" ? C.stop : LEVEL_COLOUR[e.level];
      g.fillRect(x0, y - thick / 2, Math.max(2, x1 - x0), thick);
    }
  }
  for (const e of events) levelMark(g, e.level, Math.max(map(-SPAN), map(Math.max(-SPAN, e.start - now))) + 1, y, Math.min(0.42 * height, 0.75 * t));
  if (!events.length && width > 560) label(g, "no alarm in the last 60 s", (map(-SPAN) + map(0)) / 2, y + 0.5, { align: "center", base: "middle" });
  return { state: { events: events.map((e) => [e.level, Math.round((now - e.start) * 10) / 10, e.end === null]) }, age: snapshotAge(), label: `Alarms of the last 60 s: ${events.length}` };
}

function probe(x) {
  if (!map || !state.snapshot) return null;
  const now = state.snapshot.time + Math.min(silence(), SPAN);
  const ago = map.inverse(x);
  const slack = 6 / map.k;
  const hits = state.events.filter((e) => e.start - now - slack <= ago && (e.end ?? now) - now + slack >= ago);
  return hits.length ? hits.map((e) => `${e.label}  (${number(now - e.start, 0)} s ago${e.end === null ? ", still on" : `, for ${number(e.end - e.start, 1)} s`})`) : [`${number(-ago, 0)} s ago: no alarm`];
}

/** Live the last minute; of a recorded session all of it, with the cursor. */
export function timeline() {
  const s = surface($("timeline"), (...given) => (replaying() ? track.paint : paint)(...given), (x) => (replaying() ? track.probe : probe)(x));
  trackPointer(s);
  return s;
}
