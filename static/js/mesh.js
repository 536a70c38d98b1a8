// Sun's joint sets as pixels: every cell of the (m, n) mesh becomes a filled quadrilateral.

let low = 0; // ends of the present row's span; module variables because this is the inner loop
let high = 0;

/** Widens the span by the part of an edge inside the row of pixels from y to y + 1. */
function widen(y, ax, ay, bx, by) {
  if (ay > by) {
    const x = ax, z = ay;
    ax = bx; ay = by; bx = x; by = z;
  }
  if (ay > y + 1 || by < y) return;
  let p = ax, q = bx;
  if (by > ay) {
    const slope = (bx - ax) / (by - ay);
    if (ay < y) p = ax + (y - ay) * slope;
    if (by > y + 1) q = ax + (y + 1 - ay) * slope;
  }
  if (p < low) low = p;
  if (p > high) high = p;
  if (q < low) low = q;
  if (q > high) high = q;
}

/** Fills every pixel of `mask` (w by h) that the convex cell a-b-d-c touches along x, so that thin cells are kept. */
function cell(mask, w, h, ax, ay, bx, by, dx, dy, cx, cy) {
  const top = Math.max(0, Math.floor(Math.min(ay, by, cy, dy)));
  const bottom = Math.min(h - 1, Math.floor(Math.max(ay, by, cy, dy)));
  for (let y = top; y <= bottom; y++) {
    low = Infinity;
    high = -Infinity;
    widen(y, ax, ay, bx, by);
    widen(y, bx, by, dx, dy);
    widen(y, dx, dy, cx, cy);
    widen(y, cx, cy, ax, ay);
    const from = y * w + Math.max(0, Math.floor(low));
    const to = y * w + Math.min(w - 1, Math.floor(high));
    for (let p = from; p <= to; p++) mask[p] = 1;
  }
}

let px = new Float64Array(0);
let py = new Float64Array(0);

/** xs, ys: rows by columns mesh values; mapX, mapY to pixels. Returns the number of cells filled. */
export function fillMesh(mask, w, h, xs, ys, rows, columns, mapX, mapY) {
  mask.fill(0);
  const n = rows * columns;
  if (px.length < n) {
    px = new Float64Array(n);
    py = new Float64Array(n);
  }
  for (let k = 0; k < n; k++) {
    px[k] = mapX(xs[k]);
    py[k] = mapY(ys[k]);
  }
  let cells = 0;
  for (let i = 0; i + 1 < rows; i++) {
    for (let j = 0; j + 1 < columns; j++) {
      const a = i * columns + j, b = a + 1, c = a + columns, d = c + 1;
      if (Number.isNaN(px[a] + px[b] + px[c] + px[d] + py[a] + py[b] + py[c] + py[d])) continue; // a corner is out of reach
      cells += 1;
      cell(mask, w, h, px[a], py[a], px[b], py[b], px[d], py[d], px[c], py[c]);
    }
  }
  return cells;
}

/** Colours the mask: 35 % fill, "/" hatch of 3 px at 12 px pitch, 2 px outline. k: mask pixels per px. */
export function paintMask(mask, w, h, pixels, k, red, green, blue) {
  const rim = Math.max(1, Math.round(2 * k));
  const period = Math.round(12 * Math.SQRT2 * k);
  const stroke = 3 * Math.SQRT2 * k;
  const colour = (alpha) => (Math.round(alpha * 255) << 24 | blue << 16 | green << 8 | red) >>> 0; // little-endian RGBA
  const fill = colour(0.35);
  const line = colour(0.8);
  const solid = colour(1);
  for (let y = 0, p = 0; y < h; y++) {
    for (let x = 0; x < w; x++, p++) {
      if (!mask[p]) {
        pixels[p] = 0;
        continue;
      }
      const border =
        (x >= rim && !mask[p - rim]) || (x < w - rim && !mask[p + rim]) ||
        (y >= rim && !mask[p - rim * w]) || (y < h - rim && !mask[p + rim * w]);
      pixels[p] = border ? solid : (x + y) % period < stroke ? line : fill;
    }
  }
}
