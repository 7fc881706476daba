// Decodes map nodes (docs/view.md) and computes the faces of their voxels.

import { bytesOfValues, parseValues } from './layers.js';

const HEAD = 64;
// Maximum edge length of a node in voxels, with a margin on each side for neighbours.
const MAX_EDGE = 130;
const grid = new Uint16Array(MAX_EDGE * MAX_EDGE * MAX_EDGE);

export const KIND = { occupied: 0, free: 1, unknown: 2, change: 3, compared: 4 };

function steps(bytes) {
  const places = new Uint8Array(bytes.length);
  let at = 0;
  for (let i = 0; i < bytes.length; i++) {
    at = (at + bytes[i]) & 255;
    places[i] = at;
  }
  return places;
}

export function parseNode(buffer) {
  const view = new DataView(buffer);
  if (buffer.byteLength < HEAD || view.getUint32(0, false) !== 0x56584e31) throw new Error('not a map node');
  const count = view.getUint32(4, true);
  const layer = view.getUint8(47);
  if (buffer.byteLength !== HEAD + 5 * count + bytesOfValues(count, layer)) throw new Error('map node with a wrong length');
  const plane = (k) => new Uint8Array(buffer, HEAD + k * count, count);
  return {
    count,
    corner: [view.getFloat64(8, true), view.getFloat64(16, true), view.getFloat64(24, true)],
    edge: view.getFloat64(32, true),
    lastScan: view.getUint32(40, true),
    size: view.getUint16(44, true),
    kind: view.getUint8(46),
    least: view.getFloat32(48, true),
    most: view.getFloat32(52, true),
    threshold: view.getFloat32(56, true),
    x: steps(plane(0)), y: steps(plane(1)), z: steps(plane(2)),
    value: plane(3).slice(), counts: plane(4).slice(),
    values: layer ? parseValues(view, HEAD + 5 * count, count, layer) : null,
  };
}

const cell = (x, y, z) => x + 1 + MAX_EDGE * (y + 1 + MAX_EDGE * (z + 1));
// Steps to the six neighbours of a cell, by direction: +x -x +y -y +z -z.
const NEIGHBOURS = [1, -1, MAX_EDGE, -MAX_EDGE, MAX_EDGE * MAX_EDGE, -MAX_EDGE * MAX_EDGE];

// Buffers for the faces of a node, whose number is known only at the end. Those of up to 6 MiB are used again.
const KEPT_FACES = 1 << 19;
let buffers = null;

// Returns buffers for twice as many faces, with the same contents.
function grown(before) {
  return before.map((old) => {
    const numbers = new Uint32Array(2 * old.length);
    numbers.set(old);
    return numbers;
  });
}

// Returns the faces that any threshold can make visible, four bytes in a number for each: position and direction
// (`places`: x, y, z, +x -x +y -y +z -z), the value of the voxel, that of its neighbour plus one (0 without a neighbour),
// and the count (`levels`); and the voxel. The arrays are valid until the next call. Only occupied voxels (kind 0) have
// values to compare. Voxels of a comparison have sets of classes: a face is visible if some class of its voxel is shown,
// and none of its neighbour.
export function facesOf({ count, x, y, z, value, counts, kind }) {
  const isCompared = kind === KIND.compared;
  buffers ??= [0, 1, 2].map(() => new Uint32Array(1 << 14));
  let [voxels, places, levels] = buffers;
  for (let i = 0; i < count; i++) grid[cell(x[i], y[i], z[i])] = kind === KIND.occupied ? value[i] + 1 : isCompared ? value[i] : 256;
  let n = 0;
  for (let i = 0; i < count; i++) {
    const at = cell(x[i], y[i], z[i]);
    const own = grid[at];
    for (let side = 0; side < 6; side++) {
      const neighbour = grid[at + NEIGHBOURS[side]];
      // No threshold, or choice of classes, shows the voxel without its neighbour.
      const isHidden = isCompared ? (own & ~neighbour) === 0 : neighbour >= own;
      if (isHidden) continue;
      if (n === voxels.length) [voxels, places, levels] = grown([voxels, places, levels]);
      voxels[n] = i;
      places[n] = x[i] | y[i] << 8 | z[i] << 16 | side << 24;
      // Below 256: a neighbour of 256 hides the face.
      levels[n] = value[i] | neighbour << 8 | counts[i] << 16;
      n++;
    }
  }
  for (let i = 0; i < count; i++) grid[cell(x[i], y[i], z[i])] = 0;
  buffers = voxels.length > KEPT_FACES ? null : [voxels, places, levels];
  return { voxels, places, levels, count: n };
}

// Returns the positions of a node's voxels for ray casting, computed on first use.
export function placesOf(node) {
  if (!node.places) {
    node.places = new Map();
    for (let i = 0; i < node.count; i++) node.places.set(node.x[i] | node.y[i] << 8 | node.z[i] << 16, i);
  }
  return node.places;
}

export const logOddsOf = (node, value) => node.least + (node.most - node.least) * value / 255;
export const probabilityOf = (logOdds) => 1 / (1 + Math.exp(-logOdds));
export const observationsOf = (count) => Math.round(2 ** (count / 16) - 1);
