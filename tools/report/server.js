// What the page asks of `rayrep studio`: see README.md.

import {bytesOf, unpack} from './data.js';
import {linesOf} from './history.js';

/** What the server refused: `kind` and `message` of the command. */
export class Refusal extends Error {
  constructor({kind, message, setting}, status = 0) {
    super(message);
    this.kind = kind;
    this.status = status;
    this.setting = setting;
  }
}

async function ask(path, options) {
  let answer;
  try {
    answer = await fetch(path, {cache: 'no-store', ...options});
  } catch (error) {
    if (error.name === 'AbortError') throw new Refusal({kind: 'superseded', message: ''});
    throw new Refusal(
        {kind: 'gone', message: 'rayrep studio does not answer: it was ended, or the connection was. Start it again.'});
  }
  if (answer.ok) return answer;
  const told = await answer.json().catch(() => null);
  throw new Refusal(
      told?.error ?? {kind: 'server', message: `rayrep studio answered with ${answer.status} to ${path}.`}, answer.status);
}

function wantedOf({goal, settings}) {
  const value = text => text.includes('\n') ? linesOf(text) : text;
  return {goal, settings: Object.fromEntries(Object.entries(settings).map(([name, text]) => [name, value(text)]))};
}

function refusalOr(error) {
  if (error instanceof Refusal) return error;
  throw error;
}

const posted = async (path, what, options) => (await ask(path, {method: 'POST', body: JSON.stringify(what), ...options})).json();

/** Meshes by id, of the blocks of an answer. */
const meshesIn = ({view, blocks}) => new Map(view.meshes.map(({id}) => [id, unpack(bytesOf(blocks[id]), view)]));

let meshes = 0;

/** A mesh that was loaded, to be worked on. @param file  what it was loaded from; null: by the server itself */
export function meshOf(answer, file) {
  return {...answer, number: ++meshes, file, meshes: meshesIn(answer)};
}

export async function sendMesh(file, name) {
  const answer = await ask(`mesh?name=${encodeURIComponent(name)}`, {method: 'POST', body: file});
  return answer.json();
}

/** The file that the server began with. */
export const firstFile = async () => (await ask('mesh')).blob();

/** Lines of JSON as they come. @throws Refusal of a line that is one */
async function eachLine(answer, told) {
  const reader = answer.body.pipeThrough(new TextDecoderStream()).getReader();
  let text = '';
  for (;;) {
    const {value, done} = await reader.read();
    if (done) return;
    const lines = (text + value).split('\n');
    text = lines.pop();
    for (const line of lines.map(one => JSON.parse(one))) {
      if (line.error) throw new Refusal(line.error);
      told(line);
    }
  }
}

const kLongCheck_ms = 1500;

/** Has a scene looked at after edits: one at a time, then the last that was wanted meanwhile. Answers come coarse first. */
export class Checks {
  /** @param told  called with the edit that was looked at, and what is known so far or a Refusal */
  constructor(told) {
    this.told = told;
    this.sequence = 0;
    this.busy = false;
    this.next = null;
  }

  /** @param edit  {states, transitions} */
  want(edit) {
    this.next = edit;
    if (!this.busy)
      this.work();
    else if (performance.now() - this.begun > kLongCheck_ms)
      this.inFlight.abort();
  }

  async work() {
    this.busy = true;
    while (this.next) {
      const wanted = this.next;
      this.next = null;
      this.begun = performance.now();
      const {signal} = this.inFlight = new AbortController();
      const body = JSON.stringify({sequence: ++this.sequence, ...wanted});
      try {
        await eachLine(await ask('scene/check', {method: 'POST', body, signal}), found => this.told(wanted, found));
      } catch (error) {
        // What another page has asked for does not answer this one, which lets it go first; what was broken off is for the next
        // one.
        if (error.kind === 'superseded' || error.name === 'AbortError') {
          if (!signal.aborted && !this.next) await pause(500 + 500 * Math.random());
          this.next ??= wanted;
        } else {
          this.told(wanted, error instanceof Refusal ? error : new Refusal({kind: 'gone', message: 'rayrep studio has ended.'}));
        }
      }
    }
    this.busy = false;
  }
}

/** The scene's file as it is after edits. */
export const sceneFile = async edit => (await ask('scene/file', {method: 'POST', body: JSON.stringify(edit)})).text();

/** How the scene rests in its states, of the parts as they are. @throws Refusal */
export async function sceneBalance(edit) {
  for (;;) {
    try {
      return await posted('scene/balance', edit);
    } catch (error) {
      // What another page has asked for does not answer this one, which lets it go first.
      if (error.kind !== 'superseded') throw error;
      await pause(500 + 500 * Math.random());
    }
  }
}

const kLongPreview_ms = 2000;

/** Asks for previews: one at a time, then for the last that was wanted meanwhile. One that takes long is given up for that. */
export class Previews {
  /** @param told  called with what was asked, and with the answer or a Refusal */
  constructor(told) {
    this.told = told;
    this.sequence = 0;
    this.busy = false;
    this.next = null;
  }

  want(state) {
    this.next = state;
    if (!this.busy)
      this.work();
    else if (performance.now() - this.begun > kLongPreview_ms)
      this.inFlight.abort();
  }

  forget() {
    this.next = null;
  }

  async work() {
    this.busy = true;
    while (this.next) {
      const state = this.next;
      this.next = null;
      const {signal} = this.inFlight = new AbortController();
      this.begun = performance.now();
      const timer = setTimeout(() => this.next && this.inFlight.abort(), kLongPreview_ms);
      const answer = await posted('preview', {...wantedOf(state), sequence: ++this.sequence}, {signal}).catch(refusalOr);
      clearTimeout(timer);
      // What another page has asked for does not answer this one.
      if (answer.kind === 'superseded')
        this.next ??= state;
      else
        this.told(state, answer);
    }
    this.busy = false;
  }
}

const pause = milliseconds => new Promise(done => setTimeout(done, milliseconds));

/** A full run, from its begin to its answer. */
export class Run {
  /**
   * @param after     what has to end before
   * @param progress  called with {stage, share, left_s}
   */
  constructor(state, after, progress) {
    this.state = state;
    this.after = after;
    this.progress = progress;
    this.cancelled = false;
  }

  /** @returns {data, meshes, files, command, config}, or null when it was cancelled */
  async result() {
    this.beginning = this.begun().catch(error => error);
    const begun = await this.beginning;
    if (begun !== true) {
      if (begun) throw begun;
      return null;
    }
    for (;;) {
      const told = await (await ask('run')).json();
      if (this.cancelled || told.run !== this.number) return null;
      if (told.state === 'failed') throw new Refusal(told.error ?? {kind: 'solver', message: 'It failed.'});
      if (told.state === 'cancelled' || told.state === 'none') return null;
      if (told.state === 'done') break;
      this.progress(told);
      await pause(200);
    }
    if (this.cancelled) return null;
    const answer = await (await ask('result')).json();
    return this.answered(answer);
  }

  get wanted() {
    return wantedOf(this.state);
  }

  answered(answer) {
    return {...answer, files: answer.files ?? [], meshes: meshesIn({view: answer.data.view, blocks: answer.blocks})};
  }

  /** One before it may still be ending. */
  async begun() {
    await this.after;
    for (let waits = 0; !this.cancelled; ++waits) {
      try {
        this.number = (await posted('run', this.wanted)).run;
        return true;
      } catch (error) {
        if (error.status !== 409 || waits > 100) throw error;
        await pause(100);
      }
    }
    return false;
  }

  /** Ends when it has ended. */
  async cancel() {
    this.cancelled = true;
    await this.beginning;
    if (this.number) await ask('cancel', {method: 'POST'}).catch(() => {});
  }
}

/** rayrep balance of a scene as it was edited: its result has files only. */
export class BalanceRun extends Run {
  get wanted() {
    return this.state;
  }

  answered(answer) {
    return answer;
  }
}
