/**
 * Hair with volume: an opaque cap, and cards over it, the farthest first. They are sorted for each view by the
 * middle of the card; `bakery/runtime/hair_cards.py` is the reference.
 */

import { Program } from './gl.js';
import { COLOR, SHINE } from './shaders.js';

const SKULL = 240; // mm, about as tall as a head
const ENOUGH = [420, 160]; // pixels of a head below which a coarser level of detail will do

// Written out for each kind: a graphics card of software works through both sides of a branch.
const vertex = (kind) => `
precision highp float;
layout(location = 0) in vec3 position;
layout(location = 1) in vec4 normal;
layout(location = 2) in vec2 texel;
uniform mat4 view, projection;
uniform bool whole;
uniform vec2 fade; // mm, where the bust ends and where it is whole
${kind === 'lit' ? `${SHINE}\nout vec3 tint;` : ''}
out vec2 uv;
out float shows;
void main() {
  uv = texel;
  shows = whole ? 1.0 : smoothstep(fade.x, fade.y, position.y);
  ${kind === 'lit' ? 'tint = relit(normalize(normal.xyz));' : ''}
  gl_Position = projection * (view * vec4(position, 1.0));
}`;

// The atlas is sRGB-encoded and not multiplied by alpha. The reference reads it without mipmaps, colour
// multiplied by alpha before it is mixed, in linear light: so does the kind `exact`.
const fragment = (kind) => `
precision highp float;
${kind === 'lit' ? 'in vec3 tint;' : ''}
in vec2 uv;
in float shows;
uniform sampler2D atlas;
uniform float least; // alpha: 1 for the cap, which is opaque
out vec4 color;
${COLOR}
vec4 exact() {
  ivec2 size = textureSize(atlas, 0);
  vec2 p = uv * vec2(size) - 0.5;
  ivec2 low = ivec2(floor(p));
  vec2 t = p - floor(p);
  vec4 sum = vec4(0.0);
  for (int k = 0; k < 4; k++) {
    ivec2 step = ivec2(k & 1, k >> 1);
    vec4 one = texelFetch(atlas, clamp(low + step, ivec2(0), size - 1), 0);
    vec2 share = mix(1.0 - t, t, vec2(step));
    sum += share.x * share.y * vec4(toLinear(one.rgb) * one.a, one.a);
  }
  return vec4(toEncoded(sum.rgb / max(sum.a, 1e-3)), sum.a);
}
void main() {
  color = ${kind === 'exact' ? 'exact()' : 'texture(atlas, uv)'};
  color.a = max(color.a, least) * shows;
  if (color.a < 0.002) discard;
  ${kind === 'lit' ? 'color.rgb = toEncoded(toLinear(color.rgb) * tint);' : ''}
}`;

/**
 * A program that draws hair.
 * @param {WebGL2RenderingContext} gl
 * @param {'plain' | 'lit' | 'exact'} kind
 */
export const hairProgram = (gl, kind) => new Program(gl, vertex(kind), fragment(kind));

/** Hair on the graphics card. */
export class Hair {
  #gl;
  #levels;
  #array;

  /**
   * @param {WebGL2RenderingContext} gl
   * @param {import('./glb.js').HairMesh} mesh
   */
  constructor(gl, mesh) {
    this.#gl = gl;
    this.#levels = mesh.levels.map((level) => level && { ...level, middles: middlesOf(mesh, level), sorted: level.cards.slice(), seen: [] });
    this.#array = gl.createVertexArray();
    gl.bindVertexArray(this.#array);
    const attribute = (place, data, size, kind, normalized) => {
      gl.bindBuffer(gl.ARRAY_BUFFER, gl.createBuffer());
      gl.bufferData(gl.ARRAY_BUFFER, data, gl.STATIC_DRAW);
      gl.enableVertexAttribArray(place);
      gl.vertexAttribPointer(place, size, kind, normalized, 0, 0);
    };
    attribute(0, mesh.positions, 3, gl.FLOAT, false);
    attribute(1, mesh.normals, 4, gl.BYTE, true);
    attribute(2, mesh.uv, 2, gl.FLOAT, false);
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, gl.createBuffer());
    gl.bindVertexArray(null);
    this.held = null; // whose indices lie on the card
  }

  /** The level of detail that a view needs, 0 the finest; on phones one coarser. */
  levelFor(view) {
    const tall = (SKULL * view.focal) / -view.translation[2];
    const phone = globalThis.matchMedia?.('(pointer: coarse)').matches;
    return Math.min(ENOUGH.filter((least) => tall < least).length + Number(phone ?? false), ENOUGH.length);
  }

  /** What stands for a level: itself, or the nearest finer one that shows anything. */
  #level(number) {
    for (let k = Math.min(Math.max(number, 0), this.#levels.length - 1); k >= 0; k--) {
      if (this.#levels[k]) return this.#levels[k];
    }
    return this.#levels.find(Boolean);
  }

  /** The cards of a level, far first, on the graphics card, behind its cap. */
  #sort(level, rotation) {
    const gl = this.#gl;
    const toward = rotation.slice(6);
    const turned = toward.some((value, k) => value !== level.seen[k]);
    if (turned) {
      const { middles, starts, cards, sorted } = level;
      const depth = Float64Array.from(starts.keys(), (k) => middles[3 * k] * toward[0] + middles[3 * k + 1] * toward[1] + middles[3 * k + 2] * toward[2]);
      const order = Array.from(starts.keys()).sort((a, b) => depth[a] - depth[b]);
      let at = 0;
      for (const card of order) {
        const piece = cards.subarray(starts[card], starts[card + 1] ?? cards.length);
        sorted.set(piece, at);
        at += piece.length;
      }
      level.seen = toward;
    }
    if (turned || this.held !== level) {
      gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, 4 * (level.cap.length + level.sorted.length), gl.DYNAMIC_DRAW);
      gl.bufferSubData(gl.ELEMENT_ARRAY_BUFFER, 0, level.cap);
      gl.bufferSubData(gl.ELEMENT_ARRAY_BUFFER, 4 * level.cap.length, level.sorted);
      this.held = level;
    }
  }

  /**
   * Draw cap or cards; the program is in use.
   * @param {'cap' | 'cards'} part
   * @param {number} number of the level of detail
   * @param {number[]} rotation [9] of the view
   * @returns {number} of draw calls
   */
  draw(part, number, rotation) {
    const gl = this.#gl;
    const level = this.#level(number);
    const count = level?.[part].length;
    if (!count) return 0;
    gl.bindVertexArray(this.#array);
    this.#sort(level, rotation);
    gl.drawElements(gl.TRIANGLES, count, gl.UNSIGNED_INT, part === 'cap' ? 0 : 4 * level.cap.length);
    gl.bindVertexArray(null);
    return 1;
  }
}

/** The mean of the corners of each card's triangles [3 cards]. */
function middlesOf({ positions }, { cards, starts }) {
  const out = new Float64Array(3 * starts.length);
  starts.forEach((first, card) => {
    const end = starts[card + 1] ?? cards.length;
    for (let k = first; k < end; k++) {
      for (let axis = 0; axis < 3; axis++) out[3 * card + axis] += positions[3 * cards[k] + axis] / (end - first);
    }
  });
  return out;
}
