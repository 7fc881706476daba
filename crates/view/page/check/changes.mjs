import assert from 'node:assert/strict';
import { mkdirSync, writeFileSync } from 'node:fs';
import { join } from 'node:path';
import { checkSwipe, checkSwipeOfStates } from './swipe.mjs';

// A wall at 5 m; the later map has a box before it, and a second one at the other side instead of the earlier one.
function scans(work, name, boxes) {
  const folder = join(work, name);
  mkdirSync(folder);
  const points = [];
  for (let row = -40; row <= 40; row++) for (let column = -40; column <= 40; column++) {
    const [y, z] = [column * 0.05, row * 0.05];
    const isBox = boxes.some(([low, high]) => y > low && y < high && Math.abs(z) < 0.7);
    points.push([5.05, y, z].map((k) => (isBox ? 0.5 * k : k)).join(' '));
  }
  for (let number = 0; number < 6; number++) writeFileSync(join(folder, `${number}.xyz`), points.join('\n'));
  writeFileSync(join(work, `${name}.txt`), '1 0 0 0 0 1 0 0 0 0 1 0\n'.repeat(6));
  return [folder, '--poses', join(work, `${name}.txt`)];
}

// Tests the view of the changes between two maps.
export async function checkChanges({ browser, view, run, exported, countPixels, work }) {
  const [before, after] = [join(work, 'earlier'), join(work, 'later')];
  const options = ['--resolution', '0.1', '--clearing', 'guarded', '--keep-scans', '-q'];
  run('build', ...scans(work, 'scans-before', [[-1.5, -0.7]]), '-o', before, ...options);
  const later = scans(work, 'scans-after', [[-0.2, 1.2]]);
  run('build', ...later, '-o', after, ...options);
  const wanted = JSON.parse(run('compare', before, after, '--json'));
  assert.ok(wanted.appeared.clusters > 0 && wanted.vanished.clusters > 0, JSON.stringify(wanted));
  await browser.open('about:blank');
  await browser.open(await view(before, '--compare', after));
  await browser.ready();
  await browser.value('voxtile.detail = 0.1');
  const voxels = async (count) => {
    await browser.until(`document.getElementById('state').textContent === 'ready' && voxtile.voxels().edges.join() === '0.1' && voxtile.voxels().count === ${count}`, 30);
  };
  const all = { unchanged: wanted.after.unchanged, appeared: wanted.after.changed, vanished: wanted.before.changed,
    not_seen_before: wanted.after.not_seen - wanted.after.hidden, not_seen_after: wanted.before.not_seen - wanted.before.hidden,
    uncertain_appeared: wanted.after.uncertain, uncertain_vanished: wanted.before.uncertain, hidden: wanted.after.hidden + wanted.before.hidden };
  // The wall behind the boxes.
  assert.ok(all.hidden > 100, `${all.hidden} hidden voxels`);
  const sum = Object.values(all).reduce((one, other) => one + other, 0);
  await voxels(sum);
  // The legend counts the classes, and hides them.
  const legend = await browser.value('[...document.querySelectorAll("#classes li")].map((row) => [row.querySelector("input").name, row.lastChild.textContent])');
  assert.deepEqual(legend, Object.entries(all).map(([name, count]) => [name, count.toLocaleString('en')]));
  const toggle = (...names) => browser.value(names.map((name) => `document.querySelector('#classes [name=${name}]').click()`).join(';'));
  const near = (r, g, b) => countPixels(`(r, g, b) => Math.hypot(r - ${r}, g - ${g}, b - ${b}) < 60`);
  await browser.value('document.getElementById("change-next").click()');
  await voxels(sum);
  const [blue, orange] = [await near(0, 98, 179), await near(198, 108, 0)];
  assert.ok(blue + orange > 2000, `${blue} blue and ${orange} orange pixels`);
  await toggle('appeared');
  await voxels(sum - all.appeared);
  assert.equal(await near(0, 98, 179), 0, 'appeared voxels are hidden');
  await toggle('appeared', 'unchanged', 'not_seen_before', 'not_seen_after', 'uncertain_appeared', 'uncertain_vanished', 'hidden');
  await voxels(all.appeared + all.vanished);
  // The buttons fly to one change after another, from the largest on.
  const target = async () => (await browser.value('voxtile.camera()')).to;
  for (const [step, number] of [['', 0], ['next', 1 % wanted.changes.length], ['previous', 0], ['previous', wanted.changes.length - 1]]) {
    if (step) await browser.value(`document.getElementById('change-${step}').click()`);
    const { min, max } = wanted.changes[number].bounds_m;
    const [at, center] = [await target(), min.map((low, axis) => (low + max[axis]) / 2)];
    assert.ok(center.every((k, axis) => Math.abs(k - at[axis]) < 1e-3), `${at} is the center of change ${number + 1}, ${center}`);
  }
  const listed = await browser.value('[...document.querySelectorAll("#changes button")].map(({ textContent }) => textContent)');
  assert.equal(listed.length, wanted.changes.length);
  assert.ok(listed[0].startsWith(`1 ${wanted.changes[0].kind} `), listed[0]);
  assert.equal(await browser.value('document.getElementById("crop").hidden && document.getElementById("crop-line").hidden'), true, 'crop has one map');
  // A click shows the state in both maps.
  const center = wanted.changes.find(({ kind }) => kind === 'appeared').center_m;
  await browser.value(`voxtile.lookAt([0, 0, 0], ${JSON.stringify(center)})`);
  await browser.ready();
  await browser.value(`voxtile.clickAt(...voxtile.screenOf(${JSON.stringify(center)}))`);
  await browser.until('/before free.*after.*state occupied/.test(document.getElementById("answer").innerText.replace(/\\s+/g, " "))', 10);
  await browser.value('document.getElementById("free").click()');
  await browser.ready();
  assert.deepEqual(await browser.value('voxtile.near()'), {}, 'changes have no free voxels');
  await browser.value('document.getElementById("free").click()');
  // Either map alone.
  for (const [choice, map] of [['before', before], ['after', after]]) {
    await browser.value(`document.getElementById('compared').value = '${choice}'; document.getElementById('compared').dispatchEvent(new Event('change'))`);
    await browser.until(`voxtile.shown.join() === '${choice === 'before' ? 0 : 1}'`, 10);
    await browser.value('voxtile.detail = 0.1');
    await voxels(exported(map).size);
  }
  const swipe = await checkSwipe({ browser, maps: [before, after], run, exported });
  await checkSwipeOfStates({ browser, view, map: before, inputs: later, run, exported });
  assert.deepEqual(browser.errors, []);
  return `${wanted.changes.length} changes: ${blue} blue and ${orange} orange pixels; ${swipe}`;
}
