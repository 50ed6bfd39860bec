// Builds what users get: the page's script, the module for embedding, and the page's style.
// Usage: node build.mjs FOLDER
import { build } from 'esbuild';
import { copyFile, mkdir } from 'node:fs/promises';
import { dirname, join } from 'node:path';
import { fileURLToPath } from 'node:url';

const here = dirname(fileURLToPath(import.meta.url));
const out = process.argv[2];
if (!out) {
  console.error('usage: node build.mjs FOLDER');
  process.exit(2);
}
await mkdir(out, { recursive: true });
const shared = {
  bundle: true,
  minify: true,
  charset: 'ascii', // so that no encoding of the page can change the script, whose hash is checked
  legalComments: 'inline',
  target: 'es2022',
  absWorkingDir: here, // the same bytes wherever the checkout lies
};
await build({ ...shared, entryPoints: ['src/avatar.js'], outfile: join(out, 'avatar.js'), format: 'esm' });
await build({ ...shared, entryPoints: ['src/page/page.js'], outfile: join(out, 'page.js'), format: 'iife' });
await build({ ...shared, entryPoints: ['src/page/page.css'], outfile: join(out, 'page.css') });
for (const [from, to] of [['avatar.d.ts', 'avatar.d.ts'], ['src/page/page.html', 'page.html'], ['src/index.html', 'index.html']]) {
  await copyFile(join(here, from), join(out, to));
}
