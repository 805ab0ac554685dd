// Waveforms of one detection, and of a second one laid over: panels over a common time.
import { values } from './results.mjs';
import { colours, make, quantity } from './words.mjs';
import { Picture, lower, tickText, ticks } from './plot.mjs';

const [LEFT, RIGHT, TOP, BOTTOM, GAP] = [56, 14, 8, 34, 26];
const LETTERS = ['a', 'b', 'c'];

/** Panels: their titles, shares of the height, columns. */
const PANELS = [
  { name: 'currents', title: 'phase currents, A', weight: 3.2, columns: ['i_a', 'i_b', 'i_c'], dots: true },
  { name: 'link', title: 'current of the DC link, A', weight: 1.4, columns: ['i_link'], read: ['i_link'] },
  { name: 'errors', title: 'readings beside the true currents, mA', weight: 1.4, sample: ['e_a', 'e_b', 'e_c'], factor: 1e3 },
  { name: 'potentials', title: 'terminal potentials, V', weight: 1.8, columns: ['v_a', 'v_b', 'v_c', 'u_dc'] },
  { name: 'modes', title: 'who conducts: upper half, upper device; filled, switch; outlined, diode', weight: 1.5 },
  { name: 'angle', title: 'rotor moved, ° electrical', weight: 1.2, columns: ['theta'] },
];

/** Many dots as small squares, one for each point of the screen: without a graphics card circles take four times as long. */
function squares(context, first, last, place, zero) {
  let [left, top] = [NaN, NaN];
  for (let i = first; i < last; i += 1) {
    const [px, py] = place(i).map(Math.round);
    if (px === left && py === top) continue;
    [left, top] = [px, py];
    if (zero !== undefined) context.fillRect(px, Math.min(py, zero), 1, Math.abs(py - zero));
    context.fillRect(px - 1, py - 1, 3, 3);
  }
}

export class Waves {
  constructor(canvas, readout) {
    this.canvas = canvas;
    this.readout = readout;
    this.found = { a: null, b: null };
    this.view = null;
    this.cursor = null;
    this.drag = null;
    this.picture = new Picture(canvas, (context, width, height) => this.#draw(context, width, height));
    this.#hands();
  }

  /** A detection of a side, or none. */
  show(side, detection) {
    this.found[side] = detection;
    // A rotor that moved less than a hundredth of a degree stood still for all that a picture shows.
    for (const one of [detection]) {
      if (one) one.moves = Math.abs(one.moved) > 1e-2;
    }
    this.dirty();
  }

  dirty() { this.picture.dirty(); }

  get end() { return Math.max(...this.#all().map(([, one]) => one.duration), 1e-6); }

  get span() { return this.view ?? [0, this.end]; }

  #all() { return Object.entries(this.found).filter(([, one]) => one && one.rows > 0); }

  /** Looks at these times. */
  look(from, to) {
    const end = this.end;
    const width = Math.min(Math.max(to - from, 2e-6), end);
    const begin = Math.min(Math.max(from, 0), end - width);
    this.view = width >= end * 0.999 ? null : [begin, begin + width];
    this.dirty();
  }

  zoom(factor, about) {
    const [from, to] = this.span;
    const middle = about ?? (this.cursor !== null && this.cursor >= from && this.cursor <= to ? this.cursor : (from + to) / 2);
    this.look(middle - (middle - from) * factor, middle + (to - middle) * factor);
  }

  all() { this.look(0, this.end); }

  /** The first pulse: from when a leg conducts to when none does, as far as that is near. */
  firstPulse() {
    const one = this.#all()[0]?.[1];
    if (!one) return;
    const conducts = k => one.leg.some(leg => leg[k] !== 6);
    let begin = 0;
    while (begin < one.rows && !conducts(begin)) begin += 1;
    let end = begin;
    while (end < one.rows && conducts(end)) end += 1;
    if (begin === one.rows) return;
    const from = one.time[begin];
    const width = Math.min(Math.max(one.time[Math.min(end, one.rows - 1)] - from, 20e-6), 2e-3);
    this.look(from - 0.15 * width, from + 1.25 * width);
  }

  #panels() {
    const moves = this.#all().some(([, one]) => one.moves);
    const sampled = this.#all().some(([, one]) => one.samples > 0);
    const link = this.#all().some(([, one]) => one.sample.i_link.some(Number.isFinite));
    const shows = { angle: moves, errors: sampled, link };
    return PANELS.filter(panel => shows[panel.name] ?? true);
  }

  #draw(context, width, height) {
    const shown = this.#all();
    if (!shown.length) return;
    const colour = colours();
    const panels = this.#panels();
    const [from, to] = this.span;
    const x = time => LEFT + ((time - from) / (to - from)) * (width - LEFT - RIGHT);
    const weight = panels.reduce((sum, panel) => sum + panel.weight, 0);
    const room = height - TOP - BOTTOM - GAP * panels.length;
    const wide = { from, to, x, width, height, colour, context, shown };
    let top = TOP;
    for (const panel of panels) {
      top += GAP - 8;
      const box = { top, bottom: top + (room * panel.weight) / weight };
      context.fillStyle = colour.quiet;
      context.textAlign = 'left';
      this.#title(context, panel.title, width, top - 6);
      if (panel.name === 'modes') this.#modes(wide, box);
      else this.#curves(wide, box, panel);
      top = box.bottom + 8;
    }
    this.#time(wide, height - BOTTOM + 4);
    this.#cursorLine(wide, height - BOTTOM);
    this.#tell();
  }

  #title(context, title, width, y) {
    let text = title;
    while (context.measureText(text).width > width - LEFT - RIGHT && text.includes(' ')) text = text.slice(0, text.lastIndexOf(' '));
    context.fillText(text.replace(/[;,:]$/, ''), LEFT, y);
  }

  #time({ from, to, x, width, context, colour }, y) {
    const unit = to - from < 2e-3 ? [1e-6, 'µs'] : to - from < 2 ? [1e-3, 'ms'] : [1, 's'];
    const all = ticks(from / unit[0], to / unit[0], Math.max(3, width / 110));
    context.fillStyle = colour.quiet;
    context.textAlign = 'center';
    for (const tick of all) context.fillText(tickText(tick, all), x(tick * unit[0]), y + 12);
    context.textAlign = 'right';
    context.fillText(`time, ${unit[1]}`, width - RIGHT, y + 26);
  }

  /** The extremes of columns over what is in view. */
  #range(panel, { from, to, shown }) {
    let [low, high] = [Infinity, -Infinity];
    const take = value => {
      if (value < low) low = value;
      if (value > high) high = value;
    };
    for (const [, one] of shown) {
      const columns = panel.sample ? panel.sample.map(name => one.sample[name]) : panel.columns.map(name => one[name]);
      const time = panel.sample ? one.sample.time : one.time;
      const [first, last] = [Math.max(lower(time, from) - 1, 0), Math.min(lower(time, to) + 1, time.length)];
      const base = panel.name === 'angle' ? one.theta[0] : 0;
      for (const column of columns) for (let k = first; k < last; k += 1) take((column[k] - base) * (panel.factor ?? 1));
    }
    if (!(high >= low)) return [-1, 1];
    if (panel.name === 'errors') {
      const most = Math.max(Math.abs(low), Math.abs(high), 1e-6);
      [low, high] = [-most, most];
    }
    // Of currents that are all zero, a range of 1 A; nine decimals fit beside no axis.
    const room = high === 0 && low === 0 ? 1 : Math.max((high - low) * 0.08, 1e-9 + Math.abs(high) * 1e-6);
    return [low - room, high + room];
  }

  #axes({ x, from, to, width, context, colour }, box, [low, high]) {
    const y = value => box.bottom - ((value - low) / (high - low)) * (box.bottom - box.top);
    context.strokeStyle = colour.grid;
    context.lineWidth = 1;
    const all = ticks(low, high, Math.max(2, (box.bottom - box.top) / 34));
    context.fillStyle = colour.quiet;
    context.textAlign = 'right';
    context.beginPath();
    for (const tick of all) {
      const at = Math.round(y(tick)) + 0.5;
      context.moveTo(LEFT, at);
      context.lineTo(width - RIGHT, at);
      context.fillText(tickText(tick, all), LEFT - 6, at + 4);
    }
    context.stroke();
    context.strokeStyle = colour.line;
    context.strokeRect(LEFT + 0.5, Math.round(box.top) + 0.5, width - LEFT - RIGHT - 1, Math.round(box.bottom - box.top));
    return y;
  }

  #curves(wide, box, panel) {
    const { context, colour, shown, width } = wide;
    const y = this.#axes(wide, box, this.#range(panel, wide));
    context.save();
    context.beginPath();
    context.rect(LEFT, box.top - 3, width - LEFT - RIGHT, box.bottom - box.top + 6);
    context.clip();
    for (const [side, one] of shown) {
      const second = side === 'b';
      const base = panel.name === 'angle' ? one.theta[0] : 0;
      for (const [k, name] of (panel.columns ?? []).entries()) {
        context.strokeStyle = k === 3 || ['angle', 'link'].includes(panel.name) ? colour.ink : colour[LETTERS[k]];
        context.setLineDash(second ? [6, 4] : k === 3 ? [2, 3] : []);
        context.lineWidth = k === 3 ? 1 : second ? 1.6 : 1.8;
        this.#line(wide, one, one[name], value => y(value - base));
      }
      context.setLineDash([]);
      if (panel.dots) this.#dots(wide, one, ['i_a', 'i_b', 'i_c'], y, second, 1);
      if (panel.read) this.#dots(wide, one, panel.read, y, second, 1);
      if (panel.sample) this.#dots(wide, one, panel.sample, y, second, panel.factor, y(0));
    }
    context.restore();
  }

  /** A column; of many rows, the extremes at each point of the screen. */
  #line({ from, to, x, width, context }, one, column, y) {
    const { time } = one;
    const [first, last] = [Math.max(lower(time, from) - 1, 0), Math.min(lower(time, to) + 1, time.length)];
    // A corner of many is narrower than a point of the screen: no one sees how it is joined.
    const isMany = last - first > 2 * width;
    context.lineJoin = isMany ? 'bevel' : 'round';
    context.beginPath();
    if (!isMany) {
      for (let k = first; k < last; k += 1) context.lineTo(x(time[k]), y(column[k]));
    } else {
      let k = first;
      let level = NaN;
      while (k < last) {
        const place = Math.floor(x(time[k]));
        let [low, high, end] = [Infinity, -Infinity, k];
        while (end < last && Math.floor(x(time[end])) === place) {
          const value = column[end];
          if (value < low) low = value;
          if (value > high) high = value;
          end += 1;
        }
        // A level that lasts needs its two ends alone.
        const isFlat = high === low && low === level && end < last && column[end] === level;
        if (!isFlat) {
          context.lineTo(place, y(column[k]));
          if (high > low) {
            context.lineTo(place, y(low));
            context.lineTo(place, y(high));
          }
          context.lineTo(place, y(column[end - 1]));
        }
        level = column[end - 1];
        k = end;
      }
    }
    context.stroke();
  }

  #dots({ from, to, x, context, colour }, one, names, y, second, factor, zero) {
    const { time } = one.sample;
    const [first, last] = [lower(time, from), lower(time, to)];
    const isMany = last - first > 400;
    const size = isMany ? 1.5 : 2.6;
    for (const [k, name] of names.entries()) {
      const column = one.sample[name];
      context.fillStyle = colour[LETTERS[k]];
      context.strokeStyle = colour[LETTERS[k]];
      context.lineWidth = 1;
      const place = i => [x(time[i]) + (zero === undefined ? 0 : (k - 1) * 3), y(column[i] * factor)];
      if (isMany && !second) {
        squares(context, first, last, place, zero);
        continue;
      }
      context.beginPath();
      for (let i = first; i < last; i += 1) {
        const [px, py] = place(i);
        if (zero !== undefined) {
          context.moveTo(px, zero);
          context.lineTo(px, py);
        }
        context.moveTo(px + size, py);
        context.arc(px, py, size, 0, 7);
      }
      if (second) context.stroke();
      else {
        context.fill();
        if (zero !== undefined) context.stroke();
      }
    }
  }

  #modes({ from, to, x, width, context, colour, shown }, box) {
    const lane = (box.bottom - box.top) / 3;
    for (const leg of [0, 1, 2]) {
      const top = box.top + leg * lane + 2;
      const half = (lane - 4) / 2;
      context.fillStyle = colour.quiet;
      context.textAlign = 'right';
      context.fillText(`leg ${LETTERS[leg]}`, LEFT - 6, top + half + 4);
      context.strokeStyle = colour.grid;
      context.beginPath();
      context.moveTo(LEFT, top + half);
      context.lineTo(width - RIGHT, top + half);
      context.stroke();
      for (const [side, one] of shown) {
        const modes = one.leg[leg];
        const { time } = one;
        const [first, last] = [Math.max(lower(time, from) - 1, 0), Math.min(lower(time, to) + 1, time.length)];
        context.fillStyle = colour[LETTERS[leg]];
        context.strokeStyle = colour[LETTERS[leg]];
        context.lineWidth = 1;
        context.globalAlpha = side === 'b' ? 0.45 : 1;
        for (let k = first; k < last; ) {
          let end = k + 1;
          while (end < last && modes[end] === modes[k]) end += 1;
          const mode = modes[k];
          if (mode !== 6) {
            const [x0, x1] = [Math.max(x(time[k]), LEFT), Math.min(x(time[Math.min(end, last - 1)]), width - RIGHT)];
            const upper = mode === 0 || mode === 1 || mode === 4;
            const thin = side === 'b' ? 0.4 : 1;
            const y0 = upper ? top + half * (1 - thin) : top + half + 1;
            if (mode === 1 || mode === 3) {
              context.strokeRect(x0 + 0.5, y0 + 0.5, Math.max(x1 - x0 - 1, 0.2), half * thin - 2);
            } else context.fillRect(x0, y0, Math.max(x1 - x0, 0.6), half * thin - 1);
          }
          k = end;
        }
        context.globalAlpha = 1;
      }
    }
    context.strokeStyle = colour.line;
    context.strokeRect(LEFT + 0.5, Math.round(box.top) + 0.5, width - LEFT - RIGHT - 1, Math.round(box.bottom - box.top));
  }

  #cursorLine({ from, to, x, context, colour }, bottom) {
    if (this.drag && this.drag.kind === 'zoom') {
      const [x0, x1] = [this.drag.x0, this.drag.x].sort((a, b) => a - b);
      context.fillStyle = colour.select;
      context.fillRect(x0, TOP, x1 - x0, bottom - TOP);
    }
    if (this.cursor === null || this.cursor < from || this.cursor > to) return;
    context.strokeStyle = colour.ink;
    context.lineWidth = 1;
    context.setLineDash([3, 3]);
    context.beginPath();
    context.moveTo(x(this.cursor), TOP);
    context.lineTo(x(this.cursor), bottom);
    context.stroke();
    context.setLineDash([]);
  }

  /** All values at the cursor, in words. */
  #tell() {
    if (this.cursor === null) {
      if (this.readout.dataset.empty !== 'yes') {
        this.readout.dataset.empty = 'yes';
        this.readout.replaceChildren(make('span', { class: 'hint', text: 'Point at the waveforms to read all values; drag to zoom, Shift and drag to move, double click for all.' }));
      }
      return;
    }
    this.readout.dataset.empty = 'no';
    const rows = this.#all().map(([side, one]) => values(side, one, this.cursor, this.span, this.#all().length > 1));
    this.readout.replaceChildren(make('span', { class: 'at', text: `t = ${quantity(this.cursor, 's', false, 6)}` }), ...rows);
  }

  #hands() {
    const { canvas } = this;
    const time = event => {
      const [from, to] = this.span;
      const box = canvas.getBoundingClientRect();
      return from + ((event.clientX - box.left - LEFT) / (box.width - LEFT - RIGHT)) * (to - from);
    };
    const within = event => event.clientX - canvas.getBoundingClientRect().left;
    canvas.addEventListener('pointerdown', event => {
      if (event.button !== 0) return;
      canvas.setPointerCapture(event.pointerId);
      const kind = event.shiftKey || event.pointerType === 'touch' ? 'pan' : 'zoom';
      this.drag = { kind, x0: within(event), x: within(event), from: time(event), span: this.span };
    });
    canvas.addEventListener('pointermove', event => {
      this.cursor = Math.min(Math.max(time(event), 0), this.end);
      if (this.drag) {
        this.drag.x = within(event);
        if (this.drag.kind === 'pan' && this.view) {
          const by = ((this.drag.x0 - this.drag.x) / (canvas.clientWidth - LEFT - RIGHT)) * (this.drag.span[1] - this.drag.span[0]);
          this.look(this.drag.span[0] + by, this.drag.span[1] + by);
        }
      }
      this.dirty();
    });
    const end = event => {
      const { drag } = this;
      this.drag = null;
      if (drag && drag.kind === 'zoom' && Math.abs(within(event) - drag.x0) > 5) {
        const [from, to] = [drag.from, time(event)].sort((a, b) => a - b);
        this.look(from, to);
      }
      this.dirty();
    };
    canvas.addEventListener('pointerup', end);
    canvas.addEventListener('pointercancel', () => { this.drag = null; this.dirty(); });
    canvas.addEventListener('dblclick', () => this.all());
    canvas.addEventListener('wheel', event => {
      // Without a key the wheel moves the page, as everywhere.
      if (!event.ctrlKey && !event.metaKey && document.activeElement !== canvas) return;
      event.preventDefault();
      this.zoom(Math.exp(event.deltaY * 0.002), time(event));
    }, { passive: false });
    canvas.addEventListener('keydown', event => this.#key(event));
  }

  #key(event) {
    const [from, to] = this.span;
    const width = to - from;
    const way = { ArrowLeft: -1, ArrowRight: 1 }[event.key];
    if (way && event.shiftKey) this.look(from + way * 0.2 * width, to + way * 0.2 * width);
    else if (way) {
      this.cursor = Math.min(Math.max((this.cursor ?? (from + to) / 2) + way * width * 0.005, 0), this.end);
      if (this.cursor < from || this.cursor > to) this.look(this.cursor - width / 2, this.cursor + width / 2);
    } else if (event.key === '+' || event.key === '=') this.zoom(0.5);
    else if (event.key === '-') this.zoom(2);
    else if (event.key === '0' || event.key === 'Home') this.all();
    else if (event.key === 'Escape') this.cursor = null;
    else return;
    event.preventDefault();
    this.dirty();
  }
}
