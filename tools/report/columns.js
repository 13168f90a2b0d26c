// The inside as a preview tells it: columns along rays, made to closed surfaces that are smooth along the rays.

import {bytesOf} from './data.js';
import {plus} from './geometry.js';

const kSides = [[1, 0, [1, 0], [1, 1]], [0, 1, [1, 1], [0, 1]], [-1, 0, [0, 1], [0, 0]], [0, -1, [0, 0], [1, 0]]];

/** @param columns  of a preview's answer @returns {i, j, low, high}: of each column its ray, and from where to where it goes */
export function readColumns({bytes}) {
  const all = bytesOf(bytes);
  const numbers = new DataView(all.buffer, all.byteOffset, all.byteLength);
  const columns = [];
  for (let at = 0; at + 12 <= all.byteLength; at += 12)
    columns.push({
      i: numbers.getInt16(at, true),
      j: numbers.getInt16(at + 2, true),
      low: numbers.getFloat32(at + 4, true),
      high: numbers.getFloat32(at + 8, true)
    });
  return columns;
}

/**
 * Closed, with its normals into the void, as cavities of meshes have them. Where two neighbours look onto each other alone there is
 * no wall between them, and the ends of their columns meet; every other side is a wall of its own.
 * @returns {positions, triangles}
 */
export function meshOfColumns(columns, {axes, origin_mm, spacing_mm}) {
  const cells = new Map();
  for (const column of columns) {
    const key = cellKey(column.i, column.j);
    if (!cells.has(key)) cells.set(key, []);
    cells.get(key).push(column);
  }
  const meets = (a, b) => a.low < b.high && b.low < a.high;
  const beside = (column, di, dj) => (cells.get(cellKey(column.i + di, column.j + dj)) ?? []).filter(other => meets(column, other));
  const partner = (column, [di, dj]) => {
    const seen = beside(column, di, dj);
    return seen.length === 1 && beside(seen[0], -di, -dj).length === 1 ? seen[0] : null;
  };
  const partners = new Map(columns.map(column => [column, kSides.map(side => partner(column, side))]));
  const [u, v, w] = [axes.slice(0, 3), axes.slice(3, 6), axes.slice(6, 9)];
  const positions = [], triangles = [];
  const vertexAt = (x, y, height) => {
    positions.push(...plus(plus(plus(origin_mm, u, (x - 0.5) * spacing_mm), v, (y - 0.5) * spacing_mm), w, height));
    return positions.length / 3 - 1;
  };
  const corners = cornersOf(columns, partners, vertexAt);
  const quad = (a, b, c, d) => triangles.push(a, b, c, a, c, d);
  for (const column of columns) {
    const end = ([x, y]) => corners.get(column)[x + 2 * y];
    const [a, b, c, d] = [[0, 0], [1, 0], [1, 1], [0, 1]].map(end);
    quad(a.low, b.low, c.low, d.low);
    quad(a.high, d.high, c.high, b.high);
    partners.get(column).forEach((other, n) => {
      if (other) return;
      const from = end(kSides[n][2]), to = end(kSides[n][3]);
      quad(from.low, from.high, to.high, to.low);
    });
  }
  return {positions: new Float32Array(positions), triangles: new Uint32Array(triangles)};
}

const cellKey = (i, j) => i * 65536 + j;

/** Of each column the vertices at its four corners, at the mean heights of those columns around a corner that are joined to it. */
function cornersOf(columns, partners, vertexAt) {
  const corners = new Map(columns.map(column => [column, [null, null, null, null]]));
  for (const column of columns)
    for (let k = 0; k < 4; ++k) {
      if (corners.get(column)[k]) continue;
      const corner = [column.i + (k & 1), column.j + (k >> 1)];
      const joined = joinedAround(column, corner, partners);
      const mean = end => joined.reduce((sum, one) => sum + one[end], 0) / joined.length;
      const ends = {low: vertexAt(...corner, mean('low')), high: vertexAt(...corner, mean('high'))};
      for (const one of joined) corners.get(one)[corner[0] - one.i + 2 * (corner[1] - one.j)] = ends;
    }
  return corners;
}

function joinedAround(column, [x, y], partners) {
  const touches = ({i, j}) => (x === i || x === i + 1) && (y === j || y === j + 1);
  const joined = [column];
  for (const one of joined)
    for (const other of partners.get(one))
      if (other && touches(other) && !joined.includes(other)) joined.push(other);
  return joined;
}
