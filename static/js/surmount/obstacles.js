// The site's obstacles as steps, seen from the own machine: how high, how far ahead. The server judges them once more.

import { deg, number } from "../axis.js";
import { inside } from "../geometry.js";
import { footprint } from "../plots/plan_layers.js";
import { machine, state } from "../state.js";

const LEAST = 0.01; // m, of a step
const AHEAD = 45; // degrees, of its edge to the tracks
const SQUARE = 2; // degrees, from which on the machine has to square up first

/** "hall/1" -> "hall". */
const whole = (name) => String(name).split("/")[0];
const boxes = () => state.site?.obstacles ?? [];

/** Names, each once. */
export const names = () => [...new Set(boxes().map((one) => whole(one.name)))];

function axes({ rotation, half_extents: half }) {
  const R = rotation ?? [[1, 0, 0], [0, 1, 0], [0, 0, 1]];
  return [0, 1, 2].map((j) => ({ dir: [R[0][j], R[1][j], R[2][j]], half: half[j] }));
}

/** What box `one` is for the machine: {height, distance, depth, why}; why: empty where it can be surmounted. */
function step(one, m) {
  const all = axes(one);
  const up = all.reduce((best, axis) => (Math.abs(axis.dir[2]) > Math.abs(best.dir[2]) ? axis : best));
  const height = one.center[2] + up.half - m.position[2];
  const from = [m.position[0] - one.center[0], m.position[1] - one.center[1]];
  const heading = [Math.cos(m.yaw), Math.sin(m.yaw)];
  const found = all.filter((axis) => axis !== up).map(({ dir, half }) => {
    const off = from[0] * dir[0] + from[1] * dir[1], side = off > 0 ? 1 : -1;
    const along = -side * (dir[0] * heading[0] + dir[1] * heading[1]);
    return { distance: side * off - half, along, depth: 2 * half, within: Math.abs(off) < half };
  });
  if (Math.abs(height) < LEAST && found.every((one_) => one_.within)) {
    // On its top: down over the edge ahead.
    const edge = all.filter((axis) => axis !== up).map(({ dir, half }) => {
      const along = dir[0] * heading[0] + dir[1] * heading[1], way = along > 0 ? 1 : -1;
      return { along: Math.abs(along), distance: half - way * (from[0] * dir[0] + from[1] * dir[1]) };
    }).reduce((best, one_) => (one_.along > best.along ? one_ : best));
    return { height: -2 * up.half, distance: edge.distance, depth: null, why: "" };
  }
  const face = found.reduce((best, one_) => (one_.along > best.along ? one_ : best));
  const turned = deg(Math.acos(Math.min(1, Math.max(-1, face.along))));
  const why = height < LEAST ? "not higher than the ground here" : turned > AHEAD || face.distance <= 0 ? "not ahead" : turned > SQUARE ? `not faced: turn ${number(turned, 0)}° to face its edge` : "";
  return { height, distance: face.distance, depth: face.depth, why };
}

/** An obstacle of that name as a step, its nearest box that is one; null where its place or the machine's is unknown. */
export function seen(name) {
  const m = machine(state.own);
  if (!m?.position || !Number.isFinite(m.yaw)) return null;
  const found = boxes().filter((one) => whole(one.name) === name && one.center && one.half_extents).map((one) => step(one, m));
  const good = found.filter(({ why }) => !why);
  return (good.length ? good : found).sort((a, b) => a.distance - b.distance)[0] ?? null;
}

export const outlines = (name) => boxes().filter((one) => whole(one.name) === name).map((one) => one.outline ?? footprint(one)).filter(Boolean);

/** The obstacle at a point of the plan, or null. */
export function at(point) {
  const hit = boxes().find((one) => {
    const outline = one.outline ?? footprint(one);
    return outline?.length && inside(point, outline);
  });
  return hit ? whole(hit.name) : null;
}
