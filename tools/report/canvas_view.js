// What every view in 3D has: a canvas with a camera that turns, drawn when something has changed.

import {BufferAttribute, BufferGeometry, PerspectiveCamera, Vector3, Vector4, WebGLRenderer} from 'three';

import {dot, plus, shaded} from './geometry.js';
import {Orbit} from './orbit.js';

/** Whether this browser draws in 3D here. */
export function canDraw(document) {
  try {
    return Boolean(document.createElement('canvas').getContext('webgl2'));
  } catch {
    return false;
  }
}

/** A subclass has `draw`, and `resized` with what was the width over the height before, 0: nothing. */
export class CanvasView {
  /**
   * @param canvas   where it is drawn; takes keys and the pointer
   * @param drawn    called after each drawing with a function that brings a point to pixels
   * @param options  of the renderer
   */
  constructor(canvas, drawn, options = {}) {
    this.drawn = drawn;
    this.renderer = new WebGLRenderer({canvas, antialias: true, alpha: true, ...options});
    this.renderer.autoClear = false;
    this.camera = new PerspectiveCamera();
    this.orbit = new Orbit(canvas, () => this.change());
    canvas.addEventListener('webglcontextrestored', () => this.change());
    this.size = [0, 0];
  }

  resize(width, height, ratio) {
    if (!width || !height) return;
    const before = this.size[1] ? this.size[0] / this.size[1] : 0;
    this.size = [width, height];
    this.renderer.setPixelRatio(Math.min(ratio, 2));
    this.renderer.setSize(width, height, false);
    this.resized(before);
    this.change();
  }

  change() {
    if (this.waiting) return;
    this.waiting = requestAnimationFrame(() => {
      this.waiting = 0;
      this.draw();
    });
  }

  /** @param pose  of the camera, as Orbit has it @param reach  from where to where it sees: {near, far} */
  aimAt({position, above, target, field}, {near, far}, aspect) {
    const {camera} = this;
    camera.fov = field * 180 / Math.PI;
    camera.aspect = aspect;
    camera.near = near;
    camera.far = far;
    camera.position.set(...position);
    camera.up.set(...above);
    camera.lookAt(new Vector3(...target));
    camera.updateProjectionMatrix();
    camera.updateMatrixWorld();
  }

  /** Brings points to pixels as the camera sees them now, and later too. */
  projection() {
    const [width, height] = this.size;
    const matrix = this.camera.projectionMatrix.clone().multiply(this.camera.matrixWorldInverse);
    return p => {
      const v = new Vector4(...p, 1).applyMatrix4(matrix);
      return [(0.5 + 0.5 * v.x / v.w) * width, (0.5 - 0.5 * v.y / v.w) * height];
    };
  }
}

export function geometryOf(mesh) {
  const {positions, normals} = shaded(mesh);
  const geometry = new BufferGeometry();
  geometry.setAttribute('position', new BufferAttribute(positions, 3));
  geometry.setAttribute('normal', new BufferAttribute(normals, 3));
  return geometry;
}

/** From and to of each stretch, six numbers. */
export function stretchesOf(numbers) {
  const geometry = new BufferGeometry();
  geometry.setAttribute('position', new BufferAttribute(numbers, 3));
  return geometry;
}

export function square(center, right, front, half) {
  const geometry = new BufferGeometry();
  const at = (x, y) => plus(plus(center, right, x * half), front, y * half);
  const corners = [at(-1, -1), at(1, -1), at(1, 1), at(-1, -1), at(1, 1), at(-1, 1)].flat();
  geometry.setAttribute('position', new BufferAttribute(new Float32Array(corners), 3));
  geometry.setAttribute('uv', new BufferAttribute(new Float32Array([0, 0, 1, 0, 1, 1, 0, 0, 1, 1, 0, 1]), 2));
  return geometry;
}

/** Across up, at a height along it, over or under a point. */
export function discOf({to_ground: [right, front, up]}, height, center, half) {
  return square(plus(center, up, height - dot(center, up)), right, front, half);
}
