// Clip planes and cut planes: a box of planes along the volume's axes, planes of any direction, and slices that show the data.
//
// A clip plane keeps normal . p >= offset. One that lies along an axis of the volume is a face of the crop box; the others are free.

import { add, clamp, cross, degrees, dot, length, scale, sub, unit } from "./vectors.js";
import { withKey } from "./store.js";

/// Most planes of each kind.
export const MOST = 6;
export const AXES = ["x", "y", "z"];

/// The face of the crop box that a plane is: its axis, its side (0 low, 1 high) and the index at which it lies; null for a free plane.
export function faceOf(plane, box) {
  const size = length(plane.normal);
  for (let axis = 0; axis < 3; axis++) {
    const along = unit(box.growth[axis]), cosine = dot(along, plane.normal) / size;
    if (Math.abs(Math.abs(cosine) - 1) > 1e-9) continue;
    const side = cosine > 0 ? 0 : 1;
    return { axis, side, at: indexOf(axis, ((side ? -1 : 1) * plane.offset) / size, box) };
  }
  return null;
}

/// The index along `axis` of the plane whose points have `offset` along that axis' direction.
const indexOf = (axis, offset, box) => offset * length(box.growth[axis]) - dot(box.growth[axis], box.origin);

/// The offset along the direction of `axis` of the plane at index `at`.
const offsetOf = (axis, at, box) => (at + dot(box.growth[axis], box.origin)) / length(box.growth[axis]);

/// The crop box in indices: [[low, high] for each axis], the whole box where nothing cuts.
export function cropOf(document, box) {
  const crop = AXES.map((_, axis) => [box.low[axis], box.high[axis]]);
  for (const plane of document.clip ?? []) {
    const face = faceOf(plane, box);
    if (!face) continue;
    const { axis, side, at } = face;
    crop[axis][side] = side ? Math.min(crop[axis][1], at) : Math.max(crop[axis][0], at);
  }
  return crop;
}

/// `document` cropped to `crop`; null where that needs more planes than there may be.
export function withCrop(document, crop, box) {
  const planes = freePlanes(document, box);
  crop.forEach((sides, axis) =>
    sides.forEach((at, side) => {
      const whole = (side ? box.high : box.low)[axis];
      if (side ? at >= whole : at <= whole) return;
      const sign = side ? -1 : 1;
      planes.push({ normal: scale(unit(box.growth[axis]), sign), offset: sign * offsetOf(axis, at, box) });
    })
  );
  return planes.length > MOST ? null : withKey(document, "clip", planes.length ? planes : undefined);
}

/// The planes that are no face of the crop box.
export const freePlanes = (document, box) => (document.clip ?? []).filter((plane) => !faceOf(plane, box));

/// `document` with its free plane number `n` replaced by `plane`, taken away (null), or with one more.
export function withFreePlane(document, box, n, plane) {
  const faces = (document.clip ?? []).filter((p) => faceOf(p, box)), free = freePlanes(document, box);
  if (plane) free[n] = offAxis(plane, box);
  else free.splice(n, 1);
  const all = [...free, ...faces];
  return all.length > MOST ? null : withKey(document, "clip", all.length ? all : undefined);
}

/// A free plane through the middle of the box, across the axis of the volume that lies most across the view: both its handles are in sight. Of
/// the two sides it takes away the one nearer to the camera.
export function newPlane(camera, box) {
  const axes = box.growth.map(unit).sort((a, b) => Math.abs(dot(a, camera.forward)) - Math.abs(dot(b, camera.forward)));
  const normal = dot(axes[0], camera.forward) < 0 ? scale(axes[0], -1) : axes[0];
  return { normal, offset: dot(normal, box.center) };
}

/// Azimuth and elevation of a direction, degrees.
export function anglesOfNormal(normal, box) {
  const n = unit(normal), side = cross([0, 0, 1], box.front);
  return { azimuth: degrees(Math.atan2(dot(n, side), dot(n, box.front))), elevation: degrees(Math.asin(clamp(n[2], -1, 1))) };
}

/// `plane` turned about the middle of the box, from which it keeps its distance.
export function turnedPlane(plane, normal, box) {
  const distance = (plane.offset - dot(plane.normal, box.center)) / length(plane.normal);
  return { normal: unit(normal), offset: dot(unit(normal), box.center) + distance };
}

/// The point of a plane that is nearest to the middle of the box: it moves without a jump, however the plane is moved and turned.
export const anchorOf = (plane, box) => add(box.center, scale(plane.normal, (plane.offset - dot(plane.normal, box.center)) / length(plane.normal) ** 2));

/// A free plane lies along no axis, where it would be a face of the crop box: one that does is turned by far less than shows.
function offAxis(plane, box) {
  if (!faceOf(plane, box)) return plane;
  const normal = unit(plane.normal), beside = box.growth.map(unit).find((axis) => Math.abs(dot(axis, normal)) < 0.5);
  return turnedPlane(plane, add(normal, scale(beside, 2e-4)), box);
}

/// The least and the greatest offset at which a plane of this normal cuts the box.
export function reach(normal, box) {
  const offsets = box.corners.map((corner) => dot(corner, normal));
  return [Math.min(...offsets), Math.max(...offsets)];
}

/// The slices along the volume's axes: [{ at: index, plane } or null for each axis].
export function slicesOf(document, box) {
  const found = [null, null, null];
  for (const plane of document.cut ?? []) {
    const face = faceOf(plane, box);
    if (face && !found[face.axis]) found[face.axis] = { at: face.at, plane };
  }
  return found;
}

/// `document` with the slice along `axis` at index `at`, or without it (null). It keeps its colours and its window.
export function withSlice(document, axis, at, box) {
  const cuts = [...(document.cut ?? [])], there = slicesOf(document, box)[axis];
  const rest = cuts.filter((plane) => plane !== there?.plane);
  if (at === null) return withKey(document, "cut", rest.length ? rest : undefined);
  const looks = there?.plane ?? cuts[0] ?? {};
  const plane = { normal: unit(box.growth[axis]), offset: offsetOf(axis, at, box) };
  for (const key of ["colormap", "window"]) if (looks[key]) plane[key] = looks[key];
  return rest.length + 1 > MOST ? null : withKey(document, "cut", [...rest, plane]);
}

/// The corners, in order, of the polygon in which a plane cuts the box.
export function polygon(plane, box) {
  const normal = unit(plane.normal), offset = plane.offset / length(plane.normal);
  const points = [];
  for (let n = 0; n < 8; n++) {
    for (const bit of [1, 2, 4]) {
      if (n & bit) continue;
      const a = box.corners[n], b = box.corners[n | bit];
      const da = dot(normal, a) - offset, db = dot(normal, b) - offset;
      if (da * db > 0 || da === db) continue;
      points.push(add(a, scale(sub(b, a), da / (da - db))));
    }
  }
  if (points.length < 3) return [];
  const middle = scale(points.reduce(add), 1 / points.length);
  const first = unit(sub(points[0], middle)), second = cross(normal, first);
  const angle = (p) => Math.atan2(dot(sub(p, middle), second), dot(sub(p, middle), first));
  return points.sort((p, q) => angle(p) - angle(q));
}
