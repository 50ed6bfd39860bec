/** The 52 sliders, by region, with a search. */

import { make, slider } from './dom.js';

/** @type {[string, RegExp][]} */
const REGIONS = [
  ['Brows', /^brow/],
  ['Eyes', /^eye/],
  ['Cheeks and nose', /^(cheek|nose)/],
  ['Jaw', /^jaw/],
  ['Mouth', /^mouth/],
  ['Tongue', /^tongue/],
];

/** "mouthSmileLeft" in words. */
export const words = (name) => {
  const text = name.replace(/([A-Z])/g, ' $1').toLowerCase();
  return text[0].toUpperCase() + text.slice(1);
};

/** The same expression on the other side, if there is one. */
function twin(name) {
  if (/^(jaw|mouth)(Left|Right)$/.test(name)) return null; // a direction, not a side
  if (name.endsWith('Left')) return name.slice(0, -4) + 'Right';
  if (name.endsWith('Right')) return name.slice(0, -5) + 'Left';
  return null;
}

export class Sliders {
  /**
   * @param {string[]} names
   * @param {(weights: Record<string, number>) => void} changed
   */
  constructor(names, changed) {
    this.rows = new Map();
    this.both = false;
    const mirror = make('button', {
      type: 'button', 'aria-pressed': 'false', title: 'A slider moves its twin on the other side',
      onclick: () => {
        this.both = !this.both;
        mirror.setAttribute('aria-pressed', String(this.both));
      },
    }, 'Both sides');
    const search = make('input', {
      type: 'search', placeholder: 'Search 52 expressions', 'aria-label': 'Search expressions',
      oninput: () => this.#filter(search.value),
    });
    this.none = make('p', { className: 'note', hidden: true }, 'No expression has that in its name.');
    this.groups = REGIONS.map(([title, pattern]) => {
      const members = names.filter((name) => pattern.test(name));
      const rows = members.map((name) => {
        const one = slider(words(name), { low: 0, high: 1, step: 0.01, title: name }, (value) => {
          const weights = { [name]: value };
          const other = this.both && twin(name);
          if (other && this.rows.has(other)) {
            weights[other] = value;
            this.rows.get(other).show(value);
          }
          changed(weights);
        });
        one.input.dataset.name = name;
        this.rows.set(name, one);
        return one.row;
      });
      const count = make('small', {}, ` ${members.length}`);
      return make('details', { className: 'group', open: title === 'Mouth' }, make('summary', {}, title, count), ...rows);
    });
    this.element = make('div', {}, make('div', { className: 'tools' }, search, mirror), this.none, ...this.groups);
    this.folds = null;
  }

  #filter(text) {
    const wanted = text.trim().toLowerCase().replace(/\s+/g, ' ');
    const match = (name) => !wanted || words(name).toLowerCase().includes(wanted) || name.toLowerCase().includes(wanted);
    if (wanted && !this.folds) this.folds = this.groups.map((group) => group.open);
    this.rows.forEach((one, name) => (one.row.hidden = !match(name)));
    this.groups.forEach((group, k) => {
      const any = [...group.querySelectorAll('.row')].some((row) => !row.hidden);
      group.hidden = !any;
      group.open = wanted ? any : (this.folds?.[k] ?? group.open);
    });
    if (!wanted) this.folds = null;
    this.none.hidden = this.groups.some((group) => !group.hidden);
  }

  /** Show weights [52] that came from elsewhere. */
  show(names, weights) {
    names.forEach((name, k) => this.rows.get(name).show(weights[k]));
  }
}
