import assert from 'node:assert/strict';
import { execFileSync } from 'node:child_process';
import { mkdirSync, writeFileSync } from 'node:fs';
import { join } from 'node:path';

const text = (browser, id) => browser.value(`document.getElementById('${id}').innerText.replace(/\\s+/g, ' ').trim()`);
const set = (id, value) => `document.getElementById('${id}').value = '${value}'; document.getElementById('${id}').dispatchEvent(new Event('input')); document.getElementById('${id}').dispatchEvent(new Event('change'))`;
const press = (browser, id) => browser.value(`document.getElementById('${id}').click()`);

// Moves a mouse from one place to another with its button pressed.
async function drag(browser, from, to) {
  const mouse = (type, [x, y], rest) => browser.call('Input.dispatchMouseEvent', { type, x, y, button: 'left', ...rest });
  await mouse('mousePressed', from, { buttons: 1, clickCount: 1 });
  for (const share of [0.3, 0.7, 1]) await mouse('mouseMoved', from.map((k, axis) => k + share * (to[axis] - k)), { buttons: 1 });
  await mouse('mouseReleased', to, { buttons: 0, clickCount: 1 });
}

// Tests measuring, sections, the box, play by time stamps, and the help, with a map of a room.
export async function checkTools({ browser, view, map, run, exported, work }) {
  await browser.open('about:blank');
  await browser.open(await view(map));
  await browser.ready();
  // The wall is at y = 1.55.
  await browser.value('voxtile.lookAt([0, -0.5, 0.1], [0, 1.5, 0]); voxtile.detail = 0.1');
  await browser.ready();
  const click = (point) => browser.value(`voxtile.clickAt(...voxtile.screenOf(${JSON.stringify(point)}))`);
  await press(browser, 'tool-measure');
  const corners = [[-0.75, 1.5, 0.45], [0.55, 1.5, 0.45], [0.55, 1.5, -0.45]];
  let marks = [];
  for (const corner of corners) ({ marks } = await click(corner));
  const measured = /length (.*) m height difference (.*) m horizontal (.*) m area (.*) m² from above (.*) m²/.exec(await text(browser, 'answer'));
  assert.ok(measured, await text(browser, 'answer'));
  const away = (one, other) => Math.hypot(...one.map((k, axis) => k - other[axis]));
  const [a, b, c] = [[0, 1], [1, 2], [2, 0]].map(([from, to]) => away(marks[from], marks[to]));
  // Heron's formula.
  const half = (a + b + c) / 2;
  const area = Math.sqrt(half * (half - a) * (half - b) * (half - c));
  const flat = marks.map(([x, y]) => [x, y]);
  const fromAbove = 0.5 * Math.abs((flat[1][0] - flat[0][0]) * (flat[2][1] - flat[0][1]) - (flat[2][0] - flat[0][0]) * (flat[1][1] - flat[0][1]));
  const wanted = [a + b, marks[2][2] - marks[0][2], away(flat[2], flat[0]), area, fromAbove];
  assert.ok(wanted[0] > 1 && wanted[3] > 0.1, `${wanted}`);
  assert.deepEqual(measured.slice(1), wanted.map((value) => value.toFixed(2)));
  await browser.call('Input.dispatchKeyEvent', { type: 'keyDown', key: 'Backspace', code: 'Backspace' });
  await browser.call('Input.dispatchKeyEvent', { type: 'keyUp', key: 'Backspace', code: 'Backspace' });
  assert.ok((await text(browser, 'answer')).startsWith(`points 2 length ${a.toFixed(2)} m height difference `));

  // A section has the voxels of its strip.
  await press(browser, 'tool-section');
  for (const corner of corners.slice(0, 2)) ({ marks } = await click(corner));
  await browser.value(set('section-width', 0.302));
  await press(browser, 'fit');
  await browser.value('voxtile.detail = 0.1');
  const [from, to] = marks;
  const length = away(from.slice(0, 2), to.slice(0, 2));
  const [dx, dy] = [0, 1].map((axis) => (to[axis] - from[axis]) / length);
  const inStrip = [...exported(map)].map((voxel) => voxel.split(' ').map((k) => k / 1000)).filter(([x, y]) => {
    const [along, aside] = [(x - from[0]) * dx + (y - from[1]) * dy, (y - from[1]) * dx - (x - from[0]) * dy];
    return along > -1e-6 && along < length + 1e-6 && Math.abs(aside) < 0.151;
  }).length;
  await browser.until(`document.getElementById('state').textContent === 'ready' && voxtile.section().voxels === ${inStrip}`, 20);
  assert.ok(inStrip > 100, `${inStrip} voxels`);
  const plotted = await browser.value(`(() => {
    const { width, height } = document.getElementById('section-plot');
    const { data } = document.getElementById('section-plot').getContext('2d').getImageData(0, 0, width, height);
    return new Set(new Uint32Array(data.buffer)).size;
  })()`);
  assert.ok(plotted > 20, `${plotted} colours in the plot`);
  await browser.call('Input.dispatchKeyEvent', { type: 'keyDown', key: 'Escape', code: 'Escape' });
  await browser.call('Input.dispatchKeyEvent', { type: 'keyUp', key: 'Escape', code: 'Escape' });
  assert.equal(await browser.value('document.getElementById("section").checkVisibility()'), false);

  // A face of the box is dragged; the command has the voxels that remain.
  await press(browser, 'box');
  await browser.ready();
  const middle = (name) => browser.value(`(({ left, top, width, height }) => [left + width / 2, top + height / 2])(document.querySelector('[aria-label="${name}"]').getBoundingClientRect())`);
  const [face0, other] = [await middle('Maximum x of the box'), await middle('Minimum x of the box')];
  await drag(browser, face0, face0.map((k, axis) => k + 0.4 * (other[axis] - k)));
  await browser.ready();
  const face = Number(await browser.value('document.querySelector(`[aria-label="Maximum x of the box"]`).ariaValueNow'));
  const command = () => browser.value('document.getElementById("crop-line").textContent');
  const [, region] = /--region (.*)$/.exec(await command());
  assert.ok(Math.abs(Number(region.split(' ')[3]) - face) < 0.006, `the face is at ${face} m, the region is ${region}`);
  // The height of the distances is none of the command.
  await press(browser, 'distances');
  assert.ok((await command()).endsWith(`--region ${region}`), await command());
  await press(browser, 'distances');
  const cropped = join(work, 'boxed');
  run('crop', map, '-o', cropped, '--region', ...region.split(' '), '-q');
  const left = exported(cropped).size;
  assert.ok(left > 100 && left < exported(map).size, `${left} voxels in the box`);
  await browser.until(`document.getElementById('state').textContent === 'ready' && voxtile.voxels().count === ${left}`, 20);
  await browser.value('document.querySelector(`[aria-label="Maximum x of the box"]`).focus()');
  await browser.call('Input.dispatchKeyEvent', { type: 'keyDown', key: 'ArrowLeft', code: 'ArrowLeft' });
  await browser.call('Input.dispatchKeyEvent', { type: 'keyUp', key: 'ArrowLeft', code: 'ArrowLeft' });
  await browser.until(`Number(document.activeElement.ariaValueNow) < ${face} - 0.005`, 10);
  await browser.value('document.getElementById("uncut").click(); document.getElementById("box").click(); document.activeElement.blur()');

  // Scans at uneven times, which their names have.
  const timed = join(work, "it's timed");
  mkdirSync(join(work, 'stamped'));
  const stamps = [0, 1, 3, 6].map((second) => 1317042272 + second);
  for (const stamp of stamps) writeFileSync(join(work, 'stamped', `${stamp}.000000.xyz`), '3 0 0\n3 0.5 0\n3 0 0.5\n');
  writeFileSync(join(work, 'stamped', 'poses_tum.txt'), stamps.map((stamp, k) => `${stamp} ${k} 0 0 0 0 0 1\n`).join(''));
  run('build', join(work, 'stamped'), '-o', timed, '--resolution', '0.1', '-q');
  await browser.open('about:blank');
  await browser.open(await view(timed));
  await browser.ready();
  assert.equal(await text(browser, 'scan-out'), '4 of 4, 2011-09-26 13:04:38');
  // A shell runs the command, whatever the name of the map.
  execFileSync('sh', ['-c', `${(await command()).replace('voxtile', '"$VOXTILE"')} -q`], { cwd: work });
  assert.deepEqual(exported(`${timed}_part`), exported(timed));
  await browser.value(set('speed', 4));
  const since = Date.now();
  await press(browser, 'play');
  await browser.until('document.getElementById("scan-out").textContent === "3 of 4, 2011-09-26 13:04:35"', 5);
  const third = (Date.now() - since) / 1000;
  assert.ok(third > 0.65 && third < 1.4, `the third scan after ${third} s`);
  await browser.until('document.getElementById("play").ariaPressed === "false"', 20);
  const seconds = (Date.now() - since) / 1000;
  const due = (stamps.at(-1) - stamps[0]) / 4;
  assert.ok(seconds > due - 0.1 && seconds < due + 1, `${seconds} s of ${due} s`);

  // A failed request has a message.
  await browser.value(`(() => {
    const { fetch } = window;
    window.fetch = (url, ...rest) => (String(url).includes('moving.bin') ? Promise.reject(new Error('no network')) : fetch(url, ...rest));
  })()`);
  await press(browser, 'moving');
  await browser.until('document.getElementById("message").textContent === "Cannot load the moving points: no network"', 5);

  await browser.call('Input.dispatchKeyEvent', { type: 'keyDown', key: '?', code: 'Minus', modifiers: 8 });
  await browser.call('Input.dispatchKeyEvent', { type: 'keyUp', key: '?', code: 'Minus' });
  assert.equal(await browser.value('document.getElementById("keys").open'), true);
  await browser.value('document.getElementById("keys").close()');
  assert.deepEqual(browser.errors, []);
  return `lengths, heights and areas, a section of ${inStrip} voxels, a box of ${left} voxels, play by time stamps in ${seconds.toFixed(1)} s, help`;
}

// Tests the opacity of several maps.
export async function checkOpacity({ browser, countPixels }) {
  await press(browser, 'path');
  await browser.value('voxtile.lookAt([0, -0.5, 0.1], [0, 1.5, 0])');
  const opacity = async (number, value) => {
    await browser.value(`(() => { const input = document.querySelectorAll('#layers [type=range]')[${number}]; input.value = ${value}; input.dispatchEvent(new Event('input')); })()`);
    await browser.ready();
  };
  // The first map is blue, the second one orange.
  const pixels = async () => [await countPixels('(r, g, b) => b > r + 30'), await countPixels('(r, g, b) => r > b + 30')];
  await opacity(0, 1);
  await opacity(1, 0);
  const [all, none] = await pixels();
  await opacity(0, 0.5);
  const [half] = await pixels();
  await opacity(1, 0.5);
  const both = await pixels();
  await opacity(0, 0);
  await opacity(1, 0);
  const { count } = await browser.value('voxtile.voxels()');
  const clicked = await browser.value('voxtile.clickAt(...voxtile.screenOf([0, 1.5, 0]))');
  await opacity(0, 1);
  await opacity(1, 1);
  await press(browser, 'path');
  assert.ok(all > 5000 && none < 0.01 * all, `${all} and ${none} pixels`);
  assert.ok(half < 0.8 * all && both[1] > 1000 && both[0] > 1000, `${half}, ${both} of ${all} pixels`);
  assert.deepEqual([count, clicked ?? null], [0, null], 'invisible maps have no voxels to click');
  assert.deepEqual(browser.errors, []);
  return `opacity of two maps: ${all}, ${half}, ${both} pixels`;
}
