// Figures, settings, and what was left out.
import { card, element, short, table } from './dom.js';

const kColumns = ['mean', 'median', 'p95', 'max'];
const kNames = {
  depth_error_mm: 'visible garment to depth',
  depth_error_before_fit_mm: 'the same before the fit',
  joint_mm: 'joints',
  body_vertex_mm: 'body surface',
  garment_visible_mm: 'garments, seen',
  garment_hidden_mm: 'garments, hidden',
  hidden_mm_by_skinning: 'hidden, by skinning alone',
  outer_surface_mm: 'outer surface',
  edge_strain: 'edge strain [1]',
};

function named(key) {
  return kNames[key] ?? key.replaceAll('_', ' ');
}

function isDistribution(value) {
  return value !== null && typeof value === 'object' && !Array.isArray(value) && kColumns.some((c) => c in value);
}

function distributionRows(group) {
  const order = Object.keys(kNames);
  return Object.entries(group)
    .filter(([, value]) => isDistribution(value))
    .sort(([a], [b]) => order.indexOf(a) - order.indexOf(b))
    .map(([key, value]) => [named(key), ...kColumns.map((column) => short(value[column]))]);
}

/** Everything of a group that is a plain value, groups within it by their path. */
function plainRows(group, path = '') {
  return Object.entries(group).flatMap(([key, value]) => {
    const name = path + named(key);
    if (isDistribution(value)) return [];
    if (Array.isArray(value)) return [[name, value.map(short).join(', ') || 'none']];
    if (value !== null && typeof value === 'object') return plainRows(value, `${name} · `);
    return [[name, short(value)]];
  });
}

function errorsCard(metrics) {
  const rows = [...distributionRows(metrics), ...distributionRows(metrics.ground_truth ?? {})];
  const others = ['penetration', 'jitter_mm_per_frame', 'depth_targets', 'frames_lost', 'frames_unstable', 'frames_redone']
    .filter((key) => key in metrics)
    .flatMap((key) => plainRows({ [key]: metrics[key] }));
  const overlap = metrics.ground_truth?.segmentation_iou;
  if (overlap) others.push(...plainRows({ segmentation_iou: overlap }));
  if (rows.length + others.length === 0) return null;
  const parts = [];
  if (rows.length > 0) parts.push(table(['mm', ...kColumns], rows));
  if (others.length > 0) parts.push(element('h3', {}, 'Beside this'), table(null, others));
  return card('Errors', ...parts);
}

function timesCard(metrics) {
  const times = metrics.timing_ms ?? {};
  const rows = Object.entries(times).map(([stage, time]) => [named(stage), short(time.median), short(time.p95)]);
  if (rows.length === 0) return null;
  const about = plainRows({
    ...(metrics.machine ?? {}),
    ...('calibration_gflops' in metrics ? { 'speed of one core [GFLOP/s]': metrics.calibration_gflops } : {}),
    ...('substeps_per_frame' in metrics ? { substeps_per_frame: metrics.substeps_per_frame } : {}),
  });
  return card('Time per frame', table(['ms', 'median', 'p95'], rows), element('h3', {}, 'Measured on'), table(null, about));
}

function settingsCard({ program, metrics, parts, scene, frames_per_second: rate }) {
  const rows = plainRows({
    program: metrics.program ?? program,
    input: metrics.input,
    ...('method' in metrics ? { method: metrics.method } : {}),
    'frames per second': rate,
    ...(metrics.settings ?? {}),
  });
  const made = card('Scene and settings', table(null, rows));
  const cloths = parts.filter((part) => part.material);
  if (cloths.length > 0) {
    const head = ['cloth', 'k [N/m]', 'w [Nm/rad]', 'mass', 'friction', 'vertices'];
    made.append(
      element('h3', {}, 'Materials'),
      table(head, cloths.map(({ name, material, positions }) => [
        name,
        short(material.stretch_k),
        short(material.torsion_w),
        element('span', { className: 'nowrap' }, 'vertex_mass_kg' in material
          ? `${short(1000 * material.vertex_mass_kg)} g each`
          : `${short(material.areal_density_kg_m2)} kg/m²`),
        short(material.friction),
        short(positions.points),
      ])));
  }
  if (scene) {
    made.append(element('details', {}, element('summary', {}, 'Scene file'), element('pre', {}, scene)));
  }
  return made;
}

function megabytes(bytes) {
  return (bytes / 1e6).toFixed(2);
}

function leftOutCard({ metrics, notes, savings, frames, frames_of: all, stride }) {
  const lines = [];
  if (metrics.left_out) {
    lines.push(`Not needed by the scene, and so never built or computed: ${metrics.left_out.join(', ') || 'nothing'}`);
  }
  if (stride > 1) lines.push(`Every ${stride}th frame is shown: ${frames} of ${all}`);
  lines.push(...notes);
  const rows = savings
    .filter(({ raw }) => raw > 0)
    .map(({ what, how, raw, packed }) => [what, element('span', { className: 'text' }, how), megabytes(raw), megabytes(packed)]);
  const made = card('Left out, and what it saved');
  made.id = 'left-out';
  if (lines.length > 0) made.append(element('ul', { className: 'notes' }, ...lines.map((line) => element('li', {}, line))));
  made.append(element('h3', {}, 'In this page'), table(['', 'as', 'MB before', 'MB here'], rows));
  return made;
}

export function addTables(parent, data) {
  const { metrics } = data;
  const cards = [errorsCard(metrics), timesCard(metrics), settingsCard(data), leftOutCard(data)];
  parent.append(...cards.filter((made) => made !== null));
}

/** The few figures that matter most, for the head of the page. */
export function headline({ metrics, frames_of: frames }) {
  const figures = [[short(frames), 'frames']];
  const add = (value, unit, what) => {
    if (value !== undefined) figures.push([`${short(value)} ${unit}`, what]);
  };
  add(metrics.depth_error_mm?.median, 'mm', 'to depth, median');
  add(metrics.ground_truth?.garment_visible_mm?.median, 'mm', 'to truth, seen');
  add(metrics.ground_truth?.garment_hidden_mm?.median, 'mm', 'hidden');
  const time = metrics.timing_ms?.total ?? metrics.timing_ms?.cloth_simulation;
  add(time?.median, 'ms', 'per frame');
  return figures.map(([value, what]) =>
    element('li', {}, element('b', {}, value), ' ', element('span', {}, what)));
}
