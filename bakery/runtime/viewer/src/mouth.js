/** Which of the baked mouths a frame is made of; `bakery/runtime/mouth.py` is the reference. */

export const NEAREST = 50;
const COMPANY = 0.25; // as in the reference
const LEAST = 1e-4;

/** The nearest mouths by correlation of their lip landmarks. */
export class Mouths {
  /**
   * @param {number[][]} database landmarks [80] of each mouth
   * @param {{rest: number[], shapes: number[][]}} lips
   */
  constructor(database, lips) {
    this.size = lips.rest.length;
    this.known = new Float64Array(database.length * this.size);
    this.length = new Float64Array(database.length);
    database.forEach((row, index) => {
      this.known.set(row, index * this.size);
      this.length[index] = Math.hypot(...row);
    });
    this.rest = Float64Array.from(lips.rest);
    this.shapes = lips.shapes.map((row) => Float64Array.from(row));
    this.moves = this.shapes.map((row) => row.some((value) => value !== 0));
    this.wanted = new Float64Array(this.size);
    this.score = new Float64Array(database.length);
    this.order = Array.from(database, (_, index) => index);
    this.count = Math.min(NEAREST, database.length);
    /** Index and weight of each neighbour, nearest first. */
    this.index = new Uint16Array(this.count);
    this.weight = new Float64Array(this.count);
  }

  /**
   * Find the neighbours for weights [52].
   * @returns {boolean} whether they differ from the last ones
   */
  find(weights) {
    const { wanted, known, score, size, order } = this;
    wanted.set(this.rest);
    for (let e = 0; e < weights.length; e++) {
      const weight = weights[e];
      if (weight === 0 || !this.moves[e]) continue;
      const shape = this.shapes[e];
      for (let k = 0; k < size; k++) wanted[k] += weight * shape[k];
    }
    let square = 0;
    for (let k = 0; k < size; k++) square += wanted[k] * wanted[k];
    const own = Math.sqrt(square);
    for (let m = 0, at = 0; m < score.length; m++) {
      let dot = 0;
      for (let k = 0; k < size; k++, at++) dot += known[at] * wanted[k];
      score[m] = dot / (this.length[m] * own);
    }
    order.sort((a, b) => score[b] - score[a] || a - b);
    const best = 1 - score[order[0]];
    const bandwidth = Math.max(COMPANY * best, LEAST);
    let sum = 0;
    let changed = false;
    const fresh = new Float64Array(this.count);
    for (let n = 0; n < this.count; n++) {
      fresh[n] = Math.exp((best - (1 - score[order[n]])) / bandwidth);
      sum += fresh[n];
    }
    for (let n = 0; n < this.count; n++) {
      const weight = fresh[n] / sum;
      changed ||= this.index[n] !== order[n] || Math.abs(this.weight[n] - weight) > 1e-7;
      this.index[n] = order[n];
      this.weight[n] = weight;
    }
    return changed;
  }
}

/**
 * Index of the gaze whose direction is nearest.
 * @param {number[][]} directions
 * @param {ArrayLike<number>} gaze degrees
 */
export function nearestGaze(directions, gaze) {
  let best = 0;
  let least = Infinity;
  directions.forEach(([yaw, pitch], index) => {
    const distance = (yaw - gaze[0]) ** 2 + (pitch - gaze[1]) ** 2;
    if (distance < least) [best, least] = [index, distance];
  });
  return best;
}
