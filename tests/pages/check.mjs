// Looks at a page in a browser, as its readers do:
//
//     cd tests/pages && npm ci
//     node check.mjs PAGE.html FOLDER       # e.g. page.html of `cargo run -p standstill-report --example gallery FOLDER`
//
// Pictures go into FOLDER. Ends with code 1 and one line per objection. The browser is that of the environment
// variable CHROMIUM, or /usr/bin/chromium. Not part of `cargo test`: it needs a browser.

import { mkdirSync, mkdtempSync, rmSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join, resolve } from 'node:path';
import { pathToFileURL } from 'node:url';
import { chromium } from 'playwright-core';

const [file, folder] = process.argv.slice(2);
if (!file || !folder) {
  console.error('usage: node check.mjs PAGE.html FOLDER');
  process.exit(2);
}
const address = pathToFileURL(resolve(file)).href;
mkdirSync(folder, { recursive: true });
const picture = name => join(folder, name);

const objections = [];
const expect = (holds, what) => {
  if (!holds) objections.push(what);
};

const profile = mkdtempSync(join(tmpdir(), 'pages-'));
const browser = await chromium.launchPersistentContext(profile, {
  executablePath: process.env.CHROMIUM || '/usr/bin/chromium',
  headless: true,
  args: ['--no-sandbox', '--disable-gpu', '--disable-quic', '--no-first-run', '--disable-background-networking',
    '--disable-component-update', '--disable-sync'],
});

/** A page of its own context, with all complaints and requests collected. */
async function open(name, options = {}) {

  const page = await browser.newPage();
  page.on('console', message => {
    if (['error', 'warning'].includes(message.type())) objections.push(`${name}: console: ${message.text()}`);
  });
  page.on('pageerror', error => objections.push(`${name}: ${error.message}`));
  page.on('dialog', dialog => {
    objections.push(`${name}: a dialog opened: ${dialog.message()}`);
    dialog.dismiss();
  });
  page.on('request', request => {
    if (request.url() !== address && !/^(data|blob):/.test(request.url())) {
      objections.push(`${name}: asked the network for ${request.url()}`);
    }
  });
  if (options.width) await page.setViewportSize({ width: options.width, height: options.height || 900 });
  await page.emulateMedia({ colorScheme: options.scheme || 'light' });
  await page.goto(address);
  await page.waitForSelector('html[data-ready]', { state: 'attached', timeout: 30_000 });
  await page.waitForFunction(() => [...document.querySelectorAll('.chart')].every(
    chart => chart.querySelector('.drawn').hidden && chart.querySelector('.plot .main-svg')));
  return page;
}

const fits = page => page.evaluate(() => document.scrollingElement.scrollWidth <= innerWidth);
const background = page => page.evaluate(() => getComputedStyle(document.body).backgroundColor);

async function looks() {
  for (const scheme of ['light', 'dark']) {
    for (const width of [1280, 768, 360]) {
      const name = `${scheme}-${width}`;
      const page = await open(name, { scheme, width });
      expect(await fits(page), `${name}: the page is wider than the window`);
      await page.screenshot({ path: picture(`${name}.png`), fullPage: true });
      await page.screenshot({ path: picture(`${name}-top.png`) });
      await page.close();
    }
  }
}

/** On a phone no label is cut off, and none lies on another or under the buttons. */
async function labels() {
  const page = await open('labels', { width: 390, height: 844 });
  await page.waitForTimeout(500);
  const found = await page.evaluate(() => [...document.querySelectorAll('figure.chart')].flatMap(figure => {
    const plot = figure.querySelector('.plot');
    const frame = plot.getBoundingClientRect();
    const boxes = [...plot.querySelectorAll('.main-svg text')].filter(text => text.textContent.trim() && !text.closest('.hoverlayer'))
      .map(text => ({ text: text.textContent, box: text.getBoundingClientRect(), kind: text.closest('[class*=title]') ? 'title' : text.closest('.annotation') ? 'note' : 'tick' }))
      .filter(({ box }) => box.width > 0);
    const cut = boxes.filter(({ box }) => box.left < frame.left - 1 || box.right > frame.right + 1 || box.top < frame.top - 1 || box.bottom > frame.bottom + 1)
      .map(({ text }) => `${figure.id}: "${text}" is cut off`);
    const bars = [...plot.querySelectorAll('.modebar-group')].map(bar => ({ text: 'buttons', kind: 'buttons', box: bar.getBoundingClientRect() }));
    const meet = (a, b) => Math.min(a.box.right, b.box.right) - Math.max(a.box.left, b.box.left) > 3
      && Math.min(a.box.bottom, b.box.bottom) - Math.max(a.box.top, b.box.top) > 4;
    const all = [...boxes, ...bars];
    const on = all.flatMap((a, i) => all.slice(i + 1).filter(b => a.kind !== 'buttons' && !(a.kind === 'note' && b.kind === 'note') && meet(a, b))
      .map(b => `${figure.id}: "${a.text}" lies on "${b.text}"`));
    // Plotly leaves out texts of ticks that would reach beyond its frame.
    const layout = plot._fullLayout;
    const missing = Object.keys(layout).filter(name => /^xaxis/.test(name) && layout[name].ticktext && layout[name].type !== 'log').flatMap(name => {
      const axis = layout[name];
      const drawn = [...plot.querySelectorAll(`.${axis._id}tick text`)].map(text => text.textContent.replace(/\s/g, ''));
      return axis.ticktext.filter((text, i) => axis.tickvals[i] >= Math.min(...axis.range) && axis.tickvals[i] <= Math.max(...axis.range)
        && drawn.length && !drawn.includes(text.replace(/<br>|\s/g, ''))).map(text => `${figure.id}: the tick "${text}" has no text`);
    });
    return [...cut, ...on, ...missing];
  }));
  found.forEach(what => expect(false, `390 pixels: ${what}`));
  await page.close();
}

async function structure() {
  const page = await open('structure', { width: 1280 });
  const found = await page.evaluate(() => ({
    levels: [...document.querySelectorAll('h1,h2,h3,h4')].map(head => Number(head.tagName[1])),
    lang: document.documentElement.lang,
    unnamed: [...document.querySelectorAll('button')].filter(
      button => !button.textContent.trim() && !button.getAttribute('aria-label') && !button.dataset.title
        && !button.title).length,
    drawn: [...document.querySelectorAll('.drawn')].every(box => box.getAttribute('aria-label')),
    ids: [...document.querySelectorAll('[id]')].map(element => element.id),
  }));
  expect(found.levels[0] === 1 && found.levels.filter(level => level === 1).length === 1, 'not one h1 that is first');
  expect(found.levels.every((level, i) => i === 0 || level <= found.levels[i - 1] + 1), 'a heading skips a level');
  expect(found.lang === 'en', 'the language is not given');
  expect(found.unnamed === 0, `${found.unnamed} buttons without a name`);
  expect(found.drawn, 'a drawn figure without a description');
  await page.keyboard.press('Tab');
  const outlined = await page.evaluate(() => getComputedStyle(document.activeElement).outlineStyle !== 'none');
  expect(outlined, 'focus cannot be seen');
  await page.close();
}

async function chart() {
  const page = await open('chart', { width: 1280 });
  const charts = page.locator('figure.chart');
  for (let i = 0; i < await charts.count(); i += 1) {
    const one = charts.nth(i);
    const id = await one.getAttribute('id');
    const plot = one.locator('.plot');
    await one.scrollIntoViewIfNeeded();
    const range = () => plot.evaluate(element => [...element._fullLayout.xaxis.range]);
    const drag = plot.locator('.nsewdrag').first();
    await drag.scrollIntoViewIfNeeded();
    const box = await drag.boundingBox();

    // Somewhere along the middle there is something to read.
    let text = '';
    for (let step = 1; step < 40 && !text; step += 1) {
      await page.mouse.move(box.x + (box.width * step) / 40, box.y + box.height * (0.3 + 0.4 * ((step * 7) % 10) / 10));
      await page.waitForTimeout(60);
      text = (await plot.locator('.hoverlayer').textContent()).trim();
    }
    expect(text !== '', `chart ${id}: hovering shows nothing`);
    expect(!/NaN|undefined|%\{(fullData|customdata|text|y)/.test(text), `chart ${id}: the read-out is "${text}"`);
    await one.screenshot({ path: picture(`hover-${id}.png`) });

    const before = await range();
    await page.mouse.move(box.x + box.width * 0.3, box.y + box.height * 0.3);
    await page.mouse.down();
    await page.mouse.move(box.x + box.width * 0.5, box.y + box.height * 0.7, { steps: 6 });
    await page.mouse.up();
    await page.waitForTimeout(400);
    const zoomed = await range();
    expect(zoomed[1] - zoomed[0] < 0.5 * (before[1] - before[0]), `chart ${id}: dragging does not zoom`);
    await one.screenshot({ path: picture(`zoomed-${id}.png`) });
    const shown = await plot.locator('.xtick').count();
    expect(shown >= 1, `chart ${id}: no ticks after zooming`);

    // Colours change, the view does not.
    await page.evaluate(() => document.getElementById('theme').click());
    await page.waitForTimeout(200);
    expect(String(await range()) === String(zoomed), `chart ${id}: the view changed with the colours`);
    await page.evaluate(() => document.getElementById('theme').click());
    await page.waitForTimeout(200);
    await page.mouse.dblclick(box.x + box.width * 0.5, box.y + box.height * 0.5);
    await page.waitForTimeout(600);
    expect(String(await range()) === String(before), `chart ${id}: a double click does not reset`);

    const keys = one.locator('button.key');
    if (await keys.count() > 0) {
      const visible = () => plot.evaluate(element => element.data.filter(trace => trace.visible === true).length);
      const first = await visible();
      await keys.first().click();
      expect(await visible() < first, `chart ${id}: the legend does not hide`);
      expect(await keys.first().getAttribute('aria-pressed') === 'false', `chart ${id}: the key does not say so`);
      await page.waitForTimeout(500);
      await keys.first().click();
      expect(await visible() === first, `chart ${id}: the legend does not show again`);
    }
  }
  await page.close();
}

async function theme() {
  const page = await open('theme', { width: 1280 });
  const light = await background(page);
  const paper = () => page.evaluate(() => document.querySelector('.plot')?._fullLayout.paper_bgcolor);
  const chartLight = await paper();
  await page.click('#theme');
  await page.waitForTimeout(300);
  const dark = await background(page);
  expect(dark !== light, 'the button does not change the colours');
  expect(chartLight === undefined || await paper() !== chartLight, 'the charts do not follow the colours');
  await page.reload();
  await page.waitForSelector('html[data-ready]', { state: 'attached' });
  expect(await background(page) === dark, 'the choice of colours is not remembered');
  await page.evaluate(() => localStorage.clear());
  await page.close();
}

async function table() {
  const page = await open('table', { width: 1280 });
  const boxes = page.locator('div.table');
  for (let i = 0; i < await boxes.count(); i += 1) {
    const box = boxes.nth(i);
    const name = `table ${i + 1}`;
    const rows = await box.locator('tbody tr').count();
    const heads = box.locator('th');
    for (let column = 0; column < await heads.count(); column += 1) {
      const head = heads.nth(column);
      const numeric = await head.evaluate(element => element.classList.contains('number'));
      const cells = () => box.locator(`tbody td:nth-child(${column + 1})`).allTextContents();
      if (!await head.locator('button').count()) {
        const first = (await heads.first().textContent()).trim();
        expect(first === '', `${name}: column ${column + 1} cannot be sorted`);
        continue;
      }
      // A value with its interval or share in brackets is sorted by the value; what has none comes last.
      const value = cell => {
        const digits = cell.split(/[[(]/)[0].replace('−', '-').replace(/\s/g, '');
        return numeric ? (digits === '' ? NaN : Number(digits)) : cell;
      };
      const isKnown = cell => (numeric ? !Number.isNaN(value(cell)) : cell !== '');
      const start = Date.now();
      await head.locator('button').click();
      expect(await head.getAttribute('aria-sort') === 'ascending', `${name}: column ${column + 1} does not sort`);
      expect(Date.now() - start < 2000, `${name}: sorting is slow`);
      const up = await cells();
      await head.locator('button').click();
      const down = await cells();
      for (const [list, sign] of [[up, 1], [down, -1]]) {
        const known = list.filter(isKnown);
        const ordered = !numeric || known.every((cell, k) => k === 0 || sign * (value(cell) - value(known[k - 1])) >= 0);
        expect(ordered, `${name}: column ${column + 1} is not in order`);
        expect(list.slice(0, known.length).every(isKnown), `${name}: empty cells are not last`);
      }
    }
    const filter = box.locator('.filter input');
    expect((rows > 20) === (await filter.count() === 1), `${name}: ${rows} rows and the filter do not fit`);
    if (await filter.count()) {
      const word = (await box.locator('tbody tr').first().locator('td').last().textContent()).trim();
      await filter.fill(word);
      const left = await box.locator('tbody tr:not([hidden])').count();
      expect(left > 0 && left <= rows, `${name}: filtering leaves ${left} rows`);
      await filter.fill('no such row anywhere');
      expect(await box.locator('tbody tr:not([hidden])').count() === 0, `${name}: filtering leaves what it should not`);
      await filter.fill('');
      await box.locator('.scroll').evaluate(element => { element.scrollTop = 2000; });
      const gap = await box.evaluate(element => Math.abs(element.querySelector('th').getBoundingClientRect().top
        - element.querySelector('.scroll').getBoundingClientRect().top));
      expect(gap < 3, `${name}: the heads do not stay in sight`);
    }
    await box.scrollIntoViewIfNeeded();
    await box.screenshot({ path: picture(`table-${i + 1}.png`) });
  }
  const copy = page.locator('button.copy').first();
  if (await copy.count()) {
    await copy.click();
    await page.waitForTimeout(100);
    expect(/Copied|Selected/.test(await copy.textContent()), 'copying does nothing');
  }
  await page.close();
}

async function paper() {
  const page = await open('paper', { width: 1280, scheme: 'dark' });
  await page.pdf({ path: picture('print.pdf'), format: 'A4', printBackground: true });
  await page.emulateMedia({ media: 'print', colorScheme: 'dark' });
  const found = await page.evaluate(() => ({
    buttons: [...document.querySelectorAll('button')].filter(
      button => button.offsetParent && !button.closest('th')).length,
    drawn: [...document.querySelectorAll('.drawn')].every(box => box.offsetParent),
    live: [...document.querySelectorAll('.live')].some(box => box.offsetParent),
    ground: getComputedStyle(document.body).backgroundColor,
  }));
  expect(found.buttons === 0, `${found.buttons} buttons on paper`);
  expect(found.drawn && !found.live, 'not all charts are drawn on paper');
  expect(found.ground === 'rgb(255, 255, 255)', `paper is ${found.ground}`);
  await page.close();
}

async function withoutScripts() {
  const still = mkdtempSync(join(tmpdir(), 'pages-'));
  const context = await chromium.launchPersistentContext(still, {
    executablePath: process.env.CHROMIUM || '/usr/bin/chromium',
    headless: true,
    javaScriptEnabled: false,
    viewport: { width: 1280, height: 900 },
    args: ['--no-sandbox', '--disable-gpu', '--disable-quic', '--no-first-run', '--disable-background-networking',
      '--disable-component-update', '--disable-sync'],
  });
  const page = await context.newPage();
  await page.goto(address);
  const boxes = page.locator('.drawn');
  for (let i = 0; i < await boxes.count(); i += 1) {
    expect(await boxes.nth(i).isVisible(), `without scripts: drawn figure ${i + 1} is not shown`);
  }
  const buttons = page.locator('button:visible');
  expect(await buttons.count() === 0, 'without scripts there are buttons that do nothing');
  await page.screenshot({ path: picture('without-scripts.png'), fullPage: true });
  await page.setViewportSize({ width: 360, height: 800 });
  await page.screenshot({ path: picture('without-scripts-360.png'), fullPage: true });
  await context.close();
  rmSync(still, { recursive: true, force: true });
}

try {
  for (const check of [looks, labels, structure, chart, theme, table, paper, withoutScripts]) {
    try {
      await check();
    } catch (error) {
      objections.push(`${check.name}: ${error.message}`);
    }
  }
} finally {
  await browser.close();
  rmSync(profile, { recursive: true, force: true });
}
const different = [...new Set(objections)];
for (const objection of different) console.error(objection);
console.log(different.length ? `${different.length} objections` : 'no objections');
process.exitCode = different.length ? 1 : 0;
