// What criteria mean, in a maker's words: met, and not met. Those that are not here are told in the words of the judge.

const kAny = {
  closed: ['The surface is closed and faces the right way.', 'The surface has holes or faces the wrong way.'],
  outer_unchanged: ['The outside is exactly the one you gave.', 'The outside is not the one you gave.'],
  no_islands: ['No material lies loose inside a cavity.', 'Material lies loose inside a cavity: it cannot be printed there.'],
  no_crossings: ['No inner surface runs into another.', 'Inner surfaces run into others, or are there twice.'],
  wall: ['The wall is nowhere thinner than asked for.', 'The wall is thinner somewhere than asked for.'],
  trapped_resin: ['No liquid resin stays inside.', 'Liquid resin stays shut in.'],
  mass_error: ['It weighs what it displaces at its waterline.', 'It does not weigh what it displaces at this waterline.'],
  metacentric_height: ['A small tilt is righted.', 'A small tilt is not righted: it turns over.'],
  afloat: ['It floats.', 'It sinks: it weighs more than it displaces wholly under water.'],
  settled_tilt: ['Let go tilted, it comes back upright.', 'Let go tilted, it does not come back upright.'],
  reserve:
      ['It still does with 1 % more plastic, as prints often have.', 'With 1 % more plastic, as prints often have, it does not.'],
  inserts_fit: ['What is put in has room.', 'What is put in has no room.'],
  supported: ['It touches the ground in an area.', 'It touches the ground only in a point or an edge.'],
  inside: ['Its centre of mass lies over its foot.', 'Its centre of mass does not lie over its foot: it falls.'],
  most_mass: ['It is no heavier than allowed.', 'It is heavier than allowed.'],
  centre: ['Its centre of mass lies in the middle of the yo-yo.', 'Its centre of mass does not lie in the middle of the yo-yo.'],
  axis_angle: ['It is balanced about its axis.', 'It is not balanced about its axis: it wobbles.'],
  axis_class:
      ['Its weight lies around the axis as a steady spin needs it.', 'Its weight lies around the axis as in a body that tumbles.'],
  stable_speeds: ['There are speeds at which it spins steadily.', 'There is no speed at which it spins steadily.'],
  simulated_tilt: ['Spun and kicked in a simulation, it stays upright.', 'Spun and kicked in a simulation, it leans over.'],
  hinge_balance: [
    'What turns on the hinge stays where it is left.',
    'What turns on the hinge does not stay where it is left: its centre of mass lies beside it.'
  ],
  hangs: ['It hangs straight.', 'It does not hang straight.'],
  righted: ['It rights itself from wherever it is let go.', 'It does not right itself from everywhere.'],
  faces: ['It comes to rest on all the faces wanted.', 'It does not come to rest on as many faces as wanted.'],
  fairness: ['Its faces come up equally often, as far as asked for.', 'Some faces come up more often than others.'],
  load: ['The loaded face comes up as often as wanted.', 'The loaded face does not come up as often as wanted.'],
  least_tip: ['It stands in all poses at least as safely as asked for.', 'It does not stand in all poses as safely as asked for.']
};

const kOffset = {
  floats:
      ['Weight and buoyancy act on one vertical: it floats level.', 'Weight and buoyancy do not act on one vertical: it heels.'],
  spins: ['Its centre of mass lies on the axis.', 'Its centre of mass does not lie on the axis.'],
  stands: ['Its centre of mass lies over its target.', 'Its centre of mass does not lie over its target.']
};

/** @param attitudes  of the view: what the body does in each pose */
export function plainWords({name, words, pass}, attitudes) {
  const [, pose, rest] = /^(?:pose_(\d+)_)?(.*)$/.exec(name);
  const kind = attitudes[pose ? pose - 1 : 0]?.kind;
  const known = rest === 'offset' ? kOffset[kind] : kAny[rest];
  const sentence = known ? known[pass ? 0 : 1] : words[0].toUpperCase() + words.slice(1) + (pass ? '.' : ': not met.');
  return pose && known ? `Pose ${pose}: ${sentence}` : sentence;
}

const kRaised = {
  '-': '\u207b',
  0: '\u2070',
  1: '\u00b9',
  2: '\u00b2',
  3: '\u00b3',
  4: '\u2074',
  5: '\u2075',
  6: '\u2076',
  7: '\u2077',
  8: '\u2078',
  9: '\u2079'
};
const raised = digits => [...digits].map(digit => kRaised[digit]).join('');

/** "mm3" and "1.00e-03" as people write them. */
export const units = text =>
    text.replace(/\b(mm|cm)([234])\b/g, (_, unit, power) => unit + raised(power))
        .replace(/(^|[\s(])-(?=\d)/g, '$1\u2212')
        .replace(
            /\b(\d+(?:\.\d+)?)e([+-]\d+)\b/g,
            (_, number, power) => +power ? `${number}\u00a0\u00d7\u00a010${raised(`${+ power}`)}` : number);

/** At most `digits` after the point, with a minus sign of its own. */
export const short = (x, digits = 2) =>
    Number.isFinite(x) ? x.toFixed(digits).replace(/^-(0\.?0*)$/, '$1').replace('-', '\u2212') : '\u2013';
export const degrees = (rad, digits = 1) => `${short(rad * 180 / Math.PI, digits)}\u00b0`;
export const place = p => p.map(x => short(x)).join(', ');
