// The exact reach image: swing x distance of the bucket tip at one height. Whole bodies, cell centres, not certified.

import { C, size } from "../theme.js";
import { degrees, metres, number, scale, ticks } from "../axis.js";
import { clear, fit, label, legend, message, segment, swatches } from "../pen.js";
import { ring, star } from "../glyphs.js";
import { count, layerBits, paintBytes, paintVeil, reachKind, swatch } from "../layers.js";
import { cellLines, counts, fromLeft, layerWord, middles, partnersText, presentLayers, reachByte, sample, toLeft } from "../exact.js";
import { described, exactImage, image, imageAge, imageStale, label as nameOf, machine, state, swingAt } from "../state.js";
import { pinnedFrom } from "../ghost.js";
import { picking } from "../tip.js";
import { shown } from "../view.js";
import { ageText } from "../head.js";
import { ageNote } from "./notes.js";
import { blockedFrom } from "./reach_sun.js";

const SEAM = (10 * Math.PI) / 180; // repeated on each side: 20 degrees in all
const raster = document.createElement("canvas");
let box, mapX, mapY, bytes, pixels, bits, cached = "", w = 0, h = 0;
let compared = null; // shares of the cells within reach that only one of the two sets blocks

/** Whether Sun's set blocks the tip at (swing of the joint, distance): his d > CO_d(theta). */
function sunBlocks(sun, q, d) {
  const theta = toLeft(state.own, q) - swingAt(state.own, 0);
  const from = blockedFrom(sun, theta);
  return from !== null && d > from;
}

/** On the exact image's own cells: what only Sun's set blocks, and what only the exact one does. */
function compare(entry, sun) {
  const { swing, reach } = entry.header.reach;
  const { data, shape: [nx, ny] } = entry.arrays.reach;
  const found = { cells: 0, both: 0, only_sun: 0, only_exact: 0, only_exact_partner: 0 };
  for (let i = 0; i < nx; i++) {
    const q = swing[0] + ((i + 0.5) / nx) * (swing[1] - swing[0]);
    const from = sun ? blockedFrom(sun, toLeft(state.own, q) - swingAt(state.own, 0)) : null;
    for (let j = 0; j < ny; j++) {
      const b = data[i * ny + j];
      if (b & layerBits.unreachable) continue;
      const d = reach[0] + ((j + 0.5) / ny) * (reach[1] - reach[0]);
      const ours = reachKind.touches(b) !== 0, his = from !== null && d > from;
      found.cells += 1;
      if (ours && his) found.both += 1;
      else if (ours) {
        found.only_exact += 1;
        if (b & reachKind.partner) found.only_exact_partner += 1; // Sun's method knows the partner only
      }
      else if (his) found.only_sun += 1;
    }
  }
  return found;
}

function rasterise(entry, sun, dpr) {
  const { header, arrays } = entry;
  const width = Math.max(2, Math.round((box.right - box.left) * dpr)), height = Math.max(2, Math.round((box.bottom - box.top) * dpr));
  if (width !== w || height !== h) {
    w = raster.width = width;
    h = raster.height = height;
    bytes = new Uint8Array(w * h);
    pixels = new ImageData(w, h);
    bits = new Uint32Array(pixels.data.buffer);
    cached = "";
  }
  const key = `${header.key} ${entry.serial} ${header.state_time} ${shown()} ${sun?.header.key} ${sun?.serial} ${mapY.to}`;
  if (key === cached) return;
  cached = key;
  const columns = middles(mapX, box.left, w, dpr), rows = middles(mapY, box.top, h, dpr);
  const own = columns.map((left) => fromLeft(state.own, left, (header.reach.swing[0] + header.reach.swing[1]) / 2));
  sample(bytes, w, h, own, rows, { x: header.reach.swing, y: header.reach.reach }, arrays.reach, { round: true });
  paintBytes(bytes, w, h, bits, dpr, reachKind);
  compared = null;
  if (shown() === "difference") {
    compared = compare(entry, sun);
    if (sun) {
      const mask = new Uint8Array(w * h);
      const longest = machine(state.own)?.max_reach ?? Infinity;
      for (let x = 0; x < w; x++) {
        const from = blockedFrom(sun, columns[x] - swingAt(state.own, 0));
        if (from === null) continue;
        for (let y = 0; y < h; y++) if (rows[y] > from && rows[y] <= longest) mask[y * w + x] = 1;
      }
      paintVeil(mask, w, h, bits, dpr);
    }
  }
  raster.getContext("2d").putImageData(pixels, 0, 0);
}

/** "tip 0.70 m above the swing joint, now · not certified"; a small panel's header has no room for the machine. */
function titles({ height, picked }, small) {
  const tip = `tip ${number(height, 2)} m`;
  const how = picked ? "picked" : "now";
  return [...(small ? [] : [`${tip} above the swing joint, ${how} · not certified`]), `${nameOf(state.own)} ${tip} up, ${how} · not certified`, `${tip}, ${how} · not certified`];
}

export function paint(g, width, height, dpr) {
  clear(g, width, height);
  const entry = exactImage();
  const { header } = entry;
  if (!header.reach || !entry.arrays.reach) {
    message(g, width, height, "no exact reach image");
    box = null;
    return { state: { kind: "exact", star: null }, age: Infinity, label: "Reach: no exact image" };
  }
  const own = machine(state.own);
  const age = imageAge(entry), stale = imageStale(entry);
  const t = size("tick");
  const longest = own?.max_reach ?? described(state.own)?.max_reach ?? header.reach.reach[1];
  const top = longest + 0.5;
  box = { left: Math.round(1.9 * t), top: Math.round(1.4 * t) + 1, right: width - 8, bottom: height - Math.round(2.9 * t) };
  mapX = scale(Math.PI + SEAM, -Math.PI - SEAM, box.left, box.right);
  mapY = scale(0, top, box.bottom, box.top);
  const wide = box.right - box.left;
  const sun = shown() === "difference" ? image() : null;
  rasterise(entry, sun, dpr);
  g.drawImage(raster, box.left, box.top, wide, box.bottom - box.top);
  g.lineWidth = 1;
  g.strokeStyle = C.edge;
  g.strokeRect(box.left + 0.5, box.top + 0.5, wide - 1, box.bottom - box.top - 1);
  for (const value of [-180, -90, 0, 90, 180]) {
    const x = Math.round(mapX((value * Math.PI) / 180)) + 0.5;
    if (Math.abs(value) === 180) segment(g, x, box.top, x, box.bottom, C.edge, 1, [3, 3]);
    else segment(g, x, box.bottom, x, box.bottom + 3, C.edge);
    const align = x - box.left < 2 * t ? "left" : box.right - x < 2 * t ? "right" : "center";
    label(g, value > 0 ? `+${value}°` : value < 0 ? `−${-value}°` : "0°", align === "left" ? Math.max(2, x - t) : align === "right" ? Math.min(width - 2, x + t) : x, box.bottom + 3, { align, base: "top" });
  }
  for (const value of ticks(0, top, 6)) label(g, number(value, 0), box.left - 5, Math.round(mapY(value)) + 0.5, { align: "right", base: "middle" });
  fit(g, titles(header.reach, width < 300), 6, 2, width - 10, { base: "top", colour: C.text });

  const classes = counts(entry.arrays.reach, reachKind, count);
  const x = toLeft(state.own, header.q.swing), d = own?.reach;
  const pin = pinnedFrom("reach");
  if (pin && Number.isFinite(d)) ring(g, mapX(toLeft(state.own, pin.swing)), mapY(Math.min(d, top)), 8);
  if (Number.isFinite(d)) star(g, mapX(x), mapY(Math.min(d, top)), stale);
  label(g, "tip distance, m ↑", box.left + 5, box.top + 3, { base: "top", halo: true });
  if (classes.out) label(g, "out of reach", box.right - 5, box.top + 3, { align: "right", base: "top", halo: true });
  label(g, "← swing left", box.left + 5, box.bottom - 4, { base: "bottom", halo: true });
  label(g, "right →", box.right - 5, box.bottom - 4, { align: "right", base: "bottom", halo: true });
  const waiting = picking(state.own, header.reach);
  if (waiting !== null && !stale) label(g, `computing ${number(waiting, 1)} s`, box.left + wide / 2, box.bottom - 4, { align: "center", base: "bottom", colour: C.text, halo: true });
  else ageNote(g, box.left + wide / 2, box.bottom - 4, age, stale, { align: "center", name: stale && width >= 300 ? "t3" : "tick" });

  const share = (n) => `${number((100 * n) / Math.max(1, compared.cells), n && n < 0.1 * compared.cells ? 1 : 0)} %`;
  const layers = presentLayers(classes, reachKind).map((layer) => [swatch.layer(g, layer, dpr), layerWord(layer, header)]);
  const limits = [
    ...(classes.beyond ? [[swatch.byte(g, layerBits.beyond, reachKind, dpr), "limit"]] : []),
    ...(classes.near ? [[swatch.byte(g, layerBits.near, reachKind, dpr), width < 300 ? "near" : "near limit"]] : []),
    ...(classes.out ? [[swatch.byte(g, layerBits.out, reachKind, dpr), "out of reach"]] : []),
  ];
  legend(g, 6, height - 0.65 * t, width - 8, compared ? [[swatch.sun(), sun ? `only Sun ${share(compared.only_sun)}` : "Sun: no image"], ...(sun ? [[layers[0]?.[0] ?? swatch.free(), `only exact ${share(compared.only_exact)}`], [swatches.glyph(() => {}), `of which ${partnersText(header)} ${share(compared.only_exact_partner)}`]] : layers)] : [...layers, ...limits], width < 300 ? 5 : 10);
  const here = Number.isFinite(d) ? reachByte(entry, header.q.swing, d) : null;
  return {
    state: {
      kind: "exact", shown: shown(), own: state.own, partners: header.partners, axis: "swing", star: [(x * 180) / Math.PI, d ?? NaN].map((v) => (Number.isFinite(v) ? Math.round(v * 1e3) / 1e3 : null)), hollow: stale,
      collides: here !== null && reachKind.hits(here) !== 0, counts: classes, compared, height: header.reach.height, picked: header.reach.picked, certified: false, max_reach: longest, state_time: header.state_time,
    },
    age,
    label: `Reach of ${nameOf(state.own)}, exact, not certified, tip ${metres(header.reach.height)} above the swing joint: swing ${degrees(x)}, tip at ${metres(d)}; ${ageText(age)}`,
  };
}

function under(x, y) {
  if (!exactImage()?.header.reach || !box || x < box.left || x > box.right || y < box.top || y > box.bottom) return null;
  return [mapX.inverse(x), mapY.inverse(y)];
}

export function probe(x, y) {
  const values = under(x, y);
  if (!values) return null;
  const entry = exactImage();
  const { header } = entry;
  const [left, d] = values;
  const q = fromLeft(state.own, left, header.q.swing);
  const sun = shown() === "difference" ? image() : null;
  return [
    `swing ${degrees(toLeft(state.own, q), 1)}, tip distance ${number(d, 2)} m, ${number(header.reach.height, 2)} m above the swing joint`,
    ...cellLines(reachByte(entry, q, d), header, reachKind),
    ...(sun ? [sunBlocks(sun, q, d) ? "blocked by Sun's set" : "free by Sun's set"] : []),
    `now swing ${degrees(toLeft(state.own, header.q.swing))}, ${metres(machine(state.own)?.reach)} · ${ageText(imageAge(entry))}`,
    "ghost: only the swing is changed, the arm stays",
  ];
}

/** The page does not invert the arm: the ghost is the present arm, swung there. */
export function aim(x, y) {
  const values = under(x, y);
  if (!values) return null;
  const { q } = exactImage().header;
  return { machine: state.own, joints: { ...q, swing: fromLeft(state.own, values[0], q.swing) }, from: "reach" };
}
