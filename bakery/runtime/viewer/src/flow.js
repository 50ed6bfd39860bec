/**
 * How the portrait around the face is pulled along with it, so that a jaw that drops leaves no second
 * jaw behind. The skin is followed at the cells of a coarse grid, and the field goes on smoothly between
 * the face and what is far from it. `over_photo` in `bakery/runtime/render.py` is the slow original.
 */

import { viewOf } from './camera.js';

const COLUMNS = 64;
const REACH = 0.12; // of the photo's height: where the pull begins to fade

export class Flow {
  /**
   * @param {any} about the bundle's description
   * @param {import('./glb.js').Head} head
   */
  constructor(about, head) {
    this.view = viewOf(about.photo_camera);
    this.columns = COLUMNS;
    this.rows = Math.max(8, Math.round((COLUMNS * this.view.height) / this.view.width));
    this.step = head.reach / 32767;
    const pose = about.pose.weights;
    const owner = this.#visible(head, pose);
    this.mass = this.#mass(owner);
    this.cells = Int32Array.from(owner.keys()).filter((cell) => owner[cell] >= 0);
    const count = this.cells.length;
    const total = head.part.length;
    this.rest = new Float32Array(3 * count);
    this.shapes = pose.map(() => new Int16Array(3 * count));
    this.cells.forEach((cell, k) => {
      const vertex = owner[cell];
      for (let axis = 0; axis < 3; axis++) {
        this.rest[3 * k + axis] = head.positions[3 * vertex + axis];
        this.shapes.forEach((shape, e) => {
          shape[3 * k + axis] = head.shapes[4 * (e * total + vertex) + axis];
        });
      }
    });
    this.place = new Float32Array(3 * count);
    this.values = new Float32Array(2 * owner.length);
    this.before = new Float32Array(2 * count);
    this.#project(pose, this.before);
  }

  /** The nearest vertex of the skin in each cell of the photo, -1 for none. */
  #visible(head, pose) {
    const { columns, rows } = this;
    const [first, count] = head.ranges.skin;
    const total = head.part.length;
    const skin = [...new Set(head.indices.subarray(first, first + count))];
    const places = Float32Array.from({ length: 3 * skin.length }, (_, k) => head.positions[3 * skin[Math.floor(k / 3)] + (k % 3)]);
    pose.forEach((weight, e) => {
      if (!weight) return;
      for (let n = 0; n < skin.length; n++) {
        const at = 4 * (e * total + skin[n]);
        for (let axis = 0; axis < 3; axis++) places[3 * n + axis] += weight * this.step * head.shapes[at + axis];
      }
    });
    const pixels = new Float32Array(2 * skin.length);
    const depth = this.#pixels(places, pixels);
    const owner = new Int32Array(columns * rows).fill(-1);
    const nearest = new Float32Array(owner.length).fill(Infinity);
    for (let n = 0; n < skin.length; n++) {
      const column = Math.floor(pixels[2 * n] * columns);
      const row = Math.floor(pixels[2 * n + 1] * rows);
      if (column < 0 || row < 0 || column >= columns || row >= rows) continue;
      const cell = row * columns + column;
      if (depth[n] < nearest[cell]) [nearest[cell], owner[cell]] = [depth[n], skin[n]];
    }
    return owner;
  }

  /** Points [3 n] to shares of the photo [2 n]; returns their distances, mm. */
  #pixels(points, out) {
    const { rotation: r, translation: t, focal, center, width, height } = this.view;
    const count = points.length / 3;
    const depth = new Float32Array(count);
    for (let k = 0; k < count; k++) {
      const [x, y, z] = [points[3 * k], points[3 * k + 1], points[3 * k + 2]];
      depth[k] = -(r[6] * x + r[7] * y + r[8] * z + t[2]);
      const scale = focal / depth[k];
      out[2 * k] = (center[0] + (r[0] * x + r[1] * y + r[2] * z + t[0]) * scale) / width;
      out[2 * k + 1] = (center[1] - (r[3] * x + r[4] * y + r[5] * z + t[1]) * scale) / height;
    }
    return depth;
  }

  /** Where the skin of each bound cell is for weights [52], into `out` [2 n]. */
  #project(weights, out) {
    this.place.set(this.rest);
    this.shapes.forEach((shape, e) => {
      const scale = weights[e] * this.step;
      if (scale === 0) return;
      for (let k = 0; k < shape.length; k++) this.place[k] += scale * shape[k];
    });
    this.#pixels(this.place, out);
  }

  /** How far each cell is bound: 1 on the face and far from it, 0 where it is filled in. */
  #mass(owner) {
    const { columns, rows } = this;
    const away = Float32Array.from(owner, (vertex) => (vertex >= 0 ? 0 : 1e3));
    const relax = (cell, other, step) => {
      if (away[other] + step < away[cell]) away[cell] = away[other] + step;
    };
    for (let pass = 0; pass < 2; pass++) {
      for (let n = 0; n < away.length; n++) {
        const cell = pass ? away.length - 1 - n : n;
        const column = cell % columns;
        const row = (cell - column) / columns;
        const side = pass ? 1 : -1;
        if (column + side >= 0 && column + side < columns) relax(cell, cell + side, 1);
        if (row + side >= 0 && row + side < rows) {
          relax(cell, cell + side * columns, 1);
          if (column > 0) relax(cell, cell + side * columns - 1, 1.4);
          if (column < columns - 1) relax(cell, cell + side * columns + 1, 1.4);
        }
      }
    }
    const reach = REACH * rows;
    return away.map((distance) => (distance === 0 ? 1 : Math.min(Math.max(distance / reach - 1, 0), 1)));
  }

  /**
   * The field of a frame: where the photo of each cell comes from, in shares of the photo.
   * @param {ArrayLike<number>} weights [52]
   * @returns {Float32Array} [2 cells]
   */
  at(weights) {
    const { cells, values, before } = this;
    const now = new Float32Array(before.length);
    this.#project(weights, now);
    for (let k = 0; k < cells.length; k++) {
      values[2 * cells[k]] = before[2 * k] - now[2 * k];
      values[2 * cells[k] + 1] = before[2 * k + 1] - now[2 * k + 1];
    }
    return diffuse(values, this.mass, this.columns, this.rows);
  }
}

/** Continue known values into the unknown, coarse to fine (pull and push, as `geometry.fill.diffuse`). */
function diffuse(values, mass, columns, rows) {
  if (Math.min(columns, rows) < 2) return values;
  const [wide, high] = [(columns + 1) >> 1, (rows + 1) >> 1];
  const total = new Float32Array(2 * wide * high);
  const sum = new Float32Array(wide * high);
  for (let row = 0; row < rows; row++) {
    for (let column = 0; column < columns; column++) {
      const cell = row * columns + column;
      const up = (row >> 1) * wide + (column >> 1);
      sum[up] += mass[cell];
      total[2 * up] += mass[cell] * values[2 * cell];
      total[2 * up + 1] += mass[cell] * values[2 * cell + 1];
    }
  }
  for (let up = 0; up < sum.length; up++) {
    const scale = sum[up] > 0 ? 1 / sum[up] : 0;
    total[2 * up] *= scale;
    total[2 * up + 1] *= scale;
    sum[up] = Math.min(1, sum[up]);
  }
  const coarse = diffuse(total, sum, wide, high);
  const out = new Float32Array(values.length);
  for (let row = 0; row < rows; row++) {
    for (let column = 0; column < columns; column++) {
      const cell = row * columns + column;
      const x = Math.min(Math.max((column - 0.5) / 2, 0), wide - 1);
      const y = Math.min(Math.max((row - 0.5) / 2, 0), high - 1);
      const [left, top] = [Math.floor(x), Math.floor(y)];
      const [right, low] = [Math.min(left + 1, wide - 1), Math.min(top + 1, high - 1)];
      for (let axis = 0; axis < 2; axis++) {
        const a = coarse[2 * (top * wide + left) + axis] * (1 - x + left) + coarse[2 * (top * wide + right) + axis] * (x - left);
        const b = coarse[2 * (low * wide + left) + axis] * (1 - x + left) + coarse[2 * (low * wide + right) + axis] * (x - left);
        const filled = a * (1 - y + top) + b * (y - top);
        out[2 * cell + axis] = mass[cell] * values[2 * cell + axis] + (1 - mass[cell]) * filled;
      }
    }
  }
  return out;
}
