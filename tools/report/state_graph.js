// States as nodes, the ways between them as edges.

import {svg} from './overlay.js';
import {html} from './panels.js';

const kRadius = 17;
const kWords = {
  free: 'free',
  overlap: 'parts overlap on it',
  undecided: 'being looked at'
};

const kRests = {
  good: 'rests as it shall',
  bad: 'does not rest as it shall',
  overlap: 'parts overlap in it',
  old: 'was judged before the last edit'
};

/** On an ellipse, the first on top, or side by side where there are two. */
function placesOf(count, width, height) {
  const x = width / 2 - 66, y = height / 2 - 50;
  if (count === 1) return [[width / 2, height / 2 + 20]];
  if (count === 2) return [[66, height / 2], [width - 66, height / 2]];
  return Array.from({length: count}, (_, n) => 2 * Math.PI * n / count - Math.PI / 2)
      .map(turn => [width / 2 + x * Math.cos(turn), height / 2 + y * Math.sin(turn)]);
}

const shortened = words => words.length > 18 ? `${words.slice(0, 17)}\u2026` : words;

/** A curve from one node to another; several between the same ones bend differently. */
function curve(a, b, bend) {
  if (a === b) {
    const [x, y] = a;
    const size = 30 + 0.6 * bend;
    return {
      d: `M${x - 14} ${y - 10}C${x - 1.6 * size} ${y - size},${x - 1.6 * size} ${y + size},${x - 14} ${y + 10}`,
      middle: [x - 1.25 * size, y],
      along: [0, 1]
    };
  }
  const way = [b[0] - a[0], b[1] - a[1]];
  const long = Math.hypot(...way) || 1;
  const along = way.map(x => x / long);
  const across = [along[1], -along[0]];
  const at = (p, ahead, aside) => [p[0] + ahead * along[0] + aside * across[0], p[1] + ahead * along[1] + aside * across[1]];
  const begin = at(a, kRadius, 0.1 * bend), end = at(b, -kRadius - 3, 0.1 * bend);
  const middle = at(a, long / 2, bend);
  const control = at(a, long / 2, 2 * bend);
  return {d: `M${begin.join(' ')}Q${control.join(' ')},${end.join(' ')}`, middle, along};
}

export class StateGraph {
  /** @param chosen  {state, transition}: called with the number of either */
  constructor(scene, chosen) {
    this.scene = scene;
    this.chosen = chosen;
    this.root = svg('svg', {class: 'graph', role: 'group', 'aria-label': 'States and the ways between them'});
    this.element = html('div', {class: 'graph-around'}, this.root);
    this.width = 0;
    new ResizeObserver(() => this.draw()).observe(this.element);
  }

  /**
   * @param kinds  of each transition: free, overlap or undecided
   * @param now    {state, transition} that are shown
   * @param rests  of each state: good, bad, overlap, old, or null where it was not judged
   */
  show(kinds, now, rests) {
    this.kinds = kinds;
    this.now = now;
    this.rests = rests;
    if (this.nodes) this.color();
  }

  draw() {
    const width = Math.floor(this.element.clientWidth);
    if (!width || width === this.width) return;
    this.width = width;
    const {states, transitions} = this.scene;
    const height = states.length > 2 ? Math.min(340, 150 + 28 * states.length) : 150;
    this.middle = states.length > 2 ? height / 2 - 30 : 0;
    const places = placesOf(states.length, width, height);
    for (const [key, value] of Object.entries({width, height, viewBox: `0 0 ${width} ${height}`}))
      this.root.setAttribute(key, value);
    this.edges = transitions.map((transition, n) => this.edge(transition, n, places));
    this.nodes = states.map((state, n) => this.node(state, n, places[n]));
    this.root.replaceChildren(...this.edges, ...this.nodes);
    if (this.kinds) this.color();
  }

  edge({name, from, to}, n, places) {
    const same = this.scene.transitions.filter(
        (other, k) => k < n && Math.min(other.from, other.to) === Math.min(from, to) &&
            Math.max(other.from, other.to) === Math.max(from, to));
    // Both ways between two states lie at different sides of the line by themselves.
    const {d, middle, along} = curve(places[from], places[to], 22 + 16 * Math.floor(same.length / 2));
    const [x, y] = middle;
    const [u, v] = along;
    const tip = [[7, 0], [-5, -6], [-5, 6]].map(([a, b]) => `${x + a * u - b * v},${y + a * v + b * u}`).join(' ');
    const edge =
        svg('g', {class: 'edge', tabindex: '0', role: 'button'}, svg('path', {class: 'reach', d}), svg('path', {class: 'way', d}),
            svg('polygon', {points: tip}), svg('title', {}, name));
    return this.answers(edge, () => this.chosen.transition(n));
  }

  node({name}, n, [x, y]) {
    const node =
        svg('g', {class: 'node', tabindex: '0', role: 'button'}, svg('circle', {cx: x, cy: y, r: kRadius}),
            svg('text', {x, y: y + 4.5, class: 'number', 'text-anchor': 'middle'}, `${n + 1}`),
            svg('text', {x, y: y < this.middle ? y - kRadius - 8 : y + kRadius + 17, class: 'name', 'text-anchor': 'middle'},
                shortened(name)),
            svg('text', {x: x + kRadius - 2, y: y - kRadius + 7, class: 'rest'}), svg('title', {}, name));
    return this.answers(node, () => this.chosen.state(n));
  }

  answers(element, act) {
    element.addEventListener('click', act);
    element.addEventListener('keydown', event => {
      if (event.key !== 'Enter' && event.key !== ' ') return;
      event.preventDefault();
      act();
    });
    return element;
  }

  color() {
    this.edges.forEach((edge, n) => {
      edge.setAttribute('class', `edge ${this.kinds[n]}${this.now.transition === n ? ' now' : ''}`);
      edge.setAttribute('aria-label', `Transition ${this.scene.transitions[n].name}: ${kWords[this.kinds[n]]}`);
    });
    this.nodes.forEach((node, n) => {
      const rest = this.rests[n];
      const words = rest ? `: ${kRests[rest]}` : '';
      node.setAttribute('class', `node${rest ? ` ${rest}` : ''}${this.now.state === n ? ' now' : ''}`);
      node.setAttribute('aria-label', `State ${this.scene.states[n].name}${words}`);
      node.querySelector('.rest').textContent = {good: '\u2713', bad: '\u2715', overlap: '\u2715', old: '?'}[rest] ?? '';
      node.querySelector('title').textContent = `${this.scene.states[n].name}${words}`;
    });
  }
}
