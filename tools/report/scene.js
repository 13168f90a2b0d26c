// The page of a scene: parts that move, when and where they get into each other, states and the ways between them.

import {BalancePanel, restMarks, restOf, restSentences} from './balance.js';
import {canDraw} from './canvas_view.js';
import {dot, length, plus} from './geometry.js';
import {Overlay, svg} from './overlay.js';
import {button, html} from './panels.js';
import {moves, placedBy, pointAt, poseAt, sightLines} from './poses.js';
import {footer} from './report.js';
import {reached, SceneView} from './scene_view.js';
import {samePair} from './side_effects.js';
import {legendSign} from './stage.js';
import {StateGraph} from './state_graph.js';
import {kKinds, percent, Timeline} from './timeline.js';

import {place, short, units} from './words.js';

const kWay_ms = 4000;
const kAlong = 9;         // ghosts along a way
const kMostTested = 3e6;  // triangles that are drawn to choose a view
export const kPartColors = Array.from({length: 8}, (_, n) => `part-${n}`);

const known = ({worst}) => worst !== null;  // where and how badly
const center = ([low, high]) => low.map((x, k) => (x + high[k]) / 2);

export class ScenePage {
  /**
   * @param root    where it goes; what was there goes away
   * @param data    see README.md
   * @param meshes  {positions, triangles} by id
   */
  constructor(root, data, meshes) {
    this.data = data;
    this.scene = data.scene;
    this.parts = data.scene.parts.map(part => {
      const mesh = meshes.get(part.id);
      return {...part, mesh, box: [part.low_mm, plus(part.low_mm, part.size_mm)]};
    });
    this.names = this.parts.map(({name}) => name);
    this.found = data.found;
    this.balance = data.balance ?? null;
    this.balanceOld = 0;    // edits since it was judged
    this.misplaced = null;  // in the studio: of each state what overlaps there, in words
    this.chosen = null;
    const [first] = this.byWorst();
    const transition = first?.pair.transition ?? (this.scene.transitions.length ? 0 : null);
    const state = this.balance?.states.find(({pass}) => !pass)?.state ?? this.scene.transitions[transition]?.from ?? 0;
    this.now = {transition, state, time: this.scene.transitions[transition]?.to === state ? 1 : 0};
    this.ghosts = 'ends';
    this.shown = [];  // called when something is shown
    this.drawn = [];  // called with each drawing
    this.build(root);
    this.start();
    this.update();
  }

  // ------------------------------------------------------------------------------------------------------------------ building

  build(root) {
    this.head = html('header', {class: 'verdict', 'aria-live': 'polite'});
    this.canvas = html('canvas', {
      tabindex: '0',
      role: 'application',
      'aria-label': 'The parts in 3D. Arrow keys turn them, plus and minus zoom, Home brings back the first view.'
    });
    this.stage = html('div', {class: 'stage'});
    if (canDraw(document)) {
      const over = svg('svg', {class: 'overlay', 'aria-hidden': 'true'});
      this.overlay = new Overlay(over);
      this.stage.append(this.canvas, over);
      this.drawn.push(project => this.overlay.draw(project, ...this.view.size));
      this.view = new SceneView(this.canvas, this.parts, project => this.drawn.forEach(draw => draw(project)));
    }
    this.timeline = new Timeline(this.names, {time: time => this.goTime(time), choose: (pair, n) => this.choose(pair, n)});
    this.balancePanel = new BalancePanel(n => this.goState(n));
    this.graph = new StateGraph(this.scene, {state: n => this.goState(n), transition: n => this.goTransition(n)});
    this.told = html('div', {class: 'told', role: 'status'});
    this.list = html('ul', {class: 'collisions'});
    this.clashes = html('ul', {class: 'collisions'});
    this.marked = html('ul', {class: 'legend marked'});
    this.beside = html('div', {class: 'panels'}, this.panels());
    const warning = this.view ?
        null :
        html(
            'p', {class: 'warning', role: 'status'},
            'This browser does not draw in 3D here (WebGL 2 is missing or switched off). When and where parts get ' +
                'into each other is told below all the same.');
    this.look = html(
        'section', {class: 'look', 'aria-label': 'View'}, warning, this.view ? this.stage : null, this.controls(), this.marked);
    root.classList.add('scene');
    root.replaceChildren(this.head, html('main', {}, this.look, this.beside), footer(this.data.version));
    addEventListener('keydown', event => this.key(event));
  }

  panels() {
    const panel = (title, ...content) => html('section', {class: 'panel'}, html('h2', {}, title), ...content);
    const swatches = this.parts.map(
        ({name, printed, triangles, shown}, n) => html(
            'li', {}, html('span', {class: `swatch ${kPartColors[n % kPartColors.length]}`}), html('bdi', {}, name),
            html('small', {}, [
              printed ? '' : 'not printed', shown < triangles ? `${shown} of ${triangles} triangles are shown` : ''
            ].filter(Boolean).join(', '))));
    const cavities =
        html('li', {}, html('span', {class: 'swatch cavity'}), 'cavities', html('small', {}, 'seen through the outside'));
    return [
      !this.scene.states.length ?
          null :
          panel(
              'States', this.graph.element,
              html(
                  'p', {class: 'fine'}, 'Arrows: the ways between them; green where no part gets into another, red where some do.'),
              this.clashes),
      this.balancePanel.element, panel('Collisions', this.list),
      panel('Parts', html('ul', {class: 'parts'}, swatches, this.view?.hasCavities ? cavities : null))
    ];
  }

  controls() {
    this.playButton = button('Play', () => this.play(!this.playing), {title: 'Space', class: 'plain play'});
    this.at = html('output', {class: 'at'});
    this.ways = html('div', {class: 'choice'});
    const ghosts = ['off', 'ends', 'way'].map((value, n) => {
      const input = html('input', {
        type: 'radio',
        name: 'ghosts',
        value,
        checked: value === this.ghosts,
        'aria-label': ['No ghosts', 'Ghosts at the ends of the collision', 'Ghosts all along the way'][n]
      });
      input.addEventListener('change', () => {
        this.ghosts = value;
        this.draw();
      });
      return html('label', {}, input, html('span', {}, value));
    });
    const steps = html(
        'div', {class: 'buttons'}, button('\u2039 Collision', () => this.step(-1), {title: 'p', 'aria-label': 'Collision before'}),
        button('Collision \u203a', () => this.step(1), {title: 'n', 'aria-label': 'Next collision'}),
        button('All', () => this.leave(), {title: 'Esc', 'aria-label': 'All parts again'}));
    return html(
        'div', {class: 'controls'}, this.ways,
        this.scene.transitions.length ? this.timeline.element : html('p', {class: 'fine'}, 'There are no ways between states.'),
        this.told,
        html(
            'div', {class: 'choice'}, this.playButton, this.at, steps,
            this.view ? html(
                            'div', {class: 'choice', role: 'radiogroup', 'aria-label': 'Ghosts'},
                            html('span', {class: 'name'}, 'Ghosts'), html('div', {class: 'segments'}, ghosts)) :
                        null),
        this.view?.hasCavities ? this.glass() : null);
  }

  glass() {
    const range =
        html('input', {type: 'range', min: 0, max: 100, value: 100 * this.view.opacity, 'aria-label': 'How opaque the outside is'});
    range.addEventListener('input', () => {
      this.view.opacity = range.value / 100;
      this.view.change();
    });
    return html('label', {class: 'choice'}, html('span', {class: 'name'}, 'Outside'), range, html('small', {}, 'clear to solid'));
  }

  start() {
    if (!this.view) return;
    const paint = () => {
      const style = getComputedStyle(document.documentElement);
      const of = name => style.getPropertyValue(`--${name}`).trim();
      const named = Object.fromEntries(['overlap', 'outline', 'void', 'water', 'ground'].map(name => [name, of(name)]));
      this.view.paint({parts: kPartColors.map(of), ...named});
    };
    matchMedia('(prefers-color-scheme: dark)').addEventListener('change', paint);
    paint();
    const hung = this.balance?.states.flatMap(({attitude: {kind, point_mm}}) => kind === 'hangs' ? [point_mm] : []) ?? [];
    this.view.setHome(this.upNow(), [...hung, ...reached(this.parts, moment => this.posesAt(moment), this.allMoments())]);
    new ResizeObserver(() => {
      const {width, height} = this.stage.getBoundingClientRect();
      this.view.resize(Math.round(width), Math.round(height), devicePixelRatio);
    }).observe(this.stage);
  }

  allMoments() {
    const {states, transitions} = this.scene;
    const along = transitions.flatMap((_, transition) => [0, 0.25, 0.5, 0.75, 1].map(time => ({transition, time, state: null})));
    return along.length ? along :
        states.length   ? states.map((_, state) => ({state, transition: null})) :
                          [{transition: null, state: null}];
  }

  // -------------------------------------------------------------------------------------------------------------------- moments

  posesAt({transition, state, time}) {
    const {states, transitions} = this.scene;
    if (state !== null && states[state]) return states[state].poses;
    if (transition === null) return this.parts.map(() => ({rotation: [1, 0, 0, 0], translation: [0, 0, 0]}));
    return transitions[transition].motions.map(motion => poseAt(motion, time));
  }

  upNow() {
    const {states, transitions} = this.scene;
    const state = this.now.state ?? transitions[this.now.transition]?.from;
    return states[state]?.up ?? [0, 0, 1];
  }

  pairsOf(transition) {
    return this.found.pairs.filter(pair => pair.transition === transition);
  }

  /** What the view shows of a moment. */
  momentOf(now, chosen) {
    const poses = this.posesAt(now);
    const inState = now.state !== null;
    const collisions =
        inState ? [] : this.pairsOf(now.transition).flatMap(pair => pair.intervals.filter(known).flatMap(interval => {
          const {from, to, within, worst} = interval;
          if (now.time < from - within || now.time > to + within) return [];
          return [{box: worst.box_mm, contour: Math.abs(now.time - worst.time) < 0.01 ? worst.contour_mm : []}];
        }));
    return {
      poses,
      collisions,
      ghosts: inState ? [] : this.ghostsAt(now, chosen),
      of: chosen ? [chosen.pair.first, chosen.pair.second] : null,
      attitude: inState && !chosen ? this.marks()?.attitude : null
    };
  }

  /** What is marked in the state that is shown, or null: of poses that were judged. */
  marks() {
    const rest = this.now.state === null || this.balanceOld ? null : restOf(this.balance, this.now.state);
    return rest && restMarks(rest, this.names, this.view?.reach ?? 1);
  }

  ghostsAt({transition, time}, chosen) {
    if (this.ghosts === 'off' || transition === null) return [];
    const {motions} = this.scene.transitions[transition];
    const moving = motions.map((_, part) => part).filter(part => moves(motions[part]));
    const at = (parts, when, opacity) => ({list: parts.map(part => ({part, pose: poseAt(motions[part], when)})), opacity});
    if (this.ghosts === 'way')
      return Array.from({length: kAlong}, (_, n) => n / (kAlong - 1))
          .filter(when => Math.abs(when - time) > 0.02)
          .map(when => at(moving, when, 0.14 * (1 - 0.8 * Math.abs(when - time))));
    if (!chosen) return [];
    const {from, to} = chosen.pair.intervals[chosen.interval];
    const pair = [chosen.pair.first, chosen.pair.second].filter(part => moving.includes(part));
    return [from, to].filter(when => Math.abs(when - time) > 1e-3).map(when => at(pair, when, 0.15));
  }

  /** From where a collision is seen: {towards, target, distance}. Across both motions, from where it is hidden least. */
  sight(pair, {from, to, worst}) {
    const {motions} = this.scene.transitions[pair.transition];
    const poses = this.posesAt({transition: pair.transition, time: worst.time, state: null});
    const box = this.grown(worst.box_mm);
    const others = this.pairsOf(pair.transition)
                       .filter(
                           other => !samePair(other, pair) &&
                               other.intervals.some(one => one.kind === 'overlap' && known(one) && meets(one, worst)));
    const all = [...new Set([pair, ...others].flatMap(({first, second}) => [first, second]))];
    const ways = all.map(part => {
      const {pivot_mm} = this.parts[part];
      const point = pointAt(poses[part], pivot_mm, center(box));
      return plus(placedBy(poseAt(motions[part], to), pivot_mm, point), placedBy(poseAt(motions[part], from), pivot_mm, point), -1);
    });
    const triangles = this.parts.reduce((sum, {shown}) => sum + shown, 0);
    const count = Math.max(24, Math.min(256, Math.floor(kMostTested / Math.max(1, triangles))));
    const {up} = this.view.orbit.frame;
    return this.view.best(sightLines(ways, up, 1e-6 * this.view.reach, count), poses, box, [pair.first, pair.second]);
  }

  /** A little around it: what lies on surfaces is seen beside them, and nothing is thinner than can be seen. */
  grown([low, high]) {
    const around = 0.1 * length(plus(high, low, -1)) + 0.005 * this.view.reach;
    return [low.map(x => x - around), high.map(x => x + around)];
  }

  // ---------------------------------------------------------------------------------------------------------------------- doing

  /** What was found, and how the scene is now. */
  tell(found, scene = this.scene) {
    this.scene = scene;
    this.found = found;
    if (this.chosen) {
      const pair = found.pairs.find(other => samePair(other, this.chosen.pair));
      const one = this.chosen.pair.intervals[this.chosen.interval];
      const n = pair ? pair.intervals.findIndex(({from, to}) => from <= one.to && one.from <= to) : -1;
      this.chosen = n < 0 ? null : {pair, interval: n};
    }
    this.update();
  }

  /** How it rests, and after how many edits that is told. */
  tellBalance(balance, old = 0) {
    this.balance = balance;
    this.balanceOld = old;
    this.update();
  }

  goTime(time, keep = false) {
    if (this.now.transition === null) return;
    if (!keep) this.play(false);
    this.now = {...this.now, time, state: null};
    this.draw();
  }

  goTransition(transition) {
    this.play(false);
    this.now = {transition, time: 0, state: null};
    this.chosen = null;
    this.turnUp();
    this.update();
  }

  goState(state) {
    this.play(false);
    const {transitions} = this.scene;
    const ends = n => [transitions[n]?.from, transitions[n]?.to];
    let {transition} = this.now;
    if (!ends(transition).includes(state)) {
      const other = transitions.findIndex(({from, to}) => from === state || to === state);
      if (other >= 0) transition = other;
    }
    const [from] = ends(transition);
    this.now = {transition, state, time: from === state ? 0 : 1};
    this.chosen = null;
    this.turnUp();
    this.update();
  }

  turnUp() {
    const up = this.upNow();
    if (this.view && dot(up, this.view.orbit.frame.up) < (1 - 1e-9) * length(up)) this.view.setUp(up);
  }

  /** Goes to the worst moment of a collision, and looks at it. */
  choose(pair, interval) {
    this.play(false);
    const one = pair.intervals[interval];
    this.now = {transition: pair.transition, state: null, time: known(one) ? one.worst.time : (one.from + one.to) / 2};
    this.chosen = {pair, interval};
    if (this.view && known(one)) this.lookFrom(this.sight(pair, one));
    this.update();
  }

  lookFrom({towards, target, distance}) {
    const {orbit} = this.view;
    const {right, front, up} = orbit.frame;
    orbit.target = target;
    orbit.distance = distance;
    orbit.turnTo(
        Math.atan2(dot(towards, front), dot(towards, right)), Math.max(-1.55, Math.min(1.55, Math.asin(dot(towards, up)))));
  }

  leave() {
    this.chosen = null;
    this.view?.orbit.goHome();
    this.update();
  }

  /** Collisions by way and time. */
  all() {
    return this.found.pairs.flatMap(pair => pair.intervals.map((interval, n) => ({pair, interval: n, ...interval})))
        .sort((a, b) => a.pair.transition - b.pair.transition || a.from - b.from);
  }

  byWorst() {
    return this.all().sort((a, b) => (b.kind === 'overlap') - (a.kind === 'overlap') || b.intersection_mm - a.intersection_mm);
  }

  step(by) {
    const overlaps = this.all().filter(({kind}) => kind === 'overlap');
    const all = overlaps.length ? overlaps : this.all();
    if (!all.length) return;
    const {transition, time} = this.now;
    const at = this.chosen ? all.findIndex(one => one.pair === this.chosen.pair && one.interval === this.chosen.interval) : -1;
    const after = all.findIndex(({pair, from}) => pair.transition > transition || (pair.transition === transition && from >= time));
    const next = at >= 0 ? at + by : by > 0 ? after : (after < 0 ? all.length : after) - 1;
    const one = all[(next + all.length) % all.length];
    this.choose(one.pair, one.interval);
  }

  play(on) {
    if (this.now.transition === null || on === Boolean(this.playing)) return;
    cancelAnimationFrame(this.playing);
    this.playing = 0;
    this.playButton.textContent = on ? 'Pause' : 'Play';
    if (!on) return;
    const begin = this.now.state === null && this.now.time < 1 ? this.now.time : 0;
    const begun = performance.now();
    const step = now => {
      const time = Math.min(1, begin + Math.max(0, now - begun) / kWay_ms);
      this.goTime(time, true);
      if (time < 1)
        this.playing = requestAnimationFrame(step);
      else
        this.play(false);
    };
    this.playing = requestAnimationFrame(step);
  }

  key(event) {
    if (event.altKey || event.ctrlKey || event.metaKey || event.target.matches('input:not([type=radio]), textarea, select')) return;
    const free = !event.target.closest('button, [role=button], summary, a, label');
    if (event.key === ' ' && free)
      this.play(!this.playing);
    else if (event.key === 'n' || event.key === 'p')
      this.step(event.key === 'n' ? 1 : -1);
    else if (event.key === 'Escape')
      this.leave();
    else
      return;
    event.preventDefault();
  }

  // -------------------------------------------------------------------------------------------------------------------- showing

  /** All of it. */
  update() {
    this.showVerdict();
    this.showWays();
    this.showList();
    this.markedOf = undefined;
    this.draw();
  }

  kindOf(transition) {
    const all = this.pairsOf(transition).flatMap(({intervals}) => intervals);
    return all.some(({kind}) => kind === 'overlap') ? 'overlap' : all.some(({kind}) => kind === 'undecided') ? 'undecided' : 'free';
  }

  showVerdict() {
    const {found, data} = this;
    const unsure = found.stage !== 'complete' && !found.pairs.some(({intervals}) => intervals.some(({kind}) => kind === 'overlap'));
    const [path, file] = /^(.*\/)?(.*)$/.exec(data.title).slice(1);
    const [first, ...more] = found.told;
    const {balance} = this;
    const motion = unsure ? ['unsure', '\u2026', 'LOOKING'] :
        found.pass        ? ['good', '\u2713', 'FREE'] :
                            ['bad', '\u2715', 'OVERLAPS'];
    const rest = !balance ? null :
        this.balanceOld   ? ['unsure', '\u2026', 'BALANCE IS OLD'] :
        balance.pass      ? ['good', '\u2713', balance.made ? 'BALANCED' : 'RESTS'] :
                            ['bad', '\u2715', balance.made ? 'NOT BALANCED' : 'DOES NOT REST'];
    const word = ([kind, sign, text]) =>
        html('div', {class: kind}, html('p', {class: 'word'}, html('span', {class: 'sign', 'aria-hidden': 'true'}, sign), text));
    const resting = balance && !this.balanceOld ? restSentences(balance, this.scene, this.parts) : [];
    this.head.replaceChildren(
        html('p', {class: 'over'}, `rayrep ${data.version}`, html('span', {}, 'parts that move')),
        html('h1', {}, path ? html('bdi', {class: 'path'}, path) : '', html('bdi', {}, file)),
        html('div', {class: 'choice'}, [rest, motion].filter(Boolean).map(word)),
        ...resting.map(sentence => html('p', {class: 'lead'}, units(sentence))), html('p', {class: 'lead'}, units(first)),
        ...more.map(sentence => html('p', {class: 'more'}, units(sentence))));
  }

  /** The states by colour, their verdicts in words, and what is marked of the one that is shown. */
  showRest() {
    const {now, balance, balanceOld} = this;
    this.clashes.replaceChildren(...(this.misplaced ?? []).map(({state, message}) => {
      const line = button('', () => this.goState(state), {class: 'plain line overlap'});
      line.append(units(message));
      return html('li', {}, line);
    }));
    const key = `${now.state} ${balanceOld}`;
    if (this.markedOf === key) return;
    this.markedOf = key;
    if (balance) this.balancePanel.show(balance, this, balanceOld);
    const found = this.marks();
    const clashes = (now.state === null ? [] : this.misplaced ?? []).filter(({state}) => state === now.state);
    this.overlay?.show([
      ...(found?.items ?? []),
      ...clashes.map(({place_mm}) => ({group: 'defects', kind: 'point', symbol: 'mark', at: place_mm, label: 'overlap'}))
    ]);
    this.marked.replaceChildren(...(this.view && found ? found.legend : [])
                                    .map(
                                        entry => html(
                                            'li', {},
                                            html(
                                                'div', {}, legendSign(entry),
                                                html('span', {class: 'words'}, entry.words, html('small', {}, entry.value))))));
    this.view?.change();
  }

  restKinds() {
    return this.scene.states.map((_, n) => {
      if (this.misplaced?.some(({state}) => state === n)) return 'overlap';
      const rest = restOf(this.balance, n);
      return rest && (this.balanceOld ? 'old' : rest.pass ? 'good' : 'bad');
    });
  }

  showWays() {
    const {transitions} = this.scene;
    const key = transitions.map(({name}) => name).join('\n');
    if (transitions.length > 1 && key !== this.waysKey) {
      const select = html(
          'select', {'aria-label': 'Way that is shown'}, transitions.map(({name}, n) => html('option', {value: `${n}`}, name)));
      select.addEventListener('change', () => this.goTransition(+select.value));
      this.ways.replaceChildren(html('span', {class: 'name'}, 'Way'), select);
      this.select = select;
    } else if (transitions.length === 1) {
      this.ways.replaceChildren(html('span', {class: 'name'}, 'Way'), html('b', {}, transitions[0].name));
    }
    this.waysKey = key;
    if (this.select) this.select.value = `${this.now.transition}`;
  }

  showList() {
    const all = this.byWorst();
    const several = this.scene.transitions.length > 1;
    this.list.replaceChildren(...all.map(one => {
      const {pair, interval, kind, from, to, worst} = one;
      const line = button('', () => this.choose(pair, interval), {class: `plain line ${kind}`});
      line.append(
          html('b', {}, `${this.names[pair.first]} \u00b7 ${this.names[pair.second]}`),
          html(
              'small', {},
              `${several ? `${this.scene.transitions[pair.transition].name}, ` : ''}${percent(from)} to ${percent(to)}` +
                  (kind === 'overlap' && worst?.depth_mm > 0 ? `, ${short(worst.depth_mm)} mm deep` :
                       kind === 'overlap' ? '' :
                                            `: they ${kKinds[kind]}`)));
      return html('li', {}, line);
    }));
    if (!all.length) this.list.replaceChildren(html('li', {class: 'fine'}, 'None.'));
  }

  /** What depends on the time. */
  draw() {
    const {now, chosen} = this;
    const {states, transitions} = this.scene;
    this.timeline.setTime(now.time);
    const pairs = now.transition === null ? [] : this.pairsOf(now.transition);
    const key = `${now.transition} ${chosen ? `${chosen.pair.first} ${chosen.pair.second} ${chosen.interval}` : ''}`;
    if (this.shownPairs !== this.found || key !== this.pairsKey) {
      this.timeline.show(pairs, chosen);
      this.graph.show(transitions.map((_, n) => this.kindOf(n)), this.now, this.restKinds());
      this.told.replaceChildren(...this.wordsOf(chosen));
      this.shownPairs = this.found;
      this.pairsKey = key;
    } else {
      this.graph.show(this.graph.kinds, this.now, this.restKinds());
    }
    this.at.textContent =
        now.state !== null && states[now.state] ? `State ${now.state + 1}: ${states[now.state].name}` : percent(now.time);
    this.timeline.ruler.setAttribute('aria-valuetext', this.at.textContent);
    this.view?.show(this.momentOf(now, chosen));
    this.showRest();
    for (const shown of this.shown) shown();
  }

  wordsOf(chosen) {
    if (!chosen) return [];
    const {first, second, clearance_mm, intervals} = chosen.pair;
    const {kind, from, to, within, worst, intersection_mm} = intervals[chosen.interval];
    const names = `${this.names[first]} and ${this.names[second]}`;
    const when =
        `from ${percent(from, 2)} to ${percent(to, 2)} of the way` + (within > 5e-5 ? `, each end to ${percent(within, 2)}` : '');
    if (kind === 'undecided') return [html('p', {}, `${names} are not looked at closely yet ${when}.`)];
    if (!worst) return [html('p', {}, html('b', {}, `${names} ${kKinds[kind]} `), `${when}.`)];
    const size = worst.box_mm[1].map((x, k) => short(x - worst.box_mm[0][k])).join(' \u00d7 ');
    const where = `in a box of ${size} mm around ${place(center(worst.box_mm))}`;
    if (kind === 'contact') return [html('p', {}, html('b', {}, `${names} touch `), `${when}, ${where}.`)];
    const near = worst.depth_mm === 0 && worst.distance_mm > 0;
    const how = near ?
        `${short(worst.distance_mm, 3)} mm apart, with ${short(clearance_mm, 3)} mm asked for` :
        worst.contour_length_mm > 0 ?
        `${short(worst.depth_mm)} mm deep or more, and their surfaces cross along ${short(worst.contour_length_mm, 1)} mm` :
        `one inside the other, ${short(worst.depth_mm)} mm deep or more`;
    return [
      html('p', {}, html('b', {}, near ? `${names} come too near to each other ` : `${names} overlap `), `${when}.`),
      html('p', {}, `Worst at ${percent(worst.time, 2)}: ${how}, ${where}.`),
      html('p', {class: 'fine'}, `Length of the crossing, over time: ${short(intersection_mm, 3)} mm.`)
    ];
  }
}

const meets = ({from, to, worst}, other) => from <= other.time && other.time <= to &&
    worst.box_mm[0].every((x, k) => x <= other.box_mm[1][k] && other.box_mm[0][k] <= worst.box_mm[1][k]);
