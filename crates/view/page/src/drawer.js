// The settings: a panel at the side, or a drawer at the bottom of a phone's screen.

import { viewer } from './app.js';
import { $ } from './dom.js';

const phone = matchMedia('(max-width: 700px)');
// Heights of the drawer in percent of the screen. Below the first one it closes.
const CLOSES = 12;
const [LEAST, MOST] = [20, 90];

let drag = null;

export function showPanel(on, isFocused = false) {
  $('panel').hidden = !on;
  $('menu').setAttribute('aria-expanded', String(on));
  viewer.wake();
  if (isFocused) (on ? $('panel').querySelector('summary') : $('menu')).focus();
}

function setHeight(percent) {
  const height = Math.min(Math.max(percent, LEAST), MOST);
  document.documentElement.style.setProperty('--drawer', `${height}dvh`);
  $('drawer').setAttribute('aria-valuenow', String(Math.round(height)));
}

// In a drawer, one group is open at a time.
function arrange() {
  for (const group of $('panel').querySelectorAll('details')) {
    if (phone.matches) group.setAttribute('name', 'settings');
    else group.removeAttribute('name');
  }
  showPanel(!phone.matches);
}

$('menu').addEventListener('click', () => showPanel($('panel').hidden, true));
$('drawer').addEventListener('pointerdown', (event) => {
  drag = event.pointerId;
  $('drawer').setPointerCapture(drag);
});
$('drawer').addEventListener('pointermove', (event) => {
  if (drag !== event.pointerId) return;
  const percent = 100 * (1 - event.clientY / innerHeight);
  if (percent < CLOSES) showPanel(false);
  else setHeight(percent);
});
$('drawer').addEventListener('lostpointercapture', () => { drag = null; });
$('drawer').addEventListener('keydown', (event) => {
  const step = { ArrowUp: 5, ArrowDown: -5, PageUp: 20, PageDown: -20 }[event.key];
  if (event.key === 'Escape') showPanel(false, true);
  else if (step) setHeight(Number($('drawer').getAttribute('aria-valuenow')) + step);
  else return;
  event.preventDefault();
  event.stopPropagation();
});
phone.addEventListener('change', arrange);
arrange();
