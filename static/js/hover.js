// One tooltip for all plots: values with units under the pointer; and what is pointed at, for the ghost.

import { $, write } from "./words.js";
import { hovered, pin } from "./ghost.js";

let over = null; // {surface, x, y, clientX, clientY}

export function watch(surface) {
  const { canvas } = surface;
  const move = (event) => {
    const box = canvas.getBoundingClientRect();
    over = { surface, x: event.clientX - box.left, y: event.clientY - box.top, clientX: event.clientX, clientY: event.clientY };
    refresh();
    hovered(surface.aim?.(over.x, over.y) ?? null);
  };
  canvas.addEventListener("click", () => over && pin(surface.aim?.(over.x, over.y) ?? null));
  canvas.addEventListener("pointermove", move);
  canvas.addEventListener("pointerdown", move);
  canvas.addEventListener("pointerleave", hide);
}

export function hide() {
  over = null;
  hovered(null);
  $("hover").hidden = true;
}

/** Also called while the pointer rests, because the values below it change. */
export function refresh() {
  if (!over) return;
  const tip = $("hover");
  const lines = over.surface.probe?.(over.x, over.y);
  if (!lines?.length) {
    tip.hidden = true;
    return;
  }
  write(tip, lines.join("\n"));
  tip.hidden = false;
  const { offsetWidth: w, offsetHeight: h } = tip;
  const x = over.clientX + 18 + w > innerWidth ? over.clientX - 18 - w : over.clientX + 18;
  // Nothing covers the alarm line.
  const alarm = $("alarm").getBoundingClientRect();
  const fits = (at) => at >= 2 && at + h <= innerHeight - 2 && (at + h <= alarm.top || at >= alarm.bottom);
  const below = over.clientY + 18, above = over.clientY - 18 - h;
  const y = [below, above, alarm.top - h, alarm.bottom].find(fits) ?? below;
  tip.style.transform = `translate(${Math.max(2, Math.round(x))}px, ${Math.max(2, Math.round(y))}px)`;
}
