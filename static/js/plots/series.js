// Time series of a recorded session: clearance, and joint ages or angles; the cursor is the timeline's.

import { C, LEVEL_COLOUR, size } from "../theme.js";
import { deg, metres, number, wrap } from "../axis.js";
import { clock, tickText, timeTicks } from "../clock.js";
import { clear, fit, label, legend, legendWidth, message, segment, swatches } from "../pen.js";
import { described, label as nameOf, snapshotAge, state, swingSign } from "../state.js";
import { cursor, playback } from "../player.js";
import { session, shownSpan, sources } from "../session.js";
import { FAR, OLD, STALE_JOINTS, curve, frame, limits, unknownBox } from "./chart.js";

export const choice = { angles: false }; // of the right chart
const DASH = { recorded: null, evaluated: [7, 4] };
const WORD = { recorded: "as it was", evaluated: "judged now" };
const ANGLES = [["swing", C.text, 2, null], ["boom", "#9CC3E6", 2, [8, 3]], ["stick", C.partnerLine, 2, [3, 3]], ["bucket", C.second, 1.5, [10, 3, 2, 3]]];

let charts = []; // for the pointer

const pairOf = (table, a, b) => table?.[`${a}|${b}`] ?? table?.[`${b}|${a}`] ?? null;
const clearanceOf = (data) => pairOf(data?.clearance, state.own, state.partner);

/** Points of a curve; what is above the axis lies on its edge. */
function points(chart, times, values) {
  const out = [];
  times.forEach((t, i) => {
    const v = values?.[i];
    out.push(Number.isFinite(v) ? [chart.x(t), chart.y(Math.min(v, chart.y.to))] : null);
  });
  return out;
}

/** [value, from, to] of every run of equal values. */
function runs(times, values) {
  const found = [];
  times.forEach((t, i) => {
    const last = found[found.length - 1];
    if (last && last[0] === values[i]) last[2] = t;
    else {
      if (last) last[2] = t;
      found.push([values[i], t, t]);
    }
  });
  return found;
}

/** The own machine's level as a strip: SLOW half high, STOP full, UNKNOWN dashed. */
function levels(g, { box, x }, data, y, h) {
  for (const [level, from, to] of runs(data.time, data.levels?.[state.own] ?? [])) {
    if (!LEVEL_COLOUR[level]) continue;
    const x0 = Math.max(box.left, x(from)), w = Math.max(3, Math.min(box.right, x(to)) - x0);
    if (level === "UNKNOWN") {
      g.setLineDash([3, 2]);
      g.lineWidth = 1.5;
      g.strokeStyle = C.unknown;
      g.strokeRect(x0 + 1, y + 1, Math.max(1, w - 2), h - 2);
      g.setLineDash([]);
    } else {
      g.fillStyle = level === "STOP" ? C.stopLine : C.slow;
      g.fillRect(x0, level === "SLOW" ? y + h / 2 : y, w, level === "SLOW" ? h / 2 : h);
    }
  }
}

function thresholds(g, chart, list) {
  let right = chart.box.left + 4;
  for (const [value, text] of list) {
    const y = Math.round(chart.y(value)) + 0.5;
    segment(g, chart.box.left, y, chart.box.right, y, C.edge, 1, [4, 4]);
    label(g, text, right, y - 2, { halo: true });
    right += g.measureText(text).width + 10;
  }
}

function drawClearance(g, chart, drawn) {
  const { slow_below: slow, stop_below: stop } = limits();
  drawn.forEach(([source, data]) => {
    const values = clearanceOf(data);
    if (source === drawn[0][0] && values) {
      for (const [missing, from, to] of runs(data.time, values.map((v) => v === null))) if (missing) unknownBox(g, chart.box, Math.max(chart.box.left, chart.x(from)), Math.min(chart.box.right, chart.x(to)));
    }
  });
  thresholds(g, chart, [[slow, `slow ${number(slow, 1)}`], [stop, `stop ${number(stop, 1)}`]]);
  drawn.forEach(([source, data], i) => {
    const values = clearanceOf(data);
    if (values) curve(g, chart, points(chart, data.time, values), source === "recorded" ? C.text : C.playbackLine, 2, DASH[source]);
    levels(g, chart, data, chart.box.top + 1 + 9 * i, 8);
  });
}

function drawAges(g, chart, [, data]) {
  thresholds(g, chart, [[STALE_JOINTS, `stale ${number(STALE_JOINTS, 1)}`]]);
  const styles = [[state.partner, C.partnerLine, 2, [5, 3]], [state.own, C.text, 2, null]].filter(([name]) => data.ages?.[name]);
  // A stream that was never received lies on the upper edge, as old as can be.
  for (const [name, ...style] of styles) curve(g, chart, points(chart, data.time, (data.ages[name].joints ?? []).map((v) => v ?? OLD)), ...style);
  return styles.reverse().map(([name, colour, w, dash]) => [swatches.line(colour, dash, w), nameOf(name)]);
}

const angle = (role, q) => (role === "swing" ? wrap(swingSign(state.own) * q) : q);

function drawAngles(g, chart, [, data]) {
  const joints = data.joints?.[state.own] ?? {};
  const styles = ANGLES.filter(([role]) => joints[role]);
  for (const [role, ...style] of styles) {
    const shown = joints[role].map((q) => (Number.isFinite(q) ? deg(angle(role, q)) : null));
    const line = points(chart, data.time, shown);
    // A swing through ±180° goes over the edge, not across the chart.
    const cut = line.flatMap((p, i) => (i && p && line[i - 1] && Math.abs(shown[i] - shown[i - 1]) > 180 ? [null, p] : [p]));
    curve(g, chart, cut, ...style);
  }
  return styles.map(([role, colour, w, dash]) => [swatches.line(colour, dash, w), role]);
}

function needle(g, { box, x }) {
  const at = x(cursor());
  if (at < box.left - 1 || at > box.right + 1) return;
  segment(g, at, box.top, at, box.bottom, C.halo, 4);
  segment(g, at, box.top, at, box.bottom, "#FFFFFF", 1.5);
}

export function paint(g, width, height) {
  clear(g, width, height);
  charts = [];
  const p = playback();
  const drawn = sources().map((source) => [source, session.series[source]]).filter(([, data]) => data);
  if (!p || !drawn.length) {
    const text = session.seriesProblem ? `no series: ${session.seriesProblem}` : "reading the session";
    message(g, width, height, text);
    return { state: { kind: "session", problem: session.seriesProblem }, age: Infinity, label: `Series of the session: ${text}` };
  }
  const t = size("tick");
  const [from, to] = shownSpan();
  const { step, found } = timeTicks(from, to, Math.max(2, width / 2 / (6 * t)));
  const across = { from, to, marks: found.map((value) => [value, tickText(value, step)]) };
  const up = (low, high, marks, decimals = 0) => ({ from: low, to: high, marks: marks.map((v) => [v, number(v, decimals)]) });
  const middle = Math.round(width / 2);
  const left = frame(g, { left: 4, right: middle - 4, height }, across, up(0, FAR, [0, 1, 2, 3, 4, 5]), "", "m");
  const place = { left: middle + 4, right: width - 4, height };
  const right = choice.angles ? frame(g, place, across, up(-180, 180, [-180, -90, 0, 90, 180]), "", "°", 2.8) : frame(g, place, across, up(0, OLD, [0, 0.1, 0.2, 0.3, 0.4, 0.5], 1), "", "s");
  const entries = choice.angles ? drawAngles(g, right, drawn[0]) : drawAges(g, right, drawn[0]);
  drawClearance(g, left, drawn);
  title(g, left, [`clearance to ${nameOf(state.partner)}, m`, "clearance, m"], drawn.map(([source]) => [swatches.line(source === "recorded" ? C.text : C.playbackLine, DASH[source]), WORD[source]]));
  title(g, right, choice.angles ? [`angles of ${nameOf(state.own)}, °`, "angles, °", "°"] : ["joint age, s"], entries);
  for (const chart of charts = [left, right]) needle(g, chart);
  const first = drawn[0][1];
  return {
    state: {
      kind: "session", own: state.own, partner: state.partner, sources: drawn.map(([source]) => source), points: first.time.length, window: [from, to], cursor: cursor(), right: choice.angles ? "angles" : "ages",
      least: Math.min(...(clearanceOf(first) ?? []).filter(Number.isFinite)), levels: [...new Set(first.levels?.[state.own] ?? [])],
    },
    age: snapshotAge(),
    label: `Clearance and ${choice.angles ? "joint angles" : "joint ages"} from ${clock(from)} to ${clock(to)} of the session, ${drawn.map(([source]) => WORD[source]).join(" and ")}`,
  };
}

/** What the chart is of, then the legend as far as there is room for both. */
function title(g, { box }, texts, entries) {
  const t = size("tick");
  const room = box.right - box.left - legendWidth(g, entries) - 10;
  const text = fit(g, texts, box.left, 1, Math.max(room, 3 * t), { base: "top" });
  const at = box.left + g.measureText(text).width + 10;
  legend(g, at, 1 + 0.55 * t, box.right - at, entries);
}

export const timeAt = (x) => {
  const hit = charts.find(({ box }) => x >= box.left - 4 && x <= box.right + 4);
  return hit ? hit.x.inverse(Math.min(Math.max(x, hit.box.left), hit.box.right)) : NaN;
};

export function probe(x, y) {
  const hit = charts.find(({ box }) => x >= box.left && x <= box.right && y >= box.top && y <= box.bottom);
  if (!hit) return null;
  const t = hit.x.inverse(x);
  const lines = [clock(t)];
  for (const source of sources()) {
    const data = session.series[source];
    if (!data?.time.length) continue;
    const i = data.time.reduce((best, at, k) => (Math.abs(at - t) < Math.abs(data.time[best] - t) ? k : best), 0);
    if (hit.unit === "m") {
      const d = clearanceOf(data)?.[i];
      lines.push(`${WORD[source]}: ${Number.isFinite(d) ? metres(d) : "unknown"}, ${nameOf(state.own)} ${data.levels?.[state.own]?.[i] ?? "–"}`);
    } else if (source === sources()[0] && choice.angles) {
      for (const { role } of described(state.own)?.joints ?? []) if (data.joints?.[state.own]?.[role]) lines.push(`${role} ${number(deg(angle(role, data.joints[state.own][role][i] ?? NaN)), 1)}°`);
    } else if (source === sources()[0]) {
      for (const [name, ages] of Object.entries(data.ages ?? {})) lines.push(`${nameOf(name)} joints ${Number.isFinite(ages.joints?.[i]) ? `${number(1000 * ages.joints[i], 0)} ms old` : "no data"}`);
    }
  }
  return lines;
}
