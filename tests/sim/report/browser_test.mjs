// The reports as a person meets them: node browser_test.mjs REPORT_FIXTURE CHROMIUM
// With KEEP=FOLDER the screenshots stay there.

import assert from 'node:assert/strict';
import { execFileSync } from 'node:child_process';
import { mkdtempSync, rmSync, writeFileSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { pathToFileURL } from 'node:url';
import { Browser } from './browser.mjs';

const [fixture, chromium] = process.argv.slice(2);
const folder = mkdtempSync(join(tmpdir(), 'arex-report-'));
const VIEW = '#view canvas';
const address = (name) => pathToFileURL(join(folder, name, 'report.html')).href;

/** Nothing complained, nothing was fetched, nothing sticks out. */
async function assertSound(page, width) {
  assert.deepEqual(page.complaints, []);
  const outside = page.requests.filter((url) => !/^(file|data|blob):/.test(url));
  assert.deepEqual(outside, []);
  assert.ok((await page.run('document.documentElement.scrollWidth')) <= width, 'the page scrolls sideways');
}

async function keep(page, name) {
  if (process.env.KEEP) writeFileSync(join(process.env.KEEP, `${name}.png`), await page.screenshot());
}

/** The replay: not blank, and it moves with the slider. */
async function testRun(browser, width, dark) {
  const page = await browser.open(address('run'), { width, dark });
  const end = await page.picture(VIEW);
  assert.ok(end.share > 0.02, `the view at the end is blank: ${end.share}`);
  const here = () => page.run(`document.querySelector('#path-map .here').getAttribute('cx')`);
  const [time_end, here_end] = [await page.run(`Number(document.getElementById('time').value)`), await here()];

  await page.click('#time', 0.3);
  const time = await page.run(`Number(document.getElementById('time').value)`);
  assert.ok(time > 0.2 * time_end && time < 0.4 * time_end, `the slider stands at ${time} of ${time_end}`);
  const early = await page.picture(VIEW);
  assert.notEqual(early.sum, end.sum, 'the view does not change with the slider');
  assert.ok(early.drawn < 0.7 * end.drawn, `the map was no smaller: ${early.drawn} of ${end.drawn} pixels`);
  assert.ok(early.drawn > 0.05 * end.drawn, 'the map was not there yet');
  assert.notEqual(await here(), here_end, 'the vehicle does not move on the map');
  assert.match(await page.run(`document.getElementById('now').textContent`), /^\d+\.\d s · .* m\/s/);

  // A layer that is switched off is gone.
  await page.click('.layer.cloud input');
  const bare = await page.picture(VIEW);
  assert.ok(bare.drawn < 0.5 * early.drawn, 'the cloud does not go away');

  const charts = await page.run(`document.querySelectorAll('.chart canvas').length`);
  assert.equal(charts, 8);
  for (let i = 1; i <= charts; ++i) {
    const { share } = await page.picture(`#charts .chart:nth-child(${i}) canvas`);
    assert.ok(share > 0.002, `chart ${i} is blank: ${share}`);
  }
  // An event's moment.
  await page.click('#events tr[data-t="15.000"]');
  assert.equal(await page.run(`Number(document.getElementById('time').value)`), 15);
  await keep(page, `run-${width}-${dark ? 'dark' : 'light'}`);
  await assertSound(page, width);
  await page.close();
}

/** Playing moves the time on by itself. */
async function testPlay(browser) {
  const page = await browser.open(address('run'));
  // In real time, so that a busy machine sees it moving and not at its end.
  await page.run(`(() => { const s = document.querySelector('.transport select'); s.value = '1';
    s.dispatchEvent(new Event('change')); })()`);
  await page.click('#play');
  await page.until(`Number(document.getElementById('time').value) > 1`);
  await page.click('#play');
  const stopped = await page.run(`Number(document.getElementById('time').value)`);
  await page.settle();
  assert.equal(await page.run(`Number(document.getElementById('time').value)`), stopped);
  await page.click('#time', 0.9);
  await page.click('#follow');
  assert.ok((await page.picture(VIEW)).share > 0.005);
  await assertSound(page, 1280);
  await page.close();
}

async function testWithoutGrowth(browser) {
  const page = await browser.open(address('old') + '#t=20');
  assert.equal(await page.run(`Number(document.getElementById('time').value)`), 20);
  const late = await page.picture(VIEW);
  await page.click('#time', 0.1);
  assert.ok((await page.picture(VIEW)).drawn > 0.8 * late.drawn, 'the cloud went away');
  assert.match(await page.run(`document.getElementById('replay').textContent`), /did not record when its map grew/);
  await assertSound(page, 1280);
  await page.close();
}

async function testWithoutWebGl(browser) {
  const before = `const get = HTMLCanvasElement.prototype.getContext;
    HTMLCanvasElement.prototype.getContext = function (kind, ...rest) {
      return kind.startsWith('webgl') ? null : get.call(this, kind, ...rest);
    };`;
  const page = await browser.open(address('run'), { width: 400, before });
  assert.ok(await page.run(`document.getElementById('no-webgl') !== null`));
  const here = () => page.run(`document.querySelector('#path-map .here').getAttribute('cx')`);
  const end = await here();
  await page.click('#time', 0.5);
  assert.notEqual(await here(), end);
  await assertSound(page, 400);
  await page.close();
}

async function testWithoutScript(browser) {
  const page = await browser.open(address('run'), { script: false });
  const shown = `[...document.querySelectorAll('noscript, #path-map, #events tr, .timing tr')]
    .every((e) => e.getBoundingClientRect().height > 0)`;
  assert.ok(await page.run(shown), 'something needs a script to be seen');
  assert.match(await page.run('document.body.innerText'), /need JavaScript/);
  await assertNothingEmpty(page);
  await keep(page, 'run-noscript');
  await page.close();

  const sweep = await browser.open(address('sweep'), { script: false });
  assert.equal(await sweep.run(`document.querySelectorAll('#runs tbody tr').length`), 24);
  await assertNothingEmpty(sweep);
  await keep(sweep, 'sweep-noscript');
  await sweep.close();
}

/** Every heading has something below it. */
async function assertNothingEmpty(page) {
  const empty = await page.run(`[...document.querySelectorAll('h2')]
    .filter((h) => !h.nextElementSibling || h.nextElementSibling.getBoundingClientRect().height === 0)
    .map((h) => h.textContent)`);
  assert.deepEqual(empty, []);
}

/** Two runs over each other: a curve each, both paths on one map. */
async function testOverlay(browser) {
  const page = await browser.open(address('.'), { width: 400 });
  assert.equal(await page.run(`document.querySelectorAll('#coverage canvas').length`), 2);
  const area = await page.picture('#coverage canvas');
  assert.ok(area.share > 0.002, `the curves are blank: ${area.share}`);
  const names = await page.run(`[...document.querySelectorAll('#coverage .chart:first-child .u-label')]
    .slice(1).map((label) => label.textContent)`);
  assert.deepEqual(names, ['seed 7, run', 'seed 7, old']);
  await page.run(`(() => { const s = document.getElementById('quantity'); s.value = 'surface_fraction';
    s.dispatchEvent(new Event('change')); })()`);
  await page.until(`document.querySelector('#coverage h3')?.textContent === 'Coverage of the surface over time'`);
  assert.equal(await page.run(`document.querySelectorAll('#paths svg').length`), 1);
  assert.equal(await page.run(`document.querySelectorAll('#paths polyline').length`), 2);
  await assertNothingEmpty(page);
  await keep(page, 'overlay');
  await assertSound(page, 400);
  await page.close();
}

async function testPaper(browser) {
  const page = await browser.open(address('run'), { dark: true });
  const pdf = await page.pdf();
  assert.ok(pdf.length > 20_000, `${pdf.length} bytes of PDF`);
  if (process.env.KEEP) writeFileSync(join(process.env.KEEP, 'run.pdf'), pdf);
  const printed = await page.picture('#view .printed');
  assert.ok(printed.share > 0.02, 'the view is not on the paper');
  // Across a sheet as well as along it, the bars of the host's time stay out of the events.
  await page.call('Emulation.setEmulatedMedia', { media: 'print' });
  for (const width of [718, 1047]) {
    await page.call('Emulation.setDeviceMetricsOverride', { width, height: 900, deviceScaleFactor: 1, mobile: false });
    const [bars, events] = await page.run(`[document.querySelector('.timing'), document.getElementById('events')]
      .map((e) => (({ left, right, top, bottom }) => ({ left, right, top, bottom }))(e.getBoundingClientRect()))`);
    assert.ok(bars.bottom <= events.top || bars.right <= events.left, `they overlap on ${width} pixels`);
    assert.ok((await page.run('document.documentElement.scrollWidth')) <= width, 'the paper is too narrow');
  }
  await assertSound(page, 1280);
  await page.close();
}

async function testSweep(browser, width, dark) {
  const page = await browser.open(address('sweep'), { width, dark });
  const text = (selector) => page.run(`document.querySelector(${JSON.stringify(selector)}).textContent`);
  assert.ok((await page.picture('.chart canvas')).share > 0.002);
  assert.equal(await page.run(`document.querySelectorAll('.heat tbody td').length`), 6);
  assert.equal(await page.run(`document.querySelectorAll('#run-table tbody tr').length`), 24);

  // Success of four seeds at each of 3 x 2 points; the collision is seed 2 at (0.3, 3).
  await page.run(`(() => { const s = document.getElementById('figure'); s.value = 'succeeded';
    s.dispatchEvent(new Event('change')); })()`);
  assert.match(await text('.heat tbody tr:nth-child(2) td:nth-of-type(1)'), /^75/);
  assert.match(await text('.heat tbody tr:nth-child(1) td:nth-of-type(1)'), /^100/);
  // The address names the view, and opens it again.
  const hash = await page.run('location.hash');
  assert.match(hash, /figure=succeeded/);
  const linked = await browser.open(address('sweep') + hash, { width, dark });
  assert.equal(await linked.run(`document.getElementById('figure').value`), 'succeeded');
  await linked.close();

  // Sorting up, then down; the run that crashed has no time and stays last.
  const column = await page.run(`[...document.querySelectorAll('#run-table th')]
    .findIndex((th) => th.title === 'sim_time_s') + 1`);
  const times = () => page.run(`[...document.querySelectorAll('#run-table tbody td:nth-child(${column})')]
    .map((td) => td.textContent).filter((text) => text !== '').map(Number)`);
  for (const sign of [1, -1]) {
    await page.run(`document.querySelector('#run-table th:nth-child(${column}) button').click()`);
    const sorted = await times();
    assert.equal(sorted.length, 23);
    assert.ok(sorted.every((value, i) => i === 0 || sign * (value - sorted[i - 1]) >= 0), 'not sorted');
    assert.equal(await text(`#run-table tbody tr:last-child td:nth-child(${column})`), '');
  }
  assert.equal(await page.run(`document.querySelectorAll('#run-table a[href^="./runs/"]').length`), 1);

  // More inflation takes longer here, by construction: 16 s, noise 5 s.
  assert.match(await text('#side tbody'), /flight time, s.*worse/);
  await keep(page, `sweep-${width}-${dark ? 'dark' : 'light'}`);
  await assertSound(page, width);
  await page.close();
}

/** Only what succeeded is compared, two values are no statistics, and seeds keep their digits. */
async function testFailures(browser) {
  const row = (page, figure) =>
    page.run(`[...document.querySelectorAll('#side tr[data-figure="${figure}"] td')].map((td) => td.textContent)`);
  const judged = (page) => page.run(`document.querySelectorAll('#side .better, #side .worse, #side .differs').length`);
  const few = await browser.open(address('few'));
  assert.match(await few.run(`document.querySelector('#side thead').textContent`), /A 4 of 4 succeeded.*B 2 of 4 succeeded/);
  const distance = await row(few, 'distance_m');
  assert.equal(distance[0], 'distance flown, m');
  assert.match(distance[1], /^11\.5 \(.* … .*\)$/);
  assert.equal(distance[2], '13, 14');
  assert.equal(distance[3], '3, 3, n 2');
  const left = await row(few, 'battery.remaining_fraction');
  assert.equal(left[2], '50, 50', 'shares are in percent');
  const success = await row(few, 'succeeded');
  assert.match(success[1], /^100 \(51 … 100\)$/);
  assert.match(success[2], /^50 \(15 … 85\)$/);
  assert.equal(await judged(few), 0, 'two pairs are no difference');
  const seeds = await few.run(`[...document.querySelectorAll('#run-table td')].map((td) => td.textContent)`);
  for (const seed of ['18446744073709551612', '18446744073709551615']) assert.ok(seeds.includes(seed), seed);
  assert.ok((await few.picture('.chart canvas')).share > 0.002);
  await keep(few, 'few');
  await assertSound(few, 1280);
  await few.close();

  const none = await browser.open(address('none'));
  assert.match(await none.run(`document.querySelector('#side thead').textContent`), /A 0 of 4 succeeded.*B 0 of 4 succeeded/);
  assert.deepEqual(await row(none, 'distance_m'), [], 'a figure of flights that failed is compared');
  assert.equal(await judged(none), 0);
  assert.match(await none.run(`document.body.innerText`), /succeeded\s+0\s+of 8 flown: 0 %, 95 % interval 0 to 32 %/);
  await keep(none, 'none');
  await assertSound(none, 1280);
  await none.close();
}

/** Forty values of a key are drawn as eight ranges. */
async function testHypercube(browser) {
  const page = await browser.open(address('cube'));
  const heads = await page.run(`[...document.querySelectorAll('.heat thead th')].slice(1).map((th) => th.textContent)`);
  assert.deepEqual(heads, ['0.15', '0.25', '0.35', '0.45', '0.55', '0.65', '0.75', '0.85']);
  assert.match(await page.run(`document.getElementById('figures').textContent`), /stands for the range/);
  const cells = await page.run(`[...document.querySelectorAll('.heat td')].map((td) => td.innerText)`);
  assert.equal(cells.length, 64);
  const runs = cells.map((text) => Number(/n (\d+)$/.exec(text)?.[1] ?? 0));
  assert.equal(runs.reduce((a, b) => a + b), 40);
  await assertSound(page, 1280);
  await page.close();
}

/** Trajectories compared: a page that needs no script, on a phone and on paper. */
async function testEvaluation(browser, width, dark) {
  const page = await browser.open(address('evaluation'), { width, dark, script: false });
  const shown = `[...document.querySelectorAll('#path-map polyline, .curves polyline, td')]
    .every((e) => e.getBoundingClientRect().width > 0)`;
  assert.ok(await page.run(shown), 'something is not to be seen');
  assert.equal(await page.run(`document.querySelectorAll('.curves').length`), 6);
  assert.match(await page.run('document.body.innerText'), /position error \(ATE\), RMSE, m\s+[\d.]+\s+0\s/);
  const letters = await page.run(`document.querySelector('.curves text').getBoundingClientRect().height`);
  assert.ok(letters > 9, `the charts' text is ${letters} pixels high`);
  await keep(page, `evaluation-${width}-${dark ? 'dark' : 'light'}`);
  assert.ok((await page.pdf()).length > 10_000);
  await assertSound(page, width);
  await page.close();
}

const browser = new Browser(chromium);
try {
  execFileSync(fixture, [folder]);
  for (const [width, dark] of [[1280, false], [400, true]]) {
    await testRun(browser, width, dark);
    await testSweep(browser, width, dark);
    await testEvaluation(browser, width, dark);
  }
  await testFailures(browser);
  await testHypercube(browser);
  await testPlay(browser);
  await testWithoutGrowth(browser);
  await testWithoutWebGl(browser);
  await testWithoutScript(browser);
  await testPaper(browser);
  await testOverlay(browser);
  console.log('14 passed, 0 failed');
} finally {
  await browser.close();
  rmSync(folder, { recursive: true, force: true });
}
