// Measures how fast the server builds and sends nodes:
//
//   VOXTILE=PROGRAM node crates/view/page/check/speed.mjs MAP [MAX_NODES]
//
// Starts with an empty cache: builds the coarse levels, then requests every node twice, eight at a time.
// The second time, nodes are read from the cache.

import { spawn } from 'node:child_process';
import { mkdtempSync, readFileSync, rmSync } from 'node:fs';
import { Agent, get } from 'node:http';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { createInterface } from 'node:readline';
import { gunzipSync } from 'node:zlib';

const [map, most = '20000'] = process.argv.slice(2);
const cache = mkdtempSync(join(tmpdir(), 'voxtile-view-'));
const server = spawn(process.env.VOXTILE, ['view', map, '--json'], { stdio: ['ignore', 'pipe', 'inherit'], env: { ...process.env, XDG_CACHE_HOME: cache } });
const agent = new Agent({ keepAlive: true, maxSockets: 8 });

const bytes = (url) => new Promise((resolve, reject) => {
  get(url, { agent, headers: { 'accept-encoding': 'gzip' } }, (response) => {
    const parts = [];
    response.on('data', (part) => parts.push(part)).on('error', reject);
    response.on('end', () => (response.statusCode === 200 ? resolve(Buffer.concat(parts)) : reject(new Error(`${response.statusCode} ${url}`))));
  }).on('error', reject);
});
const text = async (url) => {
  const body = await bytes(url);
  return JSON.parse((body[0] === 0x1f ? gunzipSync(body) : body).toString());
};

// Processor time of the server in seconds.
const cpu = () => {
  const fields = readFileSync(`/proc/${server.pid}/stat`, 'utf8').split(') ')[1].split(' ');
  return (Number(fields[11]) + Number(fields[12])) / 100;
};

async function nodes(url) {
  const found = new Set();
  const open = [new URL('maps/0/tileset.json', url).href];
  const walk = (tile, base) => {
    for (const { uri } of [tile.content, ...(tile.contents ?? [])].filter(Boolean)) {
      const child = new URL(uri, base).href;
      if (/\.json/.test(uri)) open.push(child);
      else if (found.size < Number(most)) found.add(child);
    }
    (tile.children ?? []).forEach((child) => walk(child, base));
  };
  while (open.length && found.size < Number(most)) {
    const base = open.shift();
    walk((await text(base)).root, base);
  }
  return [...found];
}

async function round(url) {
  const [since, before] = [performance.now(), cpu()];
  const urls = await nodes(url);
  const sum = { nodes: urls.length, wire_bytes: 0, voxels: 0 };
  const left = [...urls];
  await Promise.all(Array.from({ length: 8 }, async () => {
    for (let url = left.pop(); url; url = left.pop()) {
      const body = await bytes(url);
      sum.wire_bytes += body.length;
      sum.voxels += (body[0] === 0x1f ? gunzipSync(body) : body).readUInt32LE(4);
    }
  }));
  const seconds = (performance.now() - since) / 1000;
  return { ...sum, seconds, server_cpu_s: cpu() - before, nodes_per_s: urls.length / seconds, bytes_per_voxel: sum.wire_bytes / sum.voxels };
}

try {
  const url = await (async () => {
    for await (const line of createInterface({ input: server.stdout })) return JSON.parse(line).url;
  })();
  const since = performance.now();
  for (;;) {
    const [state] = (await text(`${url}maps.json`)).maps;
    if (state.generation && !state.pending_tiles) {
      const seconds = (performance.now() - since) / 1000;
      console.log(JSON.stringify({ what: 'levels', tiles: state.tiles, seconds, server_cpu_s: cpu(), tiles_per_s: state.tiles / seconds }));
      break;
    }
    await new Promise((resolve) => setTimeout(resolve, 50));
  }
  for (const what of ['made and sent', 'sent again']) console.log(JSON.stringify({ what, ...(await round(url)) }));
} finally {
  agent.destroy();
  server.kill();
  await new Promise((resolve) => server.once('exit', resolve));
  rmSync(cache, { recursive: true, force: true });
}
