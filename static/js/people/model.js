// People and objects that LiDARs see: what the snapshot says of them, and where they were.

import { label, names, state, waited } from "../state.js";

export const OLD = 0.5; // of the newest scan: older, and nobody counts as seen [s]
export const PAST = 20; // that is remembered [s]
export const AHEAD = 1; // of the foretold places [s]
const EVERY = 0.09; // between two remembered places [s]

/** Boundaries of the TTC–x plane: emergency up to the first, warning up to the second (Rasul 2021, Fig. 8). */
export const boundaries = () => people()?.boundaries ?? { index: [1, 2], ttc: [1, 3] };
const RANK = { SAFE: 0, WARNING: 1, EMERGENCY: 2 };
/** As the alarm line calls these levels, whose shapes and colours they have. */
export const ALARM = { WARNING: "SLOW", EMERGENCY: "STOP" };

/** Null where the site has no LiDAR. */
export const people = () => state.snapshot?.people ?? null;
export const tracks = () => people()?.tracks ?? [];
export const lost = () => people()?.lost ?? [];

/** Seconds since the newest scan; Infinity before the first. */
export const age = () => (people()?.age ?? Infinity) + waited();

/** Why nobody knows where people are, else empty. */
export function unknown() {
  const p = people();
  if (!p) return "";
  if (p.reason) return p.reason;
  if (age() <= OLD) return "";
  return Number.isFinite(age()) ? `no LiDAR data for ${age().toFixed(1)} s` : "no LiDAR data yet";
}

const letter = (kind) => (kind === "object" ? "O" : "P");
export const code = ({ id, kind }) => `${letter(kind ?? past.get(id)?.kind)}${id}`;

const infinite = (v) => v ?? Infinity;
const read = (r) => ({ ...r, ttc: infinite(r.ttc), index: infinite(r.index), ttc_ahead: infinite(r.ttc_ahead), index_ahead: infinite(r.index_ahead) });

/** What a track means for the machines, or for one of them, the worst first; nothing while unknown. */
export function risks(id, machine = null) {
  if (unknown()) return [];
  const found = (people()?.risks ?? []).filter((r) => r.id === id && (machine === null || r.machine === machine)).map(read);
  return found.sort((a, b) => RANK[b.level] - RANK[a.level] || infinite(a.distance) - infinite(b.distance));
}

/** What the swing of a machine is to the other machines; nothing while people are unknown. */
export const partners = (machine) => (unknown() ? [] : (people()?.machines ?? []).filter((r) => r.machine === machine).map(read));
const AREAS = ["none", "maximum", "predicted", "current"];
const AREA_WORDS = { current: "working area", predicted: "predicted working area", maximum: "largest working area" };

/** Whose working areas a track is in, or will be in a second, the narrowest first; nothing while unknown. */
export function inside(id) {
  if (unknown()) return [];
  const found = (people()?.inside ?? []).filter((one) => one.id === id);
  return found.sort((a, b) => AREAS.indexOf(b.area) - AREAS.indexOf(a.area) || AREAS.indexOf(b.area_ahead) - AREAS.indexOf(a.area_ahead));
}

/** One of these in words: "in LEFT's predicted working area, in 1 s in its working area". */
export function areaWords({ machine, area, area_ahead: ahead }) {
  const whose = `${label(machine)}'s`;
  const now = area === "none" ? "" : `in ${whose} ${AREA_WORDS[area]}`;
  if (AREAS.indexOf(ahead) <= AREAS.indexOf(area)) return now;
  return now ? `${now}, in 1 s in its ${AREA_WORDS[ahead]}` : `in 1 s in ${whose} ${AREA_WORDS[ahead]}`;
}

/** Who is in a working area as it is now or is predicted to be: "P7 in LEFT's predicted working area". */
export function insideWords() {
  const near = ({ area, area_ahead: ahead }) => Math.max(AREAS.indexOf(area), AREAS.indexOf(ahead)) >= 2;
  return tracks().filter(({ status }) => status !== "tentative").flatMap((track) => inside(track.id).filter(near).map((one) => `${code(track)} ${areaWords(one)}`));
}

export const level = (id) => risks(id)[0]?.level ?? "SAFE";

/** The worst level of anybody. */
export const worst = () => tracks().reduce((most, { id }) => (RANK[level(id)] > RANK[most] ? level(id) : most), "SAFE");

/** The level of a place on the TTC–x plane. */
export function region(ttc, index) {
  const at = boundaries();
  const within = (k) => index <= at.index[k] || ttc <= at.ttc[k];
  return within(0) ? "EMERGENCY" : within(1) ? "WARNING" : "SAFE";
}

/** Where it goes when it moves, else where its box faces [rad]. */
export const heading = ({ velocity: v, yaw }) => (Math.hypot(...v) > 0.3 ? Math.atan2(v[1], v[0]) : yaw);

/** Half axes [m] and direction [rad] of the ellipse that holds the foretold place with 95 %; null without. */
export function ellipse({ ahead }) {
  const [[a, b], [, c]] = ahead?.cov ?? [[null, null], [null, null]];
  if (![a, b, c].every(Number.isFinite)) return null;
  const middle = (a + c) / 2, apart = Math.hypot((a - c) / 2, b);
  const half = (v) => Math.sqrt(5.991 * Math.max(0, v));
  return { long: half(middle + apart), wide: half(middle - apart), angle: Math.atan2(2 * b, a - c) / 2 };
}

const past = new Map(); // id -> {kind, points: [{time, place: [x, y], ahead: [x, y] or null}]}

/** Where a track was during the last 20 s, and where it was then foretold to be a second later. */
export const history = (id) => past.get(id)?.points ?? [];

export const forgetPeople = () => past.clear();

/** Called with every snapshot. */
export function rememberPeople() {
  const now = state.snapshot.time;
  if (!unknown()) {
    for (const { id, kind, position, ahead } of tracks()) {
      const kept = past.get(id) ?? past.set(id, { kind, points: [] }).get(id);
      kept.kind = kind;
      const last = kept.points[kept.points.length - 1];
      if (last && now - last.time < EVERY) continue;
      kept.points.push({ time: now, place: position.slice(0, 2), ahead: ahead?.position ?? null });
    }
  }
  const told = new Set(lost().map(({ id }) => id));
  for (const [id, { points }] of past) {
    while (points.length && points[0].time < now - PAST - AHEAD) points.shift();
    if (!points.length && !told.has(id)) past.delete(id);
  }
}

/** The machines of this site that somebody is judged against, the own one first. */
export const judged = () => [state.own, ...names().filter((name) => name !== state.own)];
