import assert from 'node:assert/strict';
import { mkdirSync, writeFileSync } from 'node:fs';
import { join } from 'node:path';

const isReady = 'document.getElementById("state").textContent === "ready"';

// Writes a scan of a floor and a wall, and of a roof if it has one, with its sensor at a height.
function room(work, name, height, hasRoof) {
  const folder = join(work, name);
  mkdirSync(folder);
  const points = [];
  for (let k = 0; k < 3600; k++) {
    const at = [k % 60 / 10 - 2.95, Math.floor(k / 60) / 10 - 2.95];
    points.push([...at, -1.25], [at[0], 3.05, 0.05]);
    if (hasRoof) points.push([...at, 1.35]);
  }
  writeFileSync(join(folder, '0.xyz'), points.map((point) => point.join(' ')).join('\n'));
  writeFileSync(join(folder, 'poses_tum.txt'), `${height} 0 0 ${height} 0 0 0 1\n`);
  return folder;
}

// Tests that the ceiling and the colours are those of the shown state: with a link to a snapshot, after a failed request,
// and in comparisons; and that overviews are requested one at a time.
export async function checkOverviews({ browser, view, run, exported, work }) {
  const [map, floor] = [join(work, 'storeys'), join(work, 'floor')];
  run('build', room(work, 'lower', 1.2, true), '-o', map, '--resolution', '0.1', '--clearing', 'guarded', '-q');
  run('snapshot', map, 'lower');
  run('build', room(work, 'upper', 6.2, true), '-o', map, '--append', '--again', '-q');
  run('build', room(work, 'plain', 1.2, false), '-o', floor, '--resolution', '0.1', '--clearing', 'guarded', '-q');
  const url = await view(map);
  const ceilingOf = async (state) => (await (await fetch(`${url}maps/${state}/overview.json`)).json()).ceiling_m;
  const ceiling = await ceilingOf('0@lower');
  assert.ok(ceiling > 1 && ceiling !== await ceilingOf('0'), `a ceiling at ${ceiling} m, another one now`);
  const heights = [...exported(`${map}@lower`)].map((voxel) => Number(voxel.split(' ')[2]) / 1000);
  const below = heights.filter((z) => z < ceiling).length;
  assert.ok(below > 1000 && below < 0.8 * heights.length, `${below} of ${heights.length} voxels`);
  const shows = async (id, count) => {
    await browser.until(`voxtile.shown.join() === '${id}' && ${isReady}`, 20);
    await browser.value('voxtile.detail = 0.1');
    await browser.until(`${isReady} && voxtile.voxels().count === ${count}`, 10);
  };
  const open = async (address) => {
    await browser.open('about:blank');
    await browser.open(address);
  };

  await open(`${url}#at=lower`);
  await shows('0@lower', below);
  await open(url);
  await browser.ready();
  await browser.value('location.hash = "at=lower"');
  await shows('0@lower', below);
  assert.deepEqual(browser.errors, []);

  await browser.call('Network.enable');
  await browser.call('Network.setBlockedURLs', { urls: ['*overview.json*'] });
  await open(`${url}#at=lower`);
  await browser.until('document.getElementById("message").textContent.includes("Cannot load the ceiling")', 10);
  await shows('0@lower', heights.length);
  await browser.call('Network.setBlockedURLs', { urls: [] });
  await shows('0@lower', below);
  await browser.call('Network.disable');
  assert.ok(browser.errors.splice(0).every((line) => /Failed to load|net::ERR/.test(line)));

  const choose = (id, value) => browser.value(`document.getElementById('${id}').value = '${value}'; document.getElementById('${id}').dispatchEvent(new Event('change'))`);
  await open(await view(floor, map));
  await browser.ready();
  const times = '(() => performance.getEntriesByType("resource").filter(({ name }) => name.includes("overview.json")).map(({ startTime, responseEnd }) => [startTime, responseEnd]))()';
  await browser.until(`${times}.length >= 2`, 10);
  const requests = await browser.value(times);
  for (const [k, [start]] of requests.entries()) assert.ok(k === 0 || start >= requests[k - 1][1], `one request at a time: ${JSON.stringify(requests)}`);

  await open(await view(floor, '--compare', map));
  await browser.ready();
  const ends = [];
  for (const [id, choice] of ['before', 'after'].entries()) {
    await choose('compared', choice);
    await browser.until(`voxtile.shown.join() === '${id}' && ${isReady}`, 10);
    // An overview would come later.
    await new Promise((resolve) => setTimeout(resolve, 500));
    ends.push(await browser.value('document.getElementById("legend-ends").innerText'));
  }
  assert.match(ends[0], / m/);
  assert.equal(ends[0], ends[1], 'both maps have the same colours at the same heights');
  assert.deepEqual(browser.errors, []);
  return `a link to a snapshot shows its ${below} voxels below its ceiling, and compared maps have the same colours`;
}
