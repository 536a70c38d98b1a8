// Alarms that ended, as the server keeps them: worst moment, how they ended, who silenced them.

import { make } from "./words.js";
import { number } from "./axis.js";
import { clock, wallClock } from "./clock.js";
import { replaying } from "./state.js";

const AGAIN = 2000; // between two looks while the list is open [ms]
const SHOWN = 30;

let ended = [];
let asked = -Infinity;
let key = "";

/** Called while the list is open. */
export async function refresh() {
  if (replaying() || performance.now() - asked < AGAIN) return;
  asked = performance.now();
  try {
    const reply = await fetch("/api/alarms");
    if (reply.ok) ended = (await reply.json()).alarms.filter((a) => a.end !== null).slice(0, SHOWN);
  } catch {
    // the server is away: what is known stays
  }
  key = ended.map((a) => `${a.begin} ${a.end}`).join("|");
}

export const historyKey = () => key;

const told = (a) => [
  a.time_to_contact === null ? "" : `contact in ${number(a.time_to_contact, 1)} s then`,
  `ended: ${a.ended}`,
  a.silenced_by ? `silenced by ${a.silenced_by}` : "",
].filter(Boolean).join(" · ");

/** One item for each, the newest first. */
export const items = () => ended.map((a) => make("li", { class: "ended" },
  make("b", { "data-level": a.level, text: a.level }),
  make("span", { text: a.line.replace(/^[A-Z]+ · /, "") }),
  make("span", { class: "dim", text: `${wallClock(a.begin)}, ${clock(a.end - a.begin)} long` }),
  make("small", { text: told(a) })));
