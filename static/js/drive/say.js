// The operator's lines of the control panel: what state it is in, why, and what to do.

import { number } from "../axis.js";
import { label, state } from "../state.js";
import { percent, isBlocked } from "../plots/arrow.js";
import { consoles, decision, holds, method, pattern, remote, seat } from "./driving.js";
import { buttonWord } from "./mapping.js";
import { mapping } from "./store.js";
import { input, slots } from "./operator.js";
import { levers, worst } from "./levers.js";


/** What is to be held. */
export function deadMan() {
  const { source } = input();
  if (source === "screen") return "ENABLE";
  if (source === "gamepad" || (!source && slots[0])) return buttonWord(slots, mapping(slots).buttons.enable);
  return "Space";
}

const upper = (text) => text.charAt(0).toUpperCase() + text.slice(1);
const sentence = (text) => (text ? `${upper(text)}.` : "");

/** The state's word; where this seat has nothing, who has. */
export function stateWord(name) {
  const mine = consoles()[name];
  if (mine?.held) return mine.state ?? "Idle";
  const r = remote(name);
  return r?.holder ? `${r.holder} drives` : "Free";
}

/** Wordings of what to do, the fullest first. */
export function lines(name) {
  const mine = consoles()[name];
  const r = remote(name) ?? {};
  if (!mine?.held) {
    if (r.offered_to && r.offered_to === state.you?.who) return [`${r.holder || "Someone"} hands ${label(name)} over to you. Accept: R`, "Handed over to you. Accept: R"];
    const refused = mine?.refused ? [`Refused: ${mine.refused}.`] : [];
    if (r.holder) return [[...refused, `Not yours. Request: R. Take over: More…`].join(" "), ...refused, "Request: R. Take over: More…"];
    return [[...refused, `Nobody drives ${label(name)} remotely. Request: R`].join(" "), ...refused, "Request: R"];
  }
  const local = input();
  const driven = seat()?.driven;
  if (!driven) return [`The sticks belong to no machine yet: press the key of ${label(name)}`, `Press the key of ${label(name)}`];
  if (driven !== name) return [`The sticks belong to ${label(driven)}. Let go, then press its key again`, `Sticks drive ${label(driven)}: let go, press key`, `Sticks drive ${label(driven)}`];
  if (r.locked && mine.state !== "Stop") return [`Locked: ${r.locked}`, `Locked: ${r.locked.split(": ")[0]}`];
  const why = mine.why || "";
  const hold = deadMan();
  if (mine.state === "Stop") return [`${sentence(why)} Release everything, then RESET`.trim(), "Release everything, then RESET"];
  if (local.why) return [`${sentence(local.why)} Release everything, then hold ${hold}`, `${sentence(local.why)} Release everything`, "Release everything"];
  if (mine.state === "Pause") return [`${sentence(why)} Release everything, then hold ${hold}`.trim(), `Release everything, then hold ${hold}`, `Release all, hold ${hold}`];
  if (mine.state === "Override") return [`OVERRIDE by ${state.you?.who}: ${seat()?.override || why}`, "OVERRIDE: limits are off"];
  if (local.ignored.length) return [`Only the ${local.source || "device"} in use counts: the ${local.ignored.join(", ")} does nothing`, `Only the ${local.source} counts`];
  if (mine.state === "Active") return [""];
  const follow = seat()?.follow?.[name];
  const follows = follow && !follow.ended;
  if (mine.state === "Enabled" && follows) return [`Follows ${follow.plan}: ${number(follow.at, 1)} of ${number(follow.duration, 1)} s. Let go to stop`, `Follows ${follow.plan}`];
  if (follows) return [`${sentence(why)} Sticks in neutral, then hold ${hold} to follow ${follow.plan}`.trim(), `Hold ${hold} to follow`];
  if (mine.state === "Enabled") return [`${sentence(why)} Move a stick`.trim(), "Move a stick"];
  return [`${sentence(why)} Sticks in neutral, then hold ${hold}`.trim(), `Hold ${hold} to enable`];
}

/** What the method holds back before the limiter, or why it does nothing; empty where all passes. */
function shaped(name) {
  const { name: way, scale, why } = decision(name)?.method ?? {};
  if (!way || (!(scale < 1) && !why?.length)) return "";
  const share = scale < 1 ? ` ${percent(scale)}` : "";
  return `Method: ${way}${share}${why?.length ? ` - ${why[0]}` : ""}`;
}

/** What the method holds back and the worst cause, in one line. */
export const cause = (name) => [shaped(name), limited(name)].filter(Boolean).join(" · ");

function limited(name) {
  const { all, enforced } = levers(name);
  const bad = worst(name, all);
  if (bad) return `${upper(bad.joint)} ${bad.word} ${isBlocked(bad.allowed) ? "blocked" : percent(bad.allowed)}${bad.why ? `: ${bad.why}` : ""}`;
  const { source } = input();
  return holds(name) ? `All free · ${source || "no device used yet"} · ${pattern()}${seat()?.fine ? " · fine" : ""}${method() === "braking" ? "" : ` · ${method()}`}` : enforced ? "All free" : "Advice: all free";
}
