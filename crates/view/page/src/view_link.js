// The view in the URL.

import { app, comparison, swipe, viewer } from './app.js';
import { chooseRamp } from './colours.js';
import { CUTS, loadOverviews, OPEN } from './cut.js';
import { $, chooseOption } from './dom.js';
import { readLink, writeLink } from './link.js';
import { readCompared, showMaps } from './maps.js';
import { start } from './views.js';

export function remember() {
  writeLink(() => ({
    eye: viewer.toMap(viewer.camera.position.toArray()),
    to: viewer.toMap(viewer.flight.orbit.target.toArray()),
    colour: $('colour').value === 'height' ? null : $('colour').value,
    ramp: $('ramp').selectedIndex > 0 ? $('ramp').value : null,
    threshold: viewer.threshold || null,
    at: $('snapshot').value,
    since: $('since').value,
    cut: CUTS.some((id, k) => $(id).value !== OPEN[k]) ? CUTS.map((id) => Number($(id).value)) : null,
    distances: $('distances').checked ? [Number($('layer').value), Number($('cap').value)] : null,
    compared: comparison.choice,
    line: viewer.isSplit ? [viewer.share] : null,
  }));
}

// Sets the controls from a link; unknown colours, snapshots and numbers are ignored.
export function applyLink() {
  chooseOption('colour', app.link.colour);
  chooseRamp(app.link.ramp);
  chooseOption('snapshot', app.link.at ?? '');
  chooseOption('since', app.link.since ?? '');
  $('swiped').checked = app.link.line !== null;
  swipe.move(app.link.line?.[0] ?? 0.5);
  $('threshold').value = app.link.threshold ?? 0;
  CUTS.forEach((id, k) => { $(id).value = app.link.cut?.[k] ?? OPEN[k]; });
  $('distances').checked = app.link.distances !== null && app.finest === null;
  if (app.link.distances) {
    $('layer').value = app.link.distances[0];
    $('cap').value = app.link.distances[1];
    if (!$('cap').value) $('cap').value = '2';
  }
}

window.addEventListener('hashchange', async () => {
  app.link = readLink();
  if (comparison.info) {
    chooseOption('compared', app.link.compared);
    await readCompared();
  }
  applyLink();
  start();
  showMaps();
  loadOverviews();
});

swipe.moved = remember;
