// Panel headers: subject, machine, age.

import { mark, slowText, write } from "./words.js";
import { seconds } from "./axis.js";

export const ageLevel = (age) => (age > 1 ? "stale" : age > 0.5 ? "old" : "fresh");

export const staleText = (age) => (Number.isFinite(age) ? `STALE ${seconds(age)}` : "STALE");

/** "0.1 s", or "STALE 1.4 s" when over a second old. */
export function ageText(age) {
  if (!Number.isFinite(age)) return "no data";
  return age > 1 ? staleText(age) : seconds(age);
}

const brief = (panel) => panel.clientWidth < 300 || panel.clientHeight < 60 || panel.dataset.exact === "1";

export function head(panel) {
  const who = panel.querySelector(".who");
  const age = panel.querySelector(".age");
  const writeAge = age && slowText(age);
  return {
    who: (text) => who && write(who, text),
    // A panel too small or too full for the word STALE has it on its canvas; the number stays in the header.
    age: (value, forced = false) => {
      const level = forced ? "stale" : ageLevel(value);
      const full = forced ? staleText(value) : ageText(value);
      const text = brief(panel) && Number.isFinite(value) ? seconds(value) : full;
      writeAge(text, level);
      const name = `age ${level}`;
      if (age.className !== name) age.className = name;
      panel.classList.toggle("stale", level === "stale");
      mark(panel, "age", level);
    },
  };
}
