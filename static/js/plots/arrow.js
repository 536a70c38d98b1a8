// The arrow of a direction. Outline: free. Half filled amber: limited. Red bar: blocked.

import { C } from "../theme.js";

export const isBlocked = (allowed) => !(allowed > 0.005);
export const isFree = (allowed) => allowed >= 0.995;

export const percent = (allowed) => `${Math.round(100 * allowed)} %`;
export const shareText = (allowed) => (isFree(allowed) ? "free" : isBlocked(allowed) ? "blocked" : `${percent(allowed)} of full speed`);

const TURN = { right: 0, down: 0.5, left: 1, up: 1.5 };

/** `w` along the direction, `h` across, about the centre (x, y). */
export function arrow(g, x, y, w, h, direction, allowed) {
  g.save();
  g.translate(x, y);
  g.rotate(TURN[direction] * Math.PI);
  g.lineWidth = 1.5;
  if (isBlocked(allowed)) {
    g.fillStyle = C.stop;
    g.fillRect(-w / 2, -h * 0.34, w, h * 0.68);
    g.strokeStyle = "#FFFFFF";
    g.strokeRect(0.75 - w / 2, 0.75 - h * 0.34, w - 1.5, h * 0.68 - 1.5);
    g.restore();
    return;
  }
  const tip = w / 2, neck = 0.05 * w;
  const path = new Path2D();
  path.moveTo(tip, 0);
  path.lineTo(neck, -h / 2);
  path.lineTo(neck, -h / 5);
  path.lineTo(-tip, -h / 5);
  path.lineTo(-tip, h / 5);
  path.lineTo(neck, h / 5);
  path.lineTo(neck, h / 2);
  path.closePath();
  const limited = !isFree(allowed);
  if (limited) {
    g.save();
    g.beginPath();
    g.rect(-tip, -h, tip, 2 * h);
    g.clip();
    g.fillStyle = C.slow;
    g.fill(path);
    g.restore();
  }
  g.strokeStyle = limited ? C.slow : C.second;
  g.stroke(path);
  g.restore();
}
