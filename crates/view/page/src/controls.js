// Controls of the panel, keys, and the theme.

import { app, comparison, ground, viewer } from './app.js';
import { colour, paint } from './colours.js';
import { loadOverviews, cut } from './cut.js';
import { followCamera } from './distance_slice.js';
import { $ } from './dom.js';
import { showPanel } from './drawer.js';
import { isBehind } from './live.js';
import { allBounds, readCompared, showMaps, surround } from './maps.js';
import { choose, removeMark } from './measure.js';
import { MOVING, OBSTACLE } from './palette.js';
import { remember } from './view_link.js';

for (const kind of ['occupied', 'free', 'unknown']) {
  $(kind).addEventListener('change', () => {
    viewer.shows[kind] = $(kind).checked;
    viewer.wake();
  });
}
$('bounds').addEventListener('change', () => {
  const { min, max } = allBounds();
  if ($('bounds').checked) viewer.overlays.box('bounds', min, max, 0x7d8594);
  else viewer.overlays.set('bounds', null);
  viewer.wake();
});
$('ground').addEventListener('change', () => ground.show($('ground').checked));
$('ceiling').addEventListener('click', () => {
  app.showsCeiling = true;
  surround();
  cut();
  paint();
});
$('grid').addEventListener('change', () => {
  if ($('grid').checked) viewer.overlays.tiles('grid', { ...allBounds(), min: [...allBounds().min.slice(0, 2), app.maps[0].low] }, app.maps[0].tile_size_m, 0x7d8594);
  else viewer.overlays.set('grid', null);
  viewer.wake();
});
for (const id of ['snapshot', 'since', 'swiped']) {
  $(id).addEventListener('change', () => {
    showMaps();
    loadOverviews();
  });
}
$('compared').addEventListener('change', async () => {
  await readCompared();
  showMaps();
  loadOverviews();
});

$('shot').addEventListener('click', () => {
  viewer.draw();
  viewer.canvas.toBlob((blob) => {
    const a = Object.assign(document.createElement('a'), { href: URL.createObjectURL(blob), download: `${app.maps[0]?.name ?? 'map'}.png` });
    a.click();
    setTimeout(() => URL.revokeObjectURL(a.href), 1000);
  });
});

$('help').addEventListener('click', () => $('keys').showModal());
function theme(dark) {
  document.documentElement.classList.toggle('dark', dark);
  viewer.scene.background = null;
  viewer.renderer.setClearColor(dark ? 0x14161b : 0xf4f5f7, 1);
  ground.paint(dark);
  viewer.shading.setSky(...(dark ? [0.03, 0.035, 0.05] : [-0.09, -0.06, -0.02]));
  viewer.wake();
}
const scheme = matchMedia('(prefers-color-scheme: dark)');
scheme.addEventListener('change', () => theme(scheme.matches));
$('theme').addEventListener('click', () => theme(!document.documentElement.classList.contains('dark')));

const keys = {
  KeyF: () => $('fit').click(), KeyT: () => $('top').click(), KeyL: () => $('side').click(), KeyG: () => $('walk').click(),
  KeyN: () => comparison.step(1), KeyB: () => comparison.step(-1), KeyP: () => showPanel($('panel').hidden), KeyM: () => choose('measure'), KeyV: () => choose('sight'), Escape: () => choose('query'),
  Backspace: removeMark, KeyX: () => choose('section'), KeyZ: () => $('back').click(), KeyK: () => $('play').click(),
};
window.addEventListener('keydown', (event) => {
  if (event.ctrlKey || event.metaKey || event.altKey || $('keys').open || event.target.matches?.('select')) return;
  // The question mark is on other keys of other keyboards.
  if (event.key === '?') {
    $('help').click();
    return;
  }
  if (event.target.matches?.('input[type=number]')) return;
  const zoom = { '+': 0.8, '=': 0.8, '-': 1.25 }[event.key];
  if (zoom && !event.target.matches?.('input')) viewer.flight.zoom(zoom);
  const digit = /^Digit([1-9])$/.exec(event.code);
  if (digit && $('colour').options[digit[1] - 1]) {
    $('colour').selectedIndex = Number(digit[1]) - 1;
    colour();
  } else keys[event.code]?.();
});

viewer.listeners.push(() => {
  const isRead = app.maps.every((map) => map.pending_tiles === 0 && map.generation > 0);
  const isReady = viewer.settled && viewer.layers.length > 0 && isRead && !viewer.layers.some(isBehind);
  if ($('state').textContent !== 'disconnected') $('state').textContent = isReady ? 'ready' : 'loading';
  if (viewer.layers[0]?.scale && !viewer.scaled) {
    viewer.scaled = true;
    paint();
  }
});
viewer.flight.orbit.addEventListener('change', remember);
viewer.flight.orbit.addEventListener('change', followCamera);

theme(scheme.matches);
$('obstacle-swatch').style.background = `rgb(${OBSTACLE})`;
$('moving-swatch').style.background = `rgb(${MOVING})`;
