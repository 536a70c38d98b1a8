// Shapes that carry meaning without colour: star, base cross, level shapes for SVG and canvas.

import { C } from "./theme.js";

function starPath(g, x, y, r) {
  g.beginPath();
  for (let i = 0; i < 10; i++) {
    const a = -Math.PI / 2 + (i * Math.PI) / 5;
    const k = i % 2 ? 0.42 * r : r;
    g.lineTo(x + k * Math.cos(a), y + k * Math.sin(a));
  }
  g.closePath();
}

/** White with a black outline, 20 px; hollow when what it marks is stale. */
export function star(g, x, y, hollow, r = 11) {
  g.lineJoin = "round";
  starPath(g, x, y, r);
  g.lineWidth = hollow ? 5 : 4;
  g.strokeStyle = "#000000";
  g.stroke();
  if (hollow) {
    g.lineWidth = 1.6;
    g.strokeStyle = "#FFFFFF";
    g.stroke();
  } else {
    g.fillStyle = "#FFFFFF";
    g.fill();
  }
}

/** Where a configuration is pinned. */
export function ring(g, x, y, r) {
  for (const [width, style] of [[5, "#000000"], [2, "#FFFFFF"]]) {
    g.lineWidth = width;
    g.strokeStyle = style;
    g.beginPath();
    g.arc(x, y, r, 0, 2 * Math.PI);
    g.stroke();
  }
}

/** The base point, as a cross. */
export function cross(g, x, y, colour, r = 7) {
  for (const [width, style] of [[6, C.halo], [3, colour]]) {
    g.lineWidth = width;
    g.strokeStyle = style;
    g.beginPath();
    g.moveTo(x - r, y); g.lineTo(x + r, y);
    g.moveTo(x, y - r); g.lineTo(x, y + r);
    g.stroke();
  }
}

const SVG = "http://www.w3.org/2000/svg";
const svg = (tag, attributes) => {
  const node = document.createElementNS(SVG, tag);
  for (const [name, value] of Object.entries(attributes)) node.setAttribute(name, value);
  return node;
};
const question = (fill) => {
  const text = svg("text", { x: 24, y: 35, "text-anchor": "middle", "font-size": 32, "font-weight": 700, "font-family": "Arial, sans-serif", fill });
  text.textContent = "?";
  return text;
};
const octagonPoints = (r) => Array.from({ length: 8 }, (_, i) => {
  const a = Math.PI / 8 + (i * Math.PI) / 4;
  return `${(24 + r * Math.cos(a)).toFixed(1)},${(24 + r * Math.sin(a)).toFixed(1)}`;
}).join(" ");

/** The alarm line's shape: triangle, octagon, dashed question mark; nothing when calm. */
export function levelShape(level) {
  if (level === "SLOW") {
    return [svg("path", { d: "M24 4 46 43H2Z", fill: "#14100A" }), svg("path", { d: "M22 17h4v13h-4zM22 34h4v4h-4z", fill: C.slow })];
  }
  if (level === "STOP") {
    return [svg("polygon", { points: octagonPoints(23), fill: "#FFFFFF" }), svg("polygon", { points: octagonPoints(19.5), fill: C.stop }), svg("path", { d: "M12 21h24v6H12z", fill: "#FFFFFF" })];
  }
  if (level === "UNKNOWN") {
    return [svg("circle", { cx: 24, cy: 24, r: 21, fill: "none", stroke: C.unknown, "stroke-width": 4, "stroke-dasharray": "8 5" }), question("#FFC9C3")];
  }
  if (level === "NOTICE") {
    return [svg("circle", { cx: 24, cy: 24, r: 20, fill: "none", stroke: C.text, "stroke-width": 3 }), svg("path", { d: "M22 21h4v14h-4zM22 12h4v5h-4z", fill: C.text })];
  }
  return [];
}

const letter = (text) => {
  const node = svg("text", { x: 24, y: 34, "text-anchor": "middle", "font-size": 28, "font-weight": 700, "font-family": "Arial, sans-serif", fill: "#0B0F13" });
  node.textContent = text;
  return node;
};
const manual = () => [svg("circle", { cx: 24, cy: 24, r: 21, fill: "#2BB673" }), letter("M")];
const remote = () => [svg("rect", { x: 3, y: 3, width: 42, height: 42, fill: "#4C9BFF" }), letter("R")];
const bars = (fill) => svg("path", { d: "M13 9h8v30h-8zM27 9h8v30h-8z", fill });

/** State of a console: each its own shape. */
export function consoleShape(word) {
  const ring = (dash = "none") => svg("circle", { cx: 24, cy: 24, r: 18, fill: "none", stroke: C.second, "stroke-width": 5, "stroke-dasharray": dash });
  if (word === "Stop") return levelShape("STOP");
  if (word === "Pause") return [bars(C.text)];
  if (word === "Active") return remote();
  if (word === "Enabled") return [svg("rect", { x: 5, y: 5, width: 38, height: 38, fill: "none", stroke: "#4C9BFF", "stroke-width": 6 })];
  if (word === "Override") return [svg("rect", { x: 3, y: 3, width: 42, height: 42, fill: C.stop, stroke: "#FFFFFF", "stroke-width": 3 }), svg("path", { d: "M21 10h6v18h-6zM21 32h6v6h-6z", fill: "#FFFFFF" })];
  return [ring(word === "Idle" ? "none" : "6 6")];
}

/** Delay of a link: disc, triangle, bar, ?. */
export function delayShape(level) {
  if (level === "ok") return [svg("circle", { cx: 24, cy: 24, r: 16, fill: "#2BB673" })];
  if (level === "slow") return [svg("path", { d: "M24 6 44 41H4Z", fill: C.slow })];
  if (level === "bad" || level === "locked") return [svg("path", { d: "M6 15h36v18H6z", fill: level === "locked" ? C.stop : "none", stroke: C.stopLine, "stroke-width": 5 })];
  return [question(C.unknown)];
}

/** Lamp of a machine: disc = valid, dotted hollow ring = stale, ? = unknown; `driven` M (manual), R (remote) or STOP, where it can be driven. */
export function lampShape(validity, level, driven = "") {
  if (validity === "VALID") {
    if (driven === "STOP" || level === "STOP") return [svg("polygon", { points: octagonPoints(23), fill: C.stop, stroke: "#FFFFFF", "stroke-width": 3 })];
    if (level === "SLOW") return [svg("path", { d: "M24 4 46 43H2Z", fill: C.slow })];
    if (driven) return driven === "M" ? manual() : remote();
    return [svg("circle", { cx: 24, cy: 24, r: 15, fill: "#C8D0D6" })];
  }
  if (validity === "STALE") return [svg("circle", { cx: 24, cy: 24, r: 18, fill: "none", stroke: C.stale, "stroke-width": 6, "stroke-dasharray": "5 6" })];
  return [svg("circle", { cx: 24, cy: 24, r: 21, fill: "none", stroke: C.unknown, "stroke-width": 4, "stroke-dasharray": "8 5" }), question(C.unknown)];
}

/** The outline of STOP: not now, but it would be. */
export function octagon(g, x, y, r) {
  g.beginPath();
  for (let i = 0; i < 8; i++) g.lineTo(x + r * Math.cos(Math.PI / 8 + (i * Math.PI) / 4), y + r * Math.sin(Math.PI / 8 + (i * Math.PI) / 4));
  g.closePath();
  for (const [width, style] of [[4, C.halo], [1.5, C.stopLine]]) {
    g.lineWidth = width;
    g.strokeStyle = style;
    g.stroke();
  }
}

/** The same shapes, small, on a canvas. */
export function levelMark(g, level, x, y, r) {
  g.beginPath();
  if (level === "SLOW") {
    g.moveTo(x, y - r); g.lineTo(x + r, y + 0.8 * r); g.lineTo(x - r, y + 0.8 * r); g.closePath();
    g.fillStyle = C.slow;
    g.fill();
  } else if (level === "STOP") {
    for (let i = 0; i < 8; i++) g.lineTo(x + r * Math.cos(Math.PI / 8 + (i * Math.PI) / 4), y + r * Math.sin(Math.PI / 8 + (i * Math.PI) / 4));
    g.closePath();
    g.fillStyle = C.stop;
    g.fill();
    g.lineWidth = 1.5;
    g.strokeStyle = "#FFFFFF";
    g.stroke();
  } else {
    g.arc(x, y, r, 0, 2 * Math.PI);
    g.setLineDash([3, 2]);
    g.lineWidth = 1.5;
    g.strokeStyle = C.unknown;
    g.stroke();
    g.setLineDash([]);
    g.fillStyle = C.unknown;
    g.font = `700 ${Math.round(1.7 * r)}px Arial, sans-serif`;
    g.textAlign = "center";
    g.textBaseline = "middle";
    g.fillText("?", x, y + 0.5);
  }
}
