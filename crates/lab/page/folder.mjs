// What lies in the lab's folder: scenarios to open, reports of finished runs, runs that are under way.
import { make } from './words.mjs';

const ago = seconds => (seconds < 90 ? `${Math.round(seconds)} s` : seconds < 5400 ? `${Math.round(seconds / 60)} min` : `${Math.round(seconds / 3600)} h`);

export class Files {
  /** `open(path)` opens a scenario in the lab. */
  constructor(place, engine, open) {
    this.place = place;
    this.engine = engine;
    this.open = open;
    this.timer = null;
  }

  /** Shows and hides its section; `say(message)` says what goes wrong. */
  behind(button, section, say) {
    button.hidden = false;
    button.addEventListener('click', () => {
      const opened = section.hidden;
      section.hidden = !opened;
      button.setAttribute('aria-expanded', String(opened));
      if (opened) this.show().catch(error => say(error.message));
      else this.hide();
    });
  }

  async show() {
    const { entries } = await this.engine.folder();
    this.place.replaceChildren();
    if (!entries?.length) this.place.append(make('p', {}, 'No scenarios and no runs here.'));
    const scenarios = entries.filter(entry => entry.kind === 'scenario');
    const runs = entries.filter(entry => entry.kind !== 'scenario');
    if (scenarios.length) {
      this.place.append(make('h3', {}, 'Scenarios'), make('ul', { class: 'files' }, ...scenarios.map(({ path }) =>
        make('li', {}, make('button', { type: 'button', onclick: () => this.open(path) }, path)))));
    }
    if (runs.length) this.place.append(make('h3', {}, 'Runs'), make('ul', { class: 'files' }, ...runs.map(run => this.#run(run))));
    this.#follow(runs);
  }

  hide() {
    clearTimeout(this.timer);
  }

  #run({ kind, path }) {
    const shown = path || '(this folder)';
    const report = kind === 'run'
      ? make('a', { href: this.engine.report(path || '.'), target: '_blank', rel: 'noopener' }, 'Report')
      : make('span', { class: 'hint' }, 'not finished');
    return make('li', { 'data-path': path }, make('strong', { text: shown }), ' ', report, make('div', { class: 'journals' }));
  }

  /** Reads the journals again every other second, as long as somebody looks. */
  async #follow(runs) {
    clearTimeout(this.timer);
    for (const { path } of runs) {
      const place = this.place.querySelector(`li[data-path="${CSS.escape(path)}"] .journals`);
      if (!place) continue;
      try {
        const { journals } = await this.engine.progress(path || '.');
        place.replaceChildren(...journals.map(journal => this.#journal(journal)));
      } catch (error) {
        place.replaceChildren(make('p', { class: 'hint', text: error.message }));
        if (error.lost) return;
      }
    }
    if (runs.length && this.place.isConnected && !this.place.closest('[hidden]')) this.timer = setTimeout(() => this.#follow(runs), 2000);
  }

  #journal({ name, done, all, finished, changed, in_words, point, points }) {
    const state = finished ? 'all trials done' : changed < 15 ? 'running' : `no row for ${ago(changed)}: interrupted, or slow; --resume goes on`;
    const says = !done ? 'no row yet' : in_words ? `rms ${in_words.rms}, wrong poles ${in_words.wrong}` : `point ${point + 1} of ${points}`;
    return make('div', { class: 'journal' },
      make('progress', { max: all, value: done, 'aria-label': `${name}: ${done} of ${all} trials` }),
      make('span', {}, ` ${done} of ${all} trials${points > 1 ? ` at ${points} points` : ''}, ${state}. `), make('span', { class: 'hint', text: says }));
  }
}
