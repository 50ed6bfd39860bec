/**
 * An avatar in a canvas. This is the module for embedding; `avatar.d.ts` has its types.
 *
 *     import { load } from './avatar.js';
 *     const avatar = await load('portrait.avatar/', { canvas });
 *     avatar.set({ jawOpen: 0.4 });
 *     avatar.render();
 */

import { framed, project, projectionMatrix, turnMatrix, turned, viewMatrix, viewOf, withHead } from './camera.js';
import { AvatarError, checkDescription, fromUrl } from './data.js';
import { Flow } from './flow.js';
import { Program, Target, emptyTexture } from './gl.js';
import { parseHead } from './glb.js';
import { Mouths, nearestGaze } from './mouth.js';
import { BACKDROP, COMPOSE, FULL, HEAD_FRAGMENT, HEAD_VERTEX, MEDIAN, WEIGHTS } from './shaders.js';
import { Textures, makeTargets, readPictures } from './textures.js';

export { AvatarError, parseHead };
export { decodeIndices, decodeVertices } from './meshopt.js';

const LAYERS = ['color', 'mask', 'coverage', 'uv'];
const NECK = [0, -75, -45]; // mm: where the head turns
const FADE = 46; // mm over which the bust ends
export const MOST_GAZE = [32, 24]; // degrees that are baked

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
  const [pictures, bytes] = await Promise.all([readPictures(found), found.file('head.glb')]);
  return new Avatar(gl, found, pictures, parseHead(bytes), programs);
}

function makePrograms(gl) {
  return {
    weights: new Program(gl, FULL, WEIGHTS),
    compose: new Program(gl, FULL, COMPOSE),
    median: new Program(gl, FULL, MEDIAN),
    backdrop: new Program(gl, FULL, BACKDROP),
    head: new Program(gl, HEAD_VERTEX, HEAD_FRAGMENT),
  };
}

export class Avatar {
  #gl;
  #source;
  #head;
  #programs;
  #textures;
  #targets;
  #flow = null;
  #flowMap = null;
  #lost = false;
  #stale = true; // the face texture
  #staleFlow = true;
  #last = ''; // what the face texture was made for, besides weights
  #products = new Float32Array(4 * 104);
  #neighbours = new Float32Array(100);
  #moving = new Float32Array(104);

  constructor(gl, source, pictures, head, programs) {
    this.#gl = gl;
    this.#source = source;
    this.#head = head;
    this.#programs = programs;
    const about = source.description;
    /** What web/avatar.json says. */
    this.about = about;
    /** The 52 names in order. */
    this.expressions = about.expressions;
    this.canvas = gl.canvas;
    this.weights = new Float32Array(about.expressions.length);
    this.index = new Map(about.expressions.map((name, k) => [name, k]));
    this.hasPhoto = Boolean(about.atlases.photo);
    this.hasHair = Boolean(about.atlases.hair);
    this.options = {
      stage: 'studio', dynamic: true, hair: true, mouth: 'image', light: false,
      layer: 'color', layerExpression: 'jawOpen', wall: [0.36, 0.37, 0.39], floor: [0.13, 0.135, 0.15],
    };
    this.orbit = { yaw: 0, pitch: 0, zoom: 1, shift: [0, 0] };
    this.head = [0, 0, 0];
    this.direction = null;
    this.mouths = new Mouths(about.mouths, about.lips);
    this.stats = { drawCalls: 0, uniformBytes: 0, milliseconds: 0, medians: 0, compositions: 0 };
    const bottom = head.positions.reduce((low, value, k) => (k % 3 === 1 ? Math.min(low, value) : low), 0);
    this.bottom = bottom;
    this.lips = meanDepth(head, 'mouth_sheet');
    this.#upload(pictures);
    Object.values(pictures).forEach((picture) => picture.close());
    this.canvas.addEventListener('webglcontextlost', (event) => {
      event.preventDefault();
      this.#lost = true;
    });
    this.canvas.addEventListener('webglcontextrestored', () => this.#restore());
  }

  #upload(pictures) {
    const gl = this.#gl;
    const { about } = this;
    this.#textures = new Textures(gl, about, pictures, this.#head);
    const cell = (name) => {
      const { columns, rows } = about.atlases[name];
      return [pictures[name].width / columns, pictures[name].height / rows];
    };
    this.mouthCell = cell('mouths');
    this.gazeCell = cell('gaze');
    this.photoSize = pictures.photo ? [pictures.photo.width, pictures.photo.height] : null;
    this.#targets = makeTargets(gl, this.#textures.side, this.#textures.maskSide, this.mouthCell);
    this.#flowMap = null;
    this.#stale = this.#staleFlow = true;
    this.mouths.weight.fill(-1);
  }

  async #restore() {
    this.#programs = makePrograms(this.#gl);
    const pictures = await readPictures(this.#source);
    this.#upload(pictures);
    Object.values(pictures).forEach((picture) => picture.close());
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
    if (this.direction) return this.direction;
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
    const scale = (0.74 * Math.min(width * 1.12, height) * orbit.zoom) / front.width;
    const middle = [front.width / 2, front.height * 0.5];
    const view = turned(framed(front, middle, scale, width, height, shift), orbit.yaw, orbit.pitch, about.pivot);
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
    this.#start();
    this.#prepare();
    const gl = this.#gl;
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    gl.viewport(0, 0, this.canvas.width, this.canvas.height);
    this.#picture(this.view(), false);
    this.stats.milliseconds = performance.now() - start;
  }

  /**
   * Draw a frame as the reference does: one sample a pixel, plain wall, nothing softened.
   * @param {{width: number, height: number, view?: import('./camera.js').View}} wanted
   * @returns {Uint8Array} [height, width, 4] from the top
   */
  capture({ width, height, view = this.view(width, height) }) {
    const gl = this.#gl;
    this.#start();
    this.#prepare();
    const target = new Target(gl, { format: gl.RGBA8, width, height, depth: true });
    target.bind();
    this.#picture(view, true);
    const out = readPixels(gl, width, height);
    target.dispose();
    return flipped(out, width, height);
  }

  /** The mouth sheet of this frame [h, w, 4], sRGB-encoded, as the median left it. */
  mouthSheet() {
    this.#start();
    this.#prepare();
    const { mouth } = this.#targets;
    mouth.bind();
    return { width: mouth.width, height: mouth.height, data: readPixels(this.#gl, mouth.width, mouth.height) };
  }

  #start() {
    Object.assign(this.stats, { drawCalls: 0, uniformBytes: 0, medians: 0, compositions: 0 });
  }

  /** The passes before the picture: face texture, mouth sheet, field of the photo. */
  #prepare() {
    const gl = this.#gl;
    const { dynamic, hair } = this.options;
    const now = `${dynamic} ${hair}`;
    if (this.#stale || now !== this.#last) {
      gl.disable(gl.DEPTH_TEST);
      gl.disable(gl.BLEND);
      gl.disable(gl.CULL_FACE);
      this.#compose(dynamic, hair && this.#textures.hairy);
      if (this.mouths.find(this.weights)) this.#median();
      this.#stale = false;
      this.#last = now;
    }
    if (this.inPhoto && (this.#staleFlow || !this.#flowMap)) this.#pull();
  }

  #compose(dynamic, hairy) {
    const gl = this.#gl;
    const { weights: keyWeights, compose } = this.#programs;
    const textures = this.#textures;
    const { keys } = this.about;
    const groups = [];
    this.#products.fill(0);
    for (let e = 0; e < this.weights.length; e++) {
      const weight = dynamic ? this.weights[e] : 0;
      if (weight === 0 || !keys.some((key) => key.weights[e])) continue;
      const group = e >> 2;
      if (groups.at(-1) !== group) groups.push(group);
      keys.forEach((key, k) => {
        this.#products[4 * (8 * group + k) + (e & 3)] = key.weights[e] * weight;
      });
    }
    this.#targets.weights.bind();
    keyWeights.use();
    keyWeights.textures({ masks: [gl.TEXTURE_2D_ARRAY, textures.masks] });
    gl.uniform1i(keyWeights.at('groups'), groups.length);
    if (groups.length) gl.uniform1iv(keyWeights.at('group'), groups);
    gl.uniform4fv(keyWeights.at('product'), this.#products);
    this.#triangle(4 + 4 * groups.length + this.#products.byteLength);

    this.#targets.face.bind();
    compose.use();
    const [low, high] = this.#targets.weights.textures;
    compose.textures({
      faces: [gl.TEXTURE_2D_ARRAY, textures.faces],
      low: [gl.TEXTURE_2D, low],
      high: [gl.TEXTURE_2D, high],
      hair: [gl.TEXTURE_2D, textures.hair],
    });
    gl.uniform1i(compose.at('keys'), groups.length ? keys.length : 0);
    gl.uniform1i(compose.at('hairy'), Number(hairy));
    this.#triangle(8);
    this.stats.compositions++;
  }

  #median() {
    const gl = this.#gl;
    const program = this.#programs.median;
    const { mouths } = this;
    for (let n = 0; n < mouths.count; n++) {
      this.#neighbours[2 * n] = mouths.index[n];
      this.#neighbours[2 * n + 1] = mouths.weight[n];
    }
    this.#targets.mouth.bind();
    program.use();
    program.textures({ mouths: [gl.TEXTURE_2D, this.#textures.mouths] });
    gl.uniform1i(program.at('columns'), this.about.atlases.mouths.columns);
    gl.uniform1i(program.at('count'), mouths.count);
    gl.uniform2i(program.at('cell'), this.mouthCell[0], this.mouthCell[1]);
    gl.uniform2fv(program.at('neighbour'), this.#neighbours);
    this.#triangle(16 + this.#neighbours.byteLength);
    this.stats.medians++;
  }

  #pull() {
    const gl = this.#gl;
    this.#flow ??= new Flow(this.about, this.#head);
    const { columns, rows } = this.#flow;
    this.#flowMap ??= emptyTexture(gl, { format: gl.RG16F, width: columns, height: rows, linear: true });
    gl.bindTexture(gl.TEXTURE_2D, this.#flowMap);
    const field = this.#flow.at(this.weights);
    gl.texSubImage2D(gl.TEXTURE_2D, 0, 0, 0, columns, rows, gl.RG, gl.FLOAT, field);
    this.#staleFlow = false;
  }

  #triangle(bytes) {
    this.#gl.drawArrays(this.#gl.TRIANGLES, 0, 3);
    this.stats.drawCalls++;
    this.stats.uniformBytes += bytes;
  }

  /** The picture itself, into whatever is bound. */
  #picture(view, exact) {
    const gl = this.#gl;
    const { options, about } = this;
    const textures = this.#textures;
    const { backdrop, head } = this.#programs;
    const { inPhoto } = this;
    gl.disable(gl.BLEND);
    gl.disable(gl.CULL_FACE);
    gl.disable(gl.DEPTH_TEST);
    const scale = view.focal / about.photo_camera.focal;
    const frame = [
      view.center[0] - about.photo_camera.center[0] * scale,
      view.center[1] - about.photo_camera.center[1] * scale,
      about.photo_camera.width * scale,
      about.photo_camera.height * scale,
    ];
    const flow = inPhoto ? this.#flowMap : textures.hair;

    backdrop.use();
    backdrop.textures({ photo: [gl.TEXTURE_2D, textures.photo], flow: [gl.TEXTURE_2D, flow] });
    gl.uniform4fv(backdrop.at('frame'), frame);
    gl.uniform2f(backdrop.at('size'), view.width, view.height);
    gl.uniform1i(backdrop.at('inPhoto'), Number(inPhoto));
    gl.uniform1i(backdrop.at('plain'), Number(exact && !inPhoto));
    gl.uniform3fv(backdrop.at('wall'), options.wall);
    gl.uniform3fv(backdrop.at('floorTint'), options.floor);
    this.#triangle(56);

    gl.enable(gl.DEPTH_TEST);
    gl.clear(gl.DEPTH_BUFFER_BIT);
    gl.enable(gl.CULL_FACE);
    if (!exact) {
      gl.enable(gl.BLEND);
      gl.blendFunc(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA);
    }
    head.use();
    head.textures({
      face: [gl.TEXTURE_2D, this.#targets.face.textures[0]],
      mouth: [gl.TEXTURE_2D, this.#targets.mouth.textures[0]],
      gaze: [gl.TEXTURE_2D, textures.gaze],
      coverage: [gl.TEXTURE_2D, textures.coverage],
      photo: [gl.TEXTURE_2D, textures.photo],
      flow: [gl.TEXTURE_2D, flow],
      masks: [gl.TEXTURE_2D_ARRAY, textures.masks],
      shapes: [gl.TEXTURE_2D_ARRAY, textures.shapes],
    });
    let count = 0;
    for (let e = 0; e < this.weights.length; e++) {
      if (this.weights[e] === 0) continue;
      this.#moving[2 * count] = e;
      this.#moving[2 * count++ + 1] = this.weights[e] * textures.step;
    }
    const { gaze } = this;
    const eye = nearestGaze(about.gaze, gaze);
    const cap = 2 * about.eyes.cap;
    const { columns } = about.atlases.gaze;
    const [wide, high] = this.gazeCell;
    gl.uniformMatrix4fv(head.at('view'), false, viewMatrix(view));
    gl.uniformMatrix4fv(head.at('projection'), false, projectionMatrix(view));
    gl.uniform1i(head.at('count'), count);
    if (count) gl.uniform2fv(head.at('moving'), this.#moving.subarray(0, 2 * count));
    const { uv } = about;
    gl.uniform4fv(head.at('places'), [...uv.eye_cap_left, ...uv.eye_cap_right, ...uv.mouth_sheet]);
    gl.uniform2i(head.at('eyeCell'), wide / 2, high);
    gl.uniform2i(head.at('eyeCorner'), (eye % columns) * wide, Math.floor(eye / columns) * high);
    gl.uniform2f(head.at('slide'), (gaze[0] - about.gaze[eye][0]) / cap, (about.gaze[eye][1] - gaze[1]) / cap);
    gl.uniform1i(head.at('layer'), LAYERS.indexOf(options.layer));
    gl.uniform1i(head.at('shown'), this.index.get(options.layerExpression));
    gl.uniform1i(head.at('lit'), Number(options.light && !inPhoto && !exact));
    gl.uniform1i(head.at('inPhoto'), Number(inPhoto));
    gl.uniform1i(head.at('soft'), Number(!exact));
    gl.uniform1f(head.at('scale'), -view.focal / view.translation[2]);
    gl.uniform3fv(head.at('light'), about.light.flat());
    gl.uniform1f(head.at('lips'), this.lips);
    gl.uniform2f(head.at('fade'), this.bottom + 2, this.bottom + FADE);
    gl.uniform4fv(head.at('frame'), frame);
    gl.uniform1f(head.at('tall'), view.height);
    this.stats.uniformBytes += 128 + 8 * count + 48 + 24 + 24 + 108 + 8 + 28;
    gl.bindVertexArray(textures.array);
    const runs = options.mouth === 'geometry' ? textures.runs.geometry : textures.runs.image;
    for (const [first, size] of runs) {
      gl.drawElements(gl.TRIANGLES, size, gl.UNSIGNED_SHORT, 2 * first);
      this.stats.drawCalls++;
    }
    gl.bindVertexArray(null);
  }

  /** Free the graphics card. */
  dispose() {
    this.#gl.getExtension('WEBGL_lose_context')?.loseContext();
  }
}

/** How far forward a piece of the head is at rest, mm. */
function meanDepth(head, name) {
  const [first, count] = head.ranges[name];
  let sum = 0;
  for (let k = first; k < first + count; k++) sum += head.positions[3 * head.indices[k] + 2];
  return sum / count;
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
