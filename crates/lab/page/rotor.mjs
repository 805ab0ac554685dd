// The rotor's cross-section: one pole pair, electrical angles, counter-clockwise from the axis of phase a.

const SVG = 'http://www.w3.org/2000/svg';
const radians = degrees => (degrees * Math.PI) / 180;
const wrap = degrees => ((degrees % 360) + 360) % 360;
const at = (radius, degrees) => [radius * Math.cos(radians(degrees)), -radius * Math.sin(radians(degrees))];

function draw(parent, tag, attributes, text) {
  const element = document.createElementNS(SVG, tag);
  for (const [name, value] of Object.entries(attributes)) element.setAttribute(name, value);
  if (text !== undefined) element.textContent = text;
  parent.append(element);
  return element;
}

/** A ring's piece between two angles. */
function ring(inner, outer, from, to) {
  const large = to - from > 180 ? 1 : 0;
  const [a, b, c, d] = [at(outer, from), at(outer, to), at(inner, to), at(inner, from)];
  return `M${a}A${outer} ${outer} 0 ${large} 0 ${b}L${c}A${inner} ${inner} 0 ${large} 1 ${d}Z`;
}

export class Rotor {
  /** `moved(angle)` is called while a hand turns it. */
  constructor(svg, moved) {
    this.svg = svg;
    this.moved = moved;
    this.angle = 0;
    this.offset = null;
    this.#stator();
    this.disc = draw(svg, 'g', { class: 'disc' });
    this.truth = draw(svg, 'g', { class: 'truth' });
    this.estimates = ['a', 'b'].map(side => draw(svg, 'g', { class: `estimate ${side}`, visibility: 'hidden' }));
    this.#rotor(true);
    for (const group of this.estimates) {
      draw(group, 'line', { x1: 0, y1: 0, x2: 92, y2: 0 });
      draw(group, 'path', { d: 'M97 0l-11 -5v10z' });
      draw(group, 'line', { class: 'tail', x1: 0, y1: 0, x2: -92, y2: 0 });
    }
    svg.addEventListener('pointerdown', event => this.#begin(event));
    svg.addEventListener('pointermove', event => this.#move(event));
    for (const end of ['pointerup', 'pointercancel']) svg.addEventListener(end, () => this.#end());
    svg.addEventListener('keydown', event => this.#key(event));
  }

  #stator() {
    draw(this.svg, 'circle', { class: 'stator', r: 112 });
    draw(this.svg, 'circle', { class: 'gap', r: 74 });
    // A phase's axis is at a right angle to its coil: go and return 90 degrees before and behind it.
    for (const [k, letter] of ['a', 'b', 'c'].entries()) {
      const axis = 120 * k;
      for (const [side, sign] of [[90, '·'], [-90, '×']]) {
        draw(this.svg, 'path', { class: `coil ${letter}`, d: ring(78, 96, axis + side - 13, axis + side + 13) });
        const [x, y] = at(87, axis + side);
        draw(this.svg, 'text', { class: 'coil-mark', x, y: y + 4 }, sign);
      }
      const [x, y] = at(104, axis);
      draw(this.svg, 'text', { class: `axis ${letter}`, x, y: y + 4 }, letter);
      const [[x1, y1], [x2, y2]] = [at(75, axis), at(80, axis)];
      draw(this.svg, 'line', { class: `axis-line ${letter}`, x1, y1, x2, y2 });
    }
  }

  #rotor(magnet) {
    this.disc.replaceChildren();
    this.truth.replaceChildren();
    draw(this.disc, 'circle', { class: 'iron', r: 70 });
    if (magnet) {
      draw(this.disc, 'path', { class: 'north', d: ring(44, 66, -52, 52) });
      draw(this.disc, 'path', { class: 'south', d: ring(44, 66, 128, 232) });
    } else {
      for (const pole of [0, 180]) {
        for (const radius of [34, 46, 58]) {
          draw(this.disc, 'path', { class: 'barrier', d: ring(radius - 4, radius + 4, pole + 50, pole + 130) });
        }
      }
    }
    draw(this.disc, 'circle', { class: 'shaft', r: 13 });
    draw(this.truth, 'line', { x1: 0, y1: 0, x2: 60, y2: 0 });
    draw(this.truth, 'path', { d: 'M68 0l-13 -6v12z' });
    if (magnet) {
      // Beside the arrow, which lies along the axis.
      [this.north, this.south] = [['N', 30], ['S', 210]].map(([letter, degrees]) => {
        const [x, y] = at(55, degrees);
        return draw(this.disc, 'text', { class: 'pole', x, y: y + 5 }, letter);
      });
    }
    this.magnet = magnet;
    this.#turn();
  }

  /** What is known of the motor. */
  motor({ magnet }) {
    if (magnet !== this.magnet) this.#rotor(magnet);
  }

  /** Where it stands; not while a hand is on it, which knows better. */
  stand(angle) {
    if (this.offset === null) this.#set(angle);
  }

  /** What was found by a side: an angle, an axis without pole, or nothing. */
  found(side, estimate, isPole) {
    const group = this.estimates[side === 'a' ? 0 : 1];
    group.setAttribute('visibility', estimate === null || estimate === undefined ? 'hidden' : 'visible');
    group.classList.toggle('axis-only', !isPole);
    if (Number.isFinite(estimate)) group.setAttribute('transform', `rotate(${-estimate})`);
  }

  #set(angle) {
    this.angle = wrap(angle);
    this.#turn();
  }

  #turn() {
    const { angle } = this;
    const turn = `rotate(${-angle})`;
    this.disc.setAttribute('transform', turn);
    this.truth.setAttribute('transform', turn);
    for (const text of this.magnet ? [this.north, this.south] : []) {
      text.setAttribute('transform', `rotate(${angle} ${text.getAttribute('x')} ${text.getAttribute('y') - 5})`);
    }
    this.svg.setAttribute('aria-valuenow', angle.toFixed(1));
    this.svg.setAttribute('aria-valuetext', `${angle.toFixed(1)} degrees electrical`);
  }

  /** The angle of a pointer about the middle. */
  #pointed(event) {
    const box = this.svg.getBoundingClientRect();
    const [x, y] = [event.clientX - box.left - box.width / 2, event.clientY - box.top - box.height / 2];
    return (Math.atan2(-y, x) * 180) / Math.PI;
  }

  #begin(event) {
    if (event.button !== 0) return;
    event.preventDefault();
    this.svg.focus({ preventScroll: true });
    this.svg.setPointerCapture(event.pointerId);
    this.offset = this.angle - this.#pointed(event);
    this.svg.classList.add('held');
  }

  #move(event) {
    if (this.offset === null) return;
    // The last of those that came since the last frame is where the hand is now.
    this.#set(this.#pointed(event) + this.offset);
    this.moved(Number(this.angle.toFixed(event.shiftKey ? 0 : 1)));
  }

  #end() {
    this.offset = null;
    this.svg.classList.remove('held');
  }

  #key(event) {
    const step = { ArrowRight: -1, ArrowDown: -1, ArrowLeft: 1, ArrowUp: 1, PageUp: 30, PageDown: -30 }[event.key];
    let angle = step === undefined ? undefined : Math.round(10 * (this.angle + step * (event.shiftKey ? 10 : 1))) / 10;
    if (event.key === 'Home') angle = 0;
    if (angle === undefined) return;
    event.preventDefault();
    this.#set(angle);
    this.moved(Number(this.angle.toFixed(1)));
  }
}
