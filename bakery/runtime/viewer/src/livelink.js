/**
 * Takes of Live Link Face (CSV), by the rules at the head of `bakery/formats/livelink.py`; the numbers
 * in brackets are those of its rules.
 */

import { AvatarError } from './data.js';
import { OTHERS } from './names.js';
import { fieldsOf, records, separatorOf } from './rows.js';

const BASE = 60; // frames that a second of the time code has unless the rows say otherwise
const BASES = [60, 50, 48, 30, 25, 24]; // in doubt the first
const NEAR = 1; // frames that a measured base may lie beside a known one
const FAST = 45; // rows a second at base 60 that may as well be the usual 30 at base 30
const DAY = 86400;
const LARGEST = 256 * 2 ** 20;
const OPTIONAL = 'TongueOut';
const HEAD = ['HeadYaw', 'HeadPitch', 'HeadRoll'];
const EYES = ['Left', 'Right'].flatMap((eye) => ['Yaw', 'Pitch', 'Roll'].map((angle) => `${eye}Eye${angle}`));
const NUMBER = /^[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?$/;
const TIMECODE = /^(\d{1,2}):(\d{1,2}):(\d{1,2}):(\d{1,3}(?:\.\d+)?)$/;
const DEGREES = 180 / Math.PI;

/**
 * @typedef {object} Take
 * @property {Float64Array} seconds [N] from the first row
 * @property {Float32Array[]} weights N times [52], in the order of `expressions`
 * @property {number[][]} head N times yaw to the subject's left, pitch up, roll to its left; degrees
 * @property {number[][] | null} eyes N times the mean gaze of both eyes: yaw, pitch; degrees
 * @property {string[]} notes what was mended while reading
 */

/** A column's name as it is compared (2). */
const plain = (name) =>
  name.trim().replace(/_R$/, 'Right').replace(/_L$/, 'Left').replace(/[\s_]/g, '').toLowerCase();

/**
 * @param {string} name how messages call the file
 * @param {Uint8Array} bytes
 * @param {string[]} expressions the 52 names
 * @param {number | null} given frames that a second of the time code has; null finds out
 * @returns {Take}
 */
export function parseTake(name, bytes, expressions, given = null) {
  if (bytes.length > LARGEST) throw new AvatarError(`${name}: more than ${LARGEST >> 20} MiB; cut the take`);
  let text;
  try {
    text = new TextDecoder('utf-8', { fatal: true }).decode(bytes);
  } catch {
    throw new AvatarError(`${name}: not text (UTF-8); give the CSV that Live Link Face wrote`);
  }
  const lines = records(name, text);
  if (!lines.length) throw new AvatarError(`${name}: holds no rows; give the CSV that Live Link Face wrote`);
  const separator = separatorOf(name, lines[0][1]);
  const header = fieldsOf(lines[0][1], separator).map((field) => field.replace(/\s+/g, ' ').replace(/\p{C}/gu, ''));
  const { places, notes } = findColumns(name, header, expressions);
  const place = places.get('timecode');
  const stamps = [...rows(lines, separator)].map(([number, fields]) => stampOf(name, number, fields[place] ?? ''));
  const base = given ?? baseOf(stamps, notes);
  const time = [];
  const values = [];
  const repeated = [];
  const outside = { count: 0, most: 0, what: '' };
  for (const [number, fields] of rows(lines, separator)) {
    const [whole, frames] = stamps[time.length + repeated.length];
    if (frames >= base) throw badStamp(name, number, fields[place], base);
    let now = whole + frames / base;
    if (time.length && now < time.at(-1) - DAY / 2) now += DAY;
    if (time.length && now <= time.at(-1)) {
      repeated.push(number);
      continue;
    }
    const filled = fields.flatMap((field, place) => (field ? [place] : []));
    const bare = [place, places.get('blendshapecount')];
    const dropped = filled.length <= 2 && filled.every((one) => bare.includes(one));
    values.push(dropped ? null : rowValues(name, number, fields, header, places, expressions, outside));
    time.push(now);
  }
  const have = values.flatMap((row, k) => (row ? [k] : []));
  if (!have.length) throw new AvatarError(`${name}: holds no frame with values; record the take again`);
  if (repeated.length) notes.push(`${listed(repeated)} left out: not later than the row before`);
  if (have.length < values.length) notes.push(`${values.length - have.length} dropped frames interpolated`);
  if (outside.count) notes.push(`${outside.count} coefficients clamped to 0..1, the farthest ${outside.what}`);
  unwrap(have.map((k) => values[k].head));
  fillDropped(time, values, have);
  return {
    seconds: Float64Array.from(time, (value) => value - time[0]),
    weights: values.map((row) => row.weights),
    head: values.map((row) => row.head),
    eyes: values[0].eyes && values.map((row) => row.eyes),
    notes,
  };
}

const some = (names) => names.slice(0, 6).join(', ') + (names.length > 6 ? ` and ${names.length - 6} more` : '');

function findColumns(name, header, expressions) {
  const wanted = ['Timecode', 'BlendShapeCount', ...expressions.map((one) => one[0].toUpperCase() + one.slice(1))];
  const known = new Set([...wanted, ...HEAD, ...EYES].map((column) => column.toLowerCase()));
  for (const one of Object.keys(OTHERS)) known.add(plain(one));
  const places = new Map();
  const others = [];
  header.forEach((field, place) => {
    const key = plain(field);
    if (!known.has(key)) others.push(field || '(no name)');
    else if (places.has(key)) throw new AvatarError(`${name}: row 1: column ${field} is there twice; remove one`);
    else places.set(key, place);
  });
  const lacks = (column) => !places.has(column.toLowerCase());
  const missing = wanted.filter((column) => column !== OPTIONAL && lacks(column));
  for (const group of [HEAD, EYES]) {
    const lacking = group.filter(lacks);
    if (lacking.length < group.length) missing.push(...lacking);
  }
  if (missing.length) {
    throw new AvatarError(`${name}: row 1: lacks column ${some(missing)}; give a CSV as Live Link Face writes it`);
  }
  const notes = others.length ? [`column ${some(others)} left out: not known`] : [];
  if (lacks(OPTIONAL)) notes.push(`no column ${OPTIONAL}; taken as 0`);
  return { places, notes };
}

/** Number and fields of the records behind the header; a decimal comma becomes a point. */
function* rows(lines, separator) {
  for (const [number, line] of lines.slice(1)) {
    const fields = fieldsOf(separator === ',' ? line : line.replaceAll(',', '.'), separator);
    if (fields.some(Boolean)) yield /** @type {[number, string[]]} */ ([number, fields]);
  }
}

/**
 * Whole seconds and frames of a row (4).
 * @returns {[number, number]}
 */
function stampOf(name, row, text) {
  const parts = TIMECODE.exec(text)?.slice(1).map(Number);
  if (!parts || parts.slice(0, 3).some((part, k) => part >= [24, 60, 60][k])) throw badStamp(name, row, text, BASE);
  return [parts[0] * 3600 + parts[1] * 60 + parts[2], parts[3]];
}

const badStamp = (name, row, text, base) =>
  new AvatarError(`${name}: row ${row}, column Timecode: '${text.slice(0, 40)}'; needs HH:MM:SS:FF.mmm, FF below ${base}`);

/** How many frames a second of the time codes has; see `find_base` in `bakery/formats/timecode.py`. */
function baseOf(stamps, notes) {
  const inside = [];
  const ends = [];
  stamps.slice(1).forEach(([whole, frames], k) => {
    const [before, last] = stamps[k];
    const later = (whole - before + DAY) % DAY;
    if (later === 0 && frames > last) inside.push(frames - last);
    if (later === 1) ends.push(last - frames);
  });
  const top = stamps.reduce((high, [, frames]) => Math.max(high, frames), 0);
  const known = BASES.filter((base) => base > top);
  if (!inside.length || !known.length) return BASE;
  const step = median(inside);
  if (!ends.length) {
    if (top < BASE / 2 && BASE / step > FAST) notes.push('too short to tell the base of its time code; taken as 60');
    return BASE;
  }
  const votes = known.map(() => 0);
  for (const apart of ends) {
    const far = known.map((base) => Math.abs(apart + step - base));
    const nearest = far.indexOf(Math.min(...far));
    if (far[nearest] <= NEAR) votes[nearest]++;
  }
  const most = Math.max(...votes);
  const base = known[votes.indexOf(most)];
  if (base === BASE || 2 * most < ends.length) return BASE;
  notes.push(`time code read at ${base} frames a second`);
  return base;
}

function median(values) {
  const sorted = values.sort((a, b) => a - b);
  const middle = sorted.length >> 1;
  return sorted.length % 2 ? sorted[middle] : (sorted[middle - 1] + sorted[middle]) / 2;
}

function rowValues(name, row, fields, header, places, expressions, outside) {
  if (fields.length !== header.length) {
    throw new AvatarError(`${name}: row ${row}: ${fields.length} fields, the header has ${header.length}; mend or remove the row`);
  }
  const count = fields[places.get('blendshapecount')];
  if (!/^\d{1,6}$/.test(count) || Number(count) !== header.length - 2) {
    throw new AvatarError(`${name}: row ${row}, column BlendShapeCount: '${count.slice(0, 40)}', but the header has ${header.length - 2} columns of values; mend or remove the row`);
  }
  const read = (column) => {
    const place = places.get(column.toLowerCase());
    const text = fields[place];
    if (!NUMBER.test(text) || !Number.isFinite(Number(text))) {
      throw new AvatarError(`${name}: row ${row}, column ${header[place]}: '${text.slice(0, 40)}' is no number; mend or remove the row`);
    }
    return Number(text);
  };
  const angle = (column) => {
    const value = read(column);
    if (Math.abs(value) > 2 * Math.PI) {
      throw new AvatarError(`${name}: row ${row}, column ${header[places.get(column.toLowerCase())]}: ${value} radians; angles in degrees must be converted`);
    }
    return value * DEGREES;
  };
  const weights = Float32Array.from(expressions, (column) => {
    const value = places.has(column.toLowerCase()) ? read(column) : 0;
    const beyond = Math.max(value - 1, -value);
    if (beyond > 0) {
      outside.count++;
      if (beyond > outside.most) [outside.most, outside.what] = [beyond, `${column} ${value.toFixed(3)}`];
    }
    return Math.min(Math.max(value, 0), 1);
  });
  for (const [other, mix] of Object.entries(OTHERS)) {
    if (!places.has(plain(other))) continue;
    const strength = Math.min(Math.max(read(plain(other)), 0), 1);
    for (const [column, share] of Object.entries(mix)) weights[expressions.indexOf(column)] += strength * share;
  }
  weights.forEach((value, k) => (weights[k] = Math.min(value, 1)));
  const head = places.has('headyaw') ? HEAD.map(angle).map((value, k) => (k < 2 ? -value : value)) : [0, 0, 0];
  if (!places.has('lefteyeyaw')) return { weights, head, eyes: null };
  const [yawL, pitchL, , yawR, pitchR] = EYES.map(angle);
  return { weights, head, eyes: [-(yawL + yawR) / 2, -(pitchL + pitchR) / 2] };
}

/** Head angles [n][3] that go the shorter way round from row to row (10), changed in place. */
function unwrap(turns) {
  for (let k = 1; k < turns.length; k++) {
    turns[k].forEach((angle, which) => {
      const before = turns[k - 1][which];
      turns[k][which] = angle - 360 * Math.round((angle - before) / 360);
    });
  }
}

/** Dropped frames lie on the line between their neighbours, in time (5). */
function fillDropped(time, values, have) {
  let next = 0;
  values.forEach((row, k) => {
    if (row) return;
    while (next < have.length && have[next] < k) next++;
    const a = have[Math.max(next - 1, 0)];
    const b = have[Math.min(next, have.length - 1)];
    const share = a === b ? 0 : Math.min(Math.max((time[k] - time[a]) / (time[b] - time[a]), 0), 1);
    values[k] = mixRows(values[a], values[b], share);
  });
}

const mix = (a, b, share) => a.map((value, k) => value + (b[k] - value) * share);
const mixRows = (a, b, share) => ({
  weights: mix(a.weights, b.weights, share),
  head: mix(a.head, b.head, share),
  eyes: a.eyes && mix(a.eyes, b.eyes, share),
});

/**
 * The take at a time (10).
 * @param {Take} take
 * @param {number} seconds
 */
export function takeAt(take, seconds) {
  const last = take.seconds.length - 1;
  let [low, high] = [0, last];
  while (high - low > 1) {
    const middle = (low + high) >> 1;
    if (take.seconds[middle] <= seconds) low = middle;
    else high = middle;
  }
  const step = take.seconds[high] - take.seconds[low];
  const share = step > 0 ? Math.min(Math.max((seconds - take.seconds[low]) / step, 0), 1) : 0;
  const row = (k) => ({ weights: take.weights[k], head: take.head[k], eyes: take.eyes && take.eyes[k] });
  return mixRows(row(low), row(high), share);
}

function listed(numbers) {
  const more = numbers.length > 6 ? ' ...' : '';
  return `${numbers.length} row${numbers.length > 1 ? 's' : ''} (${numbers.slice(0, 6).join(', ')}${more})`;
}
