// Content of responses. Files of an exported page are compressed, because static web servers send them as they are.

// Returns the plain bytes of a file that may be compressed.
export async function plain(buffer) {
  const head = new Uint8Array(buffer, 0, Math.min(2, buffer.byteLength));
  if (head[0] !== 0x1f || head[1] !== 0x8b) return buffer;
  if (typeof DecompressionStream === 'undefined') throw new Error('this browser is too old: it cannot decompress files');
  const bytes = new Blob([buffer]).stream().pipeThrough(new DecompressionStream('gzip'));
  return new Response(bytes).arrayBuffer().catch(() => { throw new Error('a file is damaged: cannot decompress it'); });
}

// Returns the plain bytes of a response, or throws its error.
export async function contentOf(response) {
  if (!response.ok) throw new Error((await response.json().catch(() => null))?.error ?? `HTTP status ${response.status}`);
  return plain(await response.arrayBuffer());
}
