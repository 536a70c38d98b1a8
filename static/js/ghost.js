// What if: a ghost in the scene where the pointer is, and a pinned configuration judged by python-fcl.

import { $, make, mark, partName, write } from "./words.js";
import { metres, seconds } from "./axis.js";
import { label, state } from "./state.js";
import { jointsText, obstacle } from "./exact.js";
import { page } from "./scene.js";

const PERIOD = 100; // ms between two messages, the latest wins

let send = () => {}, changed = () => {};
let last = -Infinity, timer = null, waiting = null, showing = false;
let pinned = null; // {machine, joints, serial}
let verdict = null; // the answer, with `at` [ms]
let serial = 0;

function flush() {
  timer = null;
  if (!waiting) return;
  last = performance.now();
  send({ type: "ghost", page, ...waiting });
  showing = waiting.machine !== null;
  waiting = null;
}

function post(message) {
  waiting = message;
  if (timer === null) timer = setTimeout(flush, Math.max(0, last + PERIOD - performance.now()));
}

/** The pointer is at a configuration, or at none (null). A pinned one stays. */
export function hovered(aim) {
  if (pinned || (!aim && !showing && !waiting)) return;
  post(aim ? { machine: aim.machine, joints: aim.joints } : { machine: null });
}

/** A click: keeps the ghost and asks for the verdict. It never moves a machine. */
export async function pin(aim) {
  if (!aim) return;
  const mine = ++serial;
  pinned = { ...aim, serial: mine };
  verdict = null;
  post({ machine: aim.machine, joints: aim.joints });
  card();
  let answer;
  try {
    const reply = await fetch("/api/whatif", { method: "POST", headers: { "Content-Type": "application/json" }, body: JSON.stringify({ machine: aim.machine, joints: aim.joints }) });
    answer = reply.ok ? await reply.json() : { verdict: "UNKNOWN", reason: `not checked: the server answered ${reply.status}` };
  } catch {
    answer = { verdict: "UNKNOWN", reason: "not checked: no answer from the server" };
  }
  if (serial !== mine) return;
  verdict = { ...answer, at: performance.now() };
  card();
}

export function unpin() {
  serial += 1;
  const had = pinned !== null;
  pinned = verdict = null;
  if (had || showing || waiting) post({ machine: null });
  card();
  return had;
}

const withOwn = (own, { own: body, other }) => `${partName(body)} ↔ ${obstacle(own, other)}`;

/** The verdict in one line. */
function verdictText(own, answer) {
  if (!answer) return "checking";
  if (answer.verdict === "COLLIDING") {
    const [first, ...more] = answer.hits ?? [];
    const what = first ? withOwn(own, first) : answer.closest ? withOwn(own, answer.closest) : "contact";
    return `COLLIDING: ${what}${more.length ? ` +${more.length}` : ""}`;
  }
  if (answer.verdict === "FREE") return `FREE${Number.isFinite(answer.distance) ? `: ${metres(answer.distance)}` : ""}${answer.closest ? ` ${withOwn(own, answer.closest)}` : ""}`;
  return `UNKNOWN${answer.reason ? `: ${answer.reason}` : ""}`;
}

function card() {
  const box = $("pin");
  box.hidden = pinned === null;
  changed();
  if (!pinned) return;
  const own = pinned.machine;
  mark(box, "verdict", verdict?.verdict ?? "CHECKING");
  write($("pin-who"), `What if · ${label(own)}`);
  write($("pin-verdict"), verdictText(own, verdict));
  write($("pin-joints"), jointsText(own, pinned.joints));
  const more = (verdict?.hits ?? []).slice(1, 4).map((hit) => make("li", { text: withOwn(own, hit) }));
  $("pin-hits").replaceChildren(...more);
  $("pin-hits").hidden = !more.length;
  mark(box, "distance", Number.isFinite(verdict?.distance) ? verdict.distance : "");
  age();
}

/** Called as time goes on: the machines move on, the verdict does not. */
export function age() {
  if (!pinned) return;
  const parts = verdict ? [
    ...(verdict.verdict === "COLLIDING" && Number.isFinite(verdict.distance) ? [`distance ${metres(verdict.distance)}`] : []),
    ...(verdict.checked_by ? [`checked by ${verdict.checked_by} ${seconds((performance.now() - verdict.at) / 1000)} ago`] : []),
  ] : ["asking python-fcl"];
  write($("pin-check"), [...parts, "Esc clears"].join(" · "));
}

/** The pinned joints when they were pinned on that plot of the own machine. */
export const pinnedFrom = (from) => (pinned?.from === from && pinned.machine === state.own ? pinned.joints : null);
export const startGhost = (give, redraw) => {
  send = give;
  changed = redraw;
  $("pin-close").addEventListener("click", unpin);
};
