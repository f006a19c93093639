// Elements in a few words.

/** element('td', { className: 'text' }, 'some ', otherElement) */
export function element(name, properties = {}, ...children) {
  const made = document.createElement(name);
  Object.assign(made, properties);
  made.append(...children);
  return made;
}

export function card(title, ...children) {
  return element('section', { className: 'card' }, element('h2', {}, title), ...children);
}

export function table(head, rows) {
  const cells = (tag, row) => element('tr', {}, ...row.map((cell) => element(tag, {}, cell)));
  const made = element('table');
  if (head) made.append(element('thead', {}, cells('th', head)));
  made.append(element('tbody', {}, ...rows.map((row) => cells('td', row))));
  return made;
}

/** A number as short as it is worth reading. */
export function short(value) {
  if (typeof value !== 'number') return value === null || value === undefined ? '' : String(value);
  if (Number.isInteger(value)) return value.toLocaleString('en');
  const size = Math.abs(value);
  if (size >= 100) return value.toFixed(0);
  if (size >= 10) return value.toFixed(1);
  if (size >= 0.1) return value.toFixed(2);
  return Number(value.toPrecision(2)).toString();
}
