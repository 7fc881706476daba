import * as THREE from 'three';
import { Flight } from './camera.js';
import { Layer } from './layer.js';
import { BY_LAYER } from './layers.js';
import { LAYERS } from './palette.js';
import { sharedUniforms } from './material.js';
import { KIND } from './node.js';
import { OF_FIRST_MAP, Overlays } from './overlays.js';
import { Pace, Timers } from './pace.js';
import { Shading } from './shading.js';

const MAX_CALLS = 200;
// Maximum pause between frames while nodes are loaded.
const MAX_PAUSE_MS = 2000;
// Interval of updates of the nodes to load.
const LOAD_MS = 16;
// Time without a change after which edges are smoothed, where drawing is slow.
const SMOOTH_AFTER_MS = 400;
// Draw calls reserved for overlays: trajectory, sensor, moving points, distances, marks, change, ground, grid, bounding box, section, cut box;
// and for the shading.
const OVERLAY_CALLS = 16;

// Scene with layers, overlays and camera. Draws only after changes.
export class Viewer {
  constructor(canvas, say) {
    this.say = say;
    this.canvas = canvas;
    this.renderer = new THREE.WebGLRenderer({ canvas, antialias: false, depth: false });
    this.renderer.setPixelRatio(Math.min(devicePixelRatio, 2));
    // A frame of a swipe is drawn in two calls.
    this.renderer.info.autoReset = false;
    this.shading = new Shading(this.renderer);
    this.scene = new THREE.Scene();
    // Scene coordinates are relative to the middle of the maps, which may be millions of metres from the origin.
    this.world = new THREE.Group();
    this.scene.add(this.world);
    this.camera = new THREE.PerspectiveCamera(60, 1, 0.05, 1e6);
    this.camera.up.set(0, 0, 1);
    this.camera.layers.enable(OF_FIRST_MAP);
    this.flight = new Flight(this.camera, canvas, () => this.wake());
    this.shared = sharedUniforms();
    this.overlays = new Overlays(this.world);
    this.layers = [];
    // Whether the page is a folder of files, without the server of `voxtile view`.
    this.isExported = false;
    // In a swipe, layers of side 0 are drawn left of a share of the width, and layers of side 1 right of it.
    this.isSplit = false;
    this.share = 0.5;
    this.shows = { occupied: true, free: false, unknown: false };
    this.threshold = 0;
    // Classes of a comparison that are shown, as bits.
    this.classes = 255;
    this.cut = { low: [-Infinity, -Infinity, -Infinity], high: [Infinity, Infinity, Infinity] };
    this.colour = 'height';
    // Range of colours: of the chosen values, and of heights in metres.
    this.range = [0, 1];
    this.heights = [0, 1];
    this.listeners = [];
    // Called before each frame is drawn.
    this.moves = [];
    this.firstPictureMs = null;
    this.frames = 0;
    this.pace = new Pace(this.renderer.getContext());
    this.timers = new Timers();
    this.mostCalls = 0;
    this.last = performance.now();
    new ResizeObserver(() => this.resize()).observe(canvas);
    this.resize();
    this.wake();
  }

  get middle() {
    return this.world.position.toArray().map((k) => -k);
  }

  // Sets the scene's origin to whole metres in the middle of the maps, once.
  center(bounds, core, points) {
    const middle = [0, 1, 2].map((k) => Math.round((bounds.min[k] + bounds.max[k]) / 2));
    this.world.position.set(...middle.map((k) => -k));
    this.world.updateMatrixWorld(true);
    this.surround(bounds, core, points);
  }

  // Sets the box of all voxels, and of most voxels, with some of them: the first frame.
  surround(bounds, core = bounds, points = []) {
    this.core = this.boxOf(core);
    this.points = points.map((point) => new THREE.Vector3(...this.toScene(point)));
    this.box = this.boxOf(bounds);
  }

  boxOf(bounds) {
    return new THREE.Box3(...['min', 'max'].map((end) => new THREE.Vector3(...this.toScene(bounds[end]))));
  }

  // Fits most voxels into the view, from a direction.
  frameMost(from) {
    this.flight.fit(this.core, from, this.points);
  }

  toScene(point) {
    return point.map((k, axis) => k + this.world.position.getComponent(axis));
  }

  toMap(point) {
    return point.map((k, axis) => k - this.world.position.getComponent(axis));
  }

  show(maps, legend) {
    for (const layer of this.layers) layer.dispose();
    this.isSplit = maps.some(({ side }) => side !== undefined);
    const isTinted = maps.length > 1 && !this.isSplit;
    this.layers = maps.map(({ map, id, side, label }, k) => {
      const layer = new Layer(this, map, id, isTinted ? LAYERS[k % LAYERS.length] : null, legend);
      Object.assign(layer, { side, label });
      this.world.add(layer.group);
      return layer;
    });
    this.paint();
  }

  resize() {
    const { clientWidth: width, clientHeight: height } = this.canvas;
    if (width === 0 || height === 0) return;
    this.renderer.setSize(width, height, false);
    this.camera.aspect = width / height;
    this.camera.updateProjectionMatrix();
    this.wake();
  }

  // Requests a frame.
  wake() {
    if (this.settled) {
      this.settled = false;
      for (const listener of this.listeners) listener(this);
    }
    for (const name of ['frame', 'smooth']) this.timers.clear(name);
    // A frame may have to wait for the drawing of the last one; loading does not.
    this.loadSoon();
    if (this.waits) return;
    this.waits = true;
    requestAnimationFrame((now) => {
      this.waits = false;
      this.frame(now);
    });
  }

  // Requests a frame for nodes that were loaded. Where drawing is slow, loading gets most of the time.
  wakeSoon() {
    if (this.waits) return;
    this.settled = false;
    const isLoading = this.layers.some(({ tiles }) => !Layer.isIdle(tiles));
    const pause = isLoading ? Math.min(5 * this.pace.drawMs, MAX_PAUSE_MS) : 0;
    this.timers.set('frame', () => this.wake(), Math.max(60, pause));
  }

  // Loads nodes between frames.
  loadSoon() {
    this.timers.set('load', () => this.load(), LOAD_MS);
  }

  load(isFrame = false) {
    this.timers.clear('load');
    this.fitDepth();
    for (const layer of this.layers) layer.update();
    // Equal levels on both sides of a swipe: other levels would look like changes.
    if (this.isSplit) this.layers[0].adapt(this.layers.slice(1), isFrame);
    else for (const layer of this.layers) layer.adapt([], isFrame);
    this.isReady = this.layers.every((layer) => layer.isReady);
    if (isFrame || this.settled || this.waits) return;
    if (this.isReady) this.wake();
    else if (this.layers.every(({ tiles }) => Layer.isIdle(tiles))) this.loadSoon();
  }

  frame(now) {
    const seconds = (now - this.last) / 1000;
    this.last = now;
    const moved = this.flight.update(seconds);
    this.load(true);
    this.paint();
    for (const layer of this.layers) layer.tiles.group.visible = layer.isShown && this.shows.occupied;
    for (const layer of this.layers) layer.near.visible = layer.isShown;
    this.leaveOutFarthest();
    for (const follow of this.moves) follow();
    this.draw(!this.pace.isSlow);
    this.frames++;
    this.mostCalls = Math.max(this.mostCalls, this.renderer.info.render.calls);
    const meshes = this.layers.reduce((sum, layer) => sum + layer.tiles.visibleTiles.size, 0);
    if (this.firstPictureMs === null && meshes > 0) this.firstPictureMs = performance.now();
    // The view is settled after a frame in which no node is pending and the camera does not move.
    this.settled = this.isReady && !moved;
    for (const listener of this.listeners) listener(this);
    if (this.settled) this.smoothLater();
    else if (moved) this.wake();
    else this.wakeSoon();
    if (!this.isReady) this.loadSoon();
  }

  smoothLater() {
    this.timers.set('smooth', () => this.smooth(), SMOOTH_AFTER_MS);
  }

  // Draws a settled view again with smooth edges, if its last frame has none because drawing is slow.
  smooth() {
    if (!this.settled) return;
    // The time of the last frame is not known yet.
    if (this.pace.isMeasuring) this.smoothLater();
    else if (this.pace.mayBeSmooth) this.draw();
  }

  // First column of pixels of the later state.
  get border() {
    return Math.round(this.share * this.canvas.width);
  }

  // Draws a frame; `isSmooth`: with smooth edges, which take most of the time of software.
  draw(isSmooth = true) {
    const { renderer, shading, scene, camera } = this;
    renderer.info.reset();
    shading.isSmooth = isSmooth;
    this.pace.begin(isSmooth);
    if (this.isSplit) this.drawSides();
    else shading.draw(scene, camera);
    this.pace.end();
  }

  drawSides() {
    const { shading, scene, camera, layers } = this;
    const { border, canvas } = this;
    for (const [side, from, to] of [[0, 0, border], [1, border, canvas.width]]) {
      if (from === to) continue;
      for (const layer of layers) layer.group.visible = layer.side === side;
      if (layers[0].side === side) camera.layers.enable(OF_FIRST_MAP);
      else camera.layers.disable(OF_FIRST_MAP);
      shading.draw(scene, camera, from, to);
    }
    for (const layer of layers) layer.group.visible = true;
    camera.layers.enable(OF_FIRST_MAP);
  }

  // Returns whether a layer is drawn at a place along the screen, from -1 to 1.
  isAt(layer, x) {
    return !this.isSplit || layer.side === Number((x + 1) / 2 * this.canvas.width >= this.border);
  }

  // If a view needs more nodes than the limit, hides the farthest until coarser ones are loaded.
  leaveOutFarthest() {
    const near = this.layers.reduce((sum, layer) => sum + (layer.isShown ? layer.near.children.length : 0), 0);
    const shown = this.layers.filter((layer) => layer.isShown).flatMap((layer) => layer.meshes());
    const most = MAX_CALLS - (this.isSplit ? 2 : 1) * OVERLAY_CALLS - near;
    if (shown.length > most) shown.sort((a, b) => a[1].traversal.distanceFromCamera - b[1].traversal.distanceFromCamera);
    shown.forEach(([mesh], k) => { mesh.visible = k < most; });
  }

  // Fits the depth range to the map, for depth precision.
  fitDepth() {
    const far = this.box ? this.box.getSize(new THREE.Vector3()).length() : 100;
    const away = this.box ? this.box.distanceToPoint(this.camera.position) : 0;
    this.camera.near = Math.max(0.02, 0.6 * away, far * 1e-5);
    this.camera.far = away + 1.5 * far + 10;
    this.camera.updateProjectionMatrix();
    this.camera.updateMatrixWorld();
  }

  // Sets the heights above which colours show heights.
  refer(reference) {
    this.shared.reference.value?.dispose();
    this.shared.reference.value = reference.texture(this.middle[2]);
    const [x, y] = this.toScene([...reference.low, 0]);
    this.shared.referenceAt.value.set(x, y, reference.cell);
    this.wake();
  }

  // Sets the uniforms from the controls.
  paint() {
    this.shared.colourBy.value = ['height', 'probability', 'count', 'scan', 'above'].indexOf(this.colour);
    this.shared.paintRange.value = this.range;
    this.shared.classes.value = this.classes;
    this.shared.low.value.set(...this.toScene(this.cut.low));
    this.shared.high.value.set(...this.toScene(this.cut.high));
    for (const [k, layer] of this.layers.entries()) {
      const uniforms = layer.material.uniforms;
      uniforms.opacity.value.set(layer.opacity, k);
      uniforms.threshold.value = this.threshold;
      // Voxels whose values are not loaded yet are coloured by height.
      const isHeight = !['probability', 'count', 'scan', 'above'].includes(this.colour);
      uniforms.range.value.set(...(isHeight ? this.heights.map((k) => k + this.world.position.z) : this.range));
      uniforms.layer.value = BY_LAYER[this.colour] ?? null;
    }
  }

  // Returns whether a voxel is drawn: of a visible layer, above the threshold and within the cut.
  isSeen(layer, node, voxel, at) {
    if (!layer.isDrawn || !this.shows.occupied) return false;
    if (node.kind === KIND.occupied && node.value[voxel] < this.threshold) return false;
    if (node.kind === KIND.compared && (node.value[voxel] & this.classes) === 0) return false;
    return at.every((k, axis) => {
      const mid = node.corner[axis] + (k + 0.5) * node.edge;
      return mid >= this.cut.low[axis] && mid <= this.cut.high[axis];
    });
  }
}
