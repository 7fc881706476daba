// Maps and states that are shown.

import { app, comparison, ground, swipe, viewer } from './app.js';
import { legendOf, loadLegend, paint } from './colours.js';
import { loadDistances } from './distance_slice.js';
import { $, json, say, swatchOf } from './dom.js';
import { FIRST_RETRY_MS, LAST_RETRY_MS } from './layer.js';
import { BY_LAYER } from './layers.js';
import { catchUp } from './live.js';
import { loadMoving } from './moving_points.js';
import { LAYERS } from './palette.js';
import { survey } from './survey.js';
import { sidesOf } from './swipe.js';
import { readPath } from './trajectory.js';

// Number of the last choice of states to show.
let shownNumber = 0;
const COLOURS = [['height', 'height'], ['above', 'height above trajectory'], ['probability', 'probability'], ['count', 'observations'], ['scan', 'last scan of the tile'],
  ['rgb', 'colour'], ['intensity', 'intensity'], ['class', 'class'], ['age', 'last hit']];

// The page lists the snapshots of the first map. A map without a snapshot of the chosen name is shown in its current
// state.
export const idOf = (map) => {
  if (comparison.isShown) return comparison.id;
  const [at, since] = ['snapshot', 'since'].map((id) => $(id).value)
    .map((chosen) => map.snapshots.some(({ name }) => name === chosen) && chosen);
  return map.id + (at ? `@${at}` : '') + (since ? `~${since}` : '');
};

const isSwiped = () => app.maps.length === 1 && $('since').value !== '' && $('swiped').checked;

// Returns the states to show, with their sides in a swipe.
export function states() {
  if (!isSwiped()) {
    return app.maps.map((map) => ({ map, id: map.label ? map.id : idOf(map), side: map.side, label: map.label }));
  }
  const [map, at, since] = [app.maps[0], $('snapshot').value, $('since').value];
  const later = { map, id: idOf(map).split('~')[0], name: at || 'current' };
  return sidesOf(later, { map, id: `${map.id}@${since}`, name: since });
}

function describe() {
  const map = app.maps[0];
  const name = map.label ? comparison.name : app.maps.map((one) => one.name).join(', ');
  document.title = `${map.label ? name : map.name} - voxtile`;
  $('name').textContent = name;
  $('layers').replaceChildren(...(app.maps.length > 1 && !map.label ? app.maps : []).map((one, k) => {
    const label = document.createElement('label');
    const box = Object.assign(document.createElement('input'), { type: 'checkbox', checked: viewer.layers[k]?.isShown ?? true });
    box.addEventListener('change', () => {
      viewer.layers[k].isShown = box.checked;
      viewer.wake();
    });
    const opacity = Object.assign(document.createElement('input'), { type: 'range', min: 0, max: 1, step: 0.05, value: viewer.layers[k]?.opacity ?? 1 });
    opacity.setAttribute('aria-label', `Opacity of ${one.name}`);
    opacity.addEventListener('input', () => {
      viewer.layers[k].opacity = Number(opacity.value);
      viewer.wake();
    });
    label.append(box, swatchOf(LAYERS[k % LAYERS.length]), one.name, opacity);
    return label;
  }));
  for (const [id, first] of [['snapshot', 'current'], ['since', 'none']]) {
    const chosen = $(id).value;
    $(id).replaceChildren(new Option(first, ''), ...map.snapshots.map(({ name }) => new Option(name, name)));
    $(id).value = map.snapshots.some(({ name }) => name === chosen) ? chosen : '';
  }
  // A map has the same layers from its creation on.
  if ($('colour').options.length === 0) {
    const has = ([value]) => !BY_LAYER[value] || app.maps.some(({ layers }) => layers?.includes(BY_LAYER[value]));
    $('colour').replaceChildren(...COLOURS.filter(has).map(([value, text]) => new Option(text, value)));
  }
  const tiles = map.tiles.toLocaleString('en');
  const lost = map.unreadable?.length ? `, ${map.unreadable.length} damaged` : '';
  const rest = map.pending_tiles ? `; reading the map: ${map.pending_tiles.toLocaleString('en')} tiles left` : '';
  $('facts').textContent = `${tiles} tiles${lost} of ${map.tile_size_m} m, voxels of ${map.resolution_m} m${map.scans ? `, ${map.scans.toLocaleString('en')} ${map.scans === 1 ? 'scan' : 'scans'}` : ''}${rest}`;
}

export async function readMaps() {
  const listed = await json('maps.json');
  app.maps = comparison.mapsOf(listed);
  if (app.colourMaps.length === 0) {
    app.colourMaps = listed.color_maps;
    $('ramp').replaceChildren(...app.colourMaps.map(({ name }) => new Option(name, name)));
  }
  if (listed.exported && app.finest === null) {
    app.finest = listed.exported.finest_level;
    viewer.isExported = true;
    // These need the server.
    for (const id of ['free', 'unknown', 'distances', 'tool-sight', 'states']) $(id).closest('label, button, div').hidden = true;
    $('exported').hidden = false;
  }
  for (const map of app.maps) [map.low, map.high] = map.bounds ? [map.bounds.min[2], map.bounds.max[2]] : [0, 1];
  describe();
}

export function allBounds() {
  const known = app.maps.map((map) => map.bounds).filter(Boolean);
  if (known.length === 0) return { min: [-1, -1, -1], max: [1, 1, 1] };
  const end = (name, least) => [0, 1, 2].map((k) => least(...known.map((bounds) => bounds[name][k])));
  return { min: end('min', Math.min), max: end('max', Math.max) };
}

// Reads the occupied extent from the tileset's root, for colours, cuts and the first view. Compared maps have a common
// one, so that equal colours are equal heights.
export async function readExtents() {
  await Promise.all(app.maps.map(async (map) => {
    const url = `maps/${comparison.info ? comparison.id : map.id}/tileset.json`;
    const tileset = await json(url);
    const { root } = tileset;
    if (!root.children) return;
    map.survey = await survey(tileset, new URL(url, location.href)).catch(() => null);
    const box = root.boundingVolume.box;
    const half = [box[3], box[7], box[11]];
    map.bounds = { min: half.map((k, axis) => box[axis] - k), max: half.map((k, axis) => box[axis] + k) };
    [map.low, map.high] = [map.bounds.min[2], map.bounds.max[2]];
  }));
}

// Reads the maps to show after another choice of a comparison.
export async function readCompared() {
  await readMaps();
  await readExtents().catch(() => {});
  surround();
}

// Returns the box of most voxels of all maps, and some of them.
export function mostOf() {
  const known = app.maps.map((map) => map.survey).filter(Boolean);
  if (known.length === 0) return [allBounds(), []];
  const end = (name, least) => [0, 1, 2].map((k) => least(...known.map(({ core }) => core[name][k])));
  const cutAt = ceiling();
  const points = known.flatMap((one) => one.points).filter((point) => cutAt === null || point[2] < cutAt);
  return [{ min: end('min', Math.min), max: end('max', Math.max) }, points];
}

// Ceilings of rooms and heights of most voxels, by state, as they were read last; the states to read; and the time
// until failed requests are retried.
const overviews = new Map();
const unread = new Set();
let reading = null;
let retryTimer = 0;
let retryMs = FIRST_RETRY_MS;

const stateOf = (map) => idOf(map).split('~')[0];

// Returns the overview of the shown state of a map. Compared maps have none: those of each would give them different
// colours.
const overviewOf = (map) => (comparison.info ? undefined : overviews.get(stateOf(map)));

// Returns the heights of most voxels of a map.
export const heightsOf = (map) => overviewOf(map)?.heights_m ?? map.survey?.heights ?? [map.low, map.high];

// Reads the overviews of the shown states, and calls `apply` after each. The server computes one at a time, so that the
// others would only keep the browser's connections from loading voxels.
export function readOverviews(apply) {
  clearTimeout(retryTimer);
  const shown = comparison.info ? [] : app.maps.map(stateOf);
  for (const state of unread) if (!shown.includes(state)) unread.delete(state);
  for (const state of shown) unread.add(state);
  if (unread.size > 0) reading ??= readUnread(apply);
  return reading;
}

async function readUnread(apply) {
  let hasFailed = false;
  // States that are added in the meantime follow.
  for (const state of unread) {
    unread.delete(state);
    try {
      overviews.set(state, await json(`maps/${state}/overview.json`));
    } catch (error) {
      // A snapshot may have been deleted.
      if (!app.maps.some((map) => stateOf(map) === state)) continue;
      say(`Cannot load the ceiling and the range of heights: ${error.message}`);
      hasFailed = true;
      continue;
    }
    apply();
  }
  reading = null;
  clearTimeout(retryTimer);
  if (hasFailed) retryTimer = setTimeout(() => readOverviews(apply), retryMs);
  retryMs = hasFailed ? Math.min(2 * retryMs, LAST_RETRY_MS) : FIRST_RETRY_MS;
}

export function surround() {
  viewer.surround(allBounds(), ...mostOf());
  const heights = app.maps.map((map) => heightsOf(map)[0]);
  ground.height = Math.min(...heights);
  ground.name(app.maps[0]?.crs);
}

// Returns the height above which the ceiling is hidden; `null` for maps without one, and if it is shown.
export function ceiling() {
  const at = app.maps.length === 1 && !app.showsCeiling && !comparison.info ? overviewOf(app.maps[0])?.ceiling_m ?? null : null;
  $('ceiling').hidden = at === null;
  return at;
}

export async function showMaps() {
  const number = ++shownNumber;
  const shown = states();
  $('swiped-choice').hidden = app.maps.length > 1 || $('since').value === '';
  viewer.colour = $('colour').value;
  const found = BY_LAYER[viewer.colour] ? await legendOf(shown) : null;
  // Another state was chosen in the meantime.
  if (number !== shownNumber) return;
  app.legend = found;
  viewer.scaled = false;
  swipe.show(shown);
  viewer.show(shown, app.legend);
  viewer.layers.forEach((layer, k) => {
    const row = $('layers').children[k];
    layer.isShown = row?.querySelector('[type=checkbox]').checked ?? true;
    layer.opacity = Number(row?.querySelector('[type=range]').value ?? 1);
  });
  paint();
  if (!app.legend) loadLegend();
  readPath();
  loadMoving();
  loadDistances();
  // Flushes in the meantime.
  catchUp();
}
