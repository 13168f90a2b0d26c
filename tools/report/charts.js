// Curves and plans beside the figures. Each takes what the report tells and a width, and returns an SVG or null.

import {nearestEdge} from './marks.js';
import {svg} from './overlay.js';
import {degrees, short} from './words.js';

const line = (x1, y1, x2, y2, style) => svg('line', {x1, y1, x2, y2, class: style});
const text = (x, y, words, style = '', anchor = 'middle') => svg('text', {x, y, class: style, 'text-anchor': anchor}, words);

/** Round steps, about so many of them between two numbers. */
function ticks(low, high, count) {
  const rough = (high - low) / count;
  const power = 10 ** Math.floor(Math.log10(rough));
  const step = [1, 2, 5, 10].map(n => n * power).find(n => n >= rough);
  const result = [];
  for (let n = Math.ceil(low / step - 1e-9); n * step <= high + 1e-9 * step; ++n) result.push(n * step);
  return result;
}

/** Righting arms over the heel. */
export function rightingChart(of, width) {
  const heels = of('gz_heel_rad'), arms = of('gz_mm'), range = of('gz_range_rad');
  if (!heels || !arms) return null;
  const points = heels.map((heel, n) => [heel * 180 / Math.PI, arms[n]]).filter(([, arm]) => Number.isFinite(arm));
  if (points.length < 2) return null;
  const height = Math.round(Math.min(280, Math.max(210, width * 0.52)));
  const box = {left: 46, right: width - 14, top: 46, bottom: height - 42};
  const low = Math.min(0, ...points.map(p => p[1])), high = Math.max(1e-9, ...points.map(p => p[1]));
  const x = heel => box.left + (box.right - box.left) * heel / 180;
  const y = arm => box.bottom - (box.bottom - box.top) * (arm - low) / (high - low);
  const chart = svg('svg', {width, height, viewBox: `0 0 ${width} ${height}`, role: 'img', class: 'chart'});
  const last = range * 180 / Math.PI;
  chart.append(
      svg('title', {}, `Righting arm over heel: positive up to ${degrees(range)}, at most ${short(of('gz_largest_mm'))} mm`));
  for (const arm of ticks(low, high, 4))
    chart.append(
        line(box.left, y(arm), box.right, y(arm), arm === 0 ? 'zero' : 'grid'),
        text(box.left - 7, y(arm) + 4, short(arm, arm % 1 ? 1 : 0), 'tick', 'end'));
  for (let heel = 0; heel <= 180; heel += width < 420 ? 60 : 30)
    chart.append(text(x(heel), box.bottom + 18, `${heel}\u00b0`, 'tick'));
  chart.append(
      text((box.left + box.right) / 2, height - 6, 'heel', 'axis'),
      text(box.left - 38, 14, 'righting arm GZ, mm', 'axis', 'start'));
  // Between two heels as a straight line, so that nothing is shown that was not worked out.
  const path = list => list.map(([heel, arm], n) => `${n ? 'L' : 'M'}${x(heel).toFixed(1)} ${y(arm).toFixed(1)}`).join('');
  const within = points.filter(([heel]) => heel < last);
  if (last > 0 && within.length > 1) {
    const end = points.length > within.length ? [[last, Math.max(0, at(points, last))]] : [];
    chart.append(svg(
        'path', {class: 'safe', d: `${path([...within, ...end])}L${x(Math.min(last, 180)).toFixed(1)} ${y(0)}L${x(0)} ${y(0)}Z`}));
  }
  chart.append(svg('path', {class: 'curve', d: path(points)}));
  const best = of('gz_largest_heel_rad') * 180 / Math.PI, most = of('gz_largest_mm');
  if (last > 0 && Number.isFinite(most)) {
    chart.append(
        svg('circle', {cx: x(best), cy: y(most), r: 4, class: 'point'}),
        text(
            Math.min(Math.max(x(best), box.left + 70), box.right - 70), y(most) - 9,
            `${short(most, 1)} mm at ${short(best, 0)}\u00b0`, 'note'));
  }
  if (last > 0 && last < 179.5) {
    chart.append(svg('circle', {cx: x(last), cy: y(Math.max(0, at(points, last))), r: 4, class: 'limit'}));
    const words = `${of('gz_range_ends')} at ${short(last, 1)}\u00b0`;
    const left = x(last) > (box.left + box.right) / 2;
    chart.append(text(x(last) + (left ? -8 : 8), y(0) + 17, words, 'note', left ? 'end' : 'start'));
  }
  return chart;
}

/** Of a line through points, ascending in x. */
function at(points, x) {
  const n = points.findIndex(p => p[0] >= x);
  if (n <= 0) return points[n < 0 ? points.length - 1 : 0][1];
  const [a, b] = [points[n - 1], points[n]];
  return a[1] + (b[1] - a[1]) * (x - a[0]) / (b[0] - a[0]);
}

/** The foot from above, with the centre of mass over it. */
export function supportChart(of, before, width) {
  const corners = of('support_polygon_mm'), angles = of('tipping_angles_rad'), mass = of('centre_in_plan_mm');
  if (!corners?.length || !mass) return null;
  const old = before('centre_in_plan_mm');
  const all = [...corners, mass, ...(old ? [old] : [])];
  const [left, right] = [0, 1].map(n => [Math.min, Math.max][n](...all.map(p => p[0])));
  const [low, high] = [0, 1].map(n => [Math.min, Math.max][n](...all.map(p => p[1])));
  const height = Math.round(Math.min(300, width * 0.62));
  const room = 34;
  const scale = Math.min((width - 2 * room) / Math.max(right - left, 1e-9), (height - 2 * room) / Math.max(high - low, 1e-9));
  const at2 = ([x, y]) => [width / 2 + scale * (x - (left + right) / 2), height / 2 - scale * (y - (low + high) / 2)];
  const chart = svg('svg', {width, height, viewBox: `0 0 ${width} ${height}`, role: 'img', class: 'chart'});
  const nearest = nearestEdge(angles);
  chart.append(svg(
      'title', {},
      nearest < 0 ? 'The foot from above' : `The foot from above: it tips over its nearest edge at ${degrees(angles[nearest])}`));
  chart.append(svg('polygon', {class: 'foot', points: corners.map(p => at2(p).map(n => n.toFixed(1)).join(',')).join(' ')}));
  if (corners.length < 3)
    for (const corner of corners) chart.append(svg('circle', {cx: at2(corner)[0], cy: at2(corner)[1], r: 5, class: 'touch'}));
  if (corners.length > 2) {
    const from = at2(corners[nearest]), to = at2(corners[(nearest + 1) % corners.length]);
    chart.append(line(...from, ...to, 'tip'));
    const side = at2(mass);
    const across = [to[1] - from[1], from[0] - to[0]];
    const size = Math.hypot(...across) || 1;
    const away = ((from[0] - side[0]) * across[0] + (from[1] - side[1]) * across[1]) / size;
    const foot = [side[0] + across[0] / size * away, side[1] + across[1] / size * away];
    chart.append(line(...side, ...foot, 'arm'));
  }
  if (corners.length > 2 && corners.length <= 8) {
    corners.forEach((corner, n) => {
      const from = at2(corner), to = at2(corners[(n + 1) % corners.length]);
      const long = Math.hypot(to[0] - from[0], to[1] - from[1]);
      if (long < 44) return;
      // Outside of the edge: corners run counter-clockwise, and y points down here.
      const x = (from[0] + to[0]) / 2 + 22 * (from[1] - to[1]) / long, y = (from[1] + to[1]) / 2 + 15 * (to[0] - from[0]) / long;
      chart.append(text(x, y + 4, degrees(angles[n]), 'tick'));
    });
  }
  if (old) chart.append(svg('circle', {cx: at2(old)[0], cy: at2(old)[1], r: 5, class: 'old'}));
  const [x, y] = at2(mass);
  chart.append(svg('circle', {cx: x, cy: y, r: 6, class: 'point'}));
  scaleBar(chart, scale, width, height);
  return chart;
}

function scaleBar(chart, scale, width, height) {
  const most = 0.25 * width / scale;
  const power = 10 ** Math.floor(Math.log10(most));
  const long = [5, 2, 1].map(n => n * power).find(n => n <= most);
  const end = width - 12, begin = end - long * scale;
  chart.append(
      line(begin, height - 10, end, height - 10, 'bar'),
      text((begin + end) / 2, height - 16, `${+ long.toPrecision(1)} mm`, 'tick'));
}

/** Speeds at which a spin is stable. */
export function speedChart(of, width) {
  const kinds = [['sliding tip', of('stable_sliding')], ['fixed tip', of('stable_fixed')]].filter(([, ranges]) => ranges);
  if (!kinds.length || kinds.every(([, ranges]) => !ranges.length)) return null;
  const ends = kinds.flatMap(([, ranges]) => ranges.flatMap(({from_rpm, to_rpm}) => [from_rpm, to_rpm])).filter(Number.isFinite);
  if (!ends.some(speed => speed > 0)) return null;  // of a free body: any speed
  const most = 2 * Math.max(...ends);
  const height = 34 * kinds.length + 58;
  const box = {left: 84, right: width - 18, top: 10, bottom: height - 44};
  const x = speed => box.left + (box.right - box.left) * Math.min(speed, most) / most;
  const chart = svg('svg', {width, height, viewBox: `0 0 ${width} ${height}`, role: 'img', class: 'chart'});
  chart.append(svg('title', {}, 'Speeds at which a small tilt does not grow'));
  const steps = ticks(0, most, width < 420 ? 3 : 5);
  for (const speed of steps)
    chart.append(line(x(speed), box.top, x(speed), box.bottom, 'grid'), text(x(speed), box.bottom + 18, `${speed}`, 'tick'));
  kinds.forEach(([words, ranges], n) => {
    const top = box.top + 6 + 34 * n;
    chart.append(
        text(box.left - 10, top + 15, words, 'tick', 'end'),
        svg('rect', {x: box.left, y: top, width: box.right - box.left, height: 22, class: 'unstable'}));
    for (const {from_rpm, to_rpm} of ranges) {
      const begin = x(from_rpm), end = x(to_rpm ?? most);
      chart.append(svg('rect', {x: begin, y: top, width: Math.max(1, end - begin), height: 22, class: 'stable'}));
      if (end - begin > 90)
        chart.append(text(
            begin + 8, top + 15,
            to_rpm === null ? `above ${Math.ceil(from_rpm)}` : `${Math.ceil(from_rpm)} to ${Math.floor(to_rpm)}`, 'inbar',
            'start'));
    }
  });
  chart.append(text((box.left + box.right) / 2, height - 8, 'revolutions per minute', 'axis'));
  return chart;
}
