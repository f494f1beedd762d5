// SPDX-License-Identifier: Apache-2.0
// A generated room for the fake server: what cameras, lasers and maps of a robot in it would give. All of it repeatable.

const kRoom = { x: [-3, 3], y: [-2, 7], z: [0, 2.6] };
const kBoxes = [
  { x: [-2.2, -1.2], y: [3.0, 3.8], z: [0, 0.75], colour: [150, 108, 72] },
  { x: [-1.9, -1.7], y: [3.2, 3.4], z: [0.75, 0.98], colour: [176, 58, 52] },
  { x: [1.1, 1.6], y: [2.4, 2.9], z: [0, 1.1], colour: [70, 118, 92] },
  { x: [0.2, 1.4], y: [5.2, 5.6], z: [0, 1.7], colour: [88, 106, 140] },
  { x: [-2.95, -2.6], y: [0.2, 1.6], z: [0, 1.9], colour: [120, 112, 104] },
];
export const kCamera = { width: 320, height: 240, focal_px: 250, height_m: 1.1 };

/** A repeatable random number in 0..1 for a number. */
export function chance(seed) {
  let x = Math.imul(seed ^ 0x9e3779b9, 0x85ebca6b);
  x = Math.imul(x ^ (x >>> 13), 0xc2b2ae35);
  return ((x ^ (x >>> 16)) >>> 0) / 2 ** 32;
}

/** Where the robot is: to and fro, turning a little. Robot frame: x right, y ahead. */
export function robot_at(at_s) {
  return { x: 0.3 * Math.sin(at_s * 0.21), y: 0.6 * Math.sin(at_s * 0.3), yaw: 0.14 * Math.sin(at_s * 0.4) };
}

function enter(box, from, to) {
  let near = 0;
  let far = Infinity;
  let side = 0;
  for (const [i, axis] of ["x", "y", "z"].entries()) {
    const a = (box[axis][0] - from[i]) / to[i];
    const b = (box[axis][1] - from[i]) / to[i];
    if (Math.min(a, b) > near) side = i;
    near = Math.max(near, Math.min(a, b));
    far = Math.min(far, Math.max(a, b));
  }
  return near < far && near > 0 ? { t: near, side } : null;
}

/** Along a ray: how far, and of which colour. */
export function cast(from, to) {
  let hit = leave_room(from, to);
  for (const box of kBoxes) {
    const entered = enter(box, from, to);
    if (!entered || entered.t >= hit.t) continue;
    const light = [0.82, 1, 1.12][entered.side];
    hit = { t: entered.t, colour: box.colour.map((channel) => channel * light) };
  }
  return hit;
}

function leave_room(from, to) {
  let t = Infinity;
  let wall = 0;
  for (const [i, axis] of ["x", "y", "z"].entries()) {
    const bound = to[i] > 0 ? kRoom[axis][1] : kRoom[axis][0];
    const away = (bound - from[i]) / to[i];
    if (away > 0 && away < t) [t, wall] = [away, i];
  }
  const [x, y, z] = from.map((start, i) => start + t * to[i]);
  if (wall !== 2) return { t, colour: z < 0.1 ? [96, 92, 90] : wall === 0 ? [206, 202, 192] : [188, 192, 196] };
  if (to[2] > 0) return { t, colour: [228, 228, 226] };
  const tile = (Math.floor(x * 2) + Math.floor(y * 2)) & 1;
  return { t, colour: tile ? [142, 136, 128] : [118, 113, 107] };
}

function direction(robot, right, ahead, up) {
  const [s, c] = [Math.sin(robot.yaw), Math.cos(robot.yaw)];
  return [c * right - s * ahead, s * right + c * ahead, up].map((value) => value || 1e-9);
}

/** RGBA of the camera's picture and of its disparity; `shift_m` moves the camera to the right. */
export function render(at_s, shift_m = 0) {
  const robot = robot_at(at_s);
  const { width, height, focal_px } = kCamera;
  const picture = new Uint8ClampedArray(4 * width * height);
  const disparity = new Uint8ClampedArray(4 * width * height);
  const from = [robot.x + shift_m, robot.y, kCamera.height_m];
  for (let v = 0; v < height; ++v) {
    for (let u = 0; u < width; ++u) {
      const hit = cast(from, direction(robot, (u - width / 2) / focal_px, 1, (height / 2 - v) / focal_px));
      const shade = 1 / (1 + 0.02 * hit.t * hit.t);
      const noise = 6 * (chance(v * width + u + Math.floor(at_s * 977)) - 0.5);
      const at = 4 * (v * width + u);
      for (let channel = 0; channel < 3; ++channel) {
        picture[at + channel] = hit.colour[channel] * shade + noise;
        disparity[at + channel] = 300 / hit.t;
      }
      picture[at + 3] = disparity[at + 3] = 255;
    }
  }
  return { picture, disparity };
}

/** A sweep of 181 beams over 180 degrees at 0.25 m. */
export function scan(at_s) {
  const robot = robot_at(at_s);
  const ranges = new Float32Array(181);
  for (let i = 0; i < ranges.length; ++i) {
    const angle = -Math.PI / 2 + (i * Math.PI) / 180;
    const hit = cast([robot.x, robot.y, 0.25], direction(robot, -Math.sin(angle), Math.cos(angle), 0));
    ranges[i] = chance(i + Math.floor(at_s * 15) * 191) < 0.02 ? 0 : hit.t + 0.01 * chance(i);
  }
  return { ranges, first_angle_rad: -Math.PI / 2, step_rad: Math.PI / 180 };
}

/** Cells around the robot in the axes of the room; what no ray reaches is unknown. */
export function grid(at_s) {
  const robot = robot_at(at_s);
  const [columns, rows, cell_m] = [120, 160, 0.06];
  const origin = [-3.6, -2.4];
  const cells = new Int16Array(columns * rows).fill(-1);
  for (let i = 0; i < 720; ++i) {
    const angle = (i * Math.PI) / 360;
    const way = [Math.cos(angle), Math.sin(angle), 1e-9];
    const { t } = cast([robot.x, robot.y, 0.25], way);
    for (let along = 0; along <= t + cell_m / 2; along += cell_m / 2) {
      const column = Math.floor((way[0] * along - origin[0]) / cell_m);
      const row = Math.floor((way[1] * along - origin[1]) / cell_m);
      if (column < 0 || row < 0 || column >= columns || row >= rows) break;
      const at = row * columns + column;
      cells[at] = along > t - cell_m / 2 ? 1000 : Math.min(cells[at] < 0 ? 60 : cells[at], 60);
    }
  }
  return { cells, width: columns, height: rows, cell_m, origin_x_m: origin[0], origin_y_m: origin[1] };
}

/** Points of the camera's picture in the frame of the sensor: x right, y down, z ahead; 16 bytes each. */
export function cloud(at_s, step = 2) {
  const robot = robot_at(at_s);
  const { width, height, focal_px } = kCamera;
  const count = Math.floor(width / step) * Math.floor(height / step);
  const view = new DataView(new ArrayBuffer(16 * count));
  let point = 0;
  for (let v = 0; v + step <= height; v += step) {
    for (let u = 0; u + step <= width; u += step, ++point) {
      const [x, y] = [(u - width / 2) / focal_px, (v - height / 2) / focal_px];
      const hit = cast([robot.x, robot.y, kCamera.height_m], direction(robot, x, 1, -y));
      [x * hit.t, y * hit.t, hit.t].forEach((value, i) => view.setFloat32(16 * point + 4 * i, value, true));
      hit.colour.forEach((value, i) => view.setUint8(16 * point + 12 + i, Math.min(255, value)));
      view.setUint8(16 * point + 15, 255);
    }
  }
  return { bytes: Buffer.from(view.buffer), count, of: 4 * count };
}

/** Boxes around the cup and the green cupboard in a picture of 640 x 480, as a detector would give them. */
export function detections(at_s) {
  const robot = robot_at(at_s);
  const [s, c] = [Math.sin(robot.yaw), Math.cos(robot.yaw)];
  return [kBoxes[1], kBoxes[2]].map((box, i) => {
    const corners = box.x.flatMap((x) =>
      box.y.flatMap((y) => box.z.map((z) => [x - robot.x, y - robot.y, z - kCamera.height_m])),
    );
    const pixels = corners.map(([x, y, z]) => {
      const ahead = -s * x + c * y;
      return [320 + (500 * (c * x + s * y)) / ahead, 240 - (500 * z) / ahead];
    });
    const [left, top] = [0, 1].map((axis) => Math.min(...pixels.map((pixel) => pixel[axis])));
    const [right, bottom] = [0, 1].map((axis) => Math.max(...pixels.map((pixel) => pixel[axis])));
    return [3 + 2 * i, left, top, right - left, bottom - top, 0.91 - 0.17 * i];
  });
}
