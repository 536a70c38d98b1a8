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
  const y = over.clientY + 18 + h > innerHeight ? over.clientY - 18 - h : over.clientY + 18;
  tip.style.transform = `translate(${Math.max(2, Math.round(x))}px, ${Math.max(2, Math.round(y))}px)`;
}
