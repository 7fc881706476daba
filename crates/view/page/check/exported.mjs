import assert from 'node:assert/strict';
import { spawn } from 'node:child_process';
import { once } from 'node:events';
import { mkdirSync, readFileSync } from 'node:fs';
import { createServer } from 'node:http';
import { join } from 'node:path';
import { gzipSync } from 'node:zlib';

async function freePort() {
  const probe = createServer().listen(0, '127.0.0.1');
  await once(probe, 'listening');
  const { port } = probe.address();
  probe.close();
  return port;
}

// Serves a folder with Python's web server, which compresses nothing.
async function servedByPython(folder, ended) {
  const port = await freePort();
  const server = spawn('python3', ['-m', 'http.server', String(port), '--bind', '127.0.0.1', '-d', folder], { stdio: 'ignore' });
  ended.push(() => server.kill());
  for (let k = 0; ; k++) {
    try {
      await fetch(`http://127.0.0.1:${port}/`);
      return `http://127.0.0.1:${port}/`;
    } catch (error) {
      if (k === 100) throw error;
      await new Promise((resolve) => setTimeout(resolve, 100));
    }
  }
}

// Serves a folder as web servers that compress everything do.
async function servedCompressed(folder, ended) {
  const server = createServer((request, response) => {
    const path = new URL(request.url, 'http://host').pathname;
    try {
      const bytes = readFileSync(join(folder, path.endsWith('/') ? `${path}index.html` : path));
      const type = { html: 'text/html', js: 'text/javascript', css: 'text/css', json: 'application/json' }[path.split('.').pop()];
      response.writeHead(200, { 'content-encoding': 'gzip', 'content-type': type ?? (path.endsWith('/') ? 'text/html' : 'application/octet-stream') });
      response.end(gzipSync(bytes));
    } catch {
      response.writeHead(404).end('nothing here');
    }
  }).listen(0, '127.0.0.1');
  ended.push(() => server.close());
  await once(server, 'listening');
  return `http://127.0.0.1:${server.address().port}/`;
}

const isReady = 'document.getElementById("state").textContent === "ready"';
const voxels = (browser) => browser.value('(({ centers, edges }) => [centers.map((center) => center.map((k) => Math.round(1000 * k)).join(" ")).sort(), edges])(voxtile.voxels())');

// Tests a page that was exported to a folder, against the page of the server.
export async function checkExported({ browser, view, map, run, work, ended }) {
  mkdirSync(join(work, 'static', 'deep'), { recursive: true });
  run('view', map, '--export-page', join(work, 'static', 'deep', 'page'), '-q', '--no-cache');
  const open = async (url) => {
    await browser.open('about:blank');
    await browser.open(url);
    await browser.ready();
    await browser.value('voxtile.detail = 0.1');
    await browser.until(`${isReady} && voxtile.voxels().edges.join() === '0.1'`, 30);
  };
  await open(await view(map));
  const live = await voxels(browser);
  const path = await browser.value('document.getElementById("scan-out").value');
  const folder = join(work, 'static');
  for (const serve of [servedByPython, servedCompressed]) {
    await open(`${await serve(folder, ended)}deep/page/`);
    assert.deepEqual(await voxels(browser), live, serve.name);
    assert.equal(await browser.value('document.getElementById("scan-out").value'), path);
  }
  // Layers, and what needs the server.
  const isShown = (id) => browser.value(`document.getElementById('${id}').checkVisibility()`);
  assert.equal(await isShown('exported'), true);
  for (const id of ['free', 'unknown', 'distances', 'tool-sight', 'since']) assert.equal(await isShown(id), false, id);
  await browser.value(`document.getElementById('colour').value = 'class'; document.getElementById('colour').dispatchEvent(new Event('change'))`);
  await browser.until(`voxtile.painted() === 'class' && ${isReady}`, 30);
  assert.match(await browser.value('document.getElementById("legend-classes").innerText.replace(/\\s+/g, " ")'), /2 ground [0-9,]+ 6 building [0-9,]+/);
  await browser.value('voxtile.lookAt([2, 2, 6], [2, 2.001, 0])');
  await browser.ready();
  await browser.value('voxtile.clickAt(...voxtile.screenOf([1.55, 1.55, 1.1]))');
  const answer = await browser.value('document.getElementById("answer").innerText.replace(/\\s+/g, " ")');
  assert.match(answer, /^at 1.550 1.550 1.050 voxel of 0.10 m state occupied probability about 0.\d+ log-odds about .* observations about \d+ class 6 building/);
  assert.deepEqual(browser.errors, []);
  return `an exported page shows the ${live[0].length} voxels of the server's, also compressed and in a folder below`;
}
