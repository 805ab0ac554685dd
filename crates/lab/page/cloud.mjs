// Errors of many detections over the rotor's angle.
import { colours, fixed } from './words.mjs';
import { Picture, tickText, ticks } from './plot.mjs';

const [LEFT, RIGHT, TOP, BOTTOM] = [50, 78, 22, 36];

/** Points of one side, in arrays that grow. */
class Points {
  constructor() { this.clear(); }

  clear() {
    this.count = 0;
    this.trial = new Uint32Array(1024);
    this.angle = new Float32Array(1024);
    this.error = new Float32Array(1024);
    this.flags = new Uint8Array(1024);
    this.largest = 0;
  }

  add(trial, angle, error, verdict, wrong) {
    if (this.count === this.trial.length) {
      for (const name of ['trial', 'angle', 'error', 'flags']) {
        const grown = new this[name].constructor(2 * this.count);
        grown.set(this[name]);
        this[name] = grown;
      }
    }
    const k = this.count;
    [this.trial[k], this.angle[k], this.error[k], this.flags[k]] = [trial, angle, error, verdict | (wrong ? 4 : 0)];
    if (Math.abs(error) > this.largest) this.largest = Math.abs(error);
    this.count += 1;
  }

  /** The magnitude that all but a few do not exceed: a single outlier must not flatten the picture. */
  usual() {
    const step = Math.max(1, Math.floor(this.count / 4000));
    const some = [];
    for (let k = 0; k < this.count; k += step) if (!Number.isNaN(this.error[k])) some.push(Math.abs(this.error[k]));
    some.sort((a, b) => a - b);
    return some.length ? some[Math.min(some.length - 1, Math.floor(0.998 * some.length))] : 0;
  }
}

export class Cloud {
  /** `chosen(trial, side)` is called when a point is. */
  constructor(canvas, chosen) {
    this.canvas = canvas;
    this.chosen = chosen;
    this.sides = { a: new Points(), b: new Points() };
    this.both = false;
    this.range = 1;
    this.here = null;
    this.selected = null;
    // Ten thousand points are drawn once, and what moves over them for each picture.
    this.layer = document.createElement('canvas');
    this.stale = true;
    this.picture = new Picture(canvas, (context, width, height) => this.#draw(context, width, height));
    canvas.addEventListener('click', event => this.#click(event));
    canvas.addEventListener('pointermove', event => this.#hover(event));
    canvas.addEventListener('pointerleave', () => { this.hovered = null; this.dirty(false); });
    canvas.addEventListener('keydown', event => this.#key(event));
  }

  /** Draws anew; the points too, unless only what lies over them has changed. */
  dirty(withPoints = true) {
    this.stale ||= withPoints;
    this.picture.dirty();
  }

  /** Begins anew with the first points of a side; those before stay until then, so that nothing flickers. */
  begin(side) {
    this.sides[side].clear();
  }

  /** After some points: how far the axis goes. It grows at once and shrinks when all are there. */
  scale(finished) {
    const usual = Math.max(...['a', 'b'].map(side => (side === 'a' || this.both ? this.sides[side].usual() : 0)));
    const wanted = usual > 0 ? Math.min(1.25 * usual, 90) : 1;
    if (wanted > this.range || (finished && wanted < 0.7 * this.range) || !(this.range > 0)) this.range = wanted;
  }

  #frame(width, height) {
    const [x0, x1, y0, y1] = [LEFT, width - RIGHT, height - BOTTOM, TOP];
    const x = angle => x0 + (angle / 360) * (x1 - x0);
    const y = error => (y0 + y1) / 2 - (Math.min(Math.max(error / this.range, -1.04), 1.04) * (y0 - y1)) / 2;
    return { x0, x1, y0, y1, x, y };
  }

  #draw(context, width, height) {
    const colour = colours();
    const frame = this.#frame(width, height);
    const { canvas, layer } = this;
    if (this.stale || layer.width !== canvas.width || layer.height !== canvas.height) {
      [layer.width, layer.height] = [canvas.width, canvas.height];
      const below = layer.getContext('2d');
      below.scale(canvas.width / width, canvas.height / height);
      below.font = context.font;
      this.#axes(below, frame, colour, width, height);
      for (const side of this.both ? ['a', 'b'] : ['a']) this.#points(below, frame, colour, side, width);
      this.stale = false;
    }
    context.drawImage(layer, 0, 0, width, height);
    this.#marks(context, frame, colour);
  }

  #axes(context, { x0, x1, y0, y1, x, y }, colour, width, height) {
    context.lineWidth = 1;
    const errors = ticks(-this.range, this.range, Math.max(4, (y0 - y1) / 40));
    const angles = width < 480 ? [0, 90, 180, 270, 360] : [0, 60, 120, 180, 240, 300, 360];
    context.fillStyle = colour.quiet;
    context.strokeStyle = colour.grid;
    context.beginPath();
    context.textAlign = 'right';
    for (const tick of errors) {
      const at = Math.round(y(tick)) + 0.5;
      context.moveTo(x0, at);
      context.lineTo(x1, at);
      context.fillText(tickText(tick, errors), x0 - 6, at + 4);
    }
    context.textAlign = 'center';
    for (const tick of angles) {
      const at = Math.round(x(tick)) + 0.5;
      context.moveTo(at, y0);
      context.lineTo(at, y1);
      context.fillText(String(tick), at, y0 + 16);
    }
    context.stroke();
    context.strokeStyle = colour.line;
    context.strokeRect(x0 + 0.5, y1 + 0.5, x1 - x0 - 1, y0 - y1 - 1);
    context.beginPath();
    context.moveTo(x0, Math.round(y(0)) + 0.5);
    context.lineTo(x1, Math.round(y(0)) + 0.5);
    context.strokeStyle = colour.quiet;
    context.stroke();
    context.textAlign = 'left';
    context.fillText('error of the axis, °', x0, y1 - 8);
    context.textAlign = 'right';
    context.fillText('true angle, ° electrical', x1, height - 5);
  }

  #points(context, frame, colour, side, width) {
    const points = this.sides[side];
    const { x, y, y0, y1, x1 } = frame;
    const size = points.count > 30000 ? 1 : points.count > 4000 ? 1.7 : 2.6;
    context.fillStyle = colour[`side-${side}`];
    context.globalAlpha = points.count > 30000 ? 0.35 : points.count > 4000 ? 0.6 : 0.8;
    const odd = [];
    const bins = new Uint32Array(61);
    for (let k = 0; k < points.count; k += 1) {
      const error = points.error[k];
      if (points.flags[k] || Number.isNaN(error)) odd.push(k);
      if (Number.isNaN(error)) continue;
      if (!points.flags[k]) {
        // Squares for A, bars for B: the shape tells them apart without colour.
        if (side === 'a') context.fillRect(x(points.angle[k]) - size / 2, y(error) - size / 2, size, size);
        else context.fillRect(x(points.angle[k]) - size, y(error) - size / 4, 2 * size, size / 1.6);
      }
      bins[Math.max(0, Math.min(60, Math.floor(30.5 + (30 * error) / this.range)))] += 1;
    }
    context.globalAlpha = 1;
    for (const k of odd) this.#odd(context, frame, colour, points, k);
    // How they are distributed, beside the frame.
    const most = Math.max(...bins, 1);
    const room = Math.min(width - x1 - 12, RIGHT - 12);
    context.beginPath();
    const height = (y0 - y1) / 61;
    context.moveTo(x1 + 4, y0);
    for (let k = 0; k < 61; k += 1) {
      const at = x1 + 4 + (bins[k] / most) * room;
      context.lineTo(at, y0 - k * height);
      context.lineTo(at, y0 - (k + 1) * height);
    }
    context.lineTo(x1 + 4, y1);
    context.strokeStyle = colour[`side-${side}`];
    context.setLineDash(side === 'b' ? [4, 3] : []);
    if (side === 'a') {
      context.globalAlpha = 0.25;
      context.fill();
      context.globalAlpha = 1;
    }
    context.stroke();
    context.setLineDash([]);
  }

  /** Wrong poles are crosses, axes without a pole rings, no axis at all a stroke at the edge. */
  #odd(context, { x, y, y0 }, colour, points, k) {
    const [px, flags] = [x(points.angle[k]), points.flags[k]];
    const py = Number.isNaN(points.error[k]) ? y0 - 7 : y(points.error[k]);
    context.lineWidth = 1.6;
    context.strokeStyle = flags & 4 ? colour.bad : (flags & 3) >= 2 ? colour.ink : colour.odd;
    context.beginPath();
    if (flags & 4) {
      context.moveTo(px - 4, py - 4);
      context.lineTo(px + 4, py + 4);
      context.moveTo(px + 4, py - 4);
      context.lineTo(px - 4, py + 4);
    } else if ((flags & 3) >= 2) {
      context.moveTo(px, y0 - 12);
      context.lineTo(px, y0 - 2);
    } else context.arc(px, py, 3.2, 0, 7);
    context.stroke();
    context.lineWidth = 1;
  }

  #marks(context, { x, y, y0, y1 }, colour) {
    if (this.here) {
      const px = Math.round(x(this.here.angle)) + 0.5;
      context.strokeStyle = colour.ink;
      context.setLineDash([2, 3]);
      context.beginPath();
      context.moveTo(px, y1);
      context.lineTo(px, y0);
      context.stroke();
      context.setLineDash([]);
      if (Number.isFinite(this.here.error)) {
        context.lineWidth = 2;
        context.beginPath();
        context.arc(px, y(this.here.error), 6, 0, 7);
        context.fillStyle = colour.surface;
        context.fill();
        context.strokeStyle = colour.ink;
        context.stroke();
        context.lineWidth = 1;
      }
    }
    const { hovered } = this;
    if (!hovered) return;
    const points = this.sides[hovered.side];
    const k = hovered.index;
    const [px, py] = [x(points.angle[k]), Number.isNaN(points.error[k]) ? y0 - 7 : y(points.error[k])];
    context.strokeStyle = colour.ink;
    context.beginPath();
    context.arc(px, py, 5, 0, 7);
    context.stroke();
    const kind = points.flags[k] & 4 ? ', wrong pole' : ['', ', no pole', ', failed', ', not simulated'][points.flags[k] & 3];
    const text = `trial ${points.trial[k]}: ${fixed(points.error[k], 3)}° at ${fixed(points.angle[k], 1)}°${kind}`;
    const width = context.measureText(text).width + 12;
    const left = Math.min(Math.max(px - width / 2, 2), this.canvas.clientWidth - width - 2);
    const top = py > y1 + 34 ? py - 30 : py + 12;
    context.fillStyle = colour.ink;
    context.fillRect(left, top, width, 20);
    context.fillStyle = colour.surface;
    context.textAlign = 'left';
    context.fillText(text, left + 6, top + 14);
  }

  /** The nearest point to a place on the canvas. */
  #nearest(event, reach) {
    const box = this.canvas.getBoundingClientRect();
    const [px, py] = [event.clientX - box.left, event.clientY - box.top];
    const { x, y, y0 } = this.#frame(box.width, box.height);
    let best = { distance: reach * reach };
    for (const side of this.both ? ['a', 'b'] : ['a']) {
      const points = this.sides[side];
      for (let k = 0; k < points.count; k += 1) {
        const dx = x(points.angle[k]) - px;
        if (dx > reach || dx < -reach) continue;
        const dy = (Number.isNaN(points.error[k]) ? y0 - 7 : y(points.error[k])) - py;
        // What is odd is easier to hit.
        const distance = (dx * dx + dy * dy) * (points.flags[k] ? 0.3 : 1);
        if (distance < best.distance) best = { distance, side, index: k };
      }
    }
    return best.side ? best : null;
  }

  #hover(event) {
    this.hovered = this.#nearest(event, 12);
    this.canvas.classList.toggle('on-point', this.hovered !== null);
    this.dirty(false);
  }

  #click(event) {
    const found = this.#nearest(event, 16);
    if (found) this.chosen(this.sides[found.side].trial[found.index], found.side);
  }

  #key(event) {
    const way = { ArrowLeft: -1, ArrowRight: 1 }[event.key];
    if (!way) return;
    event.preventDefault();
    const points = this.sides.a;
    const order = [...Array(points.count).keys()].sort((i, j) => points.angle[i] - points.angle[j]);
    const place = order.findIndex(k => points.trial[k] === this.selected);
    const next = order[(place + way + order.length) % order.length];
    if (next !== undefined) this.chosen(points.trial[next], 'a');
  }

  /** The trial with the largest error, wrong poles first. */
  worst(side) {
    const points = this.sides[side];
    let best = -1;
    const size = k => (points.flags[k] & 4 ? 1000 : 0) + (Number.isNaN(points.error[k]) ? -1 : Math.abs(points.error[k]));
    for (let k = 0; k < points.count; k += 1) if (best < 0 || size(k) > size(best)) best = k;
    return best < 0 ? null : points.trial[best];
  }

  /** The next trial that is not simply found with its right pole. */
  nextOdd(side, after) {
    const points = this.sides[side];
    const odd = [];
    for (let k = 0; k < points.count; k += 1) if (points.flags[k]) odd.push(points.trial[k]);
    return odd.find(trial => trial > after) ?? odd[0] ?? null;
  }
}
