// Loads a GLB with three.js, poses it and writes the skin's vertices in metres.
// Usage: node three.mjs FILE.glb WEIGHTS.json OUT, in a folder with node_modules
import { readFileSync, writeFileSync } from 'node:fs';
import { createRequire } from 'node:module';
import { join } from 'node:path';
import { pathToFileURL } from 'node:url';

const from = createRequire(join(process.cwd(), 'package.json'));
const load = (name) => import(pathToFileURL(from.resolve(name)).href);
globalThis.self = globalThis;
const [file, weights, out] = process.argv.slice(2);
const { Box3, Vector3 } = await import(pathToFileURL(join(process.cwd(), 'node_modules/three/build/three.module.js')).href);
const { GLTFLoader } = await load('three/examples/jsm/loaders/GLTFLoader.js');
const { MeshoptDecoder } = await load('meshoptimizer');
await MeshoptDecoder.ready;
const loader = new GLTFLoader();
loader.setMeshoptDecoder(MeshoptDecoder);
loader.register((parser) => ({ name: 'no pictures', loadTexture: () => Promise.resolve(null), parser }));
const bytes = readFileSync(file);
const scene = await loader.parseAsync(bytes.buffer.slice(bytes.byteOffset, bytes.byteOffset + bytes.length), '');
const meshes = [];
scene.scene.updateMatrixWorld(true);
scene.scene.traverse((one) => one.isMesh && meshes.push(one));
const [skin] = meshes;
for (const mesh of meshes) mesh.morphTargetInfluences = JSON.parse(readFileSync(weights, 'utf8'));
const { min, max } = new Box3().setFromObject(scene.scene, true);
const posed = new Float32Array(3 * skin.geometry.attributes.position.count);
for (let k = 0; k < posed.length / 3; k++) {
  skin.getVertexPosition(k, new Vector3()).applyMatrix4(skin.matrixWorld).toArray(posed, 3 * k);
}
writeFileSync(join(out, 'skin.f32'), new Uint8Array(posed.buffer));
const names = Object.entries(skin.morphTargetDictionary).sort((a, b) => a[1] - b[1]).map(([name]) => name);
const materials = meshes.map((one) => one.material);
const clear = materials.filter((one) => one.transparent).map((one) => one.name);
const box = [min.toArray(), max.toArray()];
const scenes = scene.scenes.length;
console.log(JSON.stringify({ names, materials: materials.map((one) => one.name), clear, box, scenes }));
