// SPDX-License-Identifier: AGPL-3.0-or-later
// What can be shown: the shapes of each model in each pose, decoded when they are first asked for.
import { between, bytes, floats, indices, nearest, row, unit } from "./geometry.js";

const { data } = supine;
const shapes = data.shapes;

// What was made of holder[key], made once.
const made = new WeakMap();
const once = (holder, key, make) => {
  if (!made.has(holder)) made.set(holder, {});
  const known = made.get(holder);
  if (!(key in known)) known[key] = make(holder[key]);
  return known[key];
};
const points = (holder, key) => once(holder, key, floats);

// The points of the body, those on the border of two regions once for each: colours and light then change sharply there.
const { sources, triangles, region_of_point } = split(indices(shapes.body.triangles), bytes(shapes.body.region));
export { region_of_point };
export const body = { triangles };
function split(corners, regions) {
  const rows = new Map(), from = [], region = [];
  const row_for = (point, r) => {
    const key = point * 8 + r;
    if (!rows.has(key)) {
      rows.set(key, from.length);
      from.push(point);
      region.push(r);
    }
    return rows.get(key);
  };
  const list = corners.map((point, k) => row_for(point, regions[Math.floor(k / 3)]));
  return { sources: from, triangles: list, region_of_point: region };
}
const of_body = (values, size) => {
  const list = new values.constructor(size * sources.length);
  sources.forEach((source, i) => { for (let k = 0; k < size; ++k) list[size * i + k] = values[size * source + k]; });
  return list;
};
const body_points = (holder, key) => once(holder, key, (text) => of_body(floats(text), 3));

export const organs = shapes.organs.map((o) => ({ name: o.name, triangles: indices(o.triangles) }));
export const muscle = { points: floats(shapes.muscle.points), triangles: indices(shapes.muscle.triangles) };
export const states = shapes.states;
export const state_of = (id) => states.find((s) => s.id === id);

// The shape at `morph`: 0 prone, 1 undeformed, 2 the pose; read(shape) takes points of a stored shape.
function morphed(state, pose, morph, read) {
  const undeformed = read(state.undeformed);
  if (morph <= 1) return between(read(shapes.prone), undeformed, morph);
  return between(undeformed, read(state.poses[pose]), morph - 1);
}
export const body_at = (state, pose, morph) => morphed(state, pose, morph, (s) => body_points(s, "body"));
export const organ_at = (state, pose, morph, name) => morphed(state, pose, morph, (s) => points(s.organs, name));

// Signed distance of each point of the body, NaN where the scan does not cover it; null without a comparison.
export const distance_of = (state, pose) =>
  state.poses[pose].distance_mm ? once(state.poses[pose], "distance_mm", (text) => of_body(floats(text), 1)) : null;

// The scan of a pose as the model sees it: {points, triangles, distance}, or null.
export function scan_of(state, pose) {
  const shape = state.poses[pose];
  if (shape.scan === undefined) return null;
  const scan = shapes.scans[shape.scan];
  return { points: points(scan, "points"), triangles: once(scan, "triangles", indices), distance: points(shape, "scan_distance_mm") };
}

// [{name, predicted: [x, y, z], measured: [x, y, z] or null}]; measured only in the pose itself.
export function landmarks_at(state, pose, morph) {
  if (!shapes.prone.landmarks) return [];
  const moved = morphed(state, pose, morph, (s) => points(s.landmarks, "points")), there = morph > 1.999 && shapes.measured_landmarks[pose];
  return shapes.prone.landmarks.names.map((name, i) => {
    const k = there ? there.names.indexOf(name) : -1;
    return { name, predicted: row(moved, i), measured: k < 0 ? null : row(points(there, "points"), k) };
  });
}

// [{name, place, half_axes, axes, skin: [x, y, z] or null, depth: mm or null}] of what supine-targets found in the pose.
export function targets_of(pose) {
  const found = supine.targets_of(pose);
  return (found ? found.points : []).map((p) => ({ name: p.name, place: p.place_mm, half_axes: p.half_axes_mm, axes: p.axes, skin: p.nearest_skin && p.nearest_skin.place_mm,
    depth: p.nearest_skin && p.nearest_skin.mm }));
}

const folder_of = (state) => ({ given: "", calibrated: "calibrated/" }[state.id] ?? "ladder/" + state.id.slice(5) + "/");
export const comparison_file = (state, pose) => `${folder_of(state)}comparison${pose === "supine" ? "" : "_" + pose}.json`;
export const comparison_of = (state, pose) => data.figures[comparison_file(state, pose)] || null;

// Names for the picture: connected hot spots of the calibrated model; of the others the areas that are off most.
export function spots_of(state, pose) {
  const diagnosis = data.figures[supine.first_file("diagnosis.json", "ladder/diagnosis.json")];
  const shape = body_points(state.poses[pose], "body"), skin = (i) => region_of_point[i] === 2;
  const label = (area, value) => `${area} ${supine.signed(value, 1)} mm`;
  if (state.id === "calibrated" && diagnosis && (diagnosis.hot_spots || []).some((h) => h.pose === pose))
    return diagnosis.hot_spots.filter((h) => h.pose === pose).slice(0, 5)
      .map((h) => ({ text: label(h.area, h.mean_signed_mm), point: nearest(shape, h.centre_mm, skin) }));
  const comparison = comparison_of(state, pose), area = state.poses[pose].area;
  if (!comparison || !area) return [];
  const of_point = once(state.poses[pose], "area", (text) => of_body(bytes(text), 1));
  return comparison.areas.map((a, k) => ({ ...a, k })).filter((a) => Math.abs(a.mean_signed_mm) >= 0.5)
    .sort((a, b) => Math.abs(b.mean_signed_mm) - Math.abs(a.mean_signed_mm)).slice(0, 4)
    .map((a) => ({ text: label(a.name, a.mean_signed_mm), point: middle(shape, of_point, a.k) })).filter((s) => s.point >= 0);
}
function middle(shape, of_point, area) {
  const sum = [0, 0, 0];
  let count = 0;
  of_point.forEach((a, i) => {
    if (a !== area) return;
    row(shape, i).forEach((v, k) => { sum[k] += v; });
    ++count;
  });
  return count ? nearest(shape, sum.map((v) => v / count), (i) => of_point[i] === area) : -1;
}

// The end of the colours: nearly all distances of the first model that was compared lie within.
export const colour_limit = (() => {
  const file = states.flatMap((s) => Object.keys(s.poses).map((pose) => comparison_of(s, pose))).filter(Boolean)[0];
  const p95 = file ? file.p95_mm : 4;
  return [1, 2, 3, 4, 5, 6, 8, 10, 15, 20, 30, 50].find((limit) => limit >= p95 * 0.95) || 50;
})();

// Of an object: up against gravity, seen from the side of its longest direction.
function of_object(anatomy) {
  const down = data.case.poses.map((p) => p.gravity).find((g) => g.some((x) => x !== 0)) || anatomy.across.map((x) => -x);
  const head = down.map((x) => -x), along = anatomy.along;
  const side = [along[1] * head[2] - along[2] * head[1], along[2] * head[0] - along[0] * head[2], along[0] * head[1] - along[1] * head[0]];
  return side.some((x) => Math.abs(x) > 0.1) ? { outward: unit(side).map((x) => -x), lateral: along, head } : { outward: anatomy.outward, lateral: along, head: anatomy.across };
}

// Directions of the patient: {outward, lateral, head}.
export const directions = (() => {
  const anatomy = data.figures["mesh.json"] && data.figures["mesh.json"].anatomy;
  if (anatomy && anatomy.side === "none") return of_object(anatomy);
  if (anatomy && Array.isArray(anatomy.outward)) return anatomy;
  const prone = data.case.poses.find((p) => p.name === data.case.imaged).gravity;
  return { outward: unit(prone), lateral: [data.case.side === "right" ? -1 : 1, 0, 0], head: [0, 0, 1] };
})();
export const gravity_of = (name) => data.case.poses.find((p) => p.name === name).gravity;
