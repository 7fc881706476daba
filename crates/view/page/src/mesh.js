import * as THREE from 'three';
import { paintOf } from './layers.js';
import { facesOf } from './node.js';

const corners = new THREE.BufferAttribute(new Float32Array([0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0]), 3);
const quad = new THREE.BufferAttribute(new Uint16Array([0, 1, 2, 0, 2, 3]), 1);

// Returns a mesh with one quad per face in one draw call. `legend` is that of the layer whose values the node has.
export function meshOf(node, material, legend = null) {
  const faces = facesOf(node, node.values && paintOf(node, legend));
  const geometry = new THREE.InstancedBufferGeometry();
  geometry.setAttribute('position', corners);
  geometry.setIndex(quad);
  geometry.setAttribute('place', new THREE.InstancedBufferAttribute(faces.places, 4));
  geometry.setAttribute('levels', new THREE.InstancedBufferAttribute(faces.levels, 4));
  if (faces.paints) geometry.setAttribute('paint', new THREE.InstancedBufferAttribute(faces.paints, 4, true));
  geometry.instanceCount = faces.count;
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
    drawn.uniforms.isPainted.value = Boolean(node.values) && node.values.name === drawn.uniforms.layer.value;
    drawn.uniformsNeedUpdate = true;
  };
  return mesh;
}

// Returns the memory of a node in bytes: faces, and voxels for picking.
export const bytesOf = (node, faces) => (node.values ? 12 : 8) * faces + (node.values ? 9 : 5) * node.count;
