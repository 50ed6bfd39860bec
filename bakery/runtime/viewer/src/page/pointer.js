/** Pointer and keys on the picture: turn, zoom, and gaze by dragging an eye. */

import { MOST_GAZE } from '../avatar.js';

const TURN = 0.35; // degrees a pixel
const MOST_TURN = [100, 50];
const ZOOM = [0.5, 5];
const clamp = (value, low, high) => Math.min(Math.max(value, low), high);

/**
 * @param {HTMLCanvasElement} canvas
 * @param {import('../avatar.js').Avatar} avatar
 * @param {{changed: () => void, gazed: () => void}} told
 */
export function follow(canvas, avatar, { changed, gazed }) {
  const down = new Map();
  let eye = null; // the eye that is dragged
  let pinch = 0;
  const { orbit } = avatar;

  /** @returns {[number, number]} */
  const place = (event) => {
    const box = canvas.getBoundingClientRect();
    const ratio = canvas.width / box.width;
    return [(event.clientX - box.left) * ratio, (event.clientY - box.top) * ratio];
  };
  const eyeAt = ([x, y]) =>
    avatar.eyes().findIndex(([column, row, radius]) => Math.hypot(x - column, y - row) < radius * 1.15);
  const gazeAt = ([x, y]) => {
    const [column, row, radius] = avatar.eyes()[eye];
    const yaw = ((x - column) / radius) * 32;
    const pitch = ((row - y) / radius) * 28;
    avatar.look(clamp(yaw, -MOST_GAZE[0], MOST_GAZE[0]), clamp(pitch, -MOST_GAZE[1], MOST_GAZE[1]));
    gazed();
  };
  const turn = (dx, dy) => {
    if (avatar.inPhoto) {
      if (orbit.zoom > 1) orbit.shift = orbit.shift.map((value, k) => clamp(value + [dx, dy][k] / canvas.clientHeight, -1, 1));
    } else {
      orbit.yaw = clamp(orbit.yaw + dx * TURN, -MOST_TURN[0], MOST_TURN[0]);
      orbit.pitch = clamp(orbit.pitch - dy * TURN, -MOST_TURN[1], MOST_TURN[1]);
    }
    changed();
  };
  const zoom = (factor) => {
    orbit.zoom = clamp(orbit.zoom * factor, avatar.inPhoto ? 1 : ZOOM[0], ZOOM[1]);
    if (orbit.zoom === 1) orbit.shift = [0, 0];
    changed();
  };

  canvas.addEventListener('pointerdown', (event) => {
    canvas.setPointerCapture(event.pointerId);
    down.set(event.pointerId, [event.clientX, event.clientY]);
    const found = eyeAt(place(event));
    eye = found >= 0 && down.size === 1 ? found : null;
    if (eye !== null) gazeAt(place(event));
    else canvas.classList.add('turning');
    pinch = 0;
  });
  canvas.addEventListener('pointermove', (event) => {
    const before = down.get(event.pointerId);
    if (!before) {
      canvas.classList.toggle('eye', eyeAt(place(event)) >= 0);
      return;
    }
    down.set(event.pointerId, [event.clientX, event.clientY]);
    if (down.size === 2) {
      const [a, b] = [...down.values()];
      const apart = Math.hypot(a[0] - b[0], a[1] - b[1]);
      if (pinch) zoom(apart / pinch);
      pinch = apart;
    } else if (eye !== null) gazeAt(place(event));
    else turn(event.clientX - before[0], event.clientY - before[1]);
  });
  const release = (event) => {
    down.delete(event.pointerId);
    eye = null;
    pinch = 0;
    canvas.classList.remove('turning');
  };
  canvas.addEventListener('pointerup', release);
  canvas.addEventListener('pointercancel', release);
  canvas.addEventListener('wheel', (event) => {
    event.preventDefault();
    zoom(Math.exp(-clamp(event.deltaY, -120, 120) * 0.0016));
  }, { passive: false });
  canvas.addEventListener('dblclick', () => straighten(avatar, changed));
  canvas.addEventListener('keydown', (event) => {
    const step = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] }[event.key];
    // The whole photo can be neither turned nor moved.
    if (step && (event.shiftKey || (avatar.inPhoto && orbit.zoom === 1))) {
      const [yaw, pitch] = avatar.gaze;
      avatar.look(clamp(yaw + 4 * step[0], -MOST_GAZE[0], MOST_GAZE[0]), clamp(pitch - 4 * step[1], -MOST_GAZE[1], MOST_GAZE[1]));
      gazed();
    } else if (step) turn(14 * step[0], 14 * step[1]);
    else if (event.key === '+' || event.key === '=') zoom(1.1);
    else if (event.key === '-') zoom(1 / 1.1);
    else if (event.key === '0') straighten(avatar, changed);
    else return;
    event.preventDefault();
  });
}

/** Back to the view of the start. */
export function straighten(avatar, changed) {
  Object.assign(avatar.orbit, { yaw: 0, pitch: 0, zoom: 1, shift: [0, 0] });
  changed();
}
