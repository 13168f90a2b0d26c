// Without WebGL: a section of the bodies, drawn as lines and areas.

import {crossing, dot, loopsOf} from './geometry.js';
import {svg} from './overlay.js';

/**
 * @param bodies  {what, mesh}
 * @param cut     {normal, offset}
 * @param frame   {across, upwards}: unit vectors in its plane
 */
export function sectionPicture(bodies, cut, {across, upwards}, [width, height]) {
  const ends = [Infinity, -Infinity, Infinity, -Infinity];
  const {positions} = bodies[0].mesh;
  for (let n = 0; n < positions.length; n += 3) {
    const p = [positions[n], positions[n + 1], positions[n + 2]];
    const x = dot(p, across), y = dot(p, upwards);
    ends[0] = Math.min(ends[0], x);
    ends[1] = Math.max(ends[1], x);
    ends[2] = Math.min(ends[2], y);
    ends[3] = Math.max(ends[3], y);
  }
  const scale = 0.86 * Math.min(width / Math.max(1e-9, ends[1] - ends[0]), height / Math.max(1e-9, ends[3] - ends[2]));
  const project = p =>
      [width / 2 + scale * (dot(p, across) - (ends[0] + ends[1]) / 2),
       height / 2 - scale * (dot(p, upwards) - (ends[2] + ends[3]) / 2)];
  const outline = mesh => loopsOf(crossing(mesh, cut.normal, cut.offset))
                              .map(loop => `M${loop.map(p => project(p).map(n => n.toFixed(1)).join(' ')).join('L')}Z`)
                              .join('');
  const material = bodies.filter(body => body.what === 'shell' || body.what === 'cavity').map(body => outline(body.mesh)).join('');
  const picture = svg('g', {}, svg('path', {class: 'material', d: material || 'M0 0', 'fill-rule': 'evenodd'}));
  for (const body of bodies)
    if (body.what !== 'shell' && body.what !== 'cavity')
      picture.append(svg('path', {class: body.what, d: outline(body.mesh) || 'M0 0', 'fill-rule': 'evenodd'}));
  return {picture, project};
}
