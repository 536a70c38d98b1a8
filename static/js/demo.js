// The demo's first minute: a card, then short callouts at what is happening.

import { $, mark, write } from "./words.js";
import { metres, number } from "./axis.js";
import { controllable, holds } from "./drive/driving.js";
import { exactImage, label, state } from "./state.js";

const CARD_UNTIL = 20; // s; who opens the page later is not greeted
const SHOWN = 5.5; // s per callout

let dismissed = false; // Skip
let watching = false;
let finished = false;

const SCRIPT = [
  [0, "alarm-line", () => "Nearest distance, always here"],
  [8, "reach-panel", (own) => `★ is ${own}'s arm now`],
  [15, "plan-panel", () => "Purple: where they would meet, ten times a second"],
  [22, "limits-panel", () => "SLOW at 0.8 m: only the levers that approach"],
  [28, "alarm-line", () => (Number.isFinite(closing()) ? `Not braking: contact in ${number(closing(), 1)} s (computed)` : "STOP level at 0.2 m")],
  [34, "limits-panel", () => "Away is always free"],
  [42, "slices", () => (exactImage() ? "What if? Click a cell: checked independently" : "Point at a cell: its angles, and what is met")],
  [50, "machines", () => "No data is never “safe”"],
  [57, "alarm-line", (own) => `Contacts ${state.contacts}, closest approach ${metres(state.closest)}${controllable(state.own) && !holds(state.own) ? `. R: drive ${own}` : ""}`],
];

/** Of the own machine's bodies with the partner's at present speeds [s]. */
const closing = () => {
  const times = (state.snapshot?.concerns ?? []).filter((c) => c.machine === state.own).map((c) => c.evidence?.time_to_contact);
  return Math.min(...times.filter((t) => Number.isFinite(t) && t < 20));
};

export function startDemo(drive) {
  $("demo-watch").addEventListener("click", () => {
    watching = true;
    $("demo-card").hidden = true;
  });
  $("demo-drive").addEventListener("click", () => {
    dismissed = true;
    drive();
    update();
  });
  $("demo-skip").addEventListener("click", () => {
    dismissed = true;
    update();
  });
}

function safety(text) {
  const s = state.site?.safety;
  return s ? text.replace("0.8 m", metres(s.slow_below)).replace("0.2 m", metres(s.stop_below)) : text;
}

function point(id, text) {
  const callout = $("callout");
  write(callout, text);
  callout.hidden = false;
  const target = $(id).getBoundingClientRect();
  // Above what it speaks of, but never over the alarm line.
  const alarm = $("alarm").getBoundingClientRect();
  const height = callout.offsetHeight + 10;
  const above = target.top > 140 && (target.top - height > alarm.bottom || target.top <= alarm.bottom);
  mark(callout, "side", above ? "above" : "below");
  const x = Math.min(target.left + 12, innerWidth - callout.offsetWidth - 12);
  const y = above ? target.top - height : Math.min(target.bottom + 10, innerHeight - height);
  callout.style.left = `${Math.round(x)}px`;
  callout.style.top = `${Math.round(y)}px`;
}

export function update() {
  const elapsed = state.snapshot?.mode === "DEMO" ? state.snapshot.demo?.elapsed : undefined;
  const card = $("demo-card");
  if (!Number.isFinite(elapsed) || dismissed) {
    card.hidden = true;
    $("callout").hidden = true;
    return;
  }
  const own = label(state.own), partner = label(state.partner);
  if (elapsed < CARD_UNTIL && !watching) {
    const soon = Math.max(0, Math.round((22 - elapsed) / 5) * 5);
    write($("demo-text"), `Two excavators share one site. Purple is where ${own} would hit ${partner}. ${soon ? `In ${soon} s they get too close.` : "They get too close now."}`);
    const drivable = controllable(state.own) && !holds(state.own);
    $("demo-drive").hidden = !drivable;
    if (drivable) write($("demo-drive"), `Drive ${own}`);
    card.hidden = false;
  } else card.hidden = true;
  if (finished) return;
  const step = SCRIPT.filter(([t]) => elapsed >= t).pop();
  if (!step || elapsed > step[0] + SHOWN + (step[0] === 57 ? 6 : 0)) {
    $("callout").hidden = true;
    if (elapsed > 70) finished = true;
    return;
  }
  point(step[1], safety(step[2](own, partner)));
}
