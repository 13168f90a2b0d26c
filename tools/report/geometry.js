// Triangles: normals with creases, and where a plane cuts them.

const kCrease = Math.cos(40 * Math.PI / 180);

/**
 * Corners of all triangles, each with the mean normal of those triangles around its vertex that are turned by no more than a
 * crease.
 * @returns {positions, normals}: nine numbers a triangle
 */
export function shaded({positions, triangles}) {
  const count = triangles.length / 3;
  const faces = new Float32Array(3 * count);  // normals, as long as twice the area
  const lengths = new Float32Array(count);
  const corners = new Float32Array(9 * count);
  for (let t = 0; t < count; ++t) {
    for (let k = 0; k < 3; ++k)
      for (let n = 0; n < 3; ++n) corners[9 * t + 3 * k + n] = positions[3 * triangles[3 * t + k] + n];
    const c = corners, o = 9 * t;
    const ux = c[o + 3] - c[o], uy = c[o + 4] - c[o + 1], uz = c[o + 5] - c[o + 2];
    const vx = c[o + 6] - c[o], vy = c[o + 7] - c[o + 1], vz = c[o + 8] - c[o + 2];
    faces[3 * t] = uy * vz - uz * vy;
    faces[3 * t + 1] = uz * vx - ux * vz;
    faces[3 * t + 2] = ux * vy - uy * vx;
    lengths[t] = Math.hypot(faces[3 * t], faces[3 * t + 1], faces[3 * t + 2]);
  }
  const {first, around} = trianglesAround(triangles, positions.length / 3);
  const normals = new Float32Array(9 * count);
  for (let t = 0; t < count; ++t)
    for (let k = 0; k < 3; ++k) {
      const v = triangles[3 * t + k];
      let x = 0, y = 0, z = 0;
      for (let n = first[v]; n < first[v + 1]; ++n) {
        const o = around[n];
        const dot = faces[3 * t] * faces[3 * o] + faces[3 * t + 1] * faces[3 * o + 1] + faces[3 * t + 2] * faces[3 * o + 2];
        if (dot < kCrease * lengths[t] * lengths[o]) continue;
        x += faces[3 * o];
        y += faces[3 * o + 1];
        z += faces[3 * o + 2];
      }
      const length = Math.hypot(x, y, z) || 1;
      normals.set([x / length, y / length, z / length], 9 * t + 3 * k);
    }
  return {positions: corners, normals};
}

/**
 * The outside of a mesh, and its cavities: pieces that hang together at their vertices and face inward. Vertices are shared.
 * @returns {outside, cavities}: meshes; cavities may be null
 */
export function shellsOf({positions, triangles}) {
  const above = Uint32Array.from({length: positions.length / 3}, (_, v) => v);
  const root = v => {
    while (above[v] !== v) v = above[v] = above[above[v]];
    return v;
  };
  for (let n = 0; n < triangles.length; n += 3)
    for (const k of [1, 2]) above[root(triangles[n + k])] = root(triangles[n]);
  const volumes = new Float64Array(above.length);
  const at = v => positions.subarray(3 * v, 3 * v + 3);
  for (let n = 0; n < triangles.length; n += 3)
    volumes[root(triangles[n])] += dot(at(triangles[n]), cross(at(triangles[n + 1]), at(triangles[n + 2])));
  const of = inward => triangles.filter((_, n) => (volumes[root(triangles[n - n % 3])] < 0) === inward);
  const cavities = of(true);
  if (!cavities.length) return {outside: {positions, triangles}, cavities: null};
  return {outside: {positions, triangles: of(false)}, cavities: {positions, triangles: cavities}};
}

function trianglesAround(triangles, vertices) {
  const first = new Uint32Array(vertices + 1);
  for (const v of triangles) ++first[v + 1];
  for (let v = 0; v < vertices; ++v) first[v + 1] += first[v];
  const next = first.slice();
  const around = new Uint32Array(triangles.length);
  for (let n = 0; n < triangles.length; ++n) around[next[triangles[n]]++] = Math.floor(n / 3);
  return {first, around};
}

/**
 * Where the plane normal . p = offset cuts a mesh: from and to of each stretch, six numbers. A vertex in the plane counts as above
 * it, and stretches run alike along their loops.
 */
export function crossing({positions, triangles}, normal, offset) {
  const height = new Float64Array(positions.length / 3);
  for (let v = 0; v < height.length; ++v)
    height[v] = normal[0] * positions[3 * v] + normal[1] * positions[3 * v + 1] + normal[2] * positions[3 * v + 2] - offset;
  const out = [];
  for (let n = 0; n < triangles.length; n += 3) {
    const above = k => height[triangles[n + k]] >= 0;
    const a = above(0), b = above(1), c = above(2);
    if (a === b && b === c) continue;
    const single = a === b ? 2 : b === c ? 0 : 1;
    const p = triangles[n + single], q = triangles[n + (single + 1) % 3], r = triangles[n + (single + 2) % 3];
    const one = between(positions, height, p, q), other = between(positions, height, p, r);
    if (height[p] >= 0)
      out.push(...other, ...one);
    else
      out.push(...one, ...other);
  }
  return new Float32Array(out);
}

function between(positions, height, a, b) {
  // The same point whichever way the edge is run.
  const [from, to] = a < b ? [a, b] : [b, a];
  const part = height[from] / (height[from] - height[to]);
  return [0, 1, 2].map(k => positions[3 * from + k] + part * (positions[3 * to + k] - positions[3 * from + k]));
}

/** The stretches of a crossing joined to loops: lists of points. */
export function loopsOf(stretches) {
  const key = n => `${stretches[n]},${stretches[n + 1]},${stretches[n + 2]}`;
  const from = new Map();
  for (let n = 0; n < stretches.length; n += 6) {
    const place = key(n);
    if (!from.has(place)) from.set(place, []);
    from.get(place).push(n);
  }
  const done = new Uint8Array(stretches.length / 6);
  const loops = [];
  for (let start = 0; start < stretches.length; start += 6) {
    const loop = [];
    for (let n = start; n !== undefined && !done[n / 6];) {
      done[n / 6] = 1;
      loop.push([stretches[n], stretches[n + 1], stretches[n + 2]]);
      n = (from.get(key(n + 3)) || []).find(next => !done[next / 6]);
    }
    if (loop.length > 2) loops.push(loop);
  }
  return loops;
}

export const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
export const plus = (a, b, factor = 1) => [a[0] + factor * b[0], a[1] + factor * b[1], a[2] + factor * b[2]];
export const length = a => Math.hypot(a[0], a[1], a[2]);

/**
 * Where a line first meets a mesh, in front of where it begins, or null. @param faces  says of a triangle's normal whether it
 * counts
 */
export function firstHit({positions, triangles}, from, along, faces = () => true) {
  const [x, y, z] = along;
  const corner = (n, k) => positions[3 * triangles[n] + k];
  let nearest = Infinity;
  for (let n = 0; n < triangles.length; n += 3) {
    const ax = corner(n, 0), ay = corner(n, 1), az = corner(n, 2);
    const ex = corner(n + 1, 0) - ax, ey = corner(n + 1, 1) - ay, ez = corner(n + 1, 2) - az;
    const fx = corner(n + 2, 0) - ax, fy = corner(n + 2, 1) - ay, fz = corner(n + 2, 2) - az;
    const px = y * fz - z * fy, py = z * fx - x * fz, pz = x * fy - y * fx;
    const size = ex * px + ey * py + ez * pz;
    if (size === 0) continue;
    const sx = from[0] - ax, sy = from[1] - ay, sz = from[2] - az;
    const u = (sx * px + sy * py + sz * pz) / size;
    if (u < 0 || u > 1) continue;
    const qx = sy * ez - sz * ey, qy = sz * ex - sx * ez, qz = sx * ey - sy * ex;
    const v = (x * qx + y * qy + z * qz) / size;
    if (v < 0 || u + v > 1) continue;
    const distance = (fx * qx + fy * qy + fz * qz) / size;
    if (distance > 0 && distance < nearest && faces(cross([ex, ey, ez], [fx, fy, fz]))) nearest = distance;
  }
  return nearest < Infinity ? plus(from, along, nearest) : null;
}

export const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
