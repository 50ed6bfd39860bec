// Loads avatars by several addresses, and tells what was asked for in vain and where eyes look.
// Usage: node load.mjs PLAYWRIGHT CHROMIUM URL ADDRESSES.json
import { readFileSync } from 'node:fs';
import { open } from './browser.mjs';

const [playwright, chromium, url, addresses] = process.argv.slice(2);
const { browser, page } = await open(playwright, chromium, { width: 400, height: 400 });
const missed = [];
page.on('response', (response) => response.ok() || missed.push(new URL(response.url()).pathname));
const seen = {};
try {
  await page.goto(url);
  await page.waitForFunction(() => window.avatar, null, { timeout: 60000 });
  seen.gaze = await page.evaluate(() => [[90, 0], [-90, -90], [20, 10]].map(([yaw, pitch]) => window.avatar.look(yaw, pitch).gaze));
  seen.loaded = {};
  for (const address of JSON.parse(readFileSync(addresses, 'utf8'))) {
    missed.length = 0;
    const loaded = await page.evaluate(load, address);
    seen.loaded[address] = { loaded, missed: [...missed] };
  }
} finally {
  await browser.close();
}
console.log(JSON.stringify(seen));

/** In the page: how many expressions the avatar has, or why it was not loaded. */
async function load(address) {
  const module = await import('/avatar.js');
  try {
    const avatar = await module.load(address, { canvas: new OffscreenCanvas(8, 8) });
    avatar.dispose();
    return avatar.expressions.length;
  } catch (error) {
    return `${error instanceof module.AvatarError} ${error.message}`;
  }
}
