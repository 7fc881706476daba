import * as THREE from 'three';
import { OrbitControls } from 'three/addons/controls/OrbitControls.js';

const KEYS = { KeyW: [0, 1], ArrowUp: [0, 1], KeyS: [0, -1], ArrowDown: [0, -1], KeyD: [1, 0], KeyA: [-1, 0] };

// Camera with two modes: orbit around a point, or walk.
export class Flight {
  constructor(camera, canvas, wake) {
    Object.assign(this, { camera, canvas, wake });
    this.orbit = new OrbitControls(camera, canvas);
    this.orbit.enableDamping = false;
    this.orbit.zoomToCursor = true;
    this.orbit.listenToKeyEvents(canvas);
    this.orbit.addEventListener('change', wake);
    this.walks = false;
    this.keys = new Set();
    this.fingers = new Map();
    this.step = 1;
    canvas.addEventListener('pointerdown', (event) => this.touch(event, true));
    for (const end of ['pointerup', 'pointercancel']) canvas.addEventListener(end, (event) => this.touch(event, false));
    canvas.addEventListener('pointermove', (event) => this.look(event));
    window.addEventListener('keydown', (event) => {
      if (!this.walks || event.target.matches?.('select, input:not([type=range]):not([type=checkbox])')) return;
      this.keys.add(event.code);
      wake();
    });
    window.addEventListener('keyup', (event) => this.keys.delete(event.code));
    window.addEventListener('blur', () => this.keys.clear());
  }

  // Changes the distance to the point that the camera looks at by a factor.
  zoom(factor) {
    if (this.walks) return;
    const { position } = this.camera;
    position.sub(this.orbit.target).multiplyScalar(factor).add(this.orbit.target);
    this.orbit.update();
    this.wake();
  }

  walk(on) {
    this.walks = on;
    this.orbit.enabled = !on;
    this.keys.clear();
    if (!on) {
      const ahead = this.camera.getWorldDirection(new THREE.Vector3());
      this.orbit.target.copy(this.camera.position).addScaledVector(ahead, 10 * this.step);
      this.orbit.update();
    }
    this.wake();
  }

  // On a touch screen, two fingers move forward and three move back.
  touch(event, isDown) {
    if (event.pointerType !== 'touch') return;
    if (isDown) this.fingers.set(event.pointerId, [event.clientX, event.clientY]);
    else this.fingers.delete(event.pointerId);
    for (const key of ['ArrowUp', 'ArrowDown']) this.keys.delete(key);
    if (this.walks && this.fingers.size > 1) this.keys.add(this.fingers.size > 2 ? 'ArrowDown' : 'ArrowUp');
    this.wake();
  }

  look(event) {
    if (!this.walks || event.buttons === 0) return;
    // Touch events have no movement fields.
    const before = this.fingers.get(event.pointerId) ?? [event.clientX - event.movementX, event.clientY - event.movementY];
    if (this.fingers.has(event.pointerId)) this.fingers.set(event.pointerId, [event.clientX, event.clientY]);
    const [right, down] = [event.clientX - before[0], event.clientY - before[1]];
    const turn = new THREE.Euler().setFromQuaternion(this.camera.quaternion, 'ZXY');
    turn.z -= right * 0.004;
    turn.x = Math.min(Math.max(turn.x - down * 0.004, 0.05), Math.PI - 0.05);
    turn.y = 0;
    this.camera.quaternion.setFromEuler(turn);
    this.wake();
  }

  // Moves while keys are down. Returns whether the camera moved.
  update(seconds) {
    if (!this.walks || this.keys.size === 0) return false;
    const speed = this.step * (this.keys.has('ShiftLeft') || this.keys.has('ShiftRight') ? 25 : 5) * Math.min(seconds, 0.1);
    const ahead = this.camera.getWorldDirection(new THREE.Vector3());
    const right = new THREE.Vector3().crossVectors(ahead, this.camera.up).normalize();
    let moved = false;
    for (const key of this.keys) {
      const [sideways, forward] = KEYS[key] ?? [0, 0];
      const up = key === 'KeyE' ? 1 : key === 'KeyQ' ? -1 : 0;
      this.camera.position.addScaledVector(ahead, forward * speed).addScaledVector(right, sideways * speed);
      this.camera.position.z += up * speed;
      moved ||= Boolean(sideways || forward || up);
    }
    return moved;
  }

  lookAt(position, target) {
    this.camera.position.set(...position);
    this.orbit.target.set(...target);
    this.camera.lookAt(this.orbit.target);
    this.orbit.update();
    this.wake();
  }

  // Fits a box, or points in it, into the view from a direction.
  fit(box, from = [-0.6, -1, 0.8], points = []) {
    const center = box.getCenter(new THREE.Vector3());
    const half = box.getSize(new THREE.Vector3()).multiplyScalar(0.5).max(new THREE.Vector3(0.25, 0.25, 0.25));
    const back = new THREE.Vector3(...from).normalize();
    const right = new THREE.Vector3().crossVectors(this.camera.up, back).normalize();
    const up = new THREE.Vector3().crossVectors(back, right);
    const high = Math.tan(THREE.MathUtils.degToRad(this.camera.fov / 2));
    const corners = Array.from({ length: 8 }, (_, corner) => half.clone()
      .multiply(new THREE.Vector3(corner & 1 ? 1 : -1, corner & 2 ? 1 : -1, corner & 4 ? 1 : -1)));
    const all = points.length ? points.map((point) => point.clone().sub(center)) : corners;
    const seen = all.map((at) => [at.dot(right), at.dot(up), at.dot(back)]);
    // Minimum distance with all in view; the middle of points is in its middle, and the center of a box without points.
    const shift = [0, 0];
    let distance = 0;
    for (let round = 0; round < 4; round++) {
      distance = 0.5;
      for (const [x, y, z] of seen) {
        const aside = Math.max(Math.abs(y - shift[1]) / high, Math.abs(x - shift[0]) / (high * this.camera.aspect));
        distance = Math.max(distance, z + 1.06 * aside);
      }
      for (const axis of points.length ? [0, 1] : []) {
        let [least, most] = [Infinity, -Infinity];
        for (const at of seen) {
          const place = (at[axis] - shift[axis]) / (distance - at[2]);
          [least, most] = [Math.min(least, place), Math.max(most, place)];
        }
        shift[axis] += 0.5 * (least + most) * distance;
      }
    }
    center.addScaledVector(right, shift[0]).addScaledVector(up, shift[1]);
    this.step = half.length() / 30;
    this.lookAt(center.clone().addScaledVector(back, distance).toArray(), center.toArray());
  }
}
