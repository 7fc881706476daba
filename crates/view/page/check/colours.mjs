import assert from 'node:assert/strict';

const choose = (id, value) => `document.getElementById('${id}').value = '${value}'; document.getElementById('${id}').dispatchEvent(new Event('change'))`;
const textOf = (browser, id) => browser.value(`document.getElementById('${id}').innerText.replace(/\\s+/g, ' ').trim()`);

// Tests the choice of a colour map, heights above the trajectory, and names of legends. The sensor of the map is 4 m
// above a box, and 5 m above the floor.
export async function checkColours({ browser, view, map, countPixels }) {
  const url = await view(map);
  const colourMaps = (await (await fetch(`${url}maps.json`)).json()).color_maps;
  await browser.open('about:blank');
  await browser.open(url);
  await browser.ready();
  await browser.value('voxtile.lookAt([2, 2, 6], [2, 2.001, 0])');
  await browser.value(choose('colour', 'above'));
  await browser.ready();
  assert.equal(await textOf(browser, 'legend-ends'), '-4.95 m -3.95 m');
  assert.equal(await textOf(browser, 'legend-name'), 'Height above the trajectory');
  const counts = [];
  for (const { name, stops } of colourMaps.slice(0, 3)) {
    await browser.value(choose('ramp', name));
    await browser.ready();
    for (const [colour, least] of [[stops[0], 20000], [stops.at(-1), 2000]]) {
      const pixels = await countPixels(`(r, g, b) => Math.hypot(r - ${colour[0]}, g - ${colour[1]}, b - ${colour[2]}) < 8`);
      assert.ok(pixels > least, `${pixels} pixels in ${colour} of ${name}`);
      counts.push(pixels);
    }
  }
  await browser.until(`/colour=above&ramp=${colourMaps[2].name}/.test(location.hash)`, 5);
  // A link opens the same colours, and every choice names its legend.
  const link = await browser.value('location.href');
  await browser.open('about:blank');
  await browser.open(link);
  await browser.ready();
  assert.deepEqual(await browser.value('["colour", "ramp"].map((id) => document.getElementById(id).value)'), ['above', colourMaps[2].name]);
  const names = new Set();
  for (const colour of await browser.value('[...document.getElementById("colour").options].map(({ value }) => value)')) {
    await browser.value(choose('colour', colour));
    names.add(await textOf(browser, 'legend-name'));
  }
  assert.equal(names.size, 9);
  assert.deepEqual(browser.errors, []);
  return `colour maps and heights above the trajectory: ${counts} pixels`;
}
