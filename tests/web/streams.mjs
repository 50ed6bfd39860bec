// Unpacks streams with the decoder of meshoptimizer's authors and with the viewer's own.
// Usage: node streams.mjs FOLDER COUNT STRIDE INDICES, in the viewer's folder
import { readFileSync } from 'node:fs';
import { createRequire } from 'node:module';
import { join } from 'node:path';
import { pathToFileURL } from 'node:url';

const [folder, ...numbers] = process.argv.slice(2);
const [count, stride, indexCount] = numbers.map(Number);
const from = createRequire(join(process.cwd(), 'package.json'));
const { MeshoptDecoder } = await import(pathToFileURL(from.resolve('meshoptimizer')).href);
const ours = await import(pathToFileURL(join(process.cwd(), 'src/meshopt.js')).href);
await MeshoptDecoder.ready;
const vertices = new Uint8Array(readFileSync(join(folder, 'vertices.bin')));
const indices = new Uint8Array(readFileSync(join(folder, 'indices.bin')));
const theirs = { vertices: new Uint8Array(count * stride), indices: new Uint8Array(4 * indexCount) };
MeshoptDecoder.decodeGltfBuffer(theirs.vertices, count, stride, vertices, 'ATTRIBUTES');
MeshoptDecoder.decodeGltfBuffer(theirs.indices, indexCount, 4, indices, 'INDICES');
let cut = 0;
for (const attempt of [
  () => ours.decodeVertices(vertices.slice(0, 900), count, stride),
  () => ours.decodeIndices(indices.slice(0, 900), indexCount),
]) {
  try {
    attempt();
  } catch {
    cut++;
  }
}
console.log(JSON.stringify({
  authors: { vertices: [...theirs.vertices], indices: [...new Uint32Array(theirs.indices.buffer)] },
  ours: {
    vertices: [...ours.decodeVertices(vertices, count, stride)],
    indices: [...ours.decodeIndices(indices, indexCount)],
  },
  cut,
}));
