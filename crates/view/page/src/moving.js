// Reads points on moving objects, whose format docs/view.md describes.

import { contentOf } from './content.js';

const HEADER_BYTES = 56;

// Returns the points as offsets from their origin, in metres. They are left out if `known` is the version of the marks.
export async function readMoving(url, known) {
  const response = await fetch(known === null ? url : `${url}?v=${known}`);
  const buffer = await contentOf(response);
  const view = new DataView(buffer);
  if (view.getUint32(0) !== 0x56584d31) throw new Error('the server has another version');
  const count = view.getUint32(4, true);
  return {
    count,
    all: Number(view.getBigUint64(8, true)),
    version: view.getBigUint64(16, true).toString(16),
    origin: [24, 32, 40].map((at) => view.getFloat64(at, true)),
    keepsScans: view.getUint32(48, true) === 1,
    offsets: new Float32Array(buffer, HEADER_BYTES, 3 * count),
  };
}
