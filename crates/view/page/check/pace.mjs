import assert from 'node:assert/strict';

// Records whether each frame has smooth edges, and lets frames take `times`: those without smooth edges, and those with
// them, in milliseconds. Frames end with a triangle that covers the picture; smooth edges are resolved before.
const RECORD = `(() => {
  window.times = [1, 1];
  window.smooth = [];
  let isResolved = false;
  const due = new Map();
  const proto = WebGL2RenderingContext.prototype;
  const { blitFramebuffer, drawArrays, fenceSync, clientWaitSync, TIMEOUT_EXPIRED, ALREADY_SIGNALED } = proto;
  proto.blitFramebuffer = function (...args) {
    isResolved = true;
    return blitFramebuffer.apply(this, args);
  };
  proto.drawArrays = function (mode, first, count) {
    if (count === 3) {
      smooth.push(isResolved);
      isResolved = false;
    }
    return drawArrays.call(this, mode, first, count);
  };
  proto.fenceSync = function (...args) {
    const sync = fenceSync.apply(this, args);
    due.set(sync, performance.now() + times[Number(smooth.at(-1))]);
    return sync;
  };
  proto.clientWaitSync = (sync) => (performance.now() < due.get(sync) ? TIMEOUT_EXPIRED : ALREADY_SIGNALED);
})()`;

// Tests the choice of smooth edges for frames that take some time.
export async function checkPace({ browser, url }) {
  const { identifier } = await browser.call('Page.addScriptToEvaluateOnNewDocument', { source: RECORD });
  await browser.open('about:blank');
  await browser.open(url);
  await browser.ready();
  const { eye, to } = await browser.value('voxtile.camera()');
  // Moves the camera for some frames, each after the last one is drawn, and returns which frames had smooth edges.
  const fly = async (times, frames) => {
    await browser.value(`(async () => {
      [window.times, window.smooth] = [${JSON.stringify(times)}, []];
      for (let k = 1; k <= ${frames}; k++) {
        voxtile.lookAt(${JSON.stringify(eye)}.map((at, axis) => at + (axis === 2 ? 0.002 * k : 0)), ${JSON.stringify(to)});
        await new Promise((resolve) => setTimeout(resolve, Math.max(...times) + 40));
      }
      window.moving = smooth.length;
    })()`);
    await browser.ready();
    await new Promise((resolve) => setTimeout(resolve, 1000 + 2 * times[0]));
    const [smooth, moving] = await browser.value('[smooth, moving]');
    return { moving: smooth.slice(0, moving), last: smooth.at(-1) };
  };
  const text = ({ moving, last }) => `${moving.map(Number).join('')}, then ${last}`;
  await fly([1, 1], 3);
  // Smooth edges take more than three times longer. An odd and an even number of frames.
  for (const frames of [8, 9]) {
    const seen = await fly([10, 150], frames);
    assert.doesNotMatch(text(seen), /01/, 'edges stay as they are while the camera moves');
    assert.equal(seen.last, true, `a still view has smooth edges: ${text(seen)}`);
  }
  const tooSlow = await fly([300, 900], 3);
  assert.equal(tooSlow.last, false, `input does not wait for smooth edges: ${text(tooSlow)}`);
  // Other work of the browser may delay a frame.
  let fast;
  for (let k = 0; k < 4; k++) {
    fast = await fly([1, 1], 5);
    if (fast.moving.every(Boolean)) break;
  }
  assert.ok(fast.moving.every(Boolean) && fast.last, `fast frames have smooth edges: ${text(fast)}`);
  await browser.call('Page.removeScriptToEvaluateOnNewDocument', { identifier });
  assert.deepEqual(browser.errors, []);
  return 'edges do not flicker while the camera moves, and are smooth when it stops';
}
