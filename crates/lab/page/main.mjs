// The lab: what is set, what is asked of the engine, what is shown.
import { open } from './engine.mjs';
import { detection as decode, points, words as json } from './decode.mjs';
import { Newest, Store, read, write } from './state.mjs';
import { sound } from './link.mjs';
import { field, keyboard } from './keyboard.mjs';
import { Faults, leftOut } from './faults.mjs';
import { Advice } from './advice.mjs';
import { Controls } from './controls.mjs';
import { Converter } from './convert.mjs';
import { Rotor } from './rotor.mjs';
import { Waves } from './waves.mjs';
import { Cloud } from './cloud.mjs';
import { Files } from './folder.mjs';
import { detection, difference, statistics } from './results.mjs';
import { theme } from './theme.mjs';
import { fixed, make, renew } from './words.mjs';

const $ = id => document.getElementById(id);
const root = document.documentElement;

class Lab {
  constructor(engine, info, state) {
    this.engine = engine;
    this.info = info;
    this.tab = crypto.randomUUID?.() ?? String(Math.random());
    // Of each side: what its keys come to, its statistics, and the cloud that is being filled.
    for (const name of ['values', 'summaries', 'clouds', 'timers']) this[name] = { a: null, b: null };
    this.begun = { a: 0, b: 0 };
    this.store = new Store(state, before => this.#changed(before));
    this.faults = new Faults($('wrong'), this.store, () => this.#showValues());
    this.rotor = new Rotor($('rotor'), angle => this.store.change('angle', state => { state.angle = angle; }));
    this.waves = new Waves($('waves'), $('readout'));
    this.cloud = new Cloud($('cloud'), trial => this.#look(trial));
    this.controls = new Controls($('controls'), info, (key, text, about) => this.#set(key, text, about));
    this.asks = {};
    for (const side of ['a', 'b']) {
      this.asks[side] = { detection: new Newest(() => this.#detection(side)), values: new Newest(() => this.#values(side)) };
    }
    this.advice = new Advice($('advice'), engine, info, this.store);
    this.converter = new Converter($('convert'), engine, info.convertible);
    this.#buttons();
    if (engine.files && info.folder) this.#folder();
    $('foot').textContent = `Standstill ${info.version}. ${engine.files ? 'Computed on this machine.' : 'Computed in this browser: one thread, no files.'}`;
    this.#changed(null);
    root.dataset.ready = 'yes';
  }

  get state() { return this.store.state; }

  /** Which setting a key changes, and how. */
  #set(key, text, about) {
    this.store.change(about, state => {
      const set = state[state.side];
      if (text === null) delete set[key];
      else set[key] = text;
      // What the old method or motor had, the new one may not have.
      if (key === 'detector.method') for (const other of Object.keys(set)) if (other.startsWith('detector.') && other !== key) delete set[other];
      if (key === 'motor') for (const other of Object.keys(set)) if (other.startsWith('motor.')) delete set[other];
    });
  }

  #look(trial) {
    this.store.change(null, state => Object.assign(state, { trial, angle: null }));
  }

  /** Something was set: asks for what depends on it, and for nothing else. */
  #changed(before) {
    const { state } = this;
    this.#address();
    const frame = one => JSON.stringify([one.scenario, one.point]);
    for (const side of ['a', 'b']) {
      if (!state[side]) {
        if (before?.[side] || before === null) this.#forget(side);
        continue;
      }
      const other = before === null || !before[side] || frame(before) !== frame(state) || JSON.stringify(before[side]) !== JSON.stringify(state[side]);
      const looks = other || before.trial !== state.trial || before.angle !== state.angle;
      const many = before !== null && before.trials !== state.trials;
      if (looks) this.asks[side].detection.run(true);
      if (other || many) this.asks[side].values.run(true);
      else if (looks) this.#valuesSoon(side);
      if (other || many) this.#restart(side);
    }
    this.faults.show();
    this.advice.show();
    this.#tools();
    if (before && (before.side !== state.side || Boolean(before.b) !== Boolean(state.b))) this.#showValues();
  }

  /** While a hand turns the rotor only the commands to copy change, which can wait. */
  #valuesSoon(side) {
    clearTimeout(this.soon?.[side]);
    this.soon = { ...this.soon, [side]: setTimeout(() => this.asks[side].values.run(true), 250) };
  }

  #forget(side) {
    this.clouds[side]?.abort();
    clearTimeout(this.timers[side]);
    this.summaries[side] = null;
    this.values[side] = null;
    delete this.found?.[side];
    this.cloud.begin(side);
    this.waves.show(side, null);
    this.rotor.found(side, null);
    this.#numbers();
    this.#verdicts();
    this.cloud.dirty();
  }

  /** Says what cannot be, as long as it is what is asked. */
  #failed(side, part, question, error) {
    if (error.name === 'AbortError') return;
    if (error.lost) this.#lost();
    else this.faults.set(side, part, question, error);
  }

  async #detection(side) {
    const { trial, angle } = this.state;
    if (!this.state[side]) return;
    const question = this.faults.question(side, 'detection');
    try {
      const found = decode(await this.engine.detection({ setting: this.store.setting(side), trial, angle }));
      if (!this.state[side]) return;
      this.faults.set(side, 'detection', question, null);
      this.waves.show(side, found);
      this.rotor.found(side, found.estimate, found.outcome === 'found');
      // An answer that comes late must not turn back what the hand has turned on.
      if (side === 'a' && this.state.angle === angle && this.state.trial === trial) this.rotor.stand(found.true_angle);
      this.found = { ...this.found, [side]: found };
      this.#usable();
      this.#verdicts();
    } catch (error) {
      this.#failed(side, 'detection', question, error);
    }
  }

  /** Says when waveforms and controls are there for the first time: from then on the page answers a hand. */
  #usable() {
    if (this.found?.a && this.values.a && !root.dataset.usable) performance.mark(root.dataset.usable = 'usable');
  }

  /** The detections in words, of the sides that are there. */
  #verdicts(always = false) {
    if (!this.found) return;
    const sides = this.store.sides().map(one => [one, this.found[one]]).filter(([, one]) => one);
    $('verdict').replaceChildren(...sides.map(([one, of]) => detection(one, of, sides.length > 1)));
    const first = this.found.a;
    field($('angle'), '~angle', this.state.angle === null ? fixed(first?.start_angle, 2) : String(this.state.angle), always);
    this.cloud.selected = this.state.trial;
    this.cloud.here = first ? { angle: first.true_angle, error: first.axis_error } : null;
    this.cloud.dirty(false);
    renew($('specimen'), sides.map(([one, of]) => [one, of.specimen]), () => sides.map(([one, of]) => make('dl', { class: 'specimen-list' },
      ...(sides.length > 1 ? [make('div', {}, make('dt', {}, one.toUpperCase()), make('dd', {}, ''))] : []),
      ...of.specimen.map(([name, value]) => make('div', {}, make('dt', { text: name }), make('dd', { text: value }))))));
    $('legend').replaceChildren(...(sides.length > 1 ? [make('span', {}, 'A: lines and dots · B: dashed lines and rings')] : []));
  }

  async #values(side) {
    if (!this.state[side]) return;
    const { trial, angle, trials } = this.state;
    const setting = this.store.setting(side);
    const question = this.faults.question(side, 'values');
    try {
      const values = await this.engine.setting({ setting, trial, angle, trials });
      if (!this.state[side]) return;
      this.values[side] = values;
      this.faults.set(side, 'values', question, null);
      if (side === 'a') this.rotor.motor(values.motor);
      this.#showValues();
      this.#usable();
    } catch (error) {
      this.#failed(side, 'values', question, error);
    }
  }

  /** The controls and texts of the side that is being set. */
  #showValues() {
    const { state } = this;
    const { side } = state;
    const values = this.values[side] ?? this.values.a;
    if (!values) return;
    const other = state.b ? state[side === 'a' ? 'b' : 'a'] : null;
    this.controls.show(values, state[side], values.axes, other, this.faults.of(side));
    $('what').textContent = `${values.motor.name}, ${values.method}${values.points.length > 1 ? `, point ${state.point}: ${values.points[state.point]}` : ''}`;
    for (const name of ['trace', 'run', 'toml']) $(name).textContent = values[name];
    this.controls.showPoints(values, state.point, point => this.store.change(null, now => { now.point = point; }));
  }

  /** A new cloud of a side; while a hand is on a slider, not more often than the eye has use for. */
  #restart(side) {
    clearTimeout(this.timers[side]);
    const wait = Math.max(0, this.begun[side] + 110 - performance.now());
    if (wait > 0) this.timers[side] = setTimeout(() => this.#fill(side), wait);
    else this.#fill(side);
  }

  async #fill(side) {
    this.clouds[side]?.abort();
    const abort = new AbortController();
    this.clouds[side] = abort;
    this.begun[side] = performance.now();
    const question = this.faults.question(side, 'cloud');
    // What was said of other trials goes with them.
    $('pair').textContent = '';
    let first = true;
    const current = () => this.clouds[side] === abort && this.state[side];
    const frame = (kind, view) => {
      if (!current()) return;
      if (kind === 2) throw Object.assign(new Error(json(view).message), json(view));
      if (kind === 1) {
        if (first) this.cloud.begin(side);
        first = false;
        this.cloud.both = Boolean(this.state.b);
        points(view, (...point) => this.cloud.sides[side].add(...point));
        this.cloud.scale(false);
        this.cloud.dirty();
      } else {
        this.summaries[side] = json(view);
        this.#numbers();
      }
    };
    try {
      await this.engine.cloud({ setting: this.store.setting(side), trials: this.state.trials, slot: `${this.tab} ${side}` }, frame, abort.signal);
      if (!current()) return;
      this.faults.set(side, 'cloud', question, null);
      this.cloud.scale(true);
      this.cloud.dirty();
      await this.#pair();
      // The machine's time belongs to the first cloud.
      this.advice.open();
    } catch (error) {
      if (current()) this.#failed(side, 'cloud', question, error);
    }
  }

  async #pair() {
    $('pair').textContent = '';
    if (!this.state.b) return;
    const asked = [this.store.setting('a'), this.store.setting('b')];
    const found = await this.engine.pair({ a: asked[0], b: asked[1] });
    if (!found.trials || !this.state.b || JSON.stringify(asked) !== JSON.stringify([this.store.setting('a'), this.store.setting('b')])) return;
    $('pair').textContent = difference(found);
  }

  /** Statistics, side by side. */
  #numbers() {
    const sides = this.store.sides().filter(side => this.summaries[side]);
    const of = side => ({ ...this.summaries[side].summary, in_words: this.summaries[side].in_words });
    statistics($('numbers'), sides, of);
    const shares = sides.map(side => of(side).trials / this.summaries[side].all);
    $('progress').firstElementChild.style.width = `${100 * Math.min(...shares, 1)}%`;
    $('progress').classList.toggle('done', shares.every(share => share >= 1));
    const wrong = sides.some(side => of(side).wrong_poles);
    const axis = sides.some(side => of(side).undetermined);
    const failed = sides.some(side => of(side).failed + of(side).errors);
    $('cloud-legend').textContent = [sides.length > 1 ? 'squares A, bars B' : 'a point for each trial', wrong && '× wrong pole', axis && '○ pole undetermined', failed && '| no angle, at the lower edge', 'ring: the detection above'].filter(Boolean).join(' · ');
  }

  #tools() {
    const { store, state } = this;
    $('undo').disabled = store.past.length === 0;
    $('redo').disabled = store.future.length === 0;
    const both = Boolean(state.b);
    $('compare').setAttribute('aria-pressed', String(both));
    $('compare').textContent = both ? 'End comparison' : 'Compare A | B';
    $('sides').hidden = !both;
    for (const side of ['a', 'b']) $(`side-${side}`).setAttribute('aria-pressed', String(state.side === side));
    field($('trial'), '~trial', String(state.trial));
    $('trials').value = String(state.trials);
    $('drawn').disabled = state.angle === null;
    this.cloud.both = both;
    if (!both) $('pair').textContent = '';
    if (state.angle !== null) this.rotor.stand(state.angle);
  }

  #buttons() {
    const { store } = this;
    const on = (id, act) => $(id).addEventListener('click', act);
    on('undo', () => store.undo());
    on('redo', () => store.redo());
    on('compare', () => store.change(null, state => Object.assign(state, state.b ? { b: null, side: 'a' } : { b: { ...state.a }, side: 'b' })));
    for (const side of ['a', 'b']) on(`side-${side}`, () => store.change(null, state => { state.side = side; }));
    on('swap', () => store.change(null, state => Object.assign(state, { a: state.b, b: state.a })));
    on('keep', () => store.change(null, state => Object.assign(state, { a: state.b, b: null, side: 'a' })));
    on('drawn', () => store.change(null, state => { state.angle = null; }));
    on('zoom-in', () => this.waves.zoom(0.5));
    on('zoom-out', () => this.waves.zoom(2));
    on('zoom-all', () => this.waves.all());
    on('zoom-pulse', () => this.waves.firstPulse());
    on('worst', () => { const trial = this.cloud.worst(this.state.side); if (trial !== null) this.#look(trial); });
    on('wrong-pole', () => {
      const trial = this.cloud.nextOdd(this.state.side, this.state.trial);
      if (trial === null) this.#say('Every trial found its angle and its pole.');
      else this.#look(trial);
    });
    $('trial').addEventListener('change', () => {
      const trial = Number($('trial').value);
      const isOne = $('trial').value !== '' && Number.isInteger(trial) && trial >= 0 && trial < 1e9;
      field($('trial'), '~trial', String(isOne ? trial : this.state.trial), true);
      if (isOne) this.#look(trial);
    });
    $('angle').addEventListener('change', () => {
      const text = $('angle').value.replace('°', '').replace('−', '-').trim();
      const angle = text === '' ? null : Number(text);
      if (angle !== null && !Number.isFinite(angle)) return this.#verdicts(true);
      if (angle !== null) field($('angle'), '~angle', String(angle), true);
      return store.change(null, state => { state.angle = angle; });
    });
    $('trials').addEventListener('change', () => store.change(null, state => { state.trials = Number($('trials').value); }));
    $('find').addEventListener('input', () => this.controls.filter($('find').value));
    on('link', () => this.#copy(location.href, 'The link is copied: it restores all that is set, in this lab or behind the # of another one’s address.'));
    for (const button of document.querySelectorAll('[data-copy]')) {
      button.addEventListener('click', () => this.#copy($(button.dataset.copy).textContent, 'Copied.'));
    }
    theme($('theme'), () => this.#paint());
    addEventListener('hashchange', () => this.#link());
    keyboard(store);
  }

  /** Another address was typed into this page. */
  async #link() {
    const broken = [];
    const state = await sound(read(location.hash, broken), this.engine, broken).catch(() => null);
    if (!state) return this.#lost();
    leftOut($('left-out'), broken);
    this.store.replace(state);
    // Where all that was typed is left out, the address must not keep it.
    return this.#address();
  }

  #address() {
    const fragment = write(this.state);
    history.replaceState(null, '', fragment ? `#${fragment}` : location.pathname);
  }

  #paint() { [this.waves, this.cloud].forEach(picture => picture.dirty()); }

  #folder() {
    const files = new Files($('entries'), this.engine, path => {
      this.store.change(null, state => Object.assign(state, { scenario: path, point: 0, a: {}, b: null, side: 'a', trial: 0, angle: null }));
      this.#say(`${path} is open.`);
    });
    $('folder-path').textContent = this.info.folder;
    files.behind($('files'), $('folder'), message => this.#say(message));
  }

  async #copy(text, message) {
    try {
      await navigator.clipboard.writeText(text);
      this.#say(message);
    } catch {
      this.#say('The browser does not let pages copy; the text is in the address, or above.');
    }
  }

  #say(text) {
    $('status').textContent = text;
    clearTimeout(this.saying);
    this.saying = setTimeout(() => { $('status').textContent = ''; }, 5000);
  }

  /** Nothing answers: says so, and tries again until something does. */
  #lost() {
    if (this.isLost) return;
    this.isLost = true;
    root.dataset.lost = 'yes';
    $('lost').hidden = false;
    $('lost').textContent = 'The lab does not answer: it has ended, or this machine was asleep. What is set is kept in the address; start `standstill lab` again, open the address that it prints, and put the part behind # after it.';
    const again = async () => {
      try {
        await this.engine.start();
        this.isLost = false;
        delete root.dataset.lost;
        $('lost').hidden = true;
        this.#changed(null);
      } catch {
        setTimeout(again, 1000);
      }
    };
    setTimeout(again, 1000);
  }
}

/** The lab as soon as it answers. */
async function begin() {
  try {
    const engine = await open();
    const broken = [];
    const [info, state] = await Promise.all([engine.start(), sound(read(location.hash, broken), engine, broken)]);
    $('lost').hidden = true;
    leftOut($('left-out'), broken);
    globalThis.lab = new Lab(engine, info, state);
  } catch (error) {
    $('lost').hidden = false;
    $('lost').textContent = error.message;
    if (error.lost) setTimeout(begin, 1000);
  }
}
begin();
