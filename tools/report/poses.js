// Where parts are at a time of their way: theory.md (108). Quaternions are w, x, y, z.

import {cross, dot, length, plus} from './geometry.js';

const kSame = 1e-9;

export const times = (q, p) =>
    [q[0] * p[0] - q[1] * p[1] - q[2] * p[2] - q[3] * p[3], q[0] * p[1] + q[1] * p[0] + q[2] * p[3] - q[3] * p[2],
     q[0] * p[2] - q[1] * p[3] + q[2] * p[0] + q[3] * p[1], q[0] * p[3] + q[1] * p[2] - q[2] * p[1] + q[3] * p[0]];

export function turned(q, v) {
  const axis = q.slice(1);
  const twice = cross(axis, v).map(x => 2 * x);
  return plus(plus(v, twice, q[0]), cross(axis, twice));
}

export function turnAbout(axis, angle) {
  const size = length(axis) || 1;
  return [Math.cos(angle / 2), ...axis.map(x => x / size * Math.sin(angle / 2))];
}

/** The axis, of length 1, and the angle, 0 to pi. */
export function axisOf(rotation) {
  const q = rotation[0] < 0 ? rotation.map(x => -x) : rotation;
  const size = length(q.slice(1));
  return size < kSame ? {axis: [0, 0, 1], angle: 0} : {axis: q.slice(1).map(x => x / size), angle: 2 * Math.atan2(size, q[0])};
}

export function slerp(a, b, part) {
  let cosine = a.reduce((sum, x, n) => sum + x * b[n], 0);
  const sign = cosine < 0 ? -1 : 1;
  cosine = Math.min(1, Math.abs(cosine));
  const angle = Math.acos(cosine);
  const [x, y] =
      angle < 1e-6 ? [1 - part, part] : [Math.sin((1 - part) * angle) / Math.sin(angle), Math.sin(part * angle) / Math.sin(angle)];
  const q = a.map((value, n) => x * value + sign * y * b[n]);
  const size = Math.hypot(...q);
  return q.map(value => value / size);
}

/** The number of the first key of the piece that a time is in, and how far through it. */
function pieceAt(keys, time) {
  let n = 0;
  while (n + 2 < keys.length && keys[n + 1].time <= time) ++n;
  const long = keys[n + 1].time - keys[n].time;
  return [n, long > 0 ? Math.max(0, Math.min(1, (time - keys[n].time) / long)) : 1];
}

const between = (a, b, part) => plus(a.map(x => (1 - part) * x), b, part);

/** Points of a cubic curve's two halves, by de Casteljau. */
function split(a, b, part) {
  const first = between(a.at, a.out, part), middle = between(a.out, b.in, part), last = between(b.in, b.at, part);
  const into = between(first, middle, part), out = between(middle, last, part);
  return {first, into, at: between(into, out, part), out, last};
}

/** @returns {rotation, translation} */
export function poseAt({translation, rotation}, time) {
  const pose = {translation: translation[0]?.at ?? [0, 0, 0], rotation: rotation[0]?.rotation ?? [1, 0, 0, 0]};
  if (translation.length > 1) {
    const [n, part] = pieceAt(translation, time);
    pose.translation = split(translation[n], translation[n + 1], part).at;
  }
  if (rotation.length > 1) {
    const [n, part] = pieceAt(rotation, time);
    pose.rotation = slerp(rotation[n].rotation, rotation[n + 1].rotation, part);
  }
  return pose;
}

/** Where a point of a part is. */
export const placedBy = ({rotation, translation}, pivot, p) => plus(plus(turned(rotation, plus(p, pivot, -1)), pivot), translation);

/** Which point of the part is there. */
export function pointAt({rotation, translation}, pivot, place) {
  const [w, x, y, z] = rotation;
  return plus(turned([w, -x, -y, -z], plus(plus(place, pivot, -1), translation, -1)), pivot);
}

export const moves = ({translation, rotation}) => translation.some(key => length(plus(key.at, translation[0].at, -1)) > kSame) ||
    rotation.some(key => Math.abs(key.rotation.reduce((sum, x, n) => sum + x * rotation[0].rotation[n], 0)) < 1 - kSame);

// --------------------------------------------------------------------------------------------------------------------- editing

const kThirds = 1e-6;

const isStraight = (a, b) => {
  const size = length(plus(b.at, a.at, -1)) + 1;
  return length(plus(a.out, between(a.at, b.at, 1 / 3), -1)) < kThirds * size &&
      length(plus(b.in, between(a.at, b.at, 2 / 3), -1)) < kThirds * size;
};

/** A key of a part's way put elsewhere. Its handles go with it; where the way was straight it stays so. */
function translationMoved(keys, n, {time, at}) {
  const result = keys.map(key => ({...key}));
  const by = plus(at, keys[n].at, -1);
  result[n] = {time, at, in : plus(keys[n].in, by), out: plus(keys[n].out, by)};
  for (const k of [n - 1, n]) {
    if (!keys[k] || !keys[k + 1] || !isStraight(keys[k], keys[k + 1])) continue;
    result[k].out = between(result[k].at, result[k + 1].at, 1 / 3);
    result[k + 1].in = between(result[k].at, result[k + 1].at, 2 / 3);
  }
  return result;
}

/** @param kind  'translation' or 'rotation' @param to  what changes of key n: time, at, rotation */
export function keyMoved(motion, kind, n, to) {
  const keys = motion[kind];
  const near = 1e-3;
  const time = Math.max(keys[n - 1].time + near, Math.min(keys[n + 1].time - near, to.time ?? keys[n].time));
  const changed = kind === 'translation' ? translationMoved(keys, n, {time, at: to.at ?? keys[n].at}) :
                                           keys.map((key, k) => k === n ? {time, rotation: to.rotation ?? key.rotation} : key);
  return {...motion, [kind]: changed};
}

/** A way that begins or ends elsewhere. @param end  0 or 1 @param pose  {rotation, translation} */
export function endMoved({translation, rotation}, end, pose) {
  const last = keys => end ? keys.length - 1 : 0;
  return {
    translation: translationMoved(translation, last(translation), {time: end, at: pose.translation}),
    rotation: rotation.map((key, n) => n === last(rotation) ? {time: end, rotation: pose.rotation} : key)
  };
}

/** A scene with a part elsewhere in a state, and on the ways that begin or end there. @returns {states, transitions} */
export function partPut({states, transitions}, state, part, pose) {
  const changed = (list, n, one) => list.map((old, k) => k === n ? one : old);
  return {
    states: changed(states, state, {...states[state], poses: changed(states[state].poses, part, pose)}),
    transitions: transitions.map(way => {
      const ends = [way.from, way.to].flatMap((n, end) => n === state ? [end] : []);
      if (!ends.length) return way;
      const motion = ends.reduce((moved, end) => endMoved(moved, end, pose), way.motions[part]);
      return {...way, motions: changed(way.motions, part, motion)};
    })
  };
}

/** The axis about which a part turns on a way that begins or ends in a state; null: on none. */
export function axisAt({transitions}, state, part) {
  for (const {from, to, motions} of transitions) {
    if (from !== state && to !== state) continue;
    const {axis, angle} = turnOf(motions[part].rotation);
    if (angle > 1e-6) return axis;
  }
  return null;
}

/** From its begin to its end. */
export const turnOf = keys => axisOf(times(keys.at(-1).rotation, keys[0].rotation.map((x, n) => n ? -x : x)));

/** The same way with one more key. @returns {motion, number}, or null where there is one already */
export function keyAdded(motion, kind, time) {
  const keys = motion[kind];
  if (keys.length < 2 || keys.some(key => Math.abs(key.time - time) < 2e-3)) return null;
  const [n, part] = pieceAt(keys, time);
  const before = keys.slice(0, n), [a, b] = keys.slice(n, n + 2), after = keys.slice(n + 2);
  const made = [a, {time, rotation: kind === 'rotation' ? slerp(a.rotation, b.rotation, part) : null}, b];
  if (kind === 'translation') {
    const {first, into, at, out, last} = split(a, b, part);
    made.splice(0, 3, {...a, out: first}, {time, at, in : into, out}, {...b, in : last});
  }
  return {motion: {...motion, [kind]: [...before, ...made, ...after]}, number: n + 1};
}

export const keyRemoved = (motion, kind, n) => {
  const keys = motion[kind];
  const straight = kind === 'translation' && isStraight(keys[n - 1], keys[n]) && isStraight(keys[n], keys[n + 1]);
  const left = keys.filter((_, k) => k !== n).map(key => ({...key}));
  if (straight) {
    left[n - 1].out = between(left[n - 1].at, left[n].at, 1 / 3);
    left[n].in = between(left[n - 1].at, left[n].at, 2 / 3);
  }
  return {...motion, [kind]: left};
};

// ----------------------------------------------------------------------------------------------------------------------- sight

const unit = v => v.map(x => x / length(v));

/** Directions all over the half of a ball that is not below, evenly: a spiral. */
function halfBall(up, count) {
  const right = unit(cross(up, Math.abs(up[0]) < 0.7 ? [1, 0, 0] : [0, 1, 0]));
  const front = cross(up, right);
  return Array.from({length: count}, (_, n) => {
    const height = (n + 0.5) / count, turn = n * Math.PI * (3 - Math.sqrt(5));
    const flat = Math.sqrt(1 - height * height);
    return plus(plus(up.map(x => x * height), right, flat * Math.cos(turn)), front, flat * Math.sin(turn));
  });
}

/**
 * From where a collision may be looked at: across both motions, that is along +-(a x b); across one, where there is only one or
 * both go along one line; from everywhere above where nothing moves or more than two bodies take part.
 * @param ways   of each body that takes part how it moves, mm
 * @param least  below which it is none, mm
 * @param count  of directions, where they are sampled
 */
export function sightLines(ways, up, least, count) {
  const long = ways.filter(way => length(way) > least).map(unit);
  if (ways.length > 2 || !long.length) return halfBall(up, count);
  const normal = long.length > 1 ? cross(long[0], long[1]) : [0, 0, 0];
  if (length(normal) > 0.05) return [unit(normal), unit(normal).map(x => -x)];
  const [along] = long;
  const aside = unit(cross(along, Math.abs(dot(along, up)) < 0.9 ? up : Math.abs(up[0]) < 0.7 ? [1, 0, 0] : [0, 1, 0]));
  const other = cross(along, aside);
  const around = Math.max(12, Math.min(36, count));
  return Array.from({length: around}, (_, n) => 2 * Math.PI * n / around)
      .map(turn => plus(aside.map(x => x * Math.cos(turn)), other, Math.sin(turn)));
}
