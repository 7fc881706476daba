import * as THREE from 'three';
import { paintOf } from './layers.js';
import { facesOf } from './node.js';

// Indices of quads of four vertices, shared by all meshes. Instances of a quad would need a quarter of the memory, but
// software WebGL draws them more slowly by a factor of 20, and GPUs do not like them either.
let quads = new THREE.BufferAttribute(new Uint32Array(0), 1);
function quadsOf(count) {
  if (quads.count < 6 * count) {
    const indices = new Uint32Array(6 * Math.max(count, 2 * quads.count / 6, 1 << 15));
    for (let k = 0; k < indices.length; k++) indices[k] = 4 * Math.floor(k / 6) + [0, 1, 2, 0, 2, 3][k % 6];
    quads = new THREE.BufferAttribute(indices, 1);
  }
  return quads;
}

// Returns an attribute with a copy of four bytes, the number of each face, for each of its corners. `slots` are the
// positions of the faces in it.
function ofCorners(count, slots, numberOf, isNormalized = false) {
  const corners = new Uint32Array(4 * count);
  for (let k = 0; k < count; k++) {
    const [number, at] = [numberOf(k), 4 * slots[k]];
    corners[at] = corners[at + 1] = corners[at + 2] = corners[at + 3] = number;
  }
  return new THREE.BufferAttribute(new Uint8Array(corners.buffer), 4, isNormalized);
}

// Order of the directions of faces (+x -x +y -y +z -z) in a mesh, so that those on one side of it are adjacent.
const ORDER = [0, 2, 4, 1, 3, 5];

// Faces of a node by direction. A camera outside of a node sees faces of three directions at most.
class Sides {
  constructor({ count, places }) {
    this.counts = new Array(6).fill(0);
    // Coordinate of the rearmost faces of each direction: a camera behind them sees none. Faces to +x are visible only
    // from a greater x, faces to -x only from a smaller one.
    this.planes = [0, 1, 2, 3, 4, 5].map((side) => (side & 1 ? -Infinity : Infinity));
    for (let k = 0; k < count; k++) {
      const side = places[k] >>> 24;
      const at = places[k] >> 8 * (side >> 1) & 255;
      this.counts[side]++;
      if (side & 1) this.planes[side] = Math.max(this.planes[side], at);
      else this.planes[side] = Math.min(this.planes[side], at + 1);
    }
    this.starts = [];
    let start = 0;
    for (const side of ORDER) {
      this.starts[side] = start;
      start += this.counts[side];
    }
  }

  // Returns the position of each face in the mesh.
  slots({ count, places }) {
    const next = [...this.starts];
    return Uint32Array.from({ length: count }, (_, k) => next[places[k] >>> 24]++);
  }

  // Selects the faces whose direction a camera may see from a place in the node's voxels.
  select(eye, mesh) {
    let ranges = 0;
    let end = -1;
    for (const side of ORDER) {
      const [count, start, along] = [this.counts[side], this.starts[side], eye[side >> 1]];
      const isSeen = side & 1 ? along < this.planes[side] + 1e-3 : along > this.planes[side] - 1e-3;
      if (count === 0 || !isSeen) continue;
      if (start === end) {
        mesh._multiDrawCounts[ranges - 1] += 6 * count;
      } else {
        [mesh._multiDrawStarts[ranges], mesh._multiDrawCounts[ranges]] = [24 * start, 6 * count];
        ranges++;
      }
      end = start + count;
    }
    mesh._multiDrawCount = ranges;
  }
}

// Mesh of which some ranges are drawn in one call: what three.js has of a mesh of several objects.
class RangesMesh extends THREE.Mesh {
  isBatchedMesh = true;
  _multiDrawStarts = new Int32Array(6);
  _multiDrawCounts = new Int32Array(6);
  _multiDrawCount = 0;
  _colorsTexture = null;
}

// Returns a mesh with one quad per face in one draw call. `legend` is that of the layer whose values the node has.
export function meshOf(node, material, legend = null) {
  const faces = facesOf(node);
  const { count, voxels, places, levels } = faces;
  const sides = new Sides(faces);
  const slots = sides.slots(faces);
  const geometry = new THREE.BufferGeometry();
  geometry.setIndex(quadsOf(count));
  geometry.setAttribute('place', ofCorners(count, slots, (k) => places[k]));
  geometry.setAttribute('levels', ofCorners(count, slots, (k) => levels[k]));
  if (node.values) {
    const paint = new Uint32Array(paintOf(node, legend).buffer);
    geometry.setAttribute('paint', ofCorners(count, slots, (k) => paint[voxels[k]], true));
  }
  const half = node.size / 2;
  geometry.boundingSphere = new THREE.Sphere(new THREE.Vector3(half, half, half), Math.sqrt(3) * half);
  geometry.boundingBox = new THREE.Box3(new THREE.Vector3(), new THREE.Vector3(node.size, node.size, node.size));
  const mesh = new RangesMesh(geometry, material);
  mesh.position.set(...node.corner);
  mesh.scale.setScalar(node.edge);
  mesh.userData.node = node;
  mesh.userData.faces = count;
  mesh.raycast = () => {};
  mesh.onBeforeRender = (renderer, scene, camera, geometry_, drawn) => {
    const [eye, at] = [camera.matrixWorld.elements, mesh.matrixWorld.elements];
    sides.select([12, 13, 14].map((k) => (eye[k] - at[k]) / node.edge), mesh);
    drawn.uniforms.lastScan.value = node.lastScan === 0xffffffff ? 0 : node.lastScan;
    const { values } = node;
    const isPainted = Boolean(values) && values.name === drawn.uniforms.layer.value;
    drawn.uniforms.painted.value = !isPainted ? 0 : values.planes || values.name === 'class' ? 1 : 2;
    if (drawn.uniforms.painted.value === 2) {
      // Shares of the range at the numbers 1 and 65535; times are too large for single precision.
      const [low, high] = drawn.uniforms.paintRange.value;
      const share = (value) => (value - low) / Math.max(high - low, 1e-9);
      drawn.uniforms.paintShares.value.set(share(values.least), share(values.most));
    }
    drawn.uniformsNeedUpdate = true;
  };
  return mesh;
}

// Returns the memory of a node in bytes: faces, and voxels for picking.
export const bytesOf = (node, faces) => (node.values ? 48 : 32) * faces + (node.values ? 9 : 5) * node.count;
