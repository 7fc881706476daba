import * as THREE from 'three';
import { placesOf } from './node.js';

const ray = new THREE.Ray();
const local = new THREE.Ray();
const box = new THREE.Box3();
const entry = new THREE.Vector3();

// Returns the entry point of a ray into the first visible voxel of a mesh, by voxel traversal.
function walk(mesh, isSeen) {
  const node = mesh.userData.node;
  const places = placesOf(node);
  const start = box.containsPoint(local.origin) ? local.origin : entry;
  const from = start.toArray();
  const way = local.direction.toArray();
  const at = from.map((k) => Math.min(Math.max(Math.floor(k), 0), node.size - 1));
  const step = way.map(Math.sign);
  const delta = way.map((k) => (k === 0 ? Infinity : Math.abs(1 / k)));
  const next = way.map((k, axis) => (k === 0 ? Infinity : ((k > 0 ? at[axis] + 1 : at[axis]) - from[axis]) / k));
  let along = 0;
  while (at.every((k) => k >= 0 && k < node.size)) {
    const found = places.get(at[0] | at[1] << 8 | at[2] << 16);
    if (found !== undefined && isSeen(node, found, at)) {
      const hit = start.clone().addScaledVector(local.direction, along);
      return { node, voxel: found, at: at.slice(), distance: hit.distanceTo(local.origin) * node.edge };
    }
    const axis = next[0] < next[1] ? (next[0] < next[2] ? 0 : 2) : (next[1] < next[2] ? 1 : 2);
    along = next[axis];
    next[axis] += delta[axis];
    at[axis] += step[axis];
  }
  return null;
}

// Returns the nearest voxel at a screen position, from -1 to 1 along both axes.
export function pick(viewer, x, y) {
  const caster = new THREE.Raycaster();
  caster.setFromCamera(new THREE.Vector2(x, y), viewer.camera);
  ray.copy(caster.ray);
  let best = null;
  for (const layer of viewer.layers.filter((layer) => layer.isDrawn && viewer.isAt(layer, x))) {
    for (const [mesh] of layer.meshes()) {
      const inverse = mesh.matrixWorld.clone().invert();
      local.copy(ray).applyMatrix4(inverse);
      local.direction.normalize();
      box.set(new THREE.Vector3(), new THREE.Vector3().setScalar(mesh.userData.node.size));
      if (!local.intersectBox(box, entry)) continue;
      const found = walk(mesh, (node, voxel, at) => viewer.isSeen(layer, node, voxel, at));
      if (found && (!best || found.distance < best.distance)) best = { ...found, layer };
    }
  }
  return best;
}

export const centerOf = ({ node, at }) => at.map((k, axis) => node.corner[axis] + (k + 0.5) * node.edge);
