/** The bundle's pictures and shapes on the graphics card. */

import { AvatarError, EXPRESSIONS, readPicture } from './data.js';
import { Program, Target, emptyTexture } from './gl.js';
import { CARDS, IMAGE, PIECES } from './glb.js';
import { FULL, PACK } from './shaders.js';

const SHAPE_COLUMNS = 256;

/**
 * Decode all pictures of a bundle.
 * @param {import('./data.js').Source} source
 * @returns {Promise<Record<string, ImageBitmap>>}
 */
export async function readPictures(source) {
  const { atlases, keys } = source.description;
  const wanted = ['neutral', ...keys.map((key) => key.name), 'gaze', 'mouths', 'masks', 'coverage', 'hair', 'hair_cards', 'photo'];
  const found = wanted.filter((name) => Object.hasOwn(atlases, name));
  const pictures = await Promise.all(found.map((name) => readPicture(source, atlases[name])));
  return Object.fromEntries(found.map((name, k) => [name, pictures[k]]));
}

/** Everything of a bundle that lies on the graphics card. */
export class Textures {
  /**
   * @param {WebGL2RenderingContext} gl
   * @param {any} about the bundle's description
   * @param {Record<string, ImageBitmap>} pictures
   * @param {import('./glb.js').Head} head
   */
  constructor(gl, about, pictures, head) {
    this.gl = gl;
    const most = gl.getParameter(gl.MAX_TEXTURE_SIZE);
    for (const [name, picture] of Object.entries(pictures)) {
      if (Math.max(picture.width, picture.height) > most) {
        throw new AvatarError(`${name}: ${picture.width} x ${picture.height} texels, this device takes ${most}; bake with --preset mobile`);
      }
    }
    gl.pixelStorei(gl.UNPACK_PREMULTIPLY_ALPHA_WEBGL, false);
    gl.pixelStorei(gl.UNPACK_COLORSPACE_CONVERSION_WEBGL, gl.NONE);
    gl.pixelStorei(gl.UNPACK_FLIP_Y_WEBGL, false);
    this.side = pictures.neutral.width;
    this.faces = this.#stack(['neutral', ...about.keys.map((key) => key.name)].map((name) => pictures[name]));
    this.mouths = this.#plain(pictures.mouths, gl.RGBA8);
    this.gaze = this.#plain(pictures.gaze, gl.RGBA8);
    this.coverage = this.#plain(pictures.coverage ?? blank(255), gl.RGBA8, true);
    this.hairy = Boolean(pictures.hair);
    this.hair = this.#plain(pictures.hair ?? blank(0), gl.SRGB8_ALPHA8, true, this.hairy);
    this.locks = head.hair && pictures.hair_cards ? this.#plain(pictures.hair_cards, gl.RGBA8, true, true) : null;
    // Many cards lie over each other: one level of the picture is read, not two.
    if (this.locks) gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, gl.LINEAR_MIPMAP_NEAREST);
    this.photo = this.#plain(pictures.photo ?? blank(0), gl.SRGB8_ALPHA8, true, Boolean(pictures.photo));
    this.masks = this.#masks(pictures.masks, about.atlases.masks);
    this.#geometry(head);
  }

  #stack(pictures) {
    const { gl, side } = this;
    const texture = emptyTexture(gl, { format: gl.SRGB8_ALPHA8, width: side, height: side, layers: pictures.length });
    pictures.forEach((picture, layer) => {
      if (picture.width !== side || picture.height !== side) throw new AvatarError('face pictures differ in size; bake the bundle again');
      gl.texSubImage3D(gl.TEXTURE_2D_ARRAY, 0, 0, 0, layer, side, side, 1, gl.RGBA, gl.UNSIGNED_BYTE, picture);
    });
    return texture;
  }

  #plain(picture, format, linear = false, mipmaps = false) {
    const { gl } = this;
    const texture = gl.createTexture();
    gl.bindTexture(gl.TEXTURE_2D, texture);
    const { width, height } = picture;
    const levels = mipmaps ? Math.floor(Math.log2(Math.max(width, height))) + 1 : 1;
    gl.texStorage2D(gl.TEXTURE_2D, levels, format, width, height);
    if (picture.data) gl.texSubImage2D(gl.TEXTURE_2D, 0, 0, 0, width, height, gl.RGBA, gl.UNSIGNED_BYTE, picture.data);
    else gl.texSubImage2D(gl.TEXTURE_2D, 0, 0, 0, gl.RGBA, gl.UNSIGNED_BYTE, picture);
    if (mipmaps) gl.generateMipmap(gl.TEXTURE_2D);
    const filter = linear ? gl.LINEAR : gl.NEAREST;
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, mipmaps ? gl.LINEAR_MIPMAP_LINEAR : filter);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MAG_FILTER, filter);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_WRAP_S, gl.CLAMP_TO_EDGE);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_WRAP_T, gl.CLAMP_TO_EDGE);
    return texture;
  }

  /** The grid of 52 grey masks as an array, four to a layer. */
  #masks(picture, atlas) {
    const { gl } = this;
    const side = picture.width / atlas.columns;
    const layers = Math.ceil(EXPRESSIONS / 4);
    const grid = this.#plain(picture, gl.RGBA8);
    const packed = emptyTexture(gl, { format: gl.RGBA8, width: side, height: side, layers, linear: true });
    const program = new Program(gl, FULL, PACK);
    const frame = gl.createFramebuffer();
    gl.bindFramebuffer(gl.FRAMEBUFFER, frame);
    gl.viewport(0, 0, side, side);
    gl.disable(gl.DEPTH_TEST);
    gl.disable(gl.BLEND);
    gl.disable(gl.CULL_FACE);
    program.use();
    program.textures({ atlas: [gl.TEXTURE_2D, grid] });
    gl.uniform1i(program.at('columns'), atlas.columns);
    gl.uniform1i(program.at('count'), EXPRESSIONS);
    gl.uniform1i(program.at('side'), side);
    for (let layer = 0; layer < layers; layer++) {
      gl.framebufferTextureLayer(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, packed, 0, layer);
      gl.uniform1i(program.at('first'), 4 * layer);
      gl.drawArrays(gl.TRIANGLES, 0, 3);
    }
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    gl.deleteFramebuffer(frame);
    gl.deleteTexture(grid);
    gl.deleteProgram(program.handle);
    this.maskSide = side;
    return packed;
  }

  #geometry(head) {
    const { gl } = this;
    const total = head.part.length;
    this.array = gl.createVertexArray();
    gl.bindVertexArray(this.array);
    const attribute = (place, data, size, kind, normalized) => {
      gl.bindBuffer(gl.ARRAY_BUFFER, gl.createBuffer());
      gl.bufferData(gl.ARRAY_BUFFER, data, gl.STATIC_DRAW);
      gl.enableVertexAttribArray(place);
      if (kind === gl.UNSIGNED_BYTE) gl.vertexAttribIPointer(place, size, kind, 0, 0);
      else gl.vertexAttribPointer(place, size, kind, normalized, 0, 0);
    };
    attribute(0, head.positions, 3, gl.FLOAT, false);
    attribute(1, head.normals, 4, gl.BYTE, true);
    attribute(2, head.uv, 2, gl.FLOAT, false);
    attribute(3, head.part, 1, gl.UNSIGNED_BYTE, false);
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, gl.createBuffer());
    gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, head.indices, gl.STATIC_DRAW);
    gl.bindVertexArray(null);

    const rows = Math.ceil(total / SHAPE_COLUMNS);
    this.shapes = emptyTexture(gl, { format: gl.RGBA16I, width: SHAPE_COLUMNS, height: rows, layers: EXPRESSIONS });
    const padded = new Int16Array(4 * SHAPE_COLUMNS * rows);
    for (let e = 0; e < EXPRESSIONS; e++) {
      padded.set(head.shapes.subarray(4 * e * total, 4 * (e + 1) * total));
      gl.texSubImage3D(gl.TEXTURE_2D_ARRAY, 0, 0, 0, e, SHAPE_COLUMNS, rows, 1, gl.RGBA_INTEGER, gl.SHORT, padded);
    }
    this.step = head.reach / 32767;
    /** Runs of indices: the image-based head; the one with teeth of its own; lashes and tear line. */
    const runs = (names) => names.filter((name) => head.ranges[name]).map((name) => head.ranges[name]);
    const solid = PIECES.filter((name) => !CARDS.includes(name));
    this.runs = {
      image: join(runs(IMAGE)),
      geometry: join(runs(solid.filter((name) => name !== 'mouth_sheet'))),
      cards: this.hairy ? join(runs(CARDS)) : [],
    };
  }
}

/** Neighbouring runs of indices as one, so that they are drawn at once. */
function join(runs) {
  const out = [];
  for (const [first, count] of runs) {
    const last = out.at(-1);
    if (last && last[0] + last[1] === first) last[1] += count;
    else out.push([first, count]);
  }
  return out;
}

const blank = (value) => ({ width: 1, height: 1, data: new Uint8Array(4).fill(value) });

/**
 * The targets of the passes before the picture, as fine as the device draws.
 * @param {WebGL2RenderingContext} gl
 */
export function makeTargets(gl, side, maskSide, mouthCell) {
  const fine = gl.getExtension('EXT_color_buffer_float') || gl.getExtension('EXT_color_buffer_half_float');
  const face = (format) => new Target(gl, { format, width: side, height: side, linear: true });
  const weights = (format) => new Target(gl, { format, width: maskSide, height: maskSide, count: 2, linear: true });
  let targets = fine && { face: face(gl.RGBA16F), weights: weights(gl.RGBA16F) };
  if (!targets || !targets.face.complete || !targets.weights.complete) {
    targets = { face: face(gl.SRGB8_ALPHA8), weights: weights(gl.RGBA8) };
  }
  const mouth = new Target(gl, { format: gl.RGBA8, width: mouthCell[0], height: mouthCell[1] });
  return { ...targets, mouth };
}
