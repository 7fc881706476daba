// A section of the map along a line: the voxels of a vertical strip, from the side.

import { app, viewer } from './app.js';
import { $, metres } from './dom.js';
import { lengthText, roundLength } from './ground.js';
import { colourAt } from './palette.js';

// Margins of the plot for its scales, and the distance of their ticks, in CSS pixels.
const MARGIN = { left: 52, right: 12, top: 10, bottom: 28 };
const TICK_PX = 70;

let line = null;
let shown = null;

// Shows the section along a line between two points; none without points.
export function showSection(from, to) {
  line = from && { from, to };
  $('section').hidden = !line;
  if (!line) {
    shown = null;
    viewer.overlays.set('section', null);
    viewer.wake();
    return;
  }
  const edge = app.maps[0].resolution_m;
  if (!$('section-width').value) $('section-width').value = Number(Math.max(4 * edge, 0.5).toPrecision(2));
  drawSection();
}

// Returns the voxels that are drawn within the strip: distance along the line, height, and edge in metres.
function voxelsOf({ from, to }, width) {
  const way = [to[0] - from[0], to[1] - from[1]];
  const length = Math.hypot(...way);
  const [dx, dy] = length > 0 ? way.map((k) => k / length) : [1, 0];
  const found = [];
  for (const layer of viewer.layers.filter((one) => one.isDrawn)) {
    for (const [mesh] of layer.meshes()) {
      const { node } = mesh.userData;
      const { x, y, z, corner, edge, count } = node;
      for (let i = 0; i < count; i++) {
        const [px, py] = [corner[0] + (x[i] + 0.5) * edge - from[0], corner[1] + (y[i] + 0.5) * edge - from[1]];
        const along = px * dx + py * dy;
        // Coarse voxels count if the strip touches them.
        if (along < -1e-6 * edge || along > length + 1e-6 * edge || Math.abs(py * dx - px * dy) > Math.max(0.5 * width, 0.5 * edge)) continue;
        if (viewer.isSeen(layer, node, i, [x[i], y[i], z[i]])) found.push([along, corner[2] + (z[i] + 0.5) * edge, edge]);
      }
    }
  }
  return { length, found };
}

function outline({ from, to }, width) {
  const way = [to[0] - from[0], to[1] - from[1]];
  const length = Math.max(Math.hypot(...way), 1e-9);
  const side = [-way[1], way[0]].map((k) => 0.5 * width * k / length);
  const at = (point, sign) => [point[0] + sign * side[0], point[1] + sign * side[1], point[2]];
  return [at(from, 1), at(to, 1), at(to, -1), at(from, -1), at(from, 1)];
}

export function drawSection() {
  if (!line) return;
  const width = Math.max(Number($('section-width').value) || 0, 0);
  const { length, found } = voxelsOf(line, width);
  viewer.overlays.path('section', outline(line, width), 0xffb000);
  const heights = found.map(([, z]) => z);
  const edge = found.reduce((most, voxel) => Math.max(most, voxel[2]), 0);
  const low = heights.reduce((a, b) => Math.min(a, b), Infinity) - edge / 2;
  const high = heights.reduce((a, b) => Math.max(a, b), -Infinity) + edge / 2;
  shown = { voxels: found.length, length_m: length, low_m: low, high_m: high };
  const text = found.length ? `${metres(length)} long, heights from ${metres(low)} to ${metres(high)}, ${found.length.toLocaleString('en')} voxels` : 'no voxels in the strip';
  $('section-text').textContent = text;
  const canvas = $('section-plot');
  const ratio = Math.min(devicePixelRatio, 2);
  // Equal scales along both axes; the plot is as high as it needs.
  const w = canvas.clientWidth;
  const most = Math.min(260, 0.32 * innerHeight) - MARGIN.top - MARGIN.bottom;
  const scale = found.length ? Math.min((w - MARGIN.left - MARGIN.right) / Math.max(length, 1e-9), most / (high - low)) : 0;
  const h = MARGIN.top + MARGIN.bottom + Math.max((high - low) * scale || 0, 24);
  canvas.style.height = `${h}px`;
  [canvas.width, canvas.height] = [w * ratio, h * ratio];
  const context = canvas.getContext('2d');
  context.scale(ratio, ratio);
  if (!found.length || !w) return;
  const atX = (along) => MARGIN.left + along * scale;
  const atY = (z) => h - MARGIN.bottom - (z - low) * scale;
  const { color: ink } = getComputedStyle(canvas);
  context.fillStyle = getComputedStyle(document.body).backgroundColor;
  context.fillRect(0, 0, w, h);
  const step = roundLength(1.5 * TICK_PX / scale);
  let stepUp = roundLength(Math.min(TICK_PX / scale, Math.max(high - low, 1e-6)));
  // Texts do not overlap.
  while (stepUp * scale < 16) stepUp *= 2;
  context.font = '11px system-ui, sans-serif';
  context.fillStyle = ink;
  context.strokeStyle = ink;
  context.globalAlpha = 0.25;
  context.beginPath();
  for (let along = 0; along <= length + 1e-9; along += step) {
    context.moveTo(atX(along), atY(low));
    context.lineTo(atX(along), atY(high));
  }
  for (let z = Math.ceil(low / stepUp) * stepUp; z <= high; z += stepUp) {
    context.moveTo(atX(0), atY(z));
    context.lineTo(atX(length), atY(z));
  }
  context.stroke();
  context.globalAlpha = 1;
  context.textAlign = 'center';
  for (let along = 0; along <= length + 1e-9; along += step) context.fillText(along === 0 ? '0' : lengthText(Number(along.toPrecision(6))), atX(along), h - 10);
  context.textAlign = 'right';
  for (let z = Math.ceil(low / stepUp) * stepUp; z <= high; z += stepUp) context.fillText(`${Number(z.toPrecision(6))} m`, MARGIN.left - 6, atY(z) + 4);
  const [from, to] = viewer.heights;
  for (const [along, z, own] of found) {
    context.fillStyle = `rgb(${colourAt((z - from) / Math.max(to - from, 1e-6))})`;
    const size = Math.max(own * scale, 1);
    context.fillRect(atX(along) - size / 2, atY(z) - size / 2, size, size);
  }
}

// Returns what the plot shows; for tests.
export const sectionShown = () => shown;

$('section-width').addEventListener('input', () => {
  drawSection();
  viewer.wake();
});
$('section-save').addEventListener('click', () => {
  const a = Object.assign(document.createElement('a'), { href: $('section-plot').toDataURL(), download: `${app.maps[0].name}_section.png` });
  a.click();
});
// Finer voxels may have been loaded.
viewer.listeners.push(() => { if (viewer.settled && line) drawSection(); });
