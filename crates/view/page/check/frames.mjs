// Measures how fast the page draws, in software WebGL:
//
//   VOXTILE=PROGRAM node crates/view/page/check/frames.mjs MAP [FRAMES]
//
// Draws whole frames of the first view, of a near view and of a view from above, each finished by a read of a pixel,
// and prints the median time of a frame. PAGE is the URL of a page that is served already, instead of VOXTILE.

import { spawn } from 'node:child_process';
import { createInterface } from 'node:readline';
import { Browser } from './browser.mjs';

const [map, frames = '40'] = process.argv.slice(2);
const server = process.env.PAGE ? null : spawn(process.env.VOXTILE, ['view', map, '--json'], { stdio: ['ignore', 'pipe', 'inherit'] });
const address = async () => {
  if (!server) return process.env.PAGE;
  for await (const line of createInterface({ input: server.stdout })) return JSON.parse(line).url;
};

const VIEWS = {
  first: '',
  near: `(() => { const { eye, to } = voxtile.camera(); voxtile.lookAt(eye.map((k, axis) => to[axis] + 0.2 * (k - to[axis])), to); })()`,
  top: 'document.getElementById("top").click()',
};
const MEASURE = `(() => {
  const gl = document.getElementById('scene').getContext('webgl2');
  const pixel = new Uint8Array(4);
  const times = Array.from({ length: ${frames} }, () => {
    const since = performance.now();
    voxtile.draw();
    gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, pixel);
    return performance.now() - since;
  }).sort((a, b) => a - b);
  return { ms: +times[times.length >> 1].toFixed(1), faces: voxtile.faces(), calls: voxtile.drawCalls() };
})()`;

const browser = new Browser(undefined, [1280, 720]);
try {
  await browser.open('about:blank');
  await browser.size(1280, 720);
  await browser.open(await address());
  for (const [view, script] of Object.entries(VIEWS)) {
    await browser.ready(180);
    if (script) {
      await browser.value(script);
      await new Promise((resolve) => setTimeout(resolve, 500));
      await browser.ready(180);
    }
    console.log(JSON.stringify({ map, view, ...(await browser.value(MEASURE)) }));
  }
} finally {
  await browser.close();
  server?.kill();
}
