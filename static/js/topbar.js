// Mode, site, one button per machine, backend, link.

import { $, glyph, make, mark, slowText, write } from "./words.js";
import { number, seconds } from "./axis.js";
import { dataAge, label, link, machine, mode as modeOf, names, replaying, silence, state } from "./state.js";
import { soundFor } from "./sound.js";
import { worst } from "./alarm.js";
import { consoleOf, driving, remote } from "./drive/driving.js";
import { delayShape, lampShape } from "./glyphs.js";

const FIX = { RTK_FIXED: "RTK fixed", RTK_FLOAT: "RTK float", FIXED: "RTK fixed", FLOAT: "RTK float", DGNSS: "DGNSS", SINGLE: "single fix", NONE: "no fix" };

let built = "";
const machines = new Map();
let cycle, rate, linkAge, own;

export function startTopbar(chooseOwn) {
  own = chooseOwn;
  cycle = slowText($("cycle"));
  rate = slowText($("rate"));
  linkAge = slowText($("link-age"));
}

function build() {
  const key = names().map((name) => `${name}:${label(name)}`).join(" ");
  if (key === built) return;
  built = key;
  machines.clear();
  const many = names().length > 2;
  mark($("machines"), "many", many ? 1 : 0);
  $("machines").replaceChildren(...names().map((name, index) => {
    const lamp = glyph("lamp"), delay = glyph("delay");
    const word = make("span", { class: "word" });
    const extra = make("span", { class: "extra dim" });
    const numbers = make("span", { class: "numbers dim" });
    const holder = make("span", { class: "holder" }), trip = make("span", { class: "trip" });
    const button = make("button", { type: "button", class: "machine" },
      lamp, make("span", { class: "name", text: label(name) }), make("span", { class: "key", text: String(index + 1) }),
      make("span", { class: "pair" }, make("span", {}, word, extra), numbers, make("span", { class: "drive", hidden: "" }, holder, delay, trip)));
    button.addEventListener("click", () => own(name));
    machines.set(name, { button, lamp, word, extra, numbers: slowText(numbers), holder, delay, trip: slowText(trip), shape: "", level: "" });
    return button;
  }));
}

/** Who drives it remotely, how far away they are, and its lamp; nothing where it cannot be driven. */
function driven(name, parts) {
  const r = remote(name);
  const can = r?.agent === true;
  const line = parts.holder.parentElement;
  line.hidden = !can;
  parts.button.querySelector(".numbers").hidden = can;
  mark(parts.button, "active", can && consoleOf(name)?.state === "Active" && worst(name) === "CLEAR" ? 1 : 0);
  if (!can) return "";
  const who = r.holder ? `R ${r.holder.length > 7 ? `${r.holder.slice(0, 6)}…` : r.holder}` : "M manual";
  write(parts.holder, who);
  const level = r.level ?? "unknown";
  mark(parts.button, "delay", level);
  parts.trip(Number.isFinite(r.round_trip) ? `${number(1000 * r.round_trip, 0)} ms` : "–", level);
  if (parts.level !== level) {
    parts.level = level;
    parts.delay.replaceChildren(...delayShape(level));
  }
  return consoleOf(name)?.state === "Stop" ? "STOP" : r.holder ? "R" : "M";
}

function fixWord(fix) {
  if (fix === null || fix === undefined) return "no fix";
  return FIX[String(fix).toUpperCase()] ?? String(fix).replace(/_/g, " ");
}

export function update() {
  const s = state.snapshot;
  const how = link();
  mark(document.body, "link", how);
  mark($("link"), "link", how);
  write($("link-word"), { ok: "LINK OK", slow: "▲ LINK", lost: "LINK LOST", connecting: "connecting" }[how]);
  const delay = state.delays.length ? Math.max(0, state.delays[state.delays.length - 1]) : NaN;
  if (how === "ok") linkAge(Number.isFinite(delay) && delay < 10 ? `${number(delay * 1000, 0)} ms` : "clock differs", how);
  else linkAge(s ? `${seconds(silence())} ago` : "", how);
  if (state.site) {
    write($("site-title"), state.site.title ?? state.site.name);
    const epsg = state.site.frame?.epsg ? `EPSG:${state.site.frame.epsg}` : "";
    write($("site-name"), state.snapshot?.playback?.title || [state.site.name, epsg].filter(Boolean).join(" · "));
  }
  if (!s) return;
  const mode = modeOf();
  write($("mode"), mode);
  const monitoring = replaying() ? "A recorded session. Nothing on this page reaches a machine." : "Monitoring only: no machine control from this page yet.";
  write($("stop-word"), replaying() ? "Recorded: no machine" : "Monitoring only, no control");
  $("stop-place").title = driving() ? "" : `${monitoring} This operator aid is not a safety-rated stop.`;
  mark($("mode"), "mode", mode);
  const ms = s.backend?.cycle_ms ?? s.backend?.step;
  const hz = s.backend?.rate_hz ?? s.backend?.step?.rate;
  cycle(Number.isFinite(ms?.p95) ? `cycle ${number(ms.p95, ms.p95 < 100 ? 1 : 0)} ms` : "cycle –");
  rate(Number.isFinite(hz) ? `p95 · ${number(hz, 0)} Hz` : "");
  $("link").title = $("backend").checkVisibility() ? "" : `${$("cycle").textContent} ${$("rate").textContent}`;
  soundFor(mode);
  build();
  for (const [name, parts] of machines) {
    const m = machine(name);
    if (!m) continue;
    const validity = how === "lost" ? "STALE" : m.validity;
    mark(parts.button, "validity", validity);
    parts.button.setAttribute("aria-pressed", String(name === state.own));
    const level = worst(name);
    const lamp = driven(name, parts);
    if (parts.shape !== validity + level + lamp) {
      parts.shape = validity + level + lamp;
      parts.lamp.replaceChildren(...lampShape(validity, level, lamp));
    }
    write(parts.word, validity);
    write(parts.extra, ` ${fixWord(m.fix)}`);
    const age = dataAge(name);
    const hz = m.rates?.joints;
    const text = Number.isFinite(age) ? `${number(age, 2)} s` : "no data";
    parts.numbers(machines.size > 2 ? text : `${text} · ${Number.isFinite(hz) ? `${number(hz, 0)} Hz` : "– Hz"}`, validity);
    const r = remote(name);
    const drive = lamp ? `, ${r.holder ? `driven remotely by ${r.holder}` : "driven manually"}${lamp === "STOP" ? ", stopped" : ""}` : "";
    parts.button.setAttribute("aria-label", `${label(name)}, ${validity}, ${fixWord(m.fix)}${drive}`);
    parts.button.title = `Own machine: ${label(name)} (key ${names().indexOf(name) + 1})${lamp ? `${drive}; data ${text}${r.locked ? `; locked: ${r.locked}` : ""}` : ""}`;
  }
}
