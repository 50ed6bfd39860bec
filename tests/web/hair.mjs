// Levels of detail, light, layers and frame of an avatar whose hair has volume.
// Usage: node hair.mjs PLAYWRIGHT CHROMIUM URL
// Prints JSON: what was found, by name.
import { open } from './browser.mjs';

const [playwright, chromium, url] = process.argv.slice(2);
const out = {};
for (const [name, options] of [['desk', {}], ['phone', { hasTouch: true, isMobile: true }]]) {
  const { browser, page, log } = await open(playwright, chromium, { width: 400, height: 400 }, options);
  try {
    await page.goto(url);
    await page.waitForFunction(() => window.avatar, null, { timeout: 60000 });
    out[name] = await page.evaluate(look, name === 'desk');
  } finally {
    await browser.close();
    if (log.length) console.error(log.join('\n'));
  }
}
console.log(JSON.stringify(out));

/** In the page. */
function look(all) {
  const { avatar } = window;
  const gl = avatar.canvas.getContext('webgl2');
  const [EVEN, NONE] = [1 / 0.282095, 0];
  const light = (level) => Array.from({ length: 9 }, (_, k) => Array(3).fill(k ? NONE : level * EVEN));
  const drawn = (width, height) => {
    Object.assign(avatar.canvas, { width, height });
    avatar.render(); // after a change the face texture is composed too
    avatar.render();
    const pixels = new Uint8Array(4 * width * height);
    gl.readPixels(0, 0, width, height, gl.RGBA, gl.UNSIGNED_BYTE, pixels);
    return pixels;
  };
  const levels = [[800, 800], [300, 300], [60, 60]].map(([width, height]) => {
    drawn(width, height);
    return avatar.stats.hairLevel;
  });
  if (!all) return { levels };
  const differ = (one, other) => one.reduce((sum, value, k) => sum + Number(Math.abs(value - other[k]) > 8), 0);
  const [hairy, calls] = [drawn(300, 300), avatar.stats.drawCalls];
  Object.assign(avatar.options, { hair: false });
  const [bare, fewer, none] = [drawn(300, 300), avatar.stats.drawCalls, avatar.stats.hairLevel];
  const mean = (pixels) => {
    let [sum, count] = [0, 0];
    for (let k = 0; k < pixels.length; k += 4) {
      if (Math.abs(hairy[k] - bare[k]) < 20) continue;
      sum += pixels[k] + pixels[k + 1] + pixels[k + 2];
      count++;
    }
    return sum / count;
  };
  Object.assign(avatar.options, { hair: true, light: light(1) });
  const bright = mean(drawn(300, 300));
  Object.assign(avatar.options, { light: light(0.3) });
  const dark = mean(drawn(300, 300));
  Object.assign(avatar.options, { light: null, layer: 'uv' });
  drawn(300, 300);
  const inLayer = avatar.stats.hairLevel;
  Object.assign(avatar.options, { layer: 'color' });
  const again = differ(drawn(300, 300), hairy);
  const [corner, top] = [4 * 300 * 299, 299]; // rows stand from the bottom
  const rim = (pixels) => { // how many pixels of the upper edge and of both sides do not look like the corner
    let count = 0;
    for (let k = 0; k < 300; k++) {
      for (const at of [300 * top + k, 300 * k, 300 * k + 299]) count += Number(Math.abs(pixels[corner] - pixels[4 * at]) > 40);
    }
    return count;
  };
  avatar.options.stage = 'photo';
  drawn(300, 300);
  return { levels, hidden: differ(hairy, bare), calls: calls - fewer, none, bright, dark, inLayer, again, rim: rim(hairy), inPhoto: avatar.stats.hairLevel, hasHair: avatar.hasHair };
}
