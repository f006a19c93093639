// Error against run time of compare.json, both logarithmic, as SVG.
import { card, short } from './dom.js';

const kColors = ['#2563eb', '#f97316', '#16a34a', '#9333ea', '#0891b2', '#dc2626'];
const kWidth = 900, kHeight = 420, kLeft = 64, kRight = 20, kTop = 14, kBottom = 44;

function svg(name, attributes, text) {
  const made = document.createElementNS('http://www.w3.org/2000/svg', name);
  for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
  if (text !== undefined) made.textContent = text;
  return made;
}

function scale(values, from, to) {
  const low = Math.log10(Math.min(...values)) - 0.1;
  const high = Math.log10(Math.max(...values)) + 0.1;
  const at = (value) => from + ((Math.log10(value) - low) / (high - low)) * (to - from);
  const ticks = [];
  for (let power = Math.floor(low); power <= Math.ceil(high); ++power) {
    for (const digit of high - low < 2 ? [1, 2, 5] : [1]) {
      const value = digit * 10 ** power;
      if (Math.log10(value) >= low && Math.log10(value) <= high) ticks.push(value);
    }
  }
  return { at, ticks };
}

/** What error a comparison is about: of solvers from the converged solution, of captures from the truth. */
const kErrors = [
  { title: 'rms error [mm]', of: (run) => run.error_mm?.rms },
  { title: 'seen garment to true surface, median [mm]', of: (run) => run.ground_truth?.garment_visible_mm?.median },
  { title: 'visible garment to depth, median [mm]', of: (run) => run.depth_error_mm?.median },
];

function describe(run, error) {
  const settings = Object.entries(run.settings ?? {})
    .filter(([, value]) => typeof value !== 'object')
    .map(([key, value]) => `${key}: ${value}`);
  const size = run.vertices ? [`${short(run.vertices)} vertices, ${short(run.substeps_per_frame)} substeps`] : [];
  return [
    run.solver,
    `${short(run.wall_ms_per_frame)} ms per frame, ${error.title}: ${short(error.of(run))}`,
    ...size,
    ...settings,
  ].join('\n');
}

export function addComparison(parent, comparison) {
  const { runs } = comparison;
  const error = kErrors.find(({ of }) => runs.some((run) => of(run) > 0));
  const shown = error ? runs.filter((run) => run.wall_ms_per_frame > 0 && error.of(run) > 0) : [];
  const made = card('Error against run time');
  made.classList.add('wide');
  parent.append(made);
  if (shown.length > 0) made.append(plot(shown, error));
  if (runs.length > shown.length) {
    made.append(`${runs.length - shown.length} of ${runs.length} runs are not shown: they blew up or have no error.`);
  }
}

function plot(runs, error) {
  const x = scale(runs.map((run) => run.wall_ms_per_frame), kLeft, kWidth - kRight);
  const y = scale(runs.map(error.of), kHeight - kBottom, kTop);
  const root = svg('svg', { viewBox: `0 0 ${kWidth} ${kHeight}`, width: '100%', role: 'img' });
  for (const tick of x.ticks) {
    root.append(
      svg('line', { class: 'axis', x1: x.at(tick), x2: x.at(tick), y1: kTop, y2: kHeight - kBottom }),
      svg('text', { x: x.at(tick), y: kHeight - kBottom + 16, 'text-anchor': 'middle' }, short(tick)));
  }
  for (const tick of y.ticks) {
    root.append(
      svg('line', { class: 'axis', x1: kLeft, x2: kWidth - kRight, y1: y.at(tick), y2: y.at(tick) }),
      svg('text', { x: kLeft - 6, y: y.at(tick) + 4, 'text-anchor': 'end' }, short(tick)));
  }
  root.append(
    svg('text', { x: kWidth / 2, y: kHeight - 8, 'text-anchor': 'middle' }, 'wall time per frame [ms]'),
    svg('text', { transform: `translate(14 ${kHeight / 2}) rotate(-90)`, 'text-anchor': 'middle' }, error.title));
  const solvers = [...new Set(runs.map((run) => run.solver))];
  for (const run of runs) {
    const color = kColors[solvers.indexOf(run.solver) % kColors.length];
    const point = svg('circle', {
      cx: x.at(run.wall_ms_per_frame),
      cy: y.at(error.of(run)),
      r: 5,
      fill: run.stable === false ? 'none' : color,
      stroke: color,
      'stroke-width': 1.5,
    });
    point.append(svg('title', {}, describe(run, error)));
    root.append(point);
  }
  solvers.forEach((solver, i) => {
    const row = kTop + 14 + 17 * i;
    root.append(
      svg('circle', { cx: kWidth - 170, cy: row - 4, r: 5, fill: kColors[i % kColors.length] }),
      svg('text', { x: kWidth - 158, y: row }, solver.replaceAll('_', ' ')));
  });
  return root;
}
