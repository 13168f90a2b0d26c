// The blocks of the page: see README.md.

const kSteps = 65535;

/** What the page was given: {data, meshes}, the meshes by id. */
export function readBlocks(document) {
  const text = id => document.getElementById(id).textContent;
  const data = JSON.parse(text('rayrep-data'));
  if (data.scene) return {data, meshes: meshesOfParts(data, text)};
  return {data, meshes: new Map(data.view.meshes.map(({id}) => [id, unpack(bytesOf(text(id)), data.view)]))};
}

/** Of a scene, where each part has a box of its own. @param block  of an id its text */
export function meshesOfParts({scene}, block) {
  return new Map(scene.parts.map(part => [part.id, unpack(bytesOf(block(part.id)), part)]));
}

export function bytesOf(text) {
  const characters = atob(text);
  const bytes = new Uint8Array(characters.length);
  for (let n = 0; n < bytes.length; ++n) bytes[n] = characters.charCodeAt(n);
  return bytes;
}

/** Unsigned numbers of LEB128, and those with a sign. */
class Numbers {
  constructor(bytes) {
    this.bytes = bytes;
    this.at = 0;
  }
  next() {
    let n = 0;
    for (let factor = 1;; factor *= 128) {
      const byte = this.bytes[this.at++];
      n += (byte & 127) * factor;
      if (byte < 128) return n;
    }
  }
  nextSigned() {
    return signed(this.next());
  }
}

const signed = n => n % 2 ? -(n + 1) / 2 : n / 2;

/**
 * The triangles of a block, which src/report/packed_mesh.h describes.
 * @returns {positions, triangles}: coordinates in mm, and three places of vertices a triangle
 */
export function unpack(bytes, {low_mm, size_mm}) {
  const numbers = new Numbers(bytes);
  const count = numbers.next();
  const places = new Int32Array(3 * numbers.next());
  const triangles = new Uint32Array(3 * count);
  const run = new Set();  // directed edges, as numbers
  const stack = [];
  let made = 0, vertices = 0, lastNamed = 0;
  const vertexAt = (x, y, z) => {
    places[3 * vertices] = x + numbers.nextSigned();
    places[3 * vertices + 1] = y + numbers.nextSigned();
    places[3 * vertices + 2] = z + numbers.nextSigned();
    return vertices++;
  };
  const edge = (a, b) => a * 67108864 + b;
  const add = (a, b, c) => {
    triangles.set([a, b, c], 3 * made++);
    run.add(edge(a, b)).add(edge(b, c)).add(edge(c, a));
  };
  while (made < count) {
    const corners = [0, 0, 0];
    for (let k = 0; k < 3; ++k) {
      const known = numbers.next();
      const last = 3 * (vertices - 1);
      corners[k] = known ? known - 1 : vertices ? vertexAt(places[last], places[last + 1], places[last + 2]) : vertexAt(0, 0, 0);
    }
    const [first, second, third] = corners;
    add(first, second, third);
    stack.push(third, first, second, second, third, first, first, second, third);
    while (stack.length) {
      const c = stack.pop(), b = stack.pop(), a = stack.pop();
      if (run.has(edge(b, a))) continue;
      const code = numbers.next();
      if (code === 1) continue;
      let d;
      if (code === 0) {
        const guess = k => places[3 * a + k] + places[3 * b + k] - places[3 * c + k];
        d = vertexAt(guess(0), guess(1), guess(2));
      } else {
        d = lastNamed += signed(code - 2);
      }
      add(b, a, d);
      stack.push(d, b, a, a, d, b);
    }
  }
  const positions = new Float32Array(places.length);
  for (let n = 0; n < places.length; ++n) positions[n] = low_mm[n % 3] + places[n] * size_mm[n % 3] / kSteps;
  return {positions, triangles};
}
