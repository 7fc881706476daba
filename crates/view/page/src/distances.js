// Distances to obstacles in a layer of voxels, whose format docs/view.md describes.

import { contentOf } from './content.js';
import { OBSTACLE, colourAt } from './palette.js';

const HEADER_BYTES = 56;

// Returns the layer around a point: lower corner, size in voxels, and values by y, then x.
export async function readDistances(url, signal) {
  const response = await fetch(url, { signal });
  const buffer = await contentOf(response);
  const view = new DataView(buffer);
  if (view.getUint32(0) !== 0x56584431) throw new Error('the server has another version');
  const [width, height] = [view.getUint32(4, true), view.getUint32(8, true)];
  return {
    size: [width, height],
    corner: [16, 24, 32].map((at) => view.getFloat64(at, true)),
    edge: view.getFloat64(40, true),
    values: new Uint8Array(buffer, HEADER_BYTES, width * height),
  };
}

// Returns the colours of values: unknown voxels are transparent.
export function coloursOf(values) {
  const table = new Uint32Array(256);
  const bytes = new Uint8Array(table.buffer);
  for (let k = 1; k < 256; k++) bytes.set([...(k === 1 ? OBSTACLE : colourAt((k - 2) / 253)), 255], 4 * k);
  return new Uint8Array(Uint32Array.from(values, (value) => table[value]).buffer);
}
