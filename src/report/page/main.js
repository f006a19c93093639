// report.html: brings the parts of the page together.
import { CameraView } from './camera_view.js';
import { cssGradient, kColorings } from './colors.js';
import { addComparison } from './comparison.js';
import { element } from './dom.js';
import { Plots } from './plots.js';
import { DepthPoints, Replay } from './replay.js';
import { addStability } from './stability.js';
import { Surface } from './surface.js';
import { addTables, headline } from './tables.js';
import { Transport } from './transport.js';

const root = document.documentElement;
const byId = (id) => document.getElementById(id);

function setUpTheme(changed) {
  const dark = matchMedia('(prefers-color-scheme: dark)');
  const set = (theme) => {
    root.dataset.theme = theme;
    changed(getComputedStyle(root));
  };
  byId('theme').addEventListener('click', () => set(root.dataset.theme === 'dark' ? 'light' : 'dark'));
  dark.addEventListener('change', () => set(dark.matches ? 'dark' : 'light'));
  set(dark.matches ? 'dark' : 'light');
}

async function loadSurfaces({ parts, camera, truth }) {
  const surfaces = [];
  let garment = 0;
  for (const part of parts) {
    const errors = {};
    if (part.kind === 'garment') {
      if (camera) errors.depthError = camera.errors[garment];
      if (truth) errors.truthError = truth.errors[garment];
      ++garment;
    }
    surfaces.push(await new Surface(part, errors).load());
  }
  for (const part of truth?.parts ?? []) surfaces.push(await new Surface(part).load());
  return surfaces;
}

/** Check boxes that show and hide. */
function addLayers(replay, surfaces, depthPoints) {
  const layers = byId('layers');
  const add = (title, color, shown, show) => {
    const box = element('input', { type: 'checkbox', checked: shown });
    const swatch = element('span', { className: 'swatch' });
    swatch.style.background = color;
    box.dataset.layer = title;
    box.addEventListener('change', () => {
      show(box.checked);
      replay.invalidate();
    });
    show(shown);
    layers.append(element('label', { title }, box, swatch, title));
  };
  for (const surface of surfaces) {
    const isTruth = surface.kind === 'truth';
    add(isTruth ? `true ${surface.name}` : surface.name, `#${surface.ownColor().getHexString()}`, !isTruth, (shown) => {
      surface.mesh.visible = shown;
    });
  }
  if (depthPoints) add('depth points', 'var(--accent)', false, (shown) => (depthPoints.object.visible = shown));
}

function showLegend(name) {
  const { title, stops, ends, text } = kColorings[name];
  const legend = byId('legend');
  legend.hidden = !stops;
  if (!stops) return;
  const bar = element('div', { className: 'bar' });
  bar.style.background = cssGradient(kColorings[name]);
  legend.replaceChildren(
    element('b', {}, title), bar,
    element('div', { className: 'ends' }, ...ends.map((end) => element('span', {}, end))),
    element('div', {}, text));
}

/** One of the colourings for which somebody has values. */
function addColorings(surfaces, choose) {
  for (const [name, { title, needs }] of Object.entries(kColorings)) {
    if (needs && !surfaces.some((surface) => surface.has(needs))) continue;
    const button = element('input', { type: 'radio', name: 'coloring', value: name, checked: name === 'own' });
    button.addEventListener('change', () => choose(name));
    byId('colors').append(element('label', {}, button, title));
  }
}

function makeReplay(data, surfaces, depthPoints) {
  const replay = new Replay(byId('canvas'), surfaces, depthPoints, data.camera);
  for (const name of replay.views()) {
    const button = element('button', { type: 'button', textContent: name });
    button.addEventListener('click', () => replay.lookFrom(name));
    byId('view-buttons').append(button);
  }
  addLayers(replay, surfaces, depthPoints);
  return replay;
}

/** Replay, camera view and colours as one function of the frame. */
async function setUpViews(data) {
  const surfaces = await loadSurfaces(data);
  const depthPoints = data.camera ? await new DepthPoints(data.camera).load() : null;
  const replay = makeReplay(data, surfaces, depthPoints);
  const cameraView = data.camera ? new CameraView(byId('camera'), data.camera, replay) : null;
  const state = { frame: 0, coloring: 'own' };
  addColorings(surfaces, (name) => {
    state.coloring = name;
    showLegend(name);
    replay.color(state.frame, name);
  });
  const show = (frame) => {
    state.frame = frame;
    cameraView?.show(frame);
    replay.show(frame, state.coloring);
  };
  return { surfaces, replay, show };
}

async function start() {
  const data = JSON.parse(byId('report').textContent);
  const title = data.metrics.input ?? '';
  byId('title').textContent = title;
  document.title = `simulcap: ${title}`;
  byId('headline').append(...headline(data));
  addTables(byId('tables'), data);
  if (data.comparison) addComparison(byId('tables'), data.comparison);
  if (data.stability) addStability(byId('tables'), data.stability);

  let views = null;
  let transport = null;
  const plots = new Plots(byId('plots'), data.series, (frame) => transport?.go(frame));
  setUpTheme((style) => {
    plots.draw(style);
    views?.replay.setTheme(style);
  });
  views = await setUpViews(data);
  transport = new Transport({
    frames: data.frames,
    framesPerSecond: data.frames_per_second / data.stride,
    numbers: data.series.numbers,
    show: (frame) => {
      views.show(frame);
      plots.mark(frame);
    },
  });
  views.replay.setTheme(getComputedStyle(root));
  transport.go(0);
  views.replay.resize();
  views.replay.lookFrom(data.camera ? 'Front' : '3/4');
  views.replay.render();
  byId('message').hidden = true;
  window.simulcapReport = { data, transport, ...views }; // for scripts that look at the page
  root.dataset.ready = 'true';
}

start().catch((error) => {
  console.error(error);
  byId('message').textContent = `The replay can't be shown: ${error.message}`;
  byId('message').className = 'error';
});
