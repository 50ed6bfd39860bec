/**
 * Unpacks what `bakery/formats/meshopt.py` packs: vertex streams of version 0 and index sequences of
 * EXT_meshopt_compression. Plain JavaScript, since WebAssembly would need a wider page policy.
 */

import { AvatarError } from './data.js';

const WIDTHS = [0, 2, 4, 8];

/**
 * @param {Uint8Array} source
 * @param {number} count entries
 * @param {number} stride bytes of an entry
 * @returns {Uint8Array}
 */
export function decodeVertices(source, count, stride) {
  const tail = source.length - stride;
  if (source[0] !== 0xa0 || tail < 1) throw new AvatarError('packed vertices of another version');
  const out = new Uint8Array(count * stride);
  const before = source.slice(tail);
  const block = Math.min(((8192 / stride) | 0) & ~15, 256);
  const deltas = new Uint8Array(256);
  let at = 1;
  for (let first = 0; first < count; first += block) {
    const size = Math.min(block, count - first);
    const groups = (size + 15) >> 4;
    for (let byte = 0; byte < stride; byte++) {
      const header = at;
      at += (groups + 3) >> 2;
      for (let group = 0; group < groups; group++) {
        const mode = (source[header + (group >> 2)] >> ((group & 3) << 1)) & 3;
        at = readGroup(source, at, WIDTHS[mode], deltas, group << 4);
      }
      if (at > tail) throw new AvatarError('packed vertices that end too soon');
      let value = before[byte];
      for (let row = 0, place = first * stride + byte; row < size; row++, place += stride) {
        const delta = deltas[row];
        value = (value + ((delta >>> 1) ^ -(delta & 1))) & 255;
        out[place] = value;
      }
      before[byte] = value;
    }
  }
  return out;
}

function readGroup(source, at, bits, deltas, to) {
  if (bits === 0) {
    deltas.fill(0, to, to + 16);
    return at;
  }
  if (bits === 8) {
    for (let k = 0; k < 16; k++) deltas[to + k] = source[at + k];
    return at + 16;
  }
  const most = (1 << bits) - 1;
  const share = 8 / bits;
  let extra = at + 16 / share;
  for (let k = 0; k < 16; k++) {
    const shift = 8 - bits - (k % share) * bits;
    const value = (source[at + ((k / share) | 0)] >> shift) & most;
    deltas[to + k] = value === most ? source[extra++] : value;
  }
  return extra;
}

/**
 * @param {Uint8Array} source
 * @param {number} count
 * @returns {Uint32Array}
 */
export function decodeIndices(source, count) {
  if (source[0] !== 0xd1) throw new AvatarError('packed indices of another version');
  const out = new Uint32Array(count);
  const last = new Uint32Array(2);
  let at = 1;
  for (let k = 0; k < count; k++) {
    let value = 0;
    let byte;
    let shift = 0;
    do {
      if (at >= source.length) throw new AvatarError('packed indices that end too soon');
      byte = source[at++];
      value |= (byte & 127) << shift;
      shift += 7;
    } while (byte > 127);
    const base = value & 1;
    const step = value >>> 1;
    out[k] = last[base] += (step >>> 1) ^ -(step & 1);
  }
  return out;
}
