import * as THREE from 'three';
import { FAILED, TilesRenderer } from '3d-tiles-renderer';
import { contentOf, plain } from './content.js';
import { BY_LAYER } from './layers.js';
import { cache, queues } from './loading.js';
import { KIND, parseNode } from './node.js';
import { bytesOf, meshOf } from './mesh.js';
import { makeMaterial, tintLayer } from './material.js';

const MAX_DRAWN = 180;
// Nodes of loaded files that take part in an update at once.
const MAX_PROCESSED = 5000;
const BEST_ERROR = 2;
const MAX_ERROR = 4096;
// Factor between levels of detail.
const STEP = 1.07;
// Maximum number of tiles with free or unknown voxels.
const MAX_NEAR = 24;
// Failed requests are retried with increasing delay.
export const FIRST_RETRY_MS = 2000;
export const LAST_RETRY_MS = 60000;

// One state of a map; nodes are loaded and removed as the camera moves.
export class Layer {
  // `legend` is that of the layer by which the voxels are coloured; none before it is loaded.
  constructor(viewer, map, id, hue, legend) {
    Object.assign(this, { viewer, map, id, hue, legend });
    this.group = new THREE.Group();
    this.near = new THREE.Group();
    this.group.add(this.near);
    const kind = id.includes('~~') ? KIND.compared : id.includes('~') ? KIND.change : KIND.occupied;
    this.material = makeMaterial(kind, viewer.shared);
    this.materials = { free: makeMaterial(KIND.free, viewer.shared), unknown: makeMaterial(KIND.unknown, viewer.shared) };
    if (hue) tintLayer(this.material, hue);
    // Free and unknown voxels by URL: a mesh, or a load in progress.
    this.extra = new Map();
    // URLs of free and unknown voxels that failed to load.
    this.lostNear = new Set();
    this.retryMs = FIRST_RETRY_MS;
    this.generation = map.generation;
    this.tiles = this.open();
    this.next = null;
    this.isShown = true;
    this.opacity = 1;
  }

  open() {
    const tiles = new TilesRenderer(`maps/${this.id}/tileset.json`);
    const { legend } = this;
    tiles.layerName = legend && this.layerName;
    Object.assign(tiles, queues, { maxTilesProcessed: MAX_PROCESSED });
    tiles.errorTarget = BEST_ERROR;
    tiles.registerPlugin({
      preprocessURL: (url) => {
        if (!tiles.layerName || !url.includes('.vox?')) return url;
        // An exported page has files with the values of each layer.
        return this.viewer.isExported ? url.replace('.vox?', `.${tiles.layerName}.vox?`) : `${url}&layer=${tiles.layerName}`;
      },
      parseToMesh: async (buffer, tile, extension) => {
        if (extension !== 'vox') return null;
        const node = parseNode(await plain(buffer));
        this.scale = { least: node.least, most: node.most };
        const mesh = meshOf(node, this.material, legend);
        const group = new THREE.Group();
        group.add(mesh);
        group.userData.mesh = mesh;
        return group;
      },
    });
    // The renderer's own estimate would count shared indices in each mesh, and no voxels for picking.
    tiles.calculateBytesUsed = (tile, scene) => {
      const mesh = scene?.userData.mesh;
      return mesh ? bytesOf(mesh.userData.node, mesh.userData.faces) : 0;
    };
    tiles.setCamera(this.viewer.camera);
    tiles.setResolutionFromRenderer(this.viewer.camera, this.viewer.renderer);
    tiles.lost = new Set();
    tiles.addEventListener('load-error', ({ tile, error }) => this.lose(tiles, tile, error));
    tiles.addEventListener('needs-update', () => {
      this.viewer.loadSoon();
      this.viewer.wakeSoon();
    });
    this.group.add(tiles.group);
    return tiles;
  }

  // The layer whose values the voxels need; none for changes, and for maps without it.
  get layerName() {
    const name = BY_LAYER[this.viewer.colour];
    return this.id.includes('~') || !this.map.layers?.includes(name) ? null : name;
  }

  // Loads the voxels with the values of another layer, or with another legend.
  paintBy(legend) {
    const coloursOf = (one) => JSON.stringify(one && one.classes.map((each) => each.class));
    const isSame = coloursOf(this.legend) === coloursOf(legend);
    this.legend = legend;
    const { layerName } = this.next ?? this.tiles;
    // Voxels with unused values are kept.
    if (this.layerName && (layerName !== this.layerName || !isSame)) this.refresh();
  }

  // Handles a failed request of a tile, or of the root if there is no tile.
  lose(tiles, tile, error) {
    const isNext = tiles === this.next;
    if (this.isGone || (tiles !== this.tiles && !isNext)) return;
    this.viewer.say(`Cannot load a part of the map: ${error.message}`);
    if (tile) {
      tiles.lost.add(tile);
    } else if (isNext) {
      // Drop the next state: without its root it would never be complete, and later updates would wait for it.
      this.close(tiles);
      [this.next, this.again, this.isBehind] = [null, false, true];
    }
    this.retryLater();
  }

  retryLater() {
    if (this.retryTimer) return;
    this.retryTimer = setTimeout(() => this.retry(), this.retryMs);
    this.retryMs = Math.min(2 * this.retryMs, LAST_RETRY_MS);
  }

  retry() {
    this.retryTimer = null;
    for (const tiles of [this.tiles, this.next]) {
      if (!tiles) continue;
      // Tiles in the cache are not requested again, even if they failed.
      for (const tile of tiles.lost) if (tile.internal.loadingState === FAILED) tiles.lruCache.remove(tile);
      tiles.lost.clear();
      tiles.resetFailedTiles();
    }
    for (const url of this.lostNear) this.extra.delete(url);
    this.lostNear.clear();
    if (this.isBehind) this.refresh();
    this.viewer.wake();
  }

  close(tiles) {
    this.group.remove(tiles.group);
    tiles.dispose();
  }

  // Loads the current state in the background, and swaps when the tiles in view are loaded.
  refresh() {
    this.isBehind = false;
    if (this.next) {
      this.again = true;
      return;
    }
    this.next = this.open();
    this.next.group.visible = false;
    this.next.errorTarget = this.tiles.errorTarget;
    this.viewer.wake();
  }

  update() {
    const { camera, renderer } = this.viewer;
    for (const tiles of [this.tiles, this.next]) {
      if (!tiles) continue;
      tiles.setResolutionFromRenderer(camera, renderer);
      tiles.update();
      // Counts updates without pending requests: a file that was just loaded requests others only at the next update.
      tiles.calm = tiles.rootTileset && Layer.isIdle(tiles) ? (tiles.calm ?? 0) + 1 : 0;
    }
    if (this.next && Layer.isQuiet(this.next)) {
      this.close(this.tiles);
      [this.tiles, this.next] = [this.next, null];
      if (this.tiles.lost.size === 0) this.retryMs = FIRST_RETRY_MS;
      this.tiles.group.visible = true;
      this.viewer.wake();
      if (this.again) {
        this.again = false;
        this.refresh();
      }
    }
    this.updateNear();
  }

  // Number of nodes that the view needs at the level of detail, with those that are not loaded yet.
  get needed() {
    const { usedSet, errorTarget } = this.tiles;
    let count = this.near.children.length;
    for (const tile of usedSet) {
      const { used, inFrustum, error } = tile.traversal;
      if (!used || !inFrustum || (error > errorTarget && tile.children.length > 0)) continue;
      // Finer nodes that are shown until their parent is loaded do not count.
      let { parent } = tile;
      while (parent?.internal.hasUnrenderableContent) ({ parent } = parent);
      if (!parent || parent.traversal.error > errorTarget) count++;
    }
    return count;
  }

  // Keeps draw calls and memory within limits by selecting coarser levels; `adapts` is true until the level is stable.
  // `others` have the same level.
  adapt(others, isFrame) {
    const { tiles, viewer } = this;
    const all = [this, ...others];
    // Does not retry a level that was too fine until the view changes, to avoid flicker.
    const view = [...viewer.camera.matrixWorld.elements, viewer.canvas.width, viewer.canvas.height].join();
    if (view !== this.view) [this.view, this.finest] = [view, BEST_ERROR];
    const share = MAX_DRAWN / viewer.layers.length;
    const before = tiles.errorTarget;
    let isFull = isFrame && cache.isFull();
    for (;;) {
      const { errorTarget } = tiles;
      const needed = Math.max(...all.map((layer) => layer.needed));
      if (needed > share || isFull) tiles.errorTarget = this.finest = Math.min(STEP * errorTarget, MAX_ERROR);
      else if (needed < 0.6 * share) tiles.errorTarget = Math.max(Math.min(this.finest, errorTarget), errorTarget / STEP);
      isFull = false;
      if (tiles.errorTarget === errorTarget) break;
      for (const layer of all) layer.select(tiles.errorTarget);
    }
    const adapts = tiles.errorTarget !== before;
    for (const layer of all) layer.adapts = adapts;
  }

  // Selects the nodes of a level of detail. Requests of nodes that are not needed any more are cancelled.
  select(errorTarget) {
    for (const tiles of [this.tiles, this.next]) {
      if (!tiles) continue;
      tiles.errorTarget = errorTarget;
      tiles.update();
    }
  }

  static isIdle(tiles) {
    const { queued, downloading, parsing } = tiles.stats;
    return queued + downloading + parsing === 0 && !tiles.isLoading && !tiles.processNodeQueue.running;
  }

  static isQuiet(tiles) {
    const isEmpty = !tiles.root?.children?.length;
    return tiles.calm > (tiles.visibleTiles.size > 0 || isEmpty ? 2 : 20);
  }

  // Whether occupied voxels of the layer are visible.
  get isDrawn() {
    return this.isShown && this.opacity > 0;
  }

  // Returns whether everything in view is loaded.
  get isReady() {
    return Layer.isQuiet(this.tiles) && !this.adapts && !this.next && !this.waits;
  }

  // Memory of free and unknown voxels in bytes.
  get nearBytes() {
    return this.near.children.reduce((sum, { userData }) => sum + bytesOf(userData.node, userData.faces), 0);
  }

  meshes() {
    const meshes = [];
    for (const tile of this.tiles.visibleTiles) {
      const mesh = tile.engineData?.scene?.userData.mesh;
      if (mesh) meshes.push([mesh, tile]);
    }
    return meshes;
  }

  // Loads free and unknown voxels of the nearest tiles in view.
  updateNear() {
    // The nodes of a comparison have occupied voxels only.
    const kinds = ['free', 'unknown'].filter((kind) => this.viewer.shows[kind] && !this.id.includes('~~'));
    const wanted = new Set();
    if (kinds.length) {
      const leaves = this.meshes().filter(([mesh]) => mesh.userData.node.edge < 1.5 * this.map.resolution_m);
      leaves.sort((a, b) => a[1].traversal.distanceFromCamera - b[1].traversal.distanceFromCamera);
      for (const [, tile] of leaves.slice(0, MAX_NEAR)) {
        for (const kind of kinds) wanted.add(`${new URL(tile.content.uri, tile.internal.basePath + '/').href}&what=${kind}`);
      }
    }
    for (const [url, mesh] of this.extra) {
      if (wanted.has(url)) continue;
      if (mesh.isMesh) {
        this.near.remove(mesh);
        mesh.geometry.dispose();
      } else {
        mesh.request.abort();
      }
      this.extra.delete(url);
      this.lostNear.delete(url);
    }
    for (const url of wanted) {
      if (!this.extra.has(url)) this.loadNear(url, url.endsWith('free') ? 'free' : 'unknown');
    }
  }

  async loadNear(url, kind) {
    // A tile that left the view and returned has a newer load, which this one must not replace.
    const load = { isMesh: false, request: new AbortController() };
    const isCurrent = () => this.extra.get(url) === load;
    this.extra.set(url, load);
    this.waits = (this.waits ?? 0) + 1;
    try {
      const response = await fetch(url, { signal: load.request.signal });
      const mesh = meshOf(parseNode(await contentOf(response)), this.materials[kind]);
      if (!isCurrent() || this.isGone) {
        mesh.geometry.dispose();
        return;
      }
      this.extra.set(url, mesh);
      this.near.add(mesh);
      if (this.lostNear.size === 0 && this.tiles.lost.size === 0) this.retryMs = FIRST_RETRY_MS;
    } catch (error) {
      if (!isCurrent() || this.isGone) return;
      this.viewer.say(`Cannot load the voxels of a tile: ${error.message}`);
      this.lostNear.add(url);
      this.retryLater();
    } finally {
      this.waits--;
      this.viewer.wake();
    }
  }

  dispose() {
    this.isGone = true;
    clearTimeout(this.retryTimer);
    for (const tiles of [this.tiles, this.next]) tiles?.dispose();
    for (const mesh of this.extra.values()) mesh.isMesh ? mesh.geometry.dispose() : mesh.request.abort();
    this.group.removeFromParent();
  }
}
