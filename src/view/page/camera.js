// The camera: what a document says of it as eye, target and up, and how it turns, moves and projects.
//
// A camera here is { eye, target, up, right, forward, perspective, height, fovY, near }: height is that of the view in world units (parallel rays),
// fovY the full vertical angle in degrees (perspective). Turning is about the target: to the side about the subject's axis upwards, up and
// down about the picture's own horizontal.

import { add, clamp, cross, degrees, dot, length, radians, rotate, scale, sub, unit } from "./vectors.js";
import { withKey } from "./store.js";

const UP = [0, 0, 1];

/// The place and size of a volume in the world, from what the server tells of it.
export function boxOf(volume) {
  const rows = volume.index_to_world;
  const toWorld = (p) => rows.map((row) => row[0] * p[0] + row[1] * p[1] + row[2] * p[2] + row[3]);
  const { low, high } = volume.box;
  const pick = (n) => [0, 1, 2].map((axis) => ((n >> axis) & 1 ? high : low)[axis]);
  const corners = [0, 1, 2, 3, 4, 5, 6, 7].map((n) => toWorld(pick(n)));
  const center = toWorld(low.map((l, axis) => 0.5 * (l + high[axis])));
  const columns = [0, 1, 2].map((axis) => rows.map((row) => row[axis]));
  // The rows of the inverse matrix: how an index grows with a step in the world.
  const [a, b, c] = columns;
  const size = dot(a, cross(b, c));
  const growth = [cross(b, c), cross(c, a), cross(a, b)].map((v) => scale(v, 1 / size));
  const origin = rows.map((row) => row[3]);
  const toIndex = (p) => growth.map((g) => dot(g, sub(p, origin)));
  // Where the subject's face looks: anatomy in the RAS convention counts y towards the front.
  const front = volume.directions?.["+y"] === "A" ? [0, 1, 0] : [0, -1, 0];
  const radius = Math.max(...corners.map((corner) => length(sub(corner, center))));
  return { low, high, dims: volume.dims, corners, center, radius, growth, origin, toWorld, toIndex, columns, front };
}

/// The camera of a document.
export function cameraOf(document, box, [width, height]) {
  const keys = document.camera ?? {}, aspect = width / height;
  const perspective = keys.projection === "perspective", fovY = keys.fov_y ?? 30;
  const fitted = (2 * box.radius) / Math.min(aspect, 1);
  let { eye, target } = keys, up = keys.up ?? UP, viewHeight = keys.height ?? fitted;
  if (keys.along) return along(keys, box, [width, height]);
  if (!eye) {
    const zoom = keys.zoom ?? 1, side = cross(UP, box.front);
    const towards = direction(keys.azimuth ?? 30, keys.elevation ?? 20, box.front);
    const lean = rotate(rotate(UP, side, -(keys.elevation ?? 20)), UP, keys.azimuth ?? 30);
    up = rotate(lean, towards, keys.roll ?? 0);
    target = box.center;
    const distance = perspective ? box.radius / Math.sin(radians(fovY) / 2) / zoom : 2 * box.radius;
    eye = add(target, scale(towards, distance));
    viewHeight /= zoom;
  }
  return framed({ eye, target: target ?? box.center, up, perspective, height: viewHeight, fovY, near: keys.near ?? null });
}

/// Right, up and forward of a camera that has eye, target and up.
function framed(camera) {
  const forward = unit(sub(camera.target, camera.eye)), right = unit(cross(forward, camera.up));
  return { ...camera, forward, right, up: cross(right, forward) };
}

/// The camera along an axis of the volume. Its picture may be a mirror of the world: columns go along an axis whatever its direction is.
function along(keys, box, [width, height]) {
  const axis = "xyz".indexOf(keys.along.at(-1)), backwards = keys.along.startsWith("-");
  const [across, down] = [[1, 2], [0, 2], [0, 1]][axis];
  const sign = backwards ? -1 : 1, forward = scale(unit(box.columns[axis]), sign);
  const extent = (n, pixels) => (box.dims[n] * length(box.columns[n])) / pixels;
  const fitted = Math.max(extent(across, width), extent(down, height)) * height;
  const eye = sub(box.center, scale(forward, 2 * box.radius));
  const up = scale(unit(box.columns[down]), -1), right = scale(unit(box.columns[across]), sign);
  return { eye, target: box.center, up, right, forward, perspective: false, height: keys.height ?? fitted, fovY: 30, near: keys.near ?? null };
}

/// The direction from the target to an eye at these angles.
export function direction(azimuth, elevation, front) {
  const side = cross(UP, front), a = radians(azimuth), e = radians(elevation);
  const level = add(scale(front, Math.cos(a)), scale(side, Math.sin(a)));
  return add(scale(level, Math.cos(e)), scale(UP, Math.sin(e)));
}

/// `document` seen by `camera`.
export function withCamera(document, camera) {
  const { eye, target, up } = camera;
  const keys = { projection: camera.perspective ? "perspective" : "orthographic", eye, target, up };
  if (camera.perspective) keys.fov_y = camera.fovY;
  else keys.height = camera.height;
  if (camera.near !== null) keys.near = camera.near;
  return withKey(document, "camera", keys);
}

/// Parallel rays begin at the eye's plane: the eye goes back until the box lies before it from every side. Fog is measured from the eye, so
/// there it stays.
function beforeBox(camera, box, fogged) {
  if (camera.perspective || fogged) return camera;
  const needed = 1.05 * Math.max(...box.corners.map((corner) => length(sub(corner, camera.target))));
  const distance = length(sub(camera.eye, camera.target));
  return distance >= needed ? camera : { ...camera, eye: sub(camera.target, scale(camera.forward, needed)) };
}

/// The camera turned about its target: the eye goes to the picture's right and upwards by these angles.
export function turned(camera, box, [rightwards, upwards], fogged) {
  const from = beforeBox(camera, box, fogged);
  const tipped = from.up[2] < 0 ? -1 : 1;
  const turn = (v) => rotate(rotate(v, from.right, -upwards), UP, tipped * rightwards);
  return framed({ ...from, eye: add(from.target, turn(sub(from.eye, from.target))), up: turn(from.up) });
}

/// The camera turned clockwise about its line of sight.
export const rolled = (camera, angle) => framed({ ...camera, up: rotate(camera.up, scale(camera.forward, -1), angle) });

/// World units of a pixel at the target's depth.
export function pixelSize(camera, [, height]) {
  const depth = length(sub(camera.target, camera.eye));
  return (camera.perspective ? 2 * depth * Math.tan(radians(camera.fovY) / 2) : camera.height) / height;
}

/// The camera moved so that things follow a pointer by so many pixels, right and down.
export function panned(camera, size, [x, y]) {
  const step = pixelSize(camera, size), move = add(scale(camera.right, -x * step), scale(camera.up, y * step));
  return framed({ ...camera, eye: add(camera.eye, move), target: add(camera.target, move) });
}

/// The camera that shows things `factor` times as large: a smaller view, or an eye that has come nearer.
export function zoomed(camera, factor) {
  if (!camera.perspective) return { ...camera, height: camera.height / factor };
  return framed({ ...camera, eye: add(camera.target, scale(sub(camera.eye, camera.target), 1 / factor)) });
}

/// The camera at these angles, from the same distance.
export function placed(camera, box, { azimuth, elevation, roll }, fogged) {
  const towards = direction(azimuth, elevation, box.front);
  const up = rotate(rotate(rotate(UP, cross(UP, box.front), -elevation), UP, azimuth), towards, roll);
  const distance = length(sub(camera.eye, camera.target));
  const at = framed({ ...camera, eye: add(camera.target, scale(towards, distance)), up });
  return beforeBox(at, box, fogged);
}

/// Azimuth, elevation and roll of a camera, degrees.
export function anglesOf(camera, box) {
  const towards = scale(camera.forward, -1), side = cross(UP, box.front);
  const elevation = degrees(Math.asin(clamp(towards[2], -1, 1)));
  const steep = Math.abs(towards[2]) > 0.9999;
  const azimuth = steep
    ? degrees(Math.atan2(-dot(camera.right, box.front), dot(camera.right, side)))
    : degrees(Math.atan2(dot(towards, side), dot(towards, box.front)));
  const level = rotate(side, UP, azimuth);
  const upright = cross(towards, level);
  const roll = degrees(Math.atan2(-dot(camera.up, level), dot(camera.up, upright)));
  // What is left of rounding is no angle.
  const [a, e, r] = [azimuth, elevation, roll].map((angle) => Math.round(angle * 1e8) / 1e8 + 0);
  return { azimuth: a, elevation: e, roll: r };
}

/// The camera with another projection that shows the target's surroundings in the same size.
export function projected(camera, perspective, fovY) {
  const height = 2 * length(sub(camera.target, camera.eye)) * Math.tan(radians(camera.fovY) / 2);
  const shown = camera.perspective ? height : camera.height;
  const next = { ...camera, perspective, fovY, height: shown, near: null };
  if (!perspective) return next;
  const distance = shown / (2 * Math.tan(radians(fovY) / 2));
  return framed({ ...next, eye: sub(camera.target, scale(camera.forward, distance)) });
}

/// The camera that shows the whole box from its own direction.
export function onWholeBox(camera, box, [width, height]) {
  const fit = box.radius / Math.min(width / height, 1);
  const distance = camera.perspective ? fit / Math.sin(radians(camera.fovY) / 2) : 2 * box.radius;
  return framed({ ...camera, target: box.center, eye: sub(box.center, scale(camera.forward, distance)), height: 2 * fit, near: null });
}

/// `document` for a picture of another size: what was seen along the shorter side stays in view. The section image says what it was made for.
export function fittedTo(document, box, size) {
  const { width, height } = document.image ?? {};
  if (width === size[0] && height === size[1]) return document;
  const sized = withKey(document, "image", { ...document.image, width: size[0], height: size[1] });
  const factor = Math.min(1, width / height) / Math.min(1, size[0] / size[1]);
  if (!width || !height || factor === 1 || document.camera?.along) return sized;
  const camera = cameraOf(document, box, [width, height]);
  const tangent = Math.tan(radians(camera.fovY) / 2) * factor;
  return withCamera(sized, { ...camera, height: camera.height * factor, fovY: degrees(2 * Math.atan(tangent)) });
}

/// The pixel at which a point of the world lies.
export function pixelOf(camera, [width, height], p) {
  const from = sub(p, camera.eye), depth = dot(from, camera.forward);
  const step = camera.perspective ? (2 * Math.tan(radians(camera.fovY) / 2) * Math.max(depth, 1e-9)) / height : camera.height / height;
  return [0.5 * width + dot(from, camera.right) / step, 0.5 * height - dot(from, camera.up) / step];
}
