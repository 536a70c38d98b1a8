// How far every joint can go before it meets something, in words. Unknown when missing or old, never "free".

import { degrees, number, seconds } from "./axis.js";
import { partName } from "./words.js";
import { exactImage, imageStale, machine, snapshotAge, state, swingSign } from "./state.js";
import { obstacle } from "./exact.js";

/** Whether the backend says anything of margins at all. */
export const told = () => state.snapshot?.margins !== undefined;

/** The margins of a machine, or null when they are unknown. */
export function margins(name) {
  const given = state.snapshot?.margins?.[name];
  if (!given || given.reason || snapshotAge() > 1 || machine(name)?.validity !== "VALID") return null;
  return given;
}

/** Of a joint's two ways [to the left end of its bar, to the right end]; null where unknown. */
export function ways(name, role) {
  const joint = margins(name)?.joints?.[role];
  const [left, right] = role === "swing" && swingSign(name) > 0 ? ["positive", "negative"] : role === "swing" ? ["negative", "positive"] : ["negative", "positive"];
  return [joint?.[left] ?? null, joint?.[right] ?? null];
}

/** Contact at full speed can no longer be avoided. At a joint's own limit nothing is hit. */
export const cannotStop = (way) => Boolean(way && way.hits && way.can_stop === false);

/** It moves that way now: what is else only a possibility is then a danger. */
export const goesThere = (way) => Boolean(way && Number.isFinite(way.time_now));

/** "18° RIGHT stick · 1.2 s", from the fullest wording to the shortest. */
export function wayTexts(name, way) {
  if (!way || !Number.isFinite(way.free)) return ["margin unknown", "unknown"];
  const far = degrees(way.free, Math.abs(way.free) < 0.1 ? 1 : 0);
  const what = obstacle(name, way.hits);
  if (!way.hits) return [`${far} ${what}`, far];
  const time = Number.isFinite(way.time_full) ? seconds(way.time_full) : null;
  return [[`${far} ${what}`, time].filter(Boolean).join(" · "), `${far} ${what}`, far];
}

export function wayLines(name, way, word) {
  if (!way || !Number.isFinite(way.free)) return [`${word}: margin unknown`];
  const what = way.hits ? `${way.own ? `${partName(way.own)} meets ` : ""}${obstacle(name, way.hits)}` : "the joint's limit";
  const times = way.hits ? [`${seconds(way.time_full)} at full speed`, ...(Number.isFinite(way.time_now) ? [`${seconds(way.time_now)} as it moves now`] : [])] : [];
  const stop = Number.isFinite(way.stop_full) ? [`full-speed stop needs ${degrees(way.stop_full, 1)}${cannotStop(way) ? ": CANNOT STOP IN TIME" : ""}`] : [];
  return [`${word}: ${degrees(way.free, 1)}, then ${what}${times.length ? ` · ${times.join(", ")}` : ""}`, ...stop.map((text) => `   ${text}`)];
}

/** What the present motion leads to. */
export function motion(name) {
  if (!told()) return null;
  const given = margins(name);
  if (!given) return { text: "time to contact unknown", seconds: null, known: false };
  const m = given.motion;
  const moves = Object.values(machine(name)?.joint_velocities ?? {}).some((v) => Math.abs(v) > 0.01);
  if (!m) return moves ? { text: "time to contact unknown", seconds: null, known: false } : { text: "at rest", seconds: null, known: true };
  if (!Number.isFinite(m.free)) return { text: "time to contact unknown", seconds: null, known: false };
  if (m.hits && m.free < 0.05) return { text: `within the margin of ${obstacle(name, m.hits)}`, seconds: m.free, known: true };
  if (m.free > 60) return { text: "on this motion nothing within a minute", seconds: m.free, known: true };
  const text = m.hits ? `on this motion ${obstacle(name, m.hits)} in ${seconds(m.free)}` : `on this motion no contact, limit in ${seconds(m.free)}`;
  return { text, seconds: m.free, known: true };
}

const percent = (share) => `${number(100 * share, 100 * share < 1 && share > 0 ? 1 : 0)} %`;

/** "can reach 63 % of the joint space; 2 regions (4 %) are cut off": longest wording first; [] when not told. */
export function regionTexts() {
  const entry = exactImage();
  if (!entry) return [];
  const r = entry.header.regions;
  if (!r || imageStale(entry)) return ["reachable part of the joint space unknown", "reachable part unknown", "unknown"];
  if (!r.present) return ["this posture is not certified free", "not certified free here"];
  const regions = `${r.cut_off} region${r.cut_off === 1 ? "" : "s"} (${percent(r.cut_off_share)})`;
  const short = `can reach ${percent(r.share)}`;
  if (!r.cut_off) return [`${short} of the joint space; nothing free is cut off`, `${short} of the joint space`, short];
  return [`${short} of the joint space; ${regions} ${r.cut_off === 1 ? "is" : "are"} cut off`, `${short}; ${regions} cut off`, `${short}; ${r.cut_off} cut off`, short];
}
