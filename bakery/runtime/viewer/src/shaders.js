/** What runs on the graphics card. */

export const COLOR = `
vec3 toLinear(vec3 c) {
  return mix(c / 12.92, pow((max(c, 0.04045) + 0.055) / 1.055, vec3(2.4)), step(0.04045, c));
}
vec3 toEncoded(vec3 c) {
  c = clamp(c, 0.0, 1.0);
  return mix(c * 12.92, 1.055 * pow(max(c, 0.0031308), vec3(1.0 / 2.4)) - 0.055, step(0.0031308, c));
}`;

/** Another light than the photo's, at a normal. */
export const SHINE = `
uniform vec3 light[9], fresh[9]; // the photo's, relative to its camera; another, relative to the head
uniform mat3 photographed; // head to the photo's camera
uniform float exposure; // keeps the face as bright as it was, on average
vec3 shine(vec3 rows[9], vec3 n) { // as bakery/geometry/harmonics.py
  return 0.282095 * rows[0] + 0.488603 * (n.y * rows[1] + n.z * rows[2] + n.x * rows[3])
    + 1.092548 * (n.x * n.y * rows[4] + n.y * n.z * rows[5] + n.x * n.z * rows[7])
    + 0.315392 * (3.0 * n.z * n.z - 1.0) * rows[6] + 0.546274 * (n.x * n.x - n.y * n.y) * rows[8];
}
float luma(vec3 c) { return dot(c, vec3(0.2126, 0.7152, 0.0722)); }
vec3 relit(vec3 n) { // what the photo's colours are multiplied by
  float was = luma(shine(light, photographed * n)) / max(luma(shine(light, vec3(0.0, 0.0, 1.0))), 1e-4);
  return exposure * max(shine(fresh, n), 0.02) / clamp(was, 0.45, 1.5);
}`;

/** A triangle that covers the target. */
export const FULL = `
void main() {
  vec2 corner = vec2(gl_VertexID == 1 ? 3.0 : -1.0, gl_VertexID == 2 ? 3.0 : -1.0);
  gl_Position = vec4(corner, 0.0, 1.0);
}`;

/** Cells of the mask atlas, four to a layer. */
export const PACK = `
precision highp float;
uniform sampler2D atlas;
uniform int first, columns, count, side;
out vec4 mask;
float cell(int number) {
  if (number >= count) return 0.0;
  ivec2 corner = ivec2(number % columns, number / columns) * side;
  return texelFetch(atlas, corner + ivec2(gl_FragCoord.xy), 0).r;
}
void main() { mask = vec4(cell(first), cell(first + 1), cell(first + 2), cell(first + 3)); }`;

/** Weights w_k of equation 4, normalised; w_0 is what they leave of 1. */
export const WEIGHTS = `
precision highp float;
precision highp sampler2DArray;
uniform sampler2DArray masks;
uniform int groups;
uniform int group[13];
uniform vec4 product[104]; // a_e^k a_e^t, four expressions each, eight keys a group
layout(location = 0) out vec4 low;
layout(location = 1) out vec4 high;
void main() {
  ivec2 place = ivec2(gl_FragCoord.xy);
  low = vec4(0.0);
  high = vec4(0.0);
  for (int g = 0; g < groups; g++) {
    vec4 a = texelFetch(masks, ivec3(place, group[g]), 0);
    int k = 8 * group[g];
    low += vec4(dot(a, product[k]), dot(a, product[k + 1]), dot(a, product[k + 2]), dot(a, product[k + 3]));
    high += vec4(dot(a, product[k + 4]), dot(a, product[k + 5]), dot(a, product[k + 6]), dot(a, product[k + 7]));
  }
  float total = dot(low, vec4(1.0)) + dot(high, vec4(1.0));
  float scale = 1.0 / max(1.0, total); // w_0 + sum is 1 or, where w_0 is 0, the sum
  low *= scale;
  high *= scale;
}`;

/** Equation 4, then the hair over it; texel by texel. */
export const COMPOSE = `
precision highp float;
precision highp sampler2DArray;
uniform sampler2DArray faces;
uniform sampler2D low, high, hair;
uniform int keys;
uniform bool hairy;
out vec4 color;
void main() {
  ivec2 place = ivec2(gl_FragCoord.xy);
  vec2 uv = gl_FragCoord.xy / vec2(textureSize(faces, 0).xy);
  vec4 one = texture(low, uv), two = texture(high, uv);
  float w[8] = float[](one.x, one.y, one.z, one.w, two.x, two.y, two.z, two.w);
  float rest = 1.0 - dot(one, vec4(1.0)) - dot(two, vec4(1.0));
  vec3 c = rest * texelFetch(faces, ivec3(place, 0), 0).rgb;
  for (int k = 0; k < keys; k++)
    if (w[k] > 1e-4) c += w[k] * texelFetch(faces, ivec3(place, k + 1), 0).rgb;
  if (hairy) {
    vec4 h = texelFetch(hair, place, 0);
    c = c * (1.0 - h.a) + h.rgb * h.a;
  }
  color = vec4(c, 1.0);
}`;

/** Weighted median of the nearest mouths: the smallest value whose weights reach half, bit by bit. */
export const MEDIAN = `
precision highp float;
uniform sampler2D mouths;
uniform int columns, count;
uniform ivec2 cell;
uniform vec2 neighbour[50]; // index, weight
out vec4 median;
void main() {
  ivec2 place = ivec2(gl_FragCoord.xy);
  vec3 seen[50];
  float total = 0.0;
  for (int n = 0; n < count; n++) {
    int index = int(neighbour[n].x);
    ivec2 corner = ivec2(index % columns, index / columns) * cell;
    seen[n] = floor(texelFetch(mouths, corner + place, 0).rgb * 255.0 + 0.5);
    total += neighbour[n].y;
  }
  vec3 value = vec3(0.0);
  for (float bit = 128.0; bit >= 1.0; bit *= 0.5) {
    vec3 most = value + bit - 1.0; // with this bit 0
    vec3 reached = vec3(0.0);
    for (int n = 0; n < count; n++) reached += neighbour[n].y * vec3(lessThanEqual(seen[n], most));
    value += bit * vec3(lessThan(reached, vec3(0.5 * total)));
  }
  median = vec4(value / 255.0, 1.0);
}`;

export const HEAD_VERTEX = `
precision highp float;
precision highp isampler2DArray;
layout(location = 0) in vec3 position;
layout(location = 1) in vec4 normal;
layout(location = 2) in vec2 texel;
layout(location = 3) in uint piece;
uniform mat4 view, projection;
uniform isampler2DArray shapes;
uniform int count;
uniform vec2 moving[52]; // shape, millimetres of a step
uniform vec2 cards; // how much of the left and of the right eye's lashes shows
const float BEHIND = 8.0; // mm
flat out float shows;
out vec2 uv;
out vec3 bent;
out vec2 place; // mm: height at rest and depth
flat out uint part;
void main() {
  vec3 p = position;
  ivec2 cell = ivec2(gl_VertexID & 255, gl_VertexID >> 8);
  for (int k = 0; k < count; k++)
    p += moving[k].y * vec3(texelFetch(shapes, ivec3(cell, int(moving[k].x)), 0).xyz);
  uv = texel;
  part = piece;
  bent = normal.xyz;
  place = vec2(position.y, p.z);
  shows = position.x < 0.0 ? cards.y : cards.x;
  vec4 seen = view * vec4(p, 1.0);
  gl_Position = projection * seen;
  if (piece == 3u) { // farther, for the tongue; render.BEHIND is the reference
    vec4 behind = projection * (seen - vec4(0.0, 0.0, BEHIND, 0.0));
    gl_Position.z = behind.z / behind.w * gl_Position.w;
  }
}`;

export const HEAD_FRAGMENT = `
precision highp float;
precision highp sampler2DArray;
in vec2 uv;
in vec3 bent;
in vec2 place;
flat in float shows;
flat in uint part;
uniform sampler2D face, mouth, gaze, coverage, photo, flow, hair;
uniform sampler2DArray masks;
uniform vec4 places[3]; // rectangles of eye_cap_left, eye_cap_right, mouth_sheet in the atlas
uniform ivec2 eyeCell, eyeCorner;
uniform vec2 slide; // of the eyes' picture, beyond its own direction
uniform int layer, shown;
uniform bool lit, inPhoto, soft, geometry;
uniform float lips; // mm: how far forward they are at rest
uniform vec2 fade; // mm, where the bust ends and where it is whole
uniform vec4 frame; // of the photo: left, top, width, height in pixels of the target
uniform float tall; // pixels of the target
uniform float scale; // pixels a millimetre
const float SHADE = 1.4; // mm
out vec4 color;
${COLOR}
${SHINE}
vec3 four(sampler2D map, ivec2 corner, ivec2 size, vec2 local) {
  vec2 p = local * vec2(size) - 0.5;
  vec2 low = floor(p);
  vec2 t = p - low;
  ivec2 a = clamp(ivec2(low), ivec2(0), size - 1), b = clamp(ivec2(low) + 1, ivec2(0), size - 1);
  vec3 aa = toLinear(texelFetch(map, corner + a, 0).rgb);
  vec3 ba = toLinear(texelFetch(map, corner + ivec2(b.x, a.y), 0).rgb);
  vec3 ab = toLinear(texelFetch(map, corner + ivec2(a.x, b.y), 0).rgb);
  vec3 bb = toLinear(texelFetch(map, corner + b, 0).rgb);
  return mix(mix(aa, ba, t.x), mix(ab, bb, t.x), t.y);
}
// As the reference reads it: no mipmaps, colour multiplied by alpha before it is mixed.
vec4 exactCard(vec2 uv) {
  ivec2 size = textureSize(hair, 0);
  vec2 p = uv * vec2(size) - 0.5;
  ivec2 low = ivec2(floor(p));
  vec2 t = p - floor(p);
  vec4 sum = vec4(0.0);
  for (int k = 0; k < 4; k++) {
    ivec2 step = ivec2(k & 1, k >> 1);
    vec4 one = texelFetch(hair, clamp(low + step, ivec2(0), size - 1), 0);
    vec2 share = mix(1.0 - t, t, vec2(step));
    sum += share.x * share.y * vec4(one.rgb * one.a, one.a);
  }
  return vec4(sum.rgb / max(sum.a, 1e-6), sum.a);
}
float shade(float behind) { return 0.05 + 0.6 * exp(-max(behind, 0.0) / 13.0); }
vec3 heat(float x) {
  return clamp(vec3(1.9 * x, 2.4 * x - 0.7, 0.25 + 1.6 * x - 2.6 * x * x + 1.2 * x * x * x), 0.0, 1.0);
}
void main() {
  if (part > 7u) { // lashes and tear line
    vec4 card = soft ? texture(hair, uv) : exactCard(uv);
    color = vec4(toEncoded(card.rgb), card.a * shows);
    return;
  }
  vec3 c;
  float known = 1.0;
  if (part == 3u) {
    vec2 local = (uv - places[2].xy) / places[2].zw;
    c = four(mouth, ivec2(0), textureSize(mouth, 0), local);
    if (soft) { // the lips' shade, so that the sheet does not end at a line
      vec2 away = min(local, 1.0 - local) / max(fwidth(local), 1e-5) / scale; // mm
      c *= mix(vec3(0.42, 0.34, 0.33), vec3(1.0), smoothstep(0.0, SHADE, min(away.x, away.y)));
    }
  } else if (part < 2u) {
    vec4 box = places[int(part)];
    c = four(gaze, eyeCorner + ivec2(int(part), 0) * eyeCell, eyeCell, (uv - box.xy) / box.zw - slide);
  } else {
    c = texture(face, uv).rgb;
    if (part == 2u) known = texture(coverage, uv).r;
    else if (geometry && part != 5u) c *= shade(lips - place.y) * vec3(1.0, 0.93, 0.9); // light falls off behind the lips
  }
  if (layer == 1) {
    ivec3 size = textureSize(masks, 0);
    float a = texture(masks, vec3(uv, float(shown / 4)))[shown % 4];
    float gray = dot(c, vec3(0.2126, 0.7152, 0.0722));
    c = part == 2u ? toLinear(heat(a)) * (0.25 + 1.5 * gray) : vec3(gray);
  } else if (layer == 2) {
    int kind = int(texelFetch(coverage, ivec2(uv * vec2(textureSize(coverage, 0))), 0).g * 4.25 + 0.5);
    vec3 tint = kind == 1 ? vec3(0.10, 0.55, 0.25) : kind == 2 ? vec3(0.10, 0.35, 0.75)
      : kind == 3 ? vec3(0.85, 0.45, 0.05) : kind == 4 ? vec3(0.65, 0.10, 0.45) : vec3(0.2);
    float gray = dot(c, vec3(0.2126, 0.7152, 0.0722));
    c = part == 2u ? tint * (0.25 + 1.5 * gray) : vec3(gray);
  } else if (layer == 3) {
    vec2 line = abs(fract(uv * 32.0) - 0.5);
    float grid = smoothstep(0.46, 0.48, max(line.x, line.y));
    float check = mod(floor(uv.x * 32.0) + floor(uv.y * 32.0), 2.0);
    c = mix(vec3(uv, 0.35) * (0.55 + 0.35 * check), vec3(0.9), grid * 0.6);
  } else if (lit) {
    c *= relit(normalize(bent));
  }
  float alpha = 1.0;
  if (inPhoto) {
    vec2 here = (vec2(gl_FragCoord.x, tall - gl_FragCoord.y) - frame.xy) / frame.zw;
    vec3 around = texture(photo, here + texture(flow, here).xy).rgb;
    if (layer == 0) c = mix(around, c, known);
  } else if (soft) {
    alpha *= smoothstep(fade.x, fade.y, place.x);
  }
  color = vec4(toEncoded(c), alpha);
}`;

/** What stands behind the head: a plain wall, or the portrait pulled along with the face. */
export const BACKDROP = `
precision highp float;
uniform sampler2D photo, flow;
uniform vec4 frame;
uniform vec2 size;
uniform bool inPhoto, plain;
uniform vec3 wall, floorTint;
out vec4 color;
${COLOR}
float noise(vec2 p) { return fract(52.9829189 * fract(dot(p, vec2(0.06711056, 0.00583715)))); }
void main() {
  vec2 pixel = vec2(gl_FragCoord.x, size.y - gl_FragCoord.y);
  if (plain) {
    color = vec4(toEncoded(vec3(0.18)), 1.0);
    return;
  }
  vec2 unit = pixel / size;
  vec2 away = (unit - vec2(0.5, 0.42)) * vec2(size.x / size.y, 1.0);
  vec3 c = mix(wall, floorTint, smoothstep(0.05, 1.0, length(away) * 1.15));
  vec3 encoded = c + (noise(gl_FragCoord.xy) - 0.5) / 255.0; // against bands
  if (inPhoto) {
    vec2 here = (pixel - frame.xy) / frame.zw;
    float far = max(max(-here.x, here.x - 1.0), max(-here.y, here.y - 1.0));
    vec3 around = textureLod(photo, clamp(here, vec2(0.02), vec2(0.98)), 6.0).rgb * 0.5
      + textureLod(photo, clamp(here, vec2(0.1), vec2(0.9)), 8.0).rgb * 0.5;
    encoded = toEncoded(around * mix(0.34, 0.12, smoothstep(0.0, 0.6, far)))
      + (noise(gl_FragCoord.xy) - 0.5) / 255.0;
    if (all(greaterThanEqual(here, vec2(0.0))) && all(lessThan(here, vec2(1.0))))
      encoded = toEncoded(texture(photo, here + texture(flow, here).xy).rgb);
  }
  color = vec4(encoded, 1.0);
}`;
