import * as THREE from 'three';

// Returns a line between each pair of points.
const lines = (points, colour) => {
  const geometry = new THREE.BufferGeometry().setFromPoints(points.map((p) => new THREE.Vector3(...p)));
  return new THREE.LineSegments(geometry, new THREE.LineBasicMaterial({ color: colour, depthTest: false }));
};

// Layer of three.js with the overlays of the first map; the others belong to all maps.
export const OF_FIRST_MAP = 1;
const NAMES_OF_FIRST_MAP = ['path', 'sensor', 'moving', 'distances'];

// Lines that no voxel hides.
const ABOVE_ALL = ['measure', 'section'];

const EDGES = [[0, 1], [2, 3], [4, 5], [6, 7], [0, 2], [1, 3], [4, 6], [5, 7], [0, 4], [1, 5], [2, 6], [3, 7]];

// Overlays in map coordinates, in metres.
export class Overlays {
  constructor(parent) {
    this.group = new THREE.Group();
    parent.add(this.group);
    this.named = new Map();
  }

  set(name, object) {
    const before = this.named.get(name);
    if (before) {
      this.group.remove(before);
      before.traverse((part) => [part.geometry, part.material].forEach((owned) => owned?.dispose()));
    }
    this.named.delete(name);
    if (!object) return;
    if (NAMES_OF_FIRST_MAP.includes(name)) object.layers.set(OF_FIRST_MAP);
    this.named.set(name, object);
    this.group.add(object);
  }

  show(name, on) {
    const object = this.named.get(name);
    if (object) object.visible = on;
  }

  // Lines are relative to their first point, because `f32` is too coarse for coordinates of millions of metres.
  // `starts` are the indices of the first points of further lines.
  path(name, points, colour, starts = []) {
    if (points.length === 0) return this.set(name, null);
    const base = points[0];
    const begins = new Set([0, ...starts]);
    const pairs = points.flatMap((point, k) => (begins.has(k) ? [] : [points[k - 1], point]));
    const drawn = lines(pairs.map((p) => p.map((k, axis) => k - base[axis])), colour);
    drawn.position.set(...base);
    drawn.renderOrder = 2;
    drawn.material.depthTest = !ABOVE_ALL.includes(name);
    this.set(name, drawn);
  }

  // Points as offsets from `base`.
  points(name, base, offsets, material) {
    if (offsets.length === 0) return this.set(name, null);
    const geometry = new THREE.BufferGeometry();
    geometry.setAttribute('position', new THREE.BufferAttribute(offsets, 3));
    const drawn = new THREE.Points(geometry, material);
    drawn.position.set(...base);
    drawn.renderOrder = 1;
    drawn.onBeforeRender = (renderer) => {
      renderer.getDrawingBufferSize(material.uniforms.pixels.value);
      material.uniformsNeedUpdate = true;
    };
    this.set(name, drawn);
  }

  // Draws colours (red, green, blue, alpha) on a horizontal rectangle, row by row from its lower corner.
  image(name, low, size, edge, colours) {
    if (colours.length === 0) return this.set(name, null);
    const map = new THREE.DataTexture(colours, ...size);
    map.colorSpace = THREE.SRGBColorSpace;
    map.needsUpdate = true;
    const material = new THREE.MeshBasicMaterial({ map, alphaTest: 0.5, side: THREE.DoubleSide });
    material.addEventListener('dispose', () => map.dispose());
    const [width, height] = size.map((count) => count * edge);
    const drawn = new THREE.Mesh(new THREE.PlaneGeometry(width, height).translate(width / 2, height / 2, 0), material);
    drawn.position.set(...low);
    this.set(name, drawn);
  }

  box(name, low, high, colour) {
    const size = high.map((k, axis) => k - low[axis]);
    const corner = (k) => [k & 1, k >> 1 & 1, k >> 2].map((on, axis) => on * size[axis]);
    const drawn = lines(EDGES.flatMap(([a, b]) => [corner(a), corner(b)]), colour);
    drawn.position.set(...low);
    drawn.renderOrder = 3;
    this.set(name, drawn);
  }

  dot(name, at, radius, colour) {
    const ball = new THREE.Mesh(new THREE.SphereGeometry(radius, 16, 8), new THREE.MeshBasicMaterial({ color: colour, depthTest: false }));
    ball.position.set(...at);
    ball.renderOrder = 4;
    this.set(name, ball);
  }

  // Draws tile borders at the bottom of the map, unless there are too many.
  tiles(name, bounds, size, colour) {
    const [x0, y0, z] = bounds.min;
    const counts = [0, 1].map((k) => Math.round((bounds.max[k] - bounds.min[k]) / size));
    if (counts[0] + counts[1] > 4000) return this.set(name, null);
    const points = [];
    for (let k = 0; k <= counts[0]; k++) points.push([k * size, 0, 0], [k * size, counts[1] * size, 0]);
    for (let k = 0; k <= counts[1]; k++) points.push([0, k * size, 0], [counts[0] * size, k * size, 0]);
    const geometry = new THREE.BufferGeometry().setFromPoints(points.map((p) => new THREE.Vector3(...p)));
    const drawn = new THREE.LineSegments(geometry, new THREE.LineBasicMaterial({ color: colour, transparent: true, opacity: 0.5 }));
    drawn.position.set(x0, y0, z);
    this.set(name, drawn);
  }
}
