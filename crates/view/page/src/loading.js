// Queues of the nodes to load, and their cache. By default, the renderer runs jobs in frames only, which are rare where
// drawing is slow.

import { DEFAULT_LRU_CACHE, PriorityQueue } from '3d-tiles-renderer';

// Maximum memory of the nodes of all layers.
const MOST_BYTES = 256 * 2 ** 20;

// Browsers open six connections to a server: some more requests keep them busy. Queued requests can be cancelled.
const MOST_REQUESTS = 10;

// Returns whether one tile is more urgent than another, as a positive number, or less, as a negative one: those in view,
// files of further levels, coarse nodes, near nodes.
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
    this.queue = new BetweenFrames(MOST_REQUESTS);
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
export const cache = Object.assign(DEFAULT_LRU_CACHE, { maxBytesSize: MOST_BYTES, minBytesSize: 0.75 * MOST_BYTES });
