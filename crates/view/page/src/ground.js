// What shows size and directions: a grid on the ground, a scale bar, and the axes.

import * as THREE from 'three';

const $ = (id) => document.getElementById(id);
// Lines from the middle of the grid to each side.
const REACH = 20;
// Lengths of the scale bar in pixels.
const BAR_PX = 120;
const AXES = [['x', '#d5433a'], ['y', '#3a9d4b'], ['z', '#3b78d8']];

// Returns the largest of 1, 2, 5, 10 ... that is at most a length.
export function roundLength(length) {
  const power = 10 ** Math.floor(Math.log10(length));
  return power * [5, 2, 1].find((k) => k * power <= length * (1 + 1e-9));
}

export const lengthText = (m) => (m >= 1000 ? `${m / 1000} km` : m >= 1 ? `${m} m` : m >= 0.01 ? `${Math.round(100 * m)} cm` : `${+(1000 * m).toPrecision(2)} mm`);

// Lines that fade towards the border of the grid; each tenth is stronger.
function gridOf(step, at, rgb) {
  const [places, colours] = [[], []];
  const add = (i, j, isTenth) => {
    places.push(i * step, j * step, 0);
    colours.push(...rgb, (isTenth ? 0.8 : 0.34) * Math.max(1 - Math.hypot(i, j) / REACH, 0) ** 1.2);
  };
  for (let i = -REACH; i <= REACH; i++) {
    for (let j = -REACH; j < REACH; j++) {
      for (const flip of [false, true]) {
        const isTenth = Math.round(at[flip ? 1 : 0] / step + i) % 10 === 0;
        for (const end of [j, j + 1]) add(...(flip ? [end, i] : [i, end]), isTenth);
      }
    }
  }
  const geometry = new THREE.BufferGeometry();
  geometry.setAttribute('position', new THREE.Float32BufferAttribute(places, 3));
  geometry.setAttribute('color', new THREE.Float32BufferAttribute(colours, 4));
  return new THREE.LineSegments(geometry, new THREE.LineBasicMaterial({ vertexColors: true, transparent: true, depthWrite: false }));
}

export class Ground {
  constructor(viewer) {
    this.viewer = viewer;
    this.isShown = true;
    // Height of the ground in map coordinates, in metres.
    this.height = null;
    this.rgb = [0.4, 0.4, 0.4];
    viewer.moves.push(() => this.follow());
    // The axes are in SVG: sharp, and without a draw call.
    const svg = (name, fields) => {
      const made = document.createElementNS('http://www.w3.org/2000/svg', name);
      for (const [field, value] of Object.entries(fields)) made.setAttribute(field, value);
      return made;
    };
    this.axes = AXES.map(([name, colour]) => {
      const line = svg('line', { x1: 0, y1: 0, stroke: colour, 'stroke-width': 2.5, 'stroke-linecap': 'round' });
      const text = svg('text', { fill: colour, 'text-anchor': 'middle', 'dominant-baseline': 'central' });
      text.textContent = name;
      const group = svg('g', {});
      group.append(line, text);
      $('axes').append(group);
      return { group, line, text };
    });
  }

  // Names the axes by directions if the map has a coordinate reference system.
  name(crs) {
    ['E', 'N', 'z'].forEach((name, k) => { this.axes[k].text.textContent = crs ? name : AXES[k][0]; });
    $('axes').setAttribute('aria-label', crs ? `Axes: E east, N north, z up (${crs})` : 'Axes x, y and z of the map');
  }

  paint(isDark) {
    const value = isDark ? 0.42 : 0.3;
    this.rgb = [value, value, value + 0.04];
    this.shown = null;
    this.follow();
  }

  show(isShown) {
    this.isShown = isShown;
    this.shown = null;
    this.follow();
    this.viewer.wake();
  }

  follow() {
    const { viewer } = this;
    const { camera, flight, canvas, overlays } = viewer;
    // Axes
    const turn = camera.matrixWorldInverse.elements;
    this.axes.map((axis, k) => [axis, turn[4 * k], turn[4 * k + 1], turn[4 * k + 2]])
      .sort((a, b) => a[3] - b[3])
      .forEach(([{ group, line, text }, right, up]) => {
        line.setAttribute('x2', (22 * right).toFixed(1));
        line.setAttribute('y2', (-22 * up).toFixed(1));
        text.setAttribute('x', (30 * right).toFixed(1));
        text.setAttribute('y', (-30 * up).toFixed(1));
        if (group.nextSibling) $('axes').append(group);
      });
    // Scale bar, of the distance of the point that the camera looks at
    const away = flight.walks ? 10 * flight.step : camera.position.distanceTo(flight.orbit.target);
    const perPixel = 2 * Math.tan(THREE.MathUtils.degToRad(camera.fov / 2)) * away / canvas.clientHeight;
    if (!(perPixel > 0) || !Number.isFinite(perPixel)) return;
    const bar = roundLength(BAR_PX * perPixel);
    $('bar').style.width = `${(bar / perPixel).toFixed(1)}px`;
    if (this.bar !== bar) $('bar').textContent = lengthText(this.bar = bar);
    // Grid
    if (this.height === null) return;
    const step = roundLength(away / 8);
    const target = viewer.toMap(flight.orbit.target.toArray());
    const at = [0, 1].map((axis) => Math.round(target[axis] / step) * step);
    const shown = this.isShown ? [step, ...at, this.height].join() : '';
    if (shown === this.shown) return;
    this.shown = shown;
    const grid = shown ? gridOf(step, at, this.rgb) : null;
    grid?.position.set(...at, this.height);
    overlays.set('ground', grid);
  }
}
