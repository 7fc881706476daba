// Stores the view in the URL, so that a link opens the same view.

let timer = 0;

export function readLink() {
  const fields = new URLSearchParams(location.hash.slice(1));
  const numbers = (name, count) => {
    const list = fields.get(name)?.split(',').map(Number);
    return list?.length === count && list.every(Number.isFinite) ? list : null;
  };
  return { eye: numbers('eye', 3), to: numbers('to', 3), colour: fields.get('colour'), ramp: fields.get('ramp'), at: fields.get('at'), since: fields.get('since'),
    threshold: numbers('threshold', 1)?.[0] ?? null, cut: numbers('cut', 6),
    distances: numbers('distances', 2), compared: fields.get('compared'), line: numbers('line', 1) };
}

export function writeLink(state) {
  clearTimeout(timer);
  timer = setTimeout(() => {
    const fields = new URLSearchParams();
    for (const [name, value] of Object.entries(state())) {
      if (value !== null && value !== '' && value !== undefined) fields.set(name, Array.isArray(value) ? value.map((k) => +k.toFixed(3)).join(',') : value);
    }
    history.replaceState(null, '', '#' + fields.toString().replaceAll('%2C', ','));
  }, 300);
}
