// Measures the memory of the page over a long flight, and the time until a view is sharp after a jump:
//
//   VOXTILE=PROGRAM node crates/view/page/check/flight.mjs MAP [JUMPS] [SHARP]
//
// Jumps to places along the trajectory, or over the map without one, in a fixed order; most jumps are left after 100 ms, as
// a flight leaves a place. Prints the heap of JavaScript after a collection, and the buffers of WebGL, ten times. Then
// waits for SHARP views at the height of a street, each until no node is missing and the frame is drawn. Prints the
// maximum memory of the server. PAGE is the URL of a page that is served already, instead of VOXTILE, and SERVER its
// process, if its memory is wanted.

import { spawn } from 'node:child_process';
import { readFileSync } from 'node:fs';
import { createInterface } from 'node:readline';
import { Browser } from './browser.mjs';

const [map, jumps = '2000', sharp = '30'] = process.argv.slice(2);
const server = process.env.PAGE ? null : spawn(process.env.VOXTILE, ['view', map, '--json'], { stdio: ['ignore', 'pipe', 'inherit'] });
const address = async () => {
  if (!server) return process.env.PAGE;
  for await (const line of createInterface({ input: server.stdout })) return JSON.parse(line).url;
};

// Counts the bytes of the buffers and textures that exist, before the page creates its context.
const COUNT = `(() => {
  const sizes = new Map();
  const bound = new Map();
  const proto = WebGL2RenderingContext.prototype;
  const wrap = (name, before) => {
    const own = proto[name];
    proto[name] = function (...args) { before(this, args); return own.apply(this, args); };
  };
  wrap('bindBuffer', (gl, [target, buffer]) => bound.set(target, buffer));
  wrap('bufferData', (gl, [target, data]) => sizes.set(bound.get(target), typeof data === 'number' ? data : data.byteLength));
  wrap('deleteBuffer', (gl, [buffer]) => sizes.delete(buffer));
  window.gpuBytes = () => [...sizes.values()].reduce((sum, bytes) => sum + bytes, 0);
  window.gpuBuffers = () => sizes.size;
})()`;

// A fixed order of shares, which looks random.
let state = 12345;
const next = () => {
  state = (state * 1103515245 + 12345) % 2 ** 31;
  return state / 2 ** 31;
};

const browser = new Browser(undefined, [960, 640]);
try {
  await browser.open('about:blank');
  await browser.size(960, 640);
  await browser.call('Page.addScriptToEvaluateOnNewDocument', { source: COUNT });
  await browser.call('HeapProfiler.enable');
  const url = await address();
  await browser.open(url);
  const since = Date.now();
  await browser.ready(900);
  console.log(JSON.stringify({ ready_s: (Date.now() - since) / 1000 }));
  const { points } = await (await fetch(`${url}maps/0/trajectory.json`)).json();
  const { bounds } = (await (await fetch(`${url}maps.json`)).json()).maps[0];
  const place = () => (points.length > 10 ? points[Math.floor(next() * points.length)]
    : bounds.min.map((low, axis) => low + next() * (bounds.max[axis] - low)));
  const look = (from, far) => {
    const turn = 2 * Math.PI * next();
    const to = [from[0] + far * Math.cos(turn), from[1] + far * Math.sin(turn), from[2] - 0.2 * far];
    return browser.value(`voxtile.lookAt(${JSON.stringify(from)}, ${JSON.stringify(to)})`);
  };
  const memory = async (jump) => {
    await browser.call('HeapProfiler.collectGarbage');
    const { usedSize } = await browser.call('Runtime.getHeapUsage');
    const [gpu, buffers, nodes] = await browser.value('[gpuBytes(), gpuBuffers(), voxtile.bytes()]');
    const mib = (bytes) => +(bytes / 2 ** 20).toFixed(1);
    console.log(JSON.stringify({ jump, heap_mib: mib(usedSize), gpu_mib: mib(gpu), gpu_buffers: buffers, nodes_mib: mib(nodes) }));
  };
  await memory(0);
  for (let jump = 1; jump <= Number(jumps); jump++) {
    const at = place();
    // Streets, and views from above.
    const high = next() < 0.5 ? 0 : 100 * next();
    await look([at[0], at[1], at[2] + high], 20 + high);
    await new Promise((resolve) => setTimeout(resolve, 100));
    if (jump % 100 === 0) await browser.ready(120);
    if (jump % Math.ceil(Number(jumps) / 10) === 0) await memory(jump);
  }
  const times = [];
  for (let k = 0; k < Number(sharp); k++) {
    await browser.ready(120);
    const start = performance.now();
    await look(place(), 20);
    await browser.until('document.getElementById("state").textContent === "loading"', 5).catch(() => {});
    await browser.ready(120);
    await browser.value('voxtile.finish()');
    times.push((performance.now() - start) / 1000);
  }
  times.sort((a, b) => a - b);
  const share = (at) => +times[Math.min(Math.floor(at * times.length), times.length - 1)].toFixed(2);
  if (times.length) console.log(JSON.stringify({ sharp: { jumps: times.length, median_s: share(0.5), p90_s: share(0.9), most_s: share(1) } }));
  const pid = server?.pid ?? process.env.SERVER;
  if (pid) {
    const [, peak] = /VmHWM:\s*(\d+) kB/.exec(readFileSync(`/proc/${pid}/status`, 'utf8'));
    console.log(JSON.stringify({ server_peak_mib: +(peak / 1024).toFixed(1) }));
  }
} finally {
  await browser.close();
  server?.kill();
}
