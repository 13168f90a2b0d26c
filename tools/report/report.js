// The page of a run: puts verdict, view and panels together. `mount` may be called again with what a new run has told.

import {chartsOf, html, panelsOf, verdictOf} from './panels.js';
import {Stage} from './stage.js';

/**
 * @param root    where it goes; what was there goes away
 * @param data    see README.md
 * @param meshes  {positions, triangles} by id
 * @returns the view
 */
export function mount(root, data, meshes) {
  const {charts, panels} = panelsOf(data);
  const stage = new Stage();
  root.replaceChildren(
      verdictOf(data), html('main', {}, stage.element, html('div', {class: 'panels'}, panels)), footer(data.report.version));
  new Charts(charts).follow(stage, data);
  stage.show(data, meshes);
  return stage;
}

/** Charts of the attitude that is looked at, as wide as there is room. */
export class Charts {
  constructor(element) {
    this.element = element;
  }

  follow(stage, data) {
    stage.looksAt = attitude => {
      this.attitude = attitude;
      this.draw(data, true);
    };
    new ResizeObserver(() => this.draw(data)).observe(this.element.parentElement);
  }

  draw(data, anew) {
    const width = Math.floor(this.element.parentElement?.clientWidth ?? 0) - 34;
    if (!this.attitude || width < 60 || (!anew && width === this.width)) return;
    this.width = width;
    this.element.replaceChildren(...chartsOf(data, this.attitude, width));
  }
}

export function footer(version) {
  return html(
      'footer', {},
      html(
          'p', {}, `rayrep ${version}. Nothing on this page was loaded from elsewhere. The 3D view is drawn with three.js, `,
          '\u00a9 2010\u20132026 three.js authors, MIT License (its text is in this file).'));
}
