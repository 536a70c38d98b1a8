// What is said of plans that are on offer and followed: things by their names, and how far the machine is.

import { deg, number } from "../axis.js";
import { consoles, decision } from "../drive/driving.js";
import { deadMan } from "../drive/say.js";
import { label, machine, state } from "../state.js";

const STATES = { planning: "PLANNING", none: "NO WAY", offered: "READY", unknown: "UNKNOWN", void: "VOID", done: "ARRIVED" };

/** "left:stick/0" -> "LEFT stick". */
export const thing = (name) => {
  const [whose, part] = String(name).split(":");
  if (part === undefined) return whose;
  return machine(whose) ? `${label(whose)} ${part.split("/")[0]}` : part.split("/")[0];
};
export const things = (names) => [...new Set(names.map(thing))].slice(0, 3).join(", ");
/** The same within a sentence of the server's. */
export const named = (text) => String(text).replace(/\b([\w-]+):([\w .-]+)\/\d+/g, (all) => thing(all));

/** One word for the state of an offer, and of following it. model: of a panel. */
export function stateWord(model) {
  const follow = model.follow(), offer = model.offer();
  if (model.following()) {
    const console_ = consoles()[state.own]?.state;
    return console_ === "Enabled" ? (follow.pace > 0.02 ? "FOLLOWING" : "WAITS") : "ACCEPTED";
  }
  if (follow?.ended && !follow.arrived && follow.plan === offer?.plan) return "ENDED";
  if (model.planning()) return STATES.planning;
  return offer ? STATES[offer.state] : "";
}

/** A direction that a concern has brought to a stand waits for neutral. */
const stopped = () => Object.values(decision(state.own)?.causes ?? {}).some((both) => both.some((side) => side.concern === "neutral"));

/** How far it is followed, and what to do. */
export function followLines(follow) {
  const [role, off] = Object.entries(follow.error).reduce((worst, one) => (Math.abs(one[1]) > Math.abs(worst[1]) ? one : worst), ["", 0]);
  const where = `${number(follow.at, 1)} of ${number(follow.duration, 1)} s · pace ${number(100 * follow.pace, 0)} % · error ${number(Math.abs(deg(off)), 1)}°${role ? ` ${role}` : ""}`;
  const console_ = consoles()[state.own] ?? {};
  if (console_.state === "Enabled" && stopped()) return [where, `A limit stopped it: let go, then hold ${deadMan()} again`];
  if (console_.state === "Enabled") return [where, follow.pace > 0.02 ? "Let go to stop; a stick takes over" : "A limit holds it back, or a joint lags"];
  return [where, `${console_.why ? `${named(console_.why)}. ` : ""}Hold ${deadMan()} to follow`];
}
