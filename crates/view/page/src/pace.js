// Time that drawing takes, and timers of what happens between frames.

// Maximum time of a frame with smooth edges while the view changes.
const SLOW_MS = 80;
// Maximum time of a frame with smooth edges while the view is still: input has to wait for it.
const MAX_SMOOTH_MS = 700;
// Frames with smooth edges take about three times longer where the processor draws.
const SMOOTH_FACTOR = 3;
// Interval of checks whether a frame is drawn.
const CHECK_MS = 10;

// Measures frames from the calls of WebGL to the end of drawing, which follows later in another process.
export class Pace {
  constructor(gl) {
    this.gl = gl;
    // Time of the last measured frame.
    this.drawMs = 0;
    // Expected time of a frame with smooth edges.
    this.smoothMs = 0;
    // Whether frames with smooth edges are too slow while the view changes.
    this.isSlow = false;
    // Whether the last frame has smooth edges.
    this.isSmooth = false;
    // Fence after the frame that is measured; `null` between measurements.
    this.drawn = null;
  }

  get isMeasuring() {
    return this.drawn !== null;
  }

  // Whether a still view should be drawn again, with smooth edges.
  get mayBeSmooth() {
    return !this.isSmooth && this.smoothMs < MAX_SMOOTH_MS;
  }

  begin(isSmooth) {
    this.since = performance.now();
    this.isSmooth = isSmooth;
  }

  end() {
    // One frame is measured at a time.
    if (this.isMeasuring) return;
    const { gl, since, isSmooth } = this;
    this.drawn = gl.fenceSync(gl.SYNC_GPU_COMMANDS_COMPLETE, 0);
    gl.flush();
    const check = () => {
      if (!this.drawn) return;
      const ms = performance.now() - since;
      if (gl.clientWaitSync(this.drawn, 0, 0) === gl.TIMEOUT_EXPIRED) {
        setTimeout(check, CHECK_MS);
        return;
      }
      gl.deleteSync(this.drawn);
      this.drawn = null;
      this.record(ms, isSmooth);
    };
    setTimeout(check);
  }

  // Records a frame that took at most this long. Decoding of nodes may delay the check; while a view is still, nothing
  // is decoded.
  record(ms, isSmooth) {
    this.drawMs = ms;
    this.smoothMs = ms * (isSmooth ? 1 : SMOOTH_FACTOR);
    // Measured with smooth edges only. A slow page draws a moving view without them, and measures again when the view is
    // still. If other frames counted, edges would flicker while the view moves.
    if (isSmooth) this.isSlow = ms > SLOW_MS;
  }
}

// Timers by name. Setting one that already runs has no effect.
export class Timers {
  constructor() {
    this.running = new Map();
  }

  set(name, act, ms) {
    if (this.running.has(name)) return;
    this.running.set(name, setTimeout(() => {
      this.running.delete(name);
      act();
    }, ms));
  }

  clear(name) {
    clearTimeout(this.running.get(name));
    this.running.delete(name);
  }
}
