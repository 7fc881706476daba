// Cuts along the axes.

import { app, comparison, viewer } from './app.js';
import { drawBox } from './box.js';
import { paint } from './colours.js';
import { layerHeight } from './distance_slice.js';
import { $, metres, say, tell } from './dom.js';
import { allBounds, ceiling, readOverviews, surround } from './maps.js';
import { drawSection } from './section.js';
import { remember } from './view_link.js';

// Sliders of the cut, and their positions without a cut.
export const CUTS = ['x0', 'x1', 'y0', 'y1', 'z0', 'z1'];
export const OPEN = ['0', '1000', '0', '1000', '0', '1000'];

// Ends of the cut that the sliders have: without the ceiling, and without the height of the distances.
const sliders = { low: [-Infinity, -Infinity, -Infinity], high: [Infinity, Infinity, Infinity] };

// Returns the ends of the sliders along each axis, in metres.
export function endsOfCut() {
  const bounds = allBounds();
  const low = Math.min(...app.maps.map((map) => map.low));
  const high = Math.max(...app.maps.map((map) => map.high));
  return [[bounds.min[0], bounds.max[0]], [bounds.min[1], bounds.max[1]], [low, high]];
}

// Moves one end of the cut along an axis to a place in metres.
export function moveCut(axis, end, at) {
  const [low, high] = endsOfCut()[axis];
  const ids = [CUTS[2 * axis], CUTS[2 * axis + 1]];
  const share = Math.min(Math.max(1000 * (at - low) / Math.max(high - low, 1e-9), 0), 1000);
  // The box keeps a thickness.
  $(ids[end]).value = end ? Math.max(share, Number($(ids[0]).value) + 1) : Math.min(share, Number($(ids[1]).value) - 1);
  cut();
}

// Quotes a text as one word of a shell.
const quoted = (text) => `'${text.replaceAll("'", "'\\''")}'`;

// Returns the command that crops the map to the sliders' box.
function command() {
  const bounds = allBounds();
  const end = (side, name) => sliders[side].map((k, axis) => +(Number.isFinite(k) ? k : bounds[name][axis]).toFixed(3));
  const { name } = app.maps[0];
  return `voxtile crop ${quoted(name)} -o ${quoted(`${name}_part`)} --region ${end('low', 'min').join(' ')} ${end('high', 'max').join(' ')}`;
}

export function cut() {
  const ends = endsOfCut();
  ['x', 'y', 'z'].forEach((axis, k) => {
    for (const [end, side] of [['0', 'low'], ['1', 'high']]) {
      const input = $(axis + end);
      const at = ends[k][0] + (ends[k][1] - ends[k][0]) * input.value / 1000;
      const isOpen = end === '0' ? input.value === '0' : input.value === '1000';
      sliders[side][k] = isOpen ? (end === '0' ? -Infinity : Infinity) : at;
      tell(axis + end, isOpen ? 'all' : metres(at));
    }
  });
  viewer.cut.low = [...sliders.low];
  viewer.cut.high = [...sliders.high];
  viewer.cut.high[2] = Math.min(viewer.cut.high[2], ceiling() ?? Infinity);
  // Voxels above the distances would hide them.
  if ($('distances').checked) viewer.cut.high[2] = Math.min(viewer.cut.high[2], layerHeight() + 0.25 * app.maps[0].resolution_m);
  // The command crops one map.
  $('crop').hidden = $('crop-line').hidden = comparison.info !== null;
  $('crop-line').textContent = command();
  drawBox();
  drawSection();
  viewer.wake();
  remember();
}

// Applies the ceilings and the heights of what is shown, as far as they are read.
export function applyOverviews() {
  if (viewer.layers.length === 0) return;
  surround();
  cut();
  paint();
}

// Applies the ceilings and the heights of what is shown now, and again when they are read.
export function loadOverviews() {
  applyOverviews();
  return readOverviews(applyOverviews);
}

for (const id of CUTS) $(id).addEventListener('input', cut);
$('uncut').addEventListener('click', () => {
  CUTS.forEach((id, k) => { $(id).value = OPEN[k]; });
  cut();
});

// Copies the command that crops the map to the sliders' box.
$('crop').addEventListener('click', () => {
  const text = command();
  navigator.clipboard?.writeText(text).catch(() => {});
  say(text);
});
