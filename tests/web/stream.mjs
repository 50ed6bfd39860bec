// The page of a server that hands Live Link Face on: what came, in which order, and how late it was drawn:
// until all is handed to the graphics card; drawing in software takes half a second more.
// Usage: node stream.mjs PLAYWRIGHT CHROMIUM URL COUNT
import { open } from './browser.mjs';

const [playwright, chromium, url, count] = process.argv.slice(2);
const { browser, page, log } = await open(playwright, chromium, { width: 320, height: 320 });
let seen;
try {
  await page.goto(url);
  await page.waitForFunction(() => window.avatar, null, { timeout: 60000 });
  await page.evaluate(watch);
  await page.waitForFunction((count) => window.seen.numbers.length >= count, Number(count), { timeout: 60000 });
  await page.waitForTimeout(300);
  seen = await page.evaluate(() => ({
    ...window.seen,
    weights: Array.from(window.avatar.weights),
    head: window.avatar.head,
    note: window.page.live.note.textContent,
  }));
} finally {
  await browser.close();
}
console.log(JSON.stringify({ ...seen, log }));

/** In the page: note what it hears and draws. */
function watch() {
  const { live } = window.page;
  const [hear, advance] = [live.hear.bind(live), live.advance.bind(live)];
  window.seen = { numbers: [], delays: [] };
  live.hear = (pose) => {
    window.seen.numbers.push(pose.number);
    hear(pose);
  };
  live.advance = () => {
    const { pose } = live;
    const drawn = advance();
    return drawn && ((now) => {
      window.seen.delays.push(Date.now() - pose.at);
      drawn(now);
    });
  };
}
