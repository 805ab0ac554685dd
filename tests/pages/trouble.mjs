// What goes wrong on the page of the lab, and what it says then: undo while typing, messages whose cause has gone, links that are
// broken, narrow windows, and the detector that it opens with.

import { expect, open, settled, sleep, state } from './desk.mjs';

const text = (page, id) => page.evaluate(name => {
  const element = document.getElementById(name);
  return element.hidden ? '' : element.textContent;
}, id);
const noise = '#key-sensors-noise';

/** Ctrl+Z in a field undoes what is typed there, and of what is set that field's own last change alone. */
export async function undo({ address }) {
  const page = await open(`${address}#detector.method=bipolar`, 'undo');
  await page.selectOption('#key-errors', 'harsh');
  await page.click(noise);
  await page.keyboard.press('End');
  await page.keyboard.type('99');
  await page.keyboard.press('Control+z');
  const typed = await page.inputValue(noise);
  expect(!typed.endsWith('99'), `Ctrl+Z leaves what was typed: ${typed}`);
  expect((await state(page)).a.errors === 'harsh', 'Ctrl+Z while typing undid what is set');
  // Nothing of its own to undo.
  await page.focus('#find');
  await page.keyboard.press('Control+z');
  expect((await state(page)).a.errors === 'harsh', 'Ctrl+Z in the field of words undid what is set');
  const before = await page.inputValue(noise);
  await page.fill(noise, '60');
  await page.keyboard.press('Enter');
  expect(await page.inputValue(noise) === '60 mA', `the field shows ${await page.inputValue(noise)} where 60 mA are set`);
  await page.keyboard.press('Control+z');
  await settled(page);
  expect(!('sensors.noise' in (await state(page)).a), 'Ctrl+Z does not take back what the field has set');
  expect(await page.inputValue(noise) === before, `the field shows ${await page.inputValue(noise)}, and ${before} is what counts`);
  await page.keyboard.press('Control+Shift+z');
  await settled(page);
  expect((await state(page)).a['sensors.noise'] === '60 mA' && await page.inputValue(noise) === '60 mA', 'redo does not set it again');
  await page.fill('#trial', '7');
  await page.keyboard.press('Enter');
  await settled(page);
  await page.keyboard.press('Control+z');
  await settled(page);
  expect((await state(page)).trial === 0 && await page.inputValue('#trial') === '0', 'Ctrl+Z does not take back the trial');
  expect((await state(page)).a['sensors.noise'] === '60 mA', 'Ctrl+Z after a trial undid the noise');
  // Elsewhere it is the lab's.
  await page.focus('#rotor');
  await page.keyboard.press('Control+z');
  await settled(page);
  expect(!('sensors.noise' in (await state(page)).a), 'Ctrl+Z outside of fields undoes nothing');
  await page.close();
}

/** A message goes with its cause, whatever order answers come in. */
export async function stale({ address }) {
  const page = await open(`${address}#detector.method=bipolar`, 'stale');
  // Answers about a setting that cannot be come after those about the next one.
  await page.evaluate(() => {
    const { engine } = globalThis.lab;
    const { detection } = engine;
    engine.detection = async body => {
      if (body.setting.set['sensors.noise']?.startsWith('-')) await new Promise(done => setTimeout(done, 600));
      return detection(body);
    };
  });
  await page.fill(noise, '-3 A');
  await page.keyboard.press('Enter');
  await page.waitForSelector('#wrong:not([hidden])');
  await page.fill(noise, '30 mA');
  await page.keyboard.press('Enter');
  await page.waitForSelector('#wrong', { state: 'hidden' });
  await sleep(1000);
  await settled(page);
  expect(await text(page, 'wrong') === '', `the message stays: ${await text(page, 'wrong')}`);
  // Of a comparison that has ended nothing is left.
  await page.click('#compare');
  await page.selectOption('#key-detector-method', 'maximum-likelihood');
  await page.waitForFunction(() => /same 10000 trials/.test(document.getElementById('pair').textContent), null, { timeout: 60_000 });
  const pair = await page.evaluate(() => new Promise(done => {
    globalThis.lab.store.change(null, now => { now.b['sensors.noise'] = '90 mA'; });
    setTimeout(() => done([document.getElementById('pair').textContent, globalThis.lab.summaries.b?.all]), 150);
  }));
  expect(pair[0] === '' || /same/.test(pair[0]) === false, `beside new trials stands what was said of the old ones: ${pair[0]}`);
  await settled(page);
  await page.fill(noise, '-1 A');
  await page.keyboard.press('Enter');
  await page.waitForSelector('#wrong:not([hidden])');
  await page.click('#compare');
  expect(await text(page, 'wrong') === '', 'the message is about a side that is gone');
  expect((await page.$$('#verdict .outcome')).length === 1 && await text(page, 'legend') === '', 'the side that is gone is still shown');
  await page.close();
}

/** What a link sets and cannot be set is named; the rest is set. */
export async function broken({ address }) {
  const words = 'detector.method=bipolar&sensors.nois=3+mA&errors=harsh&foo.bar=1&sensors.offset=much&~trial=x&~colour=red&~angle=50&~point=9'
    + '&~compare=b&b:detector.method=maximum-likelihood&b:detector.pulsee=3us';
  const page = await open(`${address}#${words}`, 'broken');
  const said = await text(page, 'left-out');
  for (const word of ['sensors.nois = 3 mA', 'did you mean `noise`', 'foo.bar = 1', 'sensors.offset = much', '~trial = x', '~colour = red', '~point = 9', 'B: detector.pulsee']) {
    expect(said.includes(word), `the page does not name ${word}: ${said}`);
  }
  expect(said.length < 2500, `${said.length} letters say what is left out`);
  const now = await state(page);
  expect(now.a['detector.method'] === 'bipolar' && now.a.errors === 'harsh' && now.angle === 50 && now.trial === 0
    && now.b?.['detector.method'] === 'maximum-likelihood', `the rest of the link is not set: ${JSON.stringify(now)}`);
  expect(Object.keys(now.a).length === 2 && Object.keys(now.b).length === 1, `what cannot be is set: ${JSON.stringify(now)}`);
  expect(!/nois=|foo/.test(page.url()), `the address keeps what is left out: ${page.url()}`);
  expect(await text(page, 'wrong') === '', `a setting that is not set is at fault: ${await text(page, 'wrong')}`);
  await page.click('#left-out button');
  expect(await text(page, 'left-out') === '', 'the message cannot be closed');
  await page.evaluate(() => { location.hash = '#errors=herb&sensors.noise=30+mA'; });
  await page.waitForFunction(() => globalThis.lab.state.a['sensors.noise'] === '30 mA');
  expect((await text(page, 'left-out')).includes('errors = herb'), 'what is typed behind # is not looked at');
  await page.evaluate(() => { location.hash = '#errors=harsh'; });
  await page.waitForFunction(() => globalThis.lab.state.a.errors === 'harsh');
  await settled(page);
  expect(await text(page, 'left-out') === '', 'the message about another link stays');
  await page.close();
}

/** A number that is probably a mistake is doubted beside the detection. */
export async function doubtful({ address }) {
  const page = await open(`${address}#detector.method=bipolar&sensors.noise=20+A`, 'doubtful');
  await settled(page);
  const said = await page.evaluate(() => document.querySelector('.outcome').textContent);
  const lines = await page.evaluate(() => [...document.querySelectorAll('.outcome dt')].map(name => {
    const text = document.createRange();
    text.selectNodeContents(name);
    return text.getClientRects().length;
  }));
  expect(lines.length > 0 && lines.every(count => count === 1), `lines of the outcome's names: ${lines}`);
  expect(said.includes('meant so?') && said.includes('sensors.noise is 20 A'), `no doubt about 20 A of noise: ${said}`);
  await page.close();
}

/** On a phone one sets before one looks, and what is looked at is not far. */
export async function phone({ address }) {
  const page = await open(`${address}#detector.method=bipolar`, 'phone', { width: 390, height: 844 });
  const tops = await page.evaluate(() => ['.keys', '#detection', '.many'].map(of => document.querySelector(of).getBoundingClientRect().top + scrollY));
  expect(tops[0] < tops[1] && tops[1] < tops[2], `from the top: settings ${tops[0]}, detection ${tops[1]}, trials ${tops[2]}`);
  expect(tops[1] < 900, `the detection begins ${tops[1]} pixels down`);
  expect(await page.isVisible('#key-detector-method') && await page.isVisible('#key-motor'), 'what one sets first cannot be seen');
  expect(await page.evaluate(() => document.scrollingElement.scrollWidth <= innerWidth), 'wider than the phone');
  await page.click('summary:has-text("Sensors")');
  expect(await page.isVisible(noise), 'a table does not open');
  await page.close();
}

/** It opens with what `check` recommends, and says so; not where something else is wanted. */
export async function advised({ address }) {
  const begun = performance.now();
  const page = await open(address, 'advised');
  console.log(`advised after ${(performance.now() - begun).toFixed(0)} ms`);
  const said = await text(page, 'advice');
  const { method } = await page.evaluate(() => ({ method: globalThis.lab.state.a['detector.method'] }));
  expect(method && said.startsWith('As `check` recommends') && said.includes(method), `opened with ${method}: ${said}`);
  await page.click('#undo');
  await settled(page);
  expect(!(await state(page)).a['detector.method'], 'what is recommended cannot be undone');
  expect(/Set it/.test(await text(page, 'advice')), `what could be set is not said: ${await text(page, 'advice')}`);
  await page.click('#advice button');
  expect((await state(page)).a['detector.method'] === method, 'the button sets nothing');
  await page.selectOption('#key-motor', 'outrunner');
  expect(!(await text(page, 'advice')).includes(method), 'what is said is about another motor');
  await settled(page);
  await page.click('#advice button');
  await page.waitForFunction(() => /recommends|finds no/.test(document.getElementById('advice').textContent), null, { timeout: 60_000 });
  await page.close();
  const linked = await open(`${address}#detector.method=subdivision`, 'advised, linked');
  expect((await state(linked)).a['detector.method'] === 'subdivision', 'a link is not kept');
  await linked.close();
}
