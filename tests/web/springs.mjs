// Hair of a VRM swings by pixiv's library. Usage: node springs.mjs FILE.vrm, in a folder with node_modules
import { readFileSync } from 'node:fs';
import { createRequire } from 'node:module';
import { join } from 'node:path';
import { pathToFileURL } from 'node:url';

const from = createRequire(join(process.cwd(), 'package.json'));
const load = (name) => import(pathToFileURL(from.resolve(name)).href);
globalThis.self = globalThis;
const { Vector3, Quaternion } = await import(pathToFileURL(join(process.cwd(), 'node_modules/three/build/three.module.js')).href);
const { GLTFLoader } = await load('three/examples/jsm/loaders/GLTFLoader.js');
const { VRMLoaderPlugin } = await import(pathToFileURL(join(process.cwd(), 'node_modules/@pixiv/three-vrm/lib/three-vrm.module.js')).href);
const loader = new GLTFLoader();
loader.register((parser) => ({ name: 'no pictures', loadTexture: () => Promise.resolve(null), parser }));
loader.register((parser) => new VRMLoaderPlugin(parser));
const bytes = readFileSync(process.argv[2]);
const { userData, scene } = await loader.parseAsync(bytes.buffer.slice(bytes.byteOffset, bytes.byteOffset + bytes.length), '');
const { vrm } = userData;
const hair = [];
scene.traverse((one) => one.isSkinnedMesh && one.material.name.startsWith('hair') && hair.push(one));
const at = () => {
  scene.updateMatrixWorld(true);
  const out = [];
  for (const mesh of hair) {
    mesh.skeleton.update();
    for (let k = 0; k < mesh.geometry.attributes.position.count; k += 20) {
      out.push(mesh.getVertexPosition(k, new Vector3()).applyMatrix4(mesh.matrixWorld).toArray());
    }
  }
  return out;
};
const run = (frames) => {
  for (let k = 0; k < frames; k++) vrm.update(1 / 60);
};
const seen = { joints: vrm.springBoneManager?.joints.size ?? 0, start: at() };
run(120);
seen.rest = at();
const head = vrm.humanoid.getRawBoneNode('head');
seen.pivot = head.getWorldPosition(new Vector3()).toArray();
vrm.humanoid.autoUpdateHumanBones = false; // the raw bone is turned here
head.quaternion.multiply(new Quaternion().setFromAxisAngle(new Vector3(0, 1, 0), 0.5));
run(2);
seen.turning = at();
run(180);
seen.settled = at();
console.log(JSON.stringify(seen));
