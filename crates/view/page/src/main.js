// Controls of the page.

import { Comparison } from './comparison.js';
import { coloursOf, readDistances } from './distances.js';
import { BY_LAYER, NO_VALUE, className, endsOf, joined, timeText } from './layers.js';
import { Ground } from './ground.js';
import { readLink, writeLink } from './link.js';
import { logOddsOf, observationsOf, probabilityOf } from './node.js';
import { pointMaterial } from './material.js';
import { readMoving } from './moving.js';
import { CHANGES, LAYERS, MOVING, OBSTACLE, drawLegend } from './palette.js';
import { centerOf, pick } from './pick.js';
import { Swipe, sidesOf } from './swipe.js';
import { ceilingOf, obliqueOf, survey } from './survey.js';
import { Viewer } from './viewer.js';

const $ = (id) => document.getElementById(id);
const json = async (url) => {
  const response = await fetch(url);
  const answer = await response.json();
  if (!response.ok) throw new Error(answer.error ?? `HTTP status ${response.status}`);
  return answer;
};
const metres = (k) => `${k.toFixed(Math.abs(k) < 1000 ? 2 : 1)} m`;
const place = (point) => point.map((k) => k.toFixed(3)).join('  ');

let messageTimer = 0;
function say(text) {
  $('message').textContent = text;
  $('message').hidden = !text;
  clearTimeout(messageTimer);
  if (text) messageTimer = setTimeout(() => say(''), 12000);
}

let viewer;
try {
  viewer = new Viewer($('scene'), say);
} catch (error) {
  $('state').textContent = 'no WebGL';
  say(`Cannot draw 3D in this browser: ${error.message}`);
  throw error;
}
const swatchOf = (colour) => {
  const swatch = document.createElement('span');
  swatch.className = 'swatch';
  swatch.style.background = `rgb(${colour})`;
  return swatch;
};
const comparison = new Comparison({ viewer, json, say, swatchOf });
const swipe = new Swipe(viewer, remember);
const ground = new Ground(viewer);
let link = readLink();
let maps = [];
let tool = 'query';
let marks = [];
let answered = null;
// Place of the last click on the screen.
let clickedAt = [0, 0];
// Earlier views, and when the last one was left.
const views = [];
let leftAt = 0;
let playTimer = 0;
// Ends of the colours that the user chose, by what is coloured.
const chosen = new Map();
// Legend of the layer by which voxels are coloured, and the number of the last request for it.
let legend = null;
let legendNumber = 0;
let legendShown = 0;
// Number of the last choice of states to show.
let shownNumber = 0;
let path = [];
let showsCeiling = false;
let pathNumber = 0;
// Marked points of the first map that were loaded last, and the number of the last request for them.
let moving = null;
let movingNumber = 0;
// Distances that are shown, and the request in progress.
let distances = null;
let distancesRequest = null;
let distancesTimer = 0;
// Voxels that the camera may move before distances around another place are loaded; the layer has 1024.
const DISTANCES_STEP = 256;
const COLOURS = [['height', 'height'], ['probability', 'probability'], ['count', 'observations'], ['scan', "tile's last scan"],
  ['rgb', 'colour'], ['intensity', 'intensity'], ['class', 'class'], ['age', 'last hit']];
// Sliders of the cut, and their positions without a cut.
const CUTS = ['x0', 'x1', 'y0', 'y1', 'z0', 'z1'];
const MOST_VIEWS = 50;
const OPEN = ['0', '1000', '0', '1000', '0', '1000'];

// The page lists the snapshots of the first map. A map without a snapshot of the chosen name is shown in its current
// state.
const idOf = (map) => {
  if (comparison.isShown) return comparison.id;
  const [at, since] = ['snapshot', 'since'].map((id) => $(id).value)
    .map((chosen) => map.snapshots.some(({ name }) => name === chosen) && chosen);
  return map.id + (at ? `@${at}` : '') + (since ? `~${since}` : '');
};

const isSwiped = () => maps.length === 1 && $('since').value !== '' && $('swiped').checked;

// Returns the states to show, with their sides in a swipe.
function states() {
  if (!isSwiped()) {
    return maps.map((map) => ({ map, id: map.label ? map.id : idOf(map), side: map.side, label: map.label }));
  }
  const [map, at, since] = [maps[0], $('snapshot').value, $('since').value];
  const later = { map, id: idOf(map).split('~')[0], name: at || 'current' };
  return sidesOf(later, { map, id: `${map.id}@${since}`, name: since });
}

function answer(rows) {
  $('answer').replaceChildren(...rows.flatMap(([name, value]) => {
    const [dt, dd] = [document.createElement('dt'), document.createElement('dd')];
    dt.textContent = name;
    dd.append(value);
    return [dt, dd];
  }));
  $('card').hidden = rows.length === 0;
  if (!rows.length) return;
  // The card is next to the click, within the picture.
  const { left, top, width, height } = $('scene').getBoundingClientRect();
  const within = (at, size, low, space) => Math.max(Math.min(at > low + space - size - 16 ? at - size - 14 : at + 14, low + space - size - 8), low + 8);
  const { offsetWidth, offsetHeight } = $('card');
  $('card').style.left = `${within(clickedAt[0], offsetWidth, left, width)}px`;
  $('card').style.top = `${within(clickedAt[1], offsetHeight, top, height)}px`;
}

// --- Maps

function describe() {
  const map = maps[0];
  const name = map.label ? comparison.name : maps.map((one) => one.name).join(', ');
  document.title = `${map.label ? name : map.name} - voxtile`;
  $('name').textContent = name;
  $('layers').replaceChildren(...(maps.length > 1 && !map.label ? maps : []).map((one, k) => {
    const label = document.createElement('label');
    const box = Object.assign(document.createElement('input'), { type: 'checkbox', checked: viewer.layers[k]?.isShown ?? true });
    box.addEventListener('change', () => {
      viewer.layers[k].isShown = box.checked;
      viewer.wake();
    });
    label.append(box, ' ', swatchOf(LAYERS[k % LAYERS.length]), one.name);
    return label;
  }));
  for (const [id, first] of [['snapshot', 'current'], ['since', 'none']]) {
    const chosen = $(id).value;
    $(id).replaceChildren(new Option(first, ''), ...map.snapshots.map(({ name }) => new Option(name, name)));
    $(id).value = map.snapshots.some(({ name }) => name === chosen) ? chosen : '';
  }
  // A map has the same layers from its creation on.
  if ($('colour').options.length === 0) {
    const has = ([value]) => !BY_LAYER[value] || maps.some(({ layers }) => layers?.includes(BY_LAYER[value]));
    $('colour').replaceChildren(...COLOURS.filter(has).map(([value, text]) => new Option(text, value)));
  }
  const tiles = map.tiles.toLocaleString('en');
  const lost = map.unreadable?.length ? `, ${map.unreadable.length} damaged` : '';
  const rest = map.pending_tiles ? `; reading the map: ${map.pending_tiles.toLocaleString('en')} tiles left` : '';
  $('facts').textContent = `${tiles} tiles${lost} of ${map.tile_size_m} m, voxels of ${map.resolution_m} m${map.scans ? `, ${map.scans.toLocaleString('en')} ${map.scans === 1 ? 'scan' : 'scans'}` : ''}${rest}`;
}

async function readMaps() {
  maps = comparison.mapsOf(await json('maps.json'));
  for (const map of maps) [map.low, map.high] = map.bounds ? [map.bounds.min[2], map.bounds.max[2]] : [0, 1];
  describe();
}

function allBounds() {
  const known = maps.map((map) => map.bounds).filter(Boolean);
  if (known.length === 0) return { min: [-1, -1, -1], max: [1, 1, 1] };
  const end = (name, least) => [0, 1, 2].map((k) => least(...known.map((bounds) => bounds[name][k])));
  return { min: end('min', Math.min), max: end('max', Math.max) };
}

// Reads the occupied extent from the tileset's root, for colours, cuts and the first view. Compared maps have a common
// one, so that equal colours are equal heights.
async function readExtents() {
  await Promise.all(maps.map(async (map) => {
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
async function readCompared() {
  await readMaps();
  await readExtents().catch(() => {});
  surround();
}

// Returns the box of most voxels of all maps, and some of them.
function mostOf() {
  const known = maps.map((map) => map.survey).filter(Boolean);
  if (known.length === 0) return [allBounds(), []];
  const end = (name, least) => [0, 1, 2].map((k) => least(...known.map(({ core }) => core[name][k])));
  const cutAt = ceiling();
  const points = known.flatMap((one) => one.points).filter((point) => cutAt === null || point[2] < cutAt);
  return [{ min: end('min', Math.min), max: end('max', Math.max) }, points];
}

function surround() {
  viewer.surround(allBounds(), ...mostOf());
  const heights = maps.map((map) => map.survey?.heights?.[0] ?? map.low);
  ground.height = Math.min(...heights);
  ground.name(maps[0]?.crs);
}

// Returns the height above which the ceiling is hidden; `null` for maps without one, and if it is shown.
function ceiling() {
  const one = maps.length === 1 && !showsCeiling && !comparison.info ? maps[0].survey : null;
  if (one && one.path !== path) [one.path, one.ceiling] = [path, ceilingOf(one, path)];
  const at = one?.ceiling ?? null;
  $('ceiling').hidden = at === null;
  return at;
}

async function showMaps() {
  const number = ++shownNumber;
  const shown = states();
  $('swiped-choice').hidden = maps.length > 1 || $('since').value === '';
  viewer.colour = $('colour').value;
  const found = BY_LAYER[viewer.colour] ? await legendOf(shown) : null;
  // Another state was chosen in the meantime.
  if (number !== shownNumber) return;
  legend = found;
  viewer.scaled = false;
  swipe.show(shown);
  viewer.show(shown, legend);
  viewer.layers.forEach((layer, k) => { layer.isShown = $('layers').querySelectorAll('input')[k]?.checked ?? true; });
  paint();
  if (!legend) loadLegend();
  readPath();
  loadMoving();
  loadDistances();
  // Flushes in the meantime.
  catchUp();
}

async function readPath() {
  const number = ++pathNumber;
  let points = [];
  try {
    ({ points } = await json(`maps/${idOf(maps[0]).split('~')[0]}/trajectory.json`));
  } catch (error) {
    say(`Cannot load the trajectory: ${error.message}`);
  }
  // Ignore the response to an older request.
  if (number !== pathNumber) return;
  path = points;
  $('scan').max = Math.max(path.length - 1, 0);
  $('scan').value = $('scan').max;
  $('scan').disabled = path.length < 2;
  viewer.overlays.path('path', path, 0xff3b6b);
  showScan();
}

function showScan() {
  const at = path[Number($('scan').value)];
  const on = $('path').checked;
  viewer.overlays.show('path', on);
  $('scan-out').value = path.length ? `${Number($('scan').value) + 1} of ${path.length}` : 'none';
  const size = 1.2 * (maps[0]?.resolution_m ?? 0.1);
  if (at && on) viewer.overlays.dot('sensor', at, Math.max(2 * size, 0.1), 0xff3b6b);
  else viewer.overlays.set('sensor', null);
  viewer.wake();
}

// Loads the marked points of the first map if they are shown; after a flush only if the marks have changed.
async function loadMoving() {
  const number = ++movingNumber;
  viewer.overlays.show('moving', $('moving').checked);
  viewer.wake();
  if (!$('moving').checked) {
    if (!moving) $('moving-out').value = '';
    return;
  }
  const id = idOf(maps[0]).split('~')[0];
  if (moving?.id !== id) {
    moving = null;
    viewer.overlays.set('moving', null);
    $('moving-out').value = 'loading';
  }
  let read;
  try {
    read = await readMoving(`maps/${id}/moving.bin`, moving?.version ?? null);
  } catch (error) {
    if (number !== movingNumber) return;
    if (!moving) $('moving-out').value = 'not loaded';
    say(`Cannot load the moving points: ${error.message}`);
    return;
  }
  // Ignore the response to an older request.
  if (number !== movingNumber) return;
  if (moving?.version !== read.version) {
    moving = { ...read, id };
    viewer.overlays.points('moving', read.origin, read.offsets, pointMaterial(0.5 * maps[0].resolution_m, viewer.shared));
  }
  const [count, all] = [moving.count, moving.all].map((k) => k.toLocaleString('en'));
  $('moving-out').value = !moving.keepsScans ? 'no kept scans' : moving.all === 0 ? 'none marked' : count === all ? all : `${count} of ${all}`;
  viewer.overlays.show('moving', $('moving').checked);
  viewer.wake();
}

// Height of the layer whose distances are shown: that of the center of a voxel.
function layerHeight() {
  const { low, high, resolution_m: edge } = maps[0];
  return (Math.floor((low + (high - low) * $('layer').value / 1000) / edge + 1e-6) + 0.5) * edge;
}

// Loads the distances of the first map around the point that the camera looks at. A newer request cancels an older one.
async function loadDistances() {
  clearTimeout(distancesTimer);
  distancesRequest?.abort();
  distancesRequest = null;
  const isOn = $('distances').checked;
  $('distances-more').hidden = !isOn;
  if (!isOn || !maps[0]) {
    distances = null;
    viewer.overlays.set('distances', null);
    $('distances-out').value = '';
    viewer.wake();
    return;
  }
  const [id, cap, z] = [idOf(maps[0]).split('~')[0], Number($('cap').value), layerHeight()];
  const around = [...viewer.toMap(viewer.flight.orbit.target.toArray()).slice(0, 2), z];
  $('layer-out').value = metres(z);
  $('cap-out').textContent = `${cap} m or more`;
  $('distances-out').value = 'loading';
  const request = new AbortController();
  distancesRequest = request;
  try {
    const read = await readDistances(`maps/${id}/distances.bin?at=${around}&cap=${cap}`, request.signal);
    distances = { ...read, around };
    // On top of the voxels of the layer.
    const low = [...read.corner.slice(0, 2), z + 0.52 * read.edge];
    viewer.overlays.image('distances', low, read.size, read.edge, coloursOf(read.values));
    $('distances-out').value = read.values.some(Boolean) ? '' : 'unknown here';
  } catch (error) {
    if (request.signal.aborted) return;
    distances = null;
    viewer.overlays.set('distances', null);
    $('distances-out').value = 'not loaded';
    say(`Cannot load the distances: ${error.message}`);
  }
  distancesRequest = null;
  viewer.wake();
}

function loadDistancesSoon() {
  if (!$('distances').checked) return;
  $('layer-out').value = metres(layerHeight());
  clearTimeout(distancesTimer);
  distancesTimer = setTimeout(loadDistances, 200);
}

// Loads other distances when the camera looks at a place far from those that are shown.
function followCamera() {
  if (!distances || distancesRequest) return;
  const target = viewer.toMap(viewer.flight.orbit.target.toArray());
  const away = Math.max(...[0, 1].map((k) => Math.abs(target[k] - distances.around[k])));
  if (away > DISTANCES_STEP * maps[0].resolution_m) loadDistancesSoon();
}

// --- Colours and cuts

// Returns the joined legend of the chosen layer, of all maps that have it; `null` if it cannot be loaded.
async function legendOf(shown) {
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
async function loadLegend(refreshed = []) {
  const number = ++legendNumber;
  if (!BY_LAYER[$('colour').value]) {
    legend = null;
    legendShown = number;
    return;
  }
  const found = await legendOf(viewer.layers);
  if (number !== legendNumber) return;
  if (!found) {
    setTimeout(() => { if (number === legendNumber) loadLegend(); }, RETRY_MS);
    return;
  }
  legend = found;
  for (const layer of viewer.layers) {
    if (refreshed.includes(layer)) layer.legend = legend;
    else layer.paintBy(legend);
  }
  legendShown = number;
  paint();
}

function paintLegend(range) {
  const choice = $('colour').value;
  const isClass = choice === 'class';
  const rows = (isClass ? legend?.classes ?? [] : []).map((one) => {
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
  return endsOf(choice, legend && { ...legend, range: legend.range && range });
}

// Heights of all voxels, and of most: from the 2nd to the 98th percentile.
function heightsOf() {
  const of = (least, end, from) => least(...maps.map((map) => from(map)?.[end]).filter(Number.isFinite));
  const both = (from) => [of(Math.min, 0, from), of(Math.max, 1, from)];
  const domain = both((map) => [map.low, map.high]);
  const range = both((map) => map.survey?.heights ?? [map.low, map.high]);
  return { domain, range: [Math.max(range[0], domain[0]), Math.min(range[1], domain[1], ceiling() ?? Infinity)] };
}

// Returns the possible values of what is coloured, the range of the colours, and the texts of its ends.
function colourScale() {
  const scale = viewer.layers[0]?.scale ?? { least: 0, most: 3.5 };
  const scans = [0, Math.max(...maps.map((map) => map.scans ?? 1), 1)];
  const counts = maps.map((map) => map.survey?.counts).filter(Boolean);
  const [low, high] = legend?.range ?? [0, 1];
  const scales = {
    height: { ...heightsOf(), texts: (range) => range.map(metres) },
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

function paint() {
  viewer.colour = $('colour').value;
  viewer.threshold = Number($('threshold').value);
  const scale = viewer.layers[0]?.scale ?? { least: 0, most: 3.5 };
  $('threshold-out').value = probabilityOf(logOddsOf(scale, viewer.threshold)).toFixed(3);
  const isChange = viewer.layers.some(({ id }) => id.includes('~'));
  $('colours').hidden = comparison.isShown;
  const { domain, range, texts } = colourScale();
  viewer.range = range;
  viewer.heights = viewer.colour === 'height' ? range : heightsOf().range;
  const wide = Math.max(domain[1] - domain[0], 1e-9);
  const shares = range.map((value) => (value - domain[0]) / wide);
  ['range-low', 'range-high'].forEach((id, k) => { $(id).value = Math.round(1000 * shares[k]); });
  drawLegend($('legend'), ...shares);
  const ends = BY_LAYER[viewer.colour] ? paintLegend(range) : texts(range);
  if (isChange || !BY_LAYER[viewer.colour]) $('legend-classes').hidden = true;
  $('legend').hidden = isChange || ['rgb', 'class'].includes(viewer.colour);
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

function cut() {
  const bounds = allBounds();
  const low = Math.min(...maps.map((map) => map.low));
  const high = Math.max(...maps.map((map) => map.high));
  const ends = [[bounds.min[0], bounds.max[0]], [bounds.min[1], bounds.max[1]], [low, high]];
  ['x', 'y', 'z'].forEach((axis, k) => {
    for (const [end, side] of [['0', 'low'], ['1', 'high']]) {
      const input = $(axis + end);
      const at = ends[k][0] + (ends[k][1] - ends[k][0]) * input.value / 1000;
      const isOpen = end === '0' ? input.value === '0' : input.value === '1000';
      viewer.cut[side][k] = isOpen ? (end === '0' ? -Infinity : Infinity) : at;
      $(`${axis}${end}-out`).value = isOpen ? 'all' : metres(at);
    }
  });
  viewer.cut.high[2] = Math.min(viewer.cut.high[2], ceiling() ?? Infinity);
  // Voxels above the distances would hide them.
  if ($('distances').checked) viewer.cut.high[2] = Math.min(viewer.cut.high[2], layerHeight() + 0.25 * maps[0].resolution_m);
  viewer.wake();
  remember();
}

// --- Queries

async function click(x, y) {
  const found = pick(viewer, x, y);
  if (!found) {
    answer([['', 'no voxel here']]);
    return null;
  }
  const center = centerOf(found);
  const { node, at, layer } = found;
  const low = at.map((k, axis) => node.corner[axis] + k * node.edge);
  viewer.overlays.box('voxel', low, low.map((k) => k + node.edge), 0xff3b6b);
  viewer.wake();
  return tool === 'query' ? ask(layer, node, center) : mark(layer, center);
}

async function ask(layer, node, center) {
  const isCoarse = node.edge > 1.5 * layer.map.resolution_m;
  try {
    const result = await json(`maps/${layer.id.split('~')[0]}/query?x=${center[0]}&y=${center[1]}&z=${center[2]}`);
    answered = { ...result, isCoarse };
    const number = (k, digits) => (k === null ? 'unknown' : k.toFixed(digits));
    const before = comparison.isShown ? await json(`maps/${comparison.info.before}/query?x=${center[0]}&y=${center[1]}&z=${center[2]}`) : null;
    answer([
      ...(layer.label ? [['map', layer.label]] : []),
      ['at', place(center)],
      ...(before ? [['before', `${before.state}, probability ${number(before.probability, 4)}`], ['after', '']] : []),
      ...(isCoarse ? [['voxel', `of ${metres(node.edge)} (zoom in for single voxels)`]] : []),
      ['state', result.state],
      ['probability', number(result.probability, 4)],
      ['log-odds', number(result.log_odds, 4)],
      ['observations', result.observation_count === null ? 'none' : `${result.observation_count}`],
      ['tile', result.tile?.join(' ') ?? 'none'],
      ...await layerRows(layer, result.layers),
    ]);
    $('copy').hidden = false;
    return answered;
  } catch (error) {
    say(`The request failed: ${error.message}`);
    return null;
  }
}

// Rows on the layers of a voxel.
async function layerRows(layer, found) {
  if (!found) return [];
  const of = async (name) => (await json(`maps/${layer.id.split('~')[0]}/layers.json`).catch(() => ({})))[name];
  const rows = [['hits', String(found.points)]];
  if (found.colour) {
    const value = document.createElement('span');
    value.append(swatchOf(found.colour), found.colour.join(' '));
    rows.push(['colour', value]);
  }
  if (found.intensity !== undefined) rows.push(['intensity', `${found.intensity.toFixed(1)} ± ${found.intensity_deviation.toFixed(1)}`]);
  const classes = Object.entries(found.classes ?? {});
  if (classes.length) {
    const known = (await of('class'))?.classes ?? [];
    const nameOf = (number) => className(known.find((one) => one.class === Number(number)) ?? { class: number });
    for (const [number, votes] of classes.sort((a, b) => b[1] - a[1])) rows.push(['class', `${nameOf(number)}: ${votes}`]);
  }
  if (found.last_ns !== undefined) {
    const legend = joined([await of('time')].filter(Boolean));
    for (const [name, ns] of [['first hit', found.first_ns], ['last hit', found.last_ns]]) rows.push([name, timeText(ns * 1e-9, legend)]);
  }
  return rows;
}

async function mark(layer, center) {
  if (marks.length === 2) marks = [];
  marks.push(center);
  viewer.overlays.path('measure', marks.length === 2 ? marks : [], 0xffb000);
  if (marks.length < 2) {
    answer([['from', place(center)], ['to', 'click the second point']]);
    return marks;
  }
  const [from, to] = marks;
  const way = to.map((k, axis) => k - from[axis]);
  const rows = [['from', place(from)], ['to', place(to)], ['distance', metres(Math.hypot(...way))], ['dx dy dz', place(way)]];
  let result = null;
  if (tool === 'sight') {
    try {
      result = await json(`maps/${layer.id.split('~')[0]}/raycast?from=${from}&to=${to}`);
      rows.push(['line of sight', result.visible ? 'free' : `blocked at ${metres(result.hit.distance_m)}`]);
      if (result.unknown_from_m !== null) rows.push(['unknown', `from ${metres(result.unknown_from_m)} on`]);
      viewer.overlays.path('measure', result.visible ? marks : [from, result.hit.center_m], result.visible ? 0x2fbf71 : 0xe5484d);
    } catch (error) {
      say(`The request failed: ${error.message}`);
    }
  }
  answer(rows);
  viewer.wake();
  return { marks, ...result };
}

function choose(name) {
  tool = name;
  marks = [];
  for (const one of ['query', 'measure', 'sight']) $(`tool-${one}`).setAttribute('aria-pressed', String(one === name));
  viewer.overlays.set('measure', null);
  viewer.overlays.set('voxel', null);
  answer([]);
  $('copy').hidden = true;
  viewer.wake();
}

// --- The link

function remember() {
  writeLink(() => ({
    eye: viewer.toMap(viewer.camera.position.toArray()),
    to: viewer.toMap(viewer.flight.orbit.target.toArray()),
    colour: $('colour').value === 'height' ? null : $('colour').value,
    threshold: viewer.threshold || null,
    at: $('snapshot').value,
    since: $('since').value,
    cut: CUTS.some((id, k) => $(id).value !== OPEN[k]) ? CUTS.map((id) => Number($(id).value)) : null,
    distances: $('distances').checked ? [Number($('layer').value), Number($('cap').value)] : null,
    compared: comparison.choice,
    line: viewer.isSplit ? [viewer.share] : null,
  }));
}

function chooseOption(id, value) {
  const select = $(id);
  select.value = [...select.options].some((option) => option.value === value) ? value : select.options[0].value;
}

// Sets the controls from a link; unknown colours, snapshots and numbers are ignored.
function applyLink() {
  chooseOption('colour', link.colour);
  chooseOption('snapshot', link.at ?? '');
  chooseOption('since', link.since ?? '');
  $('swiped').checked = link.line !== null;
  swipe.move(link.line?.[0] ?? 0.5);
  $('threshold').value = link.threshold ?? 0;
  CUTS.forEach((id, k) => { $(id).value = link.cut?.[k] ?? OPEN[k]; });
  $('distances').checked = link.distances !== null;
  if (link.distances) {
    $('layer').value = link.distances[0];
    $('cap').value = link.distances[1];
    if (!$('cap').value) $('cap').value = '2';
  }
}

window.addEventListener('hashchange', async () => {
  link = readLink();
  if (comparison.info) {
    chooseOption('compared', link.compared);
    await readCompared();
  }
  applyLink();
  start();
  showMaps();
  cut();
});

// --- Live

const RETRY_MS = 1000;
// Latest generation of each map, as reported by the server. A restarted server counts from 0 again.
const latest = new Map();
let lastServer = null;
let events = null;
let isChanging = false;

const isBehind = (layer) => latest.has(layer.map.id) && layer.generation !== latest.get(layer.map.id);
const record = (id, generation) => { if (generation > 0) latest.set(id, Math.max(generation, latest.get(id) ?? 0)); };

// Loads one change at a time, because each load reads the state of all maps.
async function catchUp() {
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
  const before = maps;
  await readMaps();
  await readExtents().catch(() => {});
  for (const { id, generation } of maps) record(id, generation);
  const behind = viewer.layers.filter(isBehind);
  for (const layer of viewer.layers) layer.map = maps.find(({ id }) => id === layer.map.id) ?? layer.map;
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
  const changed = before.filter((was) => maps.some(({ id, generation }) => id === was.id && generation !== was.generation));
  if (changed.some(({ generation, low, high }) => generation === 0 || low === high)) start();
  else surround();
  // While the map is read for the first time, its new generations are not flushes.
  if (changed.some((was) => was.pending_tiles === 0 && was.generation > 0)) {
    $('live').hidden = false;
    $('live').title = `flush ${Math.max(...maps.map(({ generation }) => generation))}`;
  }
  cut();
  paint();
  readPath();
  loadMoving();
  loadDistances();
}

// A hidden page closes its connection, because a browser has only six for all pages of a server. It receives missed
// changes when it reconnects.
function follow() {
  events?.close();
  events = null;
  if (document.hidden) return;
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

function start() {
  viewer.center(allBounds());
  surround();
  if (link.eye && link.to) viewer.flight.lookAt(viewer.toScene(link.eye), viewer.toScene(link.to));
  else viewer.frameMost(oblique());
}

const oblique = () => obliqueOf(mostOf()[1], path);

// --- Controls

function colour() {
  paint();
  loadLegend();
}

$('colour').addEventListener('change', colour);
$('threshold').addEventListener('input', paint);
for (const id of CUTS) $(id).addEventListener('input', cut);
$('uncut').addEventListener('click', () => {
  CUTS.forEach((id, k) => { $(id).value = OPEN[k]; });
  cut();
});
for (const kind of ['occupied', 'free', 'unknown']) {
  $(kind).addEventListener('change', () => {
    viewer.shows[kind] = $(kind).checked;
    viewer.wake();
  });
}
$('path').addEventListener('change', showScan);
$('moving').addEventListener('change', loadMoving);
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
$('bounds').addEventListener('change', () => {
  const { min, max } = allBounds();
  if ($('bounds').checked) viewer.overlays.box('bounds', min, max, 0x7d8594);
  else viewer.overlays.set('bounds', null);
  viewer.wake();
});
$('scan').addEventListener('input', showScan);
$('ground').addEventListener('change', () => ground.show($('ground').checked));
$('ceiling').addEventListener('click', () => {
  showsCeiling = true;
  surround();
  cut();
  paint();
});
for (const id of ['range-low', 'range-high']) $(id).addEventListener('input', () => chooseRange(id === 'range-high'));
$('grid').addEventListener('change', () => {
  if ($('grid').checked) viewer.overlays.tiles('grid', { ...allBounds(), min: [...allBounds().min.slice(0, 2), maps[0].low] }, maps[0].tile_size_m, 0x7d8594);
  else viewer.overlays.set('grid', null);
  viewer.wake();
});
for (const id of ['snapshot', 'since', 'swiped']) $(id).addEventListener('change', showMaps);
$('compared').addEventListener('change', async () => {
  await readCompared();
  showMaps();
  cut();
});
for (const one of ['query', 'measure', 'sight']) $(`tool-${one}`).addEventListener('click', () => choose(one));
$('copy').addEventListener('click', () => navigator.clipboard?.writeText(answered.voxel_center_m.join(' ')).catch((error) => say(error.message)));
$('fit').addEventListener('click', () => keepView() || viewer.frameMost(oblique()));
$('top').addEventListener('click', () => keepView() || viewer.frameMost([0, -0.001, 1]));
$('side').addEventListener('click', () => keepView() || viewer.frameMost([0, -1, 0.05]));
$('walk').addEventListener('click', () => {
  viewer.flight.walk(!viewer.flight.walks);
  $('walk').setAttribute('aria-pressed', String(viewer.flight.walks));
  $('scene').focus();
});
$('shot').addEventListener('click', () => {
  viewer.draw();
  viewer.canvas.toBlob((blob) => {
    const a = Object.assign(document.createElement('a'), { href: URL.createObjectURL(blob), download: `${maps[0]?.name ?? 'map'}.png` });
    a.click();
    setTimeout(() => URL.revokeObjectURL(a.href), 1000);
  });
});
// Remembers the present view for `Back`. The steps of a wheel are one change.
function keepView() {
  const now = performance.now();
  if (now - leftAt > 500) views.push([viewer.camera.position, viewer.flight.orbit.target].map((at) => viewer.toMap(at.toArray())));
  leftAt = now;
  if (views.length > MOST_VIEWS) views.shift();
  $('back').disabled = false;
}

$('back').addEventListener('click', () => {
  const view = views.pop();
  $('back').disabled = views.length === 0;
  leftAt = 0;
  if (view) viewer.flight.lookAt(...view.map((at) => viewer.toScene(at)));
});
$('card-close').addEventListener('click', () => choose(tool));

// Moves the sensor along the trajectory in ten seconds or more.
function play(isOn) {
  clearInterval(playTimer);
  playTimer = 0;
  $('play').setAttribute('aria-pressed', String(isOn));
  if (!isOn) return;
  const last = Number($('scan').max);
  if (Number($('scan').value) === last) $('scan').value = 0;
  const step = Math.max(Math.round(last / 100), 1);
  playTimer = setInterval(() => {
    $('scan').value = Math.min(Number($('scan').value) + step, last);
    showScan();
    if (Number($('scan').value) >= last) play(false);
  }, 100);
}
$('play').addEventListener('click', () => play(!playTimer));

// Copies the command that crops the map to the cut.
$('crop').addEventListener('click', () => {
  const bounds = allBounds();
  const end = (side, name) => viewer.cut[side].map((k, axis) => +(Number.isFinite(k) ? k : bounds[name][axis]).toFixed(3));
  const text = `voxtile crop ${maps[0].name} -o ${maps[0].name}_part --region ${end('low', 'min').join(' ')} ${end('high', 'max').join(' ')}`;
  navigator.clipboard?.writeText(text).catch(() => {});
  say(text);
});
$('help').addEventListener('click', () => $('keys').showModal());
$('menu').addEventListener('click', () => showPanel($('panel').hidden));
function showPanel(on) {
  $('panel').hidden = !on;
  $('menu').setAttribute('aria-expanded', String(on));
}

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
  Slash: () => $('help').click(), KeyZ: () => $('back').click(), KeyK: () => $('play').click(),
};
window.addEventListener('keydown', (event) => {
  if (event.ctrlKey || event.metaKey || event.altKey || $('keys').open || event.target.matches?.('select')) return;
  const digit = /^Digit([1-8])$/.exec(event.code);
  if (digit && $('colour').options[digit[1] - 1]) {
    $('colour').selectedIndex = Number(digit[1]) - 1;
    colour();
  } else keys[event.code]?.();
});

// A click is a press that does not move.
let pressed = null;
$('scene').addEventListener('pointerdown', (event) => { pressed = [event.clientX, event.clientY]; });
$('scene').addEventListener('pointerup', (event) => {
  const moved = pressed && Math.hypot(event.clientX - pressed[0], event.clientY - pressed[1]);
  if (pressed && moved < 5 && event.button === 0) clickAt(event.clientX, event.clientY);
  pressed = null;
});

function clickAt(x, y) {
  clickedAt = [x, y];
  const { left, top, width, height } = $('scene').getBoundingClientRect();
  return click(2 * (x - left) / width - 1, 1 - 2 * (y - top) / height);
}

viewer.listeners.push(() => {
  const isRead = maps.every((map) => map.pending_tiles === 0 && map.generation > 0);
  const isReady = viewer.settled && viewer.layers.length > 0 && isRead && !viewer.layers.some(isBehind);
  if ($('state').textContent !== 'disconnected') $('state').textContent = isReady ? 'ready' : 'loading';
  if (viewer.layers[0]?.scale && !viewer.scaled) {
    viewer.scaled = true;
    paint();
  }
});
viewer.flight.orbit.addEventListener('start', keepView);
viewer.flight.orbit.addEventListener('change', remember);
viewer.flight.orbit.addEventListener('change', followCamera);

// For tests and the console.
window.voxtile = {
  voxels() {
    const meshes = viewer.layers.flatMap((layer) => layer.meshes().map(([mesh]) => [layer, mesh.userData.node]));
    const centers = [];
    for (const [layer, node] of meshes) {
      for (let i = 0; i < node.count; i++) {
        const at = [node.x[i], node.y[i], node.z[i]];
        if (viewer.isSeen(layer, node, i, at)) centers.push(centerOf({ node, at }));
      }
    }
    return { count: centers.length, centers, edges: [...new Set(meshes.map(([, node]) => node.edge))] };
  },
  near: () => viewer.layers.flatMap((layer) => layer.near.children).reduce((sum, { userData }) => {
    const kind = ['occupied', 'free', 'unknown'][userData.node.kind];
    return { ...sum, [kind]: (sum[kind] ?? 0) + userData.node.count };
  }, {}),
  faces: () => viewer.layers.flatMap((layer) => layer.meshes()).reduce((sum, [mesh]) => sum + mesh.userData.faces, 0),
  // Choice of colours that all drawn nodes of maps with its layer have.
  painted() {
    const name = BY_LAYER[viewer.colour] ?? null;
    const nodes = viewer.layers.filter((layer) => layer.layerName).flatMap((layer) => layer.meshes().map(([mesh]) => mesh.userData.node));
    return nodes.every((node) => !name || node.values?.name === name) && legendNumber === legendShown ? viewer.colour : null;
  },
  drawCalls: () => viewer.renderer.info.render.calls,
  mostDrawCalls: () => viewer.mostCalls,
  bytes: () => viewer.layers.reduce((sum, layer) => sum + layer.bytes, 0),
  moving() {
    const { offsets, origin } = moving;
    return Array.from({ length: moving.count }, (_, k) => origin.map((at, axis) => at + offsets[3 * k + axis]));
  },
  distances: () => distances && { ...distances, values: [...distances.values] },
  clickAt,
  draw: () => viewer.draw(),
  screenOf(point) {
    const at = viewer.camera.position.clone().set(...viewer.toScene(point)).project(viewer.camera);
    const { left, top, width, height } = $('scene').getBoundingClientRect();
    return [left + (at.x + 1) * width / 2, top + (1 - at.y) * height / 2];
  },
  camera: () => ({ eye: viewer.toMap(viewer.camera.position.toArray()), to: viewer.toMap(viewer.flight.orbit.target.toArray()) }),
  lookAt: (eye, to) => viewer.flight.lookAt(viewer.toScene(eye), viewer.toScene(to)),
  setThreshold(value) {
    $('threshold').value = value;
    paint();
  },
  set detail(pixels) {
    for (const layer of viewer.layers) layer.tiles.errorTarget = pixels;
    viewer.wake();
  },
  get firstPictureMs() { return viewer.firstPictureMs; },
  get shown() { return viewer.layers.map(({ id }) => id); },
  get generation() { return maps.map((map) => map.generation); },
};

theme(scheme.matches);
drawLegend($('legend'));
drawLegend($('distances-legend'));
$('obstacle-swatch').style.background = `rgb(${OBSTACLE})`;
$('moving-swatch').style.background = `rgb(${MOVING})`;
if (matchMedia('(max-width: 700px)').matches) showPanel(false);
try {
  chooseOption('compared', link.compared);
  await readMaps();
  // The first view is one of the trajectory.
  const first = readPath();
  await readExtents();
  applyLink();
  await first;
  start();
  showMaps();
  cut();
  if (maps.every((map) => map.tiles === 0)) say('This map is empty.');
  follow();
} catch (error) {
  $('state').textContent = 'failed';
  say(`Cannot load the map: ${error.message}`);
}
