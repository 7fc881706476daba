// State that the parts of the page share.

import { Comparison } from './comparison.js';
import { $, json, say, swatchOf } from './dom.js';
import { Ground } from './ground.js';
import { readLink } from './link.js';
import { Swipe } from './swipe.js';
import { Viewer } from './viewer.js';

export const app = {
  // Maps of `maps.json` that are shown.
  maps: [],
  // Colour maps of the server.
  colourMaps: [],
  // Level of the finest voxels in a page that is a folder of files; `null` with a server.
  finest: null,
  // State in the URL.
  link: readLink(),
  // Action of a click: query, measure, or sight.
  tool: 'query',
  // Result of the last query.
  answered: null,
  // Legend of the layer by which voxels are coloured, and the numbers of the last request for it and of the shown one.
  legend: null,
  legendNumber: 0,
  legendShown: 0,
  // Positions of the sensor.
  path: [],
  showsCeiling: false,
  // Marked points of the first map that were loaded last.
  moving: null,
  // Distances that are shown.
  distances: null,
};

export let viewer;
try {
  viewer = new Viewer($('scene'), say);
} catch (error) {
  $('state').textContent = 'no WebGL';
  say(`Cannot draw 3D in this browser: ${error.message}`);
  throw error;
}
export const comparison = new Comparison({ viewer, json, say, swatchOf });
export const swipe = new Swipe(viewer);
export const ground = new Ground(viewer);
