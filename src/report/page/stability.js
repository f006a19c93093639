// Stability map of stability.json: the largest stable substep over stretch and torsion stiffness.
import { card, element, short, table } from './dom.js';

const kPaperSubstep = 1000 / 3000; // [ms]

/** Red where the paper's substep is unstable, green where there is room. */
function heat(milliseconds) {
  const decades = Math.log10(milliseconds / kPaperSubstep);
  const at = Math.min(1, Math.max(-1, decades));
  return `hsl(${at < 0 ? 20 * (1 + at) : 45 + 100 * at} 65% ${72 + 8 * (1 - Math.abs(at))}%)`;
}

function cell(finding) {
  const limit = finding.shaken.limit_ms;
  const made = element('td', { className: finding.accepted_held ? '' : 'bad' }, short(limit));
  made.style.background = heat(limit);
  made.title =
    `k ${finding.stretch_k} N/m, w ${finding.torsion_w} N·m/rad\n` +
    `observed ${short(limit)} ms, predicted ${short(finding.predicted_ms)} ms, accepted ${short(finding.accepted_ms)} ms\n` +
    (finding.accepted_held ? 'what is accepted holds' : 'what is accepted blew up');
  return made;
}

function panel(title, findings) {
  const distinct = (key) => [...new Set(findings.map((finding) => finding[key]))];
  const columns = distinct('stretch_k');
  const made = element('table', { className: 'heat' });
  made.append(element('tr', {}, element('th', {}, 'w \\ k'), ...columns.map((k) => element('th', {}, short(k)))));
  for (const w of distinct('torsion_w')) {
    const row = columns.map((k) => {
      const finding = findings.find((one) => one.stretch_k === k && one.torsion_w === w);
      return finding ? cell(finding) : element('td');
    });
    made.append(element('tr', {}, element('th', {}, short(w)), ...row));
  }
  return element('div', {}, element('h3', {}, title), made);
}

export function addStability(parent, stability) {
  const groups = new Map();
  for (const finding of stability.grid) {
    const title = `${short(1000 * finding.vertex_mass_kg)} g per vertex, edges of ${short(1000 * finding.edge_length_m)} mm`;
    groups.set(title, [...(groups.get(title) ?? []), finding]);
  }
  const made = card(
    'Largest stable substep [ms]',
    element('div', { className: 'panels' }, ...[...groups].map(([title, findings]) => panel(title, findings))));
  made.classList.add('wide');
  const cases = stability.extreme_cases ?? [];
  if (cases.length > 0) {
    made.append(
      element('h3', {}, 'Extreme cases'),
      table(
        ['case', 'verdict', 'as expected', 'substeps per frame', 'largest strain [%]'],
        cases.map((one) => [one.what, one.verdict, one.passed ? 'yes' : 'no', short(one.substeps_per_frame), short(100 * one.strain.max)])));
  }
  parent.append(made);
}
