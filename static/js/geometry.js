// Points and polygons in the plane.

/** Even-odd rule. point: [x, y]; polygon: [[x, y], ..]. */
export function inside([x, y], polygon) {
  let odd = false;
  for (let i = 0, j = polygon.length - 1; i < polygon.length; j = i++) {
    const [xi, yi] = polygon[i], [xj, yj] = polygon[j];
    if (yi > y !== yj > y && x < xi + ((y - yi) / (yj - yi)) * (xj - xi)) odd = !odd;
  }
  return odd;
}

/** The nearest point of the polygon's edge and how far it is. */
export function edgeDistance([x, y], polygon) {
  let best = { distance: Infinity, point: null };
  for (let i = 0, j = polygon.length - 1; i < polygon.length; j = i++) {
    const [ax, ay] = polygon[j], [bx, by] = polygon[i];
    const dx = bx - ax, dy = by - ay;
    const length = dx * dx + dy * dy;
    const t = length ? Math.min(1, Math.max(0, ((x - ax) * dx + (y - ay) * dy) / length)) : 0;
    const point = [ax + t * dx, ay + t * dy];
    const distance = Math.hypot(x - point[0], y - point[1]);
    if (distance < best.distance) best = { distance, point };
  }
  return best;
}
