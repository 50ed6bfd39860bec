// Loads web/ folders of several versions through the module; prints what came of each as JSON.
// Usage: node versions.mjs PLAYWRIGHT CHROMIUM URL FOLDER...
import { open } from './browser.mjs';

const [playwright, chromium, url, ...folders] = process.argv.slice(2);
const { browser, page } = await open(playwright, chromium, { width: 200, height: 200 });
try {
  await page.goto(url);
  const seen = [];
  for (const folder of folders) {
    seen.push(await page.evaluate(async (name) => {
      const { load } = await import('./avatar.js');
      try {
        const avatar = await load(name, { canvas: new OffscreenCanvas(96, 96) });
        avatar.set({ jawOpen: 0.5, mouthSmileLeft: 0.4 });
        const bytes = await crypto.subtle.digest('SHA-256', avatar.capture({ width: 96, height: 96 }));
        return { picture: Array.from(new Uint8Array(bytes)).join(' ') };
      } catch (error) {
        return { message: error.message };
      }
    }, folder));
  }
  console.log(JSON.stringify(seen));
} finally {
  await browser.close();
}
