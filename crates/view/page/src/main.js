// Starts the page.

import { app } from './app.js';
import { cut } from './cut.js';
import { $, chooseOption, say } from './dom.js';
import { follow } from './live.js';
import { readExtents, readMaps, showMaps } from './maps.js';
import { readPath } from './trajectory.js';
import { applyLink } from './view_link.js';
import { start } from './views.js';
import './colours.js';
import './console.js';
import './controls.js';
import './distance_slice.js';
import './measure.js';
import './moving_points.js';
import './query.js';

async function run() {
  chooseOption('compared', app.link.compared);
  await readMaps();
  // The first view is one of the trajectory.
  const first = readPath();
  await readExtents();
  applyLink();
  await first;
  start();
  showMaps();
  cut();
  if (app.maps.every((map) => map.tiles === 0)) say('This map is empty.');
  follow();
}

run().catch((error) => {
  $('state').textContent = 'failed';
  if (location.protocol === 'file:') say('Browsers do not load maps from files. Serve this folder, for instance with: python3 -m http.server');
  else say(`Cannot load the map: ${error.message}`);
});
