// A data sheet's numbers in all the ways in which they are given: what `standstill convert` prints.
import { make } from './words.mjs';
import { Newest } from './state.mjs';

export class Converter {
  /** `keys`: those that the engine converts. The form is made when it is first opened. */
  constructor(place, engine, keys) {
    Object.assign(this, { place, engine, keys });
    /** What was typed, by its key. */
    this.given = {};
    this.inputs = new Map();
    this.asks = new Newest(() => this.#ask());
    place.addEventListener('toggle', () => { if (place.open && !this.inputs.size) this.#make(); });
  }

  #make() {
    const groups = make('div', { class: 'quantities' });
    let last = null;
    for (const key of this.keys) {
      if (key.quantity !== last?.quantity) {
        const name = key.quantity || 'all';
        last = { quantity: key.quantity, element: make('fieldset', { 'data-quantity': key.quantity }, key.quantity && make('legend', { text: name })) };
        groups.append(last.element);
      }
      last.element.append(this.#row(key));
    }
    this.said = make('p', { class: 'hint', role: 'status' }, 'Type what the data sheet says into its field, such as 7 and 900 rpm/V: the other fields follow.');
    this.place.append(this.said, groups);
  }

  #row({ key, meaning }) {
    const id = `convert-${key}`;
    const input = make('input', { id, type: 'text', autocomplete: 'off', spellcheck: 'false', size: '11' });
    input.addEventListener('input', () => this.#typed(key, input.value.trim()));
    this.inputs.set(key, input);
    return make('div', { class: 'way' }, make('label', { for: id }, make('code', { text: key }), ` ${meaning}`), input);
  }

  /** What one way of giving a quantity says, the others no longer do. */
  #typed(key, text) {
    const own = this.keys.find(of => of.key === key);
    for (const other of this.keys) {
      if (other.quantity === own.quantity && other.way !== own.way) delete this.given[other.key];
    }
    if (text === '') delete this.given[key];
    else this.given[key] = text;
    this.asks.run(true);
  }

  async #ask() {
    const numbers = { ...this.given };
    const none = Object.keys(numbers).every(key => key === 'pole_pairs');
    try {
      this.#show(none ? { numbers: [], command: '', nameplate: '' } : await this.engine.convert({ numbers }), null);
    } catch (error) {
      this.#show({ numbers: [], command: '', nameplate: '' }, error.message);
    }
  }

  #show({ numbers, command, nameplate }, wrong) {
    const texts = new Map(numbers.filter(of => of.key).map(of => [of.key, of.text]));
    for (const [key, input] of this.inputs) {
      const isGiven = Object.hasOwn(this.given, key);
      input.classList.toggle('given', isGiven);
      if (!isGiven) input.value = texts.get(key) ?? '';
    }
    for (const group of this.place.querySelectorAll('fieldset')) {
      group.querySelector('dl')?.remove();
      const rest = numbers.filter(of => !of.key && of.quantity === group.dataset.quantity);
      if (rest.length) group.append(make('dl', {}, ...rest.map(of => make('div', {}, make('dt', { text: of.meaning }), make('dd', { text: of.text })))));
    }
    this.said.textContent = wrong ?? 'What is typed is in bold; the other fields have the same in other ways.';
    this.said.classList.toggle('wrong', Boolean(wrong));
    document.getElementById('convert-command').textContent = command;
    document.getElementById('nameplate').textContent = nameplate;
    document.getElementById('converted').hidden = !command;
  }
}
