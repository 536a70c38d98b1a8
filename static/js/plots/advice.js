// Per joint and direction of a machine, the smallest allowed share of full speed, and in which words. Advice only.

import { described, machine, severity, silence, state, sunMap, swingSign } from "../state.js";

// Words for a lowering and a raising motion in Sun's sense (positive raises).
const WORDS = { boom: ["down", "up"], stick: ["in", "out"], bucket: ["curl", "dump"], tilt: ["left", "right"], rotate: ["left", "right"], travel: ["back", "ahead"] };

/** The severest level of a machine's concerns. */
export function worstLevel(name) {
  const levels = (state.snapshot?.concerns ?? []).filter((c) => c.machine === name).map((c) => severity[c.level] ?? 0);
  return Object.keys(severity)[Math.max(0, ...levels)];
}

/** [{role, sides: [{word, allowed, why}, ..]}]: each joint's two directions, `share(role, index, positive)` says {allowed, why}. */
export function directions(name, share) {
  return (described(name)?.joints ?? []).map(({ role }, i) => {
    const negative = (word) => ({ word, ...share(role, i, 0) });
    const positive = (word) => ({ word, ...share(role, i, 1) });
    if (role === "swing") return { role, sides: swingSign(name) > 0 ? [positive("left"), negative("right")] : [negative("left"), positive("right")] };
    const [low, high] = WORDS[role] ?? ["−", "+"];
    return { role, sides: sunMap(name, role).sign > 0 ? [negative(low), positive(high)] : [positive(low), negative(high)] };
  });
}

/** The directions of the own machine, the most restrictive concern each. */
export function advice(name) {
  if (!described(name)?.joints || !state.snapshot) return null;
  const concerns = (state.snapshot.concerns ?? []).filter((c) => c.machine === name);
  const smallest = (pick) => {
    let best = { allowed: 1, why: "" };
    for (const c of concerns) {
      const value = pick(c);
      if (Number.isFinite(value) && value < best.allowed) best = { allowed: value, why: c.reason || c.name };
    }
    return best;
  };
  // Without a verdict nothing is free.
  const unknown = silence() > 1 ? "no data" : machine(name)?.validity !== "VALID" ? "own pose is not valid" : concerns.length ? "" : "no verdict received";
  const share = (pick) => (unknown ? { allowed: 0, why: unknown } : smallest(pick));
  const rows = directions(name, (role, i, k) => share((c) => c.allowed?.[role]?.[k ? "positive" : "negative"] ?? c.allowed?.[i]?.[k]));
  const travel = (word, pick) => ({ word, ...share(pick) });
  if (concerns.some((c) => c.travel)) rows.push({ role: "travel", sides: [travel("back", (c) => c.travel?.backward ?? c.travel?.[0]), travel("ahead", (c) => c.travel?.forward ?? c.travel?.[1])] });
  return rows;
}
