// Time that drawing takes, and timers of what happens between frames.

// Frames with smooth edges that take longer are too slow while the view changes.
const SLOW_MS = 80;
// Still views get smooth edges if this takes less time: input has to wait for it.
const MOST_SMOOTH_MS = 700;
// Software takes up to three times longer for smooth edges.
const SMOOTH_FACTOR = 3;
// Interval of checks whether a frame is drawn.
const CHECK_MS = 10;

// Measures frames from the calls of WebGL to the end of drawing, which follows later in another process.
export class Pace {
  constructor(gl) {
    this.gl = gl;
    this.drawMs = 0;
    this.isSlow = false;
    this.drawn = null;
  }

  // Whether a still view is worth the time of smooth edges.
  get mayBeSmooth() {
    return this.isSlow && SMOOTH_FACTOR * this.drawMs < MOST_SMOOTH_MS;
  }

  begin(isSmooth) {
    this.since = performance.now();
    this.isSmooth = isSmooth;
  }

  end() {
    // One frame is measured at a time.
    if (this.drawn) return;
    const { gl, since, isSmooth } = this;
    this.drawn = gl.fenceSync(gl.SYNC_GPU_COMMANDS_COMPLETE, 0);
    gl.flush();
    const check = () => {
      if (!this.drawn) return;
      if (gl.clientWaitSync(this.drawn, 0, 0) === gl.TIMEOUT_EXPIRED) {
        setTimeout(check, CHECK_MS);
        return;
      }
      gl.deleteSync(this.drawn);
      this.drawn = null;
      this.drawMs = performance.now() - since;
      if (isSmooth || this.isSlow) this.isSlow = this.drawMs > (isSmooth ? SLOW_MS : SLOW_MS / SMOOTH_FACTOR);
    };
    setTimeout(check);
  }
}

// Timers by name. A timer that runs is kept.
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
