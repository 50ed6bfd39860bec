// What frames cost in headless Chromium, with hair that has volume and without: processor time of the browser,
// which other work on the machine changes little. Medians, because it changes some frames: beside another test
// one mean of twelve frames was 2.0 times that without hair, and 1.43 alone.
// Usage: node speed.mjs PLAYWRIGHT CHROMIUM URL FRAMES
// Prints JSON: median seconds a frame, by level of detail, `none` without hair.
import { readFileSync, readdirSync } from 'node:fs';
import { open } from './browser.mjs';

const [playwright, chromium, url, frames] = process.argv.slice(2);
const SIZE = { width: 1280, height: 800 };
const TICKS = 100; // a second, of /proc
const { browser, page, log } = await open(playwright, chromium, SIZE);
try {
  await page.goto(url);
  await page.waitForFunction(() => window.avatar, null, { timeout: 60000 });
  const modes = [['none', false, 0], ['0', true, 0], ['1', true, 1], ['2', true, 2]];
  const spent = Object.fromEntries(modes.map(([name]) => [name, []]));
  for (let round = 0; round <= frames; round++) { // the first one warms up
    for (const [name, hair, level] of modes) {
      await page.evaluate(draw, { ...SIZE, hair, level, round: -1 });
      const before = seconds();
      await page.evaluate(draw, { ...SIZE, hair, level, round });
      if (round) spent[name].push(seconds() - before);
    }
  }
  console.log(JSON.stringify(Object.fromEntries(modes.map(([name]) => [name, median(spent[name])]))));
} finally {
  await browser.close();
  if (log.length) console.error(log.join('\n'));
}

function median(values) {
  const sorted = values.toSorted((a, b) => a - b);
  const middle = sorted.length / 2;
  return (sorted[Math.ceil(middle) - 1] + sorted[Math.floor(middle)]) / 2;
}

/** In the page: a frame from another side, waited for. */
function draw({ width, height, hair, level, round }) {
  const { avatar } = window;
  Object.assign(avatar.canvas, { width, height });
  Object.assign(avatar.options, { hair, hairLevel: level });
  avatar.orbit.yaw = ((37 * round + 120) % 120) - 60;
  avatar.render();
  const gl = avatar.canvas.getContext('webgl2');
  gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, new Uint8Array(4));
}

/** Of the processes that this one started. */
function seconds() {
  const about = readdirSync('/proc').filter((name) => /^\d+$/.test(name)).flatMap((name) => {
    try {
      const words = readFileSync(`/proc/${name}/stat`, 'utf8').replace(/.*\) /s, '').split(' ');
      return [{ name: Number(name), parent: Number(words[1]), ticks: Number(words[11]) + Number(words[12]) }];
    } catch {
      return []; // it ended
    }
  });
  const own = new Set([process.pid]);
  for (let before = 0; before !== own.size;) {
    before = own.size;
    about.filter((one) => own.has(one.parent)).forEach((one) => own.add(one.name));
  }
  own.delete(process.pid);
  return about.filter((one) => own.has(one.name)).reduce((sum, one) => sum + one.ticks, 0) / TICKS;
}
