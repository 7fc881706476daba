import * as THREE from 'three';
import { NO_VALUE } from './layers.js';
import { CHANGES, CLASSES, MOVING, ramp } from './palette.js';
import { KIND } from './node.js';

const vertex = /* glsl */ `
attribute vec4 place;
attribute vec4 levels;
attribute vec4 paint;
uniform float threshold;
uniform vec3 low, high;
uniform int colourBy;
uniform highp sampler2D reference;
uniform vec3 referenceAt;
uniform vec2 range;
uniform float lastScan;
uniform int kind;
uniform int classes;
uniform vec3 classColours[8];
varying vec2 corner;
varying float share;
varying float light;
varying float change;
varying vec3 classColour;
varying vec4 layerColour;
// Height of the trajectory or ground, between the centers of cells.
float referenceOf(vec2 at) {
  vec2 cell = (at - referenceAt.xy) / referenceAt.z - 0.5;
  ivec2 last = textureSize(reference, 0) - 1;
  ivec2 low = clamp(ivec2(floor(cell)), ivec2(0), last);
  ivec2 high = min(low + 1, last);
  vec2 along = clamp(cell - vec2(low), 0.0, 1.0);
  vec2 below = vec2(texelFetch(reference, low, 0).r, texelFetch(reference, ivec2(high.x, low.y), 0).r);
  vec2 beyond = vec2(texelFetch(reference, ivec2(low.x, high.y), 0).r, texelFetch(reference, high, 0).r);
  vec2 rows = mix(below, beyond, along.y);
  return mix(rows.x, rows.y, along.x);
}
void main() {
  int side = int(place.w + 0.5);
  bool isSeen = kind != 0 || (levels.x >= threshold && (levels.y < 0.5 || levels.y - 1.0 < threshold));
  if (kind == 4) {
    int own = int(levels.x + 0.5) & classes;
    isSeen = own != 0 && (int(levels.y + 0.5) & classes) == 0;
    // Appeared and vanished voxels hide uncertain ones, and these those that one map has not seen, hidden ones, and unchanged ones.
    classColour = (own & 2) != 0 ? classColours[1] : (own & 4) != 0 ? classColours[2] : (own & 96) != 0 ? classColours[5]
      : (own & 24) != 0 ? classColours[3] : (own & 128) != 0 ? classColours[7] : classColours[0];
  }
  vec3 mid = (modelMatrix * vec4(place.xyz + 0.5, 1.0)).xyz;
  isSeen = isSeen && all(greaterThanEqual(mid, low)) && all(lessThanEqual(mid, high));
  if (!isSeen) { gl_Position = vec4(2.0, 2.0, 2.0, 1.0); return; }
  int number = gl_VertexID & 3;
  vec2 uv = vec2(number == 1 || number == 2, number > 1);
  vec3 at;
  // Corners are counterclockwise seen from outside.
  if (side == 0) { at = vec3(1.0, uv); light = 0.86; }
  else if (side == 1) { at = vec3(0.0, uv.y, uv.x); light = 0.66; }
  else if (side == 2) { at = vec3(uv.y, 1.0, uv.x); light = 0.78; }
  else if (side == 3) { at = vec3(uv.x, 0.0, uv.y); light = 0.72; }
  else if (side == 4) { at = vec3(uv, 1.0); light = 1.0; }
  else { at = vec3(uv.y, uv.x, 0.0); light = 0.5; }
  corner = uv;
  change = levels.x;
  layerColour = paint;
  float value = colourBy <= 0 ? mid.z : colourBy == 1 ? levels.x : colourBy == 2 ? levels.z
    : colourBy == 3 ? lastScan : mid.z - referenceOf(mid.xy);
  share = clamp((value - range.x) / max(range.y - range.x, 1e-6), 0.0, 1.0);
  gl_Position = projectionMatrix * modelViewMatrix * vec4(place.xyz + at, 1.0);
}`;

const fragment = /* glsl */ `
uniform sampler2D ramp;
uniform vec2 opacity;
uniform vec4 tint;
uniform vec3 changes[3];
uniform int kind;
uniform int painted;
uniform vec2 paintShares;
uniform vec3 noValue;
varying vec2 corner;
varying float share;
varying float light;
varying float change;
varying vec3 classColour;
varying vec4 layerColour;
vec3 linearOf(vec3 c) { return mix(c / 12.92, pow((c + 0.055) / 1.055, vec3(2.4)), step(0.04045, c)); }
// Thresholds of 4 x 4 pixels, in an order in which neighbours differ most.
float thresholdOf(ivec2 at) {
  ivec2 low = at & 1, high = at >> 1 & 1;
  return (float(4 * ((low.x ^ low.y) * 2 + low.y) + (high.x ^ high.y) * 2 + high.y) + 0.5) / 16.0;
}
void main() {
  // A map of partial opacity leaves out pixels, other ones than the other maps do: no order of drawing is needed.
  if (opacity.x < 1.0 && thresholdOf(ivec2(gl_FragCoord.xy) + ivec2(opacity.y) * ivec2(1, 2)) >= opacity.x) discard;
  vec3 colour = texture2D(ramp, vec2(share * 255.0 / 256.0 + 0.5 / 256.0, 0.5)).rgb;
  if (kind == 3) colour = change < 1.5 ? changes[0] : change < 2.5 ? changes[1] : changes[2];
  else if (kind == 4) colour = classColour;
  else if (painted == 1) colour = layerColour.a > 0.5 ? linearOf(layerColour.rgb) : noValue;
  else if (painted == 2) {
    float number = dot(round(layerColour.rg * 255.0), vec2(1.0, 256.0));
    float along = mix(paintShares.x, paintShares.y, (number - 1.0) / 65534.0);
    colour = layerColour.a > 0.5 ? texture2D(ramp, vec2(clamp(along, 0.0, 1.0) * 255.0 / 256.0 + 0.5 / 256.0, 0.5)).rgb : noValue;
  }
  else if (tint.a > 0.0) colour = tint.rgb * (0.55 + 0.45 * share);
  // Draw borders if a voxel is large enough on the screen.
  vec2 pixel = fwidth(corner);
  vec2 inside = min(corner, 1.0 - corner) / max(pixel, vec2(1e-6));
  float border = 1.0 - smoothstep(0.0, 1.5, min(inside.x, inside.y));
  float near = 1.0 - smoothstep(0.08, 0.25, max(pixel.x, pixel.y));
  gl_FragColor = vec4(colour * light * (1.0 - 0.35 * border * near), kind == 1 ? 0.10 : kind == 2 ? 0.22 : 1.0);
  #include <colorspace_fragment>
}`;

const linear = (rgb) => new THREE.Color().setRGB(...rgb.map((k) => k / 255), THREE.SRGBColorSpace);

// Returns a material for a layer and kind, with shared uniforms.
export function makeMaterial(kind, shared) {
  const isClear = kind === KIND.free || kind === KIND.unknown;
  const tint = kind === KIND.free ? [70, 150, 220] : kind === KIND.unknown ? [200, 120, 200] : null;
  const own = tint ? linear(tint) : null;
  return new THREE.ShaderMaterial({
    vertexShader: vertex,
    fragmentShader: fragment,
    transparent: isClear,
    depthWrite: !isClear,
    uniforms: {
      ...shared,
      kind: { value: kind },
      ramp: { value: ramp },
      changes: { value: CHANGES.map(linear) },
      classColours: { value: CLASSES.map(linear) },
      tint: { value: own ? new THREE.Vector4(own.r, own.g, own.b, 1) : new THREE.Vector4(0, 0, 0, 0) },
      threshold: { value: 0 },
      // Opacity, and the number of the map.
      opacity: { value: new THREE.Vector2(1, 0) },
      range: { value: new THREE.Vector2(0, 1) },
      lastScan: { value: 0 },
      // Name of the layer that is shown, and whether the drawn node has its colours (1) or its numbers (2).
      layer: { value: null },
      painted: { value: 0 },
      paintShares: { value: new THREE.Vector2(0, 1) },
      noValue: { value: linear(NO_VALUE) },
    },
  });
}

const pointVertex = /* glsl */ `
uniform vec3 low, high;
uniform float edge;
uniform vec2 pixels;
varying float rimDepth;
void main() {
  vec3 at = (modelMatrix * vec4(position, 1.0)).xyz;
  if (any(lessThan(at, low)) || any(greaterThan(at, high))) { gl_Position = vec4(2.0, 2.0, 2.0, 1.0); return; }
  vec4 eye = modelViewMatrix * vec4(position, 1.0);
  gl_Position = projectionMatrix * eye;
  vec4 behind = projectionMatrix * (eye - vec4(0.0, 0.0, edge, 0.0));
  rimDepth = 0.5 + 0.5 * behind.z / behind.w;
  gl_PointSize = max(3.0, 0.5 * edge * projectionMatrix[1][1] * pixels.y / gl_Position.w);
}`;

// Discs with a light rim differ from voxels in shape, too. Rims are behind the discs, so that dense points form an area.
const pointFragment = /* glsl */ `
uniform vec3 colour;
varying float rimDepth;
void main() {
  float radius = 2.0 * length(gl_PointCoord - 0.5);
  if (radius > 1.0) discard;
  bool isRim = radius > 0.75;
  gl_FragDepth = isRim ? rimDepth : gl_FragCoord.z;
  gl_FragColor = vec4(isRim ? vec3(1.0) : colour, 1.0);
  #include <colorspace_fragment>
}`;

// Returns the material of moving points; `edge` is their diameter in metres. Cuts apply to them.
export const pointMaterial = (edge, shared) => new THREE.ShaderMaterial({
  vertexShader: pointVertex,
  fragmentShader: pointFragment,
  uniforms: { ...shared, edge: { value: edge }, pixels: { value: new THREE.Vector2() }, colour: { value: linear(MOVING) } },
});

export function tintLayer(material, rgb) {
  const colour = linear(rgb);
  material.uniforms.tint.value.set(colour.r, colour.g, colour.b, 1);
}

export const sharedUniforms = () => ({
  low: { value: new THREE.Vector3(-Infinity, -Infinity, -Infinity) },
  high: { value: new THREE.Vector3(Infinity, Infinity, Infinity) },
  colourBy: { value: 0 },
  // Heights of the trajectory or ground; lower corner along x and y, and edge of a cell.
  reference: { value: null },
  referenceAt: { value: new THREE.Vector3(0, 0, 1) },
  // Range of the colours of intensities and times.
  paintRange: { value: [0, 1] },
  // Classes of a comparison that are shown, as bits.
  classes: { value: 255 },
});
