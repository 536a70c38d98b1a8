// Figs. 6 and 7 of Yamashita and Kikuuwe 2025, live: swing rate and lift with the limits at which the machine tips, and the joints; the simple trajectory, the planned one, and what the sensors saw.

import { C } from "../theme.js";
import { deg, number } from "../axis.js";
import { clear, label, swatches } from "../pen.js";
import { curve, points, upward } from "../plots/chart.js";
import { INKS, at, empty as nothing, entries, needle, overTime as plot, timeAt } from "../plots/over_time.js";
import { surface } from "../surface.js";
import { $ } from "../words.js";
import * as model from "./model.js";

const SIMPLE = [C.second, 1.5, [2, 3]], PLANNED = ["#FFFFFF", 2, null], LIMIT = [C.tipOver, 2, [8, 4]], ACTUAL = [C.remote, 3, null];
const HIGHEST = { swing: 2.5, lift: 3 }; // times the largest value of the curves: where a limit is farther up it is told and not drawn

const KINDS = {
  swing: { title: "swing rate, °/s", unit: "°/s", of: (s) => s.swing.map((v) => deg(Math.abs(v))), limit: (s) => s.critical_swing.map((v) => (v === null ? NaN : deg(v))), name: "Ω_c" },
  lift: { title: "lift a_z, m/s²", unit: "m/s²", of: (s) => s.lift.map((v) => v ?? NaN), limit: (s) => s.critical_lift.map((v) => v ?? NaN), name: "a_cz" },
};

const charts = {};
const finite = (values) => values.filter(Number.isFinite);

/** The moment that is shown: of the machine where it follows, else of the preview. */
const moment = () => (model.following() ? model.follow().at : model.time());

const empty = (g, width, height, kind) => {
  charts[kind] = null;
  return nothing(g, width, height, kind, model.planning() ? "planning" : "no trajectory");
};

function limited(kind) {
  const { title, unit, of, limit, name } = KINDS[kind];
  return (g, width, height) => {
    const document = model.document(), figures = document?.figures;
    if (!figures) return empty(g, width, height, kind);
    clear(g, width, height);
    const { initial, planned } = figures, actual = model.seen();
    const first = of(initial), ours = of(planned), measured = actual ? of(actual) : [];
    const limits = limit(planned), known = finite(limits).length > 0;
    const most = Math.max(0.1, ...finite(first), ...finite(ours), ...finite(measured));
    const least = Math.min(0, ...finite(first), ...finite(ours), ...finite(measured));
    const lowest = Math.min(...finite(limits));
    const near = known && lowest <= HIGHEST[kind] * most;
    const high = near ? Math.max(most, Math.min(HIGHEST[kind] * most, Math.max(...finite(limits)))) : most;
    const told = !known ? `${name} none` : near ? name : `${name} ≥ ${number(lowest, kind === "lift" ? 1 : 0)}`;
    const list = [[swatches.line(...swap(PLANNED)), "plan"], [swatches.line(...swap(LIMIT)), told], [swatches.line(...swap(SIMPLE)), "simple"], ...(measured.length ? [[swatches.line(...swap(ACTUAL)), "actual"]] : [])];
    const rows = entries(g, width, height, list);
    const chart = (charts[kind] = plot(g, width, height, rows, upward(least, high, height < 150 ? 3 : 5), title, unit, Math.max(document.duration, initial.time[initial.time.length - 1])));
    const draw = (times, values, [colour, wide, dash]) => curve(g, chart, points(chart, times, values), colour, wide, dash);
    draw(initial.time, first, SIMPLE);
    draw(planned.time, limits.map((v) => (v > chart.y.to ? NaN : v)), LIMIT);
    if (measured.length) draw(actual.at, measured, ACTUAL);
    draw(planned.time, ours, PLANNED);
    needle(g, chart, moment());
    const over = exceeds(first, limit(initial));
    if (over) label(g, `simple: over ${name}`, chart.box.right - 3, chart.box.top + 2, { align: "right", base: "top", halo: true });
    return { state: { kind, plan: model.offer()?.plan, time: Math.round(moment() * 100) / 100, actual: measured.length, limit: known ? lowest : null, most: Math.max(...finite(ours), 0), over, within: !exceeds(ours, limits) }, age: 0, label: `${title}: planned at most ${number(Math.max(...finite(ours), 0), 1)}, limit ${known ? `at least ${number(lowest, 1)}` : "none"} ${unit}` };
  };
}

const swap = ([colour, wide, dash]) => [colour, dash, wide];
const exceeds = (values, limits) => values.some((v, k) => v > limits[k]);

function joints(g, width, height) {
  const document = model.document();
  if (!document?.ok) return empty(g, width, height, "joints");
  clear(g, width, height);
  const { roles, time } = document, actual = model.seen();
  const planned = roles.map((_, j) => document.joints.map((row) => deg(row[j])));
  const measured = roles.map((_, j) => (actual?.joints ?? []).map((row) => deg(row[j])));
  // The swing's sensors may count other turns than the plan.
  measured.forEach((values, j) => {
    if (values.length) {
      const turns = 360 * Math.round((values[0] - planned[j][0]) / 360);
      measured[j] = values.map((v) => v - turns);
    }
  });
  const all = [...planned.flat(), ...measured.flat()];
  const list = [...roles.map((role, j) => [swatches.line(INKS[j % 6], [4, 3], 1.5), role]), ...(actual?.at.length ? [[swatches.line(C.text, null, 2.5), "actual"]] : [])];
  const rows = entries(g, width, height, list);
  const chart = (charts.joints = plot(g, width, height, rows, upward(Math.min(...all), Math.max(...all), height < 150 ? 3 : 5), "joints, °; dashed: plan", "°", document.duration));
  roles.forEach((_, j) => {
    if (measured[j].length) curve(g, chart, points(chart, actual.at, measured[j]), INKS[j % 6], 2.5);
    curve(g, chart, points(chart, time, planned[j]), INKS[j % 6], 1.5, [4, 3]);
  });
  needle(g, chart, moment());
  return { state: { kind: "joints", plan: model.offer()?.plan, time: Math.round(moment() * 100) / 100, actual: actual?.at.length ?? 0 }, age: 0, label: "Joint angles, planned and as they were" };
}

const probing = (kind, lines) => (px, py) => {
  const document = model.document(), t = timeAt(charts[kind], px, py);
  return t === null || !document ? null : [`${number(t, 1)} s`, ...lines(t, document)];
};

const values = (kind) => {
  const { of, limit, unit, name } = KINDS[kind];
  return probing(kind, (t, { figures: { initial, planned } }) => {
    const actual = model.seen();
    const shown = (value) => (Number.isFinite(value) ? `${number(value, 2)} ${unit}` : "none");
    return [`plan ${shown(at(planned.time, of(planned), t))}`, `${name} ${shown(at(planned.time, limit(planned), t))}`, `simple ${shown(at(initial.time, of(initial), t))}`, ...(actual?.at.length ? [`actual ${shown(at(actual.at, of(actual), t))}`] : [])];
  });
};

/** The three surfaces in the place of the slices. */
export const surfaces = () => [
  surface($("tj-plot-swing"), limited("swing"), values("swing")),
  surface($("tj-plot-lift"), limited("lift"), values("lift")),
  surface($("tj-plot-joints"), joints, probing("joints", (t, { roles, time, joints: rows }) => {
    const row = at(time, rows, t), actual = model.seen();
    const is = actual?.at.length ? at(actual.at, actual.joints, t) : null;
    return roles.map((role, j) => `${role} ${number(deg(row[j]), 1)}°${is ? `, actual ${number(deg(is[j]), 1)}°` : ""}`);
  })),
];
