/** Draws frames of an avatar: the passes before the picture, and the picture. */

import { project, projectionMatrix, rotationMatrix, viewMatrix, viewOf } from './camera.js';
import { Flow } from './flow.js';
import { AvatarError } from './data.js';
import { Program, emptyTexture } from './gl.js';
import { PIECES } from './glb.js';
import { nearestGaze } from './mouth.js';
import { Hair, hairProgram } from './hair.js';
import { BACKDROP, COMPOSE, FULL, HEAD_FRAGMENT, HEAD_VERTEX, MEDIAN, WEIGHTS } from './shaders.js';
import { Textures, makeTargets } from './textures.js';

const LAYERS = ['color', 'mask', 'coverage', 'uv'];
export const SKULL = -40; // mm: how deep the axis of the view lies
const FADE = 74; // mm over which the bust ends
// As in `bakery/runtime/lash_cards.py`: what shows of lashes where the photo's own do; degrees off its view,
// and eyeBlink, between which the rest appears.
const AS_PHOTOGRAPHED = 0.25;
const TURNED = [8, 32];
const SHUT = [0.2, 0.75];

/** The programs; made early, so that they compile while pictures are decoded. */
export function makePrograms(gl) {
  return {
    weights: new Program(gl, FULL, WEIGHTS),
    compose: new Program(gl, FULL, COMPOSE),
    median: new Program(gl, FULL, MEDIAN),
    backdrop: new Program(gl, FULL, BACKDROP),
    head: new Program(gl, HEAD_VERTEX, HEAD_FRAGMENT),
    hair: { plain: hairProgram(gl, 'plain') }, // the other kinds when they are wanted
  };
}

export class Painter {
  #gl;
  #about;
  #head;
  #programs;
  #textures;
  #hair = null;
  #flow = null;
  #flowMap = null;
  #products = new Float32Array(4 * 104);
  #neighbours = new Float32Array(100);
  #moving = new Float32Array(104);
  #toward; // the photo's view
  #exposure;
  #blinks;

  /**
   * @param {WebGL2RenderingContext} gl
   * @param {any} about the bundle's description
   * @param {import('./glb.js').Head} head
   * @param {Record<string, ImageBitmap>} pictures
   * @param {ReturnType<typeof makePrograms>} programs
   */
  constructor(gl, about, head, pictures, programs) {
    this.#gl = gl;
    this.#about = about;
    this.#head = head;
    this.#programs = programs;
    this.#textures = new Textures(gl, about, pictures, head);
    /** Pixels of the front view that hair with volume takes above its middle and, from any side, aside of it. */
    this.reach = [0, 0];
    if (this.#textures.locks) {
      this.#hair = new Hair(gl, head.hair);
      this.reach = reachOf(head.hair, about);
    }
    const cell = (name) => {
      const { columns, rows } = about.atlases[name];
      return [pictures[name].width / columns, pictures[name].height / rows];
    };
    this.mouthCell = cell('mouths');
    this.gazeCell = cell('gaze');
    this.targets = makeTargets(gl, this.#textures.side, this.#textures.maskSide, this.mouthCell);
    this.bottom = head.positions.reduce((low, value, k) => (k % 3 === 1 ? Math.min(low, value) : low), 0);
    this.lips = meanDepth(head, 'mouth_sheet');
    this.#toward = rotationMatrix(about.photo_camera.rotation);
    this.#exposure = meanShade(about.light, head, this.#toward);
    this.#blinks = ['Left', 'Right'].map((eye) => about.expressions.indexOf('eyeBlink' + eye));
    /** What the last frame cost. */
    this.stats = { drawCalls: 0, uniformBytes: 0, milliseconds: 0, medians: 0, compositions: 0, hairLevel: null };
  }

  /** Count a new frame. */
  start() {
    Object.assign(this.stats, { drawCalls: 0, uniformBytes: 0, medians: 0, compositions: 0, hairLevel: null });
    const gl = this.#gl;
    gl.disable(gl.DEPTH_TEST);
    gl.disable(gl.BLEND);
    gl.disable(gl.CULL_FACE);
  }

  /** Equation 4 into the face texture. */
  compose(weights, dynamic, hair) {
    const gl = this.#gl;
    const { weights: keyWeights, compose } = this.#programs;
    const textures = this.#textures;
    const { keys } = this.#about;
    const hairy = hair && textures.hairy;
    const groups = [];
    this.#products.fill(0);
    for (let e = 0; e < weights.length; e++) {
      const weight = dynamic ? weights[e] : 0;
      if (weight === 0 || !keys.some((key) => key.weights[e])) continue;
      const group = e >> 2;
      if (groups.at(-1) !== group) groups.push(group);
      keys.forEach((key, k) => {
        this.#products[4 * (8 * group + k) + (e & 3)] = key.weights[e] * weight;
      });
    }
    this.targets.weights.bind();
    keyWeights.use();
    keyWeights.textures({ masks: [gl.TEXTURE_2D_ARRAY, textures.masks] });
    gl.uniform1i(keyWeights.at('groups'), groups.length);
    if (groups.length) gl.uniform1iv(keyWeights.at('group'), groups);
    gl.uniform4fv(keyWeights.at('product'), this.#products);
    this.#triangle(4 + 4 * groups.length + this.#products.byteLength);

    this.targets.face.bind();
    compose.use();
    const [low, high] = this.targets.weights.textures;
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

  /** The median of the nearest mouths into the mouth sheet. */
  median(mouths) {
    const gl = this.#gl;
    const program = this.#programs.median;
    for (let n = 0; n < mouths.count; n++) {
      this.#neighbours[2 * n] = mouths.index[n];
      this.#neighbours[2 * n + 1] = mouths.weight[n];
    }
    this.targets.mouth.bind();
    program.use();
    program.textures({ mouths: [gl.TEXTURE_2D, this.#textures.mouths] });
    gl.uniform1i(program.at('columns'), this.#about.atlases.mouths.columns);
    gl.uniform1i(program.at('count'), mouths.count);
    gl.uniform2i(program.at('cell'), this.mouthCell[0], this.mouthCell[1]);
    gl.uniform2fv(program.at('neighbour'), this.#neighbours);
    this.#triangle(16 + this.#neighbours.byteLength);
    this.stats.medians++;
  }

  /** How the photo follows the face. */
  pull(weights) {
    const gl = this.#gl;
    this.#flow ??= new Flow(this.#about, this.#head);
    const { columns, rows } = this.#flow;
    this.#flowMap ??= emptyTexture(gl, { format: gl.RG16F, width: columns, height: rows, linear: true });
    gl.bindTexture(gl.TEXTURE_2D, this.#flowMap);
    const field = this.#flow.at(weights);
    gl.texSubImage2D(gl.TEXTURE_2D, 0, 0, 0, columns, rows, gl.RG, gl.FLOAT, field);
  }

  /** How much of the lashes of the left and of the right eye shows. */
  #cards(view, weights) {
    const [here, photo] = [view.rotation, this.#toward].map((matrix) => matrix.slice(6));
    const cosine = Math.min(here[0] * photo[0] + here[1] * photo[1] + here[2] * photo[2], 1);
    const turned = smoothstep(TURNED, (Math.acos(cosine) * 180) / Math.PI);
    return this.#blinks.map(
      (shape) => AS_PHOTOGRAPHED + (1 - AS_PHOTOGRAPHED) * Math.max(turned, smoothstep(SHUT, weights[shape])),
    );
  }

  #runs(runs) {
    const gl = this.#gl;
    for (const [first, size] of runs) {
      gl.drawElements(gl.TRIANGLES, size, gl.UNSIGNED_SHORT, 2 * first);
      this.stats.drawCalls++;
    }
  }

  #triangle(bytes) {
    this.#gl.drawArrays(this.#gl.TRIANGLES, 0, 3);
    this.stats.drawCalls++;
    this.stats.uniformBytes += bytes;
  }

  /**
   * The picture itself, into whatever is bound.
   * @param {import('./camera.js').View} view
   * @param {{weights: Float32Array, gaze: number[], options: any, inPhoto: boolean, shown: number}} state
   * @param {boolean} exact as the reference draws, nothing softened
   */
  picture(view, { weights, gaze, options, inPhoto, shown }, exact) {
    const gl = this.#gl;
    const about = this.#about;
    const textures = this.#textures;
    const { backdrop, head } = this.#programs;
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
    const hairy = this.#hair && options.hair && options.layer === 'color';
    if (hairy) { // first, for the skin below it need not be coloured then
      gl.disable(gl.CULL_FACE);
      this.#locks('cap', view, options, inPhoto, exact);
      gl.enable(gl.CULL_FACE);
    }
    head.use();
    head.textures({
      face: [gl.TEXTURE_2D, this.targets.face.textures[0]],
      mouth: [gl.TEXTURE_2D, this.targets.mouth.textures[0]],
      gaze: [gl.TEXTURE_2D, textures.gaze],
      coverage: [gl.TEXTURE_2D, textures.coverage],
      photo: [gl.TEXTURE_2D, textures.photo],
      flow: [gl.TEXTURE_2D, flow],
      hair: [gl.TEXTURE_2D, textures.hair],
      masks: [gl.TEXTURE_2D_ARRAY, textures.masks],
      shapes: [gl.TEXTURE_2D_ARRAY, textures.shapes],
    });
    let count = 0;
    for (let e = 0; e < weights.length; e++) {
      if (weights[e] === 0) continue;
      this.#moving[2 * count] = e;
      this.#moving[2 * count++ + 1] = weights[e] * textures.step;
    }
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
    gl.uniform1i(head.at('shown'), shown);
    gl.uniform1i(head.at('inPhoto'), Number(inPhoto));
    gl.uniform1i(head.at('soft'), Number(!exact));
    gl.uniform1f(head.at('scale'), -view.focal / view.translation[2]);
    this.#light(head, options, inPhoto || exact);
    gl.uniform2fv(head.at('cards'), this.#cards(view, weights));
    gl.uniform1f(head.at('lips'), this.lips);
    gl.uniform1i(head.at('geometry'), Number(options.mouth === 'geometry'));
    gl.uniform2fv(head.at('fade'), this.#fade);
    gl.uniform4fv(head.at('frame'), frame);
    gl.uniform1f(head.at('tall'), view.height);
    this.stats.uniformBytes += 128 + 8 * count + 48 + 24 + 24 + 256 + 8 + 28 + 8;
    gl.bindVertexArray(textures.array);
    this.#runs(options.mouth === 'geometry' ? textures.runs.geometry : textures.runs.image);
    if (options.layer === 'color') {
      gl.disable(gl.CULL_FACE);
      gl.enable(gl.BLEND);
      gl.blendFunc(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA);
      gl.depthMask(false); // what is seen through hides nothing
      this.#runs(textures.runs.cards);
      if (hairy) this.#locks('cards', view, options, inPhoto, exact);
      gl.depthMask(true);
    }
    gl.bindVertexArray(null);
  }

  /** Cap or cards of hair with volume. */
  #locks(part, view, options, inPhoto, exact) {
    const gl = this.#gl;
    const kind = exact ? 'exact' : options.light && !inPhoto ? 'lit' : 'plain';
    const hair = (this.#programs.hair[kind] ??= hairProgram(gl, kind));
    hair.use();
    hair.textures({ atlas: [gl.TEXTURE_2D, this.#textures.locks] });
    gl.uniformMatrix4fv(hair.at('view'), false, viewMatrix(view));
    gl.uniformMatrix4fv(hair.at('projection'), false, projectionMatrix(view));
    gl.uniform1f(hair.at('least'), Number(part === 'cap'));
    gl.uniform1i(hair.at('whole'), Number(inPhoto || exact));
    gl.uniform2fv(hair.at('fade'), this.#fade);
    if (kind === 'lit') this.#light(hair, options, false);
    const level = options.hairLevel ?? (exact ? 0 : this.#hair.levelFor(view));
    this.stats.drawCalls += this.#hair.draw(part, level, view.rotation);
    this.stats.hairLevel = level;
    this.stats.uniformBytes += 128 + 16 + 8 + 256;
  }

  /** The uniforms of another light than the photo's, if one is chosen and may be shown. */
  #light(program, { light }, photographed) {
    const gl = this.#gl;
    gl.uniform1i(program.at('lit'), Number(light && !photographed));
    gl.uniform3fv(program.at('light'), this.#about.light.flat());
    gl.uniform3fv(program.at('fresh'), rowsOf(light ?? this.#about.light));
    gl.uniformMatrix3fv(program.at('photographed'), true, this.#toward);
    gl.uniform1f(program.at('exposure'), this.#exposure);
  }

  /** Between which heights the bust appears, mm. */
  get #fade() {
    return [this.bottom + 2, this.bottom + FADE];
  }
}

/** @param {number[]} ends */
function smoothstep(ends, x) {
  const [low, high] = ends;
  const t = Math.min(Math.max((x - low) / (high - low), 0), 1);
  return t * t * (3 - 2 * t);
}

/** A light as the numbers of a uniform. */
function rowsOf(light) {
  const numbers = Array.isArray(light) ? light.flat() : [];
  if (numbers.length !== 27 || !numbers.every(Number.isFinite)) {
    throw new AvatarError('options.light: give nine rows of three numbers, or null');
  }
  return numbers;
}

/** By how much a face in its photo's light is darker than without: the harmonic mean over what it shows. */
function meanShade(light, head, turn) {
  const level = (x, y, z) => {
    const basis = [0.282095, 0.488603 * y, 0.488603 * z, 0.488603 * x, 1.092548 * x * y, 1.092548 * y * z,
      0.315392 * (3 * z * z - 1), 1.092548 * x * z, 0.546274 * (x * x - y * y)];
    return basis.reduce((sum, one, k) => sum + one * (0.2126 * light[k][0] + 0.7152 * light[k][1] + 0.0722 * light[k][2]), 0);
  };
  const front = Math.max(level(0, 0, 1), 1e-4);
  const skin = PIECES.indexOf('skin');
  let sum = 0;
  let count = 0;
  for (let v = 0; v < head.part.length; v++) {
    const n = [0, 1, 2].map((k) => head.normals[4 * v + k] / 127);
    const [x, y, z] = [0, 3, 6].map((row) => turn[row] * n[0] + turn[row + 1] * n[1] + turn[row + 2] * n[2]);
    if (head.part[v] !== skin || z < 0.3) continue;
    sum += 1 / Math.min(Math.max(level(x, y, z) / front, 0.45), 1.5);
    count++;
  }
  return count ? count / sum : 1;
}

/** How far hair reaches from the middle of the front view: up, and aside however the head is turned; pixels. */
function reachOf({ positions }, about) {
  const front = viewOf(about.front_camera);
  let [up, aside] = [0, 0];
  for (let k = 0; k < positions.length; k += 3) {
    const [x, y, z] = positions.subarray(k, k + 3);
    const [, row, distance] = project(front, [x, y, z]);
    up = Math.max(up, front.height / 2 - row);
    aside = Math.max(aside, (Math.hypot(x, z - SKULL) * front.focal) / distance);
  }
  return [up, aside];
}

/** How far forward a piece of the head is at rest, mm. */
function meanDepth(head, name) {
  const [first, count] = head.ranges[name];
  let sum = 0;
  for (let k = first; k < first + count; k++) sum += head.positions[3 * head.indices[k] + 2];
  return sum / count;
}
