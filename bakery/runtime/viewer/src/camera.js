/** The pinhole camera of `bakery.geometry.camera`: looks along -z, pixels from the top left. */

const RADIANS = Math.PI / 180;

/** Rotation vector [3] to matrix, nine numbers row by row (Rodrigues). */
export function rotationMatrix([x, y, z]) {
  const angle = Math.hypot(x, y, z);
  if (angle < 1e-12) return [1, 0, 0, 0, 1, 0, 0, 0, 1];
  [x, y, z] = [x / angle, y / angle, z / angle];
  const c = Math.cos(angle);
  const s = Math.sin(angle);
  const d = 1 - c;
  return [
    c + x * x * d, x * y * d - z * s, x * z * d + y * s,
    y * x * d + z * s, c + y * y * d, y * z * d - x * s,
    z * x * d - y * s, z * y * d + x * s, c + z * z * d,
  ];
}

/** Turns +z to a direction: yaw to the subject's left, pitch up, then roll to its left shoulder; degrees. */
export function turnMatrix(yaw, pitch, roll = 0) {
  const [cy, sy] = [Math.cos(yaw * RADIANS), Math.sin(yaw * RADIANS)];
  const [cp, sp] = [Math.cos(pitch * RADIANS), Math.sin(pitch * RADIANS)];
  const [cr, sr] = [Math.cos(-roll * RADIANS), Math.sin(-roll * RADIANS)];
  const turn = multiply([cy, 0, sy, 0, 1, 0, -sy, 0, cy], [1, 0, 0, 0, cp, -sp, 0, sp, cp]);
  return multiply(turn, [cr, -sr, 0, sr, cr, 0, 0, 0, 1]);
}

/** Product of two 3 x 3 matrices, row by row. */
export function multiply(a, b) {
  const out = new Array(9);
  for (let r = 0; r < 3; r++) {
    for (let c = 0; c < 3; c++) {
      out[3 * r + c] = a[3 * r] * b[c] + a[3 * r + 1] * b[3 + c] + a[3 * r + 2] * b[6 + c];
    }
  }
  return out;
}

/** Matrix times vector. */
export const apply = (m, [x, y, z]) => [
  m[0] * x + m[1] * y + m[2] * z,
  m[3] * x + m[4] * y + m[5] * z,
  m[6] * x + m[7] * y + m[8] * z,
];

/**
 * @typedef {object} View
 * @property {number[]} rotation [9]
 * @property {number[]} translation [3] mm
 * @property {number} focal pixels
 * @property {number[]} center [2] pixels
 * @property {number} width pixels
 * @property {number} height pixels
 */

/**
 * A camera of the bundle as a View.
 * @returns {View}
 */
export function viewOf(camera) {
  const { focal, center, translation, width, height } = camera;
  return { rotation: rotationMatrix(camera.rotation), translation, focal, center, width, height };
}

/**
 * The view with the head turned to face (yaw, pitch); `pivot` keeps its place and distance.
 * @param {View} view
 * @returns {View}
 */
export function turned(view, yaw, pitch, pivot) {
  const moved = apply(view.rotation, pivot);
  const where = moved.map((value, k) => value + view.translation[k]);
  const rotation = turnMatrix(yaw, pitch);
  const offset = apply(rotation, pivot);
  return { ...view, rotation, translation: where.map((value, k) => value - offset[k]) };
}

/**
 * The view in a picture of another size: `scale` new pixels per old one, old `middle` in the centre.
 * @param {View} view
 * @returns {View}
 */
export function framed(view, middle, scale, width, height, shift = [0, 0]) {
  return {
    ...view,
    focal: view.focal * scale,
    center: [
      (view.center[0] - middle[0]) * scale + width / 2 + shift[0],
      (view.center[1] - middle[1]) * scale + height / 2 + shift[1],
    ],
    width,
    height,
  };
}

/** The view with the head itself turned about a point before it is looked at. */
export function withHead(view, matrix, point) {
  const moved = apply(matrix, point);
  const shift = apply(view.rotation, point.map((value, k) => value - moved[k]));
  return {
    ...view,
    rotation: multiply(view.rotation, matrix),
    translation: view.translation.map((value, k) => value + shift[k]),
  };
}

/** Head space to pixels and distance: [x, y, mm]. */
export function project(view, point) {
  const [x, y, z] = apply(view.rotation, point).map((value, k) => value + view.translation[k]);
  const scale = view.focal / -z;
  return [view.center[0] + x * scale, view.center[1] - y * scale, -z];
}

/** Rigid motion as a column-major 4 x 4 matrix for WebGL. */
export function viewMatrix({ rotation: r, translation: t }) {
  return new Float32Array([
    r[0], r[3], r[6], 0, r[1], r[4], r[7], 0, r[2], r[5], r[8], 0, t[0], t[1], t[2], 1,
  ]);
}

/** Perspective as a column-major 4 x 4 matrix for WebGL; depth covers 500 mm around the head. */
export function projectionMatrix({ focal, center, width, height, translation }) {
  const distance = -translation[2];
  const near = Math.max(distance - 450, distance * 0.05, 1);
  const far = distance + 550;
  return new Float32Array([
    (2 * focal) / width, 0, 0, 0,
    0, (2 * focal) / height, 0, 0,
    1 - (2 * center[0]) / width, (2 * center[1]) / height - 1, -(far + near) / (far - near), -1,
    0, 0, (-2 * far * near) / (far - near), 0,
  ]);
}
