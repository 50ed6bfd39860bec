/** What a bundle holds for browsers: found, checked, and only then decoded. */

/** Something about the bundle or the browser that a person can mend. */
export class AvatarError extends Error {}

const FILE = /^[A-Za-z0-9_][A-Za-z0-9._-]*$/;
const MOST_PIXELS = 64 * 2 ** 20; // of one picture, 8192 x 8192
const MOST_BYTES = 256 * 2 ** 20; // of one file
const LARGEST_SIDE = 16384;
export const EXPRESSIONS = 52;
export const MOST_KEYS = 8; // what two targets of four channels hold

/**
 * @typedef {{description: any, file: (name: string) => Promise<Uint8Array>}} Source
 */

/**
 * A source behind a URL: of a bundle's folder or of its web/ folder. Which of them is tried by the name, so
 * that nothing is asked for that is not there; under another name, the other is tried too.
 * @param {string} url
 * @returns {Promise<Source>}
 */
export async function fromUrl(url) {
  const folder = new URL(url.endsWith('/') ? url : url + '/', document.baseURI);
  const read = async (name) => {
    const answer = await fetch(new URL(name, folder));
    if (!answer.ok) throw new AvatarError(`${name}: ${answer.status} ${answer.statusText}`);
    return new Uint8Array(await answer.arrayBuffer());
  };
  const places = ['', 'web/'];
  if (folder.pathname.endsWith('.avatar/')) places.reverse();
  let failure = null;
  for (const place of places) {
    const file = (name) => read(place + name);
    try {
      const description = JSON.parse(new TextDecoder().decode(await file('avatar.json')));
      if (!Array.isArray(description.files)) return { description, file }; // else the bundle's own list
    } catch (error) {
      if (!(error instanceof AvatarError)) throw error;
      failure ??= error;
    }
  }
  throw failure ?? new AvatarError(`${url}: holds no web/avatar.json; bake it again`);
}

/**
 * The head beside the description; bundles of version 1.0 do not name it.
 * @param {any} about
 * @returns {string}
 */
export const headFile = (about) => about.geometry ?? 'head.glb';

/**
 * Refuse a description that a player could not trust.
 * @param {any} about
 */
export function checkDescription(about) {
  const need = (good, what) => {
    if (!good) throw new AvatarError(`the bundle's web/avatar.json: ${what}; bake it again`);
  };
  need(about && about.$schema === 'urn:bakery:schema:web-1', 'is not one');
  const version = String(about.asset?.version);
  need(/^1\.\d+$/.test(version), `has version ${version.slice(0, 20)}, this player reads 1.x`);
  need(allFinite(about), 'holds a number that is none');
  const names = about.expressions;
  need(Array.isArray(names) && names.length === EXPRESSIONS, 'lacks the 52 expressions');
  need(FILE.test(headFile(about)), 'names a file outside of its folder');
  need(names.every((name) => /^[A-Za-z]{1,40}$/.test(name)), 'has an odd expression');
  need(about.keys?.length >= 1 && about.keys.length <= MOST_KEYS, `needs 1 to ${MOST_KEYS} keys`);
  need(about.keys.every((key) => isRow(key.weights, EXPRESSIONS)), 'keys lack weights');
  need(isRow(about.lips?.rest, 80) && about.lips.shapes?.length === EXPRESSIONS, 'lacks the lips');
  need(about.lips.shapes.every((row) => isRow(row, 80)), 'lacks the lips');
  need(about.mouths?.length >= 1 && about.mouths.length <= 300, 'needs 1 to 300 mouths');
  need(about.mouths.every((row) => isRow(row, 80)), 'mouths lack landmarks');
  need(about.gaze?.length >= 1 && about.gaze.every((pair) => isRow(pair, 2)), 'lacks gaze');
  need(isRow(about.pose?.weights, EXPRESSIONS), 'lacks the pose of the photo');
  need(isRow(about.pivot, 3) && about.light?.length === 9, 'lacks its frame');
  need(about.eyes?.cap > 0 && isRow(about.eyes.degrees, 2), 'lacks eyes');
  need(about.eyes.centers?.length === 2 && about.eyes.centers.every((c) => isRow(c, 3)), 'lacks eyes');
  for (const name of ['photo_camera', 'front_camera']) {
    const camera = about[name];
    need(camera && camera.focal > 0 && isRow(camera.center, 2), `lacks ${name}`);
    need(isRow(camera.rotation, 3) && isRow(camera.translation, 3), `lacks ${name}`);
    need(camera.width > 0 && camera.height > 0, `lacks ${name}`);
  }
  for (const name of ['mouth_sheet', 'eye_cap_left', 'eye_cap_right']) {
    need(isRow(about.uv?.[name], 4), `lacks the place of ${name}`);
  }
  const wanted = ['neutral', ...about.keys.map((key) => key.name), 'gaze', 'mouths', 'masks', 'coverage'];
  for (const name of wanted) need(Object.hasOwn(about.atlases ?? {}, name), `lacks a picture`);
  for (const atlas of Object.values(about.atlases)) {
    need(FILE.test(atlas.file ?? ''), 'names a file outside of its folder');
    need(isCount(atlas.columns) && isCount(atlas.rows), 'has an odd grid');
    need(atlas.names?.length <= atlas.columns * atlas.rows, 'has an odd grid');
  }
  const cells = (name, count) => need(about.atlases[name].names.length === count, `${name} differ in number`);
  cells('gaze', about.gaze.length);
  cells('mouths', about.mouths.length);
  cells('masks', EXPRESSIONS);
}

const isRow = (row, length) =>
  Array.isArray(row) && row.length === length && row.every((value) => typeof value === 'number');
const isCount = (value) => Number.isInteger(value) && value >= 1 && value <= 1024;

function allFinite(value) {
  if (typeof value === 'number') return Number.isFinite(value);
  if (value && typeof value === 'object') return Object.values(value).every(allFinite);
  return true;
}

/**
 * Width and height of a PNG or WebP file, without decoding it.
 * @param {Uint8Array} bytes
 * @returns {[number, number]}
 */
export function pictureSize(bytes) {
  const view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
  const word = (at) => String.fromCharCode(...bytes.subarray(at, at + 4));
  if (bytes.length > 24 && view.getUint32(0) === 0x89504e47) {
    return [view.getUint32(16), view.getUint32(20)];
  }
  if (bytes.length > 30 && word(0) === 'RIFF' && word(8) === 'WEBP') {
    const kind = word(12);
    if (kind === 'VP8 ') return [view.getUint16(26, true) & 0x3fff, view.getUint16(28, true) & 0x3fff];
    if (kind === 'VP8L') {
      const bits = view.getUint32(21, true);
      return [(bits & 0x3fff) + 1, ((bits >>> 14) & 0x3fff) + 1];
    }
    if (kind === 'VP8X') {
      const three = (at) => view.getUint16(at, true) + (bytes[at + 2] << 16);
      return [three(24) + 1, three(27) + 1];
    }
  }
  throw new AvatarError('a picture of the bundle is neither PNG nor WebP; bake it again');
}

/**
 * Decode a picture of the bundle, samples as they are stored.
 * @param {Source} source
 * @param {{file: string, columns: number, rows: number}} atlas
 * @returns {Promise<ImageBitmap>}
 */
export async function readPicture(source, atlas) {
  const bytes = await source.file(atlas.file);
  if (bytes.length > MOST_BYTES) throw new AvatarError(`${atlas.file}: too large`);
  const [width, height] = pictureSize(bytes);
  if (width * height > MOST_PIXELS || Math.max(width, height) > LARGEST_SIDE) {
    throw new AvatarError(`${atlas.file}: ${width} x ${height} pixels, more than any bundle has`);
  }
  if (width % atlas.columns || height % atlas.rows) {
    throw new AvatarError(`${atlas.file}: does not divide into its grid; bake it again`);
  }
  const kind = bytes[0] === 0x89 ? 'image/png' : 'image/webp';
  return createImageBitmap(new Blob([/** @type {any} */ (bytes)], { type: kind }), {
    premultiplyAlpha: 'none',
    colorSpaceConversion: 'none',
  });
}
