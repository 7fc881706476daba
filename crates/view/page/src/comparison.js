// Comparison of two maps: what is shown of it, the classes of changes, and their list.

import * as THREE from 'three';
import { CLASSES } from './palette.js';
import { sidesOf } from './swipe.js';

const $ = (id) => document.getElementById(id);
// Maximum number of changes in the list; the buttons reach all that the server sends.
const MAX_LISTED = 200;
const CHANGES = 'changes';

export class Comparison {
  // `json` loads a resource; `say` shows a message; `swatchOf` returns a square of a colour.
  constructor({ viewer, json, say, swatchOf }) {
    Object.assign(this, { viewer, json, say, swatchOf });
    this.info = null;
    this.changes = null;
    this.at = -1;
    $('change-next').addEventListener('click', () => this.step(1));
    $('change-previous').addEventListener('click', () => this.step(-1));
  }

  // Whether the changes are shown, and not one of the maps.
  get isShown() {
    return this.info !== null && $('compared').value === CHANGES;
  }

  // Returns the choice for a link; `null` for the changes.
  get choice() {
    return this.info === null || this.isShown ? null : $('compared').value;
  }

  // Returns the maps to show of those in `maps.json`: all without a comparison, both with their sides in a swipe.
  mapsOf({ maps, comparison }) {
    if (!comparison) return maps;
    const [before, after] = [comparison.before, comparison.after].map((k) => ({ ...maps[k], snapshots: [] }));
    if (!this.info) {
      this.info = comparison;
      for (const [choice, { name }] of Object.entries({ before, after })) {
        $('compared').querySelector(`[value=${choice}]`).text = `${choice}: ${name}`;
      }
      this.name = `${before.name} → ${after.name}`;
      [$('comparison').hidden, $('states').hidden] = [false, true];
      this.paintLegend();
      this.load();
    }
    const changes = { ...after, name: this.name };
    return { swipe: sidesOf(after, before), before: [before], after: [after] }[$('compared').value] ?? [changes];
  }

  // Returns the id of the changes in URLs.
  get id() {
    return `${this.info.after}~~${this.info.before}`;
  }

  paintLegend() {
    $('classes').replaceChildren(...this.info.classes.map(({ name, voxels }, k) => {
      const [row, label, count] = ['li', 'label', 'span'].map((tag) => document.createElement(tag));
      const box = Object.assign(document.createElement('input'), { type: 'checkbox', name, checked: true });
      box.addEventListener('change', () => {
        this.viewer.classes ^= 1 << k;
        this.viewer.wake();
      });
      label.append(box, ' ', this.swatchOf(CLASSES[k]), name.replaceAll('_', ' '));
      count.textContent = voxels.toLocaleString('en');
      row.append(label, count);
      return row;
    }));
    if (this.info.warnings.length) this.say(this.info.warnings.join(' '));
  }

  async load() {
    let read;
    try {
      read = await this.json(`maps/${this.id}/changes.json`);
    } catch (error) {
      this.say(`Cannot load the list of changes: ${error.message}`);
      return;
    }
    this.changes = read.changes;
    this.all = read.all;
    $('changes').replaceChildren(...this.changes.slice(0, MAX_LISTED).map((change, k) => {
      const [row, button] = ['li', 'button'].map((tag) => document.createElement(tag));
      const size = change.bounds_m.max.map((high, axis) => (high - change.bounds_m.min[axis]).toFixed(1));
      button.append(this.swatchOf(CLASSES[change.kind === 'appeared' ? 1 : 2]), `${change.number} ${change.kind} ${size.join(' x ')} m`);
      button.addEventListener('click', () => this.fly(k));
      row.append(button);
      return row;
    }));
    this.describe();
  }

  describe() {
    const { length } = this.changes;
    const isCut = this.all > length ? ` (${this.all.toLocaleString('en')} in all)` : '';
    const of = `${length.toLocaleString('en')}${isCut}`;
    $('change-out').value = length === 0 ? 'none' : this.at < 0 ? of : `${this.at + 1} of ${of}`;
    for (const id of ['change-next', 'change-previous']) $(id).disabled = length === 0;
  }

  step(by) {
    if (!this.changes?.length) return;
    const from = this.at < 0 && by < 0 ? 0 : this.at;
    this.fly((from + by + this.changes.length) % this.changes.length);
  }

  // Moves the camera to a change, and marks it.
  fly(number) {
    this.at = number;
    const { min, max } = this.changes[number].bounds_m;
    const box = new THREE.Box3(...[min, max].map((end) => new THREE.Vector3(...this.viewer.toScene(end))));
    const size = box.getSize(new THREE.Vector3());
    this.viewer.flight.fit(box.clone().expandByScalar(0.6 * Math.max(size.x, size.y, size.z)));
    this.viewer.overlays.box('change', min, max, 0xff3b6b);
    for (const [k, row] of [...$('changes').children].entries()) {
      row.firstChild.setAttribute('aria-pressed', String(k === number));
      if (k === number) row.scrollIntoView({ block: 'nearest' });
    }
    this.describe();
    this.viewer.wake();
  }
}
