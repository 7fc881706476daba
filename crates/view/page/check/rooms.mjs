import assert from 'node:assert/strict';
import { mkdirSync, writeFileSync } from 'node:fs';
import { join } from 'node:path';

// Tests that the ceiling of a room is hidden at first, from halfway between the sensor and the ceiling on.
export async function checkRooms({ browser, view, run, exported, work }) {
  const folder = join(work, 'roofed');
  mkdirSync(folder);
  const points = [];
  for (let k = 0; k < 3600; k++) {
    const at = [k % 60 / 10 - 2.95, Math.floor(k / 60) / 10 - 2.95];
    points.push([...at, -1.25], [...at, 1.35], [at[0], 3.05, 0.05]);
  }
  writeFileSync(join(folder, '0.xyz'), points.map((point) => point.join(' ')).join('\n'));
  writeFileSync(join(folder, 'poses_tum.txt'), '0 0 0 1.2 0 0 0 1\n');
  const map = join(work, 'roofed_map');
  run('build', folder, '-o', map, '--resolution', '0.1', '-q');
  await browser.open('about:blank');
  await browser.open(await view(map));
  await browser.ready();
  await browser.value('voxtile.detail = 0.1');
  const all = [...exported(map)];
  const below = all.filter((voxel) => Number(voxel.split(' ')[2]) <= 1850).length;
  await browser.until(`document.getElementById('state').textContent === 'ready' && voxtile.voxels().count === ${below}`, 20);
  assert.ok(below > 0.3 * all.length && below < 0.8 * all.length, `${below} of ${all.length} voxels`);
  await browser.value('document.getElementById("ceiling").click()');
  await browser.until(`document.getElementById('state').textContent === 'ready' && voxtile.voxels().count === ${all.length}`, 20);
  assert.equal(await browser.value('document.getElementById("ceiling").checkVisibility()'), false);
  assert.deepEqual(browser.errors, []);
  return `a room of ${below} voxels without its ceiling, ${all.length} with it`;
}
