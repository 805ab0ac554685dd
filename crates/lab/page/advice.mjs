// What `standstill check` recommends for the motor and the drive that are set.
import { make, renew } from './words.mjs';

const isDetector = key => key.startsWith('detector.');

export class Advice {
  constructor(place, engine, info, store) {
    Object.assign(this, { place, engine, info, store });
    /** What is known, by what was asked. */
    this.known = new Map();
    this.asking = null;
    this.opened = false;
    this.plain = location.hash === '' && !info.has_method;
  }

  /** The side that is being set, without its detector: what is asked. */
  #setting() {
    const setting = this.store.setting(this.store.state.side);
    return { ...setting, set: Object.fromEntries(Object.entries(setting.set).filter(([key]) => !isDetector(key))) };
  }

  /** Once, when the page has shown its first trials: where neither scenario nor address names a detector, asks in the background,
   *  and sets what is found unless a hand was faster. */
  async open() {
    if (this.opened || !this.engine.advice) return;
    this.opened = true;
    this.show();
    const isUntouched = () => this.plain && this.store.past.length === 0 && this.store.future.length === 0;
    const found = isUntouched() ? await this.#ask() : null;
    if (found?.keys && isUntouched()) this.#set(found);
    document.documentElement.dataset.advised = 'yes';
  }

  async #ask() {
    const setting = this.#setting();
    const question = JSON.stringify(setting);
    this.asking = question;
    this.show();
    let found = null;
    try {
      found = await this.engine.advice({ setting });
    } catch (error) {
      found = { keys: null, text: error.lost ? 'The lab does not answer.' : error.message };
      // It may answer next time.
      if (error.lost) found = null;
    }
    if (found) this.known.set(question, found);
    this.asking = null;
    this.show();
    return found;
  }

  #set({ keys }) {
    this.store.change(null, state => {
      const set = state[state.side];
      for (const key of Object.keys(set)) if (isDetector(key)) delete set[key];
      Object.assign(set, keys);
    });
  }

  /** One line: what is recommended, or how to ask. */
  show() {
    if (!this.engine.advice || !this.opened) return;
    const question = JSON.stringify(this.#setting());
    const found = this.known.get(question);
    const set = this.store.state[this.store.state.side];
    const own = Object.entries(set).filter(([key]) => isDetector(key));
    const isSet = found?.keys && own.length === Object.keys(found.keys).length && own.every(([key, value]) => found.keys[key] === value);
    const button = (text, act) => make('button', { type: 'button', onclick: act }, text);
    this.place.hidden = false;
    const offer = () => [`\`check\` recommends ${found.text} `, button('Set it', () => this.#set(found))];
    const [says, parts] = this.asking === question ? ['asking', () => ['`check` tries the methods on this motor and drive …']]
      : !found ? ['ask', () => [button('What does `check` recommend here?', () => this.#ask())]]
        : isSet ? ['set', () => [`As \`check\` recommends: ${found.text}`]]
          : found.keys ? ['may be set', offer] : ['none', () => [found.text]];
    renew(this.place, [says, question], parts);
  }
}
