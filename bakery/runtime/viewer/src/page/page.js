/** The page of `bakery preview`: finds the bundle inside itself and wires the controls. */

import { AvatarError, MOST_GAZE, load } from '../avatar.js';
import { folded, make, say, section, segment, slider, toggle } from './dom.js';
import { Live } from './live.js';
import { Player, save } from './player.js';
import { follow, straighten } from './pointer.js';
import { Sliders, words } from './sliders.js';

const EASE = 220; // milliseconds from one expression to the next
const MOST_PIXELS = 2.2e6; // of the canvas
const SHOW_EVERY = 100; // milliseconds between updates of the sliders while a take plays
const STOPPED = matchMedia('(prefers-reduced-motion: reduce)');
const started = performance.now();

const table = (id) => JSON.parse(document.getElementById(id).textContent);

/** The bundle inside this page. */
function embedded() {
  return {
    description: table('description'),
    file: async (name) => {
      const holder = document.getElementById('file:' + name);
      if (!holder) throw new AvatarError(`the page lacks ${name}; write it again with bakery preview`);
      const text = holder.textContent;
      holder.remove(); // the bytes are held once, not twice
      const bytes = /** @type {any} */ (Uint8Array).fromBase64 ? /** @type {any} */ (Uint8Array).fromBase64(text) : decode(text);
      kept.set(name, bytes);
      return bytes;
    },
  };
}

const kept = new Map(); // for a graphics card that loses its memory

function decode(text) {
  const binary = atob(text);
  const bytes = new Uint8Array(binary.length);
  for (let k = 0; k < bytes.length; k++) bytes[k] = binary.charCodeAt(k);
  return bytes;
}

async function start() {
  const about = table('page');
  const canvas = /** @type {HTMLCanvasElement} */ (document.getElementById('view'));
  const wait = document.getElementById('wait');
  watch(about.watch);
  let avatar;
  try {
    const source = embedded();
    const read = source.file;
    source.file = async (name) => kept.get(name) ?? read(name);
    avatar = await load(source, { canvas });
  } catch (error) {
    wait.textContent = error instanceof AvatarError ? error.message : `The avatar cannot be shown: ${error.message}`;
    wait.classList.add('bad');
    throw error;
  }
  wait.hidden = true;
  const page = new Page(avatar, about, canvas);
  page.fit();
  page.draw(performance.now());
  page.ready = performance.now() - started;
  Object.assign(window, { avatar, page });
}

/** Load again when the bundle was baked again; only a page that `--serve` sends asks. */
function watch(token) {
  if (!token) return;
  const ask = async () => {
    try {
      const answer = await fetch('/version', { cache: 'no-store' });
      if (answer.ok && (await answer.text()) !== token) location.reload();
    } catch {
      // the server is gone or bakes; ask again
    }
    setTimeout(ask, 1000);
  };
  setTimeout(ask, 1000);
}

class Page {
  constructor(avatar, about, canvas) {
    this.avatar = avatar;
    this.canvas = canvas;
    this.wanted = false;
    this.all = true; // whether the controls are to be shown anew
    this.ready = 0; // milliseconds until the first picture
    this.ease = null;
    this.shownAt = 0;
    canvas.setAttribute('aria-label', `Avatar of ${about.title}`);
    avatar.options.stage = avatar.hasPhoto ? 'photo' : 'studio';
    this.sliders = new Sliders(avatar.expressions, (weights) => {
      this.stop();
      avatar.set(weights);
      this.request(false);
    });
    this.player = new Player(avatar, () => this.request());
    this.live = about.live ? new Live(this.player) : null;
    this.build(about);
    follow(canvas, avatar, {
      changed: () => this.request(false),
      gazed: () => {
        this.stop();
        this.request();
      },
    });
    new ResizeObserver(() => {
      this.fit();
      this.request(false);
    }).observe(canvas);
    canvas.addEventListener('avatarrestored', () => this.request());
    canvas.addEventListener('pointerdown', () => document.getElementById('hint').classList.add('gone'), { once: true });
    this.keys();
    this.drops();
  }

  build(about) {
    const { avatar } = this;
    const corner = document.getElementById('corner');
    corner.hidden = false;
    document.getElementById('straight').addEventListener('click', () => straighten(avatar, () => this.request(false)));
    const choice = document.getElementById('stage-choice');
    choice.hidden = !avatar.hasPhoto;
    const showStage = segment(choice, [['photo', 'In the photo'], ['studio', 'Studio']], (value) => {
      avatar.options.stage = value;
      straighten(avatar, () => {});
      showStage(value);
      this.light.hidden = this.headRows.hidden = value === 'photo';
      this.hint();
      this.request(false);
      say(value === 'photo' ? 'In the photo' : 'Studio');
    });
    showStage(avatar.options.stage);

    const panel = document.getElementById('panel');
    panel.append(
      make('header', {}, make('h1', { dir: 'auto' }, about.title), make('p', {}, 'Synthetic media: made from one portrait')),
      this.expressions(about),
      ...(this.live ? [section('Live', this.live.element)] : []),
      section('Take', this.player.element),
      this.gazeAndHead(),
      folded('Sliders', true, this.sliders.element),
      this.display(about.lights),
      this.facts(about),
    );
    this.light.hidden = this.headRows.hidden = avatar.inPhoto;
    this.hint();
  }

  hint() {
    const coarse = matchMedia('(pointer: coarse)').matches;
    document.getElementById('hint').textContent = [
      ...(this.avatar.inPhoto ? [] : ['Drag to turn']), 'Drag an eye to move the gaze', ...(coarse ? [] : ['Drop a Live Link Face CSV to play it']),
    ].join(' \u00b7 ');
  }

  expressions(about) {
    const chips = (rows, before = '') => make('div', { className: 'chips' }, ...rows.map(([name, weights]) =>
      make('button', { type: 'button', value: name, 'aria-label': before + words(name), onclick: () => this.go(weights) }, words(name))));
    const { expressions, about: facts } = this.avatar;
    const keys = facts.keys.map((key) => [key.name, Object.fromEntries(expressions.map((name, k) => [name, key.weights[k]]))]);
    return section('Expressions',
      chips([['neutral', {}], ...Object.entries(about.named)]),
      make('h3', {}, 'Key expressions of the bake'), chips(keys, 'Key '));
  }

  gazeAndHead() {
    const { avatar } = this;
    const look = (part, value) => {
      const gaze = [...avatar.gaze];
      gaze[part] = value;
      this.stop();
      avatar.look(gaze[0], gaze[1]);
      this.request();
    };
    const turn = (part, value) => {
      const head = [...avatar.head];
      head[part] = value;
      avatar.turn(head[0], head[1], head[2]);
      this.request(false);
    };
    const degrees = (most) => ({ low: -most, high: most, step: 1, unit: '\u00b0' });
    this.gazeRows = ['Gaze left', 'Gaze up'].map((word, k) => slider(word, degrees(MOST_GAZE[k]), (value) => look(k, value)));
    this.turnRows = ['Head left', 'Head up', 'Head tilt'].map((word, k) => slider(word, degrees([45, 25, 20][k]), (value) => turn(k, value)));
    this.headRows = make('div', {}, ...this.turnRows.map((one) => one.row));
    return folded('Gaze and head', false, ...this.gazeRows.map((one) => one.row), this.headRows);
  }

  display(lights) {
    const { avatar } = this;
    const { options } = avatar;
    const change = (name) => (value) => {
      options[name] = value;
      this.request(false);
    };
    const texture = make('div', { 'aria-label': 'Texture' });
    this.showTexture = segment(texture, [['dynamic', 'Dynamic'], ['static', 'Static']], (value) => {
      options.dynamic = value === 'dynamic';
      this.showTexture(value);
      this.request(false);
    });
    this.showTexture('dynamic');
    const mouth = make('div', { 'aria-label': 'Mouth' });
    const showMouth = segment(mouth, [['image', 'Image'], ['geometry', 'Teeth']], (value) => {
      showMouth(value);
      change('mouth')(value);
    });
    showMouth('image');
    const which = make('select', { 'aria-label': 'Expression of the mask', hidden: true, onchange: () => change('layerExpression')(which.value) },
      ...avatar.expressions.map((name) => make('option', { value: name, selected: name === options.layerExpression }, name)));
    const legend = make('ul', { className: 'legend', hidden: true },
      ...[['observed', '#5cc28a'], ['mirrored', '#5a9fdf'], ['inferred', '#eeb14a'], ['painted', '#d065b5']].map(([word, color]) => {
        const swatch = make('i', {});
        swatch.style.background = color;
        return make('li', {}, swatch, word);
      }));
    const layer = make('select', { id: 'layer', onchange: () => {
      change('layer')(layer.value);
      which.hidden = layer.value !== 'mask';
      legend.hidden = layer.value !== 'coverage';
    } }, ...[['color', 'Colour'], ['mask', 'Activation mask'], ['coverage', 'What the photo showed'], ['uv', 'Texture coordinates']]
      .map(([value, word]) => make('option', { value }, word)));
    const light = make('select', { id: 'light', onchange: () => change('light')(lights[light.value] ?? null) },
      ...['photo', ...Object.keys(lights)].map((value) => make('option', { value }, value === 'photo' ? 'As photographed' : words(value))));
    this.light = make('div', { className: 'pair' }, make('label', { for: 'light' }, 'Light'), light);
    const hair = toggle('Hair', options.hair, change('hair'));
    hair.hidden = !avatar.hasHair;
    return folded('Display', false,
      make('div', { className: 'pair' }, 'Texture', texture),
      make('div', { className: 'pair' }, 'Mouth', mouth),
      make('div', { className: 'pair' }, make('label', { for: 'layer' }, 'Layer'), layer, which), legend,
      this.light, make('div', { className: 'pair' }, hair),
      make('div', { className: 'tools' }, make('button', { type: 'button', onclick: () => this.picture() }, 'Save picture')));
  }

  facts(about) {
    this.cost = make('dd', {});
    const rows = about.facts.flatMap(([word, value]) => [make('dt', {}, word), make('dd', { dir: 'auto' }, value)]);
    const keys = document.getElementById('keys-help').textContent;
    return folded('About', false, make('dl', {}, ...rows, make('dt', {}, 'Frame'), this.cost), make('p', { className: 'note' }, keys));
  }

  /** Glide to an expression. */
  go(weights) {
    this.stop();
    const { avatar } = this;
    avatar.direction = null;
    const from = Float32Array.from(avatar.weights);
    const to = Float32Array.from(avatar.expressions, (name) => weights[name] ?? 0);
    this.ease = { from, to, start: performance.now(), length: STOPPED.matches ? 0 : EASE };
    this.request();
  }

  stop() {
    this.ease = null;
    if (this.player.playing) this.player.play(false);
  }

  /** Draw with the next frame of the browser; `all` when weights changed outside of the sliders. */
  request(all = true) {
    this.all = this.all || all;
    if (this.wanted) return;
    this.wanted = true;
    requestAnimationFrame((now) => {
      this.wanted = false;
      this.draw(now);
    });
  }

  draw(now) {
    const { avatar, player } = this;
    if (this.ease) {
      const { from, to, start, length } = this.ease;
      const share = length ? Math.min(Math.max((now - start) / length, 0), 1) : 1;
      const smooth = share * share * (3 - 2 * share);
      avatar.set(Object.fromEntries(avatar.expressions.map((name, k) => [name, from[k] + (to[k] - from[k]) * smooth])));
      this.all = true;
      if (share === 1) this.ease = null;
    }
    player.advance(now);
    const drawn = this.live?.advance();
    avatar.render();
    drawn?.(now);
    if (this.all && (now - this.shownAt > SHOW_EVERY || !(player.playing || this.ease))) {
      this.shownAt = now;
      this.all = false;
      this.sliders.show(avatar.expressions, avatar.weights);
      this.gazeRows.forEach((one, k) => one.show(avatar.gaze[k]));
      this.turnRows.forEach((one, k) => one.show(avatar.head[k]));
      const { milliseconds, drawCalls, uniformBytes } = avatar.stats;
      this.cost.textContent = `${milliseconds.toFixed(1)} ms, ${drawCalls} draw calls, ${uniformBytes} bytes`;
    }
    if (player.playing || player.recorder || this.ease) this.request(this.all);
  }

  fit() {
    const { canvas } = this;
    const box = canvas.getBoundingClientRect();
    const area = Math.max(box.width * box.height, 1);
    const ratio = Math.min(devicePixelRatio || 1, Math.sqrt(MOST_PIXELS / area));
    const [width, height] = [Math.max(1, Math.round(box.width * ratio)), Math.max(1, Math.round(box.height * ratio))];
    if (canvas.width !== width || canvas.height !== height) Object.assign(canvas, { width, height });
  }

  picture() {
    this.avatar.render();
    this.canvas.toBlob((blob) => blob && save(blob, 'avatar-synthetic.png'));
  }

  keys() {
    const still = (on) => {
      if (this.avatar.options.dynamic !== on) return;
      this.avatar.options.dynamic = !on;
      this.showTexture(on ? 'static' : 'dynamic');
      this.request(false);
    };
    const typing = (event) => /^(INPUT|SELECT|BUTTON|SUMMARY)$/.test(event.target.tagName);
    document.addEventListener('keydown', (event) => {
      if (event.ctrlKey || event.metaKey || event.altKey || typing(event)) return;
      if (event.key === ' ') {
        event.preventDefault();
        this.player.toggle();
      } else if (event.key === 'r' || event.key === 'R') this.go({});
      else if (event.key === 't' || event.key === 'T') still(true);
    });
    document.addEventListener('keyup', (event) => {
      if ((event.key === 't' || event.key === 'T') && !typing(event)) still(false);
    });
  }

  drops() {
    const sign = document.getElementById('drop');
    document.addEventListener('dragover', (event) => {
      event.preventDefault();
      sign.hidden = false;
    });
    document.addEventListener('dragleave', (event) => {
      if (!event.relatedTarget) sign.hidden = true;
    });
    document.addEventListener('drop', (event) => {
      event.preventDefault();
      sign.hidden = true;
      if (event.dataTransfer.files[0]) this.player.open(event.dataTransfer.files[0]);
    });
  }
}

start();
