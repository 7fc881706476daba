// Colours of the voxels, their range and legend.

import { app, comparison, viewer } from './app.js';
import { paintDistances } from './distance_slice.js';
import { $, json, metres, say, swatchOf, tell } from './dom.js';
import { BY_LAYER, className, endsOf, joined, NO_VALUE } from './layers.js';
import { RETRY_MS } from './live.js';
import { allBounds, ceiling, heightsOf } from './maps.js';
import { logOddsOf, observationsOf, probabilityOf } from './node.js';
import { centerOf } from './pick.js';
import { CHANGES, chooseColours, drawLegend } from './palette.js';
import { Reference } from './reference.js';
import { percentiles } from './survey.js';
import { remember } from './view_link.js';

// Ends of the colours that the user chose, by what is coloured.
const chosen = new Map();
// Heights above which colours show heights, when they are shown.
let reference = null;
// Numbers of voxels whose heights above the ground give the range of the colours.
const PLACES_OF_NODE = 100;
const MAX_PLACES = 20000;
// Names of legends.
const LEGENDS = {
  height: 'Height', above: 'Height above the trajectory', probability: 'Probability of being occupied', count: 'Observations',
  scan: 'Number of the last scan of the tile', rgb: 'Mean colour of the points', intensity: 'Mean intensity of the points',
  class: 'Most frequent class, with its number of voxels', age: 'Last hit by a point',
};

// Returns the joined legend of the chosen layer, of all maps that have it; `null` if it cannot be loaded.
export async function legendOf(shown) {
  const name = BY_LAYER[$('colour').value];
  const ids = shown.filter(({ map, id }) => map.layers?.includes(name) && !id.includes('~')).map(({ id }) => id);
  try {
    return joined(await Promise.all(ids.map(async (id) => (await json(`maps/${id}/layers.json`))[name])));
  } catch (error) {
    say(`Cannot load the legend: ${error.message}`);
    return null;
  }
}

// Loads the legend of the chosen layer, and then the voxels in its colours, except of layers that the caller refreshes.
export async function loadLegend(refreshed = []) {
  const number = ++app.legendNumber;
  if (!BY_LAYER[$('colour').value]) {
    app.legend = null;
    app.legendShown = number;
    return;
  }
  const found = await legendOf(viewer.layers);
  if (number !== app.legendNumber) return;
  if (!found) {
    setTimeout(() => { if (number === app.legendNumber) loadLegend(); }, RETRY_MS);
    return;
  }
  app.legend = found;
  for (const layer of viewer.layers) {
    if (refreshed.includes(layer)) layer.legend = app.legend;
    else layer.paintBy(app.legend);
  }
  app.legendShown = number;
  paint();
}

function paintLegend(range) {
  const choice = $('colour').value;
  const isClass = choice === 'class';
  const rows = (isClass ? app.legend?.classes ?? [] : []).map((one) => {
    const [row, text, count] = ['li', 'span', 'span'].map((tag) => document.createElement(tag));
    [text.textContent, count.textContent] = [className(one), one.voxels.toLocaleString('en')];
    row.append(swatchOf(one.color), text, count);
    return row;
  });
  if (BY_LAYER[choice]) {
    const row = document.createElement('li');
    row.append(swatchOf(NO_VALUE), choice === 'rgb' ? 'no colour' : 'no value');
    rows.push(row);
  }
  $('legend-classes').replaceChildren(...rows);
  $('legend-classes').hidden = rows.length === 0;
  return endsOf(choice, app.legend && { ...app.legend, range: app.legend.range && range });
}

// Heights of all voxels, and of most: from the 2nd to the 98th percentile.
function heightScale() {
  const of = (least, end, from) => least(...app.maps.map((map) => from(map)?.[end]).filter(Number.isFinite));
  const both = (from) => [of(Math.min, 0, from), of(Math.max, 1, from)];
  const domain = both((map) => [map.low, map.high]);
  const range = both(heightsOf);
  return { domain, range: [Math.max(range[0], domain[0]), Math.min(range[1], domain[1], ceiling() ?? Infinity)] };
}

// Heights above the trajectory or ground, of all voxels and of most. Nodes that were loaded later refine the ground.
function aboveOf() {
  const bounds = allBounds();
  const key = JSON.stringify([bounds, app.path.length, app.path.at(-1)]);
  const isNew = reference?.key !== key;
  if (isNew) reference = { key, added: new WeakSet(), places: [], grid: new Reference(bounds, app.path, Math.min(...app.maps.map((map) => map.resolution_m))) };
  const { grid, added, places } = reference;
  const nodes = viewer.layers.filter((layer) => layer.isDrawn).flatMap((layer) => layer.meshes().map(([mesh]) => mesh.userData.node)).filter((node) => !added.has(node));
  if (isNew || (nodes.length && (places.length === 0 || !grid.isOfTrajectory))) {
    for (const node of nodes) {
      if (!grid.isOfTrajectory) grid.add(node);
      added.add(node);
      const step = Math.ceil(node.count / PLACES_OF_NODE);
      for (let k = 0; k < node.count && places.length < MAX_PLACES; k += step) places.push(centerOf({ node, at: [node.x[k], node.y[k], node.z[k]] }));
    }
    grid.fill();
    const surveys = app.maps.map((map) => map.survey).filter(Boolean);
    const coarse = places.length ? [] : surveys.flatMap(({ along }) => Array.from(along[2], (z, k) => [along[0][k], along[1][k], z]));
    const values = [...places, ...coarse].map((at) => grid.above(at));
    const range = percentiles(values) ?? [0, 1];
    reference.domain = [values.reduce((a, b) => Math.min(a, b), range[0]), values.reduce((a, b) => Math.max(a, b), range[1])];
    reference.range = grid.isOfTrajectory ? range : [Math.max(range[0], 0), range[1]];
    viewer.refer(grid);
  }
  return { range: reference.range, domain: reference.domain };
}

// Returns the possible values of what is coloured, the range of the colours, and the texts of its ends.
function colourScale() {
  const scale = viewer.layers[0]?.scale ?? { least: 0, most: 3.5 };
  const scans = [0, Math.max(...app.maps.map((map) => map.scans ?? 1), 1)];
  const counts = app.maps.map((map) => map.survey?.counts).filter(Boolean);
  const [low, high] = app.legend?.range ?? [0, 1];
  const scales = {
    height: { ...heightScale(), texts: (range) => range.map(metres) },
    above: { ...(viewer.colour === 'above' ? aboveOf() : {}), texts: (range) => range.map(metres) },
    probability: { domain: [0, 255], texts: (range) => range.map((value) => probabilityOf(logOddsOf(scale, value)).toFixed(2)) },
    count: {
      domain: [0, 128],
      range: counts.length ? [Math.min(...counts.map((pair) => pair[0])), Math.max(...counts.map((pair) => pair[1]))] : [0, 128],
      texts: (range) => range.map((value, k) => `${observationsOf(value)}${k ? '+' : ''}`),
    },
    scan: { domain: scans, texts: (range) => range.map((value) => String(Math.max(Math.round(value), 1))) },
    intensity: { domain: [Math.max(2 * low - high, Math.min(low, 0)), 2 * high - low], range: [low, high] },
    age: { domain: [low, high] },
  };
  const found = scales[viewer.colour] ?? { domain: [0, 1] };
  return { ...found, range: chosen.get(viewer.colour) ?? found.range ?? found.domain };
}

function chooseRange(isHigh) {
  const { domain, range } = colourScale();
  const at = ['range-low', 'range-high'].map((id) => domain[0] + (domain[1] - domain[0]) * $(id).value / 1000);
  const least = (domain[1] - domain[0]) / 1000;
  chosen.set(viewer.colour, isHigh ? [range[0], Math.max(at[1], range[0] + least)] : [Math.min(at[0], range[1] - least), range[1]]);
  paint();
}

export function paint() {
  viewer.colour = $('colour').value;
  viewer.threshold = Number($('threshold').value);
  const scale = viewer.layers[0]?.scale ?? { least: 0, most: 3.5 };
  tell('threshold', probabilityOf(logOddsOf(scale, viewer.threshold)).toFixed(3));
  const isChange = viewer.layers.some(({ id }) => id.includes('~'));
  $('colours').hidden = comparison.isShown;
  const { domain, range, texts } = colourScale();
  viewer.range = range;
  viewer.heights = viewer.colour === 'height' ? range : heightScale().range;
  const wide = Math.max(domain[1] - domain[0], 1e-9);
  const shares = range.map((value) => (value - domain[0]) / wide);
  ['range-low', 'range-high'].forEach((id, k) => { $(id).value = Math.round(1000 * shares[k]); });
  drawLegend($('legend'), ...shares);
  $('legend-name').textContent = isChange ? 'Changes' : LEGENDS[viewer.colour];
  if (viewer.colour === 'above' && !reference.grid.isOfTrajectory) $('legend-name').textContent = 'Height above the ground';
  $('ramp-choice').hidden = isChange || ['rgb', 'class'].includes(viewer.colour);
  const ends = BY_LAYER[viewer.colour] ? paintLegend(range) : texts(range);
  ['range-low', 'range-high'].forEach((id, k) => $(id).setAttribute('aria-valuetext', ends[k] ?? ''));
  if (isChange || !BY_LAYER[viewer.colour]) $('legend-classes').hidden = true;
  $('legend').hidden = isChange || ['rgb', 'class'].includes(viewer.colour) || (BY_LAYER[viewer.colour] && ends.length === 0);
  if (comparison.isShown) {
    $('legend-ends').replaceChildren();
  } else if (isChange) {
    const names = ['appeared', 'vanished', 'unchanged'].map((name, k) => {
      const span = document.createElement('span');
      span.append(swatchOf(CHANGES[k]), name);
      return span;
    });
    $('legend-ends').replaceChildren(...names);
  } else {
    $('legend-ends').replaceChildren(...ends.map((text) => Object.assign(document.createElement('span'), { textContent: text })));
  }
  viewer.wake();
  remember();
}

export function colour() {
  paint();
  loadLegend();
}

// Sets the colours of values by the name of a colour map; unknown names are the first one.
export function chooseRamp(name) {
  if (!app.colourMaps.length) return;
  const map = app.colourMaps.find((one) => one.name === name) ?? app.colourMaps[0];
  $('ramp').value = map.name;
  $('ramp').title = `For ${map.purpose}`;
  chooseColours(map);
  drawLegend($('distances-legend'));
  paintDistances();
}

$('ramp').addEventListener('change', () => {
  chooseRamp($('ramp').value);
  paint();
});
$('colour').addEventListener('change', colour);
$('threshold').addEventListener('input', paint);
// The ground is known better with finer voxels.
viewer.listeners.push(() => {
  if (!viewer.settled || viewer.colour !== 'above') return;
  const before = reference?.range;
  if (aboveOf().range !== before) paint();
});
for (const id of ['range-low', 'range-high']) $(id).addEventListener('input', () => chooseRange(id === 'range-high'));
