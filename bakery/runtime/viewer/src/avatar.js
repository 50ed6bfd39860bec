/**
 * An avatar in a canvas. This is the module for embedding; `avatar.d.ts` has its types.
 *
 *     import { load } from './avatar.js';
 *     const avatar = await load('portrait.avatar/', { canvas });
 *     avatar.set({ jawOpen: 0.4 });
 *     avatar.render();
 */

import { framed, project, turnMatrix, turned, viewOf, withHead } from './camera.js';
import { AvatarError, checkDescription, fromUrl, headFile } from './data.js';
import { Target } from './gl.js';
import { parseHead } from './glb.js';
import { Mouths } from './mouth.js';
import { Painter, SKULL, makePrograms } from './painter.js';
import { readPictures } from './textures.js';

export { AvatarError, parseHead };
export { decodeIndices, decodeVertices } from './meshopt.js';

const ROOM = 0.48; // of the picture, from its middle, that hair with volume may take
const NECK = [0, -75, -45]; // mm: where the head turns
export const MOST_GAZE = [32, 24]; // degrees that are baked
const LIMIT = [35, 30]; // degrees an eye can turn; beyond, nothing but white would be seen

/**
 * Load a bundle.
 * @param {string | import('./data.js').Source} source URL of a bundle or its web/ folder, or a Source
 * @param {{canvas: HTMLCanvasElement | OffscreenCanvas, antialias?: boolean}} options
 * @returns {Promise<Avatar>}
 */
export async function load(source, { canvas, antialias = true }) {
  const gl = /** @type {WebGL2RenderingContext} */ (
    canvas.getContext('webgl2', { antialias, alpha: false, powerPreference: 'high-performance' })
  );
  if (!gl) throw new AvatarError('this browser has no WebGL 2; update it, or turn hardware acceleration on');
  const found = typeof source === 'string' ? await fromUrl(source) : source;
  checkDescription(found.description);
  const programs = makePrograms(gl);
  const [pictures, bytes] = await Promise.all([readPictures(found), found.file(headFile(found.description))]);
  return new Avatar(gl, found, pictures, parseHead(bytes), programs);
}

export class Avatar {
  #gl;
  #source;
  #head;
  #painter;
  #lost = false;
  #stale = true; // the face texture
  #staleFlow = true;
  #last = ''; // what the face texture was made for, besides weights

  constructor(gl, source, pictures, head, programs) {
    this.#gl = gl;
    this.#source = source;
    this.#head = head;
    const about = source.description;
    /** What web/avatar.json says. */
    this.about = about;
    /** The 52 names in order. */
    this.expressions = about.expressions;
    this.canvas = gl.canvas;
    this.weights = new Float32Array(about.expressions.length);
    this.index = new Map(about.expressions.map((name, k) => [name, k]));
    this.hasPhoto = Boolean(about.atlases.photo);
    this.hasHair = Boolean(about.atlases.hair || about.atlases.hair_cards);
    this.options = {
      stage: 'studio', dynamic: true, hair: true, hairLevel: null, mouth: 'image', light: null,
      layer: 'color', layerExpression: 'jawOpen', wall: [0.36, 0.37, 0.39], floor: [0.13, 0.135, 0.15],
    };
    this.orbit = { yaw: 0, pitch: 0, zoom: 1, shift: [0, 0] };
    this.head = [0, 0, 0];
    this.direction = null;
    this.mouths = new Mouths(about.mouths, about.lips);
    this.#upload(pictures, programs);
    this.canvas.addEventListener('webglcontextlost', (event) => {
      event.preventDefault();
      this.#lost = true;
    });
    this.canvas.addEventListener('webglcontextrestored', () => this.#restore());
  }

  #upload(pictures, programs) {
    this.#painter = new Painter(this.#gl, this.about, this.#head, pictures, programs);
    this.stats = this.#painter.stats;
    Object.values(pictures).forEach((picture) => picture.close());
    this.mouths.weight.fill(-1);
    this.#stale = this.#staleFlow = true;
  }

  async #restore() {
    const programs = makePrograms(this.#gl);
    this.#upload(await readPictures(this.#source), programs);
    this.#lost = false;
    this.canvas.dispatchEvent(new Event('avatarrestored'));
  }

  /** Set some weights by name; values are clamped to 0..1. Gaze follows the eyeLook names. */
  set(weights) {
    for (const [name, value] of Object.entries(weights)) {
      const place = this.index.get(name);
      if (place === undefined) throw new AvatarError(`no expression '${String(name).slice(0, 40)}'`);
      if (!Number.isFinite(value)) throw new AvatarError(`${name}: ${value} is no weight`);
      const weight = Math.fround(Math.min(Math.max(value, 0), 1));
      if (this.weights[place] === weight) continue;
      this.weights[place] = weight;
      if (name.startsWith('eyeLook')) this.direction = null;
      this.#stale = this.#staleFlow = true;
    }
    return this;
  }

  /** Weight of one expression. */
  get(name) {
    return this.weights[this.index.get(name)];
  }

  /** All weights to 0, eyes and head straight. */
  reset() {
    this.weights.fill(0);
    this.direction = null;
    this.head = [0, 0, 0];
    this.#stale = this.#staleFlow = true;
    return this;
  }

  /**
   * Look somewhere, degrees: yaw to the subject's left, pitch up. Sets the eyeLook weights.
   * @param {number} yaw
   * @param {number} pitch
   */
  look(yaw, pitch) {
    if (!Number.isFinite(yaw + pitch)) throw new AvatarError('gaze is no number');
    const [mostYaw, mostPitch] = this.about.eyes.degrees;
    for (const [eye, side] of [['Left', 1], ['Right', -1]]) {
      this.set({
        ['eyeLookOut' + eye]: (Number(side) * yaw) / mostYaw,
        ['eyeLookIn' + eye]: (-Number(side) * yaw) / mostYaw,
        ['eyeLookUp' + eye]: pitch / mostPitch,
        ['eyeLookDown' + eye]: -pitch / mostPitch,
      });
    }
    this.direction = [yaw, pitch];
    return this;
  }

  /** Where the eyes look, degrees: what `look` was told, else what the eyeLook weights mean. */
  get gaze() {
    if (this.direction) return this.direction.map((angle, k) => Math.min(Math.max(angle, -LIMIT[k]), LIMIT[k]));
    const [mostYaw, mostPitch] = this.about.eyes.degrees;
    const one = (name) => this.get(name);
    const yaw = one('eyeLookOutLeft') - one('eyeLookInLeft') - one('eyeLookOutRight') + one('eyeLookInRight');
    const pitch = one('eyeLookUpLeft') - one('eyeLookDownLeft') + one('eyeLookUpRight') - one('eyeLookDownRight');
    return [(mostYaw * yaw) / 2, (mostPitch * pitch) / 2];
  }

  /** Turn the head, degrees: yaw to the subject's left, pitch up, roll to its left shoulder. */
  turn(yaw, pitch, roll = 0) {
    if (!Number.isFinite(yaw + pitch + roll)) throw new AvatarError('a head turn is no number');
    this.head = [yaw, pitch, roll];
    return this;
  }

  /** Whether the portrait stands behind the face. */
  get inPhoto() {
    return this.options.stage === 'photo' && this.hasPhoto;
  }

  /**
   * The view of the canvas, or of a picture of another size.
   * @returns {import('./camera.js').View}
   */
  view(width = this.canvas.width, height = this.canvas.height) {
    const { about, orbit } = this;
    const shift = orbit.shift.map((value) => value * height);
    if (this.inPhoto) {
      const { width: wide, height: high } = about.photo_camera;
      const scale = Math.min(width / wide, height / high) * orbit.zoom;
      return framed(viewOf(about.photo_camera), [wide / 2, high / 2], scale, width, height, shift);
    }
    const front = viewOf(about.front_camera);
    const usual = (0.74 * Math.min(width * 1.12, height)) / front.width;
    const [up, aside] = this.options.hair ? this.#painter.reach : [0, 0];
    const scale = Math.min(usual, (ROOM * height) / up, (ROOM * width) / aside) * orbit.zoom;
    const middle = [front.width / 2, front.height * 0.5];
    const view = turned(framed(front, middle, scale, width, height, shift), orbit.yaw, orbit.pitch, [0, about.pivot[1], SKULL]);
    return this.head.some(Boolean) ? withHead(view, turnMatrix(...this.head), NECK) : view;
  }

  /** The view that `bakery render` has from the front, in a square picture. */
  frontView(size) {
    const front = viewOf(this.about.front_camera);
    return framed(front, [front.width / 2, front.height / 2], size / front.width, size, size);
  }

  /** Where the eyes are in the canvas: [x, y, radius] pixels, left first. */
  eyes() {
    const view = this.view();
    return this.about.eyes.centers.map(([x, y, z]) => {
      const [column, row, distance] = project(view, [x, y, z + 11]);
      return [column, row, (13 * view.focal) / distance];
    });
  }

  /** Draw into the canvas. */
  render() {
    if (this.#lost) return;
    const start = performance.now();
    this.#prepare();
    const gl = this.#gl;
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    gl.viewport(0, 0, this.canvas.width, this.canvas.height);
    this.#painter.picture(this.view(), this.#state(), false);
    this.stats.milliseconds = performance.now() - start;
  }

  /**
   * Draw a frame as the reference does: one sample a pixel, plain wall, nothing softened.
   * @param {{width: number, height: number, view?: import('./camera.js').View}} wanted
   * @returns {Uint8Array} [height, width, 4] from the top
   */
  capture({ width, height, view = this.view(width, height) }) {
    const gl = this.#gl;
    this.#prepare();
    const target = new Target(gl, { format: gl.RGBA8, width, height, depth: true });
    target.bind();
    this.#painter.picture(view, this.#state(), true);
    const out = readPixels(gl, width, height);
    target.dispose();
    return flipped(out, width, height);
  }

  /** The mouth sheet of this frame [h, w, 4], sRGB-encoded, as the median left it. */
  mouthSheet() {
    this.#prepare();
    const { mouth } = this.#painter.targets;
    mouth.bind();
    return { width: mouth.width, height: mouth.height, data: readPixels(this.#gl, mouth.width, mouth.height) };
  }

  #state() {
    const { weights, gaze, options, inPhoto } = this;
    return { weights, gaze, options, inPhoto, shown: this.index.get(options.layerExpression) ?? 0 };
  }

  /** The passes before the picture: face texture, mouth sheet, field of the photo; if anything changed. */
  #prepare() {
    const painter = this.#painter;
    const { dynamic, hair } = this.options;
    painter.start();
    const now = `${dynamic} ${hair}`;
    if (this.#stale || now !== this.#last) {
      painter.compose(this.weights, dynamic, hair);
      if (this.mouths.find(this.weights)) painter.median(this.mouths);
      this.#stale = false;
      this.#last = now;
    }
    if (this.inPhoto && this.#staleFlow) {
      painter.pull(this.weights);
      this.#staleFlow = false;
    }
  }

  /** Free the graphics card. */
  dispose() {
    this.#gl.getExtension('WEBGL_lose_context')?.loseContext();
  }
}

function readPixels(gl, width, height) {
  const out = new Uint8Array(4 * width * height);
  gl.pixelStorei(gl.PACK_ALIGNMENT, 1);
  gl.readPixels(0, 0, width, height, gl.RGBA, gl.UNSIGNED_BYTE, out);
  gl.bindFramebuffer(gl.FRAMEBUFFER, null);
  return out;
}

function flipped(rows, width, height) {
  const out = new Uint8Array(rows.length);
  for (let row = 0; row < height; row++) {
    out.set(rows.subarray(4 * width * row, 4 * width * (row + 1)), 4 * width * (height - 1 - row));
  }
  return out;
}
