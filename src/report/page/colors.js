// Colour scales. Tables of 256 linear-light colours for the renderer, CSS gradients for the legend.
import { Color } from 'three';

const kSequential = ['#440154', '#3b528b', '#21918c', '#5ec962', '#fde725'];
const kDiverging = ['#1d4ed8', '#93b4e8', '#eeeeea', '#ee9a87', '#c81e1e'];
const kProvenance = ['#64748b', '#f97316'];

function table(stops) {
  const colors = stops.map((stop) => new Color(stop));
  const rgb = new Float32Array(3 * 256);
  for (let i = 0; i < 256; ++i) {
    const at = (i / 255) * (stops.length - 1);
    const low = Math.min(Math.floor(at), stops.length - 2);
    colors[low].clone().lerp(colors[low + 1], at - low).toArray(rgb, 3 * i);
  }
  return rgb;
}

/**
 * What surfaces can be coloured by. `place` brings a value to 0 … 1 (null: no value) from
 * (part, vertex, frame); `needs` names what a part must have.
 */
export const kColorings = {
  own: { title: 'Garments' },
  depth: {
    title: 'Depth error',
    needs: 'depthError',
    stops: kDiverging,
    ends: ['−20 mm', '0', '+20 mm'],
    text: 'Distance to the measured surface: blue behind it, red in front; grey not seen',
    place: (value) => (value === 0 ? null : 0.5 + (value - 128) / 80),
  },
  truth: {
    title: 'Error to truth',
    needs: 'truthError',
    stops: kSequential,
    ends: ['0', '30', '60 mm'],
    text: 'Distance to the nearest true surface',
    place: (value) => (value === 0 ? null : (value - 128) / 120),
  },
  provenance: {
    title: 'Provenance',
    needs: 'provenance',
    stops: kProvenance,
    ends: ['simulated', 'fitted to depth'],
    text: 'Where a vertex comes from',
    place: (value) => value / 255,
  },
  strain: {
    title: 'Strain',
    needs: 'strain',
    stops: kSequential,
    ends: ['0', '10', '20 %'],
    text: 'Mean change in length of a vertex’s edges',
    place: (value) => value / 0.2,
  },
  material: {
    title: 'Material',
    needs: 'stiffness',
    stops: kSequential,
    ends: ['100', '1 000', '10 000 N/m'],
    text: 'Stretch stiffness k',
    place: (value) => (value - 2) / 2,
  },
};

for (const coloring of Object.values(kColorings)) {
  if (coloring.stops) coloring.table = table(coloring.stops);
}

const kUnknown = new Color('#9ba1a6').toArray();

/** Writes the colours of values (one per vertex) into a Float32Array. */
export function paint(coloring, values, target) {
  const { place, table: rgb } = coloring;
  for (let v = 0; v < values.length; ++v) {
    const at = place(values[v]);
    if (at === null) {
      target.set(kUnknown, 3 * v);
      continue;
    }
    const entry = 3 * Math.round(255 * Math.min(1, Math.max(0, at)));
    target[3 * v] = rgb[entry];
    target[3 * v + 1] = rgb[entry + 1];
    target[3 * v + 2] = rgb[entry + 2];
  }
}

export function cssGradient(coloring) {
  return `linear-gradient(to right, ${coloring.stops.join(', ')})`;
}
