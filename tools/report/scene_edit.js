// A scene in the studio: keys of the ways are dragged, on the timeline and in the view; the check follows in the background.

import {meshesOfParts} from './data.js';
import {cross, dot, length, plus} from './geometry.js';
import {History} from './history.js';
import {svg} from './overlay.js';
import {button, html} from './panels.js';
import {axisOf, keyAdded, keyMoved, keyRemoved, moves, placedBy, poseAt, times, turnAbout} from './poses.js';
import {save} from './save.js';
import {ScenePage} from './scene.js';
import {Checks, Refusal, sceneBalance, sceneFile} from './server.js';
import {sideEffect, stillThere} from './side_effects.js';
import {percent} from './timeline.js';
import {short} from './words.js';

const kTurn = 0.008;  // radians a pixel
const kPathPieces = 48;
const kEffects = {
  new: 'New: ',
  longer: 'Longer: ',
  chosen: ''
};
const kSigns = {
  translation: 'M0-9V9M-9 0H9M0-9L-3-5H3ZM0 9L-3 5H3ZM-9 0L-5-3V3ZM9 0L5-3V3Z',
  rotation: 'M-7 5A8.6 8.6 0 1 1 7 5M7 5L9.5-.5L3.5 1.5Z'
};

/** @param begin  the block `rayrep-studio`: see README.md */
export function mountScene(root, begin) {
  const {data, blocks} = begin.scene;
  document.title = `${data.title}: rayrep studio`;
  return new SceneStudio(new ScenePage(root, data, meshesOfParts(data, id => blocks[id])));
}

export class SceneStudio {
  constructor(page) {
    this.page = page;
    this.history = new History(page.scene.transitions, JSON.stringify);
    this.base = null;  // what was found before the last edit
    this.key = null;   // {part, kind, number} that is edited, of the way that is shown
    this.effect = null;
    this.checks = new Checks((transitions, answer) => this.told(transitions, answer));
    this.judged = null;  // the states whose balance was asked for last
    this.build();
    page.shown.push(() => this.show());
    page.drawn.push(project => this.place(project));
    this.follow(page.scene.transitions);
  }

  // ------------------------------------------------------------------------------------------------------------------ building

  build() {
    this.undoButton = button('Undo', () => this.go(-1), {title: 'Ctrl+Z'});
    this.redoButton = button('Redo', () => this.go(1), {title: 'Ctrl+Shift+Z'});
    this.state = html('p', {class: 'fine', role: 'status'});
    this.problem = html('div', {class: 'refusal', role: 'alert', hidden: true});
    this.fields = html('div', {class: 'keying'});
    const saving =
        button('Save scene', () => this.save(), {title: 'Put it into the folder of the first one: it names the same meshes'});
    const panel = html(
        'section', {class: 'panel'}, html('h2', {}, 'Edit'),
        html('div', {class: 'buttons'}, this.undoButton, this.redoButton, saving), this.fields, this.problem, this.state);
    this.page.beside.prepend(panel);
    addEventListener('keydown', event => this.shortcut(event));
    this.buildPicture();
    this.handle =
        html('button', {type: 'button', class: 'handle', hidden: true}, svg('svg', {viewBox: '-12 -12 24 24'}, svg('path')));
    if (!this.page.view) return;
    this.page.stage.append(html('div', {class: 'handles'}, this.handle), this.picture);
    this.drags();
  }

  buildPicture() {
    this.pictureWords = html('span', {});
    const look = html('button', {type: 'button', class: 'seen', 'aria-label': 'Look at this collision'}, this.pictureWords);
    look.addEventListener('click', () => this.swap());
    const close = html('button', {type: 'button', class: 'close', 'aria-label': 'Close this picture'}, '\u2715');
    close.addEventListener('click', () => this.setEffect(null));
    this.picture = html('div', {class: 'inset', hidden: true}, look, close);
  }

  get transitions() {
    return this.page.scene.transitions;
  }
  get motions() {
    return this.transitions[this.page.now.transition]?.motions;
  }

  // --------------------------------------------------------------------------------------------------------------------- edits

  /** @param held  the hand is still moving it */
  edit(part, motion, held) {
    const {transition} = this.page.now;
    const transitions = this.transitions.map(
        (way, n) => n === transition ? {...way, motions: way.motions.map((old, k) => k === part ? motion : old)} : way);
    if (!this.holding && this.page.found.stage === 'complete') this.base = this.page.found;
    this.holding = held;
    if (!held) this.history.step(transitions);
    this.follow(transitions);
  }

  /** The page as edited, with what was found before, until it is known better. */
  follow(transitions) {
    this.page.scene = {...this.page.scene, transitions};
    this.page.draw();
    this.problem.hidden = true;
    this.state.textContent = 'Looking for collisions \u2026';
    this.checks.want(transitions);
  }

  go(by) {
    if (!this.history.go(by)) return;
    if (this.page.found.stage === 'complete') this.base = this.page.found;
    if (this.key && !this.history.now[this.page.now.transition]?.motions[this.key.part][this.key.kind][this.key.number])
      this.key = null;
    this.follow(this.history.now);
  }

  told(transitions, answer) {
    if (answer instanceof Refusal) {
      this.problem.textContent = answer.message;
      this.problem.hidden = false;
      this.state.textContent = '';
      return;
    }
    this.page.tell(answer, this.page.scene);
    if (answer.stage !== 'complete') return;
    this.judge();
    const all = answer.pairs.length;
    this.state.textContent =
        `Checked; ${answer.kept} of ${all} ${all === 1 ? 'pair' : 'pairs'} did not have to be looked at again.`;
    if (transitions !== this.transitions) return;
    const {chosen} = this.page;
    const effect = (this.base && sideEffect(this.base.pairs, answer.pairs, answer.tolerance)) ??
        (this.effect && stillThere(this.effect, answer.pairs));
    const looksAtIt = effect && chosen?.pair === effect.pair && chosen.interval === effect.interval;
    this.setEffect(looksAtIt ? null : effect);
  }

  /** Has the balance judged in the background, once for the states as they are. */
  async judge() {
    const {page} = this;
    const {states} = page.scene;
    if (this.judged === states || !states.some(({rests}) => rests)) return;
    this.judged = states;
    page.balancePanel.tell('Whether it rests is being judged \u2026');
    try {
      const balance = await sceneBalance({transitions: this.transitions});
      if (this.judged !== states) return;
      page.tellBalance(balance);
      page.balancePanel.tell(
          'Of the parts as they are, as rayrep balance --as-is tells it. rayrep balance chooses what is inside them.');
    } catch (error) {
      if (this.judged === states) page.balancePanel.tell(error.message, true);
    }
  }

  async save() {
    try {
      save(await sceneFile(this.transitions), this.page.data.title.replace(/^.*\//, ''));
    } catch (error) {
      this.problem.textContent = error.message;
      this.problem.hidden = false;
    }
  }

  shortcut(event) {
    if (event.key === 'i') this.peek();
    if (!(event.ctrlKey || event.metaKey) || event.altKey || event.target.matches('input:not([type=radio])')) return;
    const key = event.key.toLowerCase();
    if (key !== 'z' && key !== 'y') return;
    event.preventDefault();
    this.go(key === 'y' || event.shiftKey ? 1 : -1);
  }

  // -------------------------------------------------------------------------------------------------- the picture in the corner

  /** @param effect  {pair, interval, kind} or null */
  setEffect(effect) {
    const {page} = this;
    this.effect = effect;
    this.picture.hidden = !effect;
    page.timeline.setSecond(null);
    page.view?.showInset(null);
    if (!effect) return;
    const one = effect.pair.intervals[effect.interval];
    const {name} = this.transitions[effect.pair.transition];
    this.pictureWords.textContent = `${kEffects[effect.kind]}${page.names[effect.pair.first]} \u00b7 ` +
        `${page.names[effect.pair.second]}${this.transitions.length > 1 ? `, ${name}` : ''}, ${percent(one.worst.time)}`;
    if (page.now.transition === effect.pair.transition) page.timeline.setSecond(one.worst.time);
    if (!page.view) return;
    this.sight = page.sight(effect.pair, one);
    this.drawInset();
  }

  /** Puts the collision that is pointed at into the corner. */
  peek() {
    const at = document.querySelector('.interval:hover') ?? document.querySelector('.interval:focus');
    if (!at) return;
    const [first, second, interval] = at.dataset.place.split('-').map(Number);
    const pair = this.page.pairsOf(this.page.now.transition).find(one => one.first === first && one.second === second);
    if (pair?.intervals[interval].worst) this.setEffect({pair, interval, kind: 'chosen'});
  }

  drawInset() {
    const {page, effect} = this;
    const {transition} = effect.pair;
    const now = {transition, state: null, time: effect.pair.intervals[effect.interval].worst.time};
    const stage = page.stage.getBoundingClientRect(), at = this.picture.getBoundingClientRect();
    page.view.showInset({
      ...this.sight,
      moment: {...page.momentOf(now, effect), ghosts: []},
      place: [at.x - stage.x, at.y - stage.y, at.width, at.height].map(Math.round)
    });
  }

  /** What is in the corner comes to the middle, and what was looked at there goes into the corner. */
  swap() {
    const {page, effect} = this;
    const before = page.chosen && {...page.chosen, kind: 'chosen'};
    this.setEffect(null);
    page.choose(effect.pair, effect.interval);
    if (before) this.setEffect(before);
  }

  // ---------------------------------------------------------------------------------------------------------------------- keys

  show() {
    const {page, motions, history} = this;
    this.undoButton.disabled = !history.can(-1);
    this.redoButton.disabled = !history.can(1);
    if (page.now.transition !== this.keyWay) this.key = null;
    this.keyWay = page.now.transition;
    if (!motions) return;
    const kinds = {translation: 'moves', rotation: 'turns'};
    const rows = motions.flatMap(
        (motion, part) =>
            Object.keys(kinds)
                .filter(kind => motion[kind].length > 1 && (moves(motion) || this.key?.part === part))
                .map(
                    kind => ({part, kind, words: `${page.names[part]} ${kinds[kind]}`, keys: motion[kind].map(({time}) => time)})));
    page.timeline.showKeys(rows, this.key, {
      choose: key => this.choose(key),
      move: ({part, kind, number}, time, held) => this.change({part, kind, number}, {time}, held),
      timeOf: ({part, kind, number}) => this.motions[part][kind][number].time,
      add: (part, kind) => this.add(part, kind),
      remove: key => this.remove(key)
    });
    this.showFields();
    const path = this.key?.kind === 'translation' ? this.path(this.key.part) : null;
    if (page.view && path) page.view.show({...page.view.moment, path});
  }

  path(part) {
    return Array.from({length: kPathPieces + 1}, (_, n) => this.anchor(part, n / kPathPieces));
  }

  /** The middle of a part, at a time. */
  anchor(part, time) {
    const {box: [low, high], pivot_mm} = this.page.parts[part];
    return placedBy(poseAt(this.motions[part], time), pivot_mm, low.map((x, k) => (x + high[k]) / 2));
  }

  choose(key) {
    this.key = key;
    this.page.goTime(this.motions[key.part][key.kind][key.number].time);
  }

  isFixed({part, kind, number}) {
    return number === 0 || number === this.motions[part][kind].length - 1;
  }

  change(key, to, held) {
    const {part, kind, number} = key;
    if (this.isFixed(key)) return;
    const motion = keyMoved(this.motions[part], kind, number, to);
    this.page.now = {...this.page.now, time: motion[kind][number].time, state: null};
    this.edit(part, motion, held);
  }

  add(part, kind) {
    const added = keyAdded(this.motions[part], kind, this.page.now.time);
    if (!added) {
      this.state.textContent = 'There is a key at this time already: move the time first.';
      return;
    }
    this.key = {part, kind, number: added.number};
    this.edit(part, added.motion, false);
  }

  remove(key) {
    if (this.isFixed(key)) return;
    this.key = null;
    this.edit(key.part, keyRemoved(this.motions[key.part], key.kind, key.number), false);
  }

  // -------------------------------------------------------------------------------------------------------------------- fields

  showFields() {
    const {key, page} = this;
    const name =
        key ? `${key.part} ${key.kind} ${key.number} ${this.motions[key.part][key.kind].length} ${page.now.transition}` : '';
    if (name !== this.fieldsOf) this.buildFields();
    this.fieldsOf = name;
    if (!key) return;
    const values = this.valuesOf(this.motions[key.part][key.kind][key.number]);
    this.inputs.forEach((input, n) => {
      if (input !== document.activeElement) input.value = +values[n].toFixed(3);
    });
  }

  valuesOf({time, at, rotation}) {
    if (at) return [100 * time, ...at];
    const {axis, angle} = axisOf(rotation);
    return [100 * time, ...axis, angle * 180 / Math.PI];
  }

  buildFields() {
    const {key, page} = this;
    if (!key) {
      this.inputs = [];
      this.fields.replaceChildren(html(
          'p', {class: 'fine'},
          'Choose a key below the timeline to edit it, or add one at the time that is shown. The first and the last are those of the states.'));
      return;
    }
    const fixed = this.isFixed(key);
    const names =
        ['time, %', ...(key.kind === 'translation' ? ['x, mm', 'y, mm', 'z, mm'] : ['axis x', 'axis y', 'axis z', 'degrees'])];
    this.inputs = names.map(words => html('input', {type: 'number', step: 'any', 'aria-label': words, disabled: fixed}));
    for (const input of this.inputs) input.addEventListener('change', () => this.typed());
    const words = key.kind === 'translation' ? 'is moved by' : 'is turned about its pivot';
    this.fields.replaceChildren(
        html('p', {}, html('b', {}, page.names[key.part]), ` ${words}${fixed ? ', as in its state' : ''}:`),
        html('div', {class: 'numbers'}, this.inputs.map((input, n) => html('label', {}, html('small', {}, names[n]), input))),
        fixed ? '' : html('div', {class: 'buttons'}, button('Remove key', () => this.remove(this.key), {title: 'Delete'})));
  }

  typed() {
    const values = this.inputs.map(({value}) => Number.parseFloat(value));
    if (!values.every(Number.isFinite)) return;
    const [time, ...rest] = values;
    const to = this.key.kind === 'translation' ? {at: rest} : {rotation: turnAbout(rest.slice(0, 3), rest[3] * Math.PI / 180)};
    this.change(this.key, {time: time / 100, ...to}, false);
  }

  // ----------------------------------------------------------------------------------------------------------------- in the view

  place(project) {
    const {key, handle, page} = this;
    handle.hidden = !key || this.isFixed(key);
    if (this.effect && page.view.inset) {
      const {width, height} = page.stage.getBoundingClientRect();
      if (this.sized !== `${width} ${height}`) this.drawInset();
      this.sized = `${width} ${height}`;
    }
    if (handle.hidden) return;
    const [x, y] = project(this.anchor(key.part, this.motions[key.part][key.kind][key.number].time));
    handle.style.translate = `${x}px ${y}px`;
    handle.className = `handle ${key.kind}${x < 140 ? ' at-left' : ''}${this.held ? ' held' : ''}`;
    handle.querySelector('path').setAttribute('d', kSigns[key.kind]);
    handle.setAttribute(
        'aria-label', key.kind === 'translation' ? 'Drag the part; arrow keys move it' : 'Turn the part; arrow keys turn it');
    const [, ...values] = this.valuesOf(this.motions[key.part][key.kind][key.number]);
    handle.dataset.told =
        key.kind === 'translation' ? `${values.map(x => short(x)).join(', ')} mm` : `${short(values[3], 1)}\u00b0`;
  }

  /** By so many pixels to the right and down. */
  moved([x, y], begin, held) {
    const {view} = this.page;
    if (this.key.kind === 'translation') {
      const {aside, above} = view.orbit.pose();
      const scale = view.pixelAt(begin.place);
      this.change(this.key, {at: plus(plus(begin.key.at, aside, x * scale), above, -y * scale)}, held);
    } else {
      this.change(this.key, {rotation: times(this.turnBy([x, y], begin), begin.key.rotation)}, held);
    }
  }

  /**
   * About the axis that the part turns about on its way, so that what is held follows the hand; where that cannot be seen, freely.
   */
  turnBy([x, y], {place, axis, free}) {
    const {view, parts} = this.page;
    const {aside, above} = view.orbit.pose();
    const {part, number} = this.key;
    const {translation} = poseAt(this.motions[part], this.motions[part].rotation[number].time);
    const arm = plus(plus(place, parts[part].pivot_mm, -1), translation, -1);
    const way = cross(axis, arm);  // for one radian
    const [u, v] = [dot(way, aside), dot(way, above)];
    if (free || Math.hypot(u, v) < 0.1 * length(arm)) return times(turnAbout(above, x * kTurn), turnAbout(aside, y * kTurn));
    return turnAbout(axis, (x * u - y * v) * view.pixelAt(place) / (u * u + v * v));
  }

  /** @param free  it is not held to the axis of its way */
  begin(free) {
    const {part, kind, number} = this.key;
    const key = this.motions[part][kind][number];
    const keys = this.motions[part].rotation;
    const {axis, angle} = axisOf(times(keys.at(-1).rotation, keys[0].rotation.map((x, n) => n ? -x : x)));
    return {key, place: this.anchor(part, key.time), axis, free: free || angle < 1e-6};
  }

  drags() {
    const {handle} = this;
    handle.addEventListener('pointerdown', event => {
      if (event.button) return;
      handle.setPointerCapture(event.pointerId);
      this.held = {...this.begin(event.shiftKey), from: [event.clientX, event.clientY]};
    });
    const way = event => [event.clientX - this.held.from[0], event.clientY - this.held.from[1]];
    handle.addEventListener('pointermove', event => this.held && this.moved(way(event), this.held, true));
    const end = event => {
      if (!this.held) return;
      const {held} = this;
      const by = way(event);
      this.held = null;
      if (Math.hypot(...by) > 0) this.moved(by, held, false);
    };
    handle.addEventListener('pointerup', end);
    handle.addEventListener('pointercancel', end);
    handle.addEventListener('keydown', event => {
      const step = event.shiftKey ? 20 : 4;
      const by = {ArrowLeft: [-step, 0], ArrowRight: [step, 0], ArrowUp: [0, -step], ArrowDown: [0, step]}[event.key];
      if (by) this.moved(by, this.begin(false), false);
      if (event.key === 'Delete') this.remove(this.key);
      if (by || event.key === 'Delete') event.preventDefault();
    });
  }
}
