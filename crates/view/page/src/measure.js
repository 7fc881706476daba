// Measurements between clicked voxels.

import { app, viewer } from './app.js';
import { $, json, metres, place, say } from './dom.js';
import { answer } from './query.js';

let marks = [];

export async function mark(layer, center) {
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
  if (app.tool === 'sight') {
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

export function choose(name) {
  if (name === 'sight' && app.finest !== null) {
    say('Lines of sight need `voxtile view`.');
    return;
  }
  app.tool = name;
  marks = [];
  for (const one of ['query', 'measure', 'sight']) $(`tool-${one}`).setAttribute('aria-pressed', String(one === name));
  viewer.overlays.set('measure', null);
  viewer.overlays.set('voxel', null);
  answer([]);
  $('copy').hidden = true;
  viewer.wake();
}

for (const one of ['query', 'measure', 'sight']) $(`tool-${one}`).addEventListener('click', () => choose(one));
$('card-close').addEventListener('click', () => choose(app.tool));
