// Checks of what a newcomer meets first: when the lab can be used, and the converter of a data sheet's numbers.

import { execFileSync } from 'node:child_process';
import { resolve } from 'node:path';
import { browser, expect, open, used } from './desk.mjs';

/** A data sheet's numbers: those of `standstill convert`, in words and in the fields. */
export async function converter({ address }, program, picture) {
  for (const [width, scheme] of [[1280, 'light'], [1280, 'dark'], [390, 'light'], [390, 'dark']]) {
    const page = await open(address, `converter ${width} ${scheme}`, { width, height: 900, scheme });
    const field = key => page.locator(`#convert-${key}`);
    await page.click('#convert summary');
    await field('Kv').fill('900 rpm/V');
    await page.waitForSelector('#convert .hint.wrong');
    expect(/pole_pairs/.test(await page.textContent('#convert .hint')), 'no word of the pole pairs that are missing');
    await field('pole_pairs').fill('7');
    await field('resistance_line_to_line').fill('40 mohm');
    for (const [key, text] of [['L_d', '13.5 uH'], ['L_q', '16 uH']]) await field(key).fill(text);
    await page.waitForFunction(() => document.getElementById('convert-vesc_L').value !== '' && !document.querySelector('#convert .hint.wrong'));
    const told = JSON.parse(execFileSync(resolve(program), ['convert', 'pole_pairs=7', 'Kv=900 rpm/V', 'resistance_line_to_line=40 mohm', 'L_d=13.5 uH', 'L_q=16 uH', '--json'], { encoding: 'utf8' }));
    const typed = ['pole_pairs', 'Kv', 'resistance_line_to_line', 'L_d', 'L_q'];
    for (const { key, text, meaning } of told) {
      const there = key ? await field(key).inputValue() : await page.textContent('#convert');
      if (!typed.includes(key)) expect(key ? there === text : there.includes(meaning + text), `${key ?? meaning}: the page has ${there}, the program ${text}`);
    }
    expect(/^standstill convert .*'Kv=900 rpm\/V'/.test(await page.textContent('#convert-command')), 'no command to copy');
    expect(/^\[nameplate\]\n/.test(await page.textContent('#nameplate')), 'no data sheet to copy');
    // Another way of giving the same takes the place of the first.
    await field('vesc_lambda').fill('1 mWb');
    const other = JSON.parse(execFileSync(resolve(program), ['convert', 'pole_pairs=7', 'vesc_lambda=1 mWb', '--json'], { encoding: 'utf8' }));
    await page.waitForFunction(text => document.getElementById('convert-Kv').value === text, other.find(of => of.key === 'Kv').text);
    expect(await field('Kv').evaluate(input => !input.classList.contains('given')), 'two ways of giving the flux are given');
    expect(await page.evaluate(() => document.scrollingElement.scrollWidth <= innerWidth), `converter ${width}: wider than the window`);
    await page.locator('section.convert').scrollIntoViewIfNeeded();
    await page.locator('section.convert').screenshot({ path: picture(`converter-${scheme}-${width}.png`) });
    await page.close();
  }
}

/** How long until waveforms and controls answer: of an address that this browser has not seen before, and again. */
export async function readiness({ address }, isStrict) {
  const [times, costs] = [[], []];
  for (let k = 0; k < 5; k += 1) {
    const page = await browser.newPage();
    const before = used();
    await page.goto(address);
    await page.waitForSelector('html[data-usable]', { state: 'attached' });
    // What the machine's load does not change: processor time of page and engine, of which the first trials have a part.
    costs.push(used() - before);
    times.push(await page.evaluate(() => performance.getEntriesByName('usable')[0].startTime));
    await page.close();
  }
  const best = Math.min(...times);
  console.log(`usable after ${times.map(time => time.toFixed(0)).join(', ')} ms, of processor time ${costs.join(', ')} ms`);
  expect(best < (isStrict ? 1000 : 10_000), `usable after ${best.toFixed(0)} ms`);
}
