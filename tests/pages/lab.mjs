// Uses the lab in a browser, as its users do:
//
//     cd tests/pages && npm ci
//     node lab.mjs PROGRAM FOLDER          # PROGRAM: the path of `standstill`
//     node lab.mjs static SITE FOLDER PROGRAM   # SITE: what scripts/lab-static.sh made; PROGRAM: whose numbers it must have
//
// With STRICT=1 the times by the clock must be those that docs/lab.md promises, which takes an idle machine.
// Pictures go into FOLDER. Ends with code 1 and one line per objection. The browser is that of the environment variable
// CHROMIUM, or /usr/bin/chromium. Not part of `cargo test`: it needs a browser.

import { execFileSync, spawn } from 'node:child_process';
import { mkdirSync, mkdtempSync, readFileSync, rmSync, writeFileSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join, resolve } from 'node:path';
import { advised, broken, doubtful, phone, stale, undo } from './trouble.mjs';
import { converter, readiness } from './first.mjs';
import { browser, children, end, expect, ink, lab, listen, objections, open, report, rms, settled, site, sleep, state, used } from './desk.mjs';

const words = process.argv.slice(2);
const isStatic = words[0] === 'static';
const [place, folder] = isStatic ? words.slice(1) : words;
const program = isStatic ? words[3] : place;
if (!program || !folder) {
  console.error('usage: node lab.mjs PROGRAM FOLDER, or node lab.mjs static SITE FOLDER PROGRAM');
  process.exit(2);
}
mkdirSync(folder, { recursive: true });
const picture = name => join(folder, name);
const isStrict = Boolean(process.env.STRICT);

const desk = mkdtempSync(join(tmpdir(), 'lab-'));
writeFileSync(join(desk, 'noisy.toml'), 'detector.method = "bipolar"\nsensors.noise = "40 mA"\n');
writeFileSync(join(desk, 'axes.toml'), '[axes]\n"sensors.noise" = ["1 mA", "40 mA"]\n');

async function looks({ address }) {
  for (const scheme of ['light', 'dark']) {
    for (const width of [360, 768, 1440, 2560]) {
      const name = `${scheme}-${width}`;
      const page = await open(address, name, { scheme, width, height: width > 2000 ? 1300 : 900 });
      expect(await page.evaluate(() => document.scrollingElement.scrollWidth <= innerWidth), `${name}: wider than the window`);
      for (const id of ['waves', 'cloud']) expect(await ink(page, id) > 0.01, `${name}: ${id} is empty`);
      await page.screenshot({ path: picture(`${name}.png`), fullPage: width < 2000 });
      await page.close();
    }
  }
}

async function structure({ address }) {
  const page = await open(address, 'structure');
  const found = await page.evaluate(() => ({
    levels: [...document.querySelectorAll('h1,h2,h3')].filter(head => head.offsetParent).map(head => Number(head.tagName[1])),
    unnamed: [...document.querySelectorAll('button,input,select,[role=slider],[role=application]')].filter(element => !element.labels?.length
      && !element.textContent.trim() && !element.getAttribute('aria-label') && !element.title).map(element => element.outerHTML.slice(0, 80)),
    ids: [...document.querySelectorAll('[id]')].map(element => element.id),
  }));
  expect(found.levels[0] === 1 && found.levels.every((level, k) => k === 0 || level <= found.levels[k - 1] + 1), `headings: ${found.levels}`);
  expect(found.unnamed.length === 0, `without a name: ${found.unnamed}`);
  expect(new Set(found.ids).size === found.ids.length, 'an id stands twice');
  // All can be reached and seen with the keyboard alone.
  await page.keyboard.press('Tab');
  expect(await page.evaluate(() => getComputedStyle(document.activeElement).outlineStyle !== 'none'), 'focus cannot be seen');
  await page.focus('#rotor');
  await page.keyboard.press('ArrowUp');
  await page.keyboard.press('ArrowUp');
  const before = await page.evaluate(() => Number(document.getElementById('rotor').getAttribute('aria-valuenow')));
  await page.keyboard.press('PageUp');
  const after = await page.evaluate(() => Number(document.getElementById('rotor').getAttribute('aria-valuenow')));
  expect(Math.abs(((after - before + 540) % 360) - 180 - 30) < 0.2, `the keyboard turns the rotor from ${before} to ${after}`);
  await page.focus('#waves');
  await page.keyboard.press('ArrowRight');
  // What a key does is drawn with the next picture.
  const comes = (what, complaint) => page.waitForFunction(what, null, { timeout: 5000 }).catch(() => expect(false, complaint));
  await comes(() => /t = .*i a/s.test(document.getElementById('readout').textContent), 'the keyboard moves no cursor');
  await page.keyboard.press('+');
  await comes(() => globalThis.lab.waves.span[1] - globalThis.lab.waves.span[0] < 0.6 * globalThis.lab.waves.end, 'the keyboard does not zoom');
  await page.close();
}

async function drag({ address, child }) {
  const page = await open(address, 'drag');
  const box = await page.locator('#rotor').boundingBox();
  const [cx, cy] = [box.x + box.width / 2, box.y + box.height / 2];
  const at = degrees => [cx + 0.28 * box.width * Math.cos((degrees * Math.PI) / 180), cy - 0.28 * box.width * Math.sin((degrees * Math.PI) / 180)];
  const first = await page.evaluate(() => globalThis.lab.waves.found.a.start_angle);
  await page.mouse.move(...at(10));
  await page.mouse.down();
  // From the hand to the picture: what the page itself took between an event and the picture that shows it.
  await page.evaluate(() => {
    const { lab } = globalThis;
    const times = [];
    globalThis.times = times;
    let moved = null;
    document.getElementById('rotor').addEventListener('pointermove', () => { moved ??= performance.now(); }, true);
    const show = lab.waves.show.bind(lab.waves);
    lab.waves.show = (side, found) => {
      show(side, found);
      const since = moved;
      moved = null;
      if (since !== null) requestAnimationFrame(() => setTimeout(() => times.push(performance.now() - since)));
    };
  });
  const spent = [used(), child ? used(child.pid) : 0];
  for (let k = 1; k <= 40; k += 1) {
    await page.mouse.move(...at(10 + 2 * k));
    await sleep(25);
  }
  const [shown, answered] = [used() - spent[0], child ? used(child.pid) - spent[1] : 0];
  await page.mouse.up();
  await sleep(400);
  const found = await page.evaluate(() => ({ angle: globalThis.lab.state.angle, shown: globalThis.lab.waves.found.a.start_angle, times: globalThis.times }));
  const turned = ((found.angle - first + 540) % 360) - 180;
  expect(Math.abs(turned - 80) < 3, `dragging by 80° turned the rotor by ${turned}°`);
  expect(Math.abs(found.shown - found.angle) < 0.06, `the waveforms are of ${found.shown}°, the rotor is at ${found.angle}°`);
  const times = found.times.sort((a, b) => a - b);
  const median = times[times.length >> 1];
  console.log(`hand to picture: median ${median?.toFixed(0)} ms, largest ${times.at(-1)?.toFixed(0)} ms, of ${times.length}`);
  // What it costs is what the machine's load does not change: processor time of the page and of the lab for each picture.
  const cost = (shown + answered) / times.length;
  console.log(`processor time of a picture: ${cost.toFixed(1)} ms, of that ${(answered / times.length).toFixed(1)} ms of the lab`);
  expect(cost < 50, `a picture takes ${cost.toFixed(0)} ms of processor time`);
  expect(times.length > 10 && median < (isStrict ? 50 : 250), `hand to picture: ${times.map(time => time.toFixed(0))}`);
  await page.click('#undo');
  expect((await state(page)).angle === null, 'a drag is not one step of undo');
  await page.click('#redo');
  expect(Math.abs((await state(page)).angle - found.angle) < 1e-9, 'redo does not turn it again');
  await page.close();
}

async function type({ address }) {
  const page = await open(address, 'type');
  const plain = await rms(page);
  await page.fill('#find', 'noise');
  await page.fill('#key-sensors-noise', '60');
  await page.keyboard.press('Enter');
  await page.waitForFunction(old => globalThis.lab.summaries.a.summary.rms_deg.value > 1.5 * old, plain);
  await settled(page);
  expect((await state(page)).a['sensors.noise'] === '60 mA', `a number without a unit is ${(await state(page)).a['sensors.noise']}`);
  expect(/noise = 0.06/.test(await page.textContent('#toml')), 'the text does not have the noise');
  expect(/-s 'sensors.noise=60 mA'/.test(await page.textContent('#trace')), 'the command does not have the noise');
  await page.fill('#key-sensors-noise', '-3 A');
  await page.keyboard.press('Enter');
  await page.waitForSelector('#wrong:not([hidden])');
  expect(/zero or more/.test(await page.textContent('#wrong')), 'no word of what is wrong');
  expect(await page.getAttribute('#key-sensors-noise', 'aria-invalid') === 'true', 'the key is not marked');
  await page.screenshot({ path: picture('wrong.png') });
  await page.click('#wrong button');
  await page.waitForSelector('#wrong', { state: 'hidden' });
  await page.fill('#find', '');
  // A slider: the cloud follows while the hand is on it.
  const slider = page.locator('.row[data-key="sensors.noise"] input[type=range]');
  await slider.scrollIntoViewIfNeeded();
  const box = await slider.boundingBox();
  await page.mouse.move(box.x + box.width * 0.3, box.y + box.height / 2);
  await page.mouse.down();
  for (let k = 0; k < 20; k += 1) {
    await page.mouse.move(box.x + box.width * (0.3 + 0.03 * k), box.y + box.height / 2);
    // A hand that rests on the slider is still on it.
    await sleep(k === 10 ? 900 : 20);
  }
  await page.mouse.up();
  await settled(page);
  const slid = (await state(page)).a['sensors.noise'];
  expect(slid !== '60 mA', 'the slider sets nothing');
  await page.click('#undo');
  expect((await state(page)).a['sensors.noise'] === '60 mA', `a slide is not one step of undo: ${slid}, then ${(await state(page)).a['sensors.noise']}`);
  // Another method: its keys come, those that it lacks go.
  await page.selectOption('#key-detector-method', 'hfi-rotating');
  await page.waitForFunction(() => globalThis.lab.values.a.method === 'hfi-rotating');
  expect(await page.isVisible('#key-detector-voltage') && !await page.isVisible('#key-detector-pulse'), 'the keys are not the method’s');
  await page.selectOption('#key-detector-method', 'bipolar');
  await page.selectOption('#key-motor', 'pm-reluctance');
  await page.waitForFunction(() => globalThis.lab.values.a.motor.name === 'pm-reluctance');
  await settled(page);
  await page.close();
}

async function zoom({ address }) {
  const page = await open(address, 'zoom');
  const box = await page.locator('#waves').boundingBox();
  const span = () => page.evaluate(() => globalThis.lab.waves.span);
  const before = await span();
  await page.mouse.move(box.x + box.width * 0.3, box.y + 60);
  await page.mouse.down();
  await page.mouse.move(box.x + box.width * 0.5, box.y + 80, { steps: 5 });
  await page.mouse.up();
  const zoomed = await span();
  expect(zoomed[1] - zoomed[0] < 0.4 * (before[1] - before[0]), 'dragging does not zoom');
  await page.keyboard.down('Shift');
  await page.mouse.down();
  await page.mouse.move(box.x + box.width * 0.4, box.y + 80, { steps: 5 });
  await page.mouse.up();
  await page.keyboard.up('Shift');
  const moved = await span();
  expect(moved[0] !== zoomed[0] && Math.abs(moved[1] - moved[0] - zoomed[1] + zoomed[0]) < 1e-9, 'Shift and drag does not move the view');
  await page.click('#zoom-pulse');
  await page.mouse.move(box.x + box.width * 0.5, box.y + 60);
  await sleep(150);
  const read = await page.textContent('#readout');
  for (const word of ['i a', 'v c', 'u DC', 'θ', 'leg b', 'torque']) expect(read.includes(word), `the cursor does not read ${word}: ${read}`);
  expect(!/NaN|undefined/.test(read), `the cursor reads ${read}`);
  await page.screenshot({ path: picture('pulse.png') });
  await page.locator('#waves').dblclick({ position: { x: 200, y: 60 } });
  const after = await span();
  expect(Math.abs(after[1] - before[1]) < 1e-9 && after[0] === 0, 'a double click does not show all');
  await page.close();
}

async function compare({ address }) {
  const page = await open(address, 'compare');
  await page.selectOption('#key-detector-method', 'bipolar');
  await settled(page);
  await page.click('#compare');
  await page.selectOption('#key-detector-method', 'maximum-likelihood');
  await page.waitForFunction(() => /same 10000 trials/.test(document.getElementById('pair').textContent), null, { timeout: 60_000 });
  expect((await state(page)).a['detector.method'] === 'bipolar', 'B changed A');
  const [a, b] = [await rms(page, 'a'), await rms(page, 'b')];
  const told = await page.textContent('#pair');
  expect((a > b) === /B is better/.test(told), `rms ${a} and ${b}: ${told}`);
  expect(await page.evaluate(() => {
    const { a, b } = globalThis.lab.cloud.sides;
    return a.count === b.count && a.angle.slice(0, 100).every((angle, k) => angle === b.angle[k]);
  }), 'the trials of A and B do not start at the same angles');
  await page.screenshot({ path: picture('compare.png'), fullPage: true });
  await page.emulateMedia({ colorScheme: 'dark' });
  await sleep(200);
  await page.screenshot({ path: picture('compare-dark.png'), fullPage: true });
  await page.click('#keep');
  await settled(page);
  expect((await state(page)).a['detector.method'] === 'maximum-likelihood' && (await state(page)).b === null, 'B is not kept');
  await page.close();
}

async function link({ address }) {
  const page = await open(address, 'link');
  await page.selectOption('#key-detector-method', 'bipolar');
  await page.selectOption('#key-errors', 'harsh');
  await page.click('#compare');
  await page.fill('#key-sensors-noise', '33 mA');
  await page.keyboard.press('Enter');
  await settled(page);
  await page.click('#worst');
  await sleep(300);
  const [known, error] = [await state(page), await page.evaluate(() => globalThis.lab.waves.found.b.error)];
  await page.click('#link');
  const text = await page.evaluate(() => navigator.clipboard.readText());
  const other = await open(text, 'link restored');
  expect(JSON.stringify(await state(other)) === JSON.stringify(known), `the link ${text} restores ${JSON.stringify(await state(other))} of ${JSON.stringify(known)}`);
  await other.waitForFunction(() => globalThis.lab.waves.found.b);
  expect(await other.evaluate(() => globalThis.lab.waves.found.b.error) === error, 'the link restores another detection');
  // Typed behind the address of a lab that is open.
  await other.evaluate(() => { location.hash = '#errors=field&~trial=7'; });
  await other.waitForFunction(() => globalThis.lab.state.trial === 7 && globalThis.lab.state.a.errors === 'field' && !globalThis.lab.state.b);
  await other.close();
  await page.close();
}

async function point({ address }) {
  const page = await open(`${address}#detector.method=bipolar`, 'point');
  // What `check` recommends stands above and moves the cloud down, out of the window.
  await page.locator('#cloud').scrollIntoViewIfNeeded();
  const box = await page.locator('#cloud').boundingBox();
  const place = await page.evaluate(() => {
    const { a } = globalThis.lab.cloud.sides;
    const { cloud } = globalThis.lab;
    const k = a.error.findIndex((error, i) => i > 200 && Math.abs(error) > 0.7 * cloud.range && Math.abs(error) < cloud.range);
    const width = document.getElementById('cloud').clientWidth;
    const height = document.getElementById('cloud').clientHeight;
    return { trial: a.trial[k], x: 50 + (a.angle[k] / 360) * (width - 128), y: (22 + height - 36) / 2 - (a.error[k] / cloud.range) * (height - 58) / 2, error: a.error[k] };
  });
  await page.mouse.move(box.x + place.x, box.y + place.y);
  await sleep(100);
  await page.screenshot({ path: picture('point.png'), clip: { x: Math.max(box.x, 0), y: Math.max(box.y, 0), width: box.width, height: Math.min(box.height, 990 - box.y) } });
  await page.locator('#cloud').click({ position: { x: place.x, y: place.y } });
  await page.waitForFunction(trial => globalThis.lab.waves.found.a.trial === trial, place.trial);
  const shown = await page.evaluate(() => globalThis.lab.waves.found.a.axis_error);
  expect(Math.abs(shown - place.error) < 1e-4, `the point says ${place.error}°, its waveforms ${shown}°`);
  await page.click('.specimen summary');
  expect(/current gains.*phases a, b, c/s.test(await page.textContent('#specimen')), 'no word of the specimen');
  await page.close();
}

async function folders() {
  const running = spawn(resolve(program), ['run', join(desk, 'noisy.toml'), '--trials', '400000', '--threads', '1', '--out', join(desk, 'night')], { stdio: 'ignore' });
  children.push(running);
  const finished = spawn(resolve(program), ['run', join(desk, 'noisy.toml'), '--trials', '300', '--out', join(desk, 'done')], { stdio: 'ignore' });
  await new Promise(done => finished.on('exit', done));
  const started = await lab(program, desk);
  const page = await open(started.address, 'folder');
  await page.click('#files');
  const done = () => page.evaluate(() => Number(document.querySelector('li[data-path="night"] progress')?.value ?? -1));
  await page.waitForFunction(() => Number(document.querySelector('li[data-path="night"] progress')?.value) > 0, null, { timeout: 60_000 });
  const first = await done();
  await page.waitForFunction(old => Number(document.querySelector('li[data-path="night"] progress').value) > old, first, { timeout: 30_000 });
  await page.screenshot({ path: picture('folder.png') });
  expect(running.exitCode === null, 'the run beside ended');
  const [report] = await Promise.all([browser.waitForEvent('page'), page.click('li[data-path="done"] a')]);
  await report.waitForSelector('html[data-ready]', { state: 'attached', timeout: 30_000 });
  expect(/300 starts/.test(await report.textContent('body')), 'the report says something else');
  await report.screenshot({ path: picture('report.png') });
  await report.close();
  await page.click('text=noisy.toml');
  await page.waitForFunction(() => globalThis.lab.values.a?.values['sensors.noise'].text === '40 mA');
  await page.click('text=axes.toml');
  await page.waitForSelector('#point');
  await page.selectOption('#point', '1');
  await page.waitForFunction(() => globalThis.lab.values.a?.values['sensors.noise'].text === '40 mA');
  expect(await page.isDisabled('#key-sensors-noise'), 'an axis can be set');
  running.kill('SIGINT');
  await page.close();
  expect(await started.end() === 0, 'the lab does not end cleanly');
}

async function twoTabs({ address }) {
  const pages = await Promise.all(['one', 'two'].map(name => open(address, name)));
  await pages[0].selectOption('#key-errors', 'harsh');
  await pages[1].selectOption('#key-errors', 'none');
  for (const page of pages) await settled(page);
  await sleep(300);
  const [harsh, none] = [await rms(pages[0]), await rms(pages[1])];
  expect(harsh > 2 * none || none === 0, `two pages have the errors ${harsh} and ${none}`);
  for (const page of pages) expect(await page.evaluate(() => globalThis.lab.cloud.sides.a.count) === 10000, 'a page lost trials to the other');
  for (const page of pages) await page.close();
}

async function filling({ address }) {
  const page = await open(`${address}#detector.method=bipolar`, 'filling');
  const times = await page.evaluate(async () => {
    const begun = performance.now();
    let [thousand, count] = [null, 0];
    await globalThis.lab.engine.cloud({ setting: { scenario: '', point: 0, set: { 'detector.method': 'bipolar', seed: '99' } }, trials: 10000, slot: 'test' }, (kind, view) => {
      if (kind === 1) count += view.byteLength / 16;
      if (count >= 1000) thousand ??= performance.now() - begun;
    });
    return [thousand, performance.now() - begun, count];
  });
  console.log(`cloud: the first thousand after ${times[0].toFixed(0)} ms, ${times[2]} after ${times[1].toFixed(0)} ms`);
  expect(times[2] === 10000, `${times[2]} points`);
  const isPromised = isStrict && !isStatic;
  expect(!isPromised || (times[0] < 150 && times[1] < 500), `the cloud takes ${times[0].toFixed(0)} and ${times[1].toFixed(0)} ms`);
  await page.close();
}

/** The engine's numbers are the program's, and what they cost. */
async function numbers({ address }) {
  const page = await open(address, 'numbers');
  const [trial, angle] = [5, 100];
  const found = await page.evaluate(async ([number, degrees]) => {
    const body = k => ({ setting: { scenario: '', point: 0, set: { 'detector.method': 'bipolar', errors: 'harsh' } }, trial: k, angle: degrees });
    const bytes = new Uint8Array(await globalThis.lab.engine.detection(body(number)));
    const length = new DataView(bytes.buffer).getUint32(0, true);
    const header = JSON.parse(new TextDecoder().decode(bytes.subarray(4, 4 + length)));
    const begun = performance.now();
    for (let k = 0; k < 50; k += 1) await globalThis.lab.engine.detection(body(k));
    return { error: header.error, duration: header.duration, each: (performance.now() - begun) / 50 };
  }, [trial, angle]);
  const out = join(desk, 'native');
  execFileSync(resolve(program), ['trace', '--method', 'bipolar', '--errors', 'harsh', '--trial', String(trial), '--angle', String(angle), '--out', out]);
  const native = JSON.parse(readFileSync(join(out, 'result.json'), 'utf8'));
  console.log(`one detection: error ${found.error}° on the page, ${native.error_deg}° by the program; ${found.each.toFixed(1)} ms each with its waveforms`);
  expect(Math.abs(found.error - native.error_deg) < 1e-9 && found.duration === native.duration_s, 'the page has other numbers than the program');
  await page.close();
}

async function lost() {
  const started = await lab(program);
  const page = await open(`${started.address}#errors=harsh`, 'lost');
  listen(false);
  expect(await started.end() === 0, 'Ctrl-C does not end the lab cleanly');
  await page.selectOption('#key-errors', 'none');
  await page.waitForSelector('#lost:not([hidden])');
  expect(/does not answer/.test(await page.textContent('#lost')), 'no word of the lost connection');
  await page.screenshot({ path: picture('lost.png') });
  expect(page.url().includes('errors=none'), 'what was set is lost');
  listen(true);
  await page.close();
}

const both = [looks, structure, drag, type, undo, stale, broken, doubtful, phone, zoom, compare, link, point, filling, numbers, one => converter(one, program, picture), one => readiness(one, isStrict)];
const all = isStatic ? both : [...both, advised, twoTabs, folders, lost];
try {
  const only = process.env.ONLY?.split(',');
  const started = isStatic ? await site(resolve(place)) : await lab(program);
  for (const check of all.filter(check => !only || only.some(name => check.name === name || check.toString().includes(`${name}(one`)))) {
    try {
      await check(started);
    } catch (error) {
      objections.push(`${check.name}: ${error.message}`);
    }
  }
  if (!isStatic) expect(await started.end() === 0, 'the lab does not end cleanly');
  else await started.end();
} finally {
  await end();
  rmSync(desk, { recursive: true, force: true });
}
report();
