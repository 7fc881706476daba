// A slice of the distances to obstacles.

import { app, viewer } from './app.js';
import { cut } from './cut.js';
import { coloursOf, readDistances } from './distances.js';
import { $, metres, say, tell } from './dom.js';
import { idOf } from './maps.js';

// Request in progress.
let distancesRequest = null;
let distancesTimer = 0;
// Voxels that the camera may move before distances around another place are loaded; the layer has 1024.
const DISTANCES_STEP = 256;

// Height of the layer whose distances are shown: that of the center of a voxel.
export function layerHeight() {
  const { low, high, resolution_m: edge } = app.maps[0];
  return (Math.floor((low + (high - low) * $('layer').value / 1000) / edge + 1e-6) + 0.5) * edge;
}

// Loads the distances of the first map around the point that the camera looks at. A newer request cancels an older one.
export async function loadDistances() {
  clearTimeout(distancesTimer);
  distancesRequest?.abort();
  distancesRequest = null;
  const isOn = $('distances').checked;
  $('distances-more').hidden = !isOn;
  if (!isOn || !app.maps[0]) {
    app.distances = null;
    viewer.overlays.set('distances', null);
    $('distances-out').value = '';
    viewer.wake();
    return;
  }
  const [id, cap, z] = [idOf(app.maps[0]).split('~')[0], Number($('cap').value), layerHeight()];
  const around = [...viewer.toMap(viewer.flight.orbit.target.toArray()).slice(0, 2), z];
  tell('layer', metres(z));
  $('cap-out').textContent = `${cap} m or more`;
  $('distances-out').value = 'loading';
  const request = new AbortController();
  distancesRequest = request;
  try {
    const read = await readDistances(`maps/${id}/distances.bin?at=${around}&cap=${cap}`, request.signal);
    app.distances = { ...read, around };
    paintDistances();
    $('distances-out').value = read.values.some(Boolean) ? '' : 'unknown here';
  } catch (error) {
    if (request.signal.aborted) return;
    app.distances = null;
    viewer.overlays.set('distances', null);
    $('distances-out').value = 'not loaded';
    say(`Cannot load the distances: ${error.message}`);
  }
  distancesRequest = null;
  viewer.wake();
}

// Draws the distances on top of the voxels of their layer.
export function paintDistances() {
  if (!app.distances) return;
  const { corner, size, edge, values, around } = app.distances;
  viewer.overlays.image('distances', [...corner.slice(0, 2), around[2] + 0.52 * edge], size, edge, coloursOf(values));
  viewer.wake();
}

function loadDistancesSoon() {
  if (!$('distances').checked) return;
  tell('layer', metres(layerHeight()));
  clearTimeout(distancesTimer);
  distancesTimer = setTimeout(loadDistances, 200);
}

// Loads other distances when the camera looks at a place far from those that are shown.
export function followCamera() {
  if (!app.distances || distancesRequest) return;
  const target = viewer.toMap(viewer.flight.orbit.target.toArray());
  const away = Math.max(...[0, 1].map((k) => Math.abs(target[k] - app.distances.around[k])));
  if (away > DISTANCES_STEP * app.maps[0].resolution_m) loadDistancesSoon();
}

for (const id of ['distances', 'cap']) {
  $(id).addEventListener('change', () => {
    cut();
    loadDistances();
  });
}
$('layer').addEventListener('input', () => {
  cut();
  loadDistancesSoon();
});
