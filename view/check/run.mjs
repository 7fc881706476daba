import assert from 'node:assert/strict';
import { execFileSync, spawn } from 'node:child_process';
import { mkdirSync, mkdtempSync, readFileSync, rmSync, writeFileSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { createInterface } from 'node:readline';
import { Browser } from './browser.mjs';

const voxtile = process.env.VOXTILE;
const work = mkdtempSync(join(tmpdir(), 'voxtile-view-'));
const run = (...args) => execFileSync(voxtile, args, { encoding: 'utf8', stdio: ['ignore', 'pipe', 'inherit'] });
const ended = [];

let server;
async function view(...args) {
  server = spawn(voxtile, ['view', ...args, '--json'], { stdio: ['ignore', 'pipe', 'inherit'], env: { ...process.env, XDG_CACHE_HOME: join(work, 'cache') } });
  const started = server;
  ended.push(() => started.kill());
  for await (const line of createInterface({ input: server.stdout })) return JSON.parse(line).url;
  throw new Error('the server did not start');
}

// A room of 4 m x 3 m with a box in it; later scans have a second one.
function scan(number) {
  const folder = join(work, `scan${number}`);
  mkdirSync(folder);
  const points = [];
  for (let k = 0; k < 60; k++) for (let z = 0; z < 20; z++) points.push([-2 + k / 15, 1.52, z / 10 - 1], [-2 + k / 15, -1.52, z / 10 - 1]);
  for (let k = 0; k < 10; k++) for (let z = 0; z < 10; z++) points.push([1.03 + 0.4 * number, k / 20 - 0.25, z / 20 - 0.5]);
  writeFileSync(join(folder, '0.xyz'), points.map((p) => p.join(' ')).join('\n'));
  writeFileSync(join(folder, 'poses_tum.txt'), `${number} 0 ${number / 10} 0 0 0 0 1\n`);
  return folder;
}

function exported(map) {
  const file = join(work, 'voxels.csv');
  run('export', map, '-o', file, '-q');
  const rows = readFileSync(file, 'utf8').split('\n').filter((row) => /^-?\d/.test(row));
  return new Set(rows.map((row) => row.split(',').slice(0, 3).map((k) => Math.round(1000 * k)).join(' ')));
}

const shown = async (browser) => {
  const { centers, edges } = await browser.value('voxtile.voxels()');
  assert.deepEqual(edges.map((edge) => edge.toFixed(6)), ['0.100000'], 'the finest level is in view');
  return new Set(centers.map((center) => center.map((k) => Math.round(1000 * k)).join(' ')));
};

const browser = new Browser();
ended.push(() => browser.close());
let done = 0;
const step = (text) => console.log(`${++done}. ${text}`);
try {
  const map = join(work, 'room');
  run('build', scan(0), '-o', map, '--resolution', '0.1', '-q');
  const url = await view(map);
  await browser.open(url);
  await browser.ready();
  await browser.value('voxtile.detail = 0.1');
  await browser.until(`voxtile.voxels().edges.length === 1 && voxtile.voxels().edges[0] < 0.11 && document.getElementById('state').textContent === 'ready'`);
  assert.deepEqual(await shown(browser), exported(map));
  assert.deepEqual(browser.told, [], 'the browser has nothing to complain of');
  step('what the page shows is what export writes, to the last voxel');

  const told = await browser.value(`(async () => {
    const at = [1.05, 0.05, -0.25];
    voxtile.lookAt([-1.5, 0.02, 0.1], at);
    await new Promise((resolve) => setTimeout(resolve, 1500));
    return voxtile.clickAt(...voxtile.screenOf(at));
  })()`);
  const asked = JSON.parse(run('query', map, ...told.point_m.map(String), '--json'));
  for (const [name, value] of Object.entries(asked)) assert.deepEqual(told[name], value, name);
  assert.equal(told.state, 'occupied');
  step(`a click says what query says: ${told.state}, probability ${told.probability.toFixed(3)}`);

  await browser.value('voxtile.setThreshold(255)');
  const certain = await shown(browser);
  const log = run('query', map, ...told.point_m.map(String));
  assert.ok(certain.size < exported(map).size, `${certain.size} voxels are certain; ${log}`);
  await browser.value('voxtile.setThreshold(0)');
  step('the slider of probability hides voxels, and shows them again');

  run('snapshot', map, 'monday');
  run('build', scan(1), '-o', map, '--append', '-q');
  await browser.until('voxtile.generation[0] > 1');
  await browser.ready();
  await browser.value('document.getElementById("fit").click(); voxtile.detail = 0.1');
  const wanted = exported(map);
  await browser.until(`document.getElementById('state').textContent === 'ready' && voxtile.voxels().count === ${wanted.size}`);
  assert.deepEqual(await shown(browser), wanted);
  step('the page follows a build');

  await browser.open('about:blank');
  await browser.open(`${url}#since=monday`);
  await browser.until('document.getElementById("since")?.options.length === 2');
  await browser.value(`document.getElementById('since').value = 'monday'; document.getElementById('since').dispatchEvent(new Event('change'))`);
  await browser.ready();
  assert.match(await browser.value('document.getElementById("legend-ends").textContent'), /appeared.*vanished.*same/);
  step('what changed since a snapshot is shown');

  for (const [width, height, dark] of [[360, 640, false], [1280, 720, true]]) {
    await browser.size(width, height, dark);
    await browser.ready();
    const over = await browser.value('document.documentElement.scrollWidth > innerWidth');
    assert.equal(over, false, `${width} x ${height} fits`);
  }
  step('small and large screens, light and dark');
  assert.deepEqual(browser.told, []);

  const atRest = await browser.value('voxtile.drawCalls()');
  await browser.value('voxtile.lookAt(...Object.values(voxtile.camera()))');
  await browser.ready();
  assert.equal(await browser.value('voxtile.drawCalls()'), atRest, 'what is ready stays as it is');
  const gone = new Promise((resolve) => server.once('exit', resolve));
  server.kill();
  await gone;
  await browser.until('document.getElementById("state").textContent === "server gone"');
  const [, address, token] = /\/\/([^/]+)\/([^/]+)\//.exec(url);
  await view(map, '--listen', address, '--token', token);
  await browser.ready();
  step('a server that comes back is noticed');
  // That it was gone, the browser says as well.
  assert.ok(browser.told.splice(0).every((line) => /Failed to load|net::ERR/.test(line)));

  if (process.argv[2]) {
    const city = await view(process.argv[2]);
    const maps = async () => (await (await fetch(`${city}maps.json`)).json()).maps[0];
    for (let since = Date.now(); (await maps()).pending_tiles || !(await maps()).generation;) {
      assert.ok(Date.now() - since < 600_000, 'the levels are made');
      await new Promise((resolve) => setTimeout(resolve, 500));
    }
    await browser.size(640, 360);
    await browser.open('about:blank');
    await browser.open(city);
    const first = await browser.until('window.voxtile?.firstPictureMs');
    const faces = await browser.value('voxtile.faces()');
    await browser.ready(300);
    const [calls, bytes] = [await browser.value('voxtile.drawCalls()'), await browser.value('voxtile.bytes()')];
    assert.ok(calls <= 200 && bytes <= 256 * 2 ** 20);
    const { tiles } = await maps();
    step(`${tiles} tiles: first picture after ${(first / 1000).toFixed(2)} s of the page (${faces} faces by then); in all ${calls} draw calls, ${(bytes / 2 ** 20).toFixed(1)} MiB`);
  }
} catch (error) {
  writeFileSync(join(tmpdir(), 'voxtile-view-failed.png'), await browser.picture().catch(() => ''));
  console.error(error, browser.told);
  process.exitCode = 1;
} finally {
  for (const end of ended.reverse()) await end();
  rmSync(work, { recursive: true, force: true, maxRetries: 5, retryDelay: 200 });
}
