// The working gauge as it is now: fetched when the snapshot says that it changed, of the site's file before that.

import { get } from "../api.js";
import { label as nameOf, state } from "../state.js";

const AGAIN = 2000; // ms after a failure

let held = null; // a GaugeStateDocument
let busy = false;
let failed = -Infinity;

/** Whether this server knows what holds now. */
export const known = () => Boolean(state.snapshot?.gauge);

/** All limit volumes: {name, kind, state, drawn, switched, idle, plan}; idle: why one holds for nobody. */
export const volumes = () => held?.volumes.map((v) => ({ ...v, idle: v.why })) ?? state.site?.gauge ?? [];

export const inForce = () => volumes().filter((v) => !v.idle).map((v) => v.name);

export const isOwnTrack = (name) => Boolean(state.snapshot?.gauge?.own_tracks[state.own]?.includes(name));

/** The machines that stand on a track, by their labels. */
export const standingOn = (name) => Object.entries(state.snapshot?.gauge?.own_tracks ?? {}).filter(([, on]) => on.includes(name)).map(([machine]) => nameOf(machine));

export function take(document) {
  held = document;
}

/** Another site, or another server. */
export function forget() {
  held = null;
  failed = -Infinity;
}

/** Ten times a second. */
export async function update() {
  const choice = state.snapshot?.gauge?.choice;
  if (!choice || busy || held?.choice === choice || performance.now() - failed < AGAIN) return;
  busy = true;
  try {
    take(await get("/api/gauge"));
  } catch {
    failed = performance.now(); // the plan shows what was known
  }
  busy = false;
}
