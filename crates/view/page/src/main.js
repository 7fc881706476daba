// Starts the page.

import { app } from './app.js';
import { applyOverviews } from './cut.js';
import { $, chooseOption, say } from './dom.js';
import { follow } from './live.js';
import { readExtents, readMaps, readOverviews, showMaps } from './maps.js';
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

// Maximum time to wait for ceilings, so that a large map is shown at once.
const OVERVIEW_MS = 1000;

async function run() {
  chooseOption('compared', app.link.compared);
  await readMaps();
  // The first view is one of the trajectory, without a ceiling.
  const path = readPath();
  const overviews = readOverviews();
  await readExtents();
  applyLink();
  await path;
  // The server has to read some tiles for it.
  await Promise.race([overviews, new Promise((resolve) => { setTimeout(resolve, OVERVIEW_MS); })]);
  start();
  showMaps();
  applyOverviews(overviews);
  if (app.maps.every((map) => map.tiles === 0)) say('This map is empty.');
  follow();
}

run().catch((error) => {
  $('state').textContent = 'failed';
  if (location.protocol === 'file:') say('Browsers do not load maps from files. Serve this folder, for instance with: python3 -m http.server');
  else say(`Cannot load the map: ${error.message}`);
});
