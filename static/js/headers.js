// What stands in the panels' headers besides subject, machine and age: the switch, the tip, words on motion and regions.

import { $, mark, slowText, write } from "./words.js";
import { state } from "./state.js";
import { WORDS, shown, switchable } from "./view.js";
import { motion, regionTexts } from "./margins.js";

let switches = [];
let motionText, regionText;

export function startHeaders(switchImages) {
  switches = [...document.querySelectorAll("button.switch")];
  for (const button of switches) {
    button.title = "Exact images, Sun's, or the difference (X)";
    button.addEventListener("click", switchImages);
  }
  motionText = slowText($("motion"));
  regionText = slowText($("regions"));
}

/** The fullest wording that the place in the header has room for. */
export function widest(place, texts, given = null) {
  const panel = place.closest(".panel");
  const others = [...panel.querySelectorAll("header > *")].filter((node) => node !== place).reduce((sum, node) => sum + node.getBoundingClientRect().width + 8, 0);
  const room = given ?? panel.clientWidth - others - 80; // the age can grow by a glyph and digits meanwhile
  const g = (widest.g ??= document.createElement("canvas").getContext("2d"));
  const style = getComputedStyle(place);
  g.font = `${style.fontWeight} ${style.fontSize} ${style.fontFamily}`;
  return texts.find((text) => g.measureText(text).width + 2 <= room) ?? "";
}

export function update() {
  const how = shown();
  const exact = how !== "sun";
  for (const button of switches) {
    button.hidden = !switchable();
    const slice = button.closest("#slices") !== null;
    write(button, slice && how === "exact" ? "slice" : WORDS[how]);
    mark(button, "shown", how);
  }
  for (const id of ["tip-down", "tip-now", "tip-up"]) $(id).hidden = !exact;
  $("reach-mode").hidden = exact;
  mark($("reach-panel"), "exact", exact ? 1 : 0);
  const texts = regionTexts();
  const m = motion(state.own);
  motionText(m ? widest($("motion"), [m.text, m.text.replace("on this motion ", "")]) : "", m?.known);
  if (texts.length) $("regions").title = texts[0];
  mark($("motion"), "seconds", m?.seconds ?? "");
  mark($("motion"), "known", m ? m.known : "");
  regionText(widest($("regions"), texts), `${state.own} ${texts.length}`);
}
