// Queues of the nodes to load, and their cache. Jobs run between frames: by default, the renderer would start them only
// in frames, which are rare where drawing is slow.

import { DEFAULT_LRU_CACHE, PriorityQueue } from '3d-tiles-renderer';

// Maximum memory of the nodes of all layers.
const MAX_BYTES = 256 * 2 ** 20;

// Maximum number of requests at once. Browsers open six connections to a server; a few requests more keep these busy.
// The others wait in the queue, where they can be cancelled.
const MAX_REQUESTS = 10;

// Compares two tiles: positive if the first one is more urgent, negative if the second one is. What is in view is more
// urgent, then files of further levels, then coarse nodes, then near ones.
function urgency(one, other) {
  const [a, b] = [one.traversal, other.traversal];
  return a.used - b.used || a.inFrustum - b.inFrustum
    || one.internal.hasUnrenderableContent - other.internal.hasUnrenderableContent
    || a.error - b.error || b.distanceFromCamera - a.distanceFromCamera || 0;
}

class BetweenFrames extends PriorityQueue {
  constructor(maxJobs) {
    super();
    Object.assign(this, { maxJobs, priorityCallback: urgency });
  }

  scheduleJobRun() {
    if (this.scheduled) return;
    this.scheduled = true;
    setTimeout(() => {
      this.scheduled = false;
      this.tryRunJobs();
    });
  }
}

// Requests to one server.
class Requests {
  constructor() {
    this.queue = new BetweenFrames(MAX_REQUESTS);
  }

  get running() {
    return this.queue.running;
  }

  add(url, tile, request) {
    return this.queue.add(tile, request);
  }

  remove(tile) {
    this.queue.remove(tile);
  }
}

// Queues of all layers.
export const queues = { downloadQueue: new Requests(), parseQueue: new BetweenFrames(16) };

// Cache of all layers.
export const cache = Object.assign(DEFAULT_LRU_CACHE, { maxBytesSize: MAX_BYTES, minBytesSize: 0.75 * MAX_BYTES });
