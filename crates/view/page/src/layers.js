// Colours by the layers of a map: colour, intensity, class and time of the points that hit a voxel.

// Choices of colours, and the layers that they need.
export const BY_LAYER = { rgb: 'colour', intensity: 'intensity', class: 'class', age: 'time' };
// Voxels without a value.
export const NO_VALUE = [125, 131, 142];

const NUMBERS = ['', 'colour', 'intensity', 'class', 'time'];

// Decodes the values of a layer, which follow the voxels of a node (docs/view.md).
export function parseValues(view, at, count, number) {
  const name = NUMBERS[number];
  const plane = (offset) => new Uint8Array(view.buffer, view.byteOffset + offset, count);
  if (name === 'colour') return { name, planes: [0, 1, 2, 3].map((k) => plane(at + k * count)) };
  const [low, high] = [plane(at + 16), plane(at + 16 + count)];
  const [least, most] = [view.getFloat64(at, true), view.getFloat64(at + 8, true)];
  const valueOf = (i) => {
    const number = low[i] | high[i] << 8;
    return number === 0 ? null : least + (most - least) * (number - 1) / 65534;
  };
  // Numbers are those of `valueOf`, as two bytes: software adjusts their colours without loading them again.
  return { name, valueOf, low, high, least, most };
}

export const bytesOfValues = (count, number) => (number === 0 ? 0 : number === 1 ? 4 * count : 16 + 2 * count);

// Returns the colours of the voxels of a node: red, green, blue, 255; alpha is 0 without a value. Intensities and times
// are two bytes of a number instead, low and high, whose colours the drawing finds by their range.
export function paintOf({ count, values }, legend) {
  const paint = new Uint8Array(4 * count);
  if (values.name === 'colour') {
    values.planes.forEach((plane, k) => plane.forEach((value, i) => { paint[4 * i + k] = value; }));
    return paint;
  }
  const classes = new Map(legend?.classes?.map((one) => [one.class, one.color]));
  for (let i = 0; i < count; i++) {
    const value = values.valueOf(i);
    if (value === null) continue;
    const colour = values.name === 'class' ? classes.get(Math.round(value)) : [values.low[i], values.high[i], 0];
    if (colour) paint.set([...colour, 255], 4 * i);
  }
  return paint;
}

// Returns the value of a voxel as text, with the legend of its layer; `null` without a value.
export function valueText({ name, planes, valueOf }, i, legend) {
  if (planes) return planes[3][i] ? planes.slice(0, 3).map((plane) => plane[i]).join(' ') : null;
  const value = valueOf(i);
  if (value === null) return null;
  if (name === 'intensity') return value.toFixed(1);
  if (name === 'time') return timeText(value, legend);
  return className(legend.classes.find((one) => one.class === Math.round(value)) ?? { class: Math.round(value) });
}

const rangeOf = (legend) => legend?.range ?? legend?.range_s ?? null;

// Joins the legends of one layer of several maps, so that equal colours have equal meanings.
export function joined(legends) {
  const ranges = legends.map(rangeOf).filter(Boolean);
  const classes = new Map();
  for (const one of legends.flatMap((legend) => legend.classes ?? [])) {
    classes.set(one.class, { ...one, voxels: one.voxels + (classes.get(one.class)?.voxels ?? 0) });
  }
  return {
    range: ranges.length ? [Math.min(...ranges.map(([low]) => low)), Math.max(...ranges.map(([, high]) => high))] : null,
    classes: [...classes.values()].sort((a, b) => a.class - b.class),
    isUnixTime: legends.length > 0 && legends.every((legend) => legend.is_unix_time),
  };
}

export const className = ({ class: number, name }) => (name ? `${number} ${name}` : `${number}`);

const date = (seconds) => new Date(1000 * seconds).toISOString().slice(0, 19).replace('T', ' ');

// Returns a time stamp as a date, or as seconds since the first.
export const timeText = (seconds, { range, isUnixTime }) => (isUnixTime ? date(seconds) : `${(seconds - (range?.[0] ?? 0)).toFixed(1)} s`);

// Returns the texts at the ends of the scale.
export function endsOf(choice, legend) {
  if (!legend?.range) return [];
  const [low, high] = legend.range;
  if (choice !== 'age') return [low, high].map((value) => String(Number(value.toPrecision(3))));
  const ends = [low, high].map((seconds) => timeText(seconds, legend));
  // Dates are enough for long spans, and a date once for short ones.
  if (!legend.isUnixTime) return ends;
  if (high - low > 3 * 86400) return ends.map((text) => text.slice(0, 10));
  return ends[0].slice(0, 10) === ends[1].slice(0, 10) ? [ends[0], ends[1].slice(11)] : ends;
}
