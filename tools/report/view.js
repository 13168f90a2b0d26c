// The bodies in 3D: glass outside, what is inside of it solid, and a section with what it cuts filled.

// clang-format off
import {
  AlwaysStencilFunc, BackSide, BufferGeometry, Color, DecrementWrapStencilOp, DoubleSide, EqualStencilFunc, FrontSide,
  IncrementWrapStencilOp, KeepStencilOp, LineBasicMaterial, LineSegments, Mesh, NotEqualStencilFunc, Plane, Scene, ShaderMaterial,
  Vector4
} from 'three';
// clang-format on



import {CanvasView, discOf, geometryOf, square, stretchesOf} from './canvas_view.js';
import {cross, crossing, dot, length, plus} from './geometry.js';
import {distanceFor} from './orbit.js';
import {kCap, kDisc, kSurface} from './shaders.js';

const kBehindLines = {
  polygonOffset: true,
  polygonOffsetFactor: 1,
  polygonOffsetUnits: 2
};
const kNowhere = [0, 0, 0, 1];  // a cut that takes nothing away

export class View extends CanvasView {
  /**
   * @param canvas  where it is drawn; takes keys and the pointer
   * @param drawn   called after each drawing with a function that brings a point of the body to pixels
   */
  constructor(canvas, drawn) {
    super(canvas, drawn, {stencil: true});
    this.renderer.localClippingEnabled = true;
    this.kept = new Plane();
    this.bodies = [];
    this.stale = [];  // scenes that were drawn, and are to be given back when others were
    this.glass = 0.16;
    this.hidden = new Set();
    this.cutBy = null;
  }

  /** @param bodies  {what, closed, mesh}: of each what it is, and its triangles; what was shown before is not made anew */
  show(bodies) {
    const before = this.bodies;
    this.bodies = bodies.map(
        ({what, closed, mesh}) =>
            ({what, closed, mesh, geometry: before.find(body => body.mesh === mesh)?.geometry ?? geometryOf(mesh)}));
    for (const {geometry} of before)
      if (!this.bodies.some(body => body.geometry === geometry)) geometry.dispose();
    if (before[0]?.mesh !== bodies[0].mesh) {
      const {positions} = bodies[0].mesh;
      this.points = someOf(positions);
      this.radius = Math.max(1e-9, boxDiagonal(positions) / 2);
    }
    this.renew();
  }

  /** Scenes are built with the next drawing. */
  renew() {
    if (this.scenes) this.stale.push(this.scenes);
    this.scenes = null;
    this.cut(this.cutBy);
  }

  /**
   * @param attitude  of the page's data, and `waterline` and `ground`, of the planes up . p, or null
   * @param camera    'home': as it is first; 'keep': from where it was, with up upright; 'hold': exactly as it was
   */
  place(attitude, camera = 'home') {
    this.attitude = attitude;
    if (camera !== 'hold' || !this.home) this.lookFrom(camera);
    this.renew();
  }

  lookFrom(camera) {
    const before = this.home && {...this.orbit.pose(), distance: this.orbit.distance};
    const [right, front, up] = this.attitude.to_ground;
    const spread = axis => {
      const along = this.points.map(p => dot(p, axis));
      return [Math.min(...along), Math.max(...along)];
    };
    const [x, y, z] = [right, front, up].map(spread);
    const target = plus(plus(right.map(n => n * (x[0] + x[1]) / 2), front, (y[0] + y[1]) / 2), up, (z[0] + z[1]) / 2);
    // Its broad side, a little from the left and from above.
    const azimuth = (x[1] - x[0] >= y[1] - y[0] ? -Math.PI / 2 : 0) + 0.42;
    this.home = {azimuth, elevation: 0.26, distance: 3 * this.radius, target};
    this.orbit.fresh = true;
    this.orbit.reset({right, front, up}, this.home);
    this.fit();
    if (before && camera === 'keep') this.orbit.lookAlong(before);
    this.orbit.fresh = false;
  }

  /** Brings the camera so near that all is seen. */
  fit() {
    if (!this.home || !this.size[1]) return;
    const hung = this.attitude.kind === 'hangs' && this.attitude.point_mm ? [this.attitude.point_mm] : [];
    this.home.distance = distanceFor([...this.points, ...hung], this.home.target, this.orbit.pose(), this.size[0] / this.size[1]);
    this.orbit.goHome();
    this.fitted = true;
  }

  resized(before) {
    const factor = before ? before / (this.size[0] / this.size[1]) : 1;
    if (this.fitted && Math.abs(factor - 1) <= 0.2) return;
    this.orbit.fresh = true;
    this.fit();
    this.orbit.fresh = false;
  }

  /** @param cut  {normal, offset}: what lies beyond is taken away; null: nothing is */
  cut(cut) {
    this.cutBy = cut;
    for (const {scene} of this.outlines ?? []) giveBackAll(scene.children);
    this.outlines = null;
    this.change();
  }

  /** @param colors  by name, as CSS has them */
  paint(colors) {
    this.colors = colors;
    this.renew();
  }

  hide(what, hidden) {
    if (hidden)
      this.hidden.add(what);
    else
      this.hidden.delete(what);
    this.change();
  }

  // ------------------------------------------------------------------------------------------------------------------- scenes

  color(name) {
    return new Color(this.colors[name]);
  }

  surface(color, opacity, edge, more) {
    return new ShaderMaterial({
      vertexShader: kSurface.vertex,
      fragmentShader: kSurface.fragment,
      uniforms: {
        uColor: {value: this.color(color)},
        uOpacity: {value: opacity},
        uEdge: {value: edge},
        uCut: {value: new Vector4(...kNowhere)}
      },
      ...more
    });
  }

  build() {
    const scene = (...meshes) => {
      const result = new Scene();
      result.matrixWorldAutoUpdate = false;
      result.add(...meshes);
      return result;
    };
    const flat = (disc, color, opacity, stencil) => new Mesh(
        disc, new ShaderMaterial({
          vertexShader: kDisc.vertex,
          fragmentShader: kDisc.fragment,
          uniforms: {uColor: {value: this.color(color)}, uOpacity: {value: opacity}, uCut: {value: new Vector4(...kNowhere)}},
          transparent: true,
          depthWrite: false,
          side: DoubleSide,
          ...stencil
        }));
    const inside = this.bodies.filter(body => body.what !== 'shell');
    const outside = this.bodies.filter(body => body.what === 'shell');
    this.scenes = {
      inside: inside.map(
          body => ({
            what: body.what,
            scene: scene(new Mesh(body.geometry, this.surface(kColors[body.what], 1, 0, {side: DoubleSide, ...kBehindLines})))
          })),
      // The nearest of it alone, so that folds behind each other do not add up.
      depth: scene(...outside.map(
          body => new Mesh(body.geometry, this.surface('shell', 1, 0, {side: FrontSide, colorWrite: false, ...kBehindLines})))),
      glass: scene(...outside.map(
          body => new Mesh(
              body.geometry, this.surface('shell', this.glass, 0.75, {side: FrontSide, transparent: true, depthWrite: false})))),
      phases: this.phases(scene)
    };
    const {waterline, ground, up} = this.attitude;
    if (waterline !== null) {
      const disc = discOf(this.attitude, waterline, this.target(), 1.6 * this.radius);
      this.scenes.wet = this.counting(scene, outside, [...up, waterline]);
      // Around the hull, and where it is taken away.
      const [around, within] = [EqualStencilFunc, NotEqualStencilFunc].map(
          stencilFunc => flat(
              disc, 'water', 0.34,
              {stencilWrite: true, stencilFunc, stencilRef: 0, stencilFail: KeepStencilOp, stencilZPass: KeepStencilOp}));
      this.scenes.water = scene(around);
      this.scenes.instead = scene(within);
      const line = outside.map(body => crossing(body.mesh, up, waterline));
      this.scenes.waterline = scene(...line.map(stretches => this.line(stretches, 'water')));
      for (const one of this.scenes.waterline.children) one.material.clippingPlanes = [this.kept];
    }
    if (ground !== null)
      this.scenes.ground = scene(flat(discOf(this.attitude, ground, this.target(), 1.5 * this.radius), 'ground', 0.3));
    this.outlines = null;
  }

  target() {
    return this.home.target;
  }

  line(stretches, color) {
    return new LineSegments(stretchesOf(stretches), new LineBasicMaterial({color: this.color(color)}));
  }

  /**
   * Counts in the stencil how often a line of sight enters and leaves what is below a plane: not 0 where the plane cuts material.
   */
  counting(scene, bodies, plane) {
    const passes = [[BackSide, IncrementWrapStencilOp], [FrontSide, DecrementWrapStencilOp]];
    return scene(...bodies.flatMap(body => passes.map(([side, op]) => {
      const material = this.surface('shell', 1, 0, {
        side,
        colorWrite: false,
        depthWrite: false,
        depthTest: false,
        stencilWrite: true,
        stencilFunc: AlwaysStencilFunc,
        stencilFail: op,
        stencilZFail: op,
        stencilZPass: op
      });
      material.uniforms.uCut.value.set(...plane);
      return new Mesh(body.geometry, material);
    })));
  }

  /** What is filled where it is cut: the material first, then over it what lies in it. */
  phases(scene) {
    const groups = [['cap', this.bodies.filter(body => body.what === 'shell' || body.what === 'cavity')]];
    for (const body of this.bodies)
      if (body.what !== 'shell' && body.what !== 'cavity') groups.push([kColors[body.what], [body]]);
    return groups.filter(([, bodies]) => bodies.length && bodies.every(body => body.closed)).map(([color, bodies]) => {
      const cap = new Mesh(
          new BufferGeometry(), new ShaderMaterial({
            vertexShader: kCap.vertex,
            fragmentShader: kCap.fragment,
            uniforms: {uColor: {value: this.color(color)}, uHatch: {value: this.color(`${color}-hatch`)}, uPitch: {value: 9}},
            side: DoubleSide,
            ...kBehindLines,
            stencilWrite: true,
            stencilFunc: NotEqualStencilFunc,
            stencilRef: 0,
            stencilZPass: KeepStencilOp
          }));
      return {what: bodies[0].what, bodies, count: this.counting(scene, bodies, kNowhere), cap, capScene: scene(cap)};
    });
  }

  /** Brings the scenes to the cut as it is. */
  applyCut() {
    const plane = this.cutBy ? [...this.cutBy.normal, this.cutBy.offset] : kNowhere;
    const {inside, depth, glass, phases} = this.scenes;
    for (const scene of [...inside.map(one => one.scene), depth, glass, ...phases.map(phase => phase.count)])
      for (const mesh of scene.children) mesh.material.uniforms.uCut.value.set(...plane);
    const [x, y, z, offset] = plane;
    this.kept.setComponents(-x, -y, -z, offset);
    for (const mesh of this.scenes.instead?.children ?? []) mesh.material.uniforms.uCut.value.set(-x, -y, -z, -offset);
    for (const mesh of glass.children) mesh.material.uniforms.uOpacity.value = this.glass;
    if (this.outlines || !this.cutBy) return;
    this.outlines = [];
    for (const phase of phases) {
      phase.cap.geometry.dispose();
      phase.cap.geometry = quad(this.cutBy, this.target(), 2.5 * this.radius);
    }
    for (const body of this.bodies) {
      const scene = new Scene();
      scene.add(this.line(crossing(body.mesh, this.cutBy.normal, this.cutBy.offset), 'outline'));
      this.outlines.push({what: body.what, scene});
    }
  }

  draw() {
    if (!this.size[1] || !this.colors || !this.attitude) return;
    if (!this.scenes) this.build();
    this.applyCut();
    this.aim();
    const {renderer, camera, scenes} = this;
    const shown = what => !this.hidden.has(what);
    const render = scene => renderer.render(scene, camera);
    renderer.clear();
    if (scenes.ground && shown('ground')) render(scenes.ground);
    for (const {what, scene} of scenes.inside)
      if (shown(what)) render(scene);
    if (this.cutBy) {
      for (const {what, count, cap, capScene} of scenes.phases) {
        if (!shown(what)) continue;
        cap.material.uniforms.uPitch.value = 9 * renderer.getPixelRatio();
        renderer.clearStencil();
        render(count);
        render(capScene);
      }
      for (const {what, scene} of this.outlines)
        if (shown(what)) render(scene);
    }
    if (shown('shell')) {
      render(scenes.depth);
      render(scenes.glass);
    }
    if (scenes.water && shown('water')) {
      renderer.clearStencil();
      render(scenes.wet);
      render(scenes.water);
      if (this.cutBy) render(scenes.instead);
      render(scenes.waterline);
    }
    for (const old of this.stale.splice(0)) giveBack(old, this.bodies);
    this.drawn(this.projection());
  }

  /** Along which line a pixel is seen: {from, along}. */
  ray([x, y]) {
    const {position, towards, aside, above, field} = this.orbit.pose();
    const [width, height] = this.size;
    const scale = 2 * Math.tan(field / 2) / height;
    const along = plus(plus(towards.map(n => -n), aside, (x - width / 2) * scale), above, (height / 2 - y) * scale);
    return {from: position, along: along.map(n => n / length(along))};
  }

  aim() {
    const {orbit: {distance}, size, radius} = this;
    const reach = {near: Math.max(0.02 * radius, distance - 6 * radius), far: distance + 8 * radius};
    this.aimAt(this.orbit.pose(), reach, size[0] / size[1]);
  }
}

/** What only these scenes used. Their shaders stay where others of their kind are in use. */
function giveBack(scenes, bodies) {
  const kept = new Set(bodies.map(body => body.geometry));
  const {inside, phases, ...others} = scenes;
  const all =
      [...inside.map(({scene}) => scene), ...phases.flatMap(({count, capScene}) => [count, capScene]), ...Object.values(others)];
  giveBackAll(all.flatMap(scene => scene.children), kept);
}

function giveBackAll(meshes, kept = new Set()) {
  for (const {material, geometry} of meshes) {
    material.dispose();
    if (!kept.has(geometry)) geometry.dispose();
  }
}

const kColors = {
  cavity: 'void',
  sparse: 'sparse',
  insert: 'insert',
  plug: 'insert'
};

/** Points that stand for all: every vertex, or of many some. */
function someOf(positions) {
  const points = [];
  const step = 3 * Math.max(1, Math.floor(positions.length / 3 / 5000));
  for (let n = 0; n < positions.length; n += step) points.push([positions[n], positions[n + 1], positions[n + 2]]);
  return points.length ? points : [[0, 0, 0]];
}

function boxDiagonal(positions) {
  const low = [Infinity, Infinity, Infinity], high = [-Infinity, -Infinity, -Infinity];
  for (let n = 0; n < positions.length; ++n) {
    low[n % 3] = Math.min(low[n % 3], positions[n]);
    high[n % 3] = Math.max(high[n % 3], positions[n]);
  }
  return positions.length ? length(plus(high, low, -1)) : 0;
}

function quad({normal, offset}, center, half) {
  const least = [0, 1, 2].reduce((k, n) => Math.abs(normal[n]) < Math.abs(normal[k]) ? n : k, 0);
  const other = [0, 0, 0];
  other[least] = 1;
  const right = cross(normal, other);
  const unit = right.map(x => x / length(right));
  return square(plus(center, normal, offset - dot(center, normal)), unit, cross(normal, unit), half);
}
