// usd.mjs FILE.usda FILE.obj [SECONDS]: what three.js shows of a USD file, after SECONDS of its clip, against
// an OBJ of the same moment, corner by corner. three.js plays skeletons, of a point cache it shows the first
// sample. Exit code 1 when something is elsewhere.
import { readFileSync } from 'node:fs';
import { AnimationMixer, LoopOnce, Vector3 } from 'three';
import { USDLoader } from 'three/examples/jsm/loaders/USDLoader.js';

// Both hold float32 of numbers up to 2; rotations are chained over up to nine joints.
const kTolerance = 2e-6;
const [usdFile, objFile, seconds] = process.argv.slice(2);

/** Name of each object of an OBJ → its triangles' corners. */
function objCorners(text) {
  const vertices = [];
  const objects = new Map();
  let corners;
  for (const [kind, ...values] of text.split('\n').map((line) => line.split(' '))) {
    if (kind === 'o') objects.set(values[0], (corners = []));
    if (kind === 'v') vertices.push(new Vector3(...values.map(Number)));
    if (kind === 'f') corners.push(...values.map((index) => vertices[index - 1]));
  }
  return objects;
}

function atTime(scene, time) {
  const mixer = new AnimationMixer(scene);
  const action = mixer.clipAction(scene.animations[0]);
  action.setLoop(LoopOnce);
  action.clampWhenFinished = true;
  action.play();
  mixer.setTime(time);
}

function largestDistance(mesh, corners) {
  const positions = mesh.geometry.attributes.position;
  if (positions.count !== corners.length) return Infinity;
  mesh.skeleton?.update();
  const corner = new Vector3();
  let largest = 0;
  for (let i = 0; i < positions.count; ++i) {
    mesh.getVertexPosition(i, corner).applyMatrix4(mesh.matrixWorld);
    largest = Math.max(largest, corner.distanceTo(corners[i]));
  }
  return largest;
}

const expected = objCorners(readFileSync(objFile, 'utf8'));
const scene = new USDLoader().parse(readFileSync(usdFile, 'utf8'));
if (seconds !== undefined) atTime(scene, Number(seconds));
scene.updateMatrixWorld(true);
let failed = false;
let compared = 0;
scene.traverse((mesh) => {
  if (!mesh.isMesh || (Number(seconds) > 0 && !mesh.isSkinnedMesh)) return;
  const distance = largestDistance(mesh, expected.get(mesh.name) ?? []);
  console.log(`${mesh.name}: ${distance.toExponential(1)} m`);
  failed ||= !(distance < kTolerance);
  ++compared;
});
process.exit(failed || compared === 0 ? 1 : 0);
