// What the studio has to say: what is wrong, what it found, how far a run is, what there is to download.

import {button, html, verdictOf} from './panels.js';
import {plainWords, units} from './words.js';

const kParts = ['busy', 'refusal', 'holes', 'hint', 'answer', 'solving', 'downloads', 'note', 'notes'];

export class Status {
  constructor({run, cancel, repair}) {
    this.repair = repair;
    this.auto = html('input', {type: 'checkbox', checked: true});
    this.runButton = button('Make it', run, {class: 'main'});
    this.bar = html('progress', {max: 1, 'aria-label': 'Progress'});
    this.progressWords = html('p', {class: 'progress-words'});
    this.progress = html('div', {class: 'progress'}, this.bar, this.progressWords, button('Cancel', cancel));
    this.runBar = html('div', {class: 'run'}, this.runButton, html('label', {}, this.auto, 'make it whenever I let go'));
    this.parts = Object.fromEntries(kParts.map(name => [name, html('div', {class: 'part'})]));
    this.shared = html('div', {class: 'shared'});
    this.element = html(
        'section', {class: 'status', 'aria-label': 'Answer'}, Object.values(this.parts), this.progress, this.runBar, this.shared);
  }

  /**
   * @param of  loading (a file's name), refusal and its words, hint, mesh, repairs (holes are closed), ready (there is a mesh and a
   *     goal), last (a full run, where it is one of what is chosen), preview (else), current (that is of what is chosen), note,
   *     running
   */
  show({loading, refusal, words, hint, mesh, repairs, ready, last, preview, current, note, running}) {
    const old = Boolean(refusal) && !current;
    const answer = last ?? preview;
    const notes = mesh?.summary.notes;
    this.fill('busy', loading, () => html('p', {class: 'busy'}, 'Reading ', html('bdi', {}, loading), ' \u2026'));
    this.fill('refusal', refusal, () => refusalCard(words));
    this.fill('hint', hint, () => html('p', {class: 'hint'}, hint));
    this.fill(
        'answer', answer && `${answer.key} ${answer.sequence} ${old}`,
        () => last ? verdictOf(last.data) : previewCard(preview, old));
    this.fill('solving', ready && !answer && !refusal, () => html('p', {class: 'busy'}, 'Solving \u2026'));
    this.fill('downloads', last, () => downloads(last.files));
    this.fill('note', note, () => html('p', {class: 'note'}, note));
    const holes = mesh?.summary.refusal && !repairs ? mesh.summary : null;
    this.fill('holes', holes && (refusal ? holes.repairable && 'button' : 'words'), () => this.holesCard(holes, !refusal));
    this.fill('notes', notes?.length && mesh, () => html('ul', {class: 'note'}, notes.map(text => html('li', {}, units(text)))));
    this.element.classList.toggle('waiting', !current && !refusal);
    if (running) this.showProgress(running.told ?? {});
    this.progress.hidden = !running;
    this.runBar.hidden = !ready;
    this.runButton.hidden = Boolean(running || last);
  }

  /** A surface that is not closed. */
  holesCard({refusal, repairable}, inWords) {
    return html(
        'div', {class: inWords ? 'refusal' : ''}, inWords ? html('p', {}, units(refusal)) : null,
        repairable ? button('Close its holes, by a guess', this.repair) : null);
  }

  /** Made anew only where it is of something else: what has the focus keeps it. */
  fill(name, of, make) {
    const part = this.parts[name];
    if (part.of === of) return;
    part.of = of;
    part.replaceChildren(...(of ? [make()] : []));
  }

  showProgress({stage, share, left_s}) {
    if (Number.isFinite(share))
      this.bar.value = share;
    else
      this.bar.removeAttribute('value');
    this.progressWords.textContent = [
      stage || 'Making it', Number.isFinite(share) ? `${Math.round(100 * share)}\u00a0%` : '',
      Number.isFinite(left_s) && left_s >= 1 ? `about ${Math.ceil(left_s)}\u00a0s left` : ''
    ].filter(Boolean).join(' \u00b7 ');
  }
}

function refusalCard(words) {
  return html('div', {class: 'refusal', role: 'alert'}, words.split('\n').filter(Boolean).map(line => html('p', {}, units(line))));
}

function previewCard({told, criteria, rows, data}, old) {
  const [first, ...more] = told;
  const failed = criteria.filter(criterion => !criterion.pass);
  return html(
      'div', {class: old ? 'preview old' : 'preview'},
      html('p', {class: 'word'}, old ? 'ANSWER TO OLDER SETTINGS' : 'PREVIEW, NOT VERIFIED'),
      first ? html('p', {class: 'lead'}, units(first)) : null, more.map(line => html('p', {class: 'more'}, units(line))),
      failed.length ? html('ul', {class: 'doubts'}, failed.map(one => html('li', {}, plainWords(one, data.view.attitudes)))) : null,
      html(
          'table', {class: 'figures'},
          html(
              'tbody', {},
              rows.table.map(
                  ([words, , value]) => html('tr', {}, html('th', {scope: 'row'}, units(words)), html('td', {}, units(value)))))));
}

export function downloads(files) {
  const [first, ...others] =
      files.map(({name, words}) => [{href: `download/${encodeURIComponent(name)}`, download: name}, name, words]);
  if (!first) return '';
  const item = ([attributes, name, words], look, before) =>
      html('li', {}, html('a', {...attributes, ...look}, before, name), html('small', {}, words));
  return html('ul', {class: 'downloads'}, item(first, {class: 'main'}, 'Download '), others.map(file => item(file, {}, '')));
}
