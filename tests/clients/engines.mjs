// head.glb in engines that others wrote, as docs/guides/web.md says: a picture of each.
// Usage: node engines.mjs PLAYWRIGHT CHROMIUM MODULES FOLDER; FOLDER has head.glb and pose.json
import { createServer } from 'node:http';
import { readFile } from 'node:fs/promises';
import { dirname, extname, join, normalize } from 'node:path';
import { fileURLToPath } from 'node:url';
import { open } from '../web/browser.mjs';

const [playwright, chromium, modules, folder] = process.argv.slice(2);
const pages = join(dirname(fileURLToPath(import.meta.url)), 'pages');
const KINDS = { '.html': 'text/html', '.js': 'text/javascript', '.mjs': 'text/javascript', '.json': 'application/json' };

const server = createServer(async ({ url }, answer) => {
  const path = normalize(decodeURIComponent(url.split('?')[0]));
  const place = path.startsWith('/modules/') ? join(modules, path.slice(9)) : join(path.endsWith('.html') ? pages : folder, path);
  try {
    const data = await readFile(place);
    answer.writeHead(200, { 'Content-Type': KINDS[extname(place)] ?? 'application/octet-stream' }).end(data);
  } catch {
    answer.writeHead(404).end();
  }
}).listen(0, '127.0.0.1');
const seen = {};
for (const name of ['three', 'three?rest', 'babylon', 'playcanvas', 'model-viewer']) {
  const { browser, page, log } = await open(playwright, chromium, { width: 300, height: 300 });
  try {
    await page.goto(`http://127.0.0.1:${server.address().port}/${name.replace(/(\?|$)/, '.html$1')}`);
    await page.waitForFunction(() => document.title === 'done', null, { timeout: 90000 });
    await page.locator('#view').screenshot({ path: join(folder, `${name.replace('?', '-')}.png`) });
  } catch (error) {
    log.push(String(error));
  } finally {
    await browser.close();
  }
  seen[name] = log.filter((line) => !/404|rAF timed out/.test(line)); // of the icon; of a slow machine
}
server.close();
console.log(JSON.stringify(seen));
