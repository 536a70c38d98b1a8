// The trajectory from the side: how far out and how high the end point is; a click there sets the goal's distance and height.

import { C, size } from "../theme.js";
import { metres, number, ticks } from "../axis.js";
import { clear, label, legend, message, segment, swatches } from "../pen.js";
import { ring, star } from "../glyphs.js";
import { curve, frame, upward } from "../plots/chart.js";
import { machine, state } from "../state.js";
import { surface } from "../surface.js";
import { $ } from "../words.js";
import * as model from "./model.js";

let chart = null;
let changed = () => {};

const ground = (m) => m.position[2];
/** A point of the site frame as distance from the swing axis and height over the machine's ground [m]. */
const aside = (m, [e, n, z]) => [Math.hypot(e - m.swing_center[0], n - m.swing_center[1]), z - ground(m)];
const rounded = (values) => values.map((v) => Math.round(v * 1e3) / 1e3);

/** The height that the field says, NaN when it says none. */
const height = () => ($("tj-height").value.trim() === "" ? 0.5 : Number($("tj-height").value));

function goal(m) {
  const picked = model.picked();
  if (picked) return [aside(m, [...picked, 0])[0], height()];
  const { goal: offered } = model.offer() ?? {};
  return offered ? aside(m, offered) : null;
}

function paint(g, width, tall) {
  clear(g, width, tall);
  const m = machine(state.own);
  if (!m?.swing_center || !m.position || !m.end_point) {
    chart = null;
    message(g, width, tall, "place unknown");
    return { state: { kind: "side", goal: null }, age: Infinity, label: "Side view: the machine's place is unknown" };
  }
  const t = size("tick"), far = m.max_reach + 0.3;
  const across = { from: 0, to: far, marks: ticks(0, far, Math.max(2, width / (4 * t)), [1, 2, 5, 10]).map((v) => [v, number(v, 0)]) };
  chart = frame(g, { left: 2, right: width - 2, height: tall - 1.15 * t - 2 }, across, upward(-0.6 * far, 1.1 * far, tall < 150 ? 4 : 6), "height over ground, m", "m", 1.8);
  const { box, x, y } = chart;
  const put = (points) => points.map((one) => aside(m, one)).map(([r, z]) => [x(r), y(z)]);
  segment(g, box.left, y(0), box.right, y(0), C.edge, 2);
  label(g, "ground", box.left + 4, y(0) + 2, { base: "top", halo: true });
  segment(g, x(m.max_reach), box.top, x(m.max_reach), box.bottom, C.second, 1.5, [6, 4]);
  const { document, offer } = { document: model.document(), offer: model.offer() };
  const path = document?.ok ? document.end_point : [], simple = document?.figures?.initial.end_point ?? [];
  const stale = Boolean(offer) && ["void", "unknown", "none"].includes(offer.state);
  curve(g, chart, put(simple), C.second, 1.5, [2, 4]);
  curve(g, chart, put(path), stale ? C.stale : "#FFFFFF", 2.5, stale ? [6, 5] : null);
  const now = aside(m, m.end_point), aim = goal(m);
  if (aim && aim.every(Number.isFinite)) ring(g, x(aim[0]), y(aim[1]), 7);
  star(g, x(now[0]), y(now[1]), m.validity !== "VALID", 9);
  label(g, "distance, m →", box.right - 4, box.bottom - 3, { align: "right", base: "bottom", halo: true });
  legend(g, 4, tall - 0.6 * t, width - 6, [[swatches.glyph((c, px, py) => star(c, px, py, false, 6)), "now"], [swatches.glyph((c, px, py) => ring(c, px, py, 5)), "goal"], [swatches.line(C.second, [6, 4], 1.5), "max reach"]], 6);
  return {
    state: { kind: "side", plan: offer?.plan ?? null, goal: aim && rounded(aim), now: rounded(now), path: path.length, simple: simple.length, frame: { ...box, far: x.to ?? far, span: [y.from, y.to] } },
    age: 0,
    label: `Side view: end point ${metres(now[0])} out, ${metres(now[1])} high${aim ? `; goal ${metres(aim[0])} out, ${metres(aim[1])} high` : ""}`,
  };
}

function under(px, py) {
  if (!chart) return null;
  const { box, x, y } = chart;
  if (px < box.left || px > box.right || py < box.top || py > box.bottom) return null;
  return [x.inverse(px), y.inverse(py)];
}

function probe(px, py) {
  const at = under(px, py);
  return at && [`${number(at[0], 2)} m from the swing axis, ${number(at[1], 2)} m over the ground`, "click: the goal's distance and height"];
}

/** In the direction of the goal that was chosen, else of the arm. */
function onClick(event) {
  const m = machine(state.own);
  const frame_ = $("tj-plot-side").getBoundingClientRect();
  const at = under(event.clientX - frame_.left, event.clientY - frame_.top);
  if (!at || !m?.swing_center || model.following() || !model.mayAsk()) return;
  const [e, n] = m.swing_center, picked = model.picked();
  const azimuth = picked ? Math.atan2(picked[1] - n, picked[0] - e) : m.azimuth;
  if (!Number.isFinite(azimuth)) return;
  $("tj-height").value = number(at[1], 1).replace("−", "-");
  model.pick([e + at[0] * Math.cos(azimuth), n + at[0] * Math.sin(azimuth)]);
  changed();
}

export function startSide(onChange) {
  changed = onChange;
  $("tj-plot-side").addEventListener("click", onClick);
  return surface($("tj-plot-side"), paint, probe);
}
