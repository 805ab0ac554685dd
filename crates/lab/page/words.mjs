// Numbers for people.

// The table of crates/quantity/src/prefix.rs; a test compares them.
const PREFIXES = [[1e6, 'M'], [1e3, 'k'], [1, ''], [1e-3, 'm'], [1e-6, 'µ'], [1e-9, 'n'], [1e-12, 'p']];
const PLAIN = new Set(['deg', '°C', '']);

const trimmed = (value, digits) => String(Number(value.toPrecision(digits)));

/** A value in SI with the prefix that suits it, as a scenario takes it. */
export function quantity(value, unit, share, digits = 3) {
  if (share) return `${trimmed(100 * value, digits)} %`;
  if (value === 0 || PLAIN.has(unit)) return `${trimmed(value, digits)} ${unit === 'deg' ? '°' : unit}`.trim();
  const size = Math.abs(Number(value.toPrecision(digits)));
  const [factor, prefix] = PREFIXES.find(([factor]) => size >= factor * (1 - 1e-9)) ?? PREFIXES.at(-1);
  return `${trimmed(value / factor, digits)} ${prefix}${unit}`;
}

/** The same to read and not to type: with a true minus sign. */
export const shown = (value, unit) => quantity(value, unit, false).replace('-', '−');

/** With so many digits, and a true minus sign. */
export function number(value, digits = 3) {
  if (value === null || value === undefined || Number.isNaN(value)) return '–';
  const size = Math.abs(value);
  const text = size !== 0 && (size < 1e-4 || size >= 1e6) ? value.toExponential(digits - 1) : trimmed(value, digits);
  return text.replace('-', '−');
}

/** With so many decimals. */
export const fixed = (value, decimals) =>
  (Number.isFinite(value) ? value.toFixed(decimals).replace(/^-(0\.?0*)$/, '$1') : '–').replace('-', '−');

/** An element with attributes and children. */
export function make(tag, attributes = {}, ...children) {
  const element = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) {
    if (value === undefined || value === null || value === false) continue;
    if (name.startsWith('on')) element.addEventListener(name.slice(2), value);
    else if (name === 'text') element.textContent = value;
    else element.setAttribute(name, value === true ? '' : value);
  }
  element.append(...children.filter(child => child !== null && child !== undefined));
  return element;
}

/** Fills a place with `parts()` where what it says differs from what it said: a page that stays needs no layout. */
export function renew(place, says, parts) {
  const said = JSON.stringify(says);
  if (place.said === said) return;
  place.said = said;
  place.replaceChildren(...parts());
}

/** Colours of the page, as CSS has them now. */
export function colours() {
  const style = getComputedStyle(document.documentElement);
  return new Proxy({}, { get: (known, name) => (known[name] ??= style.getPropertyValue(`--${name}`).trim()) });
}
