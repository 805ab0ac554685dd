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

/** From a fragment; what is not understood is left out. */
export function read(fragment) {
  const state = start();
  const words = new URLSearchParams(fragment.replace(/^#/, ''));
  const whole = (text, most) => (/^\d{1,9}$/.test(text) && Number(text) <= most ? Number(text) : null);
  for (const [key, value] of words) {
    if (key === '~scenario') state.scenario = value;
    else if (key === '~point') state.point = whole(value, 1e9) ?? 0;
    else if (key === '~trials') state.trials = whole(value, 1e6) || 10000;
    else if (key === '~trial') state.trial = whole(value, 1e9) ?? 0;
    else if (key === '~angle') state.angle = value !== '' && Number.isFinite(Number(value)) ? Number(value) : null;
    else if (key === '~compare') {
      state.b ??= {};
      state.side = value === 'a' ? 'a' : 'b';
    } else if (key.startsWith('b:')) (state.b ??= {})[key.slice(2)] = value;
    else if (!key.startsWith('~')) state.a[key] = value;
  }
  return state;
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
