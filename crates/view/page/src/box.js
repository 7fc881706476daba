// A box around what is cut, with handles to drag its faces.

import { viewer } from './app.js';
import { cut, endsOfCut, moveCut } from './cut.js';
import { $ } from './dom.js';
import * as THREE from 'three';

const AXES = ['x', 'y', 'z'];
// Steps of keys as shares of the extent.
const STEPS = { ArrowLeft: -0.005, ArrowDown: -0.005, ArrowRight: 0.005, ArrowUp: 0.005, PageDown: -0.05, PageUp: 0.05 };
const caster = new THREE.Raycaster();

let drag = null;

// Returns the corners of the box in map coordinates.
function corners() {
  const ends = endsOfCut();
  return ['low', 'high'].map((side, end) => viewer.cut[side].map((k, axis) => (Number.isFinite(k) ? k : ends[axis][end])));
}

const handles = AXES.flatMap((axis, k) => [0, 1].map((end) => {
  const handle = document.createElement('button');
  handle.className = `handle ${axis}`;
  handle.setAttribute('role', 'slider');
  handle.setAttribute('aria-label', `${end ? 'Maximum' : 'Minimum'} ${axis === 'z' ? 'height' : axis} of the box`);
  handle.addEventListener('pointerdown', (event) => {
    if (event.button !== 0) return;
    drag = { pointer: event.pointerId, ...grip(k, end) };
    handle.setPointerCapture(event.pointerId);
  });
  handle.addEventListener('pointermove', (event) => { if (drag?.pointer === event.pointerId) pull(k, end, event); });
  handle.addEventListener('lostpointercapture', () => { drag = null; });
  handle.addEventListener('keydown', (event) => {
    const step = STEPS[event.key];
    if (!step) return;
    event.preventDefault();
    event.stopPropagation();
    const ends = endsOfCut()[k];
    moveCut(k, end, corners()[end][k] + step * (ends[1] - ends[0]));
  });
  // The handles do not block zooming.
  handle.addEventListener('wheel', (event) => {
    event.preventDefault();
    viewer.canvas.dispatchEvent(new WheelEvent(event.type, event));
  });
  $('handles').append(handle);
  return { handle, k, end };
}));

// Returns the line in the scene along which the middle of a face moves.
function grip(k, end) {
  const [low, high] = corners();
  const middle = low.map((value, axis) => (value + high[axis]) / 2);
  middle[k] = [low, high][end][k];
  return { from: new THREE.Vector3(...viewer.toScene(middle)), start: middle[k] };
}

// Moves a face to the point of its line that is nearest to the pointer's ray.
function pull(k, end, event) {
  const { left, top, width, height } = viewer.canvas.getBoundingClientRect();
  const at = new THREE.Vector2(2 * (event.clientX - left) / width - 1, 1 - 2 * (event.clientY - top) / height);
  caster.setFromCamera(at, viewer.camera);
  const { origin, direction } = caster.ray;
  const between = drag.from.clone().sub(origin);
  const along = direction.getComponent(k);
  const across = 1 - along * along;
  // The axis points towards the camera.
  if (across < 1e-4) return;
  moveCut(k, end, drag.start + (along * between.dot(direction) - between.getComponent(k)) / across);
}

// Places the handles on the screen.
function follow() {
  if (!$('box').checked) return;
  const { clientWidth, clientHeight } = viewer.canvas;
  const [low, high] = corners();
  for (const { handle, k, end } of handles) {
    const at = grip(k, end).from.clone().project(viewer.camera);
    const isSeen = at.z < 1 && Math.abs(at.x) < 1 && Math.abs(at.y) < 1;
    handle.hidden = !isSeen;
    if (!isSeen) continue;
    handle.style.left = `${(at.x + 1) * clientWidth / 2}px`;
    handle.style.top = `${(1 - at.y) * clientHeight / 2}px`;
    const value = [low, high][end][k];
    handle.setAttribute('aria-valuenow', value.toFixed(2));
    handle.setAttribute('aria-valuetext', `${value.toFixed(2)} m`);
  }
}

export function drawBox() {
  const isOn = $('box').checked;
  $('handles').hidden = !isOn;
  if (isOn) viewer.overlays.box('box', ...corners(), 0xffb000);
  else viewer.overlays.set('box', null);
  viewer.wake();
}

viewer.moves.push(follow);
$('box').addEventListener('change', cut);
