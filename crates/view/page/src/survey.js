// Where most voxels of a map are, and which values they have: from its coarsest nodes.

import { contentOf } from './content.js';
import { parseNode } from './node.js';

// Number of voxels of the first view, sampled evenly.
const MAX_POINTS = 4000;
const share = (sorted, at) => sorted[Math.min(Math.floor(at * sorted.length), sorted.length - 1)];

// Returns the 2nd and the 98th percentile; `null` of no values.
export function percentiles(values) {
  if (values.length === 0) return null;
  const sorted = Float64Array.from(values).sort();
  return [share(sorted, 0.02), share(sorted, 0.98)];
}

const bytesOf = async (url) => contentOf(await fetch(url));
const jsonOf = async (url) => JSON.parse(new TextDecoder().decode(await bytesOf(url)));

// Returns the coarsest nodes of a tile: its own, or those of the file that has it.
async function nodesOf(tile, base) {
  const uris = [tile.content, ...(tile.contents ?? [])].filter(Boolean).map(({ uri }) => new URL(uri, base));
  const own = uris.find(({ pathname }) => pathname.endsWith('.vox'));
  if (own) return [parseNode(await bytesOf(own))];
  const files = await Promise.all(uris.map(async (uri) => nodesOf((await jsonOf(uri)).root, uri)));
  if (files.length) return files.flat();
  return (await Promise.all((tile.children ?? []).map((child) => nodesOf(child, base)))).flat();
}

// Returns the box of 98 % of the voxels along each axis, some of their centers within it, and percentiles of their
// values; `null` of an empty map.
export async function survey({ root }, base) {
  const nodes = (await nodesOf(root, base)).filter(({ count }) => count > 0);
  if (nodes.length === 0) return null;
  const edge = Math.max(...nodes.map((node) => node.edge));
  const along = [0, 1, 2].map((axis) => nodes.flatMap((node) => (
    Array.from([node.x, node.y, node.z][axis], (k) => node.corner[axis] + (k + 0.5) * node.edge))));
  const counts = nodes.flatMap((node) => Array.from(node.counts));
  const ends = along.map((values) => {
    const sorted = Float64Array.from(values).sort();
    return [share(sorted, 0.01) - edge / 2, share(sorted, 0.99) + edge / 2];
  });
  const [min, max] = [0, 1].map((end) => ends.map((pair) => pair[end]));
  const isInside = (k) => along.every((values, axis) => values[k] >= min[axis] && values[k] <= max[axis]);
  const inside = counts.flatMap((_, k) => (isInside(k) ? [k] : []));
  const step = Math.max(Math.floor(inside.length / MAX_POINTS), 1);
  const points = inside.filter((_, k) => k % step === 0).map((k) => along.map((values) => values[k]));
  const [low, high] = percentiles(along[2]);
  return { edge, along, core: { min, max }, points, heights: [low - edge / 2, high + edge / 2], counts: percentiles(counts) };
}

// Returns the horizontal direction of greatest extent, as a unit vector with x >= 0.
function axisOf(points) {
  const mean = [0, 1].map((axis) => points.reduce((sum, point) => sum + point[axis], 0) / points.length);
  let [xx, xy, yy] = [0, 0, 0];
  for (const [x, y] of points) {
    const [dx, dy] = [x - mean[0], y - mean[1]];
    [xx, xy, yy] = [xx + dx * dx, xy + dx * dy, yy + dy * dy];
  }
  const angle = 0.5 * Math.atan2(2 * xy, xx - yy);
  return [Math.cos(angle), Math.sin(angle)];
}

// Returns the direction of an oblique first view: across the longest extent of the trajectory, or of the map if the
// trajectory is short.
export function obliqueOf(points, path) {
  if (points.length === 0) return undefined;
  const extent = (list) => Math.hypot(...[0, 1].map((axis) => {
    const values = list.map((point) => point[axis]);
    return list.length ? values.reduce((a, b) => Math.max(a, b)) - values.reduce((a, b) => Math.min(a, b)) : 0;
  }));
  const [x, y] = axisOf(extent(path) > 0.25 * extent(points) ? path : points);
  // From the side that is nearer to the south, somewhat along the axis.
  const side = [y, -x];
  const sign = side[1] <= 0 ? 1 : -1;
  return [sign * side[0] - 0.45 * x, sign * side[1] - 0.45 * y, 0.75];
}
