import { app, viewer } from './app.js';
import { paint } from './colours.js';
import { $ } from './dom.js';
import { BY_LAYER } from './layers.js';
import { cache } from './loading.js';
import { centerOf } from './pick.js';
import { clickAt } from './query.js';
import { sectionShown } from './section.js';

// For tests and the console.
window.voxtile = {
  voxels() {
    const meshes = viewer.layers.flatMap((layer) => layer.meshes().map(([mesh]) => [layer, mesh.userData.node]));
    const centers = [];
    for (const [layer, node] of meshes) {
      for (let i = 0; i < node.count; i++) {
        const at = [node.x[i], node.y[i], node.z[i]];
        if (viewer.isSeen(layer, node, i, at)) centers.push(centerOf({ node, at }));
      }
    }
    return { count: centers.length, centers, edges: [...new Set(meshes.map(([, node]) => node.edge))] };
  },
  near: () => viewer.layers.flatMap((layer) => layer.near.children).reduce((sum, { userData }) => {
    const kind = ['occupied', 'free', 'unknown'][userData.node.kind];
    return { ...sum, [kind]: (sum[kind] ?? 0) + userData.node.count };
  }, {}),
  faces: () => viewer.layers.flatMap((layer) => layer.meshes()).reduce((sum, [mesh]) => sum + mesh.userData.faces, 0),
  // Choice of colours that all drawn nodes of maps with its layer have.
  painted() {
    const name = BY_LAYER[viewer.colour] ?? null;
    const nodes = viewer.layers.filter((layer) => layer.layerName).flatMap((layer) => layer.meshes().map(([mesh]) => mesh.userData.node));
    return nodes.every((node) => !name || node.values?.name === name) && app.legendNumber === app.legendShown ? viewer.colour : null;
  },
  // What the view waits for.
  waits: () => viewer.layers.map(({ tiles, adapts, next, waits }) => ({ ...tiles.stats, calm: tiles.calm, errorTarget: tiles.errorTarget, adapts, waits, hasNext: Boolean(next), shown: tiles.visibleTiles.size })),
  get frames() { return viewer.frames; },
  drawCalls: () => viewer.renderer.info.render.calls,
  mostDrawCalls: () => viewer.mostCalls,
  bytes: () => cache.cachedBytes + viewer.layers.reduce((sum, layer) => sum + layer.nearBytes, 0),
  moving() {
    const { offsets, origin } = app.moving;
    return Array.from({ length: app.moving.count }, (_, k) => origin.map((at, axis) => at + offsets[3 * k + axis]));
  },
  section: sectionShown,
  distances: () => app.distances && { ...app.distances, values: [...app.distances.values] },
  clickAt,
  draw: () => viewer.draw(),
  // Waits until the last frame is drawn.
  finish: () => viewer.renderer.getContext().readPixels(0, 0, 1, 1, 6408, 5121, new Uint8Array(4)),
  screenOf(point) {
    const at = viewer.camera.position.clone().set(...viewer.toScene(point)).project(viewer.camera);
    const { left, top, width, height } = $('scene').getBoundingClientRect();
    return [left + (at.x + 1) * width / 2, top + (1 - at.y) * height / 2];
  },
  camera: () => ({ eye: viewer.toMap(viewer.camera.position.toArray()), to: viewer.toMap(viewer.flight.orbit.target.toArray()) }),
  lookAt: (eye, to) => viewer.flight.lookAt(viewer.toScene(eye), viewer.toScene(to)),
  setThreshold(value) {
    $('threshold').value = value;
    paint();
  },
  set detail(pixels) {
    for (const layer of viewer.layers) layer.tiles.errorTarget = pixels;
    viewer.wake();
  },
  get firstPictureMs() { return viewer.firstPictureMs; },
  get shown() { return viewer.layers.map(({ id }) => id); },
  get generation() { return app.maps.map((map) => map.generation); },
};
