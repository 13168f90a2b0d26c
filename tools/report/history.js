// What was chosen, and what was chosen before: every change is a step that can be taken back.

/** States are never changed: each step has one of its own. */
export class History {
  /** @param key  the same for states that are the same */
  constructor(first, key = keyOf) {
    this.key = key;
    this.states = [first];
    this.at = 0;
  }
  get now() {
    return this.states[this.at];
  }
  /** @returns whether it is another one than the last */
  step(state) {
    if (this.key(state) === this.key(this.now)) return false;
    this.states.splice(this.at + 1, Infinity, state);
    ++this.at;
    return true;
  }
  /** @param by  -1 or 1 @returns whether there is such a step */
  go(by) {
    if (!this.can(by)) return false;
    this.at += by;
    return true;
  }
  can(by) {
    return Boolean(this.states[this.at + by]);
  }
}

/** Of a setting that may be given several times: each has a line. */
export const linesOf = text => text.split('\n');

/** The same for states that ask for the same. */
export function keyOf({mesh, goal, settings}) {
  return JSON.stringify([mesh?.number ?? 0, goal, Object.entries(settings).sort()]);
}

/** As a shell reads it again. */
export function shellWord(word) {
  if (/^[\w@%+=:,./-]+$/.test(word)) return word;
  if (!/[\x00-\x1f\x7f]/.test(word)) return `'${word.replace(/'/g, `'\\''`)}'`;
  const code = c => `\\x${c.charCodeAt(0).toString(16).padStart(2, '0')}`;
  return `$'${word.replace(/[\\']/g, '\\$&').replace(/[\x00-\x1f\x7f]/g, code)}'`;
}

/** The command that does the same. */
export function commandOf({mesh, goal, settings}) {
  const file = /^-/.test(mesh.name) ? `./${mesh.name}` : mesh.name;
  const options = Object.entries(settings).flatMap(
      ([name, text]) => linesOf(text).map(line => line ? `--${name} ${shellWord(line)}` : `--${name}`));
  // A value that begins with - would be taken for an option.
  return ['rayrep', goal, shellWord(file), ...options.map(option => option.replace(/^(--[\w-]+) (-)/, '$1=$2'))].join(' ');
}

/** As --save-config writes it. */
export function configOf({mesh, settings}) {
  const value = text => text === '' ? true :
      text.includes('\n')           ? linesOf(text) :
      String(Number(text)) === text ? Number(text) :
                                      text;
  return {mesh: mesh.name, ...Object.fromEntries(Object.entries(settings).sort().map(([name, text]) => [name, value(text)]))};
}

/**
 * Of a file for --config: {mesh, settings}.
 * @param repeated  says of a setting whether it may be given several times
 * @throws Error that says what is wrong with it
 */
export function readConfig(text, name, repeated) {
  let object;
  try {
    object = JSON.parse(text);
  } catch (error) {
    throw new Error(`${name} is no JSON: ${error.message}.`);
  }
  if (!object || typeof object !== 'object' || Array.isArray(object))
    throw new Error(`${name} is no object of settings, like { "mesh": "bird.stl", "wall": 1.6 }.`);
  const textOf = value => value === null ? '-' :
      Array.isArray(value)               ? value.map(textOf).join(',') :
      typeof value === 'object'          ? Object.entries(value).map(([key, part]) => `${key}=${textOf(part)}`).join(',') :
                                           `${value}`;
  const {mesh, ...rest} = object;
  const said = Object.entries(rest).filter(([, value]) => value !== false && value !== null);
  const several = (key, value) => repeated(key) && Array.isArray(value) && !value.every(Number.isFinite);
  const allOf = (key, value) => value === true ? '' : several(key, value) ? value.map(textOf).join('\n') : textOf(value);
  return {mesh, settings: Object.fromEntries(said.map(([key, value]) => [key, allOf(key, value)]))};
}
