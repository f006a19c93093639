// report.mjs REPORT.html [FOLDER]: opens a report in headless Chromium with software GL, from disk,
// and uses it as a person would. Screenshots go to FOLDER. Exit code 1 when something is wrong.
import { execFileSync } from 'node:child_process';
import { join, resolve } from 'node:path';
import { pathToFileURL } from 'node:url';
import { chromium } from 'playwright-core';

const kBrowsers = ['chromium-headless-shell', 'chromium', 'google-chrome'];
const [report, shots] = process.argv.slice(2);
const failures = [];
const expect = (holds, what) => {
  if (!holds) failures.push(what);
};

function browserPath() {
  if (process.env.CHROMIUM) return process.env.CHROMIUM;
  return execFileSync('sh', ['-c', kBrowsers.map((name) => `command -v ${name}`).join(' || ')])
    .toString()
    .trim();
}

async function open(browser) {
  const page = await browser.newPage({ viewport: { width: 1366, height: 768 }, colorScheme: 'light' });
  page.on('console', (message) => {
    if (['error', 'warning'].includes(message.type()) && !/GPU stall|software WebGL/.test(message.text())) {
      failures.push(`console: ${message.text()}`);
    }
  });
  page.on('pageerror', (error) => failures.push(`page: ${error}`));
  page.on('request', (request) => {
    if (!/^(file|data|blob):/.test(request.url())) failures.push(`asks the network for ${request.url()}`);
  });
  const start = Date.now();
  await page.goto(pathToFileURL(resolve(report)).href);
  await page.waitForSelector(':root[data-ready=true]', { timeout: 60000 });
  console.log(`ready after ${Date.now() - start} ms`);
  return page;
}

/** Runs in the page: what is seen and where things are now. */
const look = (page) =>
  page.evaluate(() => {
    const { surfaces, replay, transport } = window.simulcapReport;
    replay.render();
    const gl = replay.renderer.getContext();
    const pixels = new Uint8Array(4 * gl.drawingBufferWidth * gl.drawingBufferHeight);
    gl.readPixels(0, 0, gl.drawingBufferWidth, gl.drawingBufferHeight, gl.RGBA, gl.UNSIGNED_BYTE, pixels);
    let sum = 0;
    for (let i = 0; i < pixels.length; ++i) sum = (31 * sum + pixels[i]) % 4294967291;
    return {
      frame: transport.frame,
      label: document.getElementById('time').textContent,
      picture: sum,
      surfaces: surfaces.map((surface) => ({
        name: surface.name,
        kind: surface.kind,
        first: Array.from(surface.positions.slice(0, 300)),
        finite: surface.positions.every(Number.isFinite),
        strain: surface.edges ? surface.strain().reduce((a, b) => a + b, 0) / surface.strain().length : 0,
      })),
    };
  });

function largestMove(a, b) {
  return Math.max(...a.surfaces.map((surface, s) =>
    Math.max(...surface.first.map((value, i) => Math.abs(value - b.surfaces[s].first[i])))));
}

async function checkScrubbing(page) {
  const first = await look(page);
  expect(first.frame === 0, 'does not begin with the first frame');
  for (const { name, finite, strain } of first.surfaces) {
    expect(finite, `${name}: positions are not finite`);
    expect(strain < 0.3, `${name}: edges are strained by ${strain}, so vertices are in wrong places`);
  }
  await page.locator('#scrub').press('End');
  const last = await look(page);
  expect(last.frame > 0, 'the scrubber does not move');
  expect(last.label !== first.label, 'the time is not shown');
  expect(largestMove(first, last) > 1e-4, 'scrubbing moves no vertex');
  expect(last.picture !== first.picture, 'scrubbing changes nothing in the picture');
  await page.locator('#scrub').press('Home');
  const again = await look(page);
  expect(largestMove(first, again) === 0, 'the first frame is not the same again');
}

async function checkToggles(page) {
  for (const box of await page.locator('#layers input').all()) {
    const before = await look(page);
    await box.click();
    const after = await look(page);
    const name = await box.getAttribute('data-layer');
    expect(before.picture !== after.picture, `layer ${name} changes nothing`);
    await box.click();
    expect((await look(page)).picture === before.picture, `layer ${name} does not come back`);
  }
}

async function checkColors(page) {
  const seen = new Map();
  for (const button of await page.locator('#colors input').all()) {
    await button.click();
    const name = await button.getAttribute('value');
    const { picture } = await look(page);
    if (seen.has(picture)) failures.push(`colours ${name} look like ${seen.get(picture)}`);
    seen.set(picture, name);
    expect((await page.locator('#legend').isVisible()) === (name !== 'own'), `colours ${name}: legend`);
    if (shots) await page.screenshot({ path: join(shots, `color_${name}.png`) });
  }
  await page.locator('#colors input[value=own]').click();
  console.log(`colours: ${[...seen.values()].join(', ')}`);
}

async function checkPlay(page) {
  await page.locator('#speed').selectOption('0.1'); // several pictures per frame
  await page.locator('#play').click();
  await page.waitForFunction(() => window.simulcapReport.transport.frame > 0, null, { timeout: 20000 });
  await page.locator('#play').click();
  expect((await page.locator('.plot .now').count()) > 0, 'no plot marks the frame');
  const plot = page.locator('.plot .u-over').first();
  const box = await plot.boundingBox();
  await plot.click({ position: { x: box.width - 2, y: box.height / 2 } });
  const { frame } = await look(page);
  const last = (await page.evaluate(() => window.simulcapReport.data.frames)) - 1;
  expect(last - frame <= 0.02 * last, `a click at the end of a plot goes to frame ${frame} of ${last}`);
}

/** The capture from the recording's camera lies over the person that the camera measured. */
async function checkOverlay(page) {
  const overlap = await page.evaluate(() => {
    const { replay, data, transport } = window.simulcapReport;
    if (!data.camera) return null;
    replay.render();
    const canvas = document.querySelector('#camera-picture canvas');
    const drawn = canvas.getContext('2d').getImageData(0, 0, canvas.width, canvas.height).data;
    const { columns, stride } = data.camera.depth;
    const { values } = replay.depthPoints.track.at(transport.frame);
    const scale = canvas.width / data.camera.width;
    let both = 0, either = 0;
    for (let i = 0; i < values.length; ++i) {
      const x = Math.floor(((i % columns) * stride + 0.5) * scale);
      const y = Math.floor((Math.floor(i / columns) * stride + 0.5) * scale);
      const isDrawn = drawn[4 * (y * canvas.width + x) + 3] > 0;
      both += isDrawn && values[i] > 0;
      either += isDrawn || values[i] > 0;
    }
    return both / either;
  });
  if (overlap === null) return;
  console.log(`overlay: ${overlap.toFixed(3)} of person and capture overlap`);
  expect(overlap > 0.7, `the overlay is beside the person: overlap ${overlap}`);
}

async function checkTheme(page) {
  const paper = () => page.evaluate(() => getComputedStyle(document.body).backgroundColor);
  const light = await paper();
  if (shots) await page.screenshot({ path: join(shots, 'light.png') });
  if (shots) await page.screenshot({ path: join(shots, 'light_whole.png'), fullPage: true });
  await page.locator('#theme').click();
  expect((await paper()) !== light, 'there is no dark theme');
  // The last frame is shown.
  const marked = await page.locator('.plot').first().evaluate((plot) =>
    parseFloat(plot.querySelector('.now').style.left) / plot.querySelector('.u-over').clientWidth);
  expect(marked > 0.9, `the plots drawn anew mark the frame at ${marked} of their width`);
  if (shots) await page.screenshot({ path: join(shots, 'dark.png') });
  if (shots) await page.screenshot({ path: join(shots, 'dark_whole.png'), fullPage: true });
  const wide = await page.evaluate(() => document.documentElement.scrollWidth > innerWidth);
  expect(!wide, 'the page is wider than a laptop screen');
}

const browser = await chromium.launch({
  executablePath: browserPath(),
  args: ['--no-sandbox', '--use-angle=swiftshader', '--enable-unsafe-swiftshader', '--ignore-gpu-blocklist'],
});
try {
  const page = await open(browser);
  await checkScrubbing(page);
  await checkToggles(page);
  await checkColors(page);
  await checkOverlay(page);
  await checkPlay(page);
  await checkTheme(page);
} catch (error) {
  failures.push(String(error));
} finally {
  await browser.close();
}
for (const failure of failures) console.log(`FAILED: ${failure}`);
process.exit(failures.length > 0 ? 1 : 0);
