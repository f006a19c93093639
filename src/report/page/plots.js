// Figures over time; a click or drag in a plot goes to the frame, and the frame is marked in all.
import uPlot from 'uplot';

const kTitles = {
  depth_error_mm: 'Depth error of visible garment [mm]',
  truth_error_mm: 'Garment to true surface [mm]',
  strain_percent: 'Edge strain [%]',
  timing_ms: 'Time per frame [ms]',
};
const kCurves = ['#2563eb', '#f97316', '#16a34a', '#9333ea', '#64748b', '#dc2626'];
const kHeight = 152;

class Plot {
  constructor(parent, name, curves, numbers, go) {
    this.numbers = numbers;
    this.root = parent.appendChild(document.createElement('div'));
    this.root.className = 'plot';
    const title = this.root.appendChild(document.createElement('h3'));
    title.textContent = kTitles[name] ?? name;
    this.names = Object.keys(curves);
    this.names.forEach((curve, i) => {
      const key = title.appendChild(document.createElement('i'));
      key.textContent = curve.replaceAll('_', ' ');
      key.style.setProperty('--curve', kCurves[i % kCurves.length]);
    });
    this.data = [numbers, ...Object.values(curves)];
    this.go = go;
    this.frame = 0;
    new ResizeObserver(() => this.resize()).observe(this.root);
  }

  resize() {
    this.plot?.setSize({ width: this.root.clientWidth, height: kHeight });
  }

  draw(style) {
    const color = (name) => style.getPropertyValue(name).trim();
    const axis = {
      stroke: color('--faint'),
      grid: { stroke: color('--line'), width: 1 },
      ticks: { stroke: color('--line'), width: 1 },
      font: '11px system-ui, sans-serif',
      size: (u, labels) => 14 + 7 * Math.max(3, ...(labels ?? []).map((label) => label.length)),
    };
    this.plot?.destroy();
    this.plot = new uPlot(
      {
        width: Math.max(200, this.root.clientWidth),
        height: kHeight,
        legend: { show: false },
        hooks: { draw: [() => this.mark(this.frame)] }, // only then it's known where frames are
        cursor: { drag: { x: false, y: false }, points: { show: false }, y: false },
        scales: { x: { time: false }, y: { range: (u, low, high) => [0, high > 0 ? 1.08 * high : 1] } },
        axes: [{ ...axis, size: 26 }, axis],
        series: [
          {},
          ...this.names.map((label, i) => ({
            label,
            stroke: kCurves[i % kCurves.length],
            width: 1.5,
            points: { show: this.numbers.length < 3 },
          })),
        ],
      },
      this.data,
      this.root);
    this.now = this.plot.over.appendChild(document.createElement('div'));
    this.now.className = 'now';
    const seek = (event) => {
      if (event.buttons !== 1) return;
      const x = event.clientX - this.plot.over.getBoundingClientRect().left;
      this.go(this.plot.posToIdx(x));
    };
    this.plot.over.addEventListener('pointerdown', seek);
    this.plot.over.addEventListener('pointermove', seek);
  }

  mark(frame) {
    this.frame = frame;
    if (!this.plot) return;
    this.now.style.left = `${this.plot.valToPos(this.numbers[frame], 'x')}px`;
  }
}

export class Plots {
  constructor(parent, { numbers, plots }, go) {
    const order = Object.keys(kTitles).filter((name) => name in plots);
    this.plots = order.map((name) => new Plot(parent, name, plots[name], numbers, go));
  }

  draw(style) {
    for (const plot of this.plots) plot.draw(style);
  }

  mark(frame) {
    for (const plot of this.plots) plot.mark(frame);
  }
}
