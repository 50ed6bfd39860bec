// Plays the animation of a GLB with three.js; tells shapes and the head's turn at some times.
// Usage: node take.mjs FILE.glb SECONDS..., in a folder with node_modules
import { readFileSync } from 'node:fs';
import { createRequire } from 'node:module';
import { join } from 'node:path';
import { pathToFileURL } from 'node:url';

const from = createRequire(join(process.cwd(), 'package.json'));
const load = (name) => import(pathToFileURL(from.resolve(name)).href);
globalThis.self = globalThis;
const [file, ...times] = process.argv.slice(2);
const { AnimationMixer } = await import(pathToFileURL(join(process.cwd(), 'node_modules/three/build/three.module.js')).href);
const { GLTFLoader } = await load('three/examples/jsm/loaders/GLTFLoader.js');
const loader = new GLTFLoader();
loader.register((parser) => ({ name: 'no pictures', loadTexture: () => Promise.resolve(null), parser }));
const bytes = readFileSync(file);
const { scene, animations } = await loader.parseAsync(bytes.buffer.slice(bytes.byteOffset, bytes.byteOffset + bytes.length), '');
const mixer = new AnimationMixer(scene);
mixer.clipAction(animations[0]).play();
const seen = times.map((time) => {
  mixer.setTime(Number(time));
  const meshes = [];
  scene.traverse((one) => one.isMesh && one.morphTargetInfluences && meshes.push([...one.morphTargetInfluences]));
  return { meshes, head: scene.getObjectByName('head').quaternion.toArray() };
});
console.log(JSON.stringify({ name: animations[0].name, length: animations[0].duration, seen }));
