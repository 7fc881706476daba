import * as THREE from 'three';

// Stops of the chosen colour map, in sRGB; the server sends those of all maps.
let stops = [[0, 0, 0], [255, 255, 255]];
// Blue, orange and grey are distinct with colour blindness.
export const CHANGES = [[0, 114, 208], [230, 126, 0], [150, 154, 162]];
// Classes of a comparison in the order of the server; no two of these six colours are similar, also with colour blindness.
export const CLASSES = [[76, 80, 88], [0, 114, 208], [230, 126, 0], [176, 180, 186], [176, 180, 186], [255, 232, 120], [255, 232, 120], [156, 252, 252]];
// Points on moving objects, as in pictures of maps: no other colour is similar, also with colour blindness.
export const MOVING = [190, 18, 24];
// Obstacles among distances, as in pictures of maps.
export const OBSTACLE = [226, 230, 236];
export const LAYERS = [[0, 114, 178], [230, 159, 0], [0, 158, 115], [204, 121, 167], [86, 180, 233], [213, 94, 0]];

export function colourAt(share) {
  const along = Math.min(Math.max(share, 0), 1) * (stops.length - 1);
  const low = Math.min(Math.floor(along), stops.length - 2);
  return stops[low].map((from, k) => Math.round(from + (along - low) * (stops[low + 1][k] - from)));
}

// Colours of values, for the drawing.
export const ramp = new THREE.DataTexture(new Uint8Array(4 * 256), 256, 1);
ramp.colorSpace = THREE.SRGBColorSpace;
ramp.magFilter = ramp.minFilter = THREE.LinearFilter;

// Chooses a colour map of `maps.json`.
export function chooseColours(map) {
  ({ stops } = map);
  for (let k = 0; k < 256; k++) ramp.image.data.set([...colourAt(k / 255), 255], 4 * k);
  ramp.needsUpdate = true;
}

// Draws the colours of a range, as shares of the canvas's width.
export function drawLegend(canvas, low = 0, high = 1) {
  const context = canvas.getContext('2d');
  for (let k = 0; k < canvas.width; k++) {
    context.fillStyle = `rgb(${colourAt((k / (canvas.width - 1) - low) / Math.max(high - low, 1e-6))})`;
    context.fillRect(k, 0, 1, canvas.height);
  }
}
