// Scenes as glTF: by Khronos' validator, and in their places as three.js plays them.
//   node tests/oracles/gltf.mjs RAYREP SOURCE_FOLDER
// Wants `npm install gltf-validator three` in the folder it is called in; ends with 77 where that is missing.

import { execFileSync } from "node:child_process";
import { mkdtempSync, readFileSync, readdirSync, rmSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { pathToFileURL } from "node:url";

const module = (path) => import(pathToFileURL(join(process.cwd(), "node_modules", path)).href);
let validator, THREE, GLTFLoader;
try {
  validator = (await module("gltf-validator/index.js")).default;
  THREE = await module("three/build/three.module.js");
  ({ GLTFLoader } = await module("three/examples/jsm/loaders/GLTFLoader.js"));
} catch {
  console.log("no gltf-validator and three in node_modules");
  process.exit(77);
}
globalThis.self ??= globalThis;

const [program, source] = process.argv.slice(2);
const folder = mkdtempSync(join(tmpdir(), "gltf-"));
process.on("exit", () => rmSync(folder, { recursive: true }));
const rayrep = (...words) => execFileSync(program, words, { stdio: ["ignore", "pipe", "inherit"] });
let failures = 0;

async function check(name, glb) {
  const { issues } = await validator.validateBytes(new Uint8Array(glb), { maxIssues: 20 });
  const wrong = issues.messages.filter((m) => m.severity < 2);
  failures += issues.numErrors + issues.numWarnings > 0;
  console.log(`${issues.numErrors + issues.numWarnings ? "FAILED" : "ok    "} ${name}: ${issues.numErrors} errors, ${issues.numWarnings} warnings`);
  for (const m of wrong) console.log(`       ${m.pointer}: ${m.code} ${m.message}`);
}

// docs/scene.md in a few lines, for scenes as rayrep writes them: with all keys.
const mix = (a, b, f) => a.map((x, k) => x + f * (b[k] - x));
function piece(keys, time) {
  let n = 0;
  while (n + 2 < keys.length && keys[n + 1].time <= time) ++n;
  return [keys[n], keys[n + 1], (time - keys[n].time) / (keys[n + 1].time - keys[n].time)];
}
function bezier(keys, time) {
  const [a, b, f] = piece(keys, time);
  let points = [a.at, a.out, b.in, b.at];
  while (points.length > 1) points = points.slice(1).map((p, k) => mix(points[k], p, f));
  return points[0];
}
function attitude(keys, time) {
  const [a, b, f] = piece(keys, time);
  const of = ({ quaternion: [w, x, y, z] }) => new THREE.Quaternion(x, y, z, w);
  return of(a).slerp(of(b), f);
}
/** In m, +Y up, of points given in mm from the pivot. */
function expected(part, motion, time) {
  const at = bezier(motion.translation, time).map((x, k) => (x + part.pivot[k]) / 1000);
  const pose = new THREE.Matrix4().compose(new THREE.Vector3(...at), attitude(motion.rotation, time), new THREE.Vector3(1, 1, 1));
  return new THREE.Matrix4().makeRotationX(-Math.PI / 2).multiply(pose);
}

async function play(name, scene, glb) {
  const bytes = glb.buffer.slice(glb.byteOffset, glb.byteOffset + glb.byteLength);
  const gltf = await new GLTFLoader().parseAsync(bytes, "");
  const mixer = new THREE.AnimationMixer(gltf.scene);
  let worst = 0;
  for (const transition of scene.transitions) {
    const action = mixer.clipAction(gltf.animations.find((clip) => clip.name === transition.name));
    action.setLoop(THREE.LoopOnce).play();
    action.clampWhenFinished = true;
    for (const time of [0, 0.123, 0.5, 0.777, 0.999]) {
      mixer.setTime(time * action.getClip().duration);
      gltf.scene.updateMatrixWorld(true);
      for (const [part, said] of Object.entries(scene.parts)) {
        const node = gltf.scene.getObjectByName(THREE.PropertyBinding.sanitizeNodeName(part));
        const wanted = expected(said, transition.motions[part], time).elements;
        worst = Math.max(worst, ...node.matrixWorld.elements.map((x, k) => Math.abs(x - wanted[k])));
      }
    }
    action.stop();
  }
  failures += !(worst < 1e-6);
  console.log(`${worst < 1e-6 ? "ok    " : "FAILED"} ${name}: entries of matrices as three.js has them differ by ${worst.toExponential(1)} (m)`);
}

const scenes = join(source, "examples/scenes");
for (const file of readdirSync(scenes).filter((name) => name.endsWith(".json")).sort()) {
  rayrep("scene", "export", join(scenes, file), "-q", "-o", join(folder, "scene.glb"));
  await check(file, readFileSync(join(folder, "scene.glb")));
}
const scene = join(folder, "arm.json");
rayrep("scene", "import", join(scenes, "arm.urdf"), "-q", "-o", scene);
rayrep("scene", "export", scene, "-q", "-o", join(folder, "arm.glb"));
const glb = readFileSync(join(folder, "arm.glb"));
await check("arm.urdf", glb);
await play("arm.urdf", JSON.parse(readFileSync(scene)), glb);
process.exit(failures > 0 ? 1 : 0);
