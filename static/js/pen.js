// Drawing steps that several plots share.

import { C, font, rgba, size } from "./theme.js";

export function clear(g, width, height, colour = C.panel) {
  g.fillStyle = colour;
  g.fillRect(0, 0, width, height);
}

export function label(g, text, x, y, { align = "left", base = "alphabetic", colour = C.second, name = "tick", weight = 400, halo = false } = {}) {
  g.font = font(name, weight);
  g.textAlign = align;
  g.textBaseline = base;
  if (halo) {
    g.lineJoin = "round";
    g.lineWidth = 4;
    g.strokeStyle = C.halo;
    g.strokeText(text, x, y);
  }
  g.fillStyle = colour;
  g.fillText(text, x, y);
}

export function segment(g, x0, y0, x1, y1, colour, width = 1, dash = null) {
  if (dash) g.setLineDash(dash);
  g.lineWidth = width;
  g.strokeStyle = colour;
  g.beginPath();
  g.moveTo(x0, y0);
  g.lineTo(x1, y1);
  g.stroke();
  if (dash) g.setLineDash([]);
}

/** What a plot says when it has nothing to draw. */
export function message(g, width, height, text) {
  label(g, text, width / 2, height / 2, { align: "center", base: "middle", name: "t3" });
}

/** The first of several wordings that fits; the last one cut short when none does. */
export function fit(g, texts, x, y, width, options = {}) {
  g.font = font(options.name ?? "tick", options.weight ?? 400);
  let text = texts.find((one) => g.measureText(one).width <= width);
  if (text === undefined) {
    text = texts[texts.length - 1];
    while (text.length > 1 && g.measureText(`${text}…`).width > width) text = text.slice(0, -1);
    text += "…";
  }
  label(g, text, x, y, options);
  return text;
}

/** A legend in one line: entries [draw(g, x, y, w), text]; drops the last ones that do not fit. */
export function legend(g, x, y, width, entries, gap = 10) {
  g.font = font("tick");
  const swatch = size("tick") + 3;
  let at = x;
  for (const [draw, text] of entries) {
    g.font = font("tick");
    const w = swatch + 4 + g.measureText(text).width;
    if (at + w > x + width + 1) break;
    draw(g, at, y, swatch);
    label(g, text, at + swatch + 4, y, { base: "middle" });
    at += w + gap;
  }
}

/** The least width of a legend of these entries. */
export function legendWidth(g, entries, gap = 10) {
  g.font = font("tick");
  return entries.reduce((sum, [, text]) => sum + size("tick") + 7 + g.measureText(text).width + gap, -gap);
}

export const swatches = {
  line: (colour, dash = null, width = 2) => (g, x, y, w) => segment(g, x, y, x + w, y, colour, width, dash),
  area: (fill, outline) => (g, x, y, w) => {
    g.fillStyle = fill;
    g.fillRect(x, y - w / 2 + 2, w, w - 4);
    g.lineWidth = 1.5;
    g.strokeStyle = outline;
    g.strokeRect(x + 0.75, y - w / 2 + 2.75, w - 1.5, w - 5.5);
  },
  glyph: (draw) => (g, x, y, w) => draw(g, x + w / 2, y),
};

/** PLAYBACK across a picture, outlined so that what is below can be read. */
export function playbackMark(g, box) {
  g.save();
  g.translate((box.left + box.right) / 2, (box.top + box.bottom) / 2);
  g.rotate(-Math.PI / 10);
  g.font = font("t3", 800);
  const k = (0.86 * (box.right - box.left)) / g.measureText("PLAYBACK").width;
  g.scale(k, k);
  g.textAlign = "center";
  g.textBaseline = "middle";
  g.lineWidth = 1.6 / k;
  g.strokeStyle = rgba(C.playbackLine, 0.4);
  g.strokeText("PLAYBACK", 0, 0);
  g.restore();
}
