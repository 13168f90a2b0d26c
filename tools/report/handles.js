// What is taken hold of in the view: each handle lies at a point of the body, and is dragged or moved by arrow keys.

import {cross, dot, firstHit, length, plus} from './geometry.js';
import {svg} from './overlay.js';
import {html} from './panels.js';

const kIcons = {
  level: 'M0 -11 5 -4H-5ZM0 11 5 4H-5Z',
  along: 'M-11 0 -4 5V-5ZM11 0 4 5V-5Z',
  tilt: 'M0 -10 6 0H2V9H-2V0H-6Z',
  point: 'M0 -10V-4M0 10V4M-10 0H-4M10 0H4M0 -2.5A2.5 2.5 0 0 1 0 2.5A2.5 2.5 0 0 1 0 -2.5'
};
const kArrows = {
  ArrowUp: [0, 1],
  ArrowDown: [0, -1],
  ArrowRight: [1, 0],
  ArrowLeft: [-1, 0]
};

/**
 * Takes the pointer and the keys of one handle. `of` says what it does:
 *   name, words, icon;
 *   holds                   what of an attitude it moves
 *   place(stage)            where it lies, in the body's frame, or null: it is not there
 *   told(stage)             its value in words
 *   drag(stage, pixel)      called with where the pointer has it; @returns settings that change, or null
 *   nudge(stage, [x, y])    the same for a step to the right and up
 */
class Handle {
  constructor(stage, of, edit) {
    Object.assign(this, {stage, of, edit});
    const icon = svg('svg', {viewBox: '-14 -14 28 28', 'aria-hidden': 'true'}, svg('path', {d: kIcons[of.icon]}));
    this.element =
        html('div', {class: `handle ${of.name}`, role: 'slider', tabindex: '0', 'aria-label': of.words, title: of.words}, icon);
    const on = (type, act) => this.element.addEventListener(type, event => act.call(this, event));
    on('pointerdown', this.press);
    on('pointermove', this.move);
    on('pointerup', this.release);
    on('pointercancel', this.release);
    on('keydown', this.key);
    on('keyup', this.keyUp);
    on('blur', this.keyUp);
  }

  pixel(event) {
    const {left, top} = this.stage.stage.getBoundingClientRect();
    return [event.clientX - left - this.held[0], event.clientY - top - this.held[1]];
  }

  press(event) {
    if (event.button > 0) return;
    event.preventDefault();
    this.element.focus({preventScroll: true});
    this.element.setPointerCapture(event.pointerId);
    this.held = [0, 0];
    const [x, y] = this.pixel(event);
    this.held = [x - this.at[0], y - this.at[1]];
    this.dragged = false;
    this.element.classList.add('held');
    this.of.press?.(this.stage);
  }

  move(event) {
    if (!this.held) return;
    const changes = this.of.drag(this.stage, this.pixel(event));
    if (!changes) return;
    this.dragged = true;
    this.edit(changes, this.of.holds);
  }

  release() {
    if (!this.held) return;
    this.held = null;
    this.element.classList.remove('held');
    if (this.dragged) this.edit({}, null);
  }

  key(event) {
    const way = kArrows[event.key];
    if (!way || event.altKey || event.ctrlKey || event.metaKey) return;
    event.preventDefault();
    event.stopPropagation();
    const changes = this.of.nudge(this.stage, way.map(n => n * (event.shiftKey ? 10 : 1)));
    if (!changes) return;
    this.keyed = true;
    this.edit(changes, this.of.holds);
  }

  keyUp() {
    if (!this.keyed) return;
    this.keyed = false;
    this.edit({}, null);
  }

  put(project, [width, height]) {
    const place = this.of.place(this.stage);
    this.element.hidden = !place;
    if (!place) return;
    const [x, y] = project(place);
    this.at = [Math.max(22, Math.min(width - 22, x)), Math.max(22, Math.min(height - 22, y))];
    this.element.style.transform = `translate(${this.at[0].toFixed(1)}px, ${this.at[1].toFixed(1)}px)`;
    this.element.classList.toggle('at-left', this.at[0] < 0.4 * width);
    const told = this.of.told(this.stage);
    this.element.dataset.told = told;
    this.element.setAttribute('aria-valuetext', told);
    this.element.setAttribute('aria-valuenow', parseFloat(told) || 0);
  }
}

/** All handles of a stage. */
export class Handles {
  /** @param edit  called with settings that change, and what of the attitude is held; null: the hand has let go */
  constructor(stage, edit) {
    this.stage = stage;
    this.edit = edit;
    this.layer = html('div', {class: 'handles'});
    this.handles = [];
    stage.stage.append(this.layer);
    stage.drawn.push((project, width, height) => this.put(project, width, height));
  }

  show(kinds) {
    const names = kinds.map(kind => kind.name).join();
    if (names === this.names) return;
    this.names = names;
    this.handles = kinds.map(kind => new Handle(this.stage, kind, this.edit));
    this.layer.replaceChildren(...this.handles.map(handle => handle.element));
    if (this.seen) this.put(...this.seen);
  }

  put(project, width, height) {
    this.seen = [project, width, height];
    for (const handle of this.handles) handle.put(project, [width, height]);
  }
}

// ------------------------------------------------------------------------------------------------------------------ what there is

export const kUps = {
  x: [1, 0, 0],
  y: [0, 1, 0],
  z: [0, 0, 1],
  '-x': [-1, 0, 0],
  '-y': [0, -1, 0],
  '-z': [0, 0, -1]
};
const decimals = (x, digits) => `${+ x.toFixed(digits)}`;
/** So many digits that a step is a thousandth of the body, at least. */
const digitsFor = ({radius}) => Math.max(0, Math.min(4, 3 - Math.floor(Math.log10(2 * radius))));
const textOfPoint = (stage, p) => p.map(x => decimals(x, 1 + digitsFor(stage))).join(',');
const middle = ({data: {view: {low_mm, size_mm}}}) => plus(low_mm, size_mm, 0.5);

/** Where on a line a pixel points: the line as seen is followed by steps of Newton. */
function along(project, from, axis, pixel, start) {
  let t = start;
  for (let n = 0; n < 6; ++n) {
    const [x, y] = project(plus(from, axis, t)), [X, Y] = project(plus(from, axis, t + 1));
    const way = [X - x, Y - y], square = way[0] ** 2 + way[1] ** 2;
    if (square < 1e-6) return t;  // it is looked along the line
    t += Math.max(-50, Math.min(50, ((pixel[0] - x) * way[0] + (pixel[1] - y) * way[1]) / square));
  }
  return t;
}

/** Half of how wide the body is along a direction. */
function reach({data: {view: {size_mm}}}, axis) {
  return 0.5 * (Math.abs(axis[0]) * size_mm[0] + Math.abs(axis[1]) * size_mm[1] + Math.abs(axis[2]) * size_mm[2]);
}

/** To the right of the viewer, level. */
function sideways(stage) {
  const {to_ground: [right, , up]} = stage.attitude;
  const aside = stage.view?.orbit.pose().aside ?? right;
  const level = plus(aside, up, -dot(aside, up));
  return length(level) > 1e-3 ? level.map(n => n / length(level)) : right;
}

export const kWaterline = {
  name: 'waterline',
  words: 'Waterline. Up and down arrows move it.',
  icon: 'level',
  holds: ['waterline'],
  place(stage) {
    const {waterline, up} = stage.attitude;
    if (waterline === null) return null;
    const side = sideways(stage), centre = middle(stage);
    return plus(plus(centre, up, waterline - dot(centre, up)), side, 1.12 * reach(stage, side));
  },
  told: ({attitude}) => `${(attitude.waterline - attitude.lowest_mm).toFixed(1)} mm`,
  change(stage, height) {
    const {lowest_mm, highest_mm} = stage.attitude;
    const waterline = Math.max(0.01 * (highest_mm - lowest_mm), Math.min(0.999 * (highest_mm - lowest_mm), height));
    stage.place({...stage.attitude, waterline: lowest_mm + waterline}, 'hold');
    return {waterline: decimals(waterline, digitsFor(stage)), submerged: undefined};
  },
  drag(stage, pixel) {
    const {waterline, lowest_mm, up} = stage.attitude;
    const from = plus(this.place(stage), up, -waterline);
    return this.change(stage, along(stage.project, from, up, pixel, waterline) - lowest_mm);
  },
  nudge(stage, [, up]) {
    const {waterline, lowest_mm, highest_mm} = stage.attitude;
    return up ? this.change(stage, waterline - lowest_mm + up * 0.005 * (highest_mm - lowest_mm)) : null;
  }
};

/** @param words  what up is called */
export const upHandle = words => ({
  name: 'up',
  words,
  icon: 'tilt',
  holds: ['up', 'to_ground', 'lowest_mm', 'highest_mm', 'waterline', 'ground'],
  place(stage) {
    const {up} = stage.attitude;
    return plus(middle(stage), this.up ?? up, 1.25 * reach(stage, up) + 0.12 * stage.radius);
  },
  told: stage => `up ${nameOfUp(stage.attitude.up)}`,
  press(stage) {
    const {up} = stage.attitude;
    this.size = length(plus(this.place(stage), middle(stage), -1));
    this.front = dot(up, stage.view.orbit.pose().towards) >= 0 ? 1 : -1;
  },
  change(stage, direction) {
    const near = Object.entries(kUps).find(([, axis]) => dot(axis, direction) / length(direction) > Math.cos(4 * Math.PI / 180));
    const text = near ? near[0] : direction.map(x => decimals(x / length(direction), 3)).join(',');
    stage.place(turnedTo(stage, near ? near[1] : direction.map(x => x / length(direction))), 'hold');
    return {up: text};
  },
  drag(stage, pixel) {
    if (!stage.view) return null;
    const {aside, above, towards} = stage.view.orbit.pose();
    const centre = middle(stage), [cx, cy] = stage.project(centre);
    const [ax, ay] = stage.project(plus(centre, aside, this.size));
    const size = Math.hypot(ax - cx, ay - cy);
    const x = (pixel[0] - cx) / size, y = (cy - pixel[1]) / size, flat = Math.max(1, Math.hypot(x, y));
    const z = this.front * Math.sqrt(Math.max(0, 1 - (x * x + y * y) / flat ** 2));
    return this.change(stage, plus(plus(towards.map(n => n * z), aside, x / flat), above, y / flat));
  },
  nudge(stage, [x, y]) {
    const {up, to_ground: [right, front]} = stage.attitude;
    const pose = stage.view?.orbit.pose() ?? {aside: right, above: front};
    const step = 2 * Math.PI / 180;
    return this.change(stage, plus(plus(up, pose.aside, x * step), pose.above, y * step));
  }
});

const nameOfUp = up => Object.keys(kUps).find(name => dot(kUps[name], up) > 0.99999) ?? up.map(x => x.toFixed(2)).join(', ');

/** The attitude with another up, as far as the view can know it. */
export function turnedTo(stage, up) {
  const {view: {low_mm, size_mm}} = stage.data;
  const {positions} = stage.bodies[0].mesh;
  let lowest = Infinity, highest = -Infinity;
  for (let n = 0; n < positions.length; n += 3) {
    const height = positions[n] * up[0] + positions[n + 1] * up[1] + positions[n + 2] * up[2];
    lowest = Math.min(lowest, height);
    highest = Math.max(highest, height);
  }
  if (!positions.length) lowest = highest = dot(plus(low_mm, size_mm, 0.5), up);
  const before = stage.attitude;
  const share = before?.waterline != null ? (before.waterline - before.lowest_mm) / (before.highest_mm - before.lowest_mm) : null;
  return {
    ...before,
    up,
    to_ground: frameOf(up),
    lowest_mm: lowest,
    highest_mm: highest,
    waterline: share === null ? null : lowest + share * (highest - lowest),
    ground: before?.ground != null ? lowest : null
  };
}

/** Rows: the axes of the ground's frame; those of the body where up is z. */
export function frameOf(up) {
  const other = Math.abs(up[2]) > 0.9 ? [1, 0, 0] : [-up[1], up[0], 0];
  const flat = plus(other, up, -dot(other, up));
  const right = flat.map(x => x / length(flat));
  return [right, cross(up, right), up];
}

const facing = up => normal => dot(normal, up) < 0;

/** Where the tip touches the ground: on what faces down. */
export const kContact = {
  name: 'point',
  words: 'Contact point, on which it spins. Arrow keys move it over the surface.',
  icon: 'point',
  holds: ['point_mm'],
  place: ({attitude}) => attitude.point_mm ?? null,
  told: stage => textOfPoint(stage, stage.attitude.point_mm),
  change(stage, point) {
    if (!point) return null;
    stage.place({...stage.attitude, point_mm: point}, 'hold');
    return {point: textOfPoint(stage, point)};
  },
  drag(stage, pixel) {
    if (!stage.view) return null;
    const {from, along} = stage.view.ray(pixel);
    const {mesh} = stage.bodies[0];
    return this.change(stage, firstHit(mesh, from, along, facing(stage.attitude.up)) ?? firstHit(mesh, from, along));
  },
  nudge(stage, [x, y]) {
    const {up, point_mm} = stage.attitude;
    const side = sideways(stage);
    const step = 0.01 * stage.radius;
    const beside = plus(plus(point_mm, side, x * step), cross(up, side), y * step);
    return this.change(stage, firstHit(stage.bodies[0].mesh, plus(beside, up, -4 * stage.radius), up));
  }
};

/** A point that is moved in a plane: a yo-yo's middle as it is looked at, the target of a centre of mass over the ground. */
const flatHandle = (name, words, normalOf) => ({
  name,
  words,
  icon: 'point',
  holds: [],
  place: stage => stage.points?.[name] ?? null,
  told: stage => textOfPoint(stage, stage.points[name]),
  change(stage, point) {
    stage.points[name] = point;
    stage.view?.change();
    return {[name]: textOfPoint(stage, point)};
  },
  drag(stage, pixel) {
    if (!stage.view) return null;
    const {from, along} = stage.view.ray(pixel), normal = normalOf(stage), point = this.place(stage);
    const steep = dot(along, normal);
    return Math.abs(steep) < 0.02 ? null : this.change(stage, plus(from, along, dot(plus(point, from, -1), normal) / steep));
  },
  nudge(stage, [x, y]) {
    const [right, front] = frameOf(normalOf(stage)), step = 0.01 * stage.radius;
    return this.change(stage, plus(plus(this.place(stage), right, x * step), front, y * step));
  }
});

export const kCentre = flatHandle(
    'center', 'Middle of the yo-yo. Arrow keys move it.', stage => stage.view?.orbit.pose().towards ?? stage.attitude.up);
export const kTarget =
    flatHandle('target', 'Where the centre of mass shall be, over the ground. Arrow keys move it.', stage => stage.attitude.up);

/** Of the view alone; the range beside the view does the same. */
export const kCut = {
  name: 'cut',
  words: 'Cut. Arrow keys move it.',
  icon: 'along',
  place(stage) {
    if (!stage.cutPlane || !stage.view) return null;
    const {normal, offset} = stage.cutPlane, centre = middle(stage);
    const above = stage.attitude.up.map((x, n) => normal[n] ? 0 : x);
    const up = length(above) > 0.1 ? above.map(x => x / length(above)) : sideways(stage).map((x, n) => normal[n] ? 0 : x);
    return plus(plus(centre, normal, offset - dot(centre, normal)), up, -1.15 * reach(stage, up));
  },
  told: stage => stage.cutAt.textContent,
  change(stage, part) {
    stage.range.value = 200 * Math.max(0, Math.min(1, part));
    stage.cut();
    return null;
  },
  drag(stage, pixel) {
    const n = stage.cutPlane.normal.findIndex(x => x), axis = [0, 1, 2].map(k => k === n ? 1 : 0);
    const {low_mm, size_mm} = stage.data.view, place = this.place(stage);
    const at = along(stage.project, plus(place, axis, -place[n]), axis, pixel, place[n]);
    return this.change(stage, (at - low_mm[n]) / size_mm[n]);
  },
  nudge(stage, [x, y]) {
    return this.change(stage, (+stage.range.value + (x || y)) / 200);
  }
};
