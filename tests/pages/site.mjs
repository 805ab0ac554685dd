// Looks at the pages of the built site: node site.mjs SITE [FOLDER] (SITE is what scripts/site.sh made; its newest version).
// Each page is opened at 1280 pixels in light and at 390 in dark colours: it does not scroll sideways, its links and their headings exist, its
// pictures load, and a page of the guide has at most two screens at 1280 x 1000. FOLDER keeps pictures of some.

import { mkdirSync, readFileSync } from 'node:fs';
import { join } from 'node:path';
import { end, expect, report, site, visit } from './desk.mjs';

const [root, pictures] = process.argv.slice(2);
const started = await site(root);
const { latest } = JSON.parse(readFileSync(join(root, 'versions.json'), 'utf8'));
const address = `${started.address}${latest}/`;
if (pictures) mkdirSync(pictures, { recursive: true });
// Pages that other programs made: looked at by their own checks.
const foreign = path => /^(lab|rust)\/|^(lab|rust)-here/.test(path);
const kept = ['guide/motor-gimbal.html', 'guide/which-sensor.html', 'gallery.html', 'python-here.html'];

const [todo, links] = [['index.html'], new Map()];
const headings = new Map();
const from = new Map();
for (let k = 0; k < todo.length; k += 1) {
  const path = todo[k];
  for (const [width, scheme] of [[1280, 'light'], [390, 'dark']]) {
    const name = `${path} ${width} ${scheme}`;
    if (!(await fetch(address + path)).ok) {
      expect(false, `${from.get(path)}: ${path} is not there`);
      continue;
    }
    const page = await visit(address + path, name, { width, height: 1000, scheme });
    await page.waitForLoadState('load');
    const wide = await page.evaluate(() => document.scrollingElement.scrollWidth - innerWidth);
    expect(wide <= 0, `${name}: ${wide} px wider than the window`);
    const broken = await page.evaluate(async () => {
      const images = [...document.querySelectorAll('main img')];
      images.forEach(image => { image.loading = 'eager'; });
      await Promise.all(images.map(image => image.decode().catch(() => null)));
      return images.filter(image => !image.naturalWidth).map(image => image.src);
    });
    expect(broken.length === 0, `${name}: pictures that do not load: ${broken}`);
    if (width === 1280) {
      const height = await page.evaluate(() => document.querySelector('main').scrollHeight);
      if (/^guide\/(?!README|index|faq)/.test(path)) {
        expect(height <= 2000, `${name}: ${height} px high`);
        console.log(`${path}: ${(height / 1000).toFixed(1)} screens`);
      }
      headings.set(path, new Set(await page.evaluate(() => [...document.querySelectorAll('[id]')].map(element => element.id))));
      for (const link of await page.evaluate(() => [...document.querySelectorAll('main a[href], nav a[href]')].map(a => a.href))) {
        if (!link.startsWith(address)) continue;
        const [to, anchor] = link.slice(address.length).split('#');
        const target = to === '' || to.endsWith('/') ? `${to}index.html` : to;
        links.set(`${target}#${anchor ?? ''}`, path);
        if (target.endsWith('.html') && !foreign(target) && !todo.includes(target)) {
          todo.push(target);
          from.set(target, path);
        }
      }
    }
    if (pictures && kept.includes(path)) await page.screenshot({ path: join(pictures, `${path.replaceAll('/', '-')}-${width}.png`), fullPage: false });
    await page.close();
  }
}
for (const [link, page] of links) {
  const [target, anchor] = link.split('#');
  if (headings.has(target)) {
    expect(anchor === '' || headings.get(target).has(decodeURIComponent(anchor)), `${page}: ${target} has no heading ${anchor}`);
  } else {
    const answer = await fetch(address + target);
    expect(answer.ok, `${page}: ${target} is not there`);
  }
}
console.log(`${todo.length} pages, ${links.size} links`);
expect(todo.length > 50, `${todo.length} pages`);
await started.end();
await end();
report();
