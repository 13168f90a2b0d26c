// Points, lines and their labels over the view, as sharp as text.

const kSpace = 'http://www.w3.org/2000/svg';

export function svg(name, attributes = {}, ...children) {
  const element = document.createElementNS(kSpace, name);
  for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, value);
  element.append(...children);
  return element;
}

/**
 * What is drawn over the view:
 *   {group, kind: 'point', symbol, at, label}
 *   {group, kind: 'line', from, to, label}
 *   {group, kind: 'area', corners}
 * A group is a name by which it is styled and hidden.
 */
export class Overlay {
  constructor(root) {
    this.root = root;
    this.items = [];
    this.hidden = new Set();
  }

  show(items) {
    this.items = items.map(item => {
      const mark = item.kind === 'point' ? symbol(item.symbol) : svg(item.kind === 'line' ? 'line' : 'polygon');
      mark.classList.add('mark', item.group, item.kind);
      const label = item.label ? svg('text', {class: `label ${item.group}`, 'dominant-baseline': 'central'}, item.label) : null;
      return {...item, mark, labelMark: label};
    });
    this.root.replaceChildren(...this.items.map(item => item.mark), ...this.items.flatMap(item => item.labelMark || []));
  }

  hide(group, hidden) {
    if (hidden)
      this.hidden.add(group);
    else
      this.hidden.delete(group);
  }

  /** @param project  brings a point of the body to pixels */
  draw(project, width, height) {
    this.root.setAttribute('viewBox', `0 0 ${width} ${height}`);
    const labels = [];
    for (const item of this.items) {
      const off = this.hidden.has(item.group);
      item.mark.toggleAttribute('hidden', off);
      if (item.labelMark) item.labelMark.toggleAttribute('hidden', off);
      if (off) continue;
      const [x, y] = place(item, project);
      if (item.labelMark) labels.push({item, x: x + (item.kind === 'point' ? 13 : 6), y: item.group === 'tip' ? y + 16 : y});
    }
    spread(labels, height);
    for (const {item, x, y} of labels) {
      const room = 7.2 * item.label.length;
      const flipped = x + room > width - 4 && x > room;
      item.labelMark.setAttribute('x', flipped ? x - (item.kind === 'point' ? 26 : 12) : x);
      item.labelMark.setAttribute('y', y);
      item.labelMark.setAttribute('text-anchor', flipped ? 'end' : 'start');
    }
  }
}

/** Puts a mark where it belongs. @returns where its label goes */
function place(item, project) {
  if (item.kind === 'point') {
    const at = project(item.at);
    item.mark.setAttribute('transform', `translate(${at[0].toFixed(2)} ${at[1].toFixed(2)})`);
    return at;
  }
  if (item.kind === 'area') {
    item.mark.setAttribute('points', item.corners.map(p => project(p).map(n => n.toFixed(2)).join(',')).join(' '));
    return project(item.corners[0]);
  }
  const from = project(item.from), to = project(item.to);
  for (const [key, value] of [['x1', from[0]], ['y1', from[1]], ['x2', to[0]], ['y2', to[1]]])
    item.mark.setAttribute(key, value.toFixed(2));
  return to;
}

/** Moves labels that would lie on each other apart. */
function spread(labels, height) {
  const line = 17;
  labels.sort((a, b) => a.y - b.y);
  for (let round = 0; round < 12; ++round)
    for (let n = 1; n < labels.length; ++n)
      for (let m = 0; m < n; ++m) {
        const a = labels[m], b = labels[n];
        const wide = 7.5 * Math.max(a.item.label.length, b.item.label.length) + 8;
        const more = line - (b.y - a.y);
        if (more <= 0 || Math.abs(a.x - b.x) > wide) continue;
        a.y -= more / 2;
        b.y += more / 2;
      }
  for (const label of labels) label.y = Math.max(10, Math.min(height - 10, label.y));
}

/** A mark of a point, about the origin. */
export function symbol(name) {
  const dot = (attributes, ...more) => svg('g', {}, svg('circle', attributes), ...more);
  switch (name) {
    case 'mass':  // as engineers mark centres of mass
      return dot(
          {r: 7, class: 'paper'}, svg('path', {d: 'M0 0V-7A7 7 0 0 1 7 0ZM0 0V7A7 7 0 0 1-7 0Z', class: 'ink'}),
          svg('circle', {r: 7, class: 'ring'}));
    case 'before':
      return dot({r: 5.5, class: 'hollow'});
    case 'buoyancy':
      return dot({r: 5.5, class: 'full'});
    case 'metacentre':
      return svg('g', {}, svg('path', {d: 'M0 -7 6.5 5H-6.5Z', class: 'full'}));
    case 'foot':
      return svg('g', {}, svg('path', {d: 'M-5 -5 5 5M-5 5 5 -5', class: 'cross'}));
    case 'contact':
      return dot({r: 4.5, class: 'full'});
    case 'mark':
      return dot({r: 9, class: 'hollow'}, svg('circle', {r: 2, class: 'full'}));
    default:
      return dot({r: 4, class: 'full'});
  }
}
