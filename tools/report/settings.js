// The settings of a goal, made of the rows that the command's help is made of.

import {svg} from './overlay.js';
import {html} from './panels.js';

/** Where a number's usual values lie; others can be typed. Lengths that depend on the body are in parts of its height. */
const kUsual = {
  wall: [0.4, 5, 0.1],
  density: [0.8, 4, 0.01],
  fluid: [0.7, 1.4, 0.005],
  resolution: [20, 200, 5],
  'max-tilt': [1, 45, 1],
  flatten: [0, 3, 0.1],
  size: [20, 300, 1]
};
const kOfHeight = {
  waterline: [0.02, 0.99]
};
const kUnits = {
  MM: 'mm',
  G: 'g',
  G_CM3: 'g/cm\u00b3',
  DEG: '\u00b0',
  PERCENT: '%',
  CM3: 'cm\u00b3',
  MIN: 'min',
  S: 's'
};

export const titled = name => name[0].toUpperCase() + name.slice(1).replace(/-/g, ' ');
/** Words of the command line for the studio: its options are fields here. */
export const inStudio = (text, rows) =>
    text.replace(/--([a-z0-9-]+)/g, (option, name) => rows.some(row => row.name === name) ? titled(name) : option);
/** Rows of other goals that mean the same are taken along to another goal. */
export const sameRow = (a, b) => a.name === b.name && a.kind === b.kind && a.words === b.words;

/** Of a row: from, to and step, or null. */
function rangeOf(row, height) {
  if (kUsual[row.name]) return kUsual[row.name];
  if (kOfHeight[row.name] && height) {
    const step = 10 ** Math.floor(Math.log10(height / 200));
    const [low, high] = kOfHeight[row.name].map(part => Math.round(part * height / step) * step);
    return [low, high, step];
  }
  if (row.kind !== 'number' || !Number.isFinite(row.lo) || !Number.isFinite(row.hi) || row.hi - row.lo > 1000) return null;
  const span = row.hi - row.lo;
  return [row.lo, row.hi, row.value === 'N' ? 1 : 10 ** Math.floor(Math.log10(span / 50))];
}

/** One setting. */
class Field {
  /** @param edit  called with what changes, and whether more is to come */
  constructor(row, edit) {
    this.row = row;
    this.edit = (text, more) => edit({[row.name]: text}, more);
    const id = `setting-${row.name}`;
    this.fault = html('p', {class: 'fault', id: `${id}-fault`, hidden: true});
    this.build(id);
    this.reset = html(
        'button', {
          type: 'button',
          class: 'reset',
          'aria-label': `${titled(row.name)}: back to what is usual`,
          title: 'Back to what is usual'
        },
        '\u00d7');
    this.reset.addEventListener('click', () => this.edit(undefined, false));
    const words = html('small', {id: `${id}-words`}, row.repeated ? `${row.words}; several: one a line` : row.words);
    const label = html('label', {}, titled(row.name));
    label.htmlFor = id;
    this.element = html(
        'div', {class: `field of-${row.kind}`, 'data-name': row.name}, html('div', {class: 'name'}, label, this.reset), words,
        this.control, this.more(), this.fault);
    this.input.setAttribute('aria-describedby', `${id}-words ${id}-fault`);
  }

  more() {
    const {details} = this.row;
    return details ? html('details', {}, html('summary', {}, 'More'), html('p', {}, details)) : null;
  }

  build(id) {
    const {row} = this;
    if (row.kind === 'flag') {
      this.input = html('input', {type: 'checkbox', id});
      this.input.addEventListener('change', () => this.edit(this.input.checked ? '' : undefined, false));
      this.control = html('div', {class: 'control'}, this.input);
    } else if (row.kind === 'choice') {
      this.input = html('select', {id}, row.choices.map(choice => html('option', {value: choice}, choice)));
      if (!row.choices.includes(row.default)) this.input.prepend(html('option', {value: ''}, row.default || '\u2013'));
      this.input.addEventListener(
          'change', () => this.edit(this.input.value === row.default || !this.input.value ? undefined : this.input.value, false));
      this.control = html('div', {class: 'control'}, this.input);
    } else if (row.repeated) {
      this.buildLines(id);
    } else {
      this.buildText(id);
    }
  }

  /** Each of several has a line. */
  buildLines(id) {
    this.input = html('textarea', {id, rows: 2, spellcheck: 'false', autocomplete: 'off'});
    const given = () => this.input.value.split('\n').map(line => line.trim()).filter(Boolean).join('\n');
    this.input.addEventListener('change', () => this.edit(given() || undefined, false));
    this.control = html('div', {class: 'control'}, html('span', {class: 'with-unit'}, this.input));
  }

  buildText(id) {
    const {row} = this;
    const number = row.kind === 'number';
    this.input =
        html('input', {type: 'text', id, spellcheck: 'false', autocomplete: 'off', inputmode: number ? 'decimal' : undefined});
    this.input.addEventListener('change', () => this.edit(this.input.value.trim() || undefined, false));
    this.range = number || kUsual[row.name] ?
        html('input', {type: 'range', 'aria-label': `${titled(row.name)}, to drag`, hidden: true}) :
        null;
    this.range?.addEventListener('input', () => {
      this.input.value = +(+this.range.value).toFixed(4);
      this.edit(this.input.value, true);
    });
    this.range?.addEventListener('change', () => this.edit(this.input.value, false));
    const unit = kUnits[row.value];
    this.control = html(
        'div', {class: 'control'}, this.range,
        html('span', {class: 'with-unit'}, this.input, unit ? html('span', {class: 'unit', 'aria-hidden': 'true'}, unit) : null));
  }

  /** @param text  as it was chosen, or undefined @param found  what it came to @param height  of the body, mm, or 0 */
  show(text, found, height) {
    const {row} = this;
    const given = text !== undefined;
    this.element.classList.toggle('given', given);
    this.reset.hidden = !given;
    if (row.kind === 'flag') {
      this.input.checked = given;
    } else if (row.kind === 'choice') {
      this.input.value = given ? text : row.choices.includes(row.default) ? row.default : '';
    } else {
      const usual = found ?? row.default ?? '';
      if (document.activeElement !== this.input || this.input.value === this.shown) this.input.value = given ? text : '';
      this.shown = this.input.value;
      this.input.placeholder = usual;
      this.showRange(given ? text : usual, height);
    }
  }

  showRange(text, height) {
    const range = this.range && rangeOf(this.row, height);
    if (!range) return;
    const [low, high, step] = range;
    this.range.hidden = false;
    Object.assign(this.range, {min: low, max: high, step});
    const value = parseFloat(text);
    this.range.value = Number.isFinite(value) ? value : low;
    this.range.classList.toggle('unknown', !Number.isFinite(value));
  }

  complain(message) {
    this.fault.textContent = message ?? '';
    this.fault.hidden = !message;
    this.input.toggleAttribute('aria-invalid', Boolean(message));
  }
}

export class Settings {
  constructor(edit) {
    this.edit = edit;
    this.fields = new Map();
    this.element = html('div', {class: 'settings'});
  }

  /** @param own  headings that this goal alone has @param rows  of the goal */
  build(rows, own) {
    if (rows === this.rows) return;
    this.rows = rows;
    this.fields = new Map(rows.map(
        row =>
            [row.name,
             new Field({...row, words: inStudio(row.words, rows), details: inStudio(row.details ?? '', rows)}, this.edit)]));
    const headings = [...new Set(rows.map(row => row.group))].sort((a, b) => own.has(b) - own.has(a));
    this.groups = headings.map((heading, n) => {
      const of = rare =>
          rows.filter(row => row.group === heading && Boolean(row.rare) === rare).map(row => this.fields.get(row.name).element);
      const common = of(false), rare = of(true);
      const count = html('small', {class: 'count'});
      const seldom = rare.length && common.length ?
          html('details', {class: 'rare'}, html('summary', {}, `Rarely needed (${rare.length})`), rare) :
          null;
      const open = own.has(heading) || common.some(element => element.dataset.name === 'wall');
      const element = html(
          'details', {class: 'group', open}, html('summary', {}, html('h3', {}, heading), count), common.length ? common : rare,
          seldom);
      return {heading, element, count, names: rows.filter(row => row.group === heading).map(row => row.name)};
    });
    this.element.replaceChildren(...this.groups.map(group => group.element));
  }

  /** @param texts  what was chosen @param found  what a run made of all @param height  of the body, mm, or 0 */
  show(texts, found, height) {
    for (const [name, field] of this.fields) field.show(texts[name], found[name], height);
    for (const {count, names} of this.groups ?? []) {
      const given = names.filter(name => name in texts).length;
      count.textContent = given ? `${given} set` : '';
    }
  }

  /** Whether there is text in a field that is not yet taken. */
  isTyping() {
    return [...this.fields.values()].some(
        ({input, shown}) => input === document.activeElement && shown !== undefined && input.value !== shown);
  }

  complain(name, message) {
    for (const field of this.fields.values()) field.complain(null);
    const field = this.fields.get(name);
    if (!field) return;
    field.complain(message);
    for (let outer = field.element.closest('details:not([open])'); outer;
         outer = outer.parentElement.closest('details:not([open])'))
      outer.open = true;
  }
}

const kPictures = {
  float: 'M2 15q3-3 6 0t6 0 6 0 6 0M7 11 9 5h9l2 6',
  spin: 'M14 3v5M5 9h18l-8 11-1 5-1-5Z',
  stand: 'M8 24 11 4h6l3 20ZM3 24h22',
  target: 'M14 4a10 10 0 1 0 .1 0M14 9a5 5 0 1 0 .1 0M14 13.5v1M14 1v5M14 22v5M1 14h5M22 14h5',
  pose: 'M4 23h8V9H4ZM24 23V17H10',
  dice: 'M5 5h18v18H5ZM10 10v.1M18 18v.1M14 14v.1'
};

/** "hollow MESH so that it floats upright": its end. */
function wordsOfGoal(words) {
  const end = words.replace(/^hollow MESH (so that it )?/, '');
  return end[0].toUpperCase() + end.slice(1);
}

/** What it shall do, to be chosen. */
export class Goals {
  constructor(goals, choose) {
    this.inputs = new Map(goals.map(({name}) => [name, html('input', {type: 'radio', name: 'goal', value: name})]));
    for (const [name, input] of this.inputs) input.addEventListener('change', () => choose(name));
    this.element = html(
        'fieldset', {class: 'goals'}, html('legend', {}, 'What shall it do?'),
        html(
            'div', {class: 'cards'},
            goals.map(
                ({name, words}) => html(
                    'label', {}, this.inputs.get(name),
                    svg('svg', {viewBox: '0 0 28 28', 'aria-hidden': 'true'}, svg('path', {d: kPictures[name] ?? ''})),
                    html('span', {}, html('b', {}, titled(name)), html('small', {}, wordsOfGoal(words)))))));
  }

  show(goal) {
    for (const [name, input] of this.inputs) input.checked = name === goal;
  }
}
