// Which lever direction moves what, and how much of it is allowed.

import { decision, pattern } from "./driving.js";
import { advice, directions } from "../plots/advice.js";
import { isFree } from "../plots/arrow.js";
import { silence } from "../state.js";

/** Per lever and direction: the joint and the word of its motion. Forwards is away from the operator. */
const ISO = {
  left: { up: ["stick", "out"], left: ["swing", "left"], right: ["swing", "right"], down: ["stick", "in"] },
  right: { up: ["boom", "down"], left: ["bucket", "curl"], right: ["bucket", "dump"], down: ["boom", "up"] },
};
const SAE = {
  left: { ...ISO.left, up: ISO.right.up, down: ISO.right.down },
  right: { ...ISO.right, up: ISO.left.up, down: ISO.left.down },
};
const PATTERNS = { ISO, SAE };

const NONE = { allowed: 0, why: "no verdict received" };

/** What the server enforces: {allowed, why} of one direction. */
function enforcedShare(given, role, k) {
  if (given.locked) return { allowed: 0, why: given.locked };
  if (silence() > 1) return { allowed: 0, why: "no data" };
  const allowed = given.fraction?.[role]?.[k];
  if (!Number.isFinite(allowed)) return NONE;
  const { concern = "", reason = "" } = given.causes?.[role]?.[k] ?? {};
  return { allowed, why: isFree(allowed) ? "" : reason || concern };
}

/** {enforced, find(joint, word), tracks: {track_left: [ahead, back], ..}} of a machine. */
function shares(name) {
  const given = decision(name);
  const rows = given ? directions(name, (role, i, k) => enforcedShare(given, role, k)) : advice(name) ?? [];
  const find = (joint, word) => rows.find((row) => row.role === joint)?.sides.find((side) => side.word === word) ?? { word, ...NONE };
  const track = (role) => (given ? [enforcedShare(given, role, 1), enforcedShare(given, role, 0)] : [find("travel", "ahead"), find("travel", "back")]);
  return { enforced: Boolean(given), find, tracks: { track_left: track("track_left"), track_right: track("track_right") } };
}

/** All lever directions: [{lever, way, joint, word, allowed, why}], and whether these shares are enforced. */
export function levers(name) {
  const { enforced, find, tracks } = shares(name);
  const sticks = Object.entries(PATTERNS[pattern()]).flatMap(([lever, ways]) =>
    Object.entries(ways).map(([way, [joint, word]]) => ({ lever, way, joint, ...find(joint, word), word })));
  const tracked = Object.entries(tracks).flatMap(([lever, [ahead, back]]) => [{ ...ahead, lever, way: "up", joint: lever.replace("_", " "), word: "ahead" }, { ...back, lever, way: "down", joint: lever.replace("_", " "), word: "back" }]);
  return { enforced, all: [...sticks, ...tracked] };
}

/** What was cut of the operator's wish just now: {joint: reason}. */
export const cut = (name) => decision(name)?.cut ?? {};

/** The most restricted direction that is not free, one that is being cut first. */
export function worst(name, all) {
  const cuts = cut(name);
  const rank = (one) => one.allowed - (cuts[one.joint.replace(" ", "_")] ? 1 : 0);
  return all.filter((one) => !isFree(one.allowed)).sort((a, b) => rank(a) - rank(b))[0] ?? null;
}
