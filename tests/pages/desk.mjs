// What the checks of the lab share: a lab or a static site to look at, a browser, and pages that object to what goes wrong.

import { spawn } from 'node:child_process';
import { createServer } from 'node:http';
import { mkdtempSync, readFileSync, readdirSync, rmSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join, normalize, resolve } from 'node:path';
import { chromium } from 'playwright-core';

export const objections = [];
export const expect = (holds, what) => { if (!holds) objections.push(what); };
export const sleep = time => new Promise(done => setTimeout(done, time));

/** Processes that end with the checks. */
export const children = [];

/** A lab of this program with these arguments; its address and its process. */
export async function lab(program, ...options) {
  const child = spawn(resolve(program), ['lab', '--no-browser', ...options], { stdio: ['ignore', 'pipe', 'inherit'] });
  children.push(child);
  let text = '';
  const address = await new Promise((done, failed) => {
    child.stdout.on('data', data => {
      text += data;
      const found = /http:\S+/.exec(text);
      if (found) done(found[0]);
    });
    child.on('exit', () => failed(new Error(`the lab ended: ${text}`)));
  });
  return { address, child, port: new URL(address).port, end: () => new Promise(done => {
    child.removeAllListeners('exit');
    child.on('exit', code => done(code));
    child.kill('SIGINT');
  }) };
}

/** A static folder behind a server that does nothing else. */
export async function site(root) {
  const kinds = { html: 'text/html', css: 'text/css', mjs: 'text/javascript', svg: 'image/svg+xml', wasm: 'application/wasm' };
  const server = createServer((request, response) => {
    const path = normalize(new URL(request.url, 'http://x').pathname).replace(/\/$/, '/index.html');
    try {
      const bytes = readFileSync(join(root, path));
      response.writeHead(200, { 'content-type': kinds[path.split('.').pop()] ?? 'application/octet-stream' });
      response.end(bytes);
    } catch {
      response.writeHead(404).end();
    }
  });
  await new Promise(done => server.listen(0, '127.0.0.1', done));
  return { address: `http://127.0.0.1:${server.address().port}/`, end: async () => { server.close(); return 0; } };
}

const flags = ['--no-sandbox', '--disable-gpu', '--disable-quic', '--no-first-run', '--disable-background-networking',
  '--disable-component-update', '--disable-sync'];
const profile = mkdtempSync(join(tmpdir(), 'pages-'));
export const browser = await chromium.launchPersistentContext(profile, {
  executablePath: process.env.CHROMIUM || '/usr/bin/chromium', headless: true, args: flags,
});
await browser.grantPermissions(['clipboard-read', 'clipboard-write']);

let quiet = true;

/** Whether messages of a page are objections. */
export const listen = on => { quiet = on; };

/** A page at this address, with its objections. */
export async function visit(address, name, options = {}) {
  const page = await browser.newPage();
  page.on('console', message => {
    if (quiet && ['error', 'warning'].includes(message.type()) && !/status of 422/.test(message.text())) {
      objections.push(`${name}: console: ${message.text()}`);
    }
  });
  page.on('pageerror', error => objections.push(`${name}: ${error.message}`));
  page.on('request', request => {
    if (!request.url().startsWith(new URL(address).origin) && !/^(data|blob):/.test(request.url())) {
      objections.push(`${name}: asked the network for ${request.url()}`);
    }
  });
  await page.setViewportSize({ width: options.width ?? 1440, height: options.height ?? 1000 });
  await page.emulateMedia({ colorScheme: options.scheme ?? 'light' });
  await page.goto(address);
  return page;
}

/** The lab at this address, once it can be used. */
export async function open(address, name, options = {}) {
  const page = await visit(address, name, options);
  await page.waitForSelector('html[data-ready]', { state: 'attached' });
  await settled(page);
  // What `check` recommends is set when it is known.
  if (await page.evaluate(() => Boolean(globalThis.lab.engine.advice))) {
    await page.waitForSelector('html[data-advised]', { state: 'attached', timeout: 60_000 });
    await settled(page);
  }
  return page;
}

/** Until all trials are there. */
export const settled = async page => {
  // What waits for the hand to rest begins within a third of a second.
  await sleep(300);
  await page.waitForFunction(() => document.querySelector('#progress.done') && globalThis.lab.waves.found.a && globalThis.lab.values.a
    && Object.values(globalThis.lab.asks).every(asks => Object.values(asks).every(ask => !ask.busy)), null, { timeout: 60_000 });
};
export const state = page => page.evaluate(() => structuredClone(globalThis.lab.state));
export const rms = (page, side = 'a') => page.evaluate(one => globalThis.lab.summaries[one]?.summary.rms_deg.value, side);
export const ink = (page, id) => page.evaluate(name => {
  const canvas = document.getElementById(name);
  const { data } = canvas.getContext('2d').getImageData(0, 0, canvas.width, canvas.height);
  let sum = 0;
  for (let k = 3; k < data.length; k += 4) sum += data[k] > 0 ? 1 : 0;
  return sum / (data.length / 4);
}, id);

/** What /proc says of a process behind its name: state, parent, and more. */
const fields = id => readFileSync(`/proc/${id}/stat`, 'utf8').replace(/^.*\) /s, '').split(' ');

/** Whether a process is a page of this browser: a renderer among its descendants. */
function ours(id) {
  if (!/--type=renderer/.test(readFileSync(`/proc/${id}/cmdline`, 'utf8'))) return false;
  for (let at = id; Number(at) > 1; at = fields(at)[1]) {
    if (readFileSync(`/proc/${at}/cmdline`, 'utf8').includes(`--user-data-dir=${profile}`)) return true;
  }
  return false;
}

/** Processor time in ms that a process has used, or all pages of the browser. */
export function used(pid) {
  let ticks = 0;
  for (const id of pid ? [pid] : readdirSync('/proc').filter(name => /^\d+$/.test(name))) {
    try {
      if (!pid && !ours(id)) continue;
      const [user, system] = fields(id).slice(11, 13).map(Number);
      ticks += user + system;
    } catch { /* it has ended */ }
  }
  return 10 * ticks;
}

/** Ends all that was begun. */
export async function end() {
  await browser.close();
  children.forEach(child => child.kill());
  rmSync(profile, { recursive: true, force: true });
}

/** Says what was found, and ends with a code for it. */
export function report() {
  const different = [...new Set(objections)];
  for (const objection of different) console.error(objection);
  console.log(different.length ? `${different.length} objections` : 'no objections');
  process.exitCode = different.length ? 1 : 0;
}
