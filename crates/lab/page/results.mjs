// Results in words: a detection, its values at a time, statistics.
import { fixed, make, number, shown } from './words.mjs';
import { lower } from './plot.mjs';

const PHASES = ['a', 'b', 'c'];

/** What a detection of a side came to. */
export function detection(side, of, both) {
  const wrong = of.pole_correct === false;
  const head = of.outcome === 'found'
    ? `${wrong ? 'Wrong pole' : 'Found'} ${fixed(of.estimate, 2)}°, error ${of.error >= 0 ? '+' : ''}${fixed(of.error, 3)}°`
    : of.outcome === 'undetermined' ? `Axis ${fixed(of.estimate % 180, 2)}°, pole undetermined` : `No angle: ${of.outcome}`;
  const facts = [
    ['rotor at', `${fixed(of.true_angle, 2)}°${Math.abs(of.moved) > 0.01 ? `, moved ${number(of.moved)}°` : ''}`],
    ['took', shown(of.duration, 's')],
    ['peak current', shown(of.peak_current, 'A')],
    of.mean_inductance && ['L_A, L_B', `${shown(of.mean_inductance, 'H')}, ${shown(of.saliency, 'H')}`],
    of.pole_evidence && ['pole evidence', `${number(of.pole_evidence[0])} σ, needed ${number(of.pole_evidence[1])}`],
    of.angle_deviation !== null && of.angle_deviation !== undefined && ['it claims', `± ${number(of.angle_deviation)}°`],
    of.reason && ['why', of.reason],
    ...(of.doubts ?? []).map(doubt => ['meant so?', doubt]),
  ].filter(Boolean);
  return make('div', { class: `outcome ${side} ${wrong ? 'bad' : of.outcome === 'found' ? 'good' : 'odd'}` },
    make('p', { class: 'headline' }, both ? make('i', { class: `dot ${side}` }) : null, both ? `${side.toUpperCase()} ` : '', head),
    make('dl', {}, ...facts.map(([name, value]) => make('div', {}, make('dt', { text: name }), make('dd', { text: value })))));
}

/** All values of a detection at a time, within a view from and to. */
export function values(side, one, cursor, [from, to], both) {
  const k = Math.min(Math.max(lower(one.time, cursor) - 1, 0), one.rows - 1);
  const next = Math.min(k + 1, one.rows - 1);
  const span = one.time[next] - one.time[k];
  const share = span > 0 ? Math.min(Math.max((cursor - one.time[k]) / span, 0), 1) : 0;
  const value = name => one[name][k] + share * (one[name][next] - one[name][k]);
  const row = make('dl', { class: 'values' });
  const put = (name, text, style) => row.append(make('div', {}, make('dt', { class: style ?? '', text: name }), make('dd', { text })));
  if (both) put('', side.toUpperCase(), `side ${side}`);
  for (const letter of PHASES) put(`i ${letter}`, `${fixed(value(`i_${letter}`), 3)} A`, `phase ${letter}`);
  for (const letter of PHASES) put(`v ${letter}`, `${fixed(value(`v_${letter}`), 1)} V`, `phase ${letter}`);
  put('u DC', `${fixed(value('u_dc'), 1)} V`);
  put('θ', `${fixed(((value('theta') % 360) + 360) % 360, 2)}°`);
  put('speed', `${number(value('omega'), 3)} rad/s`);
  put('torque', `${number(value('torque'), 3)} N m`);
  for (const [leg, letter] of PHASES.entries()) put(`leg ${letter}`, one.modes[one.leg[leg][next]], `phase ${letter}`);
  const near = lower(one.sample.time, cursor);
  const s = [near - 1, near].filter(i => i >= 0 && i < one.samples)
    .sort((i, j) => Math.abs(one.sample.time[i] - cursor) - Math.abs(one.sample.time[j] - cursor))[0];
  if (s !== undefined && Math.abs(one.sample.time[s] - cursor) < (to - from) / 100) {
    put('sample', `${PHASES.map(letter => fixed(one.sample[`i_${letter}`][s], 3)).join(', ')} A`);
    put('off by', `${PHASES.map(letter => fixed(1e3 * one.sample[`e_${letter}`][s], 1)).join(', ')} mA`);
  }
  return row;
}

/** Statistics, side by side, into a table; `of(side)` has those of a side. */
export function statistics(table, sides, of) {
  const rows = [
    ['trials', s => s.in_words.trials],
    ['rms error of the axis', s => s.in_words.rms],
    ['mean error', s => s.in_words.bias],
    ['95th percentile', s => s.in_words.p95],
    ['largest', s => (s.max_deg === null ? '–' : `${number(s.max_deg)}°`)],
    ['wrong pole', s => s.in_words.wrong, s => s.wrong_poles > 0],
    ['pole undetermined', s => s.in_words.undetermined],
    ['no angle', s => s.in_words.failed],
    [`angle off by > ${sides.length ? of(sides[0]).limit_deg : 2}°, where one was found`, s => s.in_words.beyond],
    ['detection takes', s => (s.mean_duration_s === null ? '–' : shown(s.mean_duration_s, 's'))],
    ['largest current', s => shown(s.peak_current_a, 'A')],
  ];
  table.tHead.replaceChildren(make('tr', {}, make('th', { scope: 'col' }, make('span', { class: 'hidden' }, 'quantity')),
    ...sides.map(side => make('th', { scope: 'col' }, make('i', { class: `dot ${side}` }), sides.length > 1 ? side.toUpperCase() : 'with 95 % interval'))));
  table.tBodies[0].replaceChildren(...rows.map(([name, text, bad]) => make('tr', {}, make('th', { scope: 'row' }, name),
    ...sides.map(side => make('td', { class: bad?.(of(side)) ? 'bad' : '' }, text(of(side)))))));
}

/** How B differs from A, and how surely. */
export function difference({ trials, axes, in_words, wrong, share, verdict }) {
  const chance = share.low > 0.5 || share.high < 0.5 ? 'more than chance' : 'no more than chance';
  const poles = wrong.a + wrong.b === 0 ? 'No trial in which only one of them names a wrong pole.'
    : `Wrong poles only in A: ${wrong.a}, only in B: ${wrong.b}, ${chance}.`;
  const of = axes < trials ? ` (${axes} in which both found an axis)` : '';
  return `B − A on the same ${trials} trials${of}: ${verdict}; rms ${in_words}. ${poles}`;
}
