/**
 * How the portrait around the face is pulled along with it, so that a jaw that drops leaves no second
 * jaw behind. For each expression a field is found once, at load; a frame's field is their sum.
 * `over_photo` in `bakery/runtime/render.py` is the slow original.
 */

import { project, viewOf } from './camera.js';

const COLUMNS = 64;
const REACH = 0.12; // of the photo's height: where the pull begins to fade

export class Flow {
  /**
   * @param {any} about the bundle's description
   * @param {import('./glb.js').Head} head
   */
  constructor(about, head) {
    const view = viewOf(about.photo_camera);
    this.columns = COLUMNS;
    this.rows = Math.max(8, Math.round((COLUMNS * view.height) / view.width));
    this.pose = about.pose.weights;
    const cells = this.columns * this.rows;
    const { owner, places } = this.#visible(view, head);
    const mass = this.#mass(owner);
    this.fields = about.expressions.map((_, e) => this.#field(view, head, e, owner, places, mass));
    this.sum = new Float32Array(2 * cells);
  }

  /** The nearest vertex in each cell, -1 for none, and the vertices of the pose in the photo. */
  #visible(view, head) {
    const [first, count] = head.ranges.skin;
    let last = 0;
    for (let k = first; k < first + count; k++) last = Math.max(last, head.indices[k]);
    const total = head.part.length;
    const step = head.reach / 32767;
    const places = new Float32Array(3 * (last + 1));
    const owner = new Int32Array(this.columns * this.rows).fill(-1);
    const depth = new Float32Array(owner.length).fill(Infinity);
    for (let v = 0; v <= last; v++) {
      for (let axis = 0; axis < 3; axis++) {
        let value = head.positions[3 * v + axis];
        for (let e = 0; e < this.pose.length; e++) {
          if (this.pose[e]) value += this.pose[e] * step * head.shapes[4 * (e * total + v) + axis];
        }
        places[3 * v + axis] = value;
      }
      const [x, y, z] = project(view, places.subarray(3 * v, 3 * v + 3));
      const column = Math.floor((x / view.width) * this.columns);
      const row = Math.floor((y / view.height) * this.rows);
      if (column < 0 || row < 0 || column >= this.columns || row >= this.rows) continue;
      const cell = row * this.columns + column;
      if (z < depth[cell]) [depth[cell], owner[cell]] = [z, v];
    }
    return { owner, places };
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

  /** Where the photo of each cell comes from at weight 1 of an expression, in shares of the photo. */
  #field(view, head, expression, owner, places, mass) {
    const total = head.part.length;
    const step = head.reach / 32767;
    const values = new Float32Array(2 * owner.length);
    let moves = false;
    owner.forEach((vertex, cell) => {
      if (vertex < 0) return;
      const at = 4 * (expression * total + vertex);
      const shape = [0, 1, 2].map((axis) => head.shapes[at + axis] * step);
      if (!shape.some((value) => Math.abs(value) > 0.01)) return;
      const rest = Array.from(places.subarray(3 * vertex, 3 * vertex + 3));
      const [x, y] = project(view, rest);
      const [u, v] = project(view, rest.map((value, axis) => value + shape[axis]));
      values[2 * cell] = (x - u) / view.width;
      values[2 * cell + 1] = (y - v) / view.height;
      moves = true;
    });
    return moves ? diffuse(values, mass, this.columns, this.rows) : null;
  }

  /**
   * The field of a frame.
   * @param {ArrayLike<number>} weights [52]
   * @returns {Float32Array} [2 cells]
   */
  at(weights) {
    this.sum.fill(0);
    this.fields.forEach((field, e) => {
      const weight = weights[e] - this.pose[e];
      if (!field || Math.abs(weight) < 1e-4) return;
      for (let k = 0; k < field.length; k++) this.sum[k] += weight * field[k];
    });
    return this.sum;
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
