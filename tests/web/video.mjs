// Plays videos, and decodes their sound. Usage: node video.mjs PLAYWRIGHT CHROMIUM URL NAME...
import { open } from './browser.mjs';

const [playwright, chromium, url, ...names] = process.argv.slice(2);
const { browser, page } = await open(playwright, chromium, { width: 400, height: 400 });
const seen = {};
try {
  await page.goto(url);
  for (const name of names) seen[name] = await page.evaluate(play, name);
} finally {
  await browser.close();
}
console.log(JSON.stringify(seen));

/** In the page: size and length of a video that was played to its end, and when its sound is loud. */
async function play(name) {
  const video = Object.assign(document.createElement('video'), { muted: true, src: name });
  const ended = new Promise((resolve) => {
    video.onended = () => resolve(true);
    video.onerror = () => resolve(video.error.message);
  });
  await video.play().catch(() => {});
  const done = await ended;
  const data = await (await fetch(name)).arrayBuffer();
  const sound = await new OfflineAudioContext(1, 48000, 48000).decodeAudioData(data).catch(() => null);
  const loud = sound && sound.getChannelData(0).findIndex((sample) => Math.abs(sample) > 0.1) / sound.sampleRate;
  return { done, width: video.videoWidth, height: video.videoHeight, seconds: video.duration, loud };
}
