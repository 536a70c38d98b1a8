// The last minute, as trends and the timeline draw it: distances, ages, alarms that came and went.

import { alarms, atLeast, machine, names, pair, state } from "./state.js";
import { forgetPeople, rememberPeople } from "./people/model.js";

const HISTORY = 60; // seconds

let lastHistory = -Infinity;
let touching = false;

export function forgetHistory() {
  state.history.length = 0;
  state.events.length = 0;
  forgetPeople();
  lastHistory = -Infinity;
}

/** Called with every snapshot. */
export function remember() {
  const s = state.snapshot;
  rememberPeople();
  const p = pair(state.own, state.partner);
  const distance = atLeast(p);
  for (const { distance: d } of s.pairs) if (d !== null && d < state.closest) state.closest = d;
  const contact = s.pairs.some((q) => q.distance !== null && q.distance <= 0);
  if (contact && !touching) state.contacts += 1;
  touching = contact;

  if (s.time - lastHistory >= 0.2 || s.time < lastHistory) {
    lastHistory = s.time;
    const ages = Object.fromEntries(names().map((name) => [name, machine(name)?.ages?.joints ?? null]));
    const trip = s.driving?.machines?.[state.own]?.round_trip ?? null;
    state.history.push({ time: s.time, distance, pair: `${state.own} ${state.partner}`, ages, trip });
    while (state.history.length && state.history[0].time < s.time - HISTORY) state.history.shift();
  }

  const open = new Map(state.events.filter((e) => e.end === null).map((e) => [e.key, e]));
  for (const alarm of alarms()) {
    const key = `${alarm.name} ${alarm.machine} ${alarm.level}`;
    if (open.delete(key)) continue;
    state.events.push({ key, level: alarm.level, label: alarm.line, machine: alarm.machine, start: s.time, end: null });
  }
  for (const event of open.values()) event.end = s.time;
  state.events = state.events.filter((e) => e.end === null || e.end > s.time - HISTORY);
}
