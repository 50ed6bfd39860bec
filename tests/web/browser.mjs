// A headless Chromium that draws in software, and a log of everything that should not happen.
import { pathToFileURL } from 'node:url';

const ARGUMENTS = ['--no-sandbox', '--use-angle=swiftshader', '--enable-unsafe-swiftshader'];

export async function open(playwright, chromium, viewport, options = {}) {
  const { chromium: engine } = await import(pathToFileURL(playwright).href);
  const browser = await engine.launch({ executablePath: chromium, args: ARGUMENTS });
  const page = await browser.newPage({ viewport, ...options });
  const log = [];
  page.on('console', (message) => {
    if (['error', 'warning'].includes(message.type())) log.push(`${message.type()}: ${message.text()}`);
  });
  page.on('pageerror', (error) => log.push(`uncaught: ${error.message}`));
  return { browser, page, log };
}
