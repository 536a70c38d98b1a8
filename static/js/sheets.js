// Panels over the scene that the transport opens: compare, export, session. One at a time.

import { $, make } from "./words.js";
import { number } from "./axis.js";
import { clock, day, wallClock } from "./clock.js";
import { label as nameOf, replaying } from "./state.js";
import { playback } from "./player.js";
import { note, problems, session, title } from "./session.js";
import { busy, formats, startExport } from "./report.js";
import { compareKey, compareSheet } from "./difference.js";

let open = null;
let built = "";

const NAMES = ["compare", "export", "session"];

export function toggle(name) {
  open = open === name ? null : name;
  built = "";
  update();
}

export function close() {
  open = null;
  update();
}

const heading = (text) => {
  const button = make("button", { type: "button", text: "×", "aria-label": "Close (Esc)", title: "Close (Esc)" });
  button.addEventListener("click", close);
  return make("h3", { text }, button);
};

function exportSheet() {
  const buttons = formats.map(([format, word]) => {
    const button = make("button", { type: "button", text: word, "data-format": format, ...(busy() ? { disabled: "" } : {}) });
    button.addEventListener("click", () => startExport(format));
    return button;
  });
  return [heading("Export"), make("div", { class: "choices" }, ...buttons), make("p", { class: "dim", text: "CSV and Parquet: poses, distances, levels as tables. MCAP: for Foxglove, PlotJuggler, ros2 bag." })];
}

function sessionSheet() {
  const d = session.document;
  const p = playback();
  const rows = [
    ["Title", title()],
    ["Recorded", d ? `${day(d.begin)} ${wallClock(d.begin)}, ${clock(d.duration)} long` : clock(p?.duration)],
    ["Machines", (d?.machines ?? []).map(nameOf).join(", ")],
    ["Origin", d?.origin],
    ["Note", note()],
    ["Files", d?.parts ? String(d.parts.length) : ""],
    ["Messages", d?.topics ? `${number(Object.values(d.topics).reduce((sum, t) => sum + (t.count ?? 0), 0), 0)} on ${Object.keys(d.topics).length} topics` : ""],
    ["Events", d?.events ? String(d.events.length) : ""],
    ["Index", d?.index?.state === "failed" ? "failed: events and curves are not complete" : d?.index?.state === "building" ? `${number(100 * d.index.progress, 0)} %: events and curves are not complete yet` : ""],
  ].filter(([, text]) => text);
  const bad = problems();
  return [
    heading("Session"),
    make("dl", {}, ...rows.flatMap(([name, text]) => [make("dt", { text: name }), make("dd", { text })])),
    make("h4", { text: bad.length ? "What could not be read or shown" : "Everything could be read." }),
    ...(bad.length ? [make("ul", {}, ...bad.slice(0, 12).map((text) => make("li", { class: "problem", text })), ...(bad.length > 12 ? [make("li", { text: `and ${bad.length - 12} more` })] : []))] : []),
  ];
}

/** Ten times a second; builds anew only what changed. */
export function update() {
  const shown = replaying() ? open : null;
  for (const name of NAMES) {
    $(`sheet-${name}`).hidden = name !== shown;
    $(`t-${name}`).setAttribute("aria-expanded", String(name === shown));
  }
  if (!shown) return;
  const key = shown === "compare" ? compareKey() : shown === "export" ? String(busy()) : JSON.stringify([session.document, problems(), note()]);
  if (key === built) return;
  built = key;
  const content = shown === "compare" ? [heading("As it was ↔ judged now"), ...compareSheet()] : shown === "export" ? exportSheet() : sessionSheet();
  $(`sheet-${shown}`).replaceChildren(...content);
}
