// Linear scales, round tick steps, and how quantities are written.

/** Maps [from, to] onto [start, end]; `inverse` maps back. */
export function scale(from, to, start, end) {
  const k = (end - start) / (to - from);
  const map = (value) => start + (value - from) * k;
  map.inverse = (pixel) => from + (pixel - start) / k;
  map.from = from;
  map.to = to;
  map.k = k;
  return map;
}

/** Multiples of the smallest of `steps` that gives at most `most` ticks between two values. */
export function ticks(from, to, most, steps = [0.1, 0.2, 0.5, 1, 2, 5, 10, 20, 50]) {
  const low = Math.min(from, to);
  const high = Math.max(from, to);
  const step = steps.find((s) => (high - low) / s <= most) ?? steps[steps.length - 1];
  const found = [];
  for (let i = Math.ceil(low / step - 1e-9); i * step <= high + 1e-9; i++) found.push(i * step);
  return found;
}

export const DEGREE_STEPS = [5, 10, 15, 30, 45, 60, 90, 180];
export const deg = (radians) => (radians * 180) / Math.PI;
export const wrap = (radians) => radians - 2 * Math.PI * Math.round(radians / (2 * Math.PI));

/** A number with a true minus sign; "–" when there is none. */
export function number(value, decimals = 1) {
  if (value === null || value === undefined || !Number.isFinite(value)) return "–";
  const text = Math.abs(value).toFixed(decimals);
  return value < 0 && Number(text) !== 0 ? `−${text}` : text;
}

export const metres = (d) => (Number.isFinite(d) ? `${number(d, Math.abs(d) < 0.995 ? 2 : 1)} m` : "unknown");
export const degrees = (radians, decimals = 0) => `${number(deg(radians), decimals)}°`;
export const seconds = (s) => (Number.isFinite(s) ? `${number(s, s < 10 ? 1 : 0)} s` : "none");
/** 308613 -> "308 613" */
export const grouped = (metresValue) => String(Math.round(metresValue)).replace(/\B(?=(\d{3})+$)/g, "\u202f");
