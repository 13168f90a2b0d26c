// The time of a way, and on it when parts are not clear of each other.

import {html} from './panels.js';

const kStep = 0.01;
export const percent = (share, digits = 1) => `${(100 * share).toFixed(digits)} %`;
export const kKinds = {
  overlap: 'overlap',
  contact: 'touch',
  undecided: 'are not looked at closely yet'
};

const placed = (element, from, to = from) => {
  element.style.setProperty('--from', `${100 * from}%`);
  element.style.setProperty('--long', `${100 * (to - from)}%`);
  return element;
};

export class Timeline {
  /**
   * @param names    of the parts
   * @param actions  time(share): it was moved there; choose(pair, interval)
   */
  constructor(names, actions) {
    this.names = names;
    this.actions = actions;
    this.ruler = html(
        'div',
        {class: 'track ruler', role: 'slider', tabindex: '0', 'aria-label': 'Time', 'aria-valuemin': '0', 'aria-valuemax': '100'},
        [0, 0.25, 0.5, 0.75, 1].map(at => placed(html('span', {class: 'tick'}, `${100 * at}`), at)));
    this.rows = html('div', {class: 'rows'});
    this.more = html('div', {class: 'rows keys'});
    this.clear = html('p', {class: 'fine'});
    this.second = html('div', {class: 'marker second', hidden: true});
    const over = html('div', {class: 'over-tracks', 'aria-hidden': 'true'}, this.second, html('div', {class: 'marker'}));
    this.element = html(
        'div', {class: 'timeline'},
        html('div', {class: 'with-marker'}, this.row(html('span', {}, 'Time, %'), this.ruler), this.rows, this.more, over),
        this.clear);
    this.scrubs(this.ruler);
    this.ruler.addEventListener('keydown', event => this.key(event));
  }

  row(label, track) {
    return html('div', {class: 'row'}, html('div', {class: 'name'}, label), track);
  }

  setTime(time) {
    this.time = time;
    this.element.style.setProperty('--at', time);
    this.ruler.setAttribute('aria-valuenow', (100 * time).toFixed(1));
    this.ruler.setAttribute('aria-valuetext', percent(time));
  }

  /** Another marker, of the picture in the corner. @param time  null: none */
  setSecond(time) {
    this.second.hidden = time === null;
    if (time !== null) this.second.style.setProperty('--at', time);
  }

  /**
   * @param pairs   {first, second, intervals} of the way that is shown
   * @param chosen  {pair, interval} or null
   */
  show(pairs, chosen) {
    const told = pairs.filter(pair => pair.intervals.length);
    const focused = this.rows.contains(document.activeElement) ? document.activeElement.dataset.place : null;
    this.rows.replaceChildren(...told.map(pair => {
      const track = html('div', {class: 'track'}, pair.intervals.map((interval, n) => this.interval(pair, n, chosen)));
      this.scrubs(track);
      return this.row(html('span', {}, `${this.names[pair.first]} \u00b7 ${this.names[pair.second]}`), track);
    }));
    if (focused) this.rows.querySelector(`[data-place="${focused}"]`)?.focus({preventScroll: true});
    const clear = pairs.length - told.length;
    this.clear.textContent = !pairs.length ? 'No pair of parts is tested on this way.' :
        clear ? `${clear === 1 ? '1 pair is' : `${clear} pairs are`} clear of each other all the way.` :
                                 '';
  }

  interval(pair, n, chosen) {
    const {kind, from, to, worst} = pair.intervals[n];
    const words = `${this.names[pair.first]} and ${this.names[pair.second]} ${kKinds[kind]}, ${percent(from)} to ${percent(to)}` +
        (worst ? `, worst at ${percent(worst.time)}` : '');
    const here = chosen && chosen.pair === pair && chosen.interval === n;
    const element = html('button', {
      type: 'button',
      class: `interval ${kind}${here ? ' now' : ''}`,
      title: words,
      'aria-label': words,
      'aria-pressed': `${Boolean(here)}`,
      'data-place': `${pair.first}-${pair.second}-${n}`
    });
    element.addEventListener('click', () => this.actions.choose(pair, n));
    return placed(element, from, to);
  }

  shareAt(event, track) {
    const {left, width} = track.getBoundingClientRect();
    return Math.max(0, Math.min(1, (event.clientX - left) / width));
  }

  /** A track that takes the pointer moves the time with it. */
  scrubs(track) {
    track.addEventListener('pointerdown', event => {
      if (event.target.closest('button') || event.button) return;
      track.setPointerCapture(event.pointerId);
      this.actions.time(this.shareAt(event, track));
    });
    track.addEventListener(
        'pointermove', event => track.hasPointerCapture(event.pointerId) && this.actions.time(this.shareAt(event, track)));
  }

  key(event) {
    if (event.altKey || event.ctrlKey || event.metaKey) return;
    const step = event.shiftKey ? 10 * kStep : kStep;
    const to = {
      ArrowRight: this.time + step,
      ArrowUp: this.time + step,
      ArrowLeft: this.time - step,
      ArrowDown: this.time - step,
      PageUp: this.time + 10 * kStep,
      PageDown: this.time - 10 * kStep,
      Home: 0,
      End: 1
    }[event.key];
    if (to === undefined) return;
    event.preventDefault();
    this.actions.time(Math.max(0, Math.min(1, to)));
  }

  // ---------------------------------------------------------------------------------------------------------------------- keys

  /**
   * @param rows     {part, kind, words, keys}: of each the times
   * @param chosen   {part, kind, number} or null
   * @param actions  choose({part, kind, number}), move(key, time, held), add(part, kind), remove(key)
   */
  showKeys(rows, chosen, actions) {
    this.keyActions = actions;
    const names = rows.map(({part, kind}) => `${part}-${kind}`).join();
    const counts = `${names}:${rows.map(({keys}) => keys.length).join()}`;
    if (counts !== this.keyCounts) this.buildKeys(rows);
    this.keyCounts = counts;
    rows.forEach(({part, kind, keys}, r) => keys.forEach((time, number) => {
      const element = this.keyElements[r][number];
      placed(element, time);
      const now = chosen?.part === part && chosen.kind === kind && chosen.number === number;
      element.classList.toggle('now', now);
      element.setAttribute('aria-pressed', `${now}`);
      element.setAttribute('aria-label', `${rows[r].words}: key ${number + 1} at ${percent(time)}`);
    }));
  }

  buildKeys(rows) {
    const focused = this.more.contains(document.activeElement) ? document.activeElement.dataset.place : null;
    this.keyElements = rows.map(({part, kind, keys}) => keys.map((_, number) => this.keyOf({part, kind, number}, keys.length)));
    this.more.replaceChildren(...rows.map(({part, kind, words}, r) => {
      const add = html(
          'button', {
            type: 'button',
            class: 'plain small',
            title: `${words}: a key at the time that is shown`,
            'aria-label': `${words}: add a key`
          },
          '+');
      add.addEventListener('click', () => this.keyActions.add(part, kind));
      const track = html('div', {class: 'track'}, this.keyElements[r]);
      this.scrubs(track);
      return this.row([html('span', {}, words), add], track);
    }));
    if (focused) this.more.querySelector(`[data-place="${focused}"]`)?.focus({preventScroll: true});
  }

  keyOf(key, count) {
    const fixed = key.number === 0 || key.number === count - 1;  // of the states
    const element = html('button', {
      type: 'button',
      class: `key ${key.kind}${fixed ? ' fixed' : ''}`,
      title: fixed ? 'The pose of a state' : 'Drag it; Delete removes it',
      'data-place': `${key.part}-${key.kind}-${key.number}`
    });
    element.addEventListener('click', () => this.keyActions.choose(key));
    if (fixed) return element;
    element.addEventListener('keydown', event => {
      if (event.key === 'Delete' || event.key === 'Backspace') this.keyActions.remove(key);
      const by = {ArrowLeft: -kStep, ArrowRight: kStep}[event.key];
      if (by) this.keyActions.move(key, this.keyActions.timeOf(key) + (event.shiftKey ? 10 : 1) * by, false);
      if (by || event.key === 'Delete' || event.key === 'Backspace') event.preventDefault();
    });
    element.addEventListener('pointerdown', event => {
      if (event.button) return;
      element.setPointerCapture(event.pointerId);
      this.keyActions.choose(key);
    });
    const drag = (event, held) => this.keyActions.move(key, this.shareAt(event, element.parentElement), held);
    element.addEventListener('pointermove', event => {
      if (!element.hasPointerCapture(event.pointerId)) return;
      element.dragged = true;
      drag(event, true);
    });
    element.addEventListener('pointerup', event => {
      if (element.dragged) drag(event, false);
      element.dragged = false;
    });
    return element;
  }
}
