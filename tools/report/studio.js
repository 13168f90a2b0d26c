// The studio: a mesh, what it shall do, and handles; the answer follows the hand. `rayrep studio` is behind it.

import {meshOfColumns, readColumns} from './columns.js';
import {length} from './geometry.js';
import {frameOf, Handles, kCentre, kContact, kCut, kTarget, kUps, kWaterline, turnedTo, upHandle} from './handles.js';
import {commandOf, configOf, History, keyOf, readConfig} from './history.js';
import {button, html, panelsOf} from './panels.js';
import {Charts, footer} from './report.js';
import {save} from './save.js';
import {firstFile, meshOf, Previews, Refusal, Run, sendMesh} from './server.js';
import {Goals, inStudio, sameRow, Settings} from './settings.js';
import {Stage} from './stage.js';
import {Status} from './status.js';

/** Settings that are places in a mesh: of another mesh they mean nothing. */
const kPlaces = ['waterline', 'point', 'center', 'target', 'com', 'inertia'];

/**
 * @param root   where it goes
 * @param begin  the block `rayrep-studio`: see README.md
 */
export function mountStudio(root, begin) {
  return new Studio(root, begin);
}

const pointOf = text => {
  const numbers = (text ?? '').split(',').map(Number);
  return numbers.length === 3 && numbers.every(Number.isFinite) ? numbers : null;
};

/** A preview as the view takes it. */
function dataOf({attitudes, criteria, after}, view) {
  return {
    report: {after, before: null, solver: null},
    told: {criteria},
    view: {
      ...view,
      attitudes,
      note: 'A quick, coarse answer. The inside is drawn as it is solved, before it becomes a surface.',
      meshes: [view.meshes[0], {id: 'columns', what: 'cavity', words: '', triangles: 0, shown: 0, closed: true}]
    }
  };
}

/** What a full run told, to be shown as an older answer when it is none to what is chosen any more. */
function previewOf({key, data}, before) {
  const {meaning, criteria, figures} = data.told;
  const spec = before?.key === key ? before.spec : data.report.options;
  return {key, data, spec, criteria, goal: data.report.command, told: meaning, rows: figures, sequence: 0};
}

/** The outside as it is after --size and --unit; the same one where it is as large as before. */
function scaled(mesh, scale) {
  if (scale === 1) return mesh;
  if (mesh.scaled?.scale === scale) return mesh.scaled;
  const times = list => list.map(x => x * scale);
  const {view} = mesh;
  const meshes = new Map([...mesh.meshes].map(([id, {positions, triangles}]) => [id, {positions: times(positions), triangles}]));
  return mesh.scaled = {scale, meshes, view: {...view, low_mm: times(view.low_mm), size_mm: times(view.size_mm)}};
}

class Studio {
  constructor(root, begin) {
    this.begin = begin;
    this.history = new History({mesh: begin.mesh && meshOf(begin.mesh, null), goal: null, settings: {}});
    this.draft = this.history.now;  // what is chosen, while the hand still moves as well
    this.stage = new Stage({fold: true});
    this.handles = new Handles(this.stage, (changes, held) => {
      this.held = held;
      this.edit(changes, Boolean(held));
    });
    this.settings = new Settings((changes, more) => this.edit(changes, more));
    this.goals = new Goals(begin.goals, goal => this.chooseGoal(goal));
    this.previews = new Previews((state, answer) => this.previewed(state, answer));
    this.previewCount = 0;
    this.build(root);
    this.listen();
    this.showMesh();
    this.update();
  }

  rows(goal = this.draft.goal) {
    return this.begin.goals.find(({name}) => name === goal)?.settings ?? [];
  }

  // ------------------------------------------------------------------------------------------------------------------ building

  build(root) {
    this.file = html('input', {
      type: 'file',
      id: 'file',
      accept: '.stl,.obj,.ply,.off,.3mf,.json',
      class: 'unseen',
      tabindex: '-1',
      'aria-label': 'A mesh, or settings that were saved'
    });
    this.file.addEventListener('change', () => this.open(this.file.files[0]));
    this.undoButton = button('Undo', () => this.go(-1), {title: 'Ctrl+Z'});
    this.redoButton = button('Redo', () => this.go(1), {title: 'Ctrl+Shift+Z'});
    this.shareButton = button('Copy command', () => this.share(), {title: 'The command line that does the same'});
    this.saveButton = button('Save settings', () => this.saveConfig(), {title: 'A file for --config, or to drop here again'});
    this.title = html('h1', {});
    this.facts = html('p', {class: 'facts'});
    this.top = html(
        'header', {class: 'top'}, html('div', {class: 'what'}, html('p', {class: 'over'}, 'rayrep studio'), this.title, this.facts),
        html(
            'div', {class: 'buttons'}, button('Open\u2026', () => this.file.click()), this.undoButton, this.redoButton,
            this.shareButton, this.saveButton),
        this.file);
    this.empty = html(
        'div', {class: 'empty'}, html('p', {class: 'big'}, 'Drop a mesh here'),
        html('p', {}, 'STL, OBJ, PLY, OFF or 3MF. It stays on this computer.'),
        button('Choose a file\u2026', () => this.file.click(), {class: 'main'}));
    this.badge = html('p', {class: 'badge'});
    this.stage.stage.append(this.badge);
    this.live = html('p', {class: 'unseen', role: 'status'});
    this.result = html('section', {class: 'result', 'aria-label': 'Last full run'});
    this.choosing = html('section', {class: 'choosing', 'aria-label': 'Settings'}, this.settings.element);
    this.ask = html('section', {class: 'ask', 'aria-label': 'Goal'}, this.goals.element);
    this.status = new Status({run: () => this.run(), cancel: () => this.cancel(), repair: () => this.edit({repair: ''}, false)});
    root.classList.add('studio');
    this.main = html(
        'main', {}, html('div', {class: 'left'}, this.ask, this.choosing),
        html('div', {class: 'middle'}, this.empty, this.stage.element),
        html('div', {class: 'right'}, this.status.element, this.result));
    root.replaceChildren(this.top, this.main, this.live, footer(this.begin.version));
  }

  listen() {
    const stop = event => event.preventDefault();
    const over = on => document.body.classList.toggle('dragged-over', on);
    addEventListener('dragover', event => {
      stop(event);
      over(true);
    });
    addEventListener('dragleave', event => event.relatedTarget || over(false));
    addEventListener('drop', event => {
      stop(event);
      over(false);
      this.open(event.dataTransfer.files[0]);
    });
    addEventListener('keydown', event => this.key(event));
  }

  key(event) {
    if (!(event.ctrlKey || event.metaKey) || event.altKey) return;
    const key = event.key.toLowerCase();
    if (key !== 'z' && key !== 'y') return;
    if (this.settings.isTyping()) return;  // that is taken back as browsers do
    event.preventDefault();
    this.go(key === 'y' || event.shiftKey ? 1 : -1);
  }

  // ------------------------------------------------------------------------------------------------------------------- choosing

  /** @param more  the hand still moves: there is more to come */
  edit(changes, more) {
    const settings = {...this.draft.settings};
    for (const [name, text] of Object.entries(changes)) {
      if (text === undefined)
        delete settings[name];
      else
        settings[name] = text;
      // Two ways to say one thing.
      const also = this.rows().find(row => row.name === name)?.also;
      if (also && text !== undefined) delete settings[also];
    }
    this.become({...this.draft, settings}, more);
  }

  become(state, more) {
    if (this.loading) return this.update();
    const before = this.draft;
    this.draft = state;
    if (keyOf(state) !== keyOf(before)) this.changed(before);
    if (!more && this.history.step(state)) this.settled();
    this.update();
  }

  /** Something else is asked for than before. */
  changed(before) {
    this.refusal = this.note = this.due = null;
    this.status.shared.replaceChildren();
    this.stage.looksAt = () => {};
    this.cancel(true);
    if (this.preview && this.preview.goal !== this.draft.goal) this.showMesh('keep');
    if (!this.held) this.follow(before);
    this.wantPreview();
  }

  wantPreview() {
    if (this.isReady() && !this.isCurrent(this.last) && !this.isCurrent(this.preview)) this.previews.want(this.draft);
  }

  /** What was typed is seen at once, where the view can know it. */
  follow(before) {
    const {stage} = this;
    const typed = name => this.draft.settings[name] === before.settings[name] ? undefined : this.draft.settings[name];
    let {attitude} = stage;
    if (!attitude || attitude.lowest_mm === null) return;
    const up = kUps[typed('up')] ?? pointOf(typed('up')), contact = pointOf(typed('point')), waterline = +typed('waterline');
    if (up && length(up) > 0) attitude = turnedTo(stage, up.map(x => x / length(up)));
    if (attitude.waterline !== null && waterline > 0) attitude = {...attitude, waterline: attitude.lowest_mm + waterline};
    if (attitude.point_mm && contact) attitude = {...attitude, point_mm: contact};
    if (attitude !== stage.attitude) stage.place(attitude, 'keep');
  }

  /** Whether there is something to be asked. */
  isReady() {
    return Boolean(this.draft.mesh && this.draft.goal && !this.loading);
  }

  /** The hand has let go: the whole is made, after the preview, which it would only slow down. */
  settled() {
    if (!this.status.auto.checked || this.isCurrent(this.last)) return;
    if (this.isCurrent(this.preview) || this.refusal)
      this.run();
    else
      this.due = true;
  }

  chooseGoal(goal) {
    const before = this.rows(), rows = this.rows(goal);
    const kept = Object.entries(this.draft.settings).filter(([name]) => {
      const row = rows.find(row => row.name === name), old = before.find(row => row.name === name);
      return row && (!before.length || (old && sameRow(row, old)));
    });
    this.become({...this.draft, goal, settings: Object.fromEntries(kept)}, false);
  }

  async go(by) {
    const before = this.history.now;
    if (this.loading || !this.history.go(by)) return;
    const {now} = this.history;
    if (now.mesh !== before.mesh && !await this.sendAgain(now.mesh)) {
      this.history.go(-by);
      this.wantPreview();
      return this.update();
    }
    this.draft = now;
    if (now.mesh !== before.mesh) this.showMesh();
    this.changed(before);
    this.settled();
    this.say(by < 0 ? 'Undone.' : 'Redone.');
    this.update();
  }

  /** The server knows one mesh at a time. */
  async sendAgain(mesh) {
    if (!mesh) return true;
    if (!mesh.file)
      return this.refused(new Refusal({kind: 'input', message: `${mesh.name} is not at hand any more. Open it again.`}));
    try {
      this.loading = mesh.name;
      this.update();
      await sendMesh(mesh.file, mesh.name);
      this.last = null;  // the server has it no more
      return true;
    } catch (error) {
      return this.refused(error);
    } finally {
      this.loading = null;
    }
  }

  refused(error) {
    if (!(error instanceof Refusal)) throw error;
    this.refusal = error;
    this.say(error.message);
    this.update();
    return false;
  }

  // ---------------------------------------------------------------------------------------------------------------------- files

  async open(file) {
    this.file.value = '';
    if (!file || this.loading) return;
    if (/\.json$/i.test(file.name)) return this.openConfig(file);
    this.loading = file.name;
    this.refusal = null;
    this.update();
    try {
      this.cancel(true);
      this.previews.forget();
      const {mesh: before} = this.history.now;
      if (before && !before.file) before.file = await firstFile().catch(() => null);
      const mesh = meshOf(await sendMesh(file, file.name), file);
      this.loading = this.last = null;
      const settings = Object.fromEntries(Object.entries(this.draft.settings).filter(([name]) => !kPlaces.includes(name)));
      this.become({...this.draft, mesh, settings}, false);
      this.showMesh();
      this.say(`${mesh.name} is open.`);
    } catch (error) {
      this.loading = null;
      this.wantPreview();
      this.refused(error);
    }
  }

  async openConfig(file) {
    try {
      const {mesh, settings} = readConfig(await file.text(), file.name, this.isRepeated);
      const names = Object.keys(settings);
      const knows = goal => names.every(name => this.rows(goal).some(row => row.name === name));
      const all = this.begin.goals.map(({name}) => name);
      const named = all.find(name => file.name.replace(/(\.config)?\.json$/i, '').endsWith(`_${name}`));
      const goal = [named, this.draft.goal, ...all].find(name => name && knows(name)) ?? this.draft.goal;
      const strange = names.filter(name => !this.rows(goal).some(row => row.name === name));
      const note = [
        mesh && mesh !== this.draft.mesh?.name ? `These settings were made for ${mesh}.` : '',
        strange.length ? `Left out, as the studio has no such setting: ${strange.join(', ')}.` : ''
      ].filter(Boolean).join(' ');
      this.become(
          {...this.draft, goal, settings: Object.fromEntries(Object.entries(settings).filter(([name]) => !strange.includes(name)))},
          false);
      this.note = note;
    } catch (error) {
      this.refused(new Refusal({kind: 'usage', message: error.message}));
    }
  }

  isRepeated = name => this.begin.goals.some(({settings}) => settings.some(row => row.name === name && row.repeated));

  saveConfig() {
    const {mesh, goal} = this.draft;
    save(`${JSON.stringify(configOf(this.draft), null, 2)}\n`, `${mesh.name.replace(/\.\w+$/, '')}_${goal}.json`);
  }

  async share() {
    const command = commandOf(this.draft);
    const field = html('textarea', {readonly: true, rows: 2, 'aria-label': 'Command line'}, command);
    const copied = await navigator.clipboard?.writeText(command).then(() => true, () => false);
    this.status.shared.replaceChildren(html('p', {}, copied ? 'Copied:' : 'To copy:'), field);
    if (!copied) field.select();
    this.say(copied ? 'The command line was copied.' : 'The command line is there to be copied.');
  }

  // -------------------------------------------------------------------------------------------------------------------- answers

  isCurrent(answer) {
    return Boolean(answer) && answer.key === keyOf(this.draft);
  }

  previewed(state, answer) {
    if (this.loading || state.mesh !== this.draft.mesh || state.goal !== this.draft.goal) return;
    const {due} = this;
    const current = keyOf(state) === keyOf(this.draft);
    if (!(answer instanceof Refusal)) {
      ++this.previewCount;
      const shell = scaled(state.mesh, answer.scale ?? 1);
      this.preview = {...answer, shell, key: keyOf(state), goal: state.goal, data: dataOf(answer, shell.view)};
      if (!this.isCurrent(this.last)) this.showPreview();
      this.update();
    } else if (current) {
      this.refused(answer);
    }
    if (!due || !current) return;
    this.due = null;
    this.run();
  }

  showPreview() {
    const {preview, stage} = this;
    preview.surface ??= meshOfColumns(readColumns(preview.columns), preview.columns);
    const meshes = new Map(preview.shell.meshes).set('columns', preview.surface);
    const moving = this.draft !== this.history.now;
    const {attitude} = stage;
    if (!this.held) stage.points = {center: preview.attitudes[0].point_mm ?? null, target: pointOf(preview.spec.target)};
    stage.show(preview.data, meshes, moving ? 'hold' : 'keep');
    // What the hand holds stays in the hand.
    if (this.held && !this.isCurrent(preview))
      stage.place({...stage.attitude, ...Object.fromEntries(this.held.map(name => [name, attitude[name]]))}, 'hold');
  }

  showMesh(camera = 'home') {
    const {mesh} = this.draft;
    document.title = `${mesh ? `${mesh.name}: ` : ''}rayrep studio`;
    this.preview = null;
    if (!mesh) return;
    const {view} = mesh;
    const plain = {
      kind: '',
      words: '',
      prefix: '',
      up: [0, 0, 1],
      to_ground: frameOf([0, 0, 1]),
      lowest_mm: view.low_mm[2],
      highest_mm: view.low_mm[2] + view.size_mm[2]
    };
    this.stage.points = {};
    this.stage.show(
        {report: {after: {}}, told: {}, view: {...view, attitudes: view.attitudes?.length ? view.attitudes : [plain]}}, mesh.meshes,
        camera);
  }

  async run() {
    const state = this.draft;
    if (!this.isReady() || this.running) return;
    const run = new Run(state, this.ending, told => {
      run.told = told;
      this.update();
    });
    this.running = run;
    this.update();
    try {
      const result = await run.result();
      if (result && this.running === run) this.finished(state, result);
    } catch (error) {
      if (this.running === run) {
        this.running = null;
        this.refused(error);
      }
    } finally {
      if (this.running === run) this.running = null;
      this.update();
    }
  }

  finished(state, result) {
    this.running = this.refusal = null;
    this.last = {...result, key: keyOf(state)};
    const {data} = result;
    if (!this.isCurrent(this.last)) return;
    this.showLast();
    this.say(data.report.pass ? 'Verified.' : 'Not verified.');
  }

  showLast() {
    const {last} = this;
    const {charts, panels} = panelsOf(last.data);
    this.oldWords = html('p', {class: 'old-words', hidden: true});
    this.result.replaceChildren(this.oldWords, html('div', {class: 'panels'}, panels));
    new Charts(charts).follow(this.stage, last.data);
    this.stage.show(last.data, last.meshes, 'keep');
    this.preview = previewOf(last, this.preview);
    this.shown = last;
  }

  cancel(silent) {
    const run = this.running;
    if (!run) return;
    this.running = null;
    this.ending = run.cancel();
    if (!silent) this.say('Cancelled.');
    this.update();
  }

  // -------------------------------------------------------------------------------------------------------------------- showing

  say(words) {
    this.live.textContent = words;
  }

  /** Brings all that is shown to what is so, with the next drawing. */
  update() {
    this.waiting ??= requestAnimationFrame(() => {
      this.waiting = null;
      this.refresh();
    });
  }

  refresh() {
    const {mesh, goal, settings} = this.draft;
    const name = mesh?.name ?? 'Hollow a mesh';
    this.title.replaceChildren(html('bdi', {}, name));
    this.facts.textContent = mesh ? factsOf(mesh) : 'so that its print floats, stands or spins';
    const ready = Boolean(mesh && goal);
    this.undoButton.disabled = !this.history.can(-1);
    this.redoButton.disabled = !this.history.can(1);
    this.shareButton.disabled = this.saveButton.disabled = !ready;
    document.body.classList.toggle('loading', Boolean(this.loading));
    this.empty.hidden = Boolean(mesh);
    this.main.classList.toggle('begin', !mesh);
    this.stage.element.hidden = !mesh;
    this.ask.classList.toggle('first', Boolean(mesh) && !goal);
    this.goals.show(goal);
    this.choosing.hidden = !goal;
    const rows = this.rows();
    this.settings.build(rows, this.ownHeadings(goal));
    const found = this.preview?.goal === goal ? this.preview.spec : {};
    const {attitude} = this.stage;
    this.settings.show(settings, found, attitude ? attitude.highest_mm - attitude.lowest_mm : 0);
    this.handles.show(this.kindsOfHandles(rows));
    this.updateView();
    this.updateStatus();
  }

  /** Headings that no other goal has. */
  ownHeadings(goal) {
    const others =
        new Set(this.begin.goals.filter(({name}) => name !== goal).flatMap(({settings}) => settings.map(row => row.group)));
    return new Set(this.rows(goal).map(row => row.group).filter(group => !others.has(group)));
  }

  kindsOfHandles(rows) {
    const has = name => rows.some(row => row.name === name);
    const yoyo = 'yoyo' in this.draft.settings;
    const spins = has('point');
    return [
      has('waterline') ? kWaterline : null,
      has('up') && this.stage.view ? this.up ??= upHandle('Which way is up. Arrow keys tilt it.') : null,
      spins && !yoyo ? kContact : null, spins && yoyo && has('center') ? kCentre : null, has('target') ? kTarget : null, kCut
    ].filter(Boolean);
  }

  /** What the view shows is the last answer to what is chosen, or the last there was. */
  updateView() {
    if (this.isCurrent(this.last) && this.shown !== this.last) this.showLast();
    if (!this.isCurrent(this.last)) this.shown = null;
    const current = this.isCurrent(this.last), quick = this.isCurrent(this.preview);
    const words = !this.preview || current ? '' : this.refusal && !quick ? 'Older settings' : 'Preview';
    this.badge.textContent = words;
    this.badge.hidden = !words;
    this.stage.element.classList.toggle('old', Boolean(this.refusal) && !current && !quick);
    this.result.hidden = !this.last || this.last.data.report.command !== this.draft.goal;
    this.result.classList.toggle('old', !current);
    if (!this.oldWords) return;
    this.oldWords.hidden = current;
    this.oldWords.replaceChildren(
        'Below: the last full run, with other settings (', html('code', {}, this.last?.command ?? ''), ').');
  }

  updateStatus() {
    const {mesh, goal, settings} = this.draft, {refusal} = this;
    const ready = Boolean(mesh && goal), verified = this.isCurrent(this.last);
    const fault = refusal && faultOf(refusal, this.rows());
    if (refusal !== this.complained) this.settings.complain(fault?.name, fault?.words);
    this.complained = refusal;
    this.status.show({
      loading: this.loading,
      refusal,
      words: fault?.words,
      hint: this.loading || !mesh      ? '' :
          !goal                        ? 'Now choose what it shall do.' :
          Object.keys(settings).length ? '' :
                                         'Drag a round handle in the view, or a slider: the answer follows.',
      mesh,
      repairs: 'repair' in settings,
      ready,
      last: ready && verified ? this.last : null,
      preview: ready && !verified ? this.preview : null,
      current: verified || this.isCurrent(this.preview),
      note: this.note,
      running: this.running
    });
  }
}

/** What is wrong, in words of the studio, and the setting it lies in, where it lies in one. */
function faultOf({kind, message, setting}, rows) {
  const known = name => rows.some(row => row.name === name);
  const named = setting ?? [...message.matchAll(/--([a-z0-9-]+)/g)].map(found => found[1]).find(known);
  return {name: kind === 'usage' ? named : null, words: inStudio(message, rows)};
}

function factsOf({summary}) {
  const {format, size_mm, triangles} = summary;
  return [
    format, size_mm && `${size_mm.map(size => +size.toPrecision(4)).join(' \u00d7 ')} mm`,
    triangles && `${triangles.toLocaleString('en')} triangles`
  ].filter(Boolean)
      .join(' \u00b7 ');
}
