// How a scene rests in its states: what of that is marked in the view, and what is told beside it.

import {cross, dot, length, plus} from './geometry.js';
import {marksOf, placed} from './marks.js';
import {button, html} from './panels.js';
import {degrees, place, plainWords, short, units} from './words.js';

const kSigns = {
  good: '\u2713',
  bad: '\u2715'
};
export const signOf = good => html('span', {class: 'sign', 'aria-hidden': 'true'}, kSigns[good ? 'good' : 'bad']);

/** Of a state what was judged there, or null. */
export const restOf = (balance, state) => balance?.states.find(one => one.state === state) ?? null;

/** Criteria that are not met, in a maker's words. */
function failuresOf({criteria}, attitude) {
  const own = name => name.replace(/^pose_1_/, '');
  return criteria.filter(({pass}) => !pass)
      .map(
          one => [plainWords({...one, name: own(one.name)}, [attitude]), `${one.words}: ${one.value} (${one.bound} ${one.limit})`]);
}

/** In a few words: "tips at 21.1°". */
function briefly({after, attitude: {kind}}) {
  const of = name => after[`pose_1_${name}`];
  if (kind === 'stands') return `stands, tips at ${degrees(of('smallest_tipping_angle_rad'))}`;
  if (kind === 'floats') return `floats, metacentric height ${short(of('metacentric_height_mm'))} mm`;
  if (kind === 'hangs') return `hangs ${degrees(of('hangs_at_rad'), 2)} off upright`;
  return kind || 'sinks';
}

function hingeMarks({hinges, after, attitude: {up}}, names, reach, {items, legend}) {
  hinges.forEach(({point_mm, axis, parts}, n) => {
    const along = axis.map(x => x / length(axis));
    const mass = after[`hinge_${n + 1}_centre_of_mass_mm`];
    items.push({
      group: 'hinge',
      kind: 'line',
      from: plus(point_mm, along, -0.6 * reach),
      to: plus(point_mm, along, 0.6 * reach),
      label: 'hinge'
    });
    let value = parts.map(part => names[part]).join(', ');
    if (mass?.every(Number.isFinite)) {
      const foot = plus(point_mm, along, dot(along, plus(mass, point_mm, -1)));
      const across = cross(along, up);
      const beside = Math.abs(dot(across, plus(mass, point_mm, -1))) / length(across);
      items.push(
          {group: 'hinge', kind: 'line', from: mass, to: foot},
          {group: 'hinge', kind: 'point', symbol: 'mass', at: mass, label: `G of ${value}`});
      value = `G of ${value} is ${short(beside, 3)} mm beside the plane through it`;
    }
    legend.push({group: 'hinge', symbol: 'hinge', words: 'Hinge', value});
  });
}

/**
 * What is marked in a state.
 * @param rest   what was judged there
 * @param names  of the parts
 * @param reach  half the size of all
 * @returns {items, legend}, as of marksOf, and `attitude` with heights of water and ground
 */
export function restMarks(rest, names, reach) {
  const attitude = placed(rest.attitude);
  const {items, legend} = marksOf({report: {after: rest.after}, view: {}}, attitude, reach);
  const found = {
    items: items.filter(({group}) => group !== 'axes'),
    legend: legend.filter(({group}) => group !== 'axes'),
    attitude
  };
  hingeMarks(rest, names, reach, found);
  return found;
}

/** First of all, in a sentence each. */
export function restSentences(balance, {states}, parts) {
  const bad = balance.states.filter(({pass}) => !pass);
  const badParts = balance.parts.filter(({pass}) => !pass);
  const quoted = list => list.map(name => `'${name}'`).join(', ');
  const count = balance.states.length;
  const told = [];
  if (bad.length) told.push(`It does not rest as it shall in ${quoted(bad.map(({state}) => states[state].name))}.`);
  if (badParts.length) told.push(`The print fails in ${quoted(badParts.map(({part}) => parts[part].name))}.`);
  if (!count) told.push('Parts are not closed: how it rests was not judged.');
  if (!told.length)
    told.push(`It rests as it shall in ${
        count === 1     ? 'its state' :
            count === 2 ? 'both of its states' :
                          `all ${count} of its states`}: together ${short(balance.mass_g)} g.`);
  return told;
}

/** The list beside the view: a line for each state, and all that was found of the one that is shown. */
export class BalancePanel {
  /** @param go  called with the number of a state */
  constructor(go) {
    this.go = go;
    this.note = html('p', {class: 'fine', role: 'status'});
    this.list = html('ul', {class: 'collisions'});
    this.more = html('div', {class: 'more-of-it'});
    this.element = html('section', {class: 'panel', hidden: true}, html('h2', {}, 'Balance'), this.list, this.more, this.note);
  }

  /** Beside the list: what is going on, or why it was not judged. */
  tell(words, bad = false) {
    this.element.hidden = false;
    this.note.textContent = words;
    this.note.className = bad ? 'refusal' : 'fine';
  }

  /** @param page  what it is of: scene, parts, now @param old  edits after it was judged */
  show(balance, {scene, parts, now}, old) {
    this.element.hidden = false;
    this.list.replaceChildren(...balance.states.map(rest => {
      const line = button(
          '', () => this.go(rest.state),
          {class: `plain line ${
               old           ? 'undecided' :
                   rest.pass ? 'good' :
                               'bad'}`,
           'aria-current': now.state === rest.state});
      line.append(
          html('b', {}, html('bdi', {}, scene.states[rest.state].name), ' ', old ? '' : signOf(rest.pass)),
          html('small', {}, briefly(rest)));
      return html('li', {}, line, now.state === rest.state ? this.wordsOf(rest) : null);
    }));
    this.more.replaceChildren(
        ...balance.parts.filter(({pass}) => !pass)
            .map(part => html('div', {class: 'failed'}, [
                   html('p', {}, `Part '${parts[part.part].name}':`),
                   html('ul', {}, failuresOf(part, {}).map(([
                                                             words, figures
                                                           ]) => html('li', {}, words, html('small', {}, ` ${units(figures)}`))))
                 ])));
    if (balance.proof.length && !old)
      this.more.append(
          ...balance.proof.map(sentence => html('p', {class: 'fine'}, units(sentence[0].toUpperCase() + sentence.slice(1) + '.'))));
  }

  wordsOf(rest) {
    const failed = failuresOf(rest, rest.attitude);
    return html(
        'div', {class: 'resting'}, rest.told.map(sentence => html('p', {}, units(sentence))),
        failed.length ?
            html(
                'div', {class: 'failed'},
                html('ul', {}, failed.map(([words, figures]) => html('li', {}, words, html('small', {}, ` ${units(figures)}`))))) :
            null,
        rest.notes.map(note => html('p', {class: 'fine'}, units(note))));
  }
}
