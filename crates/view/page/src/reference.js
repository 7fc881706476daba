// Heights of the trajectory, or of the ground if there is none, along x and y: colours show heights above them.

import * as THREE from 'three';

// Cells of the longer side.
const MAX_CELLS = 192;
// Maximum width of buildings, in metres.
const NARROW_M = 40;
// Steps that are longer than this many usual ones, and than this length, are jumps, such as the start of another
// recording.
const JUMP_STEPS = 8;
const MIN_JUMP_M = 5;

// Fills cells without a height from the nearest ones with one.
function spread(heights, width) {
  const height = heights.length / width;
  let border = [];
  for (let k = 0; k < heights.length; k++) if (!Number.isNaN(heights[k])) border.push(k);
  while (border.length) {
    const next = [];
    for (const k of border) {
      const [x, y] = [k % width, Math.floor(k / width)];
      for (const [i, j] of [[x + 1, y], [x - 1, y], [x, y + 1], [x, y - 1]]) {
        if (i < 0 || j < 0 || i >= width || j >= height || !Number.isNaN(heights[i + width * j])) continue;
        heights[i + width * j] = heights[k];
        next.push(i + width * j);
      }
    }
    border = next;
  }
}

// Returns the lowest values around each cell along both axes (or the highest, with `Math.max`).
function extremes(heights, width, reach, of) {
  let found = heights;
  for (const [step, count] of [[1, width], [width, heights.length / width]]) {
    const before = found;
    found = before.map((value, k) => {
      const at = Math.floor(k / step) % count;
      let best = value;
      for (let away = Math.max(-reach, -at); away <= Math.min(reach, count - 1 - at); away++) best = of(best, before[k + away * step]);
      return best;
    });
  }
  return found;
}

// Returns the horizontal length of the step to each position.
const lengthsOf = (path) => path.map((at, k) => (k ? Math.hypot(at[0] - path[k - 1][0], at[1] - path[k - 1][1]) : 0));

// Returns the positions after jumps. Usual steps are at least `least` metres: the edge of two voxels. The usual step is
// the median without those of less than a tenth of a voxel, because a sensor may stand still most of the time.
export function startsOf(path, least) {
  const lengths = lengthsOf(path);
  const sorted = Float64Array.from(lengths.filter((length) => length > 0.05 * least)).sort();
  const longest = Math.max(JUMP_STEPS * Math.max(sorted[Math.floor(sorted.length / 2)] ?? 0, least), MIN_JUMP_M);
  return lengths.flatMap((length, k) => (length > longest ? [k] : []));
}

// Heights on a grid of square cells around a box, in map coordinates: of the trajectory, or of the ground.
export class Reference {
  // `bounds` are those of the maps, `path` positions of the sensor, `resolution` the edge of the finest voxels.
  constructor(bounds, path, resolution) {
    this.isOfTrajectory = path.length > 0;
    const size = [0, 1].map((axis) => Math.max(bounds.max[axis] - bounds.min[axis], 1e-3));
    this.cell = Math.max(Math.max(...size) / MAX_CELLS, 2 * resolution);
    this.low = bounds.min.slice(0, 2);
    [this.width, this.height] = size.map((length) => Math.ceil(length / this.cell) + 1);
    // Heights that are known, and the voxels' edge that they are known to.
    this.known = new Float64Array(this.width * this.height).fill(NaN);
    this.edges = new Float64Array(this.width * this.height).fill(Infinity);
    const lengths = lengthsOf(path);
    const starts = new Set(startsOf(path, 2 * this.cell));
    path.forEach((at, k) => {
      // Cells between positions, too, except across jumps.
      const before = path[Math.max(k - 1, 0)];
      const steps = starts.has(k) ? 1 : Math.min(Math.ceil(lengths[k] / this.cell) + 1, 2 * (this.width + this.height));
      for (let step = 1; step <= steps; step++) {
        const cell = this.cellOf(at.map((value, axis) => before[axis] + (value - before[axis]) * step / steps));
        if (cell !== null) this.known[cell] = before[2] + (at[2] - before[2]) * step / steps;
      }
    });
    this.fill();
  }

  // Adds the voxels of a node to the ground. Finer voxels replace coarser ones.
  add({ count, x, y, z, corner, edge }) {
    for (let i = 0; i < count; i++) {
      const cell = this.cellOf([corner[0] + (x[i] + 0.5) * edge, corner[1] + (y[i] + 0.5) * edge]);
      const bottom = corner[2] + z[i] * edge;
      if (cell === null || edge > 1.01 * this.edges[cell]) continue;
      if (edge < 0.99 * this.edges[cell] || bottom < this.known[cell]) this.known[cell] = bottom;
      this.edges[cell] = edge;
    }
  }

  // Fills cells without a height. What is narrower than `NARROW_M` stands on the ground.
  fill() {
    this.heights = this.known.slice();
    if (this.heights.every(Number.isNaN)) this.heights.fill(0);
    spread(this.heights, this.width);
    if (this.isOfTrajectory) return;
    const reach = Math.min(Math.ceil(0.5 * NARROW_M / this.cell), 24);
    this.heights = extremes(extremes(this.heights, this.width, reach, Math.min), this.width, reach, Math.max);
  }

  cellOf([x, y]) {
    const [i, j] = [x, y].map((value, axis) => Math.floor((value - this.low[axis]) / this.cell));
    return i < 0 || j < 0 || i >= this.width || j >= this.height ? null : i + this.width * j;
  }

  // Returns the height of a place above the reference.
  above(at) {
    const k = this.cellOf(at);
    return k === null ? 0 : at[2] - this.heights[k];
  }

  // Returns the heights as a texture, relative to `middle`, because `f32` is too coarse for large coordinates.
  texture(middle) {
    const values = Float32Array.from(this.heights, (value) => value - middle);
    const made = new THREE.DataTexture(values, this.width, this.height, THREE.RedFormat, THREE.FloatType);
    made.needsUpdate = true;
    return made;
  }
}
