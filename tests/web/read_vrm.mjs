// A VRM by pixiv's library, without pictures; run in a folder with node_modules.
import { readFileSync } from 'node:fs';
import { createRequire } from 'node:module';
import { join } from 'node:path';
import { pathToFileURL } from 'node:url';

const from = createRequire(join(process.cwd(), 'package.json'));
const load = (name) => import(pathToFileURL(from.resolve(name)).href);
const module = (path) => import(pathToFileURL(join(process.cwd(), 'node_modules', path)).href);
globalThis.self = globalThis;
export const three = await module('three/build/three.module.js');
const { GLTFLoader } = await load('three/examples/jsm/loaders/GLTFLoader.js');
const { VRMLoaderPlugin } = await module('@pixiv/three-vrm/lib/three-vrm.module.js');

/** The vrm and the scene of a file. */
export async function read(path) {
  const loader = new GLTFLoader();
  loader.register((parser) => ({ name: 'no pictures', loadTexture: () => Promise.resolve(null), parser }));
  loader.register((parser) => new VRMLoaderPlugin(parser));
  const bytes = readFileSync(path);
  const { userData, scene } = await loader.parseAsync(bytes.buffer.slice(bytes.byteOffset, bytes.byteOffset + bytes.length), '');
  return { vrm: userData.vrm, scene };
}
