// A projection of CO_theta^3 (Sun 2020, Eq. (27)): boom-stick, boom-bucket or stick-bucket.

import { C, hatch, size } from "../theme.js";
import { DEGREE_STEPS, deg, degrees, scale, ticks } from "../axis.js";
import { clear, label, legend, message, segment, swatches } from "../pen.js";
import { fillMesh, paintMask } from "../mesh.js";
import { star } from "../glyphs.js";
import { described, image, imageAge, imageStale, label as nameOf, noImage, state, sunMap } from "../state.js";
import { ageText } from "../head.js";

export const PAIRS = [["boom", "stick"], ["boom", "bucket"], ["stick", "bucket"]];
const MARGIN = (5 * Math.PI) / 180;
const SUPERSAMPLE = 2; // mask pixels per device pixel, for smooth edges

/** A joint's limits as Sun's angle [rad]. */
function limits(name, role) {
  const joint = described(name)?.joints.find((j) => j.role === role);
  const { sign, offset } = sunMap(name, role);
  const low = joint?.lower ?? -Math.PI;
  const high = joint?.upper ?? Math.PI;
  const ends = [sign * low + offset, sign * high + offset];
  return [Math.min(...ends), Math.max(...ends)];
}

export function sliceSun(index) {
  const [across, up] = PAIRS[index];
  const title = `${across}–${up}`;
  const raster = document.createElement("canvas");
  let mask, pixels, bits, mapX, mapY, box, rasterWidth, rasterHeight;

  function layout(width, height, dpr) {
    const roomy = width >= 220; // the small layout has no ticks
    const t = size("tick");
    box = roomy
      ? { left: Math.round(t * 2.95), top: 4, right: width - 8, bottom: height - Math.round(2.9 * t) }
      : { left: 6, top: 2, right: width - 6, bottom: height - Math.round(1.5 * t) };
    const [x0, x1] = limits(state.own, across);
    const [y0, y1] = limits(state.own, up);
    mapX = scale(x0 - MARGIN, x1 + MARGIN, box.left, box.right);
    mapY = scale(y0 - MARGIN, y1 + MARGIN, box.bottom, box.top);
    const w = Math.max(2, Math.round((box.right - box.left) * dpr * SUPERSAMPLE));
    const h = Math.max(2, Math.round((box.bottom - box.top) * dpr * SUPERSAMPLE));
    if (w !== rasterWidth || h !== rasterHeight) {
      rasterWidth = raster.width = w;
      rasterHeight = raster.height = h;
      mask = new Uint8Array(w * h);
      pixels = new ImageData(w, h);
      bits = new Uint32Array(pixels.data.buffer);
    }
    return { roomy, x0, x1, y0, y1 };
  }

  function paint(g, width, height, dpr) {
    clear(g, width, height);
    const entry = image();
    if (!entry) {
      message(g, width, height, noImage());
      return { state: { cells: 0, star: null }, age: Infinity, label: `${title}: no image yet` };
    }
    const { header, arrays } = entry;
    const age = imageAge(entry);
    const stale = imageStale(entry);
    const { roomy, x0, x1, y0, y1 } = layout(width, height, dpr);

    g.fillStyle = C.outside;
    g.fillRect(box.left, box.top, box.right - box.left, box.bottom - box.top);
    const fx = mapX(x0), fy = mapY(y1), fw = mapX(x1) - fx, fh = mapY(y0) - fy;
    g.fillStyle = C.free;
    g.fillRect(fx, fy, fw, fh);
    const t = size("tick");
    if (roomy) axes(g, t);

    let cells = 0;
    const xs = arrays[across], ys = arrays[up];
    if (xs && ys && xs.data.length) {
      const k = dpr * SUPERSAMPLE;
      cells = fillMesh(mask, rasterWidth, rasterHeight, xs.data, ys.data, xs.shape[0], xs.shape[1],
        (v) => (mapX(v) - box.left) * k, (v) => (mapY(v) - box.top) * k);
      paintMask(mask, rasterWidth, rasterHeight, bits, k, 0xa9, 0x70, 0xf0);
      raster.getContext("2d").putImageData(pixels, 0, 0);
      g.drawImage(raster, box.left, box.top, box.right - box.left, box.bottom - box.top);
    } else if (mask) mask.fill(0);
    g.lineWidth = 1;
    g.strokeStyle = C.edge;
    g.strokeRect(Math.round(fx) + 0.5, Math.round(fy) + 0.5, Math.round(fw) - 1, Math.round(fh) - 1);

    if (!cells) label(g, `${nameOf(state.partner)} is out of reach`, (box.left + box.right) / 2, (box.top + box.bottom) / 2 + 1.4 * t, { align: "center", halo: true });
    const x = header.current?.[across], y = header.current?.[up];
    if (Number.isFinite(x) && Number.isFinite(y)) star(g, mapX(x), mapY(y), stale, roomy ? 11 : 9);
    label(g, `${up} ↑`, box.left + 5, box.top + 4, { base: "top", halo: true });
    label(g, `${across} →`, box.right - 5, box.bottom - 4, { align: "right", base: "bottom", halo: true });
    const fill = hatch(g, C.partner, dpr);
    const entries = [[swatches.area(fill, C.partner), `${nameOf(state.own)}: projection (Sun)`]];
    legend(g, roomy ? 6 : 8, height - 0.65 * t, width - 8, entries);
    if (stale) label(g, "STALE", box.left + 5, box.bottom - 4, { base: "bottom", colour: C.text, weight: 700, halo: true });
    return {
      state: { subject: title, kind: "projection", own: state.own, partner: state.partner, star: [round(x), round(y)], hollow: stale, cells, state_time: header.state_time },
      age,
      label: `${title} of ${nameOf(state.own)}, projection of Sun's set against ${nameOf(state.partner)}: ${cells} cells; now ${across} ${degrees(x)}, ${up} ${degrees(y)}; ${ageText(age)}`,
    };
  }

  function axes(g, t) {
    for (const value of ticks(deg(mapX.from), deg(mapX.to), 4, DEGREE_STEPS)) {
      const x = Math.round(mapX((value * Math.PI) / 180)) + 0.5;
      segment(g, x, box.top, x, box.bottom, C.grid);
      label(g, `${value}°`.replace("-", "−"), x, box.bottom + 3, { align: "center", base: "top" });
    }
    for (const value of ticks(deg(mapY.from), deg(mapY.to), 5, DEGREE_STEPS)) {
      const y = Math.round(mapY((value * Math.PI) / 180)) + 0.5;
      segment(g, box.left, y, box.right, y, C.grid);
      label(g, `${value}°`.replace("-", "−"), box.left - 4, y, { align: "right", base: "middle" });
    }
  }

  function probe(x, y) {
    const entry = image();
    if (!entry || !box || x < box.left || x > box.right || y < box.top || y > box.bottom) return null;
    const u = mapX.inverse(x), v = mapY.inverse(y);
    const [x0, x1] = limits(state.own, across), [y0, y1] = limits(state.own, up);
    const k = rasterWidth / (box.right - box.left);
    const hit = mask?.[Math.min(rasterHeight - 1, Math.floor((y - box.top) * k)) * rasterWidth + Math.min(rasterWidth - 1, Math.floor((x - box.left) * k))];
    const verdict = u < x0 || u > x1 || v < y0 || v > y1 ? "beyond a joint limit" : hit ? `${nameOf(state.partner)} can be met (projection, Sun)` : "free in Sun's projection";
    const now = entry.header.current ?? {};
    return [`${across} ${degrees(u)}, ${up} ${degrees(v)}`, verdict, `now ${degrees(now[across])}, ${degrees(now[up])}`, `${ageText(imageAge(entry))} old`];
  }

  return { paint, probe, aim: () => null };
}

const round = (value) => (Number.isFinite(value) ? Math.round(value * 1e4) / 1e4 : null);
