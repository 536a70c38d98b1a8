// Panel headers: subject, machine, age.

import { mark, slowText, write } from "./words.js";
import { seconds } from "./axis.js";

export const ageLevel = (age) => (age > 1 ? "stale" : age > 0.5 ? "old" : "fresh");

/** "0.1 s", or "STALE 1.4 s" when over a second old. */
export function ageText(age) {
  if (!Number.isFinite(age)) return "no data";
  return age > 1 ? `STALE ${seconds(age)}` : seconds(age);
}

export function head(panel) {
  const who = panel.querySelector(".who");
  const age = panel.querySelector(".age");
  const writeAge = age && slowText(age);
  return {
    who: (text) => who && write(who, text),
    age: (value) => {
      const level = ageLevel(value);
      writeAge(ageText(value), level);
      const name = `age ${level}`;
      if (age.className !== name) age.className = name;
      panel.classList.toggle("stale", level === "stale");
      mark(panel, "age", level);
    },
  };
}
