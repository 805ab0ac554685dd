// What is wrong: with what is set, as long as it is set, and with the address that the page was opened with.
import { make } from './words.mjs';

/** Parts of a side that the engine answers by themselves. */
const PARTS = ['values', 'detection', 'cloud'];

export class Faults {
  /** `marked()` is called when another key is at fault. */
  constructor(place, store, marked) {
    this.place = place;
    this.store = store;
    this.marked = marked;
    this.known = { a: {}, b: {} };
    this.said = '';
  }

  /** What a part of a side is asked now. */
  question(side, part) {
    const { trial, angle, trials } = this.store.state;
    const more = { values: [], detection: [trial, angle], cloud: [trials] }[part];
    return JSON.stringify([this.store.setting(side), ...more]);
  }

  /** The answer of a part to a question: an error, or none. */
  set(side, part, question, error) {
    // A late answer to what is asked no more says nothing of what is.
    if (question !== this.question(side, part)) return;
    this.known[side][part] = error && { question, error };
    this.show();
  }

  /** What is wrong with a side as it is set now. */
  of(side) {
    if (!this.store.state[side]) return null;
    const holds = part => this.known[side][part]?.question === this.question(side, part);
    const part = PARTS.find(holds);
    return part ? this.known[side][part].error : null;
  }

  show() {
    const wrong = this.store.sides().map(side => [side, this.of(side)]).filter(([, error]) => error);
    const both = Boolean(this.store.state.b);
    const said = JSON.stringify(wrong.map(([side, error]) => [both && side, error.message]));
    if (said === this.said) return;
    this.said = said;
    this.place.hidden = wrong.length === 0;
    this.place.replaceChildren();
    for (const [side, error] of wrong) this.place.append(make('span', {}, `${both ? `${side.toUpperCase()}: ` : ''}${error.message}. `));
    if (wrong.length) {
      this.place.append(make('span', { class: 'hint', text: 'What is shown is the last setting that works. ' }));
      if (this.store.past.length) this.place.append(make('button', { type: 'button', onclick: () => this.store.undo() }, 'Undo'));
    }
    this.marked();
  }
}

/** Names what an address sets and cannot be set. */
export function leftOut(place, broken) {
  place.hidden = broken.length === 0;
  place.replaceChildren();
  if (!broken.length) return;
  const close = () => { place.hidden = true; };
  place.append(make('p', {}, 'The link sets what cannot be set. This is left out, and all else is as the link has it:'),
    make('ul', {}, ...broken.slice(0, 20).map(({ key, value, why }) =>
      make('li', {}, make('code', { text: key.replace(/^b:/, 'B: ') }), ` = ${String(value).slice(0, 60)}: ${why}`))),
    broken.length > 20 ? make('p', {}, `and ${broken.length - 20} more`) : '',
    make('button', { type: 'button', onclick: close }, 'Close'));
}
