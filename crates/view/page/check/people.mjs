import assert from 'node:assert/strict';

const box = (id) => `(({ left, top, right, bottom, height }) => ({ left, top, right, bottom, height }))(document.getElementById('${id}').getBoundingClientRect())`;

// Tests names for screen readers, the keyboard, and the drawer of a phone.
export async function checkPeople({ browser, url }) {
  await browser.size(1280, 720);
  await browser.open('about:blank');
  await browser.open(url);
  await browser.ready();
  await browser.value('document.querySelectorAll("details").forEach((group) => { group.open = true; }); document.getElementById("box").click(); document.getElementById("distances").click()');
  await browser.ready();
  await browser.call('Accessibility.enable');
  const { nodes } = await browser.call('Accessibility.getFullAXTree');
  const controls = nodes.filter(({ ignored, role }) => !ignored && ['button', 'slider', 'checkbox', 'combobox', 'spinbutton', 'application'].includes(role?.value));
  const unnamed = controls.filter(({ name }) => !name?.value?.trim());
  assert.deepEqual(unnamed.map(({ role, backendDOMNodeId }) => [role.value, backendDOMNodeId]), []);
  // Sliders have values that mean something.
  const sliders = controls.filter(({ role }) => role.value === 'slider');
  assert.ok(controls.length > 45 && sliders.length > 15, `${controls.length} controls, ${sliders.length} sliders`);
  await browser.value('document.getElementById("box").click(); document.getElementById("distances").click()');

  // The keyboard zooms, and queries the voxel in the middle; the answer is spoken.
  await browser.value('voxtile.lookAt([-1.5, 0.02, 0.1], [1.05, 0.05, -0.25]); document.getElementById("scene").focus()');
  await browser.ready();
  const key = async (name, rest = {}) => {
    for (const type of ['keyDown', 'keyUp']) await browser.call('Input.dispatchKeyEvent', { type, key: name, code: name, ...rest });
  };
  const distance = () => browser.value('(({ eye, to }) => Math.hypot(...eye.map((k, axis) => k - to[axis])))(voxtile.camera())');
  const far = await distance();
  await key('+');
  const near = await distance();
  assert.ok(Math.abs(near - 0.8 * far) < 1e-3, `${far} m, then ${near} m`);
  const before = await browser.value('voxtile.camera()');
  await key('ArrowLeft', { windowsVirtualKeyCode: 37 });
  await browser.until(`JSON.stringify(voxtile.camera()) !== ${JSON.stringify(JSON.stringify(before))}`, 5);
  await browser.ready();
  await key('Enter');
  await browser.until('/^at .*, state occupied, probability /.test(document.getElementById("spoken").textContent)', 10);

  // A phone: the settings are a drawer below the map.
  await browser.size(390, 844);
  await browser.until('!document.getElementById("panel").checkVisibility()', 5);
  await browser.ready();
  const whole = (await browser.value(box('scene'))).height;
  assert.equal(whole, 844);
  await browser.value('document.getElementById("menu").click()');
  await browser.ready();
  const [scene, panel] = [await browser.value(box('scene')), await browser.value(box('panel'))];
  assert.ok(Math.abs(panel.height - 422) < 2 && scene.bottom <= panel.top + 13 && panel.left === 0 && panel.right === 390, JSON.stringify({ scene, panel }));
  assert.equal(await browser.value('document.querySelectorAll("#panel details[open]").length <= 1'), true, 'one group is open');
  const touch = (type, ...touchPoints) => browser.call('Input.dispatchTouchEvent', { type, touchPoints });
  await browser.call('Emulation.setTouchEmulationEnabled', { enabled: true, maxTouchPoints: 5 });
  const pull = async (from, to) => {
    await touch('touchStart', { x: 195, y: from, id: 0 });
    for (const share of [0.5, 1]) await touch('touchMove', { x: 195, y: from + share * (to - from), id: 0 });
    await touch('touchEnd');
    await browser.ready();
  };
  await pull(panel.top + 14, 300);
  assert.ok(Math.abs((await browser.value(box('panel'))).height - 544) < 6, 'the drawer follows the finger');
  const small = await browser.value(`[...document.querySelectorAll('#panel button, #panel select, header button')].filter((one) => one.checkVisibility() && one.getBoundingClientRect().height < 43).map(({ id }) => id)`);
  assert.deepEqual(small, [], 'buttons are large enough for fingers');
  assert.equal(await browser.value('document.documentElement.scrollWidth > innerWidth'), false);
  await pull(305, 840);
  assert.equal(await browser.value('document.getElementById("panel").checkVisibility()'), false, 'the drawer closes');
  // The answer of a tap is on the screen.
  await browser.value('voxtile.lookAt([-1.5, 0.02, 0.1], [1.05, 0.05, -0.25])');
  await browser.ready();
  await browser.value('voxtile.clickAt(...voxtile.screenOf([1.05, 0.05, -0.25]))');
  const card = await browser.value(box('card'));
  assert.ok(card.left >= 0 && card.right <= 390 && card.top >= 0 && card.bottom <= 844, JSON.stringify(card));
  await browser.call('Emulation.setTouchEmulationEnabled', { enabled: false });
  await browser.size(960, 640);
  await browser.ready();
  assert.deepEqual(browser.errors, []);
  return `${controls.length} controls have names, the keyboard zooms and queries, a phone has a drawer`;
}
