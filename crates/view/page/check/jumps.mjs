import assert from 'node:assert/strict';
import { mkdirSync, writeFileSync } from 'node:fs';
import { join } from 'node:path';

// Tests that nodes are loaded between frames, and that requests of a place that is left are cancelled, with two walls of
// 160 m.
export async function checkJumps({ browser, view, run, work }) {
  const folder = join(work, 'walls');
  mkdirSync(folder);
  const places = Array.from({ length: 16 }, (_, k) => 10 * k + 5);
  for (const [k, at] of places.entries()) {
    const points = [];
    for (let x = -50; x < 50; x++) for (let z = -10; z < 10; z++) points.push([x / 10, 2.05, z / 10], [x / 10, -2.05, z / 10]);
    writeFileSync(join(folder, `${at.toString().padStart(3, '0')}.xyz`), points.map((point) => point.join(' ')).join('\n'));
    places[k] = `${k} ${at} 0 0 0 0 0 1\n`;
  }
  writeFileSync(join(folder, 'poses_tum.txt'), places.join(''));
  const map = join(work, 'walls_map');
  run('build', folder, '-o', map, '--resolution', '0.1', '--tile-size', '1.6', '-q');
  const url = await view(map);
  await browser.open('about:blank');
  await browser.open(url);
  await browser.ready();

  // Frames are as slow as those of software with a large map.
  const look = (x) => `voxtile.lookAt([${x}, 0, 0.2], [${x + 5}, 0.5, 0])`;
  await browser.value('window.requestAnimationFrame = (frame) => setTimeout(() => frame(performance.now()), 800)');
  const before = await browser.value(`${look(5)}; voxtile.frames`);
  await browser.until('document.getElementById("state").textContent === "loading"', 5);
  await browser.ready();
  const frames = await browser.value('voxtile.frames') - before;
  assert.ok(frames <= 4, `${frames} frames until all levels are loaded`);
  const { edges } = await browser.value('voxtile.voxels()');
  assert.ok(edges.some((edge) => Math.abs(edge - 0.1) < 1e-6), `voxels of ${edges}`);

  // A slow network: a place is left before its nodes are loaded.
  const asked = [];
  browser.listener = ({ method, params }) => {
    const node = method === 'Network.requestWillBeSent' && /\/node\/\d+\/.*\.vox/.exec(params.request.url);
    if (node) asked.push(node[0]);
  };
  await browser.call('Network.enable');
  const wholeOf = async (x) => {
    asked.length = 0;
    await browser.value(look(x));
    await browser.until('document.getElementById("state").textContent === "loading"', 5);
    await browser.ready();
    return asked.length;
  };
  const whole = await wholeOf(60);
  await browser.call('Network.emulateNetworkConditions', { offline: false, latency: 400, downloadThroughput: -1, uploadThroughput: -1 });
  asked.length = 0;
  await browser.value(look(110));
  await browser.until('voxtile.waits()[0].queued > 10', 20);
  await browser.value(look(5));
  await browser.ready();
  await browser.call('Network.emulateNetworkConditions', { offline: false, latency: 0, downloadThroughput: -1, uploadThroughput: -1 });
  const left = asked.length;
  browser.listener = null;
  await browser.call('Network.disable');
  assert.ok(whole > 40 && left < 0.6 * whole, `${left} nodes of a place that was left, ${whole} of one that was not`);
  assert.deepEqual(browser.errors, []);
  return `${frames} slow frames until all levels are loaded; ${left} of some ${whole} nodes of a place that was left are requested`;
}
