// Sun's joint sets as pixels: every cell of the (m, n) mesh becomes a filled quadrilateral.

/** Fills the triangle into `mask` (w by h), every pixel it touches along x. */
function triangle(mask, w, h, x0, y0, x1, y1, x2, y2) {
  const top = Math.max(0, Math.floor(Math.min(y0, y1, y2)));
  const bottom = Math.min(h - 1, Math.floor(Math.max(y0, y1, y2)));
  for (let y = top; y <= bottom; y++) {
    // The part of the triangle inside this row of pixels, so that thin cells are not lost.
    let from = Infinity;
    let to = -Infinity;
    const edge = (ax, ay, bx, by) => {
      const low = Math.max(y, Math.min(ay, by));
      const high = Math.min(y + 1, Math.max(ay, by));
      if (low > high) return;
      const slope = by === ay ? 0 : (bx - ax) / (by - ay);
      const p = by === ay ? ax : ax + (low - ay) * slope;
      const q = by === ay ? bx : ax + (high - ay) * slope;
      from = Math.min(from, p, q);
      to = Math.max(to, p, q);
    };
    edge(x0, y0, x1, y1);
    edge(x1, y1, x2, y2);
    edge(x2, y2, x0, y0);
    if (from > to) continue;
    const start = Math.max(0, Math.floor(from));
    const end = Math.min(w - 1, Math.floor(to));
    if (start <= end) mask.fill(1, y * w + start, y * w + end + 1);
  }
}

/** xs, ys: rows by columns mesh values; mapX, mapY to pixels. Returns the number of cells filled. */
export function fillMesh(mask, w, h, xs, ys, rows, columns, mapX, mapY) {
  mask.fill(0);
  let cells = 0;
  for (let i = 0; i + 1 < rows; i++) {
    for (let j = 0; j + 1 < columns; j++) {
      const a = i * columns + j;
      const b = a + 1;
      const c = a + columns;
      const d = c + 1;
      const sum = xs[a] + xs[b] + xs[c] + xs[d] + ys[a] + ys[b] + ys[c] + ys[d];
      if (!(sum === sum)) continue; // a corner is out of reach (NaN)
      cells += 1;
      const ax = mapX(xs[a]), ay = mapY(ys[a]), dx = mapX(xs[d]), dy = mapY(ys[d]);
      triangle(mask, w, h, ax, ay, mapX(xs[b]), mapY(ys[b]), dx, dy);
      triangle(mask, w, h, ax, ay, mapX(xs[c]), mapY(ys[c]), dx, dy);
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
