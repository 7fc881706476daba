// Eye-dome lighting: darkens pixels that are farther away than their surroundings, from the depths of the picture alone.

import * as THREE from 'three';

// Distance of the compared pixels in CSS pixels.
const RADIUS = 1.4;

const vertex = /* glsl */ `
void main() {
  // A triangle that covers the picture.
  gl_Position = vec4(gl_VertexID == 1 ? 3.0 : -1.0, gl_VertexID == 2 ? 3.0 : -1.0, 0.0, 1.0);
}`;

const fragment = /* glsl */ `
uniform sampler2D colours;
uniform sampler2D depths;
uniform vec2 inverse;
uniform vec3 sky;
uniform int radius;
uniform float strength;
// The inverse of the distance is linear on planes, so that they have no shade from any direction.
float inverseAt(ivec2 at) {
  ivec2 last = textureSize(depths, 0) - 1;
  return mix(inverse.x, inverse.y, texelFetch(depths, clamp(at, ivec2(0), last), 0).r);
}
float pair(ivec2 at, ivec2 step, float own) {
  float both = 0.5 * (inverseAt(at + step) + inverseAt(at - step));
  return clamp(both / own - 1.0, 0.0, 0.04);
}
void main() {
  ivec2 at = ivec2(gl_FragCoord.xy);
  vec3 colour = texelFetch(colours, at, 0).rgb;
  float depth = texelFetch(depths, at, 0).r;
  if (depth == 1.0) {
    float high = gl_FragCoord.y / float(textureSize(depths, 0).y);
    gl_FragColor = vec4(colour + sky * (high - 0.5), 1.0);
    return;
  }
  float own = mix(inverse.x, inverse.y, depth);
  float sum = pair(at, ivec2(radius, 0), own) + pair(at, ivec2(0, radius), own)
    + pair(at, ivec2(radius, radius), own) + pair(at, ivec2(radius, -radius), own);
  gl_FragColor = vec4(colour * exp(-strength * sum), 1.0);
}`;

function targetOf(samples) {
  const target = new THREE.WebGLRenderTarget(1, 1, { samples, depthTexture: new THREE.DepthTexture(1, 1, THREE.FloatType) });
  // Colours are written in sRGB, as on the screen.
  target.isXRRenderTarget = true;
  target.texture.colorSpace = THREE.SRGBColorSpace;
  target.texture.internalFormat = 'RGBA8';
  return target;
}

// Draws a scene with shades.
export class Shading {
  constructor(renderer) {
    this.renderer = renderer;
    // Whether edges are smooth.
    this.isSmooth = true;
    this.targets = new Map([4, 0].map((samples) => [samples, targetOf(samples)]));
    this.material = new THREE.ShaderMaterial({
      vertexShader: vertex,
      fragmentShader: fragment,
      depthTest: false,
      depthWrite: false,
      uniforms: {
        colours: { value: null },
        depths: { value: null },
        inverse: { value: new THREE.Vector2() },
        sky: { value: new THREE.Vector3() },
        radius: { value: 1 },
        strength: { value: 7 },
      },
    });
    const geometry = new THREE.BufferGeometry();
    geometry.setDrawRange(0, 3);
    const screen = new THREE.Mesh(geometry, this.material);
    screen.frustumCulled = false;
    this.scene = new THREE.Scene();
    this.scene.add(screen);
    this.camera = new THREE.Camera();
  }

  // Sets how much lighter the background is at the top than at the bottom, from -1 to 1.
  setSky(red, green, blue) {
    this.material.uniforms.sky.value.set(red, green, blue);
  }

  // Draws the columns of pixels from `from` to `to`.
  draw(scene, camera, from = 0, to = Infinity) {
    const { renderer, material } = this;
    const { width, height } = renderer.domElement;
    const target = this.targets.get(this.isSmooth ? 4 : 0);
    material.uniforms.colours.value = target.texture;
    material.uniforms.depths.value = target.depthTexture;
    if (target.width !== width || target.height !== height) target.setSize(width, height);
    const radius = Math.max(Math.round(RADIUS * renderer.getPixelRatio()), 1);
    material.uniforms.radius.value = radius;
    material.uniforms.inverse.value.set(1 / camera.near, 1 / camera.far);
    const end = Math.min(to, width);
    const isPart = from > 0 || end < width;
    // Pixels next to the columns take part in their shades.
    const low = Math.max(from - radius, 0);
    target.scissorTest = isPart;
    target.scissor.set(low, 0, Math.min(end + radius, width) - low, height);
    renderer.setRenderTarget(target);
    renderer.render(scene, camera);
    renderer.setRenderTarget(null);
    renderer.setScissorTest(isPart);
    const ratio = renderer.getPixelRatio();
    renderer.setScissor(from / ratio, 0, (end - from) / ratio, height / ratio);
    renderer.render(this.scene, this.camera);
    renderer.setScissorTest(false);
  }
}
