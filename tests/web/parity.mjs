// Draws states of an avatar in headless Chromium through the module for embedding.
// Usage: node parity.mjs PLAYWRIGHT CHROMIUM URL STATES.json OUT
// OUT gets one file a state: the frame, or the mouth sheet, as raw RGBA from the top.
import { readFileSync, writeFileSync } from 'node:fs';
import { join } from 'node:path';
import { open } from './browser.mjs';

const [playwright, chromium, url, states, out] = process.argv.slice(2);
const { browser, page, log } = await open(playwright, chromium, { width: 400, height: 400 });
try {
  await page.goto(url);
  await page.waitForFunction(() => window.avatar, null, { timeout: 60000 });
  for (const [number, state] of JSON.parse(readFileSync(states, 'utf8')).entries()) {
    const text = await page.evaluate(draw, state);
    writeFileSync(join(out, `${String(number).padStart(3, '0')}.raw`), Buffer.from(text, 'base64'));
  }
} finally {
  await browser.close();
  if (log.length) console.error(log.join('\n'));
}

/** In the page: set the state, draw it, and return the bytes as base64. */
function draw({ kind, weights, gaze, size, hair, dynamic, camera }) {
  const { avatar } = window;
  // SwiftShader moves vertices to sixteenths of a pixel, other cards to 256ths: a picture seven times
  // as fine is drawn, and the samples at the middles of the wanted pixels are kept.
  const [FINE, HALF] = [7, 3];
  const centres = (fine) => {
    const words = new Uint32Array(fine.buffer);
    const kept = new Uint32Array(size * size);
    for (let k = 0; k < kept.length; k++) {
      const [row, column] = [Math.floor(k / size), k % size];
      kept[k] = words[FINE * size * (FINE * row + HALF) + FINE * column + HALF];
    }
    return new Uint8Array(kept.buffer);
  };
  avatar.reset();
  Object.assign(avatar.options, { hair, dynamic });
  avatar.set(weights);
  avatar.direction = gaze;
  const fine = FINE * size;
  const view = camera ? { ...camera, focal: FINE * camera.focal, center: camera.center.map((x) => FINE * x), width: fine, height: fine }
    : avatar.frontView(fine);
  const bytes = kind === 'mouth' ? avatar.mouthSheet().data : centres(avatar.capture({ width: fine, height: fine, view }));
  let text = '';
  for (let at = 0; at < bytes.length; at += 32768) {
    text += String.fromCharCode(...bytes.subarray(at, at + 32768));
  }
  return btoa(text);
}
