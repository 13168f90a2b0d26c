// What an edit did elsewhere: collisions that were not there before, or last longer.

const overlaps = pair => pair?.intervals.filter(({kind}) => kind === 'overlap') ?? [];
const meet = (a, b) => a.from <= b.to && b.from <= a.to;
export const samePair = (a, b) => a.transition === b.transition && a.first === b.first && a.second === b.second;

/**
 * The one to look at first: new ones before those that last longer than they did, of each the longest.
 * @param before, after  pairs as they were found
 * @returns {pair, interval, kind: 'new' or 'longer'}, or null
 */
export function sideEffect(before, after, tolerance) {
  const found = [];
  for (const pair of after) {
    const earlier = overlaps(before.find(other => samePair(pair, other)));
    pair.intervals.forEach((one, interval) => {
      if (one.kind !== 'overlap') return;
      const met = earlier.filter(other => meet(one, other));
      const begin = Math.min(...met.map(({from}) => from)), end = Math.max(...met.map(({to}) => to));
      const grown = met.length ? Math.max(0, begin - one.from) + Math.max(0, one.to - end) : 0;
      if (!met.length)
        found.push({pair, interval, kind: 'new', rank: 1, long: one.to - one.from});
      else if (grown > 2 * tolerance)
        found.push({pair, interval, kind: 'longer', rank: 0, long: grown});
    });
  }
  found.sort((a, b) => b.rank - a.rank || b.long - a.long);
  return found[0] ?? null;
}

/** The same collision in what was found later, or null when it is gone. */
export function stillThere({pair, interval, kind}, after) {
  const one = pair.intervals[interval];
  const now = after.find(other => samePair(pair, other));
  const n = now ? now.intervals.findIndex(other => other.kind === 'overlap' && meet(one, other)) : -1;
  return n < 0 ? null : {pair: now, interval: n, kind};
}
