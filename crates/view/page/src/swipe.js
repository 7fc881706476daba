// The border of a swipe: the earlier state is drawn left of it, the later one right of it.

const $ = (id) => document.getElementById(id);
// Steps of keys as shares of the picture's width.
const STEPS = { ArrowLeft: -0.01, ArrowDown: -0.01, ArrowRight: 0.01, ArrowUp: 0.01, PageDown: -0.1, PageUp: 0.1, Home: -1, End: 1 };

// Adds sides (0 is left) and labels to the states of a swipe, which have names. Overlays are those of the later state.
export function sidesOf(later, earlier) {
  return [{ ...later, side: 1, label: `after: ${later.name}` }, { ...earlier, side: 0, label: `before: ${earlier.name}` }];
}

export class Swipe {
  constructor(viewer) {
    this.viewer = viewer;
    // Called after the user has moved the border.
    this.moved = () => {};
    this.drag = null;
    const border = $('border');
    border.addEventListener('pointerdown', (event) => this.hold(event));
    border.addEventListener('pointermove', (event) => this.follow(event));
    border.addEventListener('lostpointercapture', () => { this.drag = null; });
    border.addEventListener('keydown', (event) => this.step(event));
    // The border does not block zooming.
    border.addEventListener('wheel', (event) => {
      event.preventDefault();
      viewer.canvas.dispatchEvent(new WheelEvent(event.type, event));
    });
  }

  // Shows the border if the states are those of a swipe.
  show(states) {
    for (const { side, label } of states) if (label) $(['swipe-left', 'swipe-right'][side]).textContent = label;
    $('swipe').hidden = !states.some(({ label }) => label);
  }

  // Moves the border to a share of the picture's width.
  move(share) {
    this.viewer.share = Math.min(Math.max(share, 0), 1);
    $('swipe').style.setProperty('--border', `${100 * this.viewer.share}%`);
    $('border').setAttribute('aria-valuenow', String(Math.round(100 * this.viewer.share)));
    this.viewer.wake();
  }

  hold(event) {
    if (this.drag || event.button !== 0) return;
    const { left, width } = $('border').getBoundingClientRect();
    this.drag = { pointer: event.pointerId, offset: event.clientX - (left + width / 2) };
    $('border').setPointerCapture(event.pointerId);
  }

  follow(event) {
    if (this.drag?.pointer !== event.pointerId) return;
    const { left, width } = this.viewer.canvas.getBoundingClientRect();
    this.move((event.clientX - this.drag.offset - left) / width);
    this.moved();
  }

  step(event) {
    const step = STEPS[event.key];
    if (!step || event.ctrlKey || event.metaKey || event.altKey) return;
    // Arrows also move the camera in walk mode.
    event.preventDefault();
    event.stopPropagation();
    this.move(this.viewer.share + step);
    this.moved();
  }
}
