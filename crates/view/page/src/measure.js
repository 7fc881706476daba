// Measurements between clicked voxels: lengths, heights, areas, lines of sight, sections.

import { app, viewer } from './app.js';
import { $, json, metres, place, say } from './dom.js';
import { answer } from './query.js';
import { showSection } from './section.js';

const TOOLS = ['query', 'measure', 'sight', 'section'];
// Lines of measurements.
const COLOUR = 0xffb000;

let marks = [];

const minus = (a, b) => a.map((k, axis) => k - b[axis]);
const square = (m2) => `${m2.toFixed(m2 < 1000 ? 2 : 0)} m²`;

export const lengthOf = (points) => points.slice(1).reduce((sum, at, k) => sum + Math.hypot(...minus(at, points[k])), 0);

// Returns the area of a polygon in space, and of its outline from above, in square metres.
export function areasOf(points) {
  const sum = [0, 0, 0];
  for (let k = 1; k + 1 < points.length; k++) {
    const [a, b] = [minus(points[k], points[0]), minus(points[k + 1], points[0])];
    sum[0] += a[1] * b[2] - a[2] * b[1];
    sum[1] += a[2] * b[0] - a[0] * b[2];
    sum[2] += a[0] * b[1] - a[1] * b[0];
  }
  return [0.5 * Math.hypot(...sum), 0.5 * Math.abs(sum[2])];
}

export async function mark(layer, center) {
  if (app.tool !== 'measure' && marks.length === 2) marks = [];
  marks.push(center);
  return app.tool === 'measure' ? measured() : pair(layer);
}

// Shows the length, the height difference and the area of the marked points.
function measured() {
  const [first, last] = [marks[0], marks.at(-1)];
  viewer.overlays.path('measure', marks.length > 2 ? [...marks, first] : marks, COLOUR);
  const rows = [['points', `${marks.length}`]];
  if (marks.length > 1) {
    const [dx, dy, dz] = minus(last, first);
    if (marks.length > 2) rows.push(['last part', metres(lengthOf(marks.slice(-2)))]);
    rows.push(['length', metres(lengthOf(marks))], ['height difference', metres(dz)], ['horizontal', metres(Math.hypot(dx, dy))]);
  } else {
    rows.push(['at', place(first)]);
  }
  if (marks.length > 2) {
    const [area, outline] = areasOf(marks);
    rows.push(['area', square(area)], ['from above', square(outline)]);
  }
  answer([...rows, ['', marks.length > 2 ? 'Backspace removes a point' : 'click the next point']]);
  viewer.wake();
  return { marks };
}

async function pair(layer) {
  if (marks.length < 2) {
    viewer.overlays.set('measure', null);
    answer([['from', place(marks[0])], ['to', 'click the second point']]);
    return marks;
  }
  const [from, to] = marks;
  if (app.tool === 'section') {
    answer([]);
    showSection(from, to);
    return { marks };
  }
  viewer.overlays.path('measure', marks, COLOUR);
  const rows = [['from', place(from)], ['to', place(to)], ['distance', metres(lengthOf(marks))]];
  let result = null;
  try {
    result = await json(`maps/${layer.id.split('~')[0]}/raycast?from=${from}&to=${to}`);
    rows.push(['line of sight', result.visible ? 'free' : `blocked at ${metres(result.hit.distance_m)}`]);
    if (result.unknown_from_m !== null) rows.push(['unknown', `from ${metres(result.unknown_from_m)} on`]);
    viewer.overlays.path('measure', result.visible ? marks : [from, result.hit.center_m], result.visible ? 0x2fbf71 : 0xe5484d);
  } catch (error) {
    say(`The request failed: ${error.message}`);
  }
  answer(rows);
  viewer.wake();
  return { marks, ...result };
}

// Removes the last point of a measurement.
export function removeMark() {
  if (app.tool !== 'measure' || marks.length < 2) return;
  marks.pop();
  measured();
}

export function choose(name) {
  if (name === 'sight' && app.finest !== null) {
    say('Lines of sight need `voxtile view`.');
    return;
  }
  app.tool = name;
  marks = [];
  for (const one of TOOLS) $(`tool-${one}`).setAttribute('aria-pressed', String(one === name));
  viewer.overlays.set('measure', null);
  viewer.overlays.set('voxel', null);
  showSection(null);
  answer([]);
  $('copy').hidden = true;
  viewer.wake();
}

for (const one of TOOLS) $(`tool-${one}`).addEventListener('click', () => choose(one));
$('card-close').addEventListener('click', () => choose(app.tool));
