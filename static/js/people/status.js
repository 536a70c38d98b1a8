// Whether people are seen, in the header of the scene: never silent while the site has a LiDAR.

import { $, glyph, slowText } from "../words.js";
import { seconds } from "../axis.js";
import { lampShape } from "../glyphs.js";
import { widest } from "../headers.js";
import { ALARM, age, insideWords, lost, people, tracks, unknown, worst } from "./model.js";

const MOST = 3; // who is in working areas, in words

let words, shape = "";

export function startStatus() {
  words = slowText($("people-words"));
  $("people-lamp").replaceWith(Object.assign(glyph("lamp"), { id: "people-lamp" }));
}

/** From the fullest wording to the shortest. */
function texts() {
  const why = unknown();
  if (why) return [`People: unknown, ${why}`, "People: unknown", "unknown"];
  const seen = tracks().filter(({ status }) => status !== "tentative");
  const persons = seen.filter(({ kind }) => kind === "person").length;
  const more = [[seen.length - persons, "object"], [lost().length, "lost"]].filter(([n]) => n);
  const rest = more.map(([n, word]) => `, ${n} ${word}${word === "object" && n > 1 ? "s" : ""}`).join("");
  const all = insideWords(), areas = all.slice(0, MOST).map((words) => `; ${words}`).join("") + (all.length > MOST ? `; +${all.length - MOST}` : "");
  const full = `People: ${persons} seen${rest}, ${seconds(age())} old`;
  return [...(areas ? [full + areas] : []), full, `People: ${persons} seen, ${seconds(age())} old`, `People: ${persons} seen`, `P ${persons}`];
}

/** Up to what stands to the right of the words [px]; its age can grow by a glyph. */
function room() {
  const place = $("people-words");
  let next = place.nextElementSibling;
  while (next && !next.getBoundingClientRect().width) next = next.nextElementSibling;
  return (next ?? place.parentElement).getBoundingClientRect()[next ? "left" : "right"] - place.getBoundingClientRect().left - 36;
}

export function update() {
  const known = people() !== null;
  for (const id of ["people-lamp", "people-words"]) $(id).toggleAttribute("hidden", !known);
  if (!known) return;
  const all = texts();
  const level = unknown() ? "UNKNOWN" : worst();
  words(widest($("people-words"), all, room()) || all[all.length - 1], `${level} ${all[0].replace(/[\d.]+ s\b/g, "")}`);
  $("people-words").title = all[0];
  if ($("people-words").dataset.level !== level) $("people-words").dataset.level = level;
  if (level === shape) return;
  shape = level;
  $("people-lamp").replaceChildren(...lampShape(level === "UNKNOWN" ? "UNKNOWN" : "VALID", ALARM[level] ?? ""));
}
