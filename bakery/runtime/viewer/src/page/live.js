/** Plays what Live Link Face sends; only a page of `bakery preview --serve --livelink` has it. */

import { make } from './dom.js';

const SHOW_EVERY = 1000; // milliseconds between what is told of the stream

export class Live {
  /** @param {import('./player.js').Player} player poses its avatar; a take that plays goes before */
  constructor(player) {
    this.player = player;
    this.pose = null; // the newest, not drawn yet
    this.numbers = []; // of the poses since it was told last
    this.delays = []; // milliseconds from packet to frame, since then
    this.told = 0;
    this.note = make('p', { className: 'note', role: 'status' }, 'Waiting for Live Link Face.');
    this.element = make('div', {}, this.note);
    new EventSource('/live').onmessage = (event) => this.hear(JSON.parse(event.data));
  }

  hear(pose) {
    this.numbers.push(pose.number);
    this.pose = pose;
    this.player.changed();
  }

  /** Take the pose of the newest packet; what to call once it is drawn, or null. */
  advance() {
    const { pose, player } = this;
    if (!pose || player.playing) return null;
    this.pose = null;
    player.show(pose);
    return (now) => {
      this.delays.push(Date.now() - pose.at);
      if (now - this.told > SHOW_EVERY) this.tell(now, pose.subject);
    };
  }

  tell(now, subject) {
    const rate = (1000 * this.numbers.length) / (now - this.told);
    const median = this.delays.sort((a, b) => a - b)[this.delays.length >> 1];
    this.note.textContent = `${subject}: ${rate.toFixed(0)} a second, ${median.toFixed(0)} ms from packet to frame`;
    this.told = now;
    this.numbers.length = this.delays.length = 0;
  }
}
