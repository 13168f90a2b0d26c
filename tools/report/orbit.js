// A camera that turns about a body: by pointer, wheel, fingers and keys.

import {dot, plus} from './geometry.js';

const kTurn = Math.PI / 36;
const kSteepest = 89 * Math.PI / 180;
const kField = 28 * Math.PI / 180;  // of view, from top to bottom

/**
 * @param element  takes the keys and the pointer
 * @param changed  called when there is something new to draw
 */
export class Orbit {
  constructor(element, changed) {
    this.element = element;
    this.changed = changed;
    this.pointers = new Map();
    this.frame = {right: [1, 0, 0], front: [0, 1, 0], up: [0, 0, 1]};
    this.home = {azimuth: 0, elevation: 0.3, distance: 1, target: [0, 0, 0]};
    Object.assign(this, this.home);
    const on = (type, handle, options) => element.addEventListener(type, handle, options);
    on('pointerdown', event => this.press(event));
    on('pointermove', event => this.move(event));
    for (const type of ['pointerup', 'pointercancel']) on(type, event => this.pointers.delete(event.pointerId));
    on('wheel', event => this.wheel(event), {passive: false});
    on('keydown', event => this.key(event));
    on('contextmenu', event => event.preventDefault());
  }

  /** World: up, and what lies to the right and ahead at azimuth 0. The view begins at `home`. */
  reset(frame, home) {
    this.frame = frame;
    this.home = home;
    this.goHome();
  }

  goHome() {
    this.turnTo(this.home.azimuth, this.home.elevation);
    this.distance = this.home.distance;
    this.target = this.home.target.slice();
  }

  /** From where another frame had it: a pose and its distance. */
  lookAlong({towards, distance, target}) {
    const {right, front, up} = this.frame;
    cancelAnimationFrame(this.turning);
    this.azimuth = Math.atan2(dot(towards, front), dot(towards, right));
    this.elevation = Math.max(-kSteepest, Math.min(kSteepest, Math.asin(Math.max(-1, Math.min(1, dot(towards, up))))));
    this.distance = distance;
    this.target = target;
    this.changed();
  }

  /** Turns there, in a short while where motion is welcome. */
  turnTo(azimuth, elevation) {
    cancelAnimationFrame(this.turning);
    const still = matchMedia('(prefers-reduced-motion: reduce)').matches;
    const from = {azimuth: this.azimuth, elevation: this.elevation};
    let way = (azimuth - from.azimuth) % (2 * Math.PI);
    if (way > Math.PI) way -= 2 * Math.PI;
    if (way < -Math.PI) way += 2 * Math.PI;
    const begun = performance.now();
    const step = now => {
      const part = still || this.fresh ? 1 : Math.min(1, (now - begun) / 350);
      const eased = part * part * (3 - 2 * part);
      this.azimuth = from.azimuth + eased * way;
      this.elevation = from.elevation + eased * (elevation - from.elevation);
      this.changed();
      if (part < 1) this.turning = requestAnimationFrame(step);
    };
    step(begun);
  }

  /** Where the camera is, and its axes. */
  pose() {
    const {right, front, up} = this.frame;
    const flat = plus(right.map(x => x * Math.cos(this.azimuth)), front, Math.sin(this.azimuth));
    const towards = plus(flat.map(x => x * Math.cos(this.elevation)), up, Math.sin(this.elevation));
    const aside = plus(right.map(x => -x * Math.sin(this.azimuth)), front, Math.cos(this.azimuth));
    const above = plus(up.map(x => x * Math.cos(this.elevation)), flat, -Math.sin(this.elevation));
    return {position: plus(this.target, towards, this.distance), towards, aside, above, target: this.target, field: kField};
  }

  press(event) {
    this.element.focus({preventScroll: true});
    this.element.setPointerCapture(event.pointerId);
    this.pointers.set(event.pointerId, event);
    cancelAnimationFrame(this.turning);
  }

  move(event) {
    const last = this.pointers.get(event.pointerId);
    if (!last) return;
    const x = event.clientX - last.clientX, y = event.clientY - last.clientY;
    if (this.pointers.size > 1) {
      const other = [...this.pointers.values()].find(p => p.pointerId !== event.pointerId);
      const apart = p => Math.hypot(p.clientX - other.clientX, p.clientY - other.clientY);
      this.zoom(apart(last) / Math.max(1, apart(event)));
      this.shift(x / 2, y / 2);
    } else if (event.shiftKey || last.buttons > 1) {
      this.shift(x, y);
    } else {
      this.turn(-x * 0.008, y * 0.008);
    }
    this.pointers.set(event.pointerId, event);
  }

  turn(aside, up) {
    cancelAnimationFrame(this.turning);
    this.azimuth += aside;
    this.elevation = Math.max(-kSteepest, Math.min(kSteepest, this.elevation + up));
    this.changed();
  }

  zoom(factor) {
    const nearest = 0.1 * this.home.distance;
    this.distance = Math.max(nearest, Math.min(5 * this.home.distance, this.distance * factor));
    this.changed();
  }

  shift(x, y) {
    const {aside, above} = this.pose();
    const scale = 2 * this.distance * Math.tan(kField / 2) / this.element.clientHeight;
    this.target = plus(plus(this.target, aside, -x * scale), above, y * scale);
    this.changed();
  }

  /** A wheel scrolls the page until the view was chosen, by a click or a key. */
  wheel(event) {
    if (document.activeElement !== this.element && !event.ctrlKey) return;
    event.preventDefault();
    this.zoom(Math.exp(0.0015 * Math.max(-100, Math.min(100, event.deltaY))));
  }

  key(event) {
    if (event.altKey || event.metaKey || event.ctrlKey) return;
    const turns = {ArrowLeft: [kTurn, 0], ArrowRight: [-kTurn, 0], ArrowUp: [0, kTurn], ArrowDown: [0, -kTurn]};
    if (turns[event.key])
      this.turn(...turns[event.key]);
    else if (event.key === '+' || event.key === '=')
      this.zoom(1 / 1.15);
    else if (event.key === '-')
      this.zoom(1.15);
    else if (event.key === 'Home')
      this.goHome();
    else
      return;
    event.preventDefault();
  }
}

/** How far away a camera has to be so that all `points` are seen from `towards` with some room around. */
export function distanceFor(points, target, {towards, aside, above}, aspect) {
  const tangent = Math.tan(kField / 2) * 0.86;
  let distance = 1e-9;
  for (const p of points) {
    const d = plus(p, target, -1);
    const near = dot(d, towards);
    distance = Math.max(distance, near + Math.abs(dot(d, above)) / tangent, near + Math.abs(dot(d, aside)) / (tangent * aspect));
  }
  return distance;
}
