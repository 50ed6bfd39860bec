// What the player knows of the pieces of a head. Usage: node pieces.mjs GLB.js SHADERS.js
import { pathToFileURL } from 'node:url';

const [glb, shaders] = await Promise.all(process.argv.slice(2).map((path) => import(pathToFileURL(path))));
const { PIECES, IMAGE, CARDS } = glb;
const above = Number(/part > (\d+)u/.exec(shaders.HEAD_FRAGMENT)[1]);
console.log(JSON.stringify({ pieces: PIECES, image: IMAGE, cards: CARDS, shaded: PIECES.slice(above + 1) }));
