// The alarm line and the list behind "+2". Its height never changes; stale data never read CLEAR.

import { $, make, mark, partName, slowText, steady, write } from "./words.js";
import { metres, seconds } from "./axis.js";
import { alarms, atLeast, label, link, machine, notices, pair, replaying, severity, silence, snapshotAge, state, wall } from "./state.js";
import { levelShape } from "./glyphs.js";
import { wallClock } from "./clock.js";
import { unknown as peopleUnknown } from "./people/model.js";
import { acknowledge, acknowledged, sound } from "./sound.js";
import { ageLevel, ageText } from "./head.js";
import * as history from "./alarm_history.js";

const SMALLEST = 0.7; // of the usual letters
let line, detail, age;
let shape = null;
let listOpen = false;
let listKey = "";
const calmDistance = steady(0.06);

/** A notice speaks where all is calm, above the distance; it never takes the place of an alarm. */
function compose() {
  const now = judge();
  const [first, ...more] = notices();
  if (!first) return now;
  if (now.level !== "CLEAR") return { ...now, more: (now.more ?? 0) + 1 + more.length };
  return { level: "NOTICE", line: first.line, detail: now.line, key: `${first.key} ${first.line.replace(/[\d.]+/g, "")}`, more: more.length };
}

/** The line's level, words and key; the key changes when the digits must not wait. */
function judge() {
  const s = state.snapshot;
  const state_ = link();
  if (!s) return { level: "NONE", line: state_ === "connecting" ? "Connecting to the backend" : "Waiting for data", detail: "", key: "none" };
  if (state_ === "lost") {
    const detail = replaying() ? "The player does not answer, or is still at work on what was asked. Nothing here moves on." : "Nothing on this page is current. Clearance unknown. Reconnecting.";
    return { level: "UNKNOWN", line: `LINK LOST · last data ${seconds(silence())} ago`, detail, key: "lost" };
  }
  const [first, ...more] = alarms();
  if (first) {
    return { level: first.level, line: first.line.startsWith(first.level) ? first.line : `${first.level} · ${first.line}`, detail: first.detail ?? "", key: `${first.level} ${first.name} ${first.machine} ${first.line.replace(/[\d.]+/g, "")}`, alarm: first, more: more.length };
  }
  const p = pair(state.own, state.partner);
  const invalid = [state.own, state.partner].find((name) => name && machine(name)?.validity !== "VALID");
  if (invalid || (p && atLeast(p) === null)) {
    const why = p?.reason || machine(invalid)?.reasons?.[0] || "no complete pose";
    return { level: "UNKNOWN", line: `UNKNOWN · ${label(state.own)} ↔ ${label(state.partner)}`, detail: `Clearance unknown: ${why}.`, key: "unknown" };
  }
  // Whoever does not know where people are must not say that all is clear.
  const blind = peopleUnknown();
  if (blind) return { level: "UNKNOWN", line: `UNKNOWN · people near ${label(state.own)}`, detail: `Where people are is not known: ${blind}.`, key: "people unknown" };
  if (!p) return { level: "CLEAR", line: `CLEAR · ${label(state.own)} · no other machine`, detail: "", key: "alone" };
  if (p.distance === null) {
    return { level: "CLEAR", line: `CLEAR · ${label(p.a)} ↔ ${label(p.b)} · over ${metres(calmDistance(p.at_least))}`, detail: "", key: "far" };
  }
  const distance = calmDistance(p.distance);
  return { level: "CLEAR", line: `CLEAR · ${label(p.a)} ${partName(p.body_a)} ↔ ${label(p.b)} ${partName(p.body_b)} · ${metres(distance)}`, detail: "", key: `clear ${p.body_a} ${p.body_b}` };
}

/** What is blocked and what is free must be read to its end: in shorter words, then in smaller ones. */
function fitted(text) {
  const room = $("alarm-words").clientWidth - 2;
  return wide(text) <= room ? text : text.replaceAll(" limited to ", " ≤ ");
}

function fit() {
  const node = $("alarm-detail"), room = $("alarm-words").clientWidth - 2;
  const scale = Math.max(SMALLEST, Math.min(1, room / Math.max(wide(node.textContent), 1)));
  mark(node, "scale", scale < 1 ? scale.toFixed(2) : "");
  const size = scale < 1 ? `${(scale * parseFloat(getComputedStyle($("alarm")).fontSize)).toFixed(1)}px` : "";
  if (node.style.fontSize !== size) node.style.fontSize = size;
}

/** Of a text in the alarm's letters [px]. */
function wide(text) {
  const g = (wide.g ??= document.createElement("canvas").getContext("2d"));
  const { fontSize, fontWeight, fontFamily } = getComputedStyle($("alarm"));
  g.font = `${fontWeight} ${fontSize} ${fontFamily}`;
  return g.measureText(text).width;
}

let send = () => {};

/** give: sends a message to the server. */
export function startAlarm(give) {
  send = give;
  line = slowText($("alarm-line"));
  detail = slowText($("alarm-detail"));
  age = slowText($("alarm-age"));
  $("alarm-ack").addEventListener("click", silenceAlarms);
  for (const id of ["alarm-more", "alarm-words"]) $(id).addEventListener("click", () => showList(!listOpen));
}

export function silenceAlarms() {
  for (const { name, machine } of alarms().filter((alarm) => !acknowledged(alarm))) if (!replaying()) send({ type: "silence", name, machine });
  acknowledge(alarms());
  update();
}

export function showList(open) {
  listOpen = open;
  $("alarm-list").hidden = !listOpen;
  $("alarm-more").setAttribute("aria-expanded", String(listOpen));
  listKey = "";
  list();
}

export function update() {
  const now = compose();
  const box = $("alarm");
  if (box.dataset.level !== now.level) line(now.line, `${now.key} now`);
  mark(box, "level", now.level);
  line(now.line, now.key);
  detail(fitted(now.detail), now.key);
  fit();
  const howOld = snapshotAge();
  age(Number.isFinite(howOld) ? ageText(howOld) : "", ageLevel(howOld));
  if (shape !== now.level) {
    shape = now.level;
    $("alarm-glyph").replaceChildren(...levelShape(now.level));
  }
  const present = alarms();
  const unseen = present.some((alarm) => !acknowledged(alarm));
  mark(box, "unseen", unseen && severity[now.level] > 0 ? 1 : 0);
  $("alarm-ack").hidden = !unseen || link() === "lost";
  const more = $("alarm-more");
  // Calm, there is room for it; an alarm needs the line, which opens the list, too.
  more.hidden = !(now.more > 0) && (now.level !== "CLEAR" || !state.snapshot || replaying());
  write(more, now.more > 0 ? `+${now.more}` : "List");
  more.title = "All alarms and notices, and those that ended";
  const p = pair(state.own, state.partner);
  sound(present, (p?.approach ?? 0) > 0);
  list();
}

function list() {
  if (!listOpen) return;
  const s = state.snapshot;
  const present = alarms();
  const told = notices();
  history.refresh();
  const key = [...[...present, ...told].map((a) => a.line), history.historyKey()].join("|");
  if (key === listKey) return;
  listKey = key;
  const items = present.map((a) => {
    const since = wallClock(wall() - (s.time - a.since));
    return make("li", {}, make("b", { "data-level": a.level, text: a.level }), make("span", { text: a.line.replace(/^[A-Z]+ · /, "") }), make("span", { class: "dim", text: `since ${since}` }), make("small", { text: a.detail ?? "" }));
  });
  const said = told.map((n) => make("li", {}, make("b", { "data-level": "NOTICE", text: "NOTICE" }), make("span", { text: n.line }), make("span", { class: "dim", text: Number.isFinite(n.since) ? `since ${wallClock(wall() - (s.time - n.since))}` : "" })));
  const past = replaying() ? [] : history.items();
  const nothing = items.length + said.length + past.length ? [] : [make("li", {}, make("span", {}), make("span", { text: "No alarm so far." }))];
  $("alarm-list").replaceChildren(make("ul", {}, ...items, ...said, ...past, ...nothing));
}

/** Of the machine itself: who drives it is no danger it is in. */
export const worst = (name) => alarms().filter((a) => a.machine === name && !state.raised.includes(a)).reduce((level, a) => (severity[a.level] > severity[level] ? a.level : level), "CLEAR");
