// One bar per joint without an exact image: its range, where it is now, and for the swing what Sun's set blocks at this reach.

import { C, hatch, rgba, size } from "../theme.js";
import { DEGREE_STEPS, deg, degrees, number, scale, ticks } from "../axis.js";
import { clear, label, legend, message, segment, swatches } from "../pen.js";
import { described, image, imageStale, label as nameOf, machine, snapshotAge, state, sunMap, swing, swingAt, swingSign } from "../state.js";
import { ageText } from "../head.js";

let rows = [];

export function row(joint) {
  const m = machine(state.own);
  const swings = joint.role === "swing";
  const now = swings ? swing(state.own) : m.joints[joint.role];
  const full = joint.continuous || !Number.isFinite(joint.lower) || !Number.isFinite(joint.upper) || joint.lower === null;
  const turned = swings && swingSign(state.own) < 0; // limits as the operator counts, left positive
  const lower = full ? -Math.PI : turned ? -joint.upper : joint.lower;
  const upper = full ? Math.PI : turned ? -joint.lower : joint.upper;
  // The operator's left is the positive swing: its axis runs from + to -.
  const reversed = swings;
  const { sign, offset } = sunMap(state.own, joint.role);
  const sun = swings ? null : m.sun?.[joint.role] ?? sign * now + offset;
  return { role: joint.role, now, lower, upper, full, reversed, sun, velocity: m.joint_velocities?.[joint.role] ?? 0 };
}

/** Swing intervals [from, to] in which the tip, at its present distance, would be inside Sun's set. */
function blockedSwing() {
  const entry = image();
  const theta = entry?.arrays.theta?.data, d = entry?.arrays.d?.data;
  const now = entry?.header.current?.d;
  if (!theta || theta.length < 2 || !Number.isFinite(now)) return [];
  const start = swingAt(state.own, theta[0]);
  const spans = [];
  let from = null;
  for (let j = 0; j < theta.length; j++) {
    const at = start + theta[j] - theta[0];
    if (now >= d[j] && from === null) from = at;
    if (from !== null && (now < d[j] || j === theta.length - 1)) {
      spans.push([from, at]);
      from = null;
    }
  }
  return spans.flatMap(([a, b]) => [-2 * Math.PI, 0, 2 * Math.PI].map((turn) => [Math.min(a, b) + turn, Math.max(a, b) + turn]));
}

export function paint(g, width, height, dpr) {
  clear(g, width, height);
  const joints = described(state.own)?.joints;
  const m = machine(state.own);
  if (!joints || !m?.joints) {
    message(g, width, height, "no joint angles yet");
    return { state: { joints: {} }, age: Infinity, label: "Joints: no data yet" };
  }
  const t3 = size("t3"), t = size("tick");
  const left = Math.round(4.2 * t3), right = width - Math.round(9.4 * t3);
  const foot = Math.round(1.3 * t);
  const pitch = (height - foot) / joints.length;
  const thick = Math.min(Math.round(0.9 * t3), pitch * 0.42);
  const stale = m.validity !== "VALID";
  rows = joints.map((joint, i) => {
    const r = row(joint);
    const y = pitch * (i + 0.38);
    const map = r.reversed ? scale(r.upper, r.lower, left, right) : scale(r.lower, r.upper, left, right);
    g.fillStyle = C.free;
    g.fillRect(left, y - thick / 2, right - left, thick);
    if (r.role === "swing") {
      const colour = imageStale(image()) ? C.stale : C.partner;
      for (const [a, b] of blockedSwing()) {
        const x0 = Math.max(left, Math.min(map(a), map(b))), x1 = Math.min(right, Math.max(map(a), map(b)));
        if (x1 <= x0) continue;
        g.fillStyle = rgba(colour, 0.35);
        g.fillRect(x0, y - thick / 2, x1 - x0, thick);
        g.fillStyle = hatch(g, colour, dpr);
        g.fillRect(x0, y - thick / 2, x1 - x0, thick);
        g.lineWidth = 2;
        g.strokeStyle = colour;
        g.strokeRect(x0 + 1, y - thick / 2 + 1, Math.max(0, x1 - x0 - 2), thick - 2);
      }
    }
    g.lineWidth = 1;
    g.strokeStyle = C.edge;
    if (r.full) segment(g, left, y - thick / 2, right, y - thick / 2, C.edge), segment(g, left, y + thick / 2, right, y + thick / 2, C.edge);
    else g.strokeRect(left + 0.5, y - thick / 2 + 0.5, right - left - 1, thick - 1);
    const below = y + thick / 2 + 2;
    const ends = r.reversed ? [r.upper, r.lower] : [r.lower, r.upper];
    const text = (v) => (r.reversed && v > 0 ? "+" : "") + degrees(v);
    label(g, text(ends[0]), left, below, { base: "top" });
    label(g, text(ends[1]), right, below, { align: "right", base: "top" });
    for (const v of ticks(deg(r.lower), deg(r.upper), 9, DEGREE_STEPS)) {
      const x = Math.round(map((v * Math.PI) / 180)) + 0.5;
      if (x - left < 3.4 * t || right - x < 3.4 * t) continue;
      segment(g, x, y + thick / 2, x, y + thick / 2 + 3, C.edge);
      if (v === 0) label(g, "0°", x, below + 1, { align: "center", base: "top" });
    }
    const x = Math.min(right, Math.max(left, map(r.now)));
    segment(g, x, y - thick / 2 - 4, x, y + thick / 2 + 4, "#000000", 6);
    segment(g, x, y - thick / 2 - 3, x, y + thick / 2 + 3, stale ? C.stale : "#FFFFFF", 3, stale ? [3, 2] : null);
    label(g, r.role, left - 10, y, { align: "right", base: "middle", colour: C.text, name: "t3" });
    label(g, `${number(deg(r.now), 1)}°`, right + 4.1 * t3, y, { align: "right", base: "middle", colour: stale ? C.stale : C.text, name: "t3", weight: 600 });
    if (r.sun !== null) label(g, `Sun ${number(deg(r.sun), 0)}°`, width - 8, y, { align: "right", base: "middle", name: "t3" });
    else label(g, "left +", width - 8, y, { align: "right", base: "middle", name: "t3" });
    return { ...r, y, map };
  });
  legend(g, left, height - 0.65 * t, width - left - 4, [
    [swatches.glyph((c, x, y) => segment(c, x, y - 6, x, y + 6, "#FFFFFF", 3)), "now"],
    [swatches.area(C.free, C.edge), "range"],
    [swatches.area(hatch(g, C.partner, dpr), C.partner), `${nameOf(state.partner)} at this reach (Sun)`],
  ]);
  const values = Object.fromEntries(rows.map((r) => [r.role, Math.round(deg(r.now) * 100) / 100]));
  const age = snapshotAge();
  return { state: { own: state.own, joints: values, unit: "deg" }, age, label: `Joints of ${nameOf(state.own)}: ${rows.map((r) => `${r.role} ${degrees(r.now)}`).join(", ")}; ${ageText(age)}` };
}

export function probe(x, y) {
  if (!rows.length) return null;
  const r = rows.reduce((a, b) => (Math.abs(b.y - y) < Math.abs(a.y - y) ? b : a));
  const at = r.map.inverse(x);
  const { sign, offset } = sunMap(state.own, r.role);
  return [
    `${r.role} now ${degrees(r.now, 1)}, ${number(deg(r.velocity), 1)} °/s`,
    r.full ? "turns without limit" : `limits ${degrees(r.lower)} to ${degrees(r.upper)}`,
    ...(at >= Math.min(r.lower, r.upper) && at <= Math.max(r.lower, r.upper) ? [`here ${degrees(at, 1)}${r.role === "swing" ? "" : `, Sun ${degrees(sign * at + offset, 1)}`}`] : []),
  ];
}
