/** web/player.glb to arrays. Only what `bakery` writes is understood; the rest is refused. */

import { AvatarError, EXPRESSIONS } from './data.js';
import { decodeIndices, decodeVertices } from './meshopt.js';

const NEEDED = ['eye_cap_left', 'eye_cap_right', 'skin', 'mouth_sheet']; // no bundle lacks them
/** The image-based head. */
export const IMAGE = [...NEEDED, 'tongue', 'eye_socket'];
/** Seen through, from both sides; old bundles lack them. */
export const CARDS = ['tear', 'lashes'];
/** The order in which the pieces are drawn; shaders.js knows them by their place in it. */
export const PIECES = [...IMAGE, 'inside', 'teeth', ...CARDS];
const MOST_VERTICES = 65535;

/**
 * @typedef {object} Head
 * @property {Float32Array} positions [3 V] millimetres
 * @property {Int8Array} normals [4 V] of 127
 * @property {Float32Array} uv [2 V]
 * @property {Uint8Array} part [V] index into PIECES
 * @property {Uint16Array} indices
 * @property {Int16Array} shapes [52 4 V] of 32767 times `reach`
 * @property {number} reach millimetres
 * @property {Record<string, [number, number]>} ranges first and count of each piece's indices
 * @property {HairMesh | null} hair
 */

/**
 * @typedef {object} HairMesh
 * @property {Float32Array} positions [3 V] millimetres
 * @property {Int8Array} normals [4 V] of 127
 * @property {Float32Array} uv [2 V]
 * @property {({cap: Uint32Array, cards: Uint32Array, starts: number[]} | undefined)[]} levels of detail: indices of
 *   the cap, those of the cards, and where each card's begin
 */

/**
 * @param {Uint8Array} bytes of a GLB file
 * @returns {Head}
 */
export function parseHead(bytes) {
  const { document, binary } = split(bytes);
  const mesh = document.meshes?.[0];
  const scale = document.nodes?.[0]?.scale;
  if (!mesh || !scale || mesh.extras?.targetNames?.length !== EXPRESSIONS) fail('lacks its 52 shapes');
  const reach = scale[0] * 1000;
  const byName = new Map(mesh.primitives.map((one) => [document.materials[one.material].name, one]));
  const used = PIECES.filter((name) => byName.has(name));
  if (NEEDED.some((name) => !byName.has(name))) fail('lacks its skin, eyes or mouth');
  const read = (index) => readAccessor(document, binary, index);

  const counts = used.map((name) => document.accessors[byName.get(name).attributes.POSITION].count);
  const total = counts.reduce((sum, count) => sum + count, 0);
  if (total > MOST_VERTICES) fail(`has ${total} vertices, more than ${MOST_VERTICES}`);
  const sizes = used.map((name) => document.accessors[byName.get(name).indices].count);
  const head = {
    positions: new Float32Array(3 * total),
    normals: new Int8Array(4 * total),
    uv: new Float32Array(2 * total),
    part: new Uint8Array(total),
    indices: new Uint16Array(sizes.reduce((sum, size) => sum + size, 0)),
    shapes: new Int16Array(EXPRESSIONS * 4 * total),
    reach,
    ranges: {},
    hair: parseHair(document, read),
  };
  let vertex = 0;
  let index = 0;
  used.forEach((name, place) => {
    const { attributes, indices, targets } = byName.get(name);
    const positions = read(attributes.POSITION);
    for (let k = 0; k < positions.length; k++) head.positions[3 * vertex + k] = positions[k] * reach;
    head.normals.set(read(attributes.NORMAL), 4 * vertex);
    head.uv.set(read(attributes.TEXCOORD_0), 2 * vertex);
    head.part.fill(PIECES.indexOf(name), vertex, vertex + counts[place]);
    const corners = read(indices);
    for (let k = 0; k < corners.length; k++) {
      if (corners[k] >= counts[place]) fail('has a triangle without a corner');
      head.indices[index + k] = corners[k] + vertex;
    }
    if (targets?.length !== EXPRESSIONS) fail('lacks its 52 shapes');
    targets.forEach((target, shape) => head.shapes.set(read(target.POSITION), 4 * (shape * total + vertex)));
    head.ranges[name] = [index, corners.length];
    vertex += counts[place];
    index += corners.length;
  });
  return head;
}

/** Hair with volume, or null: a mesh of primitives that share their vertices. */
function parseHair(document, read) {
  const number = document.meshes.findIndex((mesh) => mesh.name === 'hair');
  if (number < 0 || !document.meshes[number].primitives?.length) return null;
  const scale = document.nodes.find((node) => node.mesh === number)?.scale?.[0] * 1000;
  const { primitives } = document.meshes[number];
  const { POSITION, NORMAL, TEXCOORD_0 } = primitives[0].attributes;
  const hair = { positions: read(POSITION).map((value) => value * scale), normals: read(NORMAL), uv: read(TEXCOORD_0), levels: [] };
  const total = hair.positions.length / 3;
  if (!(scale > 0) || hair.normals.length !== 4 * total || hair.uv.length !== 2 * total) fail('has damaged hair');
  for (const { attributes, indices, extras } of primitives) {
    const corners = Uint32Array.from(read(indices));
    const { level, cards } = extras ?? {};
    if (attributes.POSITION !== POSITION || !(level >= 0 && level < 3) || !Array.isArray(cards)) fail('has damaged hair');
    if (corners.some((corner) => corner >= total)) fail('has a triangle without a corner');
    const found = (hair.levels[level] ??= { cap: new Uint32Array(0), cards: new Uint32Array(0), starts: [] });
    if (!cards.length) {
      found.cap = corners;
      continue;
    }
    let end = 0;
    found.starts = cards.map((count) => (Number.isInteger(count) && count > 0 ? (end += 3 * count) - 3 * count : fail('has damaged hair')));
    if (end !== corners.length) fail('has damaged hair');
    found.cards = corners;
  }
  return hair;
}

function fail(what) {
  throw new AvatarError(`the bundle's head for browsers ${what}; bake it again`);
}

function split(bytes) {
  const view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
  if (bytes.length < 20 || view.getUint32(0, true) !== 0x46546c67) fail('is no GLB file');
  const length = view.getUint32(12, true);
  if (20 + length + 8 > bytes.length) fail('is cut short');
  const document = JSON.parse(new TextDecoder().decode(bytes.subarray(20, 20 + length)));
  return { document, binary: bytes.subarray(28 + length) };
}

const KINDS = { 5120: Int8Array, 5122: Int16Array, 5123: Uint16Array, 5125: Uint32Array, 5126: Float32Array };

function readAccessor(document, binary, number) {
  const accessor = document.accessors[number];
  const packed = document.bufferViews[accessor.bufferView].extensions.EXT_meshopt_compression;
  const { byteOffset = 0, byteLength, byteStride, count, mode } = packed;
  if (count !== accessor.count || count > 4 * 2 ** 20 || byteStride > 256) fail('is damaged');
  if (byteOffset + byteLength > binary.length) fail('is cut short');
  const source = binary.subarray(byteOffset, byteOffset + byteLength);
  const Kind = KINDS[accessor.componentType];
  if (mode === 'ATTRIBUTES') return new Kind(decodeVertices(source, count, byteStride).buffer);
  return Kind.from(decodeIndices(source, count));
}
