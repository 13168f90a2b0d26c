// What stands beside the view: verdict, figures, checks, how to print, options.

import {rightingChart, speedChart, supportChart} from './charts.js';
import {numbersOf} from './marks.js';
import {plainWords, units} from './words.js';

export function html(name, attributes = {}, ...children) {
  const element = document.createElement(name);
  for (const [key, value] of Object.entries(attributes))
    if (value !== undefined && value !== false) element.setAttribute(key, value === true ? '' : value);
  element.append(...children.flat().filter(child => child !== null && child !== undefined));
  return element;
}

export function button(words, act, attributes = {}) {
  const element = html('button', {type: 'button', class: 'plain', ...attributes}, words);
  element.addEventListener('click', act);
  return element;
}

const kGoals = {
  float: 'floats',
  spin: 'spins',
  'yo-yo': 'spins as a yo-yo',
  stand: 'stands',
  target: 'has the numbers wanted',
  pose: 'does what it shall in its poses',
  dice: 'rolls as a die should'
};
const kMade = {
  float: 'made to float',
  spin: 'made to spin',
  stand: 'made to stand',
  target: 'made to have given numbers',
  pose: 'made for poses',
  dice: 'made to roll'
};

/** First of all: whether it does what it is for. */
export function verdictOf(data) {
  const {report, told, title} = data;
  const inspected = report.command === 'inspect';
  const pass = inspected ? report.input.usable : report.pass;
  const [path, file] = /^(.*\/)?(.*)$/.exec(title).slice(1);
  const task = inspected ? 'looked at' :
      report.solver      ? kMade[report.command] ?? report.command :
                           `judged: whether it ${kGoals[report.goal.name] ?? report.goal.name}`;
  const word = inspected ? (pass ? 'USABLE' : 'NOT USABLE') : pass ? 'VERIFIED' : 'NOT VERIFIED';
  const failed = told.criteria.filter(criterion => !criterion.pass);
  const [first, ...more] = told.meaning;
  const poses = data.view.attitudes.length > 1;  // one is as important as the other
  return html(
      'header', {class: `verdict ${pass ? 'good' : 'bad'}`},
      html('p', {class: 'over'}, `rayrep ${report.version}`, html('span', {}, task)),
      html('h1', {}, path ? html('bdi', {class: 'path'}, path) : null, html('bdi', {}, file)),
      html('p', {class: 'word'}, html('span', {class: 'sign', 'aria-hidden': 'true'}, pass ? '\u2713' : '\u2715'), word),
      first ? html('p', {class: poses ? 'of-pose' : 'lead'}, units(first)) : null,
      failed.length ? html(
                          'div', {class: 'failed'},
                          html('p', {}, failed.length === 1 ? 'What failed:' : `What failed, ${failed.length} things:`),
                          html('ul', {}, failed.map(criterion => html('li', {}, plainWords(criterion, data.view.attitudes))))) :
                                                              null,
      more.map(sentence => html('p', {class: poses ? 'of-pose' : 'more'}, units(sentence))),
      told.changed ? html('p', {class: 'more'}, `Changed, as --allow lets: ${told.changed}.`) : null,
      told.outside ? html('p', {class: 'more'}, units(told.outside[0].toUpperCase() + told.outside.slice(1))) : null,
      inspected && pass ? html('p', {class: 'lead'}, inspectedWords(report)) : null);
}

function inspectedWords({input}) {
  const [x, y, z] = input.size_mm.map(size => +size.toPrecision(4));
  return `A closed solid of ${x} \u00d7 ${y} \u00d7 ${z} mm, ${input.triangles.toLocaleString('en')} triangles` +
      (input.cavities ? `, with ${input.cavities} ${input.cavities === 1 ? 'cavity' : 'cavities'}.` : '.');
}

function panel(title, ...content) {
  return html('section', {class: 'panel'}, html('h2', {}, title), ...content);
}

function figures({told, report}) {
  const {table, lines} = told.figures;
  const both = Boolean(report.solver);
  const head = both ?
      html(
          'thead', {},
          html('tr', {}, html('td', {}), html('th', {scope: 'col'}, 'before (solid)'), html('th', {scope: 'col'}, 'after'))) :
      null;
  const rows = table.map(
      ([words, before, after]) => html(
          'tr', {}, html('th', {scope: 'row'}, units(words)), both ? html('td', {}, units(before)) : null,
          html('td', {}, units(after))));
  return panel(
      'Figures',
      table.length ?
          html('div', {class: 'wide'}, html('table', {class: both ? 'figures' : 'figures single'}, head, html('tbody', {}, rows))) :
          null,
      lines.length ? html(
                         'dl', {class: 'lines'},
                         lines.map(([words, value]) => [html('dt', {}, units(words)), html('dd', {}, units(value))]).flat()) :
                     null,
      told.asked ? html('p', {class: 'fine'}, `Held to: ${units(told.asked)}.`) : null);
}

function checks({told, view}) {
  if (!told.criteria.length) return null;
  const ordered = [...told.criteria.filter(c => !c.pass), ...told.criteria.filter(c => c.pass)];
  return panel(
      'What was checked',
      html(
          'ul', {class: 'checks'},
          ordered.map(
              c => html(
                  'li', {class: c.pass ? 'good' : 'bad'},
                  html(
                      'span', {class: 'sign', role: 'img', 'aria-label': c.pass ? 'met' : 'not met'}, c.pass ? '\u2713' : '\u2715'),
                  html(
                      'span', {}, plainWords(c, view.attitudes),
                      html('small', {}, units(`${c.words}: ${c.value} (${c.bound} ${c.limit})`)))))));
}

function proof({told}) {
  if (!told.proof?.length) return null;
  return panel('Certificate', told.proof.map(sentence => html('p', {}, units(sentence[0].toUpperCase() + sentence.slice(1)))));
}

function notes({told, report}) {
  const all = [...told.notes, ...report.input.notes];
  return all.length ? panel('Notes', html('ul', {class: 'notes'}, all.map(note => html('li', {}, units(note))))) : null;
}

function printed({told}) {
  if (!told.printed) return null;
  return panel(
      'What a printer lays down',
      told.printed.trim().split('\n').map(line => html('p', {}, units(line.trim().replace(/^note: /, '')))));
}

function printing({told}) {
  if (!told.print) return null;
  const text = told.print.replace(/\s+/g, ' ').replace(/^To print: /, '').trim();
  const named = /^[^ ]*[./]/.test(text);  // begins with the name of a file
  return panel('To print', html('p', {class: 'print'}, named ? text : units(text[0].toUpperCase() + text.slice(1))));
}

function options({report}) {
  const rows = Object.entries(report.options ?? {});
  const files = [
    ['mesh', report.input.path], ['judged', report.print?.path], ['written', report.output?.path], ['put in', report.insert?.path],
    ['outside', report.outside?.path]
  ].filter(([, path]) => path);
  const row = ([name, value]) => html('tr', {}, html('th', {scope: 'row'}, name), html('td', {}, html('bdi', {}, value)));
  return panel(
      'Options and files', html('div', {class: 'wide'}, html('table', {class: 'options'}, html('tbody', {}, files.map(row)))),
      rows.length ? html(
                        'details', {}, html('summary', {}, `All ${rows.length} options that were in force`),
                        html('div', {class: 'wide'}, html('table', {class: 'options'}, html('tbody', {}, rows.map(row))))) :
                    null);
}

/** Charts of the attitude that is shown; drawn again for another width. */
export function chartsOf(data, attitude, width) {
  const after = numbersOf(data), before = data.report.solver ? data.report.before ?? {} : {};
  const of = name => after[attitude.prefix + name], was = name => before[attitude.prefix + name];
  return [
    [
      'How it rights itself', rightingChart(of, width),
      'The arm at which weight and buoyancy turn it back. Heeled while it is positive, it comes back.'
    ],
    [
      'Its foot, from above', supportChart(of, was, width),
      (data.report.solver ? 'Filled: its centre of mass; hollow: that of the solid. ' : 'The dot is its centre of mass. ') +
          (of('support_polygon_mm')?.length > 2 ? 'It tips first over the edge in red.' : 'Green: all that touches the ground.')
    ],
    ['Stable speeds', speedChart(of, width), 'Where a small tilt does not grow. A tip that slides is one on a smooth table.']
  ].filter(([, chart]) => chart)
      .map(([title, chart, words]) => panel(title, chart, html('p', {class: 'fine'}, words)));
}

/** Where Studio and the page put charts, and all the rest. */
export function panelsOf(data) {
  const charts = html('div', {class: 'charts'});
  const list = [printing(data), printed(data), charts, figures(data), checks(data), proof(data), notes(data), options(data)];
  return {charts, panels: list.filter(Boolean)};
}
