// The mapping of each operator, kept in this browser. What is stored and not whole gives way to the default.

import { checked, standard } from "./mapping.js";

const key = (who) => `drive mapping ${who}`;

let who = null, stored = null;
export let complaint = ""; // why what was stored is not used

export function load(operator) {
  if (operator === who) return;
  who = operator;
  stored = null;
  complaint = "";
  let text = null;
  try {
    text = localStorage.getItem(key(who));
    if (text !== null) stored = checked(JSON.parse(text));
  } catch {
    // told below
  }
  if (text !== null && !stored) complaint = "The stored mapping cannot be read: the default is used.";
}

export const mapping = (slots) => stored ?? standard(slots);
export const own = () => stored !== null;

export function save(changed) {
  stored = checked(changed) ?? stored;
  try {
    localStorage.setItem(key(who), JSON.stringify(stored));
    complaint = "";
  } catch {
    complaint = "This browser keeps nothing: the mapping ends with the page.";
  }
}

export function reset() {
  stored = null;
  complaint = "";
  try {
    localStorage.removeItem(key(who));
  } catch {
    // nothing was kept then
  }
}
