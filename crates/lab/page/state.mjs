// All that is set, its history, and the address that restores it.

export const start = () => ({ scenario: '', point: 0, trials: 10000, a: {}, b: null, side: 'a', trial: 0, angle: null });

const copy = state => structuredClone(state);

/** As the fragment of an address: keys as they are; those of B behind `b:`; what is no key behind `~`. */
export function write(state) {
  const words = new URLSearchParams();
  const plain = start();
  for (const name of ['scenario', 'point', 'trials', 'trial', 'angle']) {
    if (state[name] !== plain[name]) words.set(`~${name}`, state[name]);
  }
  for (const [key, value] of Object.entries(state.a)) words.set(key, value);
  if (state.b) {
    words.set('~compare', state.side);
    for (const [key, value] of Object.entries(state.b)) words.set(`b:${key}`, value);
  }
  return words.toString();
}

/** From a fragment; what is not understood goes into `broken`, with the reason. */
export function read(fragment, broken) {
  const state = start();
  const words = new URLSearchParams(fragment.replace(/^#/, ''));
  const refuse = (key, value, why) => broken.push({ key, value, why });
  const whole = (key, value, least, most) => {
    if (/^\d{1,9}$/.test(value) && Number(value) >= least && Number(value) <= most) state[key.slice(1)] = Number(value);
    else refuse(key, value, `needed: a whole number from ${least} to ${most}`);
  };
  for (const [key, value] of words) {
    if (key === '~scenario') state.scenario = value;
    else if (key === '~point' || key === '~trial') whole(key, value, 0, 999_999_999);
    else if (key === '~trials') whole(key, value, 1, 1_000_000);
    else if (key === '~angle') {
      if (value.trim() !== '' && Number.isFinite(Number(value))) state.angle = Number(value);
      else refuse(key, value, 'needed: an angle in degrees');
    } else if (key === '~compare') {
      state.b ??= {};
      state.side = value === 'a' ? 'a' : 'b';
      if (!['a', 'b'].includes(value)) refuse(key, value, 'needed: a or b');
    } else if (key.startsWith('~')) refuse(key, value, 'needed: ~scenario, ~point, ~trials, ~trial, ~angle or ~compare');
    else if (/^(b:)?(__proto__)?$/.test(key)) refuse(key, value, 'needed: a key of a scenario');
    else if (key.startsWith('b:')) (state.b ??= {})[key.slice(2)] = value;
    else state.a[key] = value;
  }
  return state;
}

/** The words of the address in which two states differ. */
export function differing(one, other) {
  const [a, b] = [one, other].map(state => new URLSearchParams(write(state)));
  return [...new Set([...a.keys(), ...b.keys()])].filter(key => a.get(key) !== b.get(key));
}

/** What is set, with undo: changes while a hand holds a slider are one, and so are those that follow each other fast. */
export class Store {
  constructor(state, changed) {
    this.state = state;
    this.changed = changed;
    this.past = [];
    this.future = [];
    this.last = { about: null, at: 0 };
    this.held = false;
    // However long a slow machine takes between two changes.
    const hold = held => () => {
      this.held = held;
      if (held) this.last = { about: null, at: 0 };
    };
    addEventListener('pointerdown', hold(true), true);
    for (const end of ['pointerup', 'pointercancel']) addEventListener(end, hold(false), true);
  }

  /** Changes it; `about` is what the hand is on. */
  change(about, act) {
    const before = copy(this.state);
    act(this.state);
    if (write(before) === write(this.state)) return;
    const now = performance.now();
    if (about === null || about !== this.last.about || (!this.held && now - this.last.at > 700)) {
      this.past.push(before);
      if (this.past.length > 300) this.past.shift();
    }
    this.last = { about, at: now };
    this.future = [];
    this.changed(before);
  }

  /** Takes another state, as an address has it. */
  replace(state) {
    if (write(state) === write(this.state)) return;
    this.change(null, now => Object.assign(now, state));
  }

  undo() { this.#go(this.past, this.future); }

  redo() { this.#go(this.future, this.past); }

  #go(from, to) {
    if (!from.length) return;
    const before = copy(this.state);
    to.push(before);
    this.state = from.pop();
    this.last = { about: null, at: 0 };
    this.changed(before);
  }

  /** The setting of a side, as the engine takes it. */
  setting(side) {
    const { scenario, point } = this.state;
    return { scenario, point, set: { ...this.state[side] } };
  }

  /** The sides that are there. */
  sides() { return this.state.b ? ['a', 'b'] : ['a']; }
}

/** Asks for the newest only: while one question is out, later ones wait in a place for one. */
export class Newest {
  constructor(ask) {
    this.ask = ask;
    this.busy = false;
    this.next = null;
  }

  run(question) {
    if (this.busy) {
      this.next = question;
      return;
    }
    this.busy = true;
    this.ask(question).finally(() => {
      this.busy = false;
      const { next } = this;
      this.next = null;
      if (next) this.run(next);
    });
  }
}
