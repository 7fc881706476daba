// Points on moving objects.

import { app, viewer } from './app.js';
import { $, say } from './dom.js';
import { idOf } from './maps.js';
import { pointMaterial } from './material.js';
import { readMoving } from './moving.js';

// Number of the last request.
let movingNumber = 0;

// Loads the marked points of the first map if they are shown; after a flush only if the marks have changed.
export async function loadMoving() {
  const number = ++movingNumber;
  viewer.overlays.show('moving', $('moving').checked);
  viewer.wake();
  if (!$('moving').checked) {
    if (!app.moving) $('moving-out').value = '';
    return;
  }
  const id = idOf(app.maps[0]).split('~')[0];
  if (app.moving?.id !== id) {
    app.moving = null;
    viewer.overlays.set('moving', null);
    $('moving-out').value = 'loading';
  }
  let read;
  try {
    read = await readMoving(`maps/${id}/moving.bin`, app.moving?.version ?? null);
  } catch (error) {
    if (number !== movingNumber) return;
    if (!app.moving) $('moving-out').value = 'not loaded';
    say(`Cannot load the moving points: ${error.message}`);
    return;
  }
  // Ignore the response to an older request.
  if (number !== movingNumber) return;
  if (app.moving?.version !== read.version) {
    app.moving = { ...read, id };
    viewer.overlays.points('moving', read.origin, read.offsets, pointMaterial(0.5 * app.maps[0].resolution_m, viewer.shared));
  }
  const [count, all] = [app.moving.count, app.moving.all].map((k) => k.toLocaleString('en'));
  $('moving-out').value = !app.moving.keepsScans ? 'no kept scans' : app.moving.all === 0 ? 'none marked' : count === all ? all : `${count} of ${all}`;
  viewer.overlays.show('moving', $('moving').checked);
  viewer.wake();
}

$('moving').addEventListener('change', loadMoving);
