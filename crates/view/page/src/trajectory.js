// Trajectory of the sensor.

import { app, viewer } from './app.js';
import { $, json, say, tell } from './dom.js';
import { timeText } from './layers.js';
import { idOf } from './maps.js';
import { startsOf } from './reference.js';

let pathNumber = 0;
// Time stamps of the positions in seconds, if they are known.
let times = null;
let isUnixTime = false;
let playTimer = 0;

export async function readPath() {
  const number = ++pathNumber;
  let [points, stamps, areDates, parts] = [[], null, false, []];
  try {
    ({ points, times_s: stamps = null, is_unix_time: areDates = false, parts = [] } = await json(`maps/${idOf(app.maps[0]).split('~')[0]}/trajectory.json`));
  } catch (error) {
    say(`Cannot load the trajectory: ${error.message}`);
  }
  // Ignore the response to an older request.
  if (number !== pathNumber) return;
  app.path = points;
  // Stamps of several recordings may go backwards: they are no schedule.
  isUnixTime = areDates;
  times = stamps?.length === points.length && stamps.every((seconds, k) => k === 0 || seconds >= stamps[k - 1]) ? stamps : null;
  $('scan').max = Math.max(app.path.length - 1, 0);
  $('scan').value = $('scan').max;
  $('scan').disabled = app.path.length < 2;
  viewer.overlays.path('path', app.path, 0xff3b6b, [...parts, ...startsOf(app.path, 2 * app.maps[0].resolution_m)]);
  showScan();
}

function showScan() {
  const number = Number($('scan').value);
  const at = app.path[number];
  const on = $('path').checked;
  viewer.overlays.show('path', on);
  const time = times ? `, ${timeText(times[number], { range: [times[0]], isUnixTime })}` : '';
  tell('scan', app.path.length ? `${number + 1} of ${app.path.length}${time}` : 'none');
  const size = 1.2 * (app.maps[0]?.resolution_m ?? 0.1);
  if (at && on) viewer.overlays.dot('sensor', at, Math.max(2 * size, 0.1), 0xff3b6b);
  else viewer.overlays.set('sensor', null);
  viewer.wake();
}

// Returns the seconds of each position from the start of playing: by time stamps, or in ten seconds without any.
function schedule() {
  const speed = Number($('speed').value);
  if (times) return times.map((seconds) => (seconds - times[0]) / speed);
  const all = 10 / Math.sqrt(speed);
  return app.path.map((_, k) => all * k / Math.max(app.path.length - 1, 1));
}

// Moves the sensor along the trajectory.
function play(isOn) {
  clearInterval(playTimer);
  playTimer = 0;
  $('play').setAttribute('aria-pressed', String(isOn));
  if (!isOn) return;
  const last = Number($('scan').max);
  if (Number($('scan').value) === last) $('scan').value = 0;
  const seconds = schedule();
  const since = performance.now() / 1000 - seconds[Number($('scan').value)];
  playTimer = setInterval(() => {
    const now = performance.now() / 1000 - since;
    let at = Number($('scan').value);
    while (at < last && seconds[at + 1] <= now) at++;
    $('scan').value = at;
    showScan();
    if (at >= last) play(false);
  }, 50);
}
$('speed').addEventListener('change', () => { if (playTimer) play(true); });
$('play').addEventListener('click', () => play(!playTimer));
$('scan').addEventListener('input', showScan);
$('path').addEventListener('change', showScan);
