// The machines' cameras over the scene, and whether one machine is worked with or two.

import { $, make, mark, write } from "../words.js";
import { described, names, replaying, state } from "../state.js";
import { change, prefs, recall, shown } from "./prefs.js";
import { slot } from "./slot.js";

const slots = {};
let buttons = null;

const listed = (name) => described(name)?.cameras ?? [];
const machineOf = (side) => (side === "own" ? state.own : prefs.machines === "two" ? state.partner : null);
const pick = (name) => Math.min(Number(prefs.picks[name]) || 0, Math.max(0, listed(name).length - 1));
const some = () => names().some((name) => listed(name).length > 0);

export function toggleCameras() {
  if (!some()) return;
  change({ shown: !shown(), large: "" });
  update();
}

/** One machine: only the own one's panels and camera. Two: the partner's beside it. */
export function toggleMachines() {
  if (names().length < 2) return;
  change({ machines: prefs.machines === "two" ? "one" : "two", large: prefs.large === "partner" ? "" : prefs.large });
  update();
}

function next(side) {
  const name = machineOf(side);
  if (name) change({ picks: { ...prefs.picks, [name]: (pick(name) + 1) % listed(name).length } });
  update();
}

function enlarge(side) {
  change({ large: prefs.large === side ? "" : side });
  update();
}

export function startCameras() {
  buttons = {
    shown: make("button", { type: "button", id: "cameras-shown", text: "Camera", title: "Pictures of the machines' cameras (C)", hidden: "" }),
    machines: make("button", { type: "button", id: "machines-shown", title: "Both machines, or the own one only (B)", hidden: "" }),
  };
  buttons.shown.addEventListener("click", toggleCameras);
  buttons.machines.addEventListener("click", toggleMachines);
  $("layout-tools").prepend(buttons.shown, buttons.machines);
  for (const side of ["own", "partner"]) {
    slots[side] = slot(side, { next, enlarge, hide: toggleCameras });
    $("scene").after(slots[side].node);
  }
  document.addEventListener("visibilitychange", update);
}

/** Ten times a second. */
export function update() {
  if (!state.site) return;
  recall();
  const recorded = replaying();
  const seen = shown() && !recorded && !document.hidden;
  for (const [side, one] of Object.entries(slots)) {
    const name = seen ? machineOf(side) : null;
    one.show(name, name === null ? 0 : pick(name), prefs.large === side);
  }
  mark(document.body, "machines", names().length < 2 ? "two" : prefs.machines);
  buttons.shown.hidden = recorded || !some();
  buttons.shown.setAttribute("aria-pressed", String(shown()));
  buttons.machines.hidden = names().length < 2;
  write(buttons.machines, prefs.machines === "two" ? "Both" : "Own");
  buttons.machines.setAttribute("aria-pressed", String(prefs.machines === "two"));
}
