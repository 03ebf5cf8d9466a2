// SPDX-License-Identifier: AGPL-3.0-or-later
// Arrays of the report's data, and what is computed from them while the view is used.

const bytes_of = (text) => Uint8Array.from(atob(text), (c) => c.charCodeAt(0));
export const floats = (text) => new Float32Array(bytes_of(text).buffer);
export const indices = (text) => new Uint32Array(bytes_of(text).buffer);
export const bytes = (text) => bytes_of(text);

// from + share (to − from), point by point.
export function between(from, to, share, result = new Float32Array(from.length)) {
  for (let i = 0; i < from.length; ++i) result[i] = from[i] + share * (to[i] - from[i]);
  return result;
}

// Unit normals of points, weighted by the area of the triangles around them; outward for triangles that are.
export function normals(points, triangles, result = new Float32Array(points.length)) {
  result.fill(0);
  for (let t = 0; t < triangles.length; t += 3) {
    const a = 3 * triangles[t], b = 3 * triangles[t + 1], c = 3 * triangles[t + 2];
    const ux = points[b] - points[a], uy = points[b + 1] - points[a + 1], uz = points[b + 2] - points[a + 2];
    const vx = points[c] - points[a], vy = points[c + 1] - points[a + 1], vz = points[c + 2] - points[a + 2];
    const nx = uy * vz - uz * vy, ny = uz * vx - ux * vz, nz = ux * vy - uy * vx;
    for (const k of [a, b, c]) {
      result[k] += nx;
      result[k + 1] += ny;
      result[k + 2] += nz;
    }
  }
  for (let i = 0; i < result.length; i += 3) {
    const length = Math.hypot(result[i], result[i + 1], result[i + 2]) || 1;
    result[i] /= length;
    result[i + 1] /= length;
    result[i + 2] /= length;
  }
  return result;
}

// The rows of `points` closest to a place, only those with keep(row).
export function nearest(points, place, keep) {
  let best = -1, least = Infinity;
  for (let i = 0; i < points.length / 3; ++i) {
    if (!keep(i)) continue;
    const d = Math.hypot(points[3 * i] - place[0], points[3 * i + 1] - place[1], points[3 * i + 2] - place[2]);
    if (d < least) [best, least] = [i, d];
  }
  return best;
}

export const row = (points, i) => [points[3 * i], points[3 * i + 1], points[3 * i + 2]];
export const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
export const scaled = (a, s) => a.map((v) => v * s);
export const plus = (...vectors) => [0, 1, 2].map((k) => vectors.reduce((sum, v) => sum + v[k], 0));
export const unit = (a) => scaled(a, 1 / (Math.hypot(...a) || 1));
export const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];

// Corners of the box around all given point arrays: [low, high].
export function box(...arrays) {
  const low = [Infinity, Infinity, Infinity], high = [-Infinity, -Infinity, -Infinity];
  for (const points of arrays)
    for (let i = 0; i < points.length; ++i) {
      low[i % 3] = Math.min(low[i % 3], points[i]);
      high[i % 3] = Math.max(high[i % 3], points[i]);
    }
  return [low, high];
}
