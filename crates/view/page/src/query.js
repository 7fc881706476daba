// Clicks on voxels, and their answers.

import { app, comparison, viewer } from './app.js';
import { $, json, metres, place, say, swatchOf } from './dom.js';
import { className, joined, timeText, valueText } from './layers.js';
import { mark } from './measure.js';
import { logOddsOf, observationsOf, probabilityOf } from './node.js';
import { centerOf, pick } from './pick.js';

// Place of the last click on the screen.
let clickedAt = [0, 0];

export function answer(rows) {
  $('answer').replaceChildren(...rows.flatMap(([name, value]) => {
    const [dt, dd] = [document.createElement('dt'), document.createElement('dd')];
    dt.textContent = name;
    dd.append(value);
    return [dt, dd];
  }));
  $('card').hidden = rows.length === 0;
  $('spoken').textContent = rows.map(([name, value]) => `${name} ${value.textContent ?? value}`).join(', ');
  if (!rows.length) return;
  // The card is next to the click, within the picture.
  const { left, top, width, height } = $('scene').getBoundingClientRect();
  const within = (at, size, low, space) => Math.max(Math.min(at > low + space - size - 16 ? at - size - 14 : at + 14, low + space - size - 8), low + 8);
  const { offsetWidth, offsetHeight } = $('card');
  $('card').style.left = `${within(clickedAt[0], offsetWidth, left, width)}px`;
  $('card').style.top = `${within(clickedAt[1], offsetHeight, top, height)}px`;
}

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
  return app.tool === 'query' ? ask(found, center) : mark(layer, center);
}

// Rows on a voxel in an exported page: what its node has.
function askNode({ layer, node, voxel }, center) {
  const logOdds = logOddsOf(node, node.value[voxel]);
  app.answered = { voxel_center_m: center, edge_m: node.edge, state: 'occupied', log_odds: logOdds, probability: probabilityOf(logOdds) };
  const value = node.values && app.legend && valueText(node.values, voxel, app.legend);
  answer([
    ['at', place(center)],
    ['voxel', `of ${metres(node.edge)}${node.edge > 1.5 * layer.map.resolution_m * 2 ** app.finest ? ' (zoom in for finer ones)' : ''}`],
    ['state', 'occupied'],
    ['probability', `about ${app.answered.probability.toFixed(2)}`],
    ['log-odds', `about ${logOdds.toFixed(2)}`],
    ['observations', `about ${observationsOf(node.counts[voxel])}`],
    ...(value ? [[node.values.name === 'time' ? 'last hit' : node.values.name, value]] : []),
  ]);
  $('copy').hidden = false;
  return app.answered;
}

async function ask(found, center) {
  const { layer, node } = found;
  if (app.finest !== null) return askNode(found, center);
  const isCoarse = node.edge > 1.5 * layer.map.resolution_m;
  try {
    const result = await json(`maps/${layer.id.split('~')[0]}/query?x=${center[0]}&y=${center[1]}&z=${center[2]}`);
    app.answered = { ...result, isCoarse };
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
    return app.answered;
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

// A click is a press that does not move.
let pressed = null;
$('scene').addEventListener('pointerdown', (event) => { pressed = [event.clientX, event.clientY]; });
$('scene').addEventListener('pointerup', (event) => {
  const moved = pressed && Math.hypot(event.clientX - pressed[0], event.clientY - pressed[1]);
  if (pressed && moved < 5 && event.button === 0) clickAt(event.clientX, event.clientY);
  pressed = null;
});

$('scene').addEventListener('keydown', (event) => {
  if (event.key !== 'Enter') return;
  const { left, top, width, height } = $('scene').getBoundingClientRect();
  clickAt(left + width / 2, top + height / 2);
});

export function clickAt(x, y) {
  clickedAt = [x, y];
  const { left, top, width, height } = $('scene').getBoundingClientRect();
  return click(2 * (x - left) / width - 1, 1 - 2 * (y - top) / height);
}

$('copy').addEventListener('click', () => navigator.clipboard?.writeText(app.answered.voxel_center_m.join(' ')).catch((error) => say(error.message)));
