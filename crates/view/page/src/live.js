// Follows changes of the maps.

import { app, viewer } from './app.js';
import { loadLegend } from './colours.js';
import { loadOverviews } from './cut.js';
import { loadDistances } from './distance_slice.js';
import { $, say } from './dom.js';
import { readExtents, readMaps, showMaps, states } from './maps.js';
import { loadMoving } from './moving_points.js';
import { readPath } from './trajectory.js';
import { isAtStart, start } from './views.js';

export const RETRY_MS = 1000;
// Latest generation of each map, as reported by the server. A restarted server counts from 0 again.
const latest = new Map();
let lastServer = null;
let events = null;
let isChanging = false;

export const isBehind = (layer) => latest.has(layer.map.id) && layer.generation !== latest.get(layer.map.id);
const record = (id, generation) => { if (generation > 0) latest.set(id, Math.max(generation, latest.get(id) ?? 0)); };

// Loads one change at a time, because each load reads the state of all maps.
export async function catchUp() {
  if (isChanging || !viewer.layers.some(isBehind)) return;
  isChanging = true;
  try {
    await change();
  } catch (error) {
    say(`Cannot load the change: ${error.message}`);
  }
  isChanging = false;
  // The update failed, or there are newer changes.
  if (viewer.layers.some(isBehind)) setTimeout(catchUp, RETRY_MS);
}

async function change() {
  const before = app.maps;
  await readMaps();
  await readExtents().catch(() => {});
  for (const { id, generation } of app.maps) record(id, generation);
  const behind = viewer.layers.filter(isBehind);
  for (const layer of viewer.layers) layer.map = app.maps.find(({ id }) => id === layer.map.id) ?? layer.map;
  await loadLegend(behind);
  if (states().map(({ id }) => id).join() !== viewer.layers.map(({ id }) => id).join()) {
    // A shown snapshot was deleted.
    showMaps();
  } else {
    for (const layer of behind) {
      // A snapshot never changes, but another server may have one with this name.
      if (!layer.id.includes('@') || layer.generation === null) layer.refresh();
      layer.generation = layer.map.generation;
    }
  }
  const changed = before.filter((was) => app.maps.some(({ id, generation }) => id === was.id && generation !== was.generation));
  // While the map is read for the first time, its box grows.
  if (changed.some(({ generation, low, high, pending_tiles: pending }) => generation === 0 || low === high || (pending > 0 && isAtStart()))) start();
  // While the map is read for the first time, its new generations are not flushes.
  if (changed.some((was) => was.pending_tiles === 0 && was.generation > 0)) {
    $('live').hidden = false;
    $('live').title = `flush ${Math.max(...app.maps.map(({ generation }) => generation))}`;
  }
  loadOverviews();
  readPath();
  loadMoving();
  loadDistances();
}

// A hidden page closes its connection, because a browser has only six for all pages of a server. It receives missed
// changes when it reconnects.
export function follow() {
  events?.close();
  events = null;
  if (document.hidden || app.finest !== null) return;
  events = new EventSource('events');
  events.addEventListener('open', () => {
    if ($('state').textContent !== 'disconnected') return;
    $('state').textContent = 'loading';
    viewer.wake();
  });
  events.addEventListener('error', () => { $('state').textContent = 'disconnected'; });
  events.addEventListener('changed', ({ data }) => {
    const { map: id, generation, server } = JSON.parse(data);
    if (lastServer !== null && lastServer !== server) {
      latest.clear();
      for (const layer of viewer.layers) layer.generation = null;
    }
    lastServer = server;
    record(id, generation);
    catchUp();
  });
}
document.addEventListener('visibilitychange', () => {
  // Do not connect before the maps are shown.
  if (viewer.layers.length > 0) follow();
});
