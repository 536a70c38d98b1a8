// Six deflections of -1..1: x positive to the right, y and tracks positive forwards.

export const NAMES = ["left_x", "left_y", "right_x", "right_y", "track_left", "track_right"];

export const zero = () => Object.fromEntries(NAMES.map((name) => [name, 0]));

/** Within -1..1; what is no number is no input. */
export const clamp = (value) => (Number.isFinite(value) ? Math.min(Math.max(value, -1), 1) : 0);

export const clean = (given) => Object.fromEntries(NAMES.map((name) => [name, clamp(given?.[name])]));

export const neutral = (given) => NAMES.every((name) => clamp(given?.[name]) === 0);

/** Nothing within the dead zone; outside it from zero on, so that nothing jumps at its edge. */
export function outside(value, dead) {
  const v = clamp(value);
  return Math.abs(v) <= dead ? 0 : (Math.sign(v) * (Math.abs(v) - dead)) / (1 - dead);
}
