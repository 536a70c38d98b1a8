// The panel “Trajectory” in the place of the reach image: a goal on the plan, a plan, its preview, and following it.

import { metres, number, seconds } from "../axis.js";
import { controllable, holds } from "../drive/driving.js";
import { label, machine, state } from "../state.js";
import { $, mark, write } from "../words.js";
import { setHeight, setOpen, startDrawing } from "./draw.js";
import * as model from "./model.js";
import { surfaces } from "./plots.js";
import { startSide } from "./side.js";
import { followLines, named, stateWord, things } from "./words.js";

const FIELDS = { height: [0.5, -20, 40], payload: [0, 0, 1e6], lift: [0, 0, 20], clearance: [0.2, 0.05, 4], speed: [100, 1, 100], acceleration: [100, 1, 100] };

let open = false;
let redraw = () => {};
let plots = [];
let drawn = "";
let used = false;
let third = "joints"; // in the third plot, once there is a trajectory

/** What the fields say; null with the first that makes no sense. */
function entered() {
  const found = {};
  for (const [name, [usual, low, high]] of Object.entries(FIELDS)) {
    const field = $(`tj-${name}`);
    const value = field.value.trim() === "" ? usual : Number(field.value);
    const wrong = !Number.isFinite(value) || value < low || value > high;
    mark(field, "wrong", wrong ? 1 : 0);
    if (wrong) return { wrong: `${field.title.split(":")[0]}: allowed is ${low} to ${high}` };
    found[name] = value;
  }
  return { ...found, speed: found.speed / 100, acceleration: found.acceleration / 100, ground: $("tj-ground").checked };
}

function result(offer) {
  const { duration, checks, clearance } = offer;
  const least = checks.min_clearance === null ? "nothing in reach" : `${metres(checks.min_clearance)} at least`;
  const tips = checks.min_stability_margin === null ? "tipping not judged" : `${metres(checks.min_stability_margin)} to tipping`;
  return [`${number(duration, 1)} s · ${least} (${metres(clearance)} asked) · ${tips}`, ...offer.notes.map(named)];
}

/** What to say, at most three lines. */
function lines() {
  const offer = model.offer(), follow = model.follow(), asked = entered();
  if (asked.wrong) return [asked.wrong];
  if (model.trouble() && !model.following()) return [named(model.trouble())];
  if (model.following()) return followLines(follow);
  if (model.planning()) return ["Looking for a way that touches nothing and does not tip"];
  if (!offer) return model.picked() ? ["Plan finds a way to the goal; nothing moves by it"] : ["Click the goal on the plan"];
  if (offer.state === "none") return [`${offer.proven ? "Proven: " : ""}${named(offer.why)}`, ...(offer.blockers.length ? [`In the way: ${things(offer.blockers)}`] : [])];
  if (follow?.ended && !follow.arrived && follow.plan === offer.plan) return [`Ended: ${named(follow.ended)}`, "Plan again from here"];
  if (offer.state === "void") return [`Void: ${named(offer.why)}`, "Plan again"];
  if (offer.state === "unknown") return [`Not known: ${named(offer.why)}`];
  if (offer.state === "done") return ["The machine is at its goal"];
  return [...result(offer), holds(state.own) ? "" : controllable(state.own) ? `To follow it, request ${label(state.own)} (R)` : ""].filter(Boolean);
}

const setDisabled = (id, off) => {
  if ($(id).disabled !== off) $(id).disabled = off;
};

function ask() {
  const asked = entered();
  if (asked.wrong || !model.picked()) return;
  model.plan(asked);
  keys();
}

/** Keys go on to the levers. */
const keys = () => $("plan").focus();

export function openTrajectory() {
  if (!model.possible()) return;
  open = true;
  setOpen(true);
  const counted = state.snapshot.stability?.[state.own]?.payload; // what the site says that it carries
  if (!used && Number.isFinite(counted)) $("tj-payload").value = Math.round(counted);
  used = true;
  update();
  redraw();
}

export function closeTrajectory() {
  if (!open) return;
  open = false;
  setOpen(false);
  model.stop();
  update();
  redraw();
}

/** plan: draws the plan view anew; others: closes what else stands in this place. Returns the surfaces of its plots. */
export function startTrajectory(send, plan, others) {
  const chosen = () => {
    update();
    redraw();
  };
  plots = [...surfaces(), startSide(chosen)];
  redraw = () => {
    plan();
    for (const one of plots) one.dirty = true;
  };
  model.startModel(send);
  startDrawing(chosen);
  $("trajectory-open").addEventListener("click", () => {
    if (open) return closeTrajectory();
    others();
    return openTrajectory();
  });
  $("tj-close").addEventListener("click", closeTrajectory);
  $("tj-plan").addEventListener("click", ask);
  $("tj-accept").addEventListener("click", () => {
    model.accept();
    keys();
  });
  $("tj-drop").addEventListener("click", () => {
    model.drop();
    keys();
  });
  $("tj-third").addEventListener("click", () => {
    third = third === "joints" ? "side" : "joints";
    chosen();
  });
  $("tj-pause").addEventListener("click", model.pause);
  $("tj-time").addEventListener("input", () => model.seek(Number($("tj-time").value)));
  for (const name of Object.keys(FIELDS)) {
    $(`tj-${name}`).addEventListener("keydown", (event) => {
      if (event.key === "Enter") ask();
      else if (event.key === "Escape") keys();
    });
  }
  return plots;
}

/** Ten times a second. */
export function update() {
  const possible = model.possible();
  if ($("trajectory-open").hidden === possible) $("trajectory-open").hidden = !possible;
  if (open && !possible) return closeTrajectory();
  model.update(open);
  $("trajectory-open").setAttribute("aria-pressed", String(open));
  $("trajectory").hidden = !open;
  const made = model.document()?.ok === true, drawnThird = made ? third : "side";
  $("tj-plots").hidden = !open;
  mark($("tj-plots"), "only", made ? 0 : 1);
  $("tj-third").hidden = !made;
  write($("tj-third"), drawnThird === "joints" ? "Side" : "Joints");
  write($("tj-third-name"), drawnThird === "joints" ? "Joints" : "Side");
  $("tj-plot-joints").hidden = drawnThird !== "joints";
  $("tj-plot-side").hidden = drawnThird !== "side";
  mark(document.body, "trajectory", open ? 1 : 0);
  if (!open) return undefined;
  const offer = model.offer(), picked = model.picked(), asked = entered();
  setHeight(asked.height ?? 0);
  write($("tj-who"), label(state.own));
  const now = stateWord(model);
  write($("tj-state"), now);
  mark($("trajectory"), "state", now);
  const from = machine(state.own)?.swing_center;
  write($("tj-goal"), picked ? (from ? `${number(Math.hypot(picked[0] - from[0], picked[1] - from[1]), 1)} m away` : "chosen") : "click the plan");
  setDisabled("tj-plan", !model.mayAsk() || !picked || Boolean(asked.wrong) || model.planning() || model.following());
  setDisabled("tj-accept", !model.mayAccept());
  setDisabled("tj-drop", !offer && !model.follow());
  const [first = "", ...others] = lines();
  write($("tj-line"), first);
  $("tj-line").title = first;
  write($("tj-more"), others.join(" · "));
  $("tj-more").title = others.join(" · ");
  const known = model.document()?.ok === true;
  write($("tj-plan-name"), offer?.plan ?? "");
  const watched = ["offered", "unknown"].includes(offer?.state) && Number.isFinite(offer.age);
  for (const node of $("tj-plots").querySelectorAll(".age")) write(node, watched ? seconds(offer.age) : "");
  setDisabled("tj-pause", !known || model.following());
  setDisabled("tj-time", !known || model.following());
  write($("tj-pause"), model.playing() ? "Pause" : "Play");
  const at = model.following() ? model.follow().at : model.time();
  if (known) $("tj-time").max = model.duration();
  if (document.activeElement !== $("tj-time") || model.playing()) $("tj-time").value = at;
  write($("tj-at"), known ? `${number(at, 1)} s` : "");
  const key = `${offer?.plan} ${offer?.state} ${at.toFixed(2)} ${picked} ${asked.height} ${known} ${model.changes()}`;
  if (key !== drawn) redraw();
  drawn = key;
  return undefined;
}
