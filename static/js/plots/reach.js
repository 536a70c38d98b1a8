// The reach image: the exact one where there is one, Sun's otherwise.

import { $, write } from "../words.js";
import { surface } from "../surface.js";
import { shown } from "../view.js";
import * as sun from "./reach_sun.js";
import * as exact from "./reach_exact.js";

export function reach() {
  const now = () => (shown() === "sun" ? sun : exact);
  const s = surface($("reach"), (...given) => now().paint(...given), (x, y) => now().probe(x, y), (x, y) => now().aim?.(x, y) ?? null);
  const button = $("reach-mode");
  button.addEventListener("click", () => {
    write(button, sun.turnAxis());
    button.setAttribute("aria-pressed", String(button.textContent !== "±180"));
    s.dirty = true;
    s.last = -Infinity;
  });
  return s;
}
