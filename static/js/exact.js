// Reading exact images: which cell is where, what it says, and in which words.

import { degrees, wrap } from "./axis.js";
import { partName } from "./words.js";
import { label as nameOf, machine, swingSign } from "./state.js";
import { COLLIDING, FREE, LAYERS, OUTSIDE, jointKind, reachKind } from "./layers.js";

const TURN = 2 * Math.PI;

/** The cell of a value in `n` cells from lo to hi, -1 beyond; `round` for a joint that turns fully. */
function cell(value, [lo, hi], n, round = false) {
  const way = round && hi - lo > TURN - 0.1 ? ((value - lo) % TURN + TURN) % TURN : value - lo;
  const i = Math.floor((way / (hi - lo)) * n);
  return i >= 0 && i < n ? i : Math.abs(value - hi) < 1e-9 ? n - 1 : -1;
}

/** The byte of slice `i` at (across, up): of the finer patch where there is one. */
export function sliceByte(entry, i, u, v) {
  const slice = entry.header.slices[i];
  const patch = slice.patch && entry.arrays[`patch${i}`];
  for (const [place, array] of [[patch ? slice.patch : null, patch], [slice, entry.arrays[`slice${i}`]]]) {
    if (!place || !array) continue;
    const [nx, ny] = array.shape;
    const a = cell(u, place.x, nx), b = cell(v, place.y, ny);
    if (a >= 0 && b >= 0) return array.data[a * ny + b];
  }
  return OUTSIDE;
}

export function barByte(entry, role, q) {
  const i = entry.header.bars.findIndex((bar) => bar.joint === role);
  const array = entry.arrays[`bar${i}`];
  const at = array ? cell(q, entry.header.bars[i].edges, array.data.length, role === "swing") : -1;
  return at < 0 ? OUTSIDE : array.data[at];
}

export function reachByte(entry, q, d) {
  const { swing, reach } = entry.header.reach;
  const array = entry.arrays.reach;
  if (!array) return OUTSIDE;
  const a = cell(q, swing, array.shape[0], true), b = cell(d, reach, array.shape[1]);
  return a < 0 || b < 0 ? OUTSIDE : array.data[a * array.shape[1] + b];
}

/** Writes one byte per pixel from the cells of `place` {x: [lo, hi], y: [lo, hi]}; `over` leaves the other pixels. */
export function sample(bytes, w, h, columns, rows, place, array, { over = false, round = false } = {}) {
  const [nx, ny] = array.shape;
  const xs = Int32Array.from(columns, (v) => cell(v, place.x, nx, round)), ys = Int32Array.from(rows, (v) => cell(v, place.y, ny));
  for (let y = 0, p = 0; y < h; y++) {
    for (let x = 0; x < w; x++, p++) {
      if (xs[x] >= 0 && ys[y] >= 0) bytes[p] = array.data[xs[x] * ny + ys[y]];
      else if (!over) bytes[p] = OUTSIDE;
    }
  }
}

/** The values at the middles of `n` pixels along a scale that starts at pixel `from`. */
export const middles = (map, from, n, dpr) => Float64Array.from({ length: n }, (_, i) => map.inverse(from + (i + 0.5) / dpr));

/** A swing angle of the joint as the operator's, left positive within ±180°, and back, near `near`. */
export const toLeft = (name, q) => wrap(swingSign(name) * q);
export function fromLeft(name, left, near = 0) {
  const q = swingSign(name) * left;
  return q + TURN * Math.round((near - q) / TURN);
}

const shownAngle = (name, role, q) => (role === "swing" ? toLeft(name, q) : q);
export const jointText = (name, role, q, decimals = 0) => `${role} ${degrees(shownAngle(name, role, q), decimals)}`;
export const jointsText = (name, joints, roles = ["swing", "boom", "stick", "bucket"]) => roles.filter((role) => Number.isFinite(joints?.[role])).map((role) => jointText(name, role, joints[role])).join(", ");

/** "RIGHT", or "partners" when a layer stands for several. */
export const partnersText = ({ partners }) => (partners?.length === 1 ? nameOf(partners[0]) : "partners");

export const layerWord = (layer, header) => (layer.name === "partner" ? partnersText(header) : layer.name);

/** The layers a byte names, on top first. */
const layersOf = (byte, kind) => (byte === OUTSIDE ? [] : kind.layers.filter(({ bit }) => kind.hits(byte) & bit));

export function cellLines(byte, header, kind) {
  if (byte === OUTSIDE) return ["no cell here"];
  const layers = layersOf(byte, kind), tips = layers.some(({ name }) => name === "tip-over");
  const words = layers.filter(({ name }) => name !== "tip-over").map((layer) => ({ partner: (header.partners ?? []).map(nameOf).join(" or ") || "partner", self: "itself" })[layer.name] ?? layer.name);
  const hit = [words.length ? `collides with ${words.join(", ")}` : null, tips ? "tips over, at rest" : null].filter(Boolean).join(", ") || null;
  const unknown = header.tip_over?.reason ? [`tip-over unknown: ${header.tip_over.reason}`] : [];
  if (kind === reachKind) {
    const plain = { out: "out of reach", beyond: "beyond a joint limit", near: "within 5° of a joint limit" }[kind.plain(byte)];
    return [...unknown, [hit ?? (kind.plain(byte) === "out" || kind.plain(byte) === "beyond" ? null : "free at the cell's centre"), plain].filter(Boolean).join(", "), "not certified"];
  }
  const certificate = byte & FREE ? "certified free, whole cell" : byte & COLLIDING ? `certified ${tips && !words.length ? "tipping" : "colliding"}, whole cell` : "undecided: not certified either way";
  return [...unknown, ...(hit ? [hit] : byte & FREE ? [] : ["free at the cell's centre"]), certificate];
}

/** True when stopping ends in what is not certified free, or goes through it from a free cell. */
export function stopsInBlocked(byteAt, from, by, steps = 24) {
  // Beyond the joint's range its own limit stops it.
  const bad = (k) => {
    const b = byteAt(from + (by * k) / steps);
    return b !== OUTSIDE && !(b & FREE);
  };
  if (bad(steps)) return true;
  return !bad(0) && Array.from({ length: steps - 1 }, (_, k) => k + 1).some(bad);
}

/** "right:stick/0" -> "RIGHT stick", "site:wall" -> "wall", "gauge:T1/12" -> "gauge T1", "left:tracks/0" -> "own tracks", null -> "limit". */
export function obstacle(own, hits) {
  if (!hits) return "limit";
  const [who, what] = String(hits).includes(":") ? String(hits).split(/:(.*)/) : [own, hits];
  if (who === "site") return what;
  if (who === "gauge") return `gauge ${what.split("/")[0]}`;
  return who === own ? `own ${partName(what)}` : `${machine(who) ? nameOf(who) : who.toUpperCase()} ${partName(what)}`;
}

const counted = new WeakMap();

/** count() of an array of an image, once. */
export function counts(array, kind, count) {
  if (!array) return {};
  if (!counted.has(array)) counted.set(array, count(array.data, kind));
  return counted.get(array);
}

/** Legend entries of the layers in `present` (name -> cells). */
export const presentLayers = (present, kind = jointKind) => (kind === jointKind ? LAYERS : kind.layers).filter(({ name }) => present[name]);
