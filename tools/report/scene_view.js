// Parts that move, in 3D: where they are at a time, their ghosts, where they get into each other, and a second picture in a corner.

// clang-format off
import {
  Color, DoubleSide, FrontSide, LineBasicMaterial, LineSegments, Matrix4, Mesh, MeshBasicMaterial, Quaternion, Scene, ShaderMaterial, Vector4,
  WebGLRenderTarget
} from 'three';
// clang-format on



import {CanvasView, discOf, geometryOf, stretchesOf} from './canvas_view.js';
import {crossing, dot, length, plus, shellsOf} from './geometry.js';
import {distanceFor} from './orbit.js';
import {placedBy, turned} from './poses.js';
import {kDisc, kSurface} from './shaders.js';

const kAside = 0.16;  // how opaque is what has no part in what is looked at
const kProbe = 64;    // pixels along a side, to see how much of a collision can be seen

/** The axes of a frame in which `up` is up. */
export function frameOf(up) {
  const size = length(up) || 1;
  const u = up.map(x => x / size);
  const least = Math.abs(u[0]) < 0.9 ? [1, 0, 0] : [0, 1, 0];
  const flat = plus(least, u, -dot(least, u));
  const right = flat.map(x => x / length(flat));
  const front = [u[1] * right[2] - u[2] * right[1], u[2] * right[0] - u[0] * right[2], u[0] * right[1] - u[1] * right[0]];
  return {right, front, up: u};
}

export const cornersOf = ([low, high]) => Array.from({length: 8}, (_, n) => low.map((x, k) => n >> k & 1 ? high[k] : x));

function matrixOf({rotation: [w, x, y, z], translation}, pivot) {
  return new Matrix4()
      .makeTranslation(...plus(pivot, translation))
      .multiply(new Matrix4().makeRotationFromQuaternion(new Quaternion(x, y, z, w)))
      .multiply(new Matrix4().makeTranslation(...pivot.map(x => -x)));
}

const stretches = list => stretchesOf(new Float32Array(list.flat(2)));

const kEdges = Array.from({length: 8}, (_, n) => [1, 2, 4].filter(k => !(n & k)).map(k => [n, n | k])).flat();
const boxLines = box => kEdges.map(([a, b]) => [cornersOf(box)[a], cornersOf(box)[b]]);

function boxFaces(box) {
  const corners = cornersOf(box);
  const quads = [[0, 2, 6, 4], [1, 5, 7, 3], [0, 4, 5, 1], [2, 3, 7, 6], [0, 1, 3, 2], [4, 6, 7, 5]];
  return stretches(quads.flatMap(([a, b, c, d]) => [[corners[a], corners[b], corners[c]], [corners[a], corners[c], corners[d]]]));
}

export class SceneView extends CanvasView {
  /**
   * @param canvas  where it is drawn; takes keys and the pointer
   * @param parts   {pivot_mm, box: [low, high], mesh}
   * @param drawn   called after each drawing with a function that brings a point of the scene to pixels
   */
  constructor(canvas, parts, drawn) {
    super(canvas, drawn);
    this.parts = parts;
    this.renderer.setClearColor(0x000000, 0);
    this.moment = {poses: [], collisions: [], ghosts: [], of: null};
    this.inset = null;
    const matter = (more = {}) => new ShaderMaterial({
      vertexShader: kSurface.vertex,
      fragmentShader: kSurface.fragment,
      uniforms: {uColor: {value: new Color()}, uOpacity: {value: 1}, uEdge: {value: 0}, uCut: {value: new Vector4(0, 0, 0, 1)}},
      side: DoubleSide,
      ...more
    });
    const see = {transparent: true, depthWrite: false};
    const behind = {polygonOffset: true, polygonOffsetFactor: 1, polygonOffsetUnits: 2};
    this.bodies = parts.map(part => {
      const {outside, cavities} = shellsOf(part.mesh);
      const geometry = geometryOf(outside);
      const body = {
        outside,
        solid: new Mesh(geometry, matter()),
        glass: new Mesh(geometry, matter(see)),
        // Seen through: the nearest of it alone, so that folds behind each other do not add up.
        depth: new Mesh(geometry, matter({side: FrontSide, colorWrite: false, ...behind})),
        clear: new Mesh(geometry, matter({side: FrontSide, ...see})),
        cavities: cavities ? new Mesh(geometryOf(cavities), matter(behind)) : null
      };
      for (const mesh of Object.values(body))
        if (mesh?.isMesh) mesh.matrixAutoUpdate = false;
      return body;
    });
    this.hasCavities = this.bodies.some(({cavities}) => cavities);
    this.opacity = 0.3;  // of the outside of what has cavities
    this.discs = Object.fromEntries(['water', 'ground'].map(
        name => [name, new ShaderMaterial({
                   vertexShader: kDisc.vertex,
                   fragmentShader: kDisc.fragment,
                   uniforms: {uColor: {value: new Color()}, uOpacity: {value: 0.34}, uCut: {value: new Vector4(0, 0, 0, 1)}},
                   side: DoubleSide,
                   ...see
                 })]));
    this.waterline = new LineBasicMaterial();
    this.scene = new Scene();
    this.red = new LineBasicMaterial({depthTest: false, transparent: true});
    this.frameLine = new LineBasicMaterial({depthTest: false, transparent: true, opacity: 0.75});
    this.veil = new MeshBasicMaterial({transparent: true, opacity: 0.2, depthWrite: false, side: DoubleSide});
    this.path = new LineBasicMaterial({depthTest: false, transparent: true, opacity: 0.8});
  }

  /**
   * @param moment  poses; collisions: {box, contour} to be marked; ghosts: {list of {part, pose}, opacity}; of: numbers of the
   *     parts that are
   *                looked at, null: all; path: points of a way, or none; attitude: with waterline and ground, heights along up, or
   * none
   */
  show(moment) {
    this.moment = moment;
    this.change();
  }

  /** @param inset  {moment, towards, target, distance, place: [x, y, width, height]} or null */
  showInset(inset) {
    this.inset = inset;
    this.change();
  }

  /** @param points  all that has to be seen from home */
  setHome(up, points) {
    const frame = frameOf(up);
    const middle = [0, 1, 2].map(k => {
      const all = points.map(p => p[k]);
      return (Math.min(...all) + Math.max(...all)) / 2;
    });
    this.reach = Math.max(1e-6, ...points.map(p => length(plus(p, middle, -1))));
    this.orbit.fresh = true;
    const home = {azimuth: -Math.PI / 2 + 0.55, elevation: 0.38, distance: 4 * this.reach, target: middle};
    this.orbit.reset(frame, home);
    const ratio = this.size[1] ? this.size[0] / this.size[1] : 1.4;
    home.distance = distanceFor(points, middle, this.orbit.pose(), ratio);
    this.orbit.goHome();
    this.orbit.fresh = false;
    this.homePoints = points;
  }

  /** Up is another direction; what is looked at stays. */
  setUp(up) {
    const {target, distance} = this.orbit;
    const {towards} = this.orbit.pose();
    this.orbit.frame = frameOf(up);
    this.orbit.lookAlong({towards, distance, target});
  }

  resized(before) {
    if (!before && this.homePoints) this.setHome(this.orbit.frame.up, this.homePoints);
  }

  /** @param colors  {parts: by number, void, overlap, outline, water, ground} as CSS has them */
  paint(colors) {
    this.bodies.forEach(({solid, glass, clear, cavities}, n) => {
      for (const mesh of [solid, glass, clear])
        mesh.material.uniforms.uColor.value = new Color(colors.parts[n % colors.parts.length]);
      if (cavities) cavities.material.uniforms.uColor.value = new Color(colors.void);
    });
    for (const [name, {uniforms}] of Object.entries(this.discs)) uniforms.uColor.value = new Color(colors[name]);
    this.waterline.color = new Color(colors.water);
    for (const material of [this.red, this.frameLine, this.veil]) material.color = new Color(colors.overlap);
    this.path.color = new Color(colors.outline);
    this.painted = true;
    this.change();
  }

  // ------------------------------------------------------------------------------------------------------------------- drawing

  placed(mesh, part, pose) {
    mesh.matrix.copy(matrixOf(pose, this.parts[part].pivot_mm));
    mesh.matrixWorld.copy(mesh.matrix);
    return mesh;
  }

  render(objects) {
    this.scene.clear();
    for (const object of objects) this.scene.add(object);
    this.renderer.render(this.scene, this.camera);
  }

  drawMoment({poses, collisions, ghosts, of, path, attitude}) {
    const all = poses.map((pose, part) => ({part, pose}));
    const inIt = part => !of || of.includes(part);
    const isClear = part => this.bodies[part].cavities && this.opacity < 1;
    const drawn = (name, list) => this.render(list.map(({part, pose}) => this.placed(this.bodies[part][name], part, pose)));
    const here = all.filter(({part}) => inIt(part)), clear = here.filter(({part}) => isClear(part));
    if (attitude && attitude.ground !== null) this.renderDisc('ground', attitude, attitude.ground);
    drawn('solid', here.filter(({part}) => !isClear(part)));
    drawn('cavities', clear);
    drawn('depth', clear);
    for (const {part} of clear) {
      const {uOpacity, uEdge} = this.bodies[part].clear.material.uniforms;
      uOpacity.value = this.opacity;
      uEdge.value = 0.75;
    }
    drawn('clear', clear);
    if (attitude && attitude.waterline !== null) this.renderWater(attitude, all);
    const glass = (list, opacity) => {
      for (const {part, pose} of list) {
        const mesh = this.placed(this.bodies[part].glass, part, pose);
        mesh.material.uniforms.uOpacity.value = opacity;
        mesh.material.uniforms.uEdge.value = 0.35;
        this.render([mesh]);
      }
    };
    glass(all.filter(({part}) => !inIt(part)), kAside);
    for (const {list, opacity} of ghosts) glass(list, opacity);
    const marks = collisions.flatMap(
        ({box, contour}) =>
            [new Mesh(boxFaces(box), this.veil), new LineSegments(stretches(boxLines(box)), this.frameLine),
             new LineSegments(stretches(contour), this.red)]);
    if (path?.length > 1) marks.push(new LineSegments(stretches(path.slice(1).map((p, n) => [path[n], p])), this.path));
    if (!marks.length) return;
    this.render(marks);
    for (const {geometry} of marks) geometry.dispose();
  }

  renderDisc(name, attitude, height) {
    const disc = new Mesh(discOf(attitude, height, this.orbit.home.target, 1.6 * this.reach), this.discs[name]);
    this.render([disc]);
    disc.geometry.dispose();
  }

  /** Around what floats, and the line where it comes out. */
  renderWater(attitude, all) {
    this.renderDisc('water', attitude, attitude.waterline);
    const lines = all.map(({part, pose: {rotation: [w, x, y, z], translation}}) => {
      const pivot = this.parts[part].pivot_mm;
      // The plane in the part's own coordinates.
      const normal = turned([w, -x, -y, -z], attitude.up);
      const offset = attitude.waterline - dot(attitude.up, plus(pivot, translation)) + dot(normal, pivot);
      const line = new LineSegments(stretchesOf(crossing(this.bodies[part].outside, normal, offset)), this.waterline);
      line.matrixAutoUpdate = false;
      return this.placed(line, part, all[part].pose);
    });
    this.render(lines);
    for (const {geometry} of lines) geometry.dispose();
  }

  draw() {
    if (!this.size[1] || !this.painted) return;
    const {renderer, size: [width, height]} = this;
    this.aim(this.orbit.pose(), this.orbit.distance, width / height);
    renderer.setScissorTest(false);
    renderer.setViewport(0, 0, width, height);
    renderer.clear();
    this.drawMoment(this.moment);
    const project = this.projection();
    if (this.inset) this.drawInset(this.inset);
    this.drawn(project);
  }

  drawInset({moment, towards, target, distance, place: [x, y, width, height]}) {
    const below = this.size[1] - y - height;
    this.renderer.setScissorTest(true);
    this.renderer.setScissor(x, below, width, height);
    this.renderer.setViewport(x, below, width, height);
    this.renderer.clear();
    this.aim(this.seenFrom(towards, target, distance), distance, width / height);
    this.drawMoment(moment);
    this.renderer.setScissorTest(false);
  }

  /** A pose of the camera as Orbit has it. */
  seenFrom(towards, target, distance) {
    const {frame, azimuth, elevation, target: before} = this.orbit;
    const {right, front, up} = frame;
    this.orbit.azimuth = Math.atan2(dot(towards, front), dot(towards, right));
    this.orbit.elevation = Math.max(-1.55, Math.min(1.55, Math.asin(Math.max(-1, Math.min(1, dot(towards, up))))));
    this.orbit.target = target;
    const pose = {...this.orbit.pose(), position: plus(target, towards, distance)};
    Object.assign(this.orbit, {azimuth, elevation, target: before});
    return pose;
  }

  aim(pose, distance, aspect) {
    const {reach} = this;
    this.aimAt(pose, {near: Math.max(0.02 * distance, distance - 4 * reach), far: distance + 6 * reach}, aspect);
  }

  // --------------------------------------------------------------------------------------------------------------------- sight

  /** Where the camera has to be to see a box well: {target, distance}. */
  frame([low, high]) {
    const target = low.map((x, k) => (x + high[k]) / 2);
    const radius = length(plus(high, low, -1)) / 2;
    const home = this.orbit.home.distance;
    return {target, distance: Math.min(Math.max(12 * radius, 0.3 * home), Math.max(5 * radius, home))};
  }

  /**
   * Of these directions the one from which most of a box is seen, with the parts where they are; where they hide it from all sides,
   * with those that collide left out.
   * @param pair  numbers of the parts that collide
   */
  best(directions, poses, box, pair) {
    const {target, distance} = this.frame(box);
    const seen = hides => directions.map(towards => {
      this.aim(this.seenFrom(towards, target, distance), distance, 1);
      return this.pixelsOf(box, poses, hides);
    });
    let score = seen(() => true);
    if (!score.some(Boolean)) score = seen(part => !pair.includes(part));
    this.change();
    return {towards: directions[score.indexOf(Math.max(...score))], target, distance};
  }

  /** How many pixels of a box are not hidden by parts. */
  pixelsOf(box, poses, hides) {
    this.probe ??= {
      target: new WebGLRenderTarget(kProbe, kProbe),
      dark: new MeshBasicMaterial({color: 0x000000, side: DoubleSide}),
      light: new MeshBasicMaterial({color: 0xffffff, side: DoubleSide}),
      bytes: new Uint8Array(4 * kProbe * kProbe)
    };
    const {renderer, probe} = this;
    renderer.setRenderTarget(probe.target);
    renderer.clear();
    this.scene.overrideMaterial = probe.dark;
    this.render(poses.flatMap((pose, part) => hides(part) ? [this.placed(this.bodies[part].solid, part, pose)] : []));
    this.scene.overrideMaterial = probe.light;
    const faces = new Mesh(boxFaces(box));
    this.render([faces]);
    faces.geometry.dispose();
    this.scene.overrideMaterial = null;
    renderer.readRenderTargetPixels(probe.target, 0, 0, kProbe, kProbe, probe.bytes);
    renderer.setRenderTarget(null);
    let count = 0;
    for (let n = 0; n < probe.bytes.length; n += 4) count += probe.bytes[n] > 127;
    return count;
  }

  /** How far apart two points are that look so many pixels apart at a place: for what is dragged there. */
  pixelAt(place) {
    const {position, towards, field} = this.orbit.pose();
    return 2 * Math.tan(field / 2) * Math.max(1e-6, -dot(plus(place, position, -1), towards)) / this.size[1];
  }
}

/** Corners of all parts at some times of their ways: what a view of all of it has to show. */
export function reached(parts, posesAt, moments) {
  return moments.flatMap(
      moment =>
          posesAt(moment).flatMap((pose, part) => cornersOf(parts[part].box).map(p => placedBy(pose, parts[part].pivot_mm, p))));
}
