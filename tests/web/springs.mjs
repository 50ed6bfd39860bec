// Hair of a VRM swings by pixiv's library. Usage: node springs.mjs FILE.vrm, in a folder with node_modules
import { read, three } from './read_vrm.mjs';

const { Vector3, Quaternion } = three;
const { vrm, scene } = await read(process.argv[2]);
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
