import assert from 'node:assert/strict';

const choose = (id, value) => `document.getElementById('${id}').value = '${value}'; document.getElementById('${id}').dispatchEvent(new Event('change'))`;
const isReady = 'document.getElementById("state").textContent === "ready"';

// Keeps the pixels of the map in the page, and counts those that differ between two pictures in some columns. Shades are
// rounded: a colour may differ by 2 of 255.
const PICTURES = `window.pictures = {};
  window.keep = (name) => {
    voxtile.draw();
    const scene = document.getElementById('scene');
    const context = new OffscreenCanvas(scene.width, scene.height).getContext('2d');
    context.drawImage(scene, 0, 0);
    const { data, width } = context.getImageData(0, 0, scene.width, scene.height);
    pictures[name] = new Uint32Array(data.buffer);
    return width;
  };
  window.isOther = (one, other) => one !== other && [0, 8, 16].some((shift) => Math.abs((one >> shift & 255) - (other >> shift & 255)) > 2);
  window.differing = (one, other, from, to) => {
    const width = document.getElementById('scene').width;
    return pictures[one].reduce((sum, pixel, k) => sum + (k % width >= from && k % width < to && isOther(pixel, pictures[other][k])), 0);
  }`;

class SwipePage {
  constructor(browser) {
    this.browser = browser;
  }

  // Waits for some states with all of their voxels.
  async shows(ids, count) {
    await this.browser.until(`voxtile.shown.join() === '${ids}'`, 10);
    await this.browser.value('voxtile.detail = 0.1');
    await this.browser.until(`${isReady} && voxtile.voxels().count === ${count}`, 30);
  }

  // Returns the border as a share of the picture's width, and its place on the screen.
  async border() {
    const [left, width, all, value] = await this.browser.value(`(() => {
      const { left, width } = document.getElementById('border').getBoundingClientRect();
      return [left, width, document.getElementById('scene').clientWidth, Number(document.getElementById('border').ariaValueNow)];
    })()`);
    const x = left + width / 2;
    assert.ok(Math.abs(100 * x / all - value) < 0.51, `the border is at ${x} of ${all}, and ${value} % are reported`);
    return { x, share: x / all, all };
  }

  // Drags from one place to another.
  async drag(from, to, y) {
    const mouse = (type, x, rest) => this.browser.call('Input.dispatchMouseEvent', { type, x, y, ...rest });
    await mouse('mousePressed', from, { button: 'left', buttons: 1, clickCount: 1 });
    for (let k = 1; k <= 5; k++) await mouse('mouseMoved', from + (to - from) * k / 5, { button: 'left', buttons: 1 });
    await mouse('mouseReleased', to, { button: 'left', buttons: 0, clickCount: 1 });
  }

  async isAt(share) {
    const border = await this.border();
    assert.ok(Math.abs(border.share - share) < 0.005, `the border is at ${border.share}, not ${share}`);
  }

  labels() {
    return this.browser.value('document.getElementById("swipe").innerText.replace(/\\s+/g, " ").trim()');
  }

  async press(key, milliseconds = 0) {
    const send = (type) => this.browser.call('Input.dispatchKeyEvent', { type, key, code: key });
    await send('keyDown');
    await new Promise((resolve) => setTimeout(resolve, milliseconds));
    await send('keyUp');
  }

  // Asserts that each side has exactly the pixels of its state alone, and both states differ in both sides.
  async hasSides(left, right) {
    await this.browser.until(isReady, 10);
    const width = await this.browser.value('keep("swipe")');
    const border = Math.round((await this.border()).share * width);
    const differing = (one, other, from, to) => this.browser.value(`differing('${one}', '${other}', ${from}, ${to})`);
    for (const [own, foreign, from, to] of [[left, right, 0, border], [right, left, border, width]]) {
      assert.equal(await differing('swipe', own, from, to), 0, `columns ${from} to ${to} are those of ${own}`);
      const others = await differing('swipe', foreign, from, to);
      assert.ok(others > 500, `${others} pixels in columns ${from} to ${to} differ from ${foreign}`);
    }
    return border;
  }
}

// Tests the swipe between two maps, of which the page shows the changes.
export async function checkSwipe({ browser, maps, run, exported }) {
  const page = new SwipePage(browser);
  const counts = maps.map((map) => exported(map).size);
  const camera = () => browser.value('JSON.stringify(voxtile.camera())');
  await browser.value(PICTURES);
  await browser.value('voxtile.lookAt([1, 0, 0.2], [5, 0, 0])');
  for (const [k, name] of ['before', 'after'].entries()) {
    await browser.value(choose('compared', name));
    await page.shows(`${k}`, counts[k]);
    await browser.value(`keep('${name}')`);
    assert.equal(await browser.value('document.getElementById("swipe").hidden'), true);
  }
  await browser.value(choose('compared', 'swipe'));
  await page.shows('1,0', counts[0] + counts[1]);
  await page.hasSides('before', 'after');
  assert.equal(await page.labels(), 'before: earlier after: later');
  // The sensor is that of the later map.
  const look = (eye) => browser.value(`voxtile.lookAt([${eye}, 0, 0.2], [5, 0, 0])`).then(() => browser.until(isReady, 10));
  await look(-8);
  for (const name of ['with', 'without']) {
    await browser.value(`keep('${name}'); document.getElementById('path').click()`);
    await browser.until(isReady, 10);
  }
  const sensor = async (from, to) => browser.value(`differing('with', 'without', ${from}, ${to})`);
  const middle = Math.round((await page.border()).x);
  assert.deepEqual([await sensor(0, middle) > 0, await sensor(middle, 10000) > 0], [false, true]);
  await look(1);

  // A pointer moves the border and not the camera.
  const seen = await camera();
  const { x, all } = await page.border();
  await page.drag(x + 6, x + 6 - 0.2 * all, 500);
  await page.isAt(0.3);
  await page.hasSides('before', 'after');
  await browser.call('Emulation.setTouchEmulationEnabled', { enabled: true, maxTouchPoints: 5 });
  const touch = (type, ...touchPoints) => browser.call('Input.dispatchTouchEvent', { type, touchPoints });
  await touch('touchStart', { x: 0.3 * all, y: 200, id: 0 });
  for (const share of [0.4, 0.5, 0.6]) await touch('touchMove', { x: share * all, y: 220, id: 0 });
  await touch('touchEnd');
  await browser.call('Emulation.setTouchEmulationEnabled', { enabled: false });
  await page.isAt(0.6);
  await browser.value('document.getElementById("border").focus()');
  for (const [key, share] of [['ArrowLeft', 0.59], ['PageUp', 0.69], ['End', 1], ['Home', 0], ['ArrowRight', 0.01], ['PageUp', 0.11]]) {
    await page.press(key);
    await page.isAt(share);
  }
  for (let k = 0; k < 3; k++) await page.press('PageUp');
  const border = await page.hasSides('before', 'after');
  assert.equal(await camera(), seen, 'the camera does not move');

  // A click asks the map of its side. The other map has a box before the wall there.
  const clicked = [];
  for (const [k, y] of [0.4, -0.55].entries()) {
    const [left, top] = await browser.value(`voxtile.screenOf([2.5, ${y}, 0])`);
    await page.drag(left, left, top);
    const label = ['before: earlier', 'after: later'][k];
    await browser.until(`document.getElementById("answer").innerText.replace(/\\s+/g, " ").startsWith("map ${label} at ")`, 10);
    const [, point, probability] = await browser.value('/\\nat\\n([^\\n]*)[^]*\\nprobability\\n([^\\n]*)/.exec(document.getElementById("answer").innerText)');
    const { state, probability: wanted } = JSON.parse(run('query', maps[k], ...point.split(/\s+/), '--json'));
    assert.deepEqual([state, wanted.toFixed(4)], ['occupied', probability], `${label} at ${point}`);
    clicked.push(Number(point.split(/\s+/)[0]));
  }
  assert.ok(clicked.every((x) => x > 4.9), `clicks at x = ${clicked} are on the wall`);

  // A link opens the same picture.
  await browser.until(`/compared=swipe&line=0.41$/.test(location.hash)`, 10);
  await browser.value('keep("swipe")');
  const link = await browser.value('location.href');
  await browser.open('about:blank');
  await browser.open(link);
  await browser.until(`window.voxtile?.shown.join() === '1,0'`, 20);
  await page.shows('1,0', counts[0] + counts[1]);
  await page.isAt(0.41);
  // In walk mode, keys move the border only, and pointers turn the camera only outside the border.
  await browser.value('document.getElementById("walk").click(); document.getElementById("border").focus()');
  const standing = await camera();
  await page.press('ArrowUp', 300);
  await page.drag(0.42 * all, 0.5 * all, 500);
  await page.isAt(0.5);
  await browser.until(isReady, 10);
  assert.equal(await camera(), standing);
  await browser.value('document.getElementById("walk").click()');
  await page.drag(100, 150, 500);
  const turned = await camera();
  assert.notEqual(turned, standing);
  await browser.call('Input.dispatchMouseEvent', { type: 'mouseWheel', x: 0.5 * all, y: 300, deltaX: 0, deltaY: -200 });
  await browser.until(`JSON.stringify(voxtile.camera()) !== ${JSON.stringify(turned)}`, 10);
  return `the border of a swipe at column ${border}`;
}

// Tests the swipe between a snapshot and the present state of a map.
export async function checkSwipeOfStates({ browser, view, map, inputs, run, exported }) {
  const page = new SwipePage(browser);
  run('snapshot', map, 'first');
  run('build', ...inputs, '-o', map, '--append', '-q');
  const [before, after] = [`${map}@first`, map].map((state) => exported(state).size);
  assert.notEqual(before, after);
  await browser.open('about:blank');
  await browser.open(await view(map));
  await browser.ready();
  await browser.value(PICTURES);
  await browser.value('voxtile.lookAt([1, 0, 0.2], [5, 0, 0])');
  for (const [name, id, count] of [['', '0', after], ['first', '0@first', before]]) {
    await browser.value(choose('snapshot', name));
    await page.shows(id, count);
    await browser.value(`keep('${name}')`);
  }
  assert.equal(await browser.value('document.getElementById("swiped").checkVisibility()'), false);
  await browser.value(`${choose('snapshot', '')}; ${choose('since', 'first')}`);
  await browser.until(`voxtile.shown.join() === '0~first'`, 10);
  assert.equal(await browser.value('document.getElementById("swiped").checkVisibility()'), true);
  await browser.value('document.getElementById("swiped").click()');
  await page.shows('0,0@first', before + after);
  await page.hasSides('first', '');
  assert.equal(await page.labels(), 'before: first after: current');
  // The swipe ends with its snapshot.
  run('snapshot', map, 'first', '--delete');
  await page.shows('0', after);
  assert.equal(await browser.value('document.getElementById("swipe").hidden'), true);
}
