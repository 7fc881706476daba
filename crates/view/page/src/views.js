// Camera views.

import { app, viewer } from './app.js';
import { $ } from './dom.js';
import { allBounds, mostOf, surround } from './maps.js';
import { obliqueOf } from './survey.js';

// Earlier views, and when the last one was left.
const views = [];
let leftAt = 0;
const MAX_VIEWS = 50;
// Camera of the first view.
let startedAt = '';
const pose = () => JSON.stringify([viewer.camera.position, viewer.flight.orbit.target]);

export function start() {
  viewer.center(allBounds());
  surround();
  if (app.link.eye && app.link.to) viewer.flight.lookAt(viewer.toScene(app.link.eye), viewer.toScene(app.link.to));
  else viewer.frameMost(oblique());
  startedAt = pose();
}

// Returns whether the camera was not moved since the start.
export const isAtStart = () => pose() === startedAt;

const oblique = () => obliqueOf(mostOf()[1], app.path);

$('fit').addEventListener('click', () => keepView() || viewer.frameMost(oblique()));
$('top').addEventListener('click', () => keepView() || viewer.frameMost([0, -0.001, 1]));
$('side').addEventListener('click', () => keepView() || viewer.frameMost([0, -1, 0.05]));
$('walk').addEventListener('click', () => {
  viewer.flight.walk(!viewer.flight.walks);
  $('walk').setAttribute('aria-pressed', String(viewer.flight.walks));
  $('scene').focus();
});

// Remembers the present view for `Back`. The steps of a wheel are one change.
function keepView() {
  const now = performance.now();
  if (now - leftAt > 500) views.push([viewer.camera.position, viewer.flight.orbit.target].map((at) => viewer.toMap(at.toArray())));
  leftAt = now;
  if (views.length > MAX_VIEWS) views.shift();
  $('back').disabled = false;
}

$('back').addEventListener('click', () => {
  const view = views.pop();
  $('back').disabled = views.length === 0;
  leftAt = 0;
  if (view) viewer.flight.lookAt(...view.map((at) => viewer.toScene(at)));
});

viewer.flight.orbit.addEventListener('start', keepView);
