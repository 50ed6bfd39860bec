/** Elements from plain text; nothing of a bundle is ever read as markup. */

/**
 * @param {string} tag
 * @param {Record<string, any>} [properties] properties; `aria-`, `role` and `for` become attributes
 * @param {...(Node | string)} children
 * @returns {any}
 */
export function make(tag, properties = {}, ...children) {
  const element = document.createElement(tag);
  for (const [name, value] of Object.entries(properties)) {
    if (value === undefined) continue;
    if (name.startsWith('on')) element.addEventListener(name.slice(2), value);
    else if (name.includes('-') || name === 'role' || name === 'for') element.setAttribute(name, value);
    else element[name] = value;
  }
  element.append(...children);
  return element;
}

/** A section of the panel. */
export function section(title, ...children) {
  return make('section', { 'aria-label': title }, make('h2', {}, title), ...children);
}

/** A section that can be folded. */
export function folded(title, open, ...children) {
  return make('details', { className: 'section', open }, make('summary', { className: 'title' }, title), ...children);
}

/**
 * One of several choices, as a radio group with arrow keys.
 * @param {HTMLElement} group
 * @param {[string, string][]} choices value and word
 * @param {(value: string) => void} choose
 * @returns {(value: string) => void} shows a choice
 */
export function segment(group, choices, choose) {
  group.setAttribute('role', 'radiogroup');
  group.classList.add('segment');
  const buttons = choices.map(([value, word]) =>
    make('button', { type: 'button', role: 'radio', value, onclick: () => choose(value) }, word),
  );
  group.append(...buttons);
  group.addEventListener('keydown', (event) => {
    const step = { ArrowRight: 1, ArrowDown: 1, ArrowLeft: -1, ArrowUp: -1 }[event.key];
    if (!step) return;
    event.preventDefault();
    const now = buttons.findIndex((button) => button.getAttribute('aria-checked') === 'true');
    const next = buttons[(now + step + buttons.length) % buttons.length];
    next.focus();
    choose(next.value);
  });
  return (value) => {
    for (const button of buttons) {
      const on = button.value === value;
      button.setAttribute('aria-checked', String(on));
      button.tabIndex = on ? 0 : -1;
    }
  };
}

/**
 * A labelled slider.
 * @param {string} word
 * @param {{low: number, high: number, step: number, unit?: string, title?: string}} range
 * @param {(value: number) => void} changed
 */
export function slider(word, { low, high, step, unit = '', title }, changed) {
  const id = 's-' + word.replace(/\W+/g, '-').toLowerCase();
  const digits = step < 1 ? 2 : 0;
  // Not an <output>: fifty live regions would talk over each other; the slider itself says its value.
  const output = make('span', { className: 'value', 'aria-hidden': 'true' });
  const input = make('input', { type: 'range', id, min: low, max: high, step });
  const row = make('div', { className: 'row' }, make('label', { for: id, title: title ?? word }, word), input, output);
  const show = (value) => {
    input.value = String(value);
    output.textContent = value.toFixed(digits) + unit;
    input.setAttribute('aria-valuetext', output.textContent);
    row.classList.toggle('on', Math.abs(value) > 0.004);
  };
  input.addEventListener('input', () => {
    show(Number(input.value));
    changed(Number(input.value));
  });
  input.addEventListener('dblclick', () => {
    show(0);
    changed(0);
  });
  show(0);
  return { row, input, show };
}

/** A switch with a label. */
export function toggle(word, checked, changed) {
  const input = make('input', { type: 'checkbox', checked, onchange: () => changed(input.checked) });
  return make('label', {}, input, word);
}

/** A short message for everybody, also for those who cannot see the page. */
export function say(text) {
  document.getElementById('status').textContent = text;
}
