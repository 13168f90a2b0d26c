// Volumes of unions, intersections and differences by manifold-3d against rayrep's.
//   node tests/oracles/manifold.mjs BOOLEAN_PAIRS ARGUMENTS
// Wants `npm install manifold-3d` in the folder it is called in; ends with 77 where that is missing.

import { spawn } from "node:child_process";
import { createInterface } from "node:readline";
import { pathToFileURL } from "node:url";

let Module;
try {
  Module = (await import(pathToFileURL(process.cwd() + "/node_modules/manifold-3d/manifold.js").href)).default;
} catch {
  console.log("no manifold-3d in node_modules");
  process.exit(77);
}
const wasm = await Module();
wasm.setup();
const { Manifold, Mesh } = wasm;

const solid = (mesh) =>
  new Manifold(new Mesh({ numProp: 3, vertProperties: Float32Array.from(mesh.points), triVerts: Uint32Array.from(mesh.triangles) }));

let compared = 0, refused = 0, differ = 0, worst = 0, ours = 0, theirs = 0;
const [program, ...rest] = process.argv.slice(2);
for await (const line of createInterface({ input: spawn(program, rest, { stdio: ["ignore", "pipe", "inherit"] }).stdout })) {
  const pair = JSON.parse(line);
  let a, b;
  try {
    a = solid(pair.a);
    b = solid(pair.b);
  } catch {
    ++refused; // edges of four triangles, which it does not take
    continue;
  }
  const scale = a.volume() + b.volume();
  const begun = performance.now();
  for (const word of ["add", "intersect", "subtract"]) {
    const result = a[word](b);
    const off = Math.abs(result.volume() - pair[word][0]) / scale;
    result.delete();
    worst = Math.max(worst, off);
    ++compared;
    if (off < 1e-6) continue;
    ++differ;
    console.log(`pair ${pair.name}: ${word} off by ${off.toExponential(2)}`);
  }
  theirs += (performance.now() - begun) / 1000;
  ours += pair.seconds;
  a.delete();
  b.delete();
}
console.log(`${compared} compared, ${refused} pairs refused, ${differ} differ; largest difference ${worst.toExponential(2)} of the volume; ` +
  `rayrep ${ours.toFixed(2)} s, manifold ${theirs.toFixed(2)} s`);
process.exit(differ || !compared ? 1 : 0);
