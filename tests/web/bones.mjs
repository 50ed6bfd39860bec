// Loads a GLB with three.js and tells where vertices go. Usage: node bones.mjs FILE.glb POSES.json, in a folder with node_modules
// A pose: {bones: {name: quaternion}, shapes: {material: {shape: weight}}}; printed is [{material: [[x, y, z] of each seventh vertex]}].
import { readFileSync } from 'node:fs';
import { createRequire } from 'node:module';
import { join } from 'node:path';
import { pathToFileURL } from 'node:url';

const from = createRequire(join(process.cwd(), 'package.json'));
globalThis.self = globalThis;
const { Vector3 } = await import(pathToFileURL(join(process.cwd(), 'node_modules/three/build/three.module.js')).href);
const { GLTFLoader } = await import(pathToFileURL(from.resolve('three/examples/jsm/loaders/GLTFLoader.js')).href);
const loader = new GLTFLoader();
loader.register((parser) => ({ name: 'no pictures', loadTexture: () => Promise.resolve(null), parser }));
const bytes = readFileSync(process.argv[2]);
const { scene } = await loader.parseAsync(bytes.buffer.slice(bytes.byteOffset, bytes.byteOffset + bytes.length), '');
const meshes = [];
scene.traverse((one) => one.isSkinnedMesh && meshes.push(one));
const seen = JSON.parse(readFileSync(process.argv[3], 'utf8')).map(({ bones, shapes }) => {
  for (const bone of meshes[0].skeleton.bones) bone.quaternion.fromArray(bones[bone.name] ?? [0, 0, 0, 1]);
  scene.updateMatrixWorld(true);
  return Object.fromEntries(
    meshes.map((mesh) => {
      const weights = shapes[mesh.material.name] ?? shapes.all ?? {};
      mesh.morphTargetInfluences?.fill(0);
      for (const [name, weight] of Object.entries(weights)) if (mesh.morphTargetInfluences) mesh.morphTargetInfluences[mesh.morphTargetDictionary[name]] = weight;
      mesh.skeleton.update();
      const out = [];
      for (let k = 0; k < mesh.geometry.attributes.position.count; k += 7) {
        out.push(mesh.getVertexPosition(k, new Vector3()).applyMatrix4(mesh.matrixWorld).toArray());
      }
      return [mesh.material.name, out];
    }),
  );
});
console.log(JSON.stringify({ bones: meshes[0].skeleton.bones.map((bone) => bone.name), seen }));
