// A control for every key of a scenario, with its unit, its range and what it is by itself.
import { field } from './keyboard.mjs';
import { make, quantity } from './words.mjs';

const TABLES = [
  ['detector', 'Detector', true], ['sensors', 'Sensors', true], ['inverter', 'Inverter', false], ['rotor', 'Rotor', false],
  ['', 'Run', false], ['stop_at', 'Early end', false],
];

const name = key => key.split('.').pop().replaceAll('_', ' ');

export class Controls {
  /** `set(key, text, about)` sets a key, or takes it back where the text is null. */
  constructor(place, info, set) {
    this.place = place;
    this.set = set;
    this.rows = new Map();
    this.tables = [];
    this.sheet = new Map();
    const controls = info.controls;
    const of = key => controls.find(control => control.key === key);
    const motors = { key: 'motor', about: 'A built-in motor, or the path of a data sheet below the folder.', kind: 'motor', choices: info.motors.map(motor => [motor, '']) };
    // What one turns first stands first; where it stands above the results, alone.
    const isWide = matchMedia('(min-width:70rem)').matches;
    this.#table('What', true, [motors, of('errors'), of('detector.method'), of('rotor.state')]);
    for (const [table, title, open] of TABLES) {
      const own = controls.filter(control => (control.key.includes('.') ? control.key.split('.')[0] : '') === table
        && !['errors', 'detector.method', 'rotor.state', 'trials'].includes(control.key));
      this.#table(title, open && isWide, own);
    }
    this.motor = this.#table('Motor’s data sheet', false, []);
    this.#tolerances(controls.filter(control => control.kind === 'number' && /^(sensors|inverter|rotor)\./.test(control.key)));
  }

  #table(title, open, controls) {
    const body = make('div', { class: 'rows' });
    const count = make('span', { class: 'count' });
    const table = make('details', { open }, make('summary', {}, title, count), body);
    this.place.append(table);
    const entry = { table, body, count, rows: [] };
    for (const control of controls) entry.rows.push(this.#row(control, body));
    this.tables.push(entry);
    return entry;
  }

  #row(control, body) {
    const id = `key-${control.key.replaceAll(/[^a-z0-9]/gi, '-')}`;
    const row = { control, input: null, slider: null };
    const label = make('label', { for: id, title: `${control.key}: ${control.about}` }, name(control.key));
    row.back = make('button', { type: 'button', class: 'back', 'aria-label': `${control.key}: as it is by itself`, title: 'As it is by itself', hidden: true,
      onclick: () => this.set(control.key, null, null) }, '↺');
    row.hint = make('p', { class: 'hint row-hint', id: `${id}-hint` });
    row.element = make('div', { class: `row ${control.kind}`, 'data-key': control.key }, label);
    if (control.kind === 'choice' || control.kind === 'motor' || control.kind === 'flag') this.#choice(row, id);
    else this.#number(row, id);
    row.element.append(row.back, row.hint);
    row.input.setAttribute('aria-describedby', `${id}-hint`);
    body.append(row.element);
    this.rows.set(control.key, row);
    return row;
  }

  #choice(row, id) {
    const { control } = row;
    const choices = control.kind === 'flag' ? [['true', 'yes'], ['false', 'no']] : control.choices;
    const texts = control.kind === 'flag' ? { true: 'yes', false: 'no' } : {};
    row.input = make('select', { id }, ...choices.map(([value, about]) => make('option', { value, title: about }, texts[value] ?? value)));
    row.input.addEventListener('change', () => this.set(control.key, row.input.value === '' ? null : row.input.value, null));
    row.element.append(row.input);
  }

  #number(row, id) {
    const { control } = row;
    row.input = make('input', { id, type: 'text', inputmode: 'text', autocomplete: 'off', spellcheck: 'false', size: '9' });
    const typed = () => {
      const text = row.input.value.trim();
      if (text === row.shown) return;
      const whole = text === '' ? null : this.#withUnit(control, text);
      // From here on the field shows what is set, and follows it.
      if (whole !== null) field(row.input, control.key, whole, true);
      this.set(control.key, whole, null);
    };
    row.input.addEventListener('change', typed);
    row.input.addEventListener('keydown', event => {
      if (event.key === 'Enter') typed();
      if (event.key === 'Escape') { field(row.input, control.key, row.shown, true); row.input.blur(); }
    });
    row.slider = make('input', { type: 'range', min: '0', max: '1000', step: '1', tabindex: '0', 'aria-label': `${control.key}, slider` });
    row.slider.addEventListener('input', () => {
      const [low, high] = row.span;
      let value = low + ((high - low) * Number(row.slider.value)) / 1000;
      const step = 10 ** Math.floor(Math.log10((high - low) / 200));
      value = Number((Math.round(value / step) * step).toPrecision(6));
      if (this.#whole(control)) value = Math.round(value);
      const text = quantity(value, control.unit, control.share, 4);
      field(row.input, control.key, text, true);
      row.slider.setAttribute('aria-valuetext', text);
      this.set(control.key, text, `slider ${control.key}`);
    });
    row.element.append(row.input, row.slider);
  }

  #whole(control) { return control.kind === 'whole' || /(^|[._])(bits|rounds)$/.test(control.key); }

  /** A number typed without a unit is in the unit that was shown, as the eye expects. */
  #withUnit(control, text) {
    const row = this.rows.get(control.key);
    const unit = /[^\d.\s+eE-].*$/.exec(row?.shown ?? '')?.[0];
    return unit && /^[+-]?[\d.]+([eE][+-]?\d+)?$/.test(text) ? `${text} ${unit}` : text;
  }

  /** Shows what all keys come to in a setting. */
  show(values, set, axes, other, error) {
    for (const [key, row] of this.rows) {
      const shown = values.values[key] ?? this.#ofSheet(key, values);
      if (shown) this.#showRow(key, row, shown, set, axes, other, error);
    }
    this.#showSheet(values, set, axes, other, error);
    this.#showTolerances(values, set);
    for (const table of this.tables) {
      const changed = table.rows.filter(row => row.changed).length;
      table.count.textContent = changed ? ` · ${changed} changed` : '';
    }
    this.filter(this.wanted ?? '');
  }

  #ofSheet(key, values) {
    if (key === 'motor') return { value: values.motor.name, text: values.motor.name, default: '', there: true };
    const entry = values.sheet.find(entry => entry.key === key);
    return entry ? { value: entry.text, text: entry.text, default: entry.text, there: true, entry } : null;
  }

  #showRow(key, row, shown, set, axes, other, error) {
    const own = Object.hasOwn(set, key);
    const isAxis = axes.includes(key);
    row.there = shown.there || own;
    row.changed = own;
    row.back.hidden = !own;
    row.element.classList.toggle('changed', own);
    row.element.classList.toggle('differs', other !== null && other[key] !== set[key]);
    const wrong = error?.key === key || (error?.key && key.startsWith(`${error.key}.`) && own);
    row.element.classList.toggle('wrong', Boolean(wrong));
    row.input.disabled = isAxis;
    if (row.slider) {
      row.slider.hidden = !shown.slider;
      row.slider.disabled = isAxis;
    }
    this.#fill(row, shown, own ? set[key] : null);
    const range = row.control.range ? `${row.control.range}` : '';
    const source = shown.entry ? `${shown.entry.source}: ${shown.entry.reason}` : '';
    const plain = own && shown.default ? `by itself ${shown.default}` : '';
    row.hint.textContent = wrong ? error.message : isAxis ? 'an axis of the scenario: the point above chooses its value'
      : [row.control.about, range && `Needed: ${range}.`, plain && `${plain}.`, source].filter(Boolean).join(' ');
    row.input.setAttribute('aria-invalid', wrong ? 'true' : 'false');
  }

  #fill(row, shown, text) {
    const { input, slider, control } = row;
    if (input.tagName === 'SELECT') {
      const value = text ?? (shown.value === null || shown.value === undefined ? '' : String(shown.value));
      if (![...input.options].some(option => option.value === value)) {
        input.prepend(make('option', { value }, value === '' ? 'suits the motor' : value));
      }
      input.value = value;
      return;
    }
    row.shown = text ?? shown.text;
    field(input, control.key, row.shown);
    input.placeholder = shown.default || (control.key === 'rotor.angle' ? 'drawn' : 'not set');
    if (slider && shown.slider) {
      row.span = shown.slider;
      const [low, high] = shown.slider;
      const value = typeof shown.value === 'number' ? shown.value : Number.NaN;
      if (document.activeElement !== slider || !slider.matches(':active')) {
        slider.value = String(Number.isNaN(value) ? 0 : (1000 * (value - low)) / (high - low));
      }
      slider.setAttribute('aria-valuetext', row.shown || 'not set');
    }
  }

  /** Where the scenario has axes, one point of them is looked at. */
  showPoints({ points }, point, choose) {
    if (points.length < 2) {
      this.points?.remove();
      this.points = null;
      return;
    }
    if (!this.points) {
      const select = make('select', { id: 'point', onchange: () => choose(Number(select.value)) });
      this.points = make('div', { id: 'points', class: 'row' }, make('label', { for: 'point' }, 'point of the axes'), select);
      this.place.before(this.points);
    }
    const select = this.points.lastElementChild;
    const names = points.slice(0, 500).map((text, k) => `${k}: ${text}`);
    if (select.options.length !== names.length) select.replaceChildren(...names.map((text, k) => make('option', { value: String(k) }, text)));
    select.value = String(point);
  }

  /** The motor's own numbers, as its data sheet has them. */
  #showSheet(values, set, axes, other, error) {
    const names = values.sheet.map(entry => entry.key).join();
    if (names !== this.sheetNames) {
      this.sheetNames = names;
      this.motor.body.replaceChildren();
      for (const row of this.motor.rows) this.rows.delete(row.control.key);
      this.motor.rows = values.sheet.map(entry => {
        const control = { key: entry.key, about: '', kind: 'text', unit: '', share: false, range: null };
        return this.#row(control, this.motor.body);
      });
    }
    for (const row of this.motor.rows) {
      const shown = this.#ofSheet(row.control.key, values);
      if (shown) this.#showRow(row.control.key, row, shown, set, axes, other, error);
    }
  }

  /** What each trial draws of its own: a line each, and one to add. */
  #tolerances(controls) {
    const entry = this.#table('Tolerances', false, []);
    this.tolerances = make('div', {});
    const keys = [...controls.map(control => control.key), 'motor.winding.resistance', 'motor.winding.mean_inductance', 'motor.winding.saliency'];
    const key = make('input', { type: 'text', list: 'tolerance-keys', 'aria-label': 'Key', placeholder: 'motor.winding.resistance', size: '22' });
    const kind = make('select', { 'aria-label': 'Distribution' }, make('option', {}, 'normal'), make('option', {}, 'uniform'));
    const width = make('input', { type: 'text', 'aria-label': 'Standard deviation, or half the width', placeholder: '5 %', size: '6' });
    const list = make('datalist', { id: 'tolerance-keys' }, ...keys.map(value => make('option', { value })));
    const add = make('button', { type: 'button', onclick: () => {
      if (key.value && width.value) this.set(`tolerances.${key.value}`, `{ ${kind.value} = "${width.value.replaceAll(/["\\]/g, '')}" }`, null);
    } }, 'Add');
    entry.body.append(make('p', { class: 'hint' }, 'Each trial draws its own value: normal with a standard deviation, or uniform with half a width; in per cent of the value or in its unit.'),
      this.tolerances, make('div', { class: 'add' }, key, kind, width, add, list));
  }

  #showTolerances(values, set) {
    const all = Object.entries(values.tolerances ?? {});
    this.tolerances.replaceChildren(...all.map(([key, tolerance]) => {
      const text = Object.entries(tolerance).map(([word, value]) => `${word} ${value}`).join(', ');
      const own = Object.hasOwn(set, `tolerances.${key}`);
      return make('p', { class: 'tolerance' }, make('code', { text: key }), ` ${text} `,
        own ? make('button', { type: 'button', 'aria-label': `Remove the tolerance of ${key}`, onclick: () => this.set(`tolerances.${key}`, null, null) }, '×') : null);
    }));
  }

  /** Shows only keys with these words. */
  filter(words) {
    this.wanted = words;
    const parts = words.toLowerCase().split(/\s+/).filter(Boolean);
    for (const { table, rows } of this.tables) {
      let any = false;
      for (const row of rows) {
        const text = `${row.control.key} ${row.control.about}`.toLowerCase().replaceAll('_', ' ');
        const fits = parts.every(part => text.includes(part.replaceAll('_', ' ')));
        row.element.hidden = !(fits && row.there !== false);
        any ||= !row.element.hidden;
      }
      table.hidden = parts.length > 0 ? !any : rows.length > 0 && !any;
      if (parts.length && any) table.open = true;
    }
  }
}
