// What the page knows. Frames go in through `accept`; everything that draws only reads.

import { wrap } from "./axis.js";
import { forgetHistory, remember } from "./memory.js";

const ZONE_OLD = 2.5; // exact zones are made once a second [s]
const SWITCH = 0.3; // a new partner must be this much nearer [m], so that the panels do not flip

export const state = {
  site: null,
  you: null, // {seat, who, role}: whose page this is
  snapshot: null,
  raised: [], // alarms this page itself has to tell of
  arrival: -Infinity, // of the newest snapshot, performance.now() [ms]
  images: new Map(), // Sun's: "left<-right" -> {header, arrays, arrival, serial}
  exact: new Map(), // "left" -> the same
  zones: new Map(), // "left<-right", "left<-layer:people", "left<-layer:site" -> the same
  along: new Map(), // "left" -> the same: the strip along its track
  own: null,
  partner: null,
  socket: "connecting",
  serial: 0, // counts snapshots
  history: [], // {time, distance, level, ages}
  events: [], // {level, label, start, end}
  closest: Infinity, // smallest distance seen [m]
  contacts: 0,
  delays: [], // from the server's clock to arrival here [s]
};

const KINDS = { sun: "images", exact: "exact", zone: "zones", along: "along" };
let minimumDelay = Infinity;

export const mode = () => state.snapshot?.mode ?? state.site?.mode ?? "";

/** A recorded session is shown, not the machines. */
export const replaying = () => mode() === "PLAYBACK";

/** Clock on the wall of what the snapshot shows [s since 1970]. */
export const wall = () => state.snapshot?.playback?.wall ?? state.snapshot?.wall;

export function accept(header, arrays) {
  const now = performance.now();
  if (header.type === "you") state.you = header;
  else if (header.type === "site") {
    state.site = header;
    if (!(state.own in header.machines)) state.own = header.own?.find((name) => name in header.machines) ?? names()[0];
    state.partner = null;
    if (state.snapshot && names().some((name) => !(name in state.snapshot.machines))) forget();
  } else if (header.type === "snapshot") {
    if (state.snapshot && header.cycle < state.snapshot.cycle && header.time < state.snapshot.time) forget(); // restarted
    else if (state.snapshot && header.mode === "PLAYBACK" && header.time < state.snapshot.time) forgetHistory(); // images stay: their age tells
    Object.values(header.machines).forEach(normalise);
    state.snapshot = header;
    state.arrival = now;
    state.serial += 1;
    if (!header.machines[state.own]) state.own = names()[0];
    state.partner = nearest();
    const delay = Date.now() / 1000 - header.wall;
    if (Number.isFinite(delay)) {
      minimumDelay = Math.min(minimumDelay, delay);
      state.delays.push(delay);
      if (state.delays.length > 250) state.delays.shift();
    }
    remember();
  } else if (header.type in KINDS) {
    const kept = state[KINDS[header.type]];
    kept.set(header.key, { header, arrays, arrival: now, serial: (kept.get(header.key)?.serial ?? 0) + 1 });
  }
}

/** Numbers that do not exist arrive as null: a point or posture with one of them does not exist. */
function normalise(machine) {
  for (const name of ["position", "position_projected", "swing_center", "end_point"]) {
    if (!machine[name]?.every(Number.isFinite)) machine[name] = null;
  }
  if (!Object.values(machine.joints ?? { none: null }).every(Number.isFinite)) machine.joints = null;
}

function forget() {
  for (const kept of Object.values(KINDS)) state[kept].clear();
  forgetHistory();
}

export const names = () => Object.keys(state.site?.machines ?? state.snapshot?.machines ?? {});
export const machine = (name) => state.snapshot?.machines[name] ?? null;
export const described = (name) => state.site?.machines[name] ?? null;
export const label = (name) => machine(name)?.label ?? described(name)?.label ?? String(name ?? "–").toUpperCase();

export function choose(name) {
  if (!names().includes(name) || name === state.own) return false;
  state.own = name;
  state.partner = null;
  state.partner = nearest();
  return true;
}

/** The entry of `pairs` for two machines, in the order (one, other). */
export function pair(one, other) {
  const found = state.snapshot?.pairs.find((p) => (p.a === one && p.b === other) || (p.a === other && p.b === one));
  if (!found || found.a === one) return found ?? null;
  return { ...found, a: found.b, b: found.a, body_a: found.body_b, body_b: found.body_a, points: found.points && [...found.points].reverse() };
}

/** The distance, or for machines far apart the bound below it; null when unknown. */
export const atLeast = (p) => p?.distance ?? p?.at_least ?? null;

function nearest() {
  const own = machine(state.own);
  if (!own) return null;
  let best = null;
  for (const name of names()) {
    if (name === state.own || !machine(name)) continue;
    const p = machine(name).position;
    let distance = atLeast(pair(state.own, name));
    if (distance === null) distance = own.position && p ? Math.hypot(own.position[0] - p[0], own.position[1] - p[1]) : Infinity;
    const compared = name === state.partner ? distance - SWITCH : distance;
    if (!best || compared < best.compared) best = { name, compared };
  }
  return best?.name ?? null;
}

/** The bound of a pair too far apart to matter, else null. No image is computed of such a pair. */
export function far() {
  const p = pair(state.own, state.partner);
  return p && p.distance === null ? p.at_least ?? null : null;
}

export const image = () => (far() === null ? state.images.get(`${state.own}<-${state.partner}`) ?? null : null);

/** The exact image of the own machine, against all partners, the site and itself. */
export const exactImage = () => state.exact.get(state.own) ?? null;
export const zoneImage = () => (far() === null ? state.zones.get(`${state.own}<-${state.partner}`) ?? null : null);

/** The own machine's driving zone of "people" or "site"; null where there is none. */
export const layerZone = (layer) => state.zones.get(`${state.own}<-layer:${layer}`) ?? null;

/** The machines whose data an image was computed from. */
const parties = ({ header }) => [header.own, ...(header.partners ?? [header.partner])].filter((name) => machine(name));

/** Why there is no image. */
export const noImage = () => (far() === null ? "no image yet" : `${label(state.partner)} is over ${Math.floor(far())} m away`);

/** Seconds since the last snapshot arrived. */
export const silence = () => (performance.now() - state.arrival) / 1000;

/** What waiting adds to ages. Recorded data grow no older while the player answers, paused or not. */
export const waited = () => (replaying() && silence() <= 1 ? 0 : silence());

/** Age of what the snapshot says: pipeline, the way here beyond the quickest seen, and waiting since. */
export function snapshotAge() {
  const s = state.snapshot;
  if (!s) return Infinity;
  const delay = state.delays.length && !replaying() ? Math.max(0, state.delays[state.delays.length - 1] - minimumDelay) : 0;
  return Math.max(0, s.time - (s.state_time ?? s.time)) + delay + waited();
}

/** How much longer than the quickest message one took that the server sent at `sent` [s since 1970]. */
export const transit = (sent) => (Number.isFinite(minimumDelay) ? Math.max(0, Date.now() / 1000 - sent - minimumDelay) : 0);

/** Age of an image's state, by the server's clock as the newest snapshot carries it. */
export function imageAge(entry) {
  if (!entry || !state.snapshot) return Infinity;
  const since = state.snapshot.time - entry.header.state_time;
  // After a jump back a picture can be of what is yet to come: as wrong as one of long ago.
  const own = (replaying() ? Math.abs(since) : Math.max(0, since)) + waited();
  // A picture is no younger than the pose of a machine that has gone silent.
  const invalid = parties(entry).filter((name) => machine(name).validity !== "VALID");
  return Math.max(own, ...invalid.map(dataAge));
}

/** Too old, or computed from a machine whose own data are not valid. */
export function imageStale(entry) {
  if (!entry) return true;
  return imageAge(entry) > (entry.header.type === "zone" ? ZONE_OLD : 1) || parties(entry).some((name) => machine(name).validity !== "VALID");
}

export function link() {
  if (state.socket !== "open" && !state.snapshot) return "connecting";
  const s = silence();
  return s > 1 ? "lost" : s > 0.5 ? "slow" : "ok";
}

/** The oldest stream of a machine [s]; Infinity when one was never received. */
export function dataAge(name) {
  const ages = machine(name)?.ages;
  if (!ages) return Infinity;
  const known = Object.values(ages).map((a) => (a === null ? Infinity : a));
  return Math.max(...known) + waited();
}

/** Angles of Sun 2020, Fig. 2, from a joint's own value: sign * q + offset. */
export function sunMap(name, role) {
  const given = described(name)?.sun;
  const index = ["boom", "stick", "bucket"].indexOf(role);
  if (given && index >= 0) return { sign: given.signs[index], offset: given.offsets[index] };
  const m = machine(name);
  const offset = (m?.sun?.[role] ?? 0) - (m?.joints?.[role] ?? 0);
  return { sign: 1, offset: Number.isFinite(offset) ? offset : 0 };
}

/** +1 when a machine's own swing angle grows to the left, as the words of its concerns tell. */
export function swingSign(name) {
  const words = state.snapshot?.concerns?.find((c) => c.machine === name)?.allowed?.swing?.words;
  return words ? (words[1].endsWith("left") ? 1 : -1) : described(name)?.sun?.azimuth_sign ?? 1;
}

/** Swing, left positive, within ±π [rad]. */
export function swing(name) {
  return wrap(swingSign(name) * (machine(name)?.joints?.swing ?? NaN));
}

/** Swing, left positive, at which the arm has the azimuth theta. */
export const swingAt = (name, theta) => wrap(theta - (machine(name)?.azimuth ?? 0) + swing(name));

export const severity = { CLEAR: 0, SLOW: 1, STOP: 2, UNKNOWN: 3 };

/** Alarms that count, the severest first, the own machine's before others' at the same level. */
export function alarms() {
  const active = [...state.raised, ...(state.snapshot?.alarms ?? [])].filter((a) => a.active !== false && severity[a.level] > 0);
  const mine = (a) => (a.machine === state.own ? 0 : 1);
  return active.map((a, i) => [a, i]).sort(([a, i], [b, j]) => severity[b.level] - severity[a.level] || mine(a) - mine(b) || i - j).map(([a]) => a);
}

/** What the operator should know though no machine is in danger: [{key, line, since}]. */
export const notices = () => state.snapshot?.notices ?? [];

export const partnerLevel = (distance) => {
  const safety = state.site?.safety ?? { slow_below: 0.8, stop_below: 0.2 };
  if (distance === null || distance === undefined) return "UNKNOWN";
  return distance < safety.stop_below ? "STOP" : distance < safety.slow_below ? "SLOW" : "CLEAR";
};
