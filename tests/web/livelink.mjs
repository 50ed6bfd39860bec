// Reads takes with the page's reader. Usage: node livelink.mjs TAKES.json NAMES.json
import { readFileSync } from 'node:fs';
import { join } from 'node:path';
import { pathToFileURL } from 'node:url';

const { parseTake, takeAt } = await import(pathToFileURL(join(process.cwd(), 'src/livelink.js')).href);
const [takes, names] = process.argv.slice(2).map((path) => JSON.parse(readFileSync(path, 'utf8')));
const seen = {};
for (const [name, text] of Object.entries(takes)) {
  try {
    const take = parseTake('take.csv', new TextEncoder().encode(text), names);
    const last = take.seconds.at(-1);
    const times = Array.from({ length: 7 }, (_, k) => -0.1 + (k * (last + 0.2)) / 6);
    seen[name] = {
      seconds: [...take.seconds], weights: take.weights.map((row) => [...row]), head: take.head,
      eyes: take.eyes, notes: take.notes, between: times.map((time) => [...takeAt(take, time).weights]),
      turned: times.map((time) => takeAt(take, time).head),
    };
  } catch (error) {
    seen[name] = { error: error.message };
  }
}
console.log(JSON.stringify(seen));
