// Times of a recording in words: since it began, and on the clock on the wall.

const two = (n) => String(n).padStart(2, "0");

/** 12.34 -> "0:12.3"; 3723.4 -> "1:02:03.4" */
export function clock(t, decimals = 1) {
  if (!Number.isFinite(t)) return "–";
  const unit = 10 ** decimals;
  const ticks = Math.floor(Math.max(0, t) * unit + 1e-6);
  const whole = Math.floor(ticks / unit);
  const hours = Math.floor(whole / 3600), minutes = Math.floor(whole / 60) % 60;
  const part = decimals ? `.${String(ticks % unit).padStart(decimals, "0")}` : "";
  return `${hours ? `${hours}:${two(minutes)}` : minutes}:${two(whole % 60)}${part}`;
}

/** Seconds since 1970 -> "14:02:33" by the clock of this computer. */
export function wallClock(s) {
  if (!Number.isFinite(s)) return "–";
  const d = new Date(s * 1000);
  return `${two(d.getHours())}:${two(d.getMinutes())}:${two(d.getSeconds())}`;
}

const MONTHS = ["Jan", "Feb", "Mar", "Apr", "May", "Jun", "Jul", "Aug", "Sep", "Oct", "Nov", "Dec"];

/** Seconds since 1970 -> "25 Nov 2026" */
export function day(s) {
  if (!Number.isFinite(s)) return "";
  const d = new Date(s * 1000);
  return `${d.getDate()} ${MONTHS[d.getMonth()]} ${d.getFullYear()}`;
}

const STEPS = [0.1, 0.2, 0.5, 1, 2, 5, 10, 15, 30, 60, 120, 300, 600, 900, 1800, 3600, 7200, 14400];

/** Round times between two, at most `most` of them. */
export function timeTicks(from, to, most) {
  const step = STEPS.find((s) => (to - from) / s <= most) ?? STEPS[STEPS.length - 1];
  const found = [];
  for (let i = Math.ceil(from / step - 1e-9); i * step <= to + 1e-9; i++) found.push(i * step);
  return { step, found };
}

/** How finely to write times that are `step` apart. */
export const tickText = (t, step) => clock(t, step < 1 ? 1 : 0);
