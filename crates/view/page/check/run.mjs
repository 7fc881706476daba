import assert from 'node:assert/strict';
import { execFileSync, spawn } from 'node:child_process';
import { existsSync, mkdirSync, mkdtempSync, readFileSync, rmSync, writeFileSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { createInterface } from 'node:readline';
import { inflateSync } from 'node:zlib';
import { Browser } from './browser.mjs';
import { checkChanges } from './changes.mjs';
import { checkColours } from './colours.mjs';
import { checkExported } from './exported.mjs';
import { checkJumps } from './jumps.mjs';
import { checkOverviews } from './overviews.mjs';
import { checkPace } from './pace.mjs';
import { checkPeople } from './people.mjs';
import { checkRooms } from './rooms.mjs';
import { checkOpacity, checkTools } from './tools.mjs';

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

// A room of 4 m x 3 m with a box; later scans have a second box.
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

function exported(map, ...options) {
  const file = join(work, 'voxels.csv');
  run('export', map, '-o', file, '-q', ...options);
  const rows = readFileSync(file, 'utf8').split('\n').filter((row) => /^-?\d/.test(row));
  return new Set(rows.map((row) => row.split(',').slice(0, 3).map((k) => Math.round(1000 * k)).join(' ')));
}

const shown = async (browser) => {
  const { centers, edges } = await browser.value('voxtile.voxels()');
  assert.deepEqual(edges.map((edge) => edge.toFixed(6)), ['0.100000'], 'the finest level is in view');
  return new Set(centers.map((center) => center.map((k) => Math.round(1000 * k)).join(' ')));
};

// Moves fingers on the screen; each list has their next positions.
async function fingers(...places) {
  const touchPoints = (points) => points.map(([x, y], id) => ({ x, y, id }));
  for (const [k, points] of places.entries()) {
    await browser.call('Input.dispatchTouchEvent', { type: k ? 'touchMove' : 'touchStart', touchPoints: touchPoints(points) });
  }
  return () => browser.call('Input.dispatchTouchEvent', { type: 'touchEnd', touchPoints: [] });
}

async function touch() {
  const away = ({ eye, to }) => Math.hypot(...eye.map((k, axis) => k - to[axis]));
  const camera = () => browser.value('voxtile.camera()');
  const moved = (one, other) => Math.hypot(...one.eye.map((k, axis) => k - other.eye[axis]));
  await browser.call('Emulation.setTouchEmulationEnabled', { enabled: true, maxTouchPoints: 5 });
  await browser.value('document.getElementById("fit").click()');
  const before = await camera();
  await (await fingers([[300, 300]], [[340, 310]], [[400, 320]]))();
  const turned = await camera();
  assert.ok(moved(before, turned) > 0.1 && Math.abs(away(before) - away(turned)) < 1e-3, 'one finger turns');
  await (await fingers([[300, 300], [360, 300]], [[280, 300], [380, 300]], [[200, 300], [460, 300]]))();
  const nearer = await camera();
  assert.ok(away(nearer) < 0.8 * away(turned), `two fingers come near: ${away(turned)} m, then ${away(nearer)} m`);
  const at = [1.05, 0.05, -0.25];
  await browser.value(`voxtile.lookAt([-1.5, 0.02, 0.1], ${JSON.stringify(at)})`);
  await browser.ready();
  const [x, y] = await browser.value(`voxtile.screenOf(${JSON.stringify(at)})`);
  await (await fingers([[x, y]]))();
  await browser.until('document.getElementById("answer").textContent.includes("occupied")', 10);
  await browser.value('document.getElementById("walk").click()');
  const standing = await camera();
  const lift = await fingers([[300, 300], [400, 300]]);
  await browser.until(`Math.hypot(...voxtile.camera().eye.map((k, axis) => k - ${JSON.stringify(standing.eye)}[axis])) > 0.2`, 10);
  await lift();
  const walked = await camera();
  assert.ok(walked.eye[0] > standing.eye[0] + 0.1, 'two fingers go ahead');
  await (await fingers([[300, 300]], [[340, 300]]))();
  await browser.value('document.getElementById("walk").click()');
  await browser.call('Emulation.setTouchEmulationEnabled', { enabled: false });
  await browser.ready();
}

const browser = new Browser();
ended.push(() => browser.close());
// Counts the pixels of the map for which a function of red, green and blue holds.
const count = async (isWanted) => {
  const { data } = await browser.call('Page.captureScreenshot', { format: 'png' });
  return browser.value(`(async () => {
    const image = new Image();
    image.src = 'data:image/png;base64,${data}';
    await image.decode();
    const canvas = new OffscreenCanvas(image.width, image.height);
    const context = canvas.getContext('2d');
    context.drawImage(image, 0, 0);
    const { data } = context.getImageData(0, 0, image.width - 264, image.height);
    let count = 0;
    for (let k = 0; k < data.length; k += 4) count += (${isWanted})(data[k], data[k + 1], data[k + 2]);
    return count;
  })()`);
};

// Checks ground and scale, ends of the colours, views, the card of a click, the command of a cut, and play.
async function checkHands(map) {
  const text = (id) => browser.value(`document.getElementById('${id}').innerText.replace(/\\s+/g, ' ').trim()`);
  const press = async (id) => {
    await browser.value(`document.getElementById('${id}').click()`);
    await browser.ready();
  };
  await browser.value('voxtile.lookAt([-1.5, 0.02, 0.1], [1.05, 0.05, -0.25])');
  await browser.ready();
  const [pixels, away] = await browser.value(`(() => {
    const { eye, to } = voxtile.camera();
    return [document.getElementById('bar').offsetWidth / document.getElementById('scene').clientHeight, Math.hypot(...eye.map((k, axis) => k - to[axis]))];
  })()`);
  const barM = pixels * 2 * Math.tan(Math.PI / 6) * away;
  const barText = /^(\d+) (cm|m)$/.exec(await text('bar'));
  assert.ok(Math.abs(barM - barText[1] * (barText[2] === 'cm' ? 0.01 : 1)) < 0.05 * barM, `${barText[0]} for ${barM} m`);
  const endsOfColours = await text('legend-ends');
  await browser.value(`document.getElementById('range-low').value = 400; document.getElementById('range-low').dispatchEvent(new Event('input'))`);
  assert.notEqual(await text('legend-ends'), endsOfColours);
  const aside = await browser.value('voxtile.camera()');
  await press('top');
  assert.ok(Math.abs((await browser.value('voxtile.camera()')).eye[2] - aside.eye[2]) > 1);
  await press('back');
  const returned = await browser.value('voxtile.camera()');
  assert.ok(Math.hypot(...returned.eye.map((k, axis) => k - aside.eye[axis])) < 1e-6, 'back shows the view before');
  const clicked = await browser.value('voxtile.clickAt(...voxtile.screenOf([1.05, 0.05, -0.25])).then(() => voxtile.screenOf([1.05, 0.05, -0.25]))');
  const card = await browser.value('(({ left, top, right, bottom }) => [left, top, right, bottom])(document.getElementById("card").getBoundingClientRect())');
  const gap = Math.hypot(Math.max(card[0] - clicked[0], clicked[0] - card[2], 0), Math.max(card[1] - clicked[1], clicked[1] - card[3], 0));
  assert.ok(gap < 30, `the answer is ${gap} pixels from the click`);
  await browser.value('document.getElementById("card-close").click()');
  assert.equal(await browser.value('document.getElementById("card").hidden'), true);
  await browser.value(`document.getElementById('x0').value = 333; document.getElementById('x0').dispatchEvent(new Event('input')); document.getElementById('fit').click(); voxtile.detail = 0.1`);
  await browser.value('document.getElementById("crop").click()');
  const region = / --region (.*)$/.exec(await text('message'))[1].split(' ');
  run('crop', map, '-o', join(work, 'cropped'), '--region', ...region, '-q');
  const cropped = exported(join(work, 'cropped')).size;
  assert.ok(cropped > 0 && cropped < exported(map).size);
  await browser.until(`document.getElementById('state').textContent === 'ready' && voxtile.voxels().count === ${cropped}`, 30);
  await browser.value('document.getElementById("uncut").click(); document.getElementById("speed").value = 10; document.getElementById("play").click()');
  await browser.until('document.getElementById("play").ariaPressed === "false" && document.getElementById("scan").value === document.getElementById("scan").max', 20);
  await browser.ready();
  assert.equal(await browser.value('document.querySelectorAll("#panel > details:not([hidden])").length'), 5);
  assert.deepEqual(browser.errors, []);
  return `a scale bar of ${barText[0]}, ends of colours, the view before, the answer next to the click, a crop of ${cropped} voxels, and play`;
}

let done = 0;
const step = (text) => console.log(`${++done}. ${text}`);
checks: try {
  if (process.env.ONLY === 'changes') {
    step(await checkChanges({ browser, view, run, exported, countPixels: count, work }));
    break checks;
  }
  if (process.env.ONLY === 'tools') {
    const map = join(work, 'room');
    run('build', scan(0), '-o', map, '--resolution', '0.1', '-q');
    run('build', scan(7), '-o', map, '--append', '-q');
    step(await checkTools({ browser, view, map, run, exported, work }));
    step(await checkJumps({ browser, view, run, work }));
    step(await checkRooms({ browser, view, run, exported, work }));
    step(await checkOverviews({ browser, view, run, exported, work }));
    step(await checkPace({ browser, url: await view(map) }));
    step(await checkPeople({ browser, url: await view(map) }));
    run('build', scan(1), '-o', join(work, 'other'), '--resolution', '0.1', '-q');
    await browser.open('about:blank');
    await browser.open(await view(map, join(work, 'other')));
    await browser.ready();
    step(await checkOpacity({ browser, countPixels: count }));
    break checks;
  }
  const map = join(work, 'room');
  run('build', scan(0), '-o', map, '--resolution', '0.1', '-q');
  const url = await view(map);
  const colourMaps = (await (await fetch(`${url}maps.json`)).json()).color_maps;
  const { stops } = colourMaps[0];
  await browser.open(url);
  await browser.ready();
  await browser.value('voxtile.detail = 0.1');
  await browser.until(`voxtile.voxels().edges.length === 1 && voxtile.voxels().edges[0] < 0.11 && document.getElementById('state').textContent === 'ready'`);
  assert.deepEqual(await shown(browser), exported(map));
  assert.deepEqual(browser.errors, [], 'no errors in the browser');
  step('the page shows exactly the voxels that export writes');

  const result = await browser.value(`(async () => {
    const at = [1.05, 0.05, -0.25];
    voxtile.lookAt([-1.5, 0.02, 0.1], at);
    await new Promise((resolve) => setTimeout(resolve, 1500));
    return voxtile.clickAt(...voxtile.screenOf(at));
  })()`);
  const expected = JSON.parse(run('query', map, ...result.point_m.map(String), '--json'));
  for (const [name, value] of Object.entries(expected)) assert.deepEqual(result[name], value, name);
  assert.equal(result.state, 'occupied');
  step(`a click shows the result of query: ${result.state}, probability ${result.probability.toFixed(3)}`);

  await browser.value('voxtile.setThreshold(255)');
  const certain = await shown(browser);
  const log = run('query', map, ...result.point_m.map(String));
  assert.ok(certain.size < exported(map).size, `${certain.size} voxels are certain; ${log}`);
  await browser.value('voxtile.setThreshold(0)');
  step('the slider of probability hides voxels, and shows them again');

  await browser.value('document.getElementById("fit").click(); voxtile.detail = 0.1; document.getElementById("free").click(); document.getElementById("unknown").click()');
  const free = exported(map, '--what', 'free').size;
  await browser.until(`voxtile.near().free === ${free} && voxtile.near().unknown && document.getElementById("state").textContent === "ready"`, 30);
  const near = await browser.value('voxtile.near()');
  await browser.value('document.getElementById("free").click(); document.getElementById("unknown").click()');
  await browser.ready();
  assert.deepEqual(await browser.value('voxtile.near()'), {});
  step(`free space and frontier: ${near.free} and ${near.unknown} voxels`);

  await browser.call('Browser.setDownloadBehavior', { behavior: 'allow', downloadPath: work }, undefined);
  await browser.value('document.getElementById("shot").click()');
  const saved = join(work, 'room.png');
  for (let k = 0; !existsSync(saved); k++) {
    assert.ok(k < 100, 'the picture is saved');
    await new Promise((resolve) => setTimeout(resolve, 100));
  }
  const png = readFileSync(saved);
  const [width, height] = [png.readUInt32BE(16), png.readUInt32BE(20)];
  const data = [];
  for (let at = 8; at < png.length; at += 12 + png.readUInt32BE(at)) {
    if (png.toString('latin1', at + 4, at + 8) === 'IDAT') data.push(png.subarray(at + 8, at + 8 + png.readUInt32BE(at)));
  }
  const pixels = inflateSync(Buffer.concat(data));
  assert.ok(pixels.length >= 3 * width * height && new Set(pixels).size > 100, 'the picture shows the map');
  step(`a picture of ${width} x ${height} is saved`);

  await touch();
  step('a touch screen rotates, zooms, queries and walks');

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
  assert.match(await browser.value('document.getElementById("legend-ends").textContent'), /appeared.*vanished.*unchanged/);
  step('changes since a snapshot are shown');

  // Six scans of a wall, in a rotated frame; in the third, something passes.
  const passing = new Set();
  const passed = join(work, 'passed');
  mkdirSync(passed);
  for (let number = 0; number < 6; number++) {
    const points = [];
    for (let row = -40; row <= 40; row++) for (let column = -40; column <= 40; column++) {
      const [y, z] = [column * 0.05, row * 0.05];
      const isPassing = number === 2 && Math.abs(y) < 0.8 && Math.abs(z) < 0.8;
      const point = [5.05, y, z].map((k) => (isPassing ? 0.5 * k : k));
      points.push(point.join(' '));
      // The pose turns x to y, and moves by 100 m along x.
      if (isPassing) passing.add([100 - point[1], point[0], point[2]].map((k) => Math.round(1000 * k)).join(' '));
    }
    writeFileSync(join(passed, `${number}.xyz`), points.join('\n'));
  }
  writeFileSync(join(work, 'passed.txt'), '0 -1 0 100 1 0 0 0 0 0 1 0\n'.repeat(6));
  const wall = join(work, 'wall');
  run('build', passed, '--poses', join(work, 'passed.txt'), '-o', wall, '--keep-scans', '--resolution', '0.2', '--clearing', 'guarded', '-q');
  const label = 'document.getElementById("moving-out").value';
  await browser.open('about:blank');
  const first = server;
  await browser.open(await view(wall, map));
  server = first;
  await browser.ready();
  const requests = 'performance.getEntriesByType("resource").filter(({ name }) => name.includes("moving.bin")).length';
  assert.equal(await browser.value(requests), 0, 'points are loaded only if they are shown');
  await browser.value('document.getElementById("moving").click()');
  await browser.until(`${label} === 'none marked'`, 20);
  const marked = JSON.parse(run('clean', wall, '--json')).points_changed;
  await browser.until(`${label} === '${marked.toLocaleString('en')}'`, 20);
  const points = (await browser.value('voxtile.moving()')).map((point) => point.map((k) => Math.round(1000 * k)).join(' '));
  assert.equal(points.length, marked);
  assert.ok(points.every((point) => passing.has(point)), 'the points are those of what passed');
  assert.ok(marked > 0.9 * passing.size);
  await browser.value('document.getElementById("theme").click(); voxtile.lookAt([100, 0.5, 1], [100, 2.5, 0])');
  await browser.ready();
  const reds = () => count('(r, g, b) => Math.hypot(r - 190, g - 18, b - 24) < 8');
  assert.ok(await reds() > 500, `${await reds()} red pixels`);
  await browser.value('document.getElementById("moving").click()');
  await browser.ready();
  assert.equal(await reds(), 0, 'the points are hidden');
  await browser.value('document.getElementById("moving").click()');
  await browser.until('document.getElementById("moving").checked');
  run('clean', wall, '--undo', '-q');
  await browser.until(`${label} === 'none marked'`, 20);
  await browser.ready();
  assert.equal(await reds(), 0, 'marks that are undone are not drawn');
  await browser.open('about:blank');
  await browser.open(url);
  await browser.ready();
  await browser.value('document.getElementById("moving").click()');
  await browser.until(`${label} === 'no kept scans'`, 20);
  assert.deepEqual(browser.errors, []);
  step(`${marked} moving points are shown, follow clean and are hidden`);

  // Distances at a height: obstacles are the occupied voxels of the layer. Lines of the grid may have any grey.
  await browser.value('document.getElementById("ground").click()');
  await browser.value(`document.getElementById('fit').click(); document.getElementById('top').click();
    document.getElementById('layer').value = 500; document.getElementById('distances').click()`);
  await browser.until('voxtile.distances()?.values.length > 0', 20);
  await browser.ready();
  const layer = await browser.value('voxtile.distances()');
  const z = Math.round(1000 * (layer.corner[2] + layer.edge / 2));
  const ofLayer = [...exported(map)].filter((voxel) => Number(voxel.split(' ')[2]) === z);
  const obstacles = layer.values.flatMap((value, k) => (value === 1
    ? [[k % layer.size[0], Math.floor(k / layer.size[0])].map((at, axis) => Math.round(1000 * (layer.corner[axis] + (at + 0.5) * layer.edge))).join(' ')] : []));
  assert.deepEqual(new Set(obstacles.map((voxel) => `${voxel} ${z}`)), new Set(ofLayer));
  const known = layer.values.filter((value) => value > 1).length;
  assert.ok(ofLayer.length > 30 && known > 200 && layer.values.includes(0), `${ofLayer.length} obstacles, ${known} free, some unknown`);
  // The colours of obstacles, and of free voxels near to them and far away from them.
  const drawn = async () => {
    const near = (colour) => `(r, g, b) => Math.hypot(r - ${colour[0]}, g - ${colour[1]}, b - ${colour[2]}) < 4`;
    return [await count(near([226, 230, 236])), await count(near(stops[0]).replace('< 4', '< 60')), await count(near(stops[11]).replace('< 4', '< 60'))];
  };
  const layerPixels = await drawn();
  assert.ok(layerPixels.every((pixels) => pixels > 500), `${layerPixels} pixels`);
  const message = (await (await fetch(`${url}maps/0/distances.bin?at=0,0,0&cap=0`)).json()).error;
  assert.match(message, /from 0\.1 m to 18\.1 m/);
  run('build', scan(7), '-o', map, '--append', '-q');
  await browser.until(`voxtile.distances()?.values.filter((value) => value === 1).length > ${ofLayer.length}`, 20);
  await browser.value('document.getElementById("distances").click()');
  await browser.ready();
  assert.equal((await drawn())[0], 0, 'the distances are hidden');
  assert.deepEqual(browser.errors, []);
  step(`distances at a height: ${layerPixels.join(', ')} pixels; they follow a build`);

  // Two scans from above of a floor, green and ground; a box, red and a building; and points without attributes.
  const painted = (start) => {
    const folder = join(work, `painted${start}`);
    mkdirSync(folder);
    for (const number of [0, 1]) {
      const rows = ['x,y,z,intensity,r,g,b,class'];
      for (let k = 0; k < 40; k++) for (let j = 0; j < 40; j++) {
        const isBox = k >= 10 && k < 20 && j >= 10 && j < 20;
        const point = [0.05 + 0.1 * k, 0.05 + 0.1 * j, (isBox ? 1.05 : 0.05) - 5];
        // The second scan sees half of the floor.
        if (number === 0 || k >= 20) rows.push([...point, ...(isBox ? [90, 220, 40, 30, 6] : [30, 30, 160, 60, 2])].map((value) => +Number(value).toFixed(3)).join(','));
      }
      // The name has the time stamp.
      writeFileSync(join(folder, `${start + 100 * number}.000000.csv`), rows.join('\n'));
    }
    writeFileSync(join(folder, 'poses_tum.txt'), [0, 1].map((k) => `${start + 100 * k} 0 0 5 0 0 0 1\n`).join(''));
    return folder;
  };
  const layered = join(work, 'layered');
  run('build', painted(1317042272), '-o', layered, '--resolution', '0.1', '--layers', 'colour,intensity,class,time', '--poses', join(work, 'painted1317042272/poses_tum.txt'), '-q');
  const plain = server;
  await browser.size(960, 640);
  await browser.open('about:blank');
  await browser.open(await view(layered, map));
  server = plain;
  await browser.ready();
  const requested = () => browser.value('performance.getEntriesByType("resource").filter(({ name }) => name.includes("layer")).length');
  const options = () => browser.value('[...document.getElementById("colour").options].map(({ value }) => value)');
  assert.deepEqual(await options(), ['height', 'above', 'probability', 'count', 'scan', 'rgb', 'intensity', 'class', 'age']);
  assert.equal(await requested(), 0, 'values of layers are loaded only if they are shown');
  await browser.value('document.getElementById("layers").querySelectorAll("input")[1].click(); voxtile.lookAt([2, 2, 6], [2, 2.001, 0])');
  const nearPixels = (colour) => count(`(r, g, b) => Math.hypot(r - ${colour[0]}, g - ${colour[1]}, b - ${colour[2]}) < 12`);
  const colourBy = async (name) => {
    await browser.value(`document.getElementById('colour').value = '${name}'; document.getElementById('colour').dispatchEvent(new Event('change'))`);
    await browser.until(`voxtile.painted() === '${name}' && document.getElementById('state').textContent === 'ready'`, 30);
    return browser.value('[document.getElementById("legend-classes"), document.getElementById("legend-ends")].map(({ innerText }) => innerText.replace(/\\s+/g, " ")).join("|")');
  };
  const pixelsOf = async (...colours) => {
    const found = [];
    for (const colour of colours) found.push(await nearPixels(colour));
    return found;
  };
  await colourBy('rgb');
  const byColour = await pixelsOf([30, 160, 60], [220, 40, 30]);
  assert.ok(byColour[0] > 20000 && byColour[1] > 2000, `${byColour} pixels in colour`);
  assert.match(await colourBy('class'), /2 ground 1,500 6 building 100/);
  const byClass = await pixelsOf([166, 124, 82], [236, 126, 84]);
  assert.ok(byClass[0] > 20000 && byClass[1] > 2000, `${byClass} pixels by class`);
  assert.match(await colourBy('intensity'), /30 90/);
  const byIntensity = await pixelsOf(stops[0], stops.at(-1));
  assert.ok(byIntensity[0] > 20000 && byIntensity[1] > 2000, `${byIntensity} pixels by intensity`);
  assert.match(await colourBy('age'), /2011-09-26 13:04:32 13:06:12/);
  const byAge = await pixelsOf(stops[0], stops.at(-1));
  assert.ok(byAge[0] > 10000 && byAge[1] > 10000, `${byAge} pixels by age`);
  await browser.value('voxtile.clickAt(...voxtile.screenOf([1.55, 1.55, 1.1]))');
  await browser.until('/6 building: 1/.test(document.getElementById("answer").innerText)', 10);
  const said = await browser.value('document.getElementById("answer").innerText.replace(/\\s+/g, " ")');
  assert.match(said, /hits 1 colour 220 40 30 intensity 90.0 ± 0.0 class 6 building: 1 first hit 2011-09-26 13:04:32/);
  await colourBy('rgb');
  run('snapshot', layered, 'before');
  run('build', painted(1317042572), '-o', layered, '--append', '--again', '--poses', join(work, 'painted1317042572/poses_tum.txt'), '-q');
  await browser.until('voxtile.generation[0] > 1');
  await browser.ready();
  // The snapshot has a generation of its own, which may be shown before that of the build.
  await colourBy('age');
  await browser.until('/2011-09-26 13:04:32\\s+13:11:12/.test(document.getElementById("legend-ends").innerText)', 30);
  await browser.ready();
  await browser.value(`document.getElementById('snapshot').value = 'before'; document.getElementById('snapshot').dispatchEvent(new Event('change'))`);
  await browser.until('/13:06:12/.test(document.getElementById("legend-ends").innerText)', 30);
  await browser.ready();
  assert.ok((await pixelsOf(stops[0]))[0] > 10000, 'the snapshot has its own times');
  await browser.value(`document.getElementById('snapshot').value = ''; document.getElementById('snapshot').dispatchEvent(new Event('change'))`);
  await colourBy('height');
  assert.deepEqual(browser.errors, []);
  step(`layers: ${byColour} pixels in colour, ${byClass} by class, ${byIntensity} by intensity, ${byAge} by age; they follow a build and a snapshot`);
  step(await checkColours({ browser, view, map: layered, countPixels: count }));
  step(await checkExported({ browser, view, map: layered, run, work, ended }));
  server = plain;
  const changes = await checkChanges({ browser, view, run, exported, countPixels: count, work });
  server = plain;
  step(`changes between two maps, ${changes}`);
  await browser.open('about:blank');
  await browser.open(url);
  await browser.ready();
  assert.deepEqual(await options(), ['height', 'above', 'probability', 'count', 'scan']);

  for (const [width, height, dark] of [[360, 640, false], [1280, 720, true]]) {
    await browser.size(width, height, dark);
    await browser.ready();
    const over = await browser.value('document.documentElement.scrollWidth > innerWidth');
    assert.equal(over, false, `${width} x ${height} fits`);
  }
  step('small and large screens, light and dark');
  assert.deepEqual(browser.errors, []);

  step(await checkHands(map));
  step(await checkPeople({ browser, url }));
  const running = server;
  step(await checkTools({ browser, view, map, run, exported, work }));
  step(await checkJumps({ browser, view, run, work }));
  step(await checkRooms({ browser, view, run, exported, work }));
  step(await checkOverviews({ browser, view, run, exported, work }));
  server = running;
  step(await checkPace({ browser, url }));
  await browser.open('about:blank');
  await browser.open(url);
  await browser.ready();

  const atRest = await browser.value('voxtile.drawCalls()');
  await browser.value('voxtile.lookAt(...Object.values(voxtile.camera()))');
  await browser.ready();
  assert.equal(await browser.value('voxtile.drawCalls()'), atRest, 'what is ready stays as it is');
  const gone = new Promise((resolve) => server.once('exit', resolve));
  server.kill();
  await gone;
  await browser.until('document.getElementById("state").textContent === "disconnected"');
  const [, address, token] = /\/\/([^/]+)\/([^/]+)\//.exec(url);
  await view(map, '--listen', address, '--token', token);
  await browser.ready();
  step('the page reconnects to a restarted server');
  // The browser also reports the disconnection.
  assert.ok(browser.errors.splice(0).every((line) => /Failed to load|net::ERR/.test(line)));

  const isShown = (...ids) => `JSON.stringify(voxtile.shown) === '${JSON.stringify(ids)}' && document.getElementById('state').textContent === 'ready'`;
  const follows = async (...maps) => {
    const count = maps.reduce((sum, one) => sum + exported(one).size, 0);
    await browser.value('document.getElementById("fit").click(); voxtile.detail = 0.1');
    await browser.until(`document.getElementById('state').textContent === 'ready' && voxtile.voxels().count === ${count}`, 60);
  };

  await browser.open('about:blank');
  await browser.open(url);
  await browser.ready();
  await browser.call('Network.enable');
  await browser.call('Network.setBlockedURLs', { urls: ['*tileset.json*'] });
  run('build', scan(2), '-o', map, '--append', '-q');
  await browser.until('document.getElementById("message").textContent.includes("Cannot load")');
  await browser.call('Network.setBlockedURLs', { urls: [] });
  await follows(map);
  assert.ok(browser.errors.splice(0).every((line) => /Failed to load|net::ERR/.test(line)));
  step('a failed request of a flush is retried');

  const hide = (isHidden) => browser.value(`Object.defineProperty(document, 'hidden', { value: ${isHidden}, configurable: true }); document.dispatchEvent(new Event('visibilitychange'))`);
  await hide(true);
  const generation = await browser.value('voxtile.generation[0]');
  run('build', scan(3), '-o', map, '--append', '-q');
  for (let shows = generation; shows === generation;) shows = (await (await fetch(`${url}maps.json`)).json()).maps[0].generation;
  await new Promise((resolve) => setTimeout(resolve, 1000));
  assert.equal(await browser.value('voxtile.generation[0]'), generation, 'a hidden page keeps no connection');
  await hide(false);
  await follows(map);
  step('a hidden page closes its connection and catches up later');

  const other = join(work, 'other');
  run('build', scan(4), '-o', other, '--resolution', '0.1', '-q');
  const both = await view(map, other);
  await browser.open('about:blank');
  await browser.open(both);
  await browser.ready();
  await browser.value(`document.getElementById('snapshot').value = 'monday'; document.getElementById('snapshot').dispatchEvent(new Event('change'))`);
  await browser.until(isShown('0@monday', '1'), 60);
  await follows(`${map}@monday`, other);
  run('snapshot', map, 'monday', '--delete');
  await browser.until(isShown('0', '1'), 60);
  await follows(map, other);
  // Both maps are extended concurrently. The event for one map does not report the other.
  const grown = [scan(5), scan(6)];
  await Promise.all([map, other].map((one, k) => new Promise((resolve, reject) => {
    const build = spawn(voxtile, ['build', grown[k], '-o', one, '--append', '-q'], { stdio: ['ignore', 'ignore', 'inherit'] });
    build.once('exit', (code) => (code ? reject(new Error(`build: ${code}`)) : resolve()));
  })));
  await follows(map, other);
  assert.deepEqual(browser.errors, []);
  step(await checkOpacity({ browser, countPixels: count }));
  step('a map without the snapshot shows its current state, a deleted snapshot is left, and all maps are updated');

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
    // The limit of draw calls also holds while the map is loaded.
    const most = await browser.value('voxtile.mostDrawCalls()');
    assert.ok(most >= calls && most <= 200, `${most} draw calls`);
    const { tiles } = await maps();
    step(`${tiles} tiles: first picture after ${(first / 1000).toFixed(2)} s of the page (${faces} faces by then); in all ${calls} draw calls, ${(bytes / 2 ** 20).toFixed(1)} MiB`);
  }
} catch (error) {
  writeFileSync(join(tmpdir(), 'voxtile-view-failed.png'), await browser.picture().catch(() => ''));
  console.error(error, browser.errors);
  process.exitCode = 1;
} finally {
  for (const end of ended.reverse()) await end();
  rmSync(work, { recursive: true, force: true, maxRetries: 5, retryDelay: 200 });
}
