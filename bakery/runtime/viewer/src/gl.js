/** Small helpers over WebGL2. */

import { AvatarError } from './data.js';

/** A compiled program and its uniforms by name. */
export class Program {
  /**
   * @param {WebGL2RenderingContext} gl
   * @param {string} vertex
   * @param {string} fragment
   */
  constructor(gl, vertex, fragment) {
    this.gl = gl;
    this.handle = gl.createProgram();
    for (const [kind, text] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
      const shader = gl.createShader(/** @type {number} */ (kind));
      gl.shaderSource(shader, '#version 300 es\n' + text);
      gl.compileShader(shader);
      gl.attachShader(this.handle, shader);
      gl.deleteShader(shader);
    }
    gl.linkProgram(this.handle);
    this.places = null; // asked for on first use, so that programs compile side by side
  }

  use() {
    const { gl } = this;
    gl.useProgram(this.handle);
    if (this.places) return;
    if (!gl.getProgramParameter(this.handle, gl.LINK_STATUS) && !gl.isContextLost()) {
      const logs = gl.getAttachedShaders(this.handle).map((shader) => gl.getShaderInfoLog(shader));
      throw new AvatarError(`this browser's graphics refuse a shader: ${logs.join(' ').slice(0, 300)}`);
    }
    this.places = new Map();
    const count = gl.getProgramParameter(this.handle, gl.ACTIVE_UNIFORMS);
    for (let k = 0; k < count; k++) {
      const name = gl.getActiveUniform(this.handle, k).name.replace('[0]', '');
      this.places.set(name, gl.getUniformLocation(this.handle, name));
    }
  }

  at(name) {
    return this.places.get(name) ?? null;
  }

  /** Bind textures to units in order: name -> [target, texture]. */
  textures(table) {
    const { gl } = this;
    let unit = 0;
    for (const [name, [target, texture]] of Object.entries(table)) {
      gl.activeTexture(gl.TEXTURE0 + unit);
      gl.bindTexture(target, texture);
      gl.uniform1i(this.at(name), unit++);
    }
  }
}

/**
 * An empty 2D texture or array with clamped borders.
 * @param {WebGL2RenderingContext} gl
 * @param {{format: number, width: number, height: number, layers?: number, linear?: boolean}} wanted
 */
export function emptyTexture(gl, { format, width, height, layers = 0, linear = false }) {
  const target = layers ? gl.TEXTURE_2D_ARRAY : gl.TEXTURE_2D;
  const texture = gl.createTexture();
  gl.bindTexture(target, texture);
  if (layers) gl.texStorage3D(target, 1, format, width, height, layers);
  else gl.texStorage2D(target, 1, format, width, height);
  const filter = linear ? gl.LINEAR : gl.NEAREST;
  gl.texParameteri(target, gl.TEXTURE_MIN_FILTER, filter);
  gl.texParameteri(target, gl.TEXTURE_MAG_FILTER, filter);
  gl.texParameteri(target, gl.TEXTURE_WRAP_S, gl.CLAMP_TO_EDGE);
  gl.texParameteri(target, gl.TEXTURE_WRAP_T, gl.CLAMP_TO_EDGE);
  return texture;
}

/** A target to draw into: one or more textures, all of one size. */
export class Target {
  /**
   * @param {WebGL2RenderingContext} gl
   * @param {{format: number, width: number, height: number, count?: number, linear?: boolean, depth?: boolean}} wanted
   */
  constructor(gl, { format, width, height, count = 1, linear = false, depth = false }) {
    this.gl = gl;
    this.width = width;
    this.height = height;
    this.textures = Array.from({ length: count }, () => emptyTexture(gl, { format, width, height, linear }));
    this.handle = gl.createFramebuffer();
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.handle);
    const places = this.textures.map((texture, k) => {
      gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0 + k, gl.TEXTURE_2D, texture, 0);
      return gl.COLOR_ATTACHMENT0 + k;
    });
    gl.drawBuffers(places);
    this.depth = null;
    if (depth) {
      this.depth = gl.createRenderbuffer();
      gl.bindRenderbuffer(gl.RENDERBUFFER, this.depth);
      gl.renderbufferStorage(gl.RENDERBUFFER, gl.DEPTH_COMPONENT24, width, height);
      gl.framebufferRenderbuffer(gl.FRAMEBUFFER, gl.DEPTH_ATTACHMENT, gl.RENDERBUFFER, this.depth);
    }
    this.complete = gl.checkFramebufferStatus(gl.FRAMEBUFFER) === gl.FRAMEBUFFER_COMPLETE;
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
  }

  bind() {
    this.gl.bindFramebuffer(this.gl.FRAMEBUFFER, this.handle);
    this.gl.viewport(0, 0, this.width, this.height);
  }

  dispose() {
    const { gl } = this;
    this.textures.forEach((texture) => gl.deleteTexture(texture));
    if (this.depth) gl.deleteRenderbuffer(this.depth);
    gl.deleteFramebuffer(this.handle);
  }
}
