// Trajectory of the sensor.

import { app, viewer } from './app.js';
import { $, json, say } from './dom.js';
import { idOf } from './maps.js';

let pathNumber = 0;
let playTimer = 0;

export async function readPath() {
  const number = ++pathNumber;
  let points = [];
  try {
    ({ points } = await json(`maps/${idOf(app.maps[0]).split('~')[0]}/trajectory.json`));
  } catch (error) {
    say(`Cannot load the trajectory: ${error.message}`);
  }
  // Ignore the response to an older request.
  if (number !== pathNumber) return;
  app.path = points;
  $('scan').max = Math.max(app.path.length - 1, 0);
  $('scan').value = $('scan').max;
  $('scan').disabled = app.path.length < 2;
  viewer.overlays.path('path', app.path, 0xff3b6b);
  showScan();
}

function showScan() {
  const at = app.path[Number($('scan').value)];
  const on = $('path').checked;
  viewer.overlays.show('path', on);
  $('scan-out').value = app.path.length ? `${Number($('scan').value) + 1} of ${app.path.length}` : 'none';
  const size = 1.2 * (app.maps[0]?.resolution_m ?? 0.1);
  if (at && on) viewer.overlays.dot('sensor', at, Math.max(2 * size, 0.1), 0xff3b6b);
  else viewer.overlays.set('sensor', null);
  viewer.wake();
}

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
$('scan').addEventListener('input', showScan);
$('path').addEventListener('change', showScan);
