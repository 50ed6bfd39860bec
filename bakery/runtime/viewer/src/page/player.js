/** Plays a take, and records what is seen. */

import { parseTake, takeAt } from '../livelink.js';
import { make, say, slider, toggle } from './dom.js';

const LARGEST = 256 * 2 ** 20;

export class Player {
  /**
   * @param {import('../avatar.js').Avatar} avatar
   * @param {() => void} changed the avatar is to be drawn and its controls shown
   */
  constructor(avatar, changed) {
    this.avatar = avatar;
    this.changed = changed;
    this.take = null;
    this.playing = false;
    this.time = 0;
    this.loop = true;
    this.gain = 1;
    this.recorder = null;
    this.bytes = 0; // of the recording
    const file = make('input', { type: 'file', accept: '.csv,text/csv', className: 'hidden', id: 'take-file',
      onchange: () => file.files[0] && this.open(file.files[0]) });
    this.name = make('p', { className: 'note' }, 'A CSV recorded with Live Link Face, or written by `bakery track`.');
    this.notes = make('p', { className: 'note', role: 'status' });
    this.button = make('button', { type: 'button', disabled: true, onclick: () => this.toggle() }, 'Play');
    this.clock = make('span', { className: 'note' }, '0:00');
    this.place = make('input', { type: 'range', min: 0, max: 1, step: 0.001, value: 0, disabled: true, 'aria-label': 'Place in the take',
      oninput: () => this.seek(Number(this.place.value) * this.length) });
    this.record = make('button', { type: 'button', onclick: () => this.toggleRecording() }, 'Record WebM');
    const gain = slider('Gain', { low: 0, high: 2, step: 0.05, unit: '' }, (value) => {
      this.gain = value;
      this.apply();
    });
    gain.show(1);
    this.element = make('div', {},
      make('div', { className: 'tools' }, make('label', { className: 'file', for: 'take-file' }, 'Open take'), file, this.button, this.record),
      this.name, this.place,
      make('div', { className: 'pair' }, this.clock, toggle('Repeat', true, (on) => (this.loop = on))),
      gain.row, this.notes);
  }

  get length() {
    return this.take ? this.take.seconds.at(-1) : 0;
  }

  /** Read a file that was dropped or chosen. */
  async open(file) {
    try {
      if (file.size > LARGEST) throw new Error(`${file.name}: more than 256 MiB; cut the take`);
      const take = parseTake(file.name, new Uint8Array(await file.arrayBuffer()), this.avatar.expressions);
      this.take = take;
      this.name.textContent = `${file.name}: ${take.seconds.length} frames, ${clock(this.length)}`;
      this.notes.textContent = take.notes.join('; ');
      this.notes.classList.remove('bad');
      this.button.disabled = this.place.disabled = false;
      this.time = 0;
      this.play(true);
      say(`Playing ${file.name}`);
    } catch (error) {
      this.notes.textContent = error.message;
      this.notes.classList.add('bad');
      say(error.message);
    }
  }

  toggle() {
    this.play(!this.playing);
  }

  play(on) {
    if (!this.take) return;
    if (on && this.time >= this.length) this.time = 0;
    this.playing = on;
    this.last = null;
    this.button.textContent = on ? 'Pause' : 'Play';
    this.changed();
  }

  seek(seconds) {
    this.time = seconds;
    this.apply();
  }

  /** Go on to the time `now`, milliseconds. */
  advance(now) {
    if (!this.playing) return;
    if (this.last !== null) this.time += (now - this.last) / 1000;
    this.last = now;
    if (this.time > this.length) {
      if (this.loop) this.time %= this.length || 1;
      else {
        this.time = this.length;
        this.play(false);
      }
    }
    this.apply();
  }

  apply() {
    if (!this.take) return;
    this.show(takeAt(this.take, this.time));
    this.place.value = String(this.length ? this.time / this.length : 0);
    this.clock.textContent = `${clock(this.time)} of ${clock(this.length)}`;
    this.changed();
  }

  /** Pose the avatar: 52 weights, head and eyes in degrees. */
  show({ weights, head, eyes }) {
    const table = {};
    this.avatar.expressions.forEach((name, k) => (table[name] = weights[k] * this.gain));
    this.avatar.set(table);
    if (eyes && (eyes[0] || eyes[1])) this.avatar.direction = eyes;
    this.avatar.turn(head[0], head[1], head[2]);
  }

  toggleRecording() {
    if (this.recorder) {
      this.recorder.stop();
      return;
    }
    const kind = ['video/webm;codecs=vp9', 'video/webm;codecs=vp8', 'video/webm'].find((one) => globalThis.MediaRecorder?.isTypeSupported(one));
    if (!kind) {
      say('This browser cannot record WebM');
      this.notes.textContent = 'This browser cannot record WebM.';
      return;
    }
    const pieces = [];
    this.bytes = 0;
    const stream = this.avatar.canvas.captureStream(30);
    this.recorder = new MediaRecorder(stream, { mimeType: kind, videoBitsPerSecond: 8e6 });
    this.recorder.ondataavailable = (event) => {
      pieces.push(event.data);
      this.bytes += event.data.size;
      if (this.recorder) this.record.textContent = `Stop recording (${Math.ceil(this.bytes / 1024)} kB)`;
    };
    this.recorder.onstop = () => {
      stream.getTracks().forEach((track) => track.stop());
      this.recorder = null;
      this.record.textContent = 'Record WebM';
      this.record.classList.remove('recording');
      save(new Blob(pieces, { type: 'video/webm' }), 'avatar-synthetic.webm');
      say('Recording saved');
    };
    this.recorder.start(500);
    this.record.textContent = 'Stop recording';
    this.record.classList.add('recording');
    say('Recording');
    this.changed();
  }
}

/** Offer bytes as a download. */
export function save(blob, name) {
  const url = URL.createObjectURL(blob);
  const link = make('a', { href: url, download: name });
  link.click();
  setTimeout(() => URL.revokeObjectURL(url), 10000);
}

const clock = (seconds) => `${Math.floor(seconds / 60)}:${String(Math.floor(seconds % 60)).padStart(2, '0')}`;
