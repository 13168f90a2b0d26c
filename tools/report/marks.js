// What of a report is marked in the view: centres, axes, water, ground.

import {dot, length, plus} from './geometry.js';
import {degrees, place, short} from './words.js';

/** Points of the ground's frame in that of the body. */
const fromGround = ({to_ground: [right, front, up]}, x, y, z) => plus(plus(right.map(n => n * x), front, y), up, z);

export const numbersOf = ({report}) => report.after ?? report.mass_properties ?? {};

/** Plane heights along up, for View.place. */
export function placed(attitude) {
  const known = attitude.lowest_mm !== null;
  return {
    ...attitude,
    waterline: known && attitude.waterline_mm !== undefined ? attitude.lowest_mm + attitude.waterline_mm : null,
    ground: known && (attitude.kind === 'stands' || attitude.kind === 'rights itself') ? attitude.lowest_mm : null
  };
}

/**
 * @returns {items, legend}: for Overlay, and in which groups: {group, symbol, words, value, off}
 */
export function marksOf(data, attitude, radius) {
  const numbers = numbersOf(data);
  const of = name => numbers[attitude.prefix + name];
  const found = {items: [], legend: []};
  const mass = numbers.centre_of_mass_mm;
  if (mass?.every(Number.isFinite)) {
    if (attitude.kind === 'floats') addWater(mass, of, attitude, found);
    if (attitude.kind === 'stands') addSupport(mass, of, attitude, found);
    addPrincipalAxes(numbers, mass, radius, attitude.kind, found);
    if (attitude.kind === 'spins') addAxis(mass, attitude, radius, found);
    if (attitude.kind === 'hangs') addString(mass, attitude, found);
    addMass(data, mass, found);  // over all others
  }
  for (const mark of data.view.marks ?? []) {
    found.items.push(
        {group: 'defects', kind: 'point', symbol: 'mark', at: mark.at_mm, label: `${mark.words} (first of ${mark.count})`});
    if (!found.legend.some(entry => entry.group === 'defects'))
      found.legend.push({group: 'defects', symbol: 'mark', words: 'Defects', value: 'the first of each kind'});
  }
  return found;
}

function addMass({report}, mass, {items, legend}) {
  const before = report.solver && report.before?.centre_of_mass_mm;
  items.push({group: 'mass', kind: 'point', symbol: 'mass', at: mass, label: 'G'});
  legend.push({
    group: 'mass',
    symbol: 'mass',
    words: before ? 'G: centre of mass, after' : 'G: centre of mass',
    value: `${place(mass)} mm`
  });
  if (!before) return;
  items.push(
      {group: 'before', kind: 'line', from: before, to: mass},
      {group: 'before', kind: 'point', symbol: 'before', at: before, label: 'solid'});
  legend.push({group: 'before', symbol: 'before', words: 'Centre of mass of the solid, before', value: `${place(before)} mm`});
}

function addWater(mass, of, {up, waterline}, {items, legend}) {
  const buoyancy = of('centre_of_buoyancy_mm');
  if (waterline !== null) legend.push({group: 'water', symbol: 'water', words: 'Water', value: ''});
  if (!buoyancy?.every(Number.isFinite)) return;
  items.push({group: 'buoyancy', kind: 'point', symbol: 'buoyancy', at: buoyancy, label: 'B'});
  legend.push({group: 'buoyancy', symbol: 'buoyancy', words: 'B: centre of buoyancy', value: `${place(buoyancy)} mm`});
  const height = of('metacentric_height_mm');
  if (waterline === null || !Number.isFinite(height)) return;
  const metacentre = plus(buoyancy, up, height + dot(up, plus(mass, buoyancy, -1)));
  items.push(
      {group: 'metacentre', kind: 'line', from: buoyancy, to: metacentre},
      {group: 'metacentre', kind: 'point', symbol: 'metacentre', at: metacentre, label: 'M'});
  legend.push({
    group: 'metacentre',
    symbol: 'metacentre',
    words: 'M: metacentre',
    value: `${short(Math.abs(height))} mm ${height > 0 ? 'above' : 'below'} G`
  });
}

/** The edge over which it tips first, and by how much: the place in the list of corners, or -1. */
export function nearestEdge(angles) {
  if (!angles?.length) return -1;
  return angles.reduce((least, angle, n) => angle < angles[least] ? n : least, 0);
}

function addSupport(mass, of, attitude, {items, legend}) {
  const plan = of('support_polygon_mm');
  if (!plan?.length) return;
  const corners = plan.map(([x, y]) => fromGround(attitude, x, y, attitude.lowest_mm));
  const foot = plus(mass, attitude.up, attitude.lowest_mm - dot(attitude.up, mass));
  items.push({group: 'support', kind: 'area', corners});
  const angles = of('tipping_angles_rad');
  const nearest = nearestEdge(angles);
  if (plan.length > 2 && nearest >= 0)
    items.push({
      group: 'tip',
      kind: 'line',
      from: corners[nearest],
      to: corners[(nearest + 1) % corners.length],
      label: `tips at ${degrees(angles[nearest])}`
    });
  items.push({group: 'foot', kind: 'line', from: mass, to: foot}, {group: 'foot', kind: 'point', symbol: 'foot', at: foot});
  legend.push(
      {group: 'ground', symbol: 'ground', words: 'Ground', value: ''},
      {group: 'support', symbol: 'support', words: 'Foot: where it touches the ground', value: `${plan.length} corners`});
  if (plan.length > 2)
    legend.push({group: 'tip', symbol: 'tip', words: 'Edge over which it tips first', value: degrees(angles[nearest])});
  legend.push({group: 'foot', symbol: 'foot', words: 'Straight below G', value: ''});
}

function addAxis(mass, {up, lowest_mm, highest_mm, point_mm}, radius, {items, legend}) {
  if (!point_mm) return;
  const at = height => plus(point_mm, up, height - dot(up, point_mm));
  items.push(
      {group: 'spin', kind: 'line', from: at(lowest_mm - 0.12 * radius), to: at(highest_mm + 0.25 * radius), label: 'axis'},
      {group: 'spin', kind: 'point', symbol: 'contact', at: point_mm});
  const beside = plus(plus(mass, point_mm, -1), up, -dot(up, plus(mass, point_mm, -1)));
  legend.push({group: 'spin', symbol: 'spin', words: 'Axis of spin', value: `G is ${short(length(beside), 3)} mm beside it`});
}

function addString(mass, {point_mm, up}, {items, legend}) {
  if (!point_mm) return;
  const below = plus(point_mm, up, dot(up, plus(mass, point_mm, -1)));
  items.push(
      {group: 'spin', kind: 'line', from: below, to: point_mm},
      {group: 'spin', kind: 'point', symbol: 'contact', at: point_mm, label: 'hangs here'});
  legend.push({group: 'spin', symbol: 'spin', words: 'Where it hangs, and straight below', value: `${place(point_mm)} mm`});
}

function addPrincipalAxes(numbers, mass, radius, kind, {items, legend}) {
  const axes = numbers.principal_axes, moments = numbers.principal_moments_g_mm2;
  if (!axes || !moments?.every(Number.isFinite)) return;
  axes.forEach((axis, n) => {
    items.push({
      group: 'axes',
      kind: 'line',
      from: plus(mass, axis, -0.55 * radius),
      to: plus(mass, axis, 0.55 * radius),
      label: `${n + 1}`
    });
  });
  legend.push({
    group: 'axes',
    symbol: 'axes',
    words: 'Principal axes, 1 of the smallest moment to 3 of the largest',
    value: '',
    off: kind !== 'spins' && kind !== ''
  });
}
