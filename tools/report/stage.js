// The view with its controls and its legend. `show` may be called again, with other bodies or with the same ones.

import {canDraw} from './canvas_view.js';
import {dot, plus} from './geometry.js';
import {marksOf, placed} from './marks.js';
import {Overlay, svg, symbol} from './overlay.js';
import {html} from './panels.js';
import {sectionPicture} from './section.js';
import {View} from './view.js';

import {short, units} from './words.js';

const kColors =
    ['shell', 'cap', 'cap-hatch', 'void', 'sparse', 'sparse-hatch', 'insert', 'insert-hatch', 'water', 'ground', 'outline'];
const kBodies = {
  shell: 'Outside',
  cavity: 'Cavities',
  sparse: 'Printed sparsely',
  insert: 'Put in',
  plug: 'Plug'
};
const kAxes = ['x', 'y', 'z'];

/** As an entry of a legend has it in front of its words. */
export function legendSign({group, symbol: mark, swatch}) {
  const area = {water: 'water', ground: 'ground', support: 'support'}[mark] ?? swatch;
  if (area) return html('span', {class: `swatch ${area}`});
  const isLine = ['axes', 'spin', 'tip', 'hinge'].includes(mark);
  return svg(
      'svg', {viewBox: '-10 -10 20 20', class: 'sign'},
      isLine ? svg('line', {x1: -9, y1: 0, x2: 9, y2: 0, class: `mark line ${mark}`}) :
               svg('g', {class: `mark ${group} point`}, symbol(mark)));
}

export class Stage {
  /** @param fold  whether controls and legend can be folded away, and are where there is little room */
  constructor({fold = false} = {}) {
    this.drawsInSpace = canDraw(document);
    this.choices = new Map();  // of the legend, as the reader has made them
    this.drawn = [];           // called with each drawing
    this.looksAt = () => {};   // called with the attitude that is shown
    this.build(fold);
  }

  /**
   * @param data    see README.md
   * @param meshes  {positions, triangles} by id
   * @param camera  'home': as it is first; 'keep': from where it was, with up upright; 'hold': exactly as it was
   */
  show(data, meshes, camera = 'home') {
    this.data = data;
    this.bodies = data.view.meshes.map(info => ({...info, mesh: meshes.get(info.id)}));
    this.radius = 0.5 * Math.hypot(...data.view.size_mm);
    this.attitudes = data.view.attitudes.map(placed);
    if (this.view && !this.glassChosen) {
      this.view.glass = this.bodies.length > 1 ? 0.16 : 0.75;  // there is nothing to be seen in it
      this.glass.value = 100 * this.view.glass;
    }
    this.buildPoses();
    this.fine.textContent = data.view.note ?? this.rounding();
    this.view?.show(this.bodies);
    this.place(this.attitudes[this.pose] ?? this.attitudes[0], camera);
    if (!this.started) this.start();
  }

  /** @param attitude  as `placed` makes it */
  place(attitude, camera) {
    this.attitude = attitude;
    this.pose = Math.max(0, this.attitudes.findIndex(one => one.prefix === attitude.prefix));
    this.poseWords.textContent = this.attitudes.length > 1 ? `Pose ${this.pose + 1}: ${attitude.words}` : '';
    const {items, legend} = marksOf(this.data, attitude, this.radius);
    this.overlay.show(items);
    this.buildLegend(legend);
    this.view?.place(attitude, camera);
    this.looksAt(attitude);
    if (camera === 'home')
      this.chooseCut(this.axis);
    else
      this.cut();
  }

  // ------------------------------------------------------------------------------------------------------------------ building

  build(fold) {
    this.canvas = html('canvas', {
      tabindex: '0',
      role: 'application',
      'aria-label': 'The body in 3D. Arrow keys turn it, plus and minus zoom, Home brings back the first view.'
    });
    this.over = svg('svg', {class: 'overlay', 'aria-hidden': 'true'});
    this.overlay = new Overlay(this.over);
    this.stage = html('div', {class: 'stage'}, this.drawsInSpace ? this.canvas : null, this.over);
    this.legend = html('ul', {class: 'legend'});
    this.fine = html('p', {class: 'fine'});
    if (this.drawsInSpace) this.view = new View(this.canvas, project => this.draw(project, ...this.view.size));
    const warning = this.drawsInSpace ?
        null :
        html(
            'p', {class: 'warning', role: 'status'}, 'This browser does not draw in 3D here (WebGL 2 is missing or switched off). ',
            'Below is a section of the body; all figures are there as well.');
    const around = [this.controls(), this.legend, this.fine];
    this.element = html(
        'section', {class: 'look', 'aria-label': 'View'}, warning, this.stage,
        fold ? html('details', {class: 'around', open: innerWidth >= 960}, html('summary', {}, 'Cut, look, legend'), around) :
               around);
  }

  draw(project, width, height) {
    this.project = project;
    this.overlay.draw(project, width, height);
    for (const drawn of this.drawn) drawn(project, width, height);
  }

  rounding() {
    const {rounding_mm} = this.data.view;
    const coarse = this.bodies.filter(body => body.shown < body.triangles);
    const count = n => n.toLocaleString('en');
    return `The view is rounded: coordinates to ${rounding_mm < 1e-3 ? rounding_mm.toPrecision(1) : short(rounding_mm, 3)} mm` +
        coarse.map(body => `, ${kBodies[body.what].toLowerCase()} to ${count(body.shown)} of ${count(body.triangles)} triangles`)
            .join('') +
        '. The figures are those of the file itself.';
  }

  radios(name, words, choices, chosen, pick) {
    const inputs = choices.map(([value, label, says]) => {
      const input = html('input', {type: 'radio', name, value, checked: value === chosen, 'aria-label': says});
      input.addEventListener('change', () => pick(value));
      return html('label', {}, input, html('span', {}, label));
    });
    return html(
        'div', {class: 'choice', role: 'radiogroup', 'aria-label': words}, html('span', {class: 'name'}, words),
        html('div', {class: 'segments'}, inputs));
  }

  buildPoses() {
    const words = this.attitudes.map(attitude => attitude.words).join('\n');
    if (words === this.allPoses) return;
    this.allPoses = words;
    this.pose = 0;
    this.poses.replaceChildren(
        ...(this.attitudes.length > 1 ?
                [
                  this.radios(
                      'pose', 'Pose', this.attitudes.map((attitude, n) => [`${n}`, `${n + 1}`, `Pose ${n + 1}: ${attitude.words}`]),
                      '0', n => this.place(this.attitudes[+n], 'home')),
                  this.poseWords
                ] :
                []));
  }

  controls() {
    this.range = html('input', {type: 'range', min: 0, max: 200, step: 1, value: 100, 'aria-label': 'Position of the cut'});
    this.cutAt = html('output', {class: 'at'});
    this.flip = html('button', {type: 'button', class: 'plain'}, 'Other half');
    this.range.addEventListener('input', () => this.moveCut());
    this.flip.addEventListener('click', () => {
      this.flipped = !this.flipped;
      this.cut();
    });
    this.axis = this.drawsInSpace ? 'none' : 'y';
    const cuts =
        [['none', 'none', 'No cut'], ...kAxes.map(axis => [axis, axis, `Cut across ${axis}`])].slice(this.drawsInSpace ? 0 : 1);
    this.poses = html('div', {class: 'poses'});
    this.poseWords = html('p', {class: 'pose'});
    const looks = this.drawsInSpace ? html(
                                          'div', {class: 'choice'}, html('span', {class: 'name'}, 'Look'),
                                          html('div', {class: 'buttons'}, ['Home', 'Front', 'Side', 'Top'].map(from => {
                                            const button = html('button', {type: 'button', class: 'plain'}, from);
                                            button.addEventListener('click', () => this.lookFrom(from));
                                            return button;
                                          }))) :
                                      null;
    this.glass = html('input', {type: 'range', min: 0, max: 100, 'aria-label': 'How opaque the outside is'});
    this.glass.addEventListener('input', () => {
      this.glassChosen = true;
      this.view.glass = this.glass.value / 100;
      this.view.change();
    });
    return html(
        'div', {class: 'controls'}, this.poses,
        html(
            'div', {class: 'choice cut'}, this.radios('cut', 'Cut', cuts, this.axis, axis => this.chooseCut(axis)), this.range,
            this.cutAt, this.flip),
        looks,
        this.drawsInSpace ? html(
                                'label', {class: 'choice'}, html('span', {class: 'name'}, 'Outside'), this.glass,
                                html('small', {}, 'clear to solid')) :
                            null);
  }

  // --------------------------------------------------------------------------------------------------------------------- doing

  start() {
    this.started = true;
    const paint = () => {
      const style = getComputedStyle(document.documentElement);
      this.view?.paint(Object.fromEntries(kColors.map(name => [name, style.getPropertyValue(`--${name}`).trim()])));
    };
    matchMedia('(prefers-color-scheme: dark)').addEventListener('change', paint);
    paint();
    new ResizeObserver(() => this.fit()).observe(this.stage);
    this.fit();
  }

  /** Built anew only where it has other entries: what has the focus keeps it. */
  buildLegend(marks) {
    const bodies =
        this.bodies.filter((body, n, all) => all.findIndex(other => other.what === body.what && other.words === body.words) === n)
            .map(body => ({group: body.what, swatch: body.what, words: kBodies[body.what], value: units(body.words)}));
    const entries = [...bodies, ...marks].filter(({group}) => this.drawsInSpace || (group !== 'shell' && group !== 'cavity'));
    const key = entries.map(({group, words}) => `${group}:${words}`).join('\n');
    if (key !== this.legendKey) this.legend.replaceChildren(...entries.map(entry => this.legendEntry(entry)));
    this.legendKey = key;
    entries.forEach(({value}, n) => {
      const small = this.legend.children[n].querySelector('small');
      small.textContent = value;
      small.hidden = !value;
    });
  }

  legendEntry({group, symbol: mark, swatch, words, off}) {
    const box = html('input', {type: 'checkbox', checked: this.choices.get(group) ?? !off});
    const hide = () => {
      this.overlay.hide(group, !box.checked);
      this.view?.hide(group, !box.checked);
      if (!this.view) this.drawSection();
    };
    box.addEventListener('change', () => {
      this.choices.set(group, box.checked);
      hide();
    });
    hide();
    return html(
        'li', {},
        html('label', {}, box, legendSign({group, symbol: mark, swatch}), html('span', {class: 'words'}, words, html('small'))));
  }

  lookFrom(from) {
    const {orbit, home} = this.view;
    if (from === 'Home') return orbit.goHome();
    const quarter = Math.PI / 2;
    const [azimuth, elevation] = {Front: [-quarter, 0], Side: [0, 0], Top: [-quarter, quarter * 0.985]}[from];
    orbit.target = home.target.slice();
    orbit.turnTo(azimuth, elevation);
  }

  /** Cuts across an axis; of the two halves the one away from the viewer stays. */
  chooseCut(axis) {
    this.axis = axis;
    this.flip.disabled = axis === 'none';
    const n = kAxes.indexOf(axis);
    if (n >= 0 && this.view) this.flipped = this.view.orbit.pose().towards[n] < 0;
    this.cut();
  }

  /** Moving it begins a cut across what the viewer looks along. */
  moveCut() {
    if (this.axis !== 'none') return this.cut();
    const towards = this.view.orbit.pose().towards.map(Math.abs);
    const axis = kAxes[towards.indexOf(Math.max(...towards))];
    this.element.querySelector(`input[name=cut][value=${axis}]`).checked = true;
    this.chooseCut(axis);
  }

  cut() {
    const n = kAxes.indexOf(this.axis);
    const {low_mm, size_mm} = this.data.view;
    this.cutPlane = null;
    if (n >= 0) {
      const at = low_mm[n] + size_mm[n] * this.range.value / 200;
      const sign = this.flipped ? -1 : 1;
      this.cutPlane = {normal: [0, 1, 2].map(k => k === n ? sign : 0), offset: sign * at};
      this.cutAt.textContent = `${this.axis} = ${short(at)} mm`;
      this.range.setAttribute('aria-valuetext', this.cutAt.textContent);
    } else {
      this.cutAt.textContent = '';
    }
    this.view?.cut(this.cutPlane);
    if (!this.view) this.drawSection();
  }

  fit() {
    const {width, height} = this.stage.getBoundingClientRect();
    if (this.view)
      this.view.resize(Math.round(width), Math.round(height), devicePixelRatio);
    else
      this.drawSection();
  }

  /** Without WebGL. */
  drawSection() {
    const {width, height} = this.stage.getBoundingClientRect();
    if (!this.cutPlane || !width) return;
    const {normal} = this.cutPlane;
    const [right, front, up] = this.attitude.to_ground;
    const level = Math.abs(dot(normal, up)) > 0.7;
    const across = Math.abs(dot(normal, right)) > 0.7 ? front : right;
    const {picture, project} = sectionPicture(
        this.bodies.filter(body => !this.overlay.hidden.has(body.what)), this.cutPlane, {across, upwards: level ? front : up},
        [width, height]);
    this.draw(project, width, height);
    this.over.querySelector('.section')?.remove();
    picture.classList.add('section');
    const {waterline} = this.attitude;
    if (waterline !== null && !level && !this.overlay.hidden.has('water')) {
      const [, y] = project(up.map(n => n * waterline));
      picture.append(svg('line', {class: 'waterline', x1: 0, y1: y, x2: width, y2: y}));
    }
    this.over.prepend(picture);
  }
}
