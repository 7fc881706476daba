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

// Returns an attribute with a copy of each four bytes for each corner of a face.
function ofCorners(bytes, isNormalized = false) {
  const faces = new Uint32Array(bytes.buffer);
  const corners = new Uint32Array(4 * faces.length);
  for (let k = 0; k < corners.length; k++) corners[k] = faces[k >> 2];
  return new THREE.BufferAttribute(new Uint8Array(corners.buffer), 4, isNormalized);
}

// Returns a mesh with one quad per face in one draw call. `legend` is that of the layer whose values the node has.
export function meshOf(node, material, legend = null) {
  const faces = facesOf(node, node.values && paintOf(node, legend));
  const geometry = new THREE.BufferGeometry();
  geometry.setIndex(quadsOf(faces.count));
  geometry.setDrawRange(0, 6 * faces.count);
  geometry.setAttribute('place', ofCorners(faces.places));
  geometry.setAttribute('levels', ofCorners(faces.levels));
  if (faces.paints) geometry.setAttribute('paint', ofCorners(faces.paints, true));
  const half = node.size / 2;
  geometry.boundingSphere = new THREE.Sphere(new THREE.Vector3(half, half, half), Math.sqrt(3) * half);
  geometry.boundingBox = new THREE.Box3(new THREE.Vector3(), new THREE.Vector3(node.size, node.size, node.size));
  const mesh = new THREE.Mesh(geometry, material);
  mesh.position.set(...node.corner);
  mesh.scale.setScalar(node.edge);
  mesh.userData.node = node;
  mesh.userData.faces = faces.count;
  mesh.raycast = () => {};
  mesh.onBeforeRender = (renderer, scene, camera, geometry_, drawn) => {
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
