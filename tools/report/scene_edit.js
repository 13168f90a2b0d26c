// A scene in the studio: keys of the ways and parts in their states are dragged, on the timeline and in the view; the check follows
// in the background.

import {meshesOfParts} from './data.js';
import {cross, dot, length, plus} from './geometry.js';
import {History} from './history.js';
import {svg} from './overlay.js';
import {button, html} from './panels.js';
import {axisAt, axisOf, keyAdded, keyMoved, keyRemoved, moves, partPut, placedBy, poseAt, times, turnAbout, turnOf} from './poses.js';
import {save} from './save.js';
import {ScenePage} from './scene.js';
import {BalanceRun, Checks, Refusal, sceneBalance, sceneFile} from './server.js';
import {sideEffect, stillThere} from './side_effects.js';
import {downloads} from './status.js';
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
    this.history = new History(this.edited, JSON.stringify);
    this.base = null;  // what was found before the last edit
    // What is edited: {part, kind, number} of the way that is shown, or {part, kind, state}. Kind: translation or rotation.
    this.key = null;
    this.effect = null;
    this.checks = new Checks((edit, answer) => this.told(edit, answer));
    this.judged = null;  // the states whose balance was asked for last
    this.build();
    page.shown.push(() => this.show());
    page.drawn.push(project => this.place(project));
    this.follow(this.history.now);
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
    if (this.page.scene.states.some(({rests}) => rests)) this.buildMaking();
    this.buildPicture();
    this.handle =
        html('button', {type: 'button', class: 'handle', hidden: true}, svg('svg', {viewBox: '-12 -12 24 24'}, svg('path')));
    if (!this.page.view) return;
    this.page.stage.append(html('div', {class: 'handles'}, this.handle), this.picture);
    this.drags();
  }

  /** What is needed to run rayrep balance from here. */
  buildMaking() {
    this.making = html('div', {class: 'making'});
    this.page.balancePanel.element.append(this.making);
    this.offerBalance();
  }

  offerBalance(...told) {
    this.made = told.length > 0;
    this.making.replaceChildren(
        ...told, html('div', {class: 'buttons'}, button('Balance the parts', () => this.runBalance(), {
                        title: 'rayrep balance: chooses what is inside all printed parts, so that it rests in all its states'
                      })));
  }

  async runBalance() {
    const {edited} = this;
    const at = html('p', {class: 'fine', role: 'status'}, 'Balancing \u2026');
    const run = new BalanceRun(edited, null, ({stage}) => at.textContent = `Balancing \u2026 ${stage}`);
    this.making.replaceChildren(at, html('div', {class: 'buttons'}, button('Cancel', () => run.cancel())));
    try {
      const answer = await run.result();
      const isOld = edited.states !== this.edited.states || edited.transitions !== this.transitions;
      const words = `It was balanced${isOld ? ' as it was before the last edit' : ''}, and judged from these files:`;
      this.offerBalance(...(answer ? [html('p', {}, words), downloads(answer.files)] : []));
    } catch (error) {
      this.offerBalance(html('p', {class: 'refusal', role: 'alert'}, error.message));
    }
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
  /** What can be edited of the scene. */
  get edited() {
    const {states, transitions} = this.page.scene;
    return {states, transitions};
  }
  get motions() {
    return this.transitions[this.page.now.transition]?.motions;
  }

  // --------------------------------------------------------------------------------------------------------------------- edits

  editWay(part, motion, held) {
    const {transition} = this.page.now;
    const transitions = this.transitions.map(
        (way, n) => n === transition ? {...way, motions: way.motions.map((old, k) => k === part ? motion : old)} : way);
    this.edit({...this.edited, transitions}, held);
  }

  /** @param held  the hand is still moving it */
  edit(edited, held) {
    if (!this.holding && this.page.found.stage === 'complete') this.base = this.page.found;
    this.holding = held;
    if (!held) this.history.step(edited);
    if (this.made) this.offerBalance();  // what can be had there is of before
    this.follow(edited);
  }

  /** The page as edited, with what was found before, until it is known better. */
  follow(edited) {
    const {page} = this;
    const statesMoved = edited.states !== page.scene.states;
    page.scene = {...page.scene, ...edited};
    if (statesMoved && !this.grown) this.grewOld();
    this.grown = this.holding;  // what the hand does is one edit
    page.draw();
    this.problem.hidden = true;
    this.state.textContent = 'Looking for collisions \u2026';
    this.checks.want(edited);
  }

  /** The balance that is shown is that of before one more edit. */
  grewOld() {
    const {page} = this;
    if (!page.balance) return;
    page.tellBalance(page.balance, page.balanceOld + 1);
    page.balancePanel.tell(`It is judged again once collisions are known.${this.ageWords()}`);
  }

  /** How old the balance is that is shown. */
  ageWords() {
    const {balance, balanceOld} = this.page;
    if (!balance || !balanceOld) return '';
    return ` What is told above was judged before the last ${balanceOld === 1 ? 'edit' : `${balanceOld} edits`}.`;
  }

  go(by) {
    if (!this.history.go(by)) return;
    if (this.page.found.stage === 'complete') this.base = this.page.found;
    const {key, history: {now}} = this;
    if (key?.number !== undefined && !now.transitions[this.page.now.transition]?.motions[key.part][key.kind][key.number])
      this.key = null;
    this.holding = false;
    this.follow(now);
  }

  told(edit, answer) {
    if (answer instanceof Refusal) {
      this.problem.textContent = answer.message;
      this.problem.hidden = false;
      this.state.textContent = '';
      return;
    }
    if (answer.misplaced) this.page.misplaced = answer.misplaced;
    this.page.tell(answer, this.page.scene);
    if (answer.stage !== 'complete') return;
    if (!this.holding) this.judge();
    const all = answer.pairs.length;
    this.state.textContent =
        `Checked; ${answer.kept} of ${all} ${all === 1 ? 'pair' : 'pairs'} did not have to be looked at again.`;
    if (edit.transitions !== this.transitions) return;
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
    if (page.misplaced?.length) {
      page.balancePanel.tell(
          `Not judged: parts overlap in a state, and what is in one place twice would weigh twice.${this.ageWords()}`, true);
      return;
    }
    page.balancePanel.tell('Whether it rests is being judged \u2026');
    try {
      const balance = await sceneBalance(this.edited);
      if (this.judged !== states) return;
      page.tellBalance(balance, page.scene.states === states ? 0 : Math.max(1, page.balanceOld));
      page.balancePanel.tell(
          'Of the parts as they are, as rayrep balance --as-is tells it. rayrep balance chooses what is inside them.');
    } catch (error) {
      if (this.judged === states) page.balancePanel.tell(error.message, true);
    }
  }

  async save() {
    try {
      save(await sceneFile(this.edited), this.page.data.title.replace(/^.*\//, ''));
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
    const {transition, state} = page.now;
    if (this.key && (this.key.state === undefined ? transition !== this.keyWay : state !== this.key.state)) this.key = null;
    this.keyWay = transition;
    this.showFields();
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
    const path = this.key?.number !== undefined && this.key.kind === 'translation' ? this.path(this.key.part) : null;
    if (page.view && path) page.view.show({...page.view.moment, path});
  }

  path(part) {
    return Array.from({length: kPathPieces + 1}, (_, n) => this.anchor(part, n / kPathPieces));
  }

  /** The middle of a part, at a time of the way that is shown. */
  anchor(part, time) {
    return this.middle(part, poseAt(this.motions[part], time));
  }

  middle(part, pose) {
    const {box: [low, high], pivot_mm} = this.page.parts[part];
    return placedBy(pose, pivot_mm, low.map((x, k) => (x + high[k]) / 2));
  }

  /** As `key` has it: {time, at} or {time, rotation}; in a state without a time. */
  valueOf({part, kind, number, state}) {
    if (state === undefined) return this.motions[part][kind][number];
    const {translation, rotation} = this.page.scene.states[state].poses[part];
    return kind === 'translation' ? {at: translation} : {rotation};
  }

  /** Where the part is then. */
  poseOf(key) {
    if (key.state !== undefined) return this.page.scene.states[key.state].poses[key.part];
    return poseAt(this.motions[key.part], this.valueOf(key).time);
  }

  choose(key) {
    this.key = key;
    this.page.goTime(this.motions[key.part][key.kind][key.number].time);
  }

  isFixed({part, kind, number, state}) {
    if (state !== undefined) return false;
    return number === 0 || number === this.motions[part][kind].length - 1;
  }

  change(key, to, held) {
    const {part, kind, number, state} = key;
    if (this.isFixed(key)) return;
    if (state !== undefined) {
      const {translation, rotation} = this.poseOf(key);
      this.edit(partPut(this.edited, state, part, {translation: to.at ?? translation, rotation: to.rotation ?? rotation}), held);
      return;
    }
    const motion = keyMoved(this.motions[part], kind, number, to);
    this.page.now = {...this.page.now, time: motion[kind][number].time, state: null};
    this.editWay(part, motion, held);
  }

  add(part, kind) {
    const added = keyAdded(this.motions[part], kind, this.page.now.time);
    if (!added) {
      this.state.textContent = 'There is a key at this time already: move the time first.';
      return;
    }
    this.key = {part, kind, number: added.number};
    this.editWay(part, added.motion, false);
  }

  remove(key) {
    if (key.state !== undefined || this.isFixed(key)) return;
    this.key = null;
    this.editWay(key.part, keyRemoved(this.motions[key.part], key.kind, key.number), false);
  }

  // -------------------------------------------------------------------------------------------------------------------- fields

  showFields() {
    const {key, page} = this;
    const name = key?.state !== undefined ? `${key.part} ${key.kind} in ${key.state}` :
        key ? `${key.part} ${key.kind} ${key.number} ${this.motions[key.part][key.kind].length} ${page.now.transition}` :
              `${page.now.state}`;
    if (name !== this.fieldsOf) this.buildFields();
    this.fieldsOf = name;
    if (!key) return;
    const values = this.valuesOf(this.valueOf(key));
    this.inputs.forEach((input, n) => {
      if (input !== document.activeElement) input.value = +values[n].toFixed(3);
    });
  }

  valuesOf({time, at, rotation}) {
    const begin = time === undefined ? [] : [100 * time];
    if (at) return [...begin, ...at];
    const {axis, angle} = axisOf(rotation);
    return [...begin, ...axis, angle * 180 / Math.PI];
  }

  buildFields() {
    const {key, page} = this;
    this.inputs = [];
    if (!key) {
      this.fields.replaceChildren(...this.invitation());
      return;
    }
    const inState = key.state !== undefined, fixed = this.isFixed(key);
    const names = [
      ...(inState ? [] : ['time, %']),
      ...(key.kind === 'translation' ? ['x, mm', 'y, mm', 'z, mm'] : ['axis x', 'axis y', 'axis z', 'degrees'])
    ];
    this.inputs = names.map(words => html('input', {type: 'number', step: 'any', 'aria-label': words, disabled: fixed}));
    for (const input of this.inputs) input.addEventListener('change', () => this.typed());
    const where = inState ? `, in the state '${page.scene.states[key.state].name}',` : '';
    const words = `${key.kind === 'translation' ? 'is moved by' : 'is turned about its pivot'}${fixed ? ', as in its state' : ''}:`;
    this.fields.replaceChildren(
        html('p', {}, html('b', {}, page.names[key.part]), `${where} ${words}`),
        html('div', {class: 'numbers'}, this.inputs.map((input, n) => html('label', {}, html('small', {}, names[n]), input))),
        html('div', {class: 'buttons'}, this.doings(fixed, inState)));
  }

  /** What can be done with what is edited. */
  doings(fixed, inState) {
    const {key} = this;
    if (inState) {
      const other = key.kind === 'translation' ? ['Turn it', 'rotation'] : ['Move it', 'translation'];
      return [
        button(other[0], () => this.put(key.part, other[1])),
        button(
            'Another part',
            () => {
              this.key = null;
              this.page.draw();
            })
      ];
    }
    if (!fixed) return [button('Remove key', () => this.remove(key), {title: 'Delete'})];
    const {from, to} = this.transitions[this.page.now.transition];
    return [button('Edit the state', () => {
      this.page.goState(key.number === 0 ? from : to);
      this.put(key.part, key.kind);
    })];
  }

  /** Where nothing is chosen. */
  invitation() {
    const {page: {now, scene, names}} = this;
    if (now.state === null || !scene.states[now.state])
      return [html(
          'p', {class: 'fine'},
          'Choose a key below the timeline to edit it, or add one at the time that is shown. The first and the last are those of ' +
              'the states: go to a state to edit it.')];
    return [
      html(
          'p', {}, 'Move a part in the state ', html('b', {}, scene.states[now.state].name),
          ', with all ways that begin or end there:'),
      html(
          'div', {class: 'buttons'},
          names.map((name, part) => button(name, () => this.put(part, 'translation'), {class: 'plain part'})))
    ];
  }

  /** Chooses a part in the state that is shown. */
  put(part, kind) {
    this.key = {part, kind, state: this.page.now.state};
    this.page.draw();
  }

  typed() {
    const values = this.inputs.map(({value}) => Number.parseFloat(value));
    if (!values.every(Number.isFinite)) return;
    const inState = this.key.state !== undefined;
    const [time, ...rest] = inState ? [0, ...values] : values;
    const to = this.key.kind === 'translation' ? {at: rest} : {rotation: turnAbout(rest.slice(0, 3), rest[3] * Math.PI / 180)};
    this.change(this.key, inState ? to : {time: time / 100, ...to}, false);
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
    const [x, y] = project(this.middle(key.part, this.poseOf(key)));
    handle.style.translate = `${x}px ${y}px`;
    handle.className = `handle ${key.kind}${x < 140 ? ' at-left' : ''}${this.held ? ' held' : ''}`;
    handle.querySelector('path').setAttribute('d', kSigns[key.kind]);
    handle.setAttribute(
        'aria-label', key.kind === 'translation' ? 'Drag the part; arrow keys move it' : 'Turn the part; arrow keys turn it');
    const {time, ...value} = this.valueOf(key);
    const values = this.valuesOf(value);
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
    const {part} = this.key;
    const {translation} = this.poseOf(this.key);
    const arm = plus(plus(place, parts[part].pivot_mm, -1), translation, -1);
    const way = cross(axis, arm);  // for one radian
    const [u, v] = [dot(way, aside), dot(way, above)];
    if (free || Math.hypot(u, v) < 0.1 * length(arm)) return times(turnAbout(above, x * kTurn), turnAbout(aside, y * kTurn));
    return turnAbout(axis, (x * u - y * v) * view.pixelAt(place) / (u * u + v * v));
  }

  /** @param free  it is not held to the axis of its way */
  begin(free) {
    const {key, page} = this;
    const place = this.middle(key.part, this.poseOf(key));
    if (key.state !== undefined) {
      const axis = axisAt(page.scene, key.state, key.part);
      return {key: this.valueOf(key), place, axis: axis ?? [0, 0, 1], free: free || !axis};
    }
    const {axis, angle} = turnOf(this.motions[key.part].rotation);
    return {key: this.valueOf(key), place, axis, free: free || angle < 1e-6};
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
