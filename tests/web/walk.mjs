// Walks through a page of `bakery preview` as a person does, and prints what it saw as JSON.
// Usage: node walk.mjs PLAYWRIGHT CHROMIUM PAGE.html TAKE.csv OUT AXE.js
import { existsSync, readFileSync } from 'node:fs';
import { join } from 'node:path';
import { pathToFileURL } from 'node:url';
import { open } from './browser.mjs';

const [playwright, chromium, file, take, out, axe] = process.argv.slice(2);
const options = { colorScheme: 'dark', reducedMotion: 'reduce', acceptDownloads: true };
// Software draws each pixel slowly: where nobody looks at the picture the window is low.
const [HIGH, LOW] = [{ width: 960, height: 600 }, { width: 960, height: 300 }];
const { browser, page, log } = await open(playwright, chromium, HIGH, options);
const seen = { log, requests: [], dialogs: 0 };
page.setDefaultTimeout(120000); // software drawing, on a machine that may be busy
async function walk() {
  const address = pathToFileURL(file).href;
  page.on('request', (request) => {
    if (request.url() !== address && !/^(blob|data):/.test(request.url())) seen.requests.push(request.url());
  });
  page.on('dialog', (dialog) => {
    seen.dialogs++;
    dialog.dismiss();
  });
  await page.goto(address);
  await page.waitForFunction(() => window.page?.ready, null, { timeout: 60000 });
  seen.ready = await page.evaluate(() => window.page.ready);
  seen.title = await page.title();
  seen.heading = await page.locator('h1').textContent();
  seen.images = await page.locator('img').count();
  await page.screenshot({ path: join(out, 'page.png') });

  await page.setViewportSize(LOW);
  await sliders();
  await page.setViewportSize(HIGH);
  await expressions();
  await keys();
  await stages();
  await page.setViewportSize(LOW);
  await layers();
  await playing();
  await costs();
  await page.setViewportSize(HIGH);
  seen.nameless = await nameless();
  seen.axe = { desktop: await violations() };
  await phone();
  seen.axe.phone = await violations();
}

/** What axe-core objects to; null without it. */
async function violations() {
  if (!existsSync(axe)) return null;
  await page.evaluate(readFileSync(axe, 'utf8'));
  return page.evaluate(async () => {
    const { violations } = await window.axe.run(document, { resultTypes: ['violations'] });
    return violations.map((one) => `${one.id}: ${one.nodes.map((node) => node.html).join(' ')}`);
  });
}

const settled = () => page.evaluate(() => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done))));
const weight = (name) => page.evaluate((n) => window.avatar.get(n), name);
const round = (value) => Math.round(value * 100) / 100;

async function sliders() {
  const all = page.locator('input[data-name]');
  seen.sliders = await all.count();
  const search = page.getByRole('searchbox');
  await search.fill('jaw open');
  const jaw = page.locator('input[data-name=jawOpen]');
  await jaw.fill('0.6');
  const shown = await page.locator('.row', { has: jaw }).locator('.value').textContent();
  seen.slid = { jawOpen: round(await weight('jawOpen')), shown };
  await jaw.focus();
  const before = await weight('jawOpen');
  await page.keyboard.press('ArrowRight');
  seen.keyboard = [before, await weight('jawOpen')];
  await search.fill('mouth smile');
  seen.searched = await all.evaluateAll((inputs) => inputs.filter((one) => one.checkVisibility()).map((one) => one.dataset.name));
  await page.getByRole('button', { name: 'Both sides' }).click();
  await page.locator('input[data-name=mouthSmileLeft]').fill('0.5');
  seen.both = [round(await weight('mouthSmileLeft')), round(await weight('mouthSmileRight'))];
  await search.fill('');
}

async function expressions() {
  const chips = page.getByRole('region', { name: 'Expressions' }).getByRole('button');
  const names = await chips.evaluateAll((buttons) => buttons.map((one) => one.getAttribute('aria-label')));
  seen.keys = names.filter((name) => name.startsWith('Key ')).length;
  seen.named = names.length - seen.keys;
  await page.getByRole('button', { name: 'Surprise', exact: true }).click();
  await settled();
  seen.surprised = await weight('browInnerUp');
  await page.getByRole('button', { name: 'Neutral', exact: true }).click();
  await settled();
  // An eye is dragged towards the right of the screen, the subject's left.
  const [x, y] = await page.evaluate(() => window.avatar.eyes()[0]);
  await page.mouse.move(x, y);
  await page.mouse.down();
  await page.mouse.move(x + 8, y, { steps: 3 });
  await page.mouse.up();
  seen.gaze = await page.evaluate(() => window.avatar.gaze);
  seen.wrong = await page.evaluate(() => [
    () => window.avatar.set({ jawOpen: NaN }),
    () => window.avatar.set({ nothing: 1 }),
    () => window.avatar.look(Infinity, 0),
    () => window.avatar.turn(0, NaN),
  ].map((call) => {
    try {
      call();
      return '';
    } catch (error) {
      return error.message;
    }
  }));
}

/** Keys on the picture, in the photo: they move the gaze, and the photo once it is enlarged. */
async function keys() {
  const view = page.locator('#view');
  await view.focus();
  const state = () => page.evaluate(() => ({ gaze: window.avatar.gaze, shift: [...window.avatar.orbit.shift], turned: window.avatar.orbit.yaw }));
  const press = async (...keys) => {
    for (const key of keys) await page.keyboard.press(key);
    return state();
  };
  seen.keyed = {
    role: await view.getAttribute('role'), label: await view.getAttribute('aria-label'), focused: await page.evaluate(() => document.activeElement.id),
    start: await state(), gazed: await press('ArrowRight', 'ArrowUp'), moved: await press('+', 'ArrowRight'),
    back: await press('0', 'ArrowLeft', 'ArrowDown'),
  };
}

async function stages() {
  const stage = () => page.evaluate(() => window.avatar.options.stage);
  seen.stage = [await stage()];
  await page.getByRole('radio', { name: 'Studio' }).click();
  seen.stage.push(await stage());
  await page.getByRole('button', { name: 'Laugh' }).click();
  await settled();
  await page.mouse.move(60, 520);
  await page.mouse.down();
  await page.mouse.move(140, 510, { steps: 4 });
  await page.mouse.up();
  await page.mouse.move(10, 590);
  seen.turned = await page.evaluate(() => window.avatar.orbit.yaw);
  await settled();
  await page.screenshot({ path: join(out, 'studio.png') });
  await page.locator('#view').focus();
  await page.keyboard.down('t');
  seen.static = await page.evaluate(() => window.avatar.options.dynamic);
  await page.keyboard.up('t');
}

async function layers() {
  await page.getByText('Display', { exact: true }).click();
  const picture = () => page.evaluate(() => {
    const bytes = window.avatar.capture({ width: 96, height: 96 });
    return bytes.reduce((hash, byte) => (Math.imul(hash, 31) + byte) | 0, 7);
  });
  seen.layers = {};
  const choice = page.getByLabel('Layer', { exact: true });
  for (const value of ['mask', 'coverage', 'uv', 'color']) {
    await choice.selectOption(value);
    seen.layers[value] = await picture();
  }
  await page.getByRole('radio', { name: 'Teeth' }).click();
  seen.layers.teeth = await picture();
  await page.getByRole('radio', { name: 'Image' }).click();
  // `capture` leaves lights out, so they are looked at in the canvas.
  const canvas = () => page.evaluate(() => {
    window.avatar.render();
    return window.avatar.canvas.toDataURL().length;
  });
  const dark = await canvas();
  const light = page.getByLabel('Light', { exact: true });
  for (const name of ['neutral', 'studio', 'rim', 'sunset']) {
    await light.selectOption(name);
    seen.layers[name] = (await canvas()) - dark || 'same';
  }
  await light.selectOption('photo');
  seen.unlit = (await canvas()) === dark;
  seen.sides = await page.evaluate(sides);
  seen.noLight = await page.evaluate(() => {
    window.avatar.options.light = [[1, 2]];
    try {
      window.avatar.render();
      return '';
    } catch (error) {
      return error.message;
    } finally {
      window.avatar.options.light = null;
    }
  });
  seen.restored = await page.evaluate(restored);
}

/** In the page: how bright the halves of the picture are in a light from the subject's left, and neutral. */
function sides() {
  const { avatar } = window;
  const { width, height } = avatar.canvas;
  const still = new OffscreenCanvas(width, height).getContext('2d', { willReadFrequently: true });
  const even = Array.from({ length: 9 }, (_, k) => Array(3).fill(k ? 0 : 1 / 0.282095));
  const left = even.map((row, k) => (k === 3 ? Array(3).fill(0.9 / 0.488603) : row));
  const both = [left, even].map((light) => {
    avatar.options.light = light;
    avatar.render();
    still.drawImage(avatar.canvas, 0, 0);
    const sums = [0, 0];
    const { data } = still.getImageData(0, 0, width, height);
    // The middle third, which is all head; green alone.
    for (let y = height >> 2; y < height >> 1; y += 3) {
      for (let x = Math.round(width * 0.42); x < width * 0.58; x++) sums[Number(2 * x >= width)] += data[4 * (y * width + x) + 1];
    }
    return sums[1] / sums[0];
  });
  avatar.options.light = null;
  avatar.render();
  return both;
}

/** In the page: whether the picture is the same after the graphics card lost everything. */
async function restored() {
  const { avatar } = window;
  const hash = () => avatar.capture({ width: 96, height: 96 }).reduce((sum, byte) => (Math.imul(sum, 31) + byte) | 0, 7);
  const before = hash();
  const card = avatar.canvas.getContext('webgl2').getExtension('WEBGL_lose_context');
  card.loseContext();
  await new Promise((done) => setTimeout(done, 200));
  avatar.render();
  const back = new Promise((done) => avatar.canvas.addEventListener('avatarrestored', done, { once: true }));
  card.restoreContext();
  await back;
  return hash() === before;
}

async function playing() {
  const drop = async (name, text) => page.evaluate(([name, text]) => {
    const carried = new DataTransfer();
    carried.items.add(new File([text], name, { type: 'text/csv' }));
    document.dispatchEvent(new DragEvent('drop', { dataTransfer: carried, bubbles: true, cancelable: true }));
  }, [name, text]);
  const text = readFileSync(take, 'utf8');
  const notes = page.getByRole('region', { name: 'Take' }).getByRole('status');
  await drop('bad.csv', text.replace(/(\n[^\n]*\n)([^,]*,[^,]*),[^,]*/, '$1$2,NaN'));
  await page.waitForFunction(() => document.querySelector('.note.bad'), null, { timeout: 5000 });
  seen.refused = await notes.textContent();
  await drop('take.csv', text);
  await page.waitForFunction(() => window.page.player.time > 0.2, null, { timeout: 20000 });
  // Both at one moment: a busy machine plays on between two calls.
  const playing = await page.evaluate(() => [window.page.player.time, window.avatar.get('jawOpen')]);
  const clicked = page.waitForEvent('download');
  await page.getByRole('button', { name: 'Record WebM' }).click();
  await page.waitForFunction(() => window.page.player.bytes > 1000, null, { timeout: 30000 });
  await page.getByRole('button', { name: /^Stop recording/ }).click();
  const download = await clicked;
  await download.saveAs(join(out, 'recording.webm'));
  seen.recorded = readFileSync(join(out, 'recording.webm')).length;
  await page.getByRole('button', { name: 'Pause' }).click();
  await page.evaluate(() => window.page.player.seek(1.5));
  const yaw = await page.evaluate(() => window.avatar.head[0]);
  seen.played = { playing, sought: await weight('jawOpen'), yaw, notes: await notes.textContent() };
}

async function costs() {
  seen.cost = await page.evaluate(() => {
    const { avatar } = window;
    const [find, script] = [[], []];
    Object.assign(avatar.canvas, { width: 64, height: 64 }); // what the card does is not counted
    for (let frame = 0; frame < 15; frame++) {
      avatar.set(Object.fromEntries(avatar.expressions.map((name, k) => [name, Math.abs(Math.sin(0.37 * frame + k))])));
      const start = performance.now();
      avatar.mouths.find(avatar.weights);
      find.push(performance.now() - start);
      avatar.mouths.weight.fill(-1);
      avatar.render();
      script.push(avatar.stats.milliseconds);
    }
    const stats = { ...avatar.stats };
    avatar.render();
    const median = (values) => values.sort((a, b) => a - b)[values.length >> 1];
    return { find: median(find), script: median(script), stats, idle: { ...avatar.stats } };
  });
}

async function nameless() {
  await page.evaluate(() => document.querySelectorAll('details').forEach((one) => (one.open = true)));
  return page.evaluate(() => [...document.querySelectorAll('button, input, select, canvas, [role=radiogroup]')]
    .filter((one) => one.checkVisibility() && !one.classList.contains('hidden'))
    .filter((one) => !(one.getAttribute('aria-label') || one.textContent.trim() || one.labels?.length))
    .map((one) => one.outerHTML.slice(0, 120)));
}

async function phone() {
  await page.evaluate(() => document.querySelectorAll('details').forEach((one) => (one.open = false)));
  await page.evaluate(() => window.avatar.reset() && window.page.request());
  await page.setViewportSize({ width: 390, height: 780 });
  await page.waitForTimeout(400);
  await settled();
  await page.evaluate(() => (document.getElementById('panel').scrollTop = 0));
  await page.screenshot({ path: join(out, 'phone.png') });
  seen.phone = await page.evaluate(() => ({
    width: innerWidth,
    scroll: document.documentElement.scrollWidth,
    canvas: document.getElementById('view').clientHeight,
    panel: document.getElementById('panel').clientHeight,
    summary: Math.min(...[...document.querySelectorAll('summary')].filter((one) => one.checkVisibility()).map((one) => one.getBoundingClientRect().height)),
    smallest: Math.min(...[...document.querySelectorAll('button')].filter((one) => one.checkVisibility()).map((one) => one.clientHeight + 2)),
  }));
}

try {
  await walk();
} finally {
  await browser.close();
}
console.log(JSON.stringify(seen));
