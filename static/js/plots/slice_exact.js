// An exact slice: two joints vary, the others stand where they are. Certified free, colliding by layer, undecided.

import { C, size } from "../theme.js";
import { DEGREE_STEPS, deg, degrees, scale, ticks } from "../axis.js";
import { clear, fit, label, legend, legendWidth, segment } from "../pen.js";
import { fillMesh } from "../mesh.js";
import { ring, star } from "../glyphs.js";
import { count, jointKind, paintBytes, paintVeil, swatch } from "../layers.js";
import { cellLines, counts, jointText, jointsText, layerWord, middles, presentLayers, sample, sliceByte } from "../exact.js";
import { described, exactImage, image, imageAge, imageStale, label as nameOf, state, sunMap } from "../state.js";
import { shown } from "../view.js";
import { ageText } from "../head.js";
import { pinnedFrom } from "../ghost.js";
import { stopping } from "./stopping.js";
import { ageNote } from "./notes.js";

const MARGIN = (5 * Math.PI) / 180;
const round = (value) => (Number.isFinite(value) ? Math.round(value * 1e4) / 1e4 : null);

export function sliceExact(index) {
  const raster = document.createElement("canvas");
  let box, mapX, mapY, bytes, pixels, bits, cached = "", w = 0, h = 0, sunCells = 0, mask = null;

  function limits(role, edges) {
    const joint = described(state.own)?.joints.find((j) => j.role === role);
    return [joint?.lower ?? edges[0], joint?.upper ?? edges[1]];
  }

  function layout(slice, width, height, dpr) {
    const roomy = width >= 220; // the small layout has no ticks
    const t = size("tick");
    const top = Math.round(1.4 * t) + 1; // under the line that names the fixed joints
    box = roomy
      ? { left: Math.round(t * 2.95), top, right: width - 8, bottom: height - Math.round(2.9 * t) }
      : { left: 6, top, right: width - 6, bottom: height - Math.round(1.5 * t) };
    const [x0, x1] = limits(slice.across, slice.x), [y0, y1] = limits(slice.up, slice.y);
    mapX = scale(x0 - MARGIN, x1 + MARGIN, box.left, box.right);
    mapY = scale(y0 - MARGIN, y1 + MARGIN, box.bottom, box.top);
    const width_ = Math.max(2, Math.round((box.right - box.left) * dpr)), height_ = Math.max(2, Math.round((box.bottom - box.top) * dpr));
    if (width_ !== w || height_ !== h) {
      w = raster.width = width_;
      h = raster.height = height_;
      bytes = new Uint8Array(w * h);
      pixels = new ImageData(w, h);
      bits = new Uint32Array(pixels.data.buffer);
      cached = "";
    }
    return { roomy, x0, x1, y0, y1 };
  }

  /** The cells as pixels; made anew only for another image, size or way of showing. */
  function rasterise(entry, slice, dpr, sun) {
    const key = `${state.own} ${entry.serial} ${entry.header.state_time} ${w} ${h} ${sun ? `${sun.serial} ${sun.header.key}` : ""} ${mapX.from} ${mapY.to}`;
    if (key === cached) return;
    cached = key;
    const columns = middles(mapX, box.left, w, dpr), rows = middles(mapY, box.top, h, dpr);
    sample(bytes, w, h, columns, rows, slice, entry.arrays[`slice${index}`]);
    if (slice.patch) sample(bytes, w, h, columns, rows, slice.patch, entry.arrays[`patch${index}`], { over: true });
    paintBytes(bytes, w, h, bits, dpr, jointKind);
    sunCells = 0;
    mask = null;
    const xs = sun?.arrays[slice.across], ys = sun?.arrays[slice.up];
    if (xs?.data.length && ys?.data.length) {
      const a = sunMap(state.own, slice.across), b = sunMap(state.own, slice.up);
      mask = new Uint8Array(w * h);
      sunCells = fillMesh(mask, w, h, xs.data, ys.data, xs.shape[0], xs.shape[1],
        (s) => (mapX((s - a.offset) * a.sign) - box.left) * dpr, (s) => (mapY((s - b.offset) * b.sign) - box.top) * dpr);
      paintVeil(mask, w, h, bits, dpr);
    }
    raster.getContext("2d").putImageData(pixels, 0, 0);
  }

  function paint(g, width, height, dpr) {
    clear(g, width, height);
    const entry = exactImage();
    const { header, arrays } = entry;
    const slice = header.slices[index];
    const { across, up } = slice;
    const title = `${across}–${up}`;
    const age = imageAge(entry), stale = imageStale(entry);
    const { roomy, x0, x1, y0, y1 } = layout(slice, width, height, dpr);
    const difference = shown() === "difference";
    rasterise(entry, slice, dpr, difference ? image() : null);
    g.drawImage(raster, box.left, box.top, box.right - box.left, box.bottom - box.top);
    const t = size("tick");
    const fx = Math.round(mapX(x0)) + 0.5, fy = Math.round(mapY(y1)) + 0.5;
    g.lineWidth = 1;
    g.strokeStyle = C.edge;
    g.strokeRect(fx, fy, Math.round(mapX(x1) - mapX(x0)) - 1, Math.round(mapY(y0) - mapY(y1)) - 1);
    if (roomy) axes(g, t);

    const fixed = Object.fromEntries(["bucket", "stick", "boom", "swing"].filter((role) => role !== across && role !== up).map((role) => [role, header.q[role]]));
    const at = Object.keys(fixed).map((role) => jointText(state.own, role, fixed[role]));
    fit(g, [`slice at ${at.join(", ")}`, at.join(", "), at.join(" ")], 6, 2, width - 10, { base: "top", colour: C.text });
    const x = header.q[across], y = header.q[up];
    const stops = stopping(g, box, mapX, mapY, slice, header, (u, v) => sliceByte(entry, index, u, v));
    const pin = pinnedFrom(`slice ${index}`);
    if (pin) ring(g, mapX(pin[across]), mapY(pin[up]), roomy ? 8 : 6);
    star(g, mapX(x), mapY(y), stale, roomy ? 11 : 9);
    label(g, width < 165 ? `slice, ${up} ↑` : `${up} ↑`, box.left + 5, box.top + 3, { base: "top", halo: true });
    label(g, `${across} →`, box.right - 5, box.bottom - 4, { align: "right", base: "bottom", halo: true });

    const classes = counts(arrays[`slice${index}`], jointKind, count);
    const near = slice.patch ? counts(arrays[`patch${index}`], jointKind, count) : {};
    const has = (name) => (classes[name] ?? 0) + (near[name] ?? 0);
    const present = presentLayers(Object.fromEntries(jointKind.layers.map(({ name }) => [name, has(name)])));
    const entries = difference ? [
      [swatch.sun(), !sunCells ? "Sun: nothing" : roomy ? "Sun: projection" : "projection"],
      [present.length ? swatch.layer(g, present[0], dpr) : swatch.free(), roomy ? "exact: slice" : "slice"],
    ] : [
      ...present.map((layer) => [swatch.layer(g, layer, dpr), layerWord(layer, header)]),
    ];
    const gap = roomy ? 7 : 5;
    const undecided = ["undecided", "undec.", "?"].map((word) => [swatch.undecided(g, dpr), word]).find((entry) => legendWidth(g, [...entries, entry], gap) <= width - 8);
    legend(g, 6, height - 0.65 * t, width - 8, !difference && has("undecided") && undecided ? [...entries, undecided] : entries, gap);
    ageNote(g, box.left + 5, box.bottom - 4, age, stale);
    return {
      state: {
        subject: title, kind: "slice", shown: shown(), own: state.own, partners: header.partners, star: [round(x), round(y)], hollow: stale, cells: arrays[`slice${index}`]?.data.length ?? 0,
        counts: classes, patch: slice.patch ? near : null, fixed: Object.fromEntries(Object.entries(fixed).map(([role, q]) => [role, round(q)])), stops, pinned: pin ? [round(pin[across]), round(pin[up])] : null, sun: difference ? sunCells : null, eta: header.eta, state_time: header.state_time,
      },
      age,
      label: `${title} of ${nameOf(state.own)}, exact slice at ${at.join(", ")}; now ${across} ${degrees(x)}, ${up} ${degrees(y)}: ${cellLines(sliceByte(entry, index, x, y), header, jointKind).join(", ")}; ${ageText(age)}`,
    };
  }

  function axes(g, t) {
    for (const value of ticks(deg(mapX.from), deg(mapX.to), 4, DEGREE_STEPS)) {
      const x = Math.round(mapX((value * Math.PI) / 180)) + 0.5;
      segment(g, x, box.bottom, x, box.bottom + 3, C.edge);
      label(g, `${value}°`.replace("-", "−"), x, box.bottom + 3, { align: "center", base: "top" });
    }
    for (const value of ticks(deg(mapY.from), deg(mapY.to), 5, DEGREE_STEPS)) {
      const y = Math.round(mapY((value * Math.PI) / 180)) + 0.5;
      segment(g, box.left - 3, y, box.left, y, C.edge);
      label(g, `${value}°`.replace("-", "−"), box.left - 4, y, { align: "right", base: "middle" });
    }
  }

  /** The two angles under the pointer, or null outside of the plot. */
  function under(x, y) {
    if (!exactImage() || !box || x < box.left || x > box.right || y < box.top || y > box.bottom) return null;
    return [mapX.inverse(x), mapY.inverse(y)];
  }

  function probe(x, y) {
    const values = under(x, y);
    if (!values) return null;
    const entry = exactImage();
    const { header } = entry;
    const { across, up } = header.slices[index];
    const others = ["boom", "stick", "bucket", "swing"].filter((role) => role !== across && role !== up);
    return [
      `${across} ${degrees(values[0], 1)}, ${up} ${degrees(values[1], 1)}`,
      ...(aim(x, y) ? cellLines(sliceByte(entry, index, ...values), header, jointKind) : ["beyond a joint limit"]),
      ...(mask ? [mask[Math.min(h - 1, Math.floor(((y - box.top) * h) / (box.bottom - box.top))) * w + Math.min(w - 1, Math.floor(((x - box.left) * w) / (box.right - box.left)))] ? "in Sun's projection" : "outside Sun's projection"] : []),
      `slice at ${jointsText(state.own, header.q, others)}`,
      `now ${degrees(header.q[across])}, ${degrees(header.q[up])} · bodies grown by ${(100 * header.eta).toFixed(0)} cm · ${ageText(imageAge(entry))}`,
    ];
  }

  /** The configuration under the pointer: the joints that are not in the plot stay as they are. */
  function aim(x, y) {
    const values = under(x, y);
    if (!values) return null;
    const { header } = exactImage();
    const { across, up, x: xs, y: ys } = header.slices[index];
    const [x0, x1] = limits(across, xs), [y0, y1] = limits(up, ys);
    if (values[0] < x0 || values[0] > x1 || values[1] < y0 || values[1] > y1) return null;
    return { machine: state.own, joints: { ...header.q, [across]: values[0], [up]: values[1] }, from: `slice ${index}` };
  }

  return { paint, probe, aim };
}
