// Starts the page.

import { app } from './app.js';
import { applyOverviews, loadOverviews } from './cut.js';
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

// Maximum time that the first view waits for the ceiling, so that a large map is shown at once.
const OVERVIEW_MS = 1000;

async function run() {
  chooseOption('compared', app.link.compared);
  await readMaps();
  // The link chooses the states to read.
  applyLink();
  // The first view is across the trajectory, and hides the ceiling: it needs both.
  const path = readPath();
  const extents = readExtents();
  const overviews = loadOverviews();
  await extents;
  await path;
  // The server reads some tiles to find the ceiling. Several maps are shown with their ceilings.
  if (app.maps.length === 1) {
    await Promise.race([overviews, new Promise((resolve) => { setTimeout(resolve, OVERVIEW_MS); })]);
  }
  start();
  showMaps();
  applyOverviews();
  if (app.maps.every((map) => map.tiles === 0)) say('This map is empty.');
  follow();
}

run().catch((error) => {
  $('state').textContent = 'failed';
  if (location.protocol === 'file:') say('Browsers do not load maps from files. Serve this folder, for instance with: python3 -m http.server');
  else say(`Cannot load the map: ${error.message}`);
});
