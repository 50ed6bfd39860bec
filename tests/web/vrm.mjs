// Loads a VRM with pixiv's library, plays it and tells what moved. Usage: node vrm.mjs FILE.vrm, in a folder with node_modules
import { read, three } from './read_vrm.mjs';

const { Box3, Vector3, Quaternion } = three;
const { vrm, scene } = await read(process.argv[2]);
const meshes = [];
scene.traverse((one) => one.isSkinnedMesh && meshes.push(one));
const [skin] = meshes;
const shapes = Object.keys(skin.morphTargetDictionary);
const moved = () => Object.fromEntries(shapes.map((name, k) => [name, skin.morphTargetInfluences[k]]).filter(([, weight]) => weight > 1e-6));
const seen = { meta: vrm.meta, bones: {}, expressions: {}, looks: {} };
scene.updateMatrixWorld(true);
for (const [name, { node }] of Object.entries(vrm.humanoid.humanBones)) seen.bones[name] = node.getWorldPosition(new Vector3()).toArray();
const box = new Box3().setFromObject(scene, true);
seen.box = [box.min.toArray(), box.max.toArray()];
for (const name of Object.keys(vrm.expressionManager.expressionMap)) {
  vrm.expressionManager.resetValues?.();
  for (const other of Object.keys(vrm.expressionManager.expressionMap)) vrm.expressionManager.setValue(other, other === name ? 1 : 0);
  vrm.expressionManager.update();
  seen.expressions[name] = moved();
}
for (const other of Object.keys(vrm.expressionManager.expressionMap)) vrm.expressionManager.setValue(other, 0);
for (const [yaw, pitch] of [[15, 0], [-15, 0], [0, 12], [0, -12]]) {
  vrm.lookAt.yaw = yaw;
  vrm.lookAt.pitch = pitch;
  vrm.update(0.01);
  vrm.expressionManager.update();
  seen.looks[`${yaw},${pitch}`] = moved();
}
vrm.lookAt.reset();
for (const other of Object.keys(vrm.expressionManager.expressionMap)) vrm.expressionManager.setValue(other, 0);
vrm.update(0.01);
const at = () => {
  scene.updateMatrixWorld(true);
  skin.skeleton.update();
  const out = [];
  for (let k = 0; k < skin.geometry.attributes.position.count; k += 50) {
    out.push(skin.getVertexPosition(k, new Vector3()).applyMatrix4(skin.matrixWorld).toArray());
  }
  return out;
};
seen.rest = at();
vrm.humanoid.getRawBoneNode('head').quaternion.multiply(new Quaternion().setFromAxisAngle(new Vector3(0, 1, 0), 0.5));
seen.turned = at();
console.log(JSON.stringify(seen));
