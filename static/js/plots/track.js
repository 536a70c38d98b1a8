// The timeline of a recorded session: events, cursor, loop; dragging seeks, dragging with Shift marks a loop.

import { C, size } from "../theme.js";
import { number, scale } from "../axis.js";
import { clock, tickText, timeTicks, wallClock } from "../clock.js";
import { clear, label, message, segment } from "../pen.js";
import { label as nameOf, snapshotAge } from "../state.js";
import { current, cursor, dragging, playback, seeking } from "../player.js";
import { events, session, shownSpan } from "../session.js";
import { interval, mark, rank } from "./event_marks.js";

export const geometry = { map: null, height: 0 };
export const marking = { from: null, to: null }; // a loop that is being dragged [s]
const MOST = 8; // events named under the pointer

export const loop = () => (marking.from === null ? current("loop") : [Math.min(marking.from, marking.to), Math.max(marking.from, marking.to)]);

function ruler(g, map, y, duration) {
  const { step, found } = timeTicks(0, duration, Math.max(2, (map(duration) - map(0)) / 110));
  for (const t of found) {
    const x = Math.round(map(t)) + 0.5;
    segment(g, x, y - 4, x, y, C.edge);
    const text = tickText(t, step);
    const w = g.measureText(text).width;
    if (x + 4 + w < map(duration)) label(g, text, x + 3, y - 1, { base: "bottom" });
  }
}

function section(g, [a, b], map, top, bottom) {
  const x0 = map(a), x1 = map(b);
  // Bars above and below: a veil would change the colours of the levels.
  g.fillStyle = C.playbackLine;
  g.fillRect(x0, top - 3, x1 - x0, 3);
  g.fillRect(x0, bottom, x1 - x0, 3);
  for (const [x, way] of [[x0, 1], [x1, -1]]) {
    segment(g, x, top - 3, x, bottom + 3, C.playbackLine, 2);
    g.fillStyle = C.playbackLine; // handles point inwards
    g.beginPath();
    g.moveTo(x, top);
    g.lineTo(x + 7 * way, top);
    g.lineTo(x, top + 8);
    g.fill();
  }
}

function needle(g, x, top, bottom, hollow) {
  for (const [width, colour] of [[5, C.halo], [2, "#FFFFFF"]]) segment(g, x, top, x, bottom, colour, width, hollow ? [3, 2] : null);
  g.beginPath();
  g.moveTo(x - 6, top);
  g.lineTo(x + 6, top);
  g.lineTo(x, top + 8);
  g.closePath();
  g.lineWidth = 1.5;
  g.strokeStyle = C.halo;
  g.stroke();
  g.fillStyle = hollow ? C.halo : "#FFFFFF";
  g.fill();
  if (hollow) {
    g.strokeStyle = "#FFFFFF";
    g.stroke();
  }
}

/** What does not move: ruler, intervals, marks. Drawn once into a picture of its own. */
const still = { key: [], canvas: null, sorted: [], kinds: {} };

function stillPicture(width, height, dpr, duration, map, top, bottom) {
  const key = [events(), width, height, dpr, duration];
  if (still.canvas && key.every((value, i) => value === still.key[i])) return still.canvas;
  if (key[0] !== still.key[0]) {
    still.sorted = [...events()].sort((a, b) => rank(a) - rank(b));
    still.kinds = {};
    for (const { kind } of still.sorted) still.kinds[kind] = (still.kinds[kind] ?? 0) + 1;
  }
  const canvas = document.createElement("canvas");
  canvas.width = Math.round(width * dpr);
  canvas.height = Math.round(height * dpr);
  const g = canvas.getContext("2d");
  g.scale(dpr, dpr);
  clear(g, width, height);
  g.fillStyle = C.free;
  g.fillRect(map(0), top, map(duration) - map(0), bottom - top);
  ruler(g, map, top, duration);
  for (const e of still.sorted) if (e.end !== null && e.end !== undefined) interval(g, e, map(e.start), map(Math.min(e.end, duration)), top, bottom, dpr);
  // Of marks that would cover each other, the gravest.
  const r = Math.min(0.55 * (bottom - top), 0.65 * size("tick"));
  const places = new Map();
  for (const e of still.sorted) places.set(Math.round(map(e.start) / (0.9 * r)), e);
  for (const e of [...places.values()].sort((a, b) => rank(a) - rank(b))) mark(g, e, map(e.start) + 1, (top + bottom) / 2, r);
  Object.assign(still, { key, canvas });
  return canvas;
}

export function paint(g, width, height, dpr) {
  const p = playback();
  if (!p) {
    geometry.map = null;
    clear(g, width, height);
    message(g, width, height, "waiting for the player");
    return { state: { events: 0 }, age: Infinity, label: "Timeline: waiting for the player" };
  }
  const t = size("tick");
  const map = scale(0, Math.max(p.duration, 0.001), 12, width - 12);
  Object.assign(geometry, { map, height });
  const top = Math.round(t) + 2, bottom = height - 4;
  g.drawImage(stillPicture(width, height, dpr, p.duration, map, top, bottom), 0, 0, width, height);
  const at = cursor();
  const part = loop();
  if (part) section(g, part, map, top, bottom);
  const [from, to] = shownSpan();
  if (session.span) {
    segment(g, map(from), height - 2, Math.max(map(from) + 3, map(to)), height - 2, C.second, 3); // what the trends show
  }
  const index = session.document?.index;
  if (index?.state === "building") segment(g, map(index.progress * p.duration), height - 2, map(p.duration), height - 2, C.stale, 2, [2, 4]);
  needle(g, map(at), top - 5, height, seeking());
  if (dragging()) {
    const text = clock(at);
    const w = 5 * t;
    label(g, text, map(at) + (map(at) + w > width ? -10 : 10), (top + bottom) / 2, { align: map(at) + w > width ? "right" : "left", base: "middle", name: "t3", weight: 700, colour: C.text, halo: true });
  }
  return {
    state: {
      time: at, duration: p.duration, events: still.sorted.length, loop: part ?? null, dragging: dragging(), seeking: seeking(),
      kinds: still.kinds, window: [from, to], index: index?.state ?? null,
    },
    age: snapshotAge(),
    label: `Timeline of the session: ${clock(at)} of ${clock(p.duration)}, ${still.sorted.length} events`,
  };
}

const KIND = { alarm: "", note: "note: ", "near miss": "NEAR MISS: ", pin: "pinned: ", action: "operator: ", gap: "" };

function sentence(e) {
  const who = e.machine && !String(e.text).toUpperCase().includes(nameOf(e.machine)) ? `${nameOf(e.machine)} ` : "";
  const level = e.level && !String(e.text).startsWith(e.level) ? `${e.level} · ` : "";
  const length = e.kind === "gap" || e.end === null || e.end === undefined ? "" : `, ${number(e.end - e.start, 1)} s`;
  return `${clock(e.start)}  ${KIND[e.kind] ?? `${e.kind}: `}${level}${who}${e.text}${length}`;
}

/** The events at a place of the strip, the gravest first. */
export function eventsAt(x) {
  const { map } = geometry;
  if (!map) return [];
  const slack = 7 / map.k, t = map.inverse(x);
  return events().filter((e) => e.start - slack <= t && (e.end ?? e.start) + slack >= t).sort((a, b) => rank(b) - rank(a));
}

export function probe(x) {
  const p = playback();
  const { map } = geometry;
  if (!p || !map) return null;
  const t = Math.min(Math.max(map.inverse(x), 0), p.duration);
  const hits = eventsAt(x);
  const lines = [`${clock(t)} · ${wallClock(p.wall - p.time + t)}`, ...hits.slice(0, MOST).map(sentence)];
  if (hits.length > MOST) lines.push(`and ${hits.length - MOST} more`);
  return lines;
}
