// Opens a folder of `voxtile export --format 3dtiles` in CesiumJS, in a real browser:
//
//   npm install --prefix FOLDER cesium; node crates/view/page/check/cesium.mjs TILES FOLDER/node_modules/cesium [PICTURE.png]
//
// Fails if a tile cannot be read or nothing is drawn.

import { createServer } from 'node:http';
import { readFile } from 'node:fs/promises';
import { writeFileSync } from 'node:fs';
import { extname, join, normalize } from 'node:path';
import { Browser } from './browser.mjs';

const [tiles, cesium, file] = process.argv.slice(2);
const TYPES = { '.js': 'text/javascript', '.json': 'application/json', '.glb': 'model/gltf-binary', '.css': 'text/css', '.wasm': 'application/wasm' };

const PAGE = `<!doctype html><meta charset="utf-8"><title>3D Tiles</title>
<style>html, body, #map, .cesium-widget, canvas { margin: 0; width: 100%; height: 100%; overflow: hidden }</style>
<div id="map"></div><p id="state" hidden>loading</p><p id="message" hidden></p>
<script>window.CESIUM_BASE_URL = '/cesium/Build/Cesium/';</script><script src="/cesium/Build/Cesium/Cesium.js"></script>
<script type="module">
  const say = (state, message = '') => {
    document.getElementById('message').textContent = message;
    document.getElementById('state').textContent = state;
  };
  try {
    const widget = new Cesium.CesiumWidget('map', { baseLayer: false, globe: false, skyBox: false, skyAtmosphere: false });
    const { scene, camera } = widget;
    scene.backgroundColor = Cesium.Color.WHITE;
    const tileset = await Cesium.Cesium3DTileset.fromUrl('/tiles/tileset.json', { maximumScreenSpaceError: 0.5 });
    scene.primitives.add(tileset);
    const found = { loaded: 0, failed: [], levels: new Set(), triangles: 0 };
    tileset.tileFailed.addEventListener(({ url, message }) => found.failed.push(url + ': ' + message));
    tileset.tileLoad.addEventListener((tile) => {
      found.loaded += 1;
      found.triangles += tile.content.trianglesLength;
    });
    tileset.tileVisible.addEventListener((tile) => found.levels.add(tile.geometricError));
    const { center, radius } = tileset.boundingSphere;
    // Coordinates are metres with z up, not on the Earth's surface.
    camera.frustum.near = 0.1;
    camera.setView({ destination: Cesium.Cartesian3.add(center, new Cesium.Cartesian3(0, -1.2 * radius, 1.2 * radius), new Cesium.Cartesian3()),
      orientation: { direction: Cesium.Cartesian3.normalize(new Cesium.Cartesian3(0, 1, -1), new Cesium.Cartesian3()),
        up: Cesium.Cartesian3.normalize(new Cesium.Cartesian3(0, 1, 1), new Cesium.Cartesian3()) } });
    tileset.allTilesLoaded.addEventListener(() => {
      window.found = JSON.stringify({ ...found, levels: [...found.levels].sort((a, b) => a - b) });
      // Draw once more with all tiles.
      requestAnimationFrame(() => requestAnimationFrame(() => say('ready')));
    });
  } catch (error) {
    say('failed', String(error));
  }
</script>`;

async function answer(request, response) {
  const path = normalize(decodeURIComponent(new URL(request.url, 'http://localhost').pathname));
  if (path === '/') return response.setHeader('content-type', 'text/html').end(PAGE);
  const [, room, ...rest] = path.split('/');
  const root = { tiles, cesium }[room];
  try {
    const body = await readFile(join(root, ...rest));
    response.setHeader('content-type', TYPES[extname(path)] ?? 'application/octet-stream').end(body);
  } catch {
    response.writeHead(404).end();
  }
}

const server = createServer(answer).listen(0, '127.0.0.1');
await new Promise((resolve) => server.once('listening', resolve));
const browser = new Browser(undefined, [640, 480]);
try {
  await browser.open(`http://127.0.0.1:${server.address().port}/`);
  await browser.ready(300);
  const found = JSON.parse(await browser.value('window.found'));
  if (file) writeFileSync(file, await browser.picture());
  console.log(JSON.stringify(found));
  if (found.failed.length) throw new Error(`Cesium could not read ${found.failed.join('; ')}`);
  if (!found.loaded || !found.triangles) throw new Error('Cesium drew nothing');
} catch (error) {
  console.error(error.message, browser.errors.join('\n'));
  process.exitCode = 1;
} finally {
  await browser.close();
  server.close();
}
