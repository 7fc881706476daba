// Helpers of the page: elements, requests, texts.

export const $ = (id) => document.getElementById(id);

export const json = async (url) => {
  const response = await fetch(url);
  const answer = await response.json().catch(() => null);
  if (!response.ok || !answer) throw new Error(answer?.error ?? (response.ok ? `${url} is not JSON` : `HTTP status ${response.status}`));
  return answer;
};

export const metres = (k) => `${k.toFixed(Math.abs(k) < 1000 ? 2 : 1)} m`;
export const place = (point) => point.map((k) => k.toFixed(3)).join('  ');

let messageTimer = 0;
export function say(text) {
  $('message').textContent = text;
  $('message').hidden = !text;
  clearTimeout(messageTimer);
  if (text) messageTimer = setTimeout(() => say(''), 12000);
}

// Sets the text of a slider, also for screen readers.
export function tell(id, text) {
  $(`${id}-out`).value = text;
  $(id).setAttribute('aria-valuetext', text);
}

export const swatchOf = (colour) => {
  const swatch = document.createElement('span');
  swatch.className = 'swatch';
  swatch.style.background = `rgb(${colour})`;
  return swatch;
};

export function chooseOption(id, value) {
  const select = $(id);
  select.value = [...select.options].some((option) => option.value === value) ? value : select.options[0].value;
}
