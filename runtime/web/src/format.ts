// Numbers as people read them.

const prefixes: [number, string][] = [
  [1e9, 'G'],
  [1e6, 'M'],
  [1e3, 'k'],
  [1, ''],
  [1e-3, 'm'],
  [1e-6, 'µ'],
  [1e-9, 'n'],
];

/** The SI prefix for numbers up to `largest`: what it stands for and its letter. */
export function si_prefix(largest: number): [number, string] {
  const size = Math.abs(largest);
  if (!(size > 0) || !Number.isFinite(size)) return [1, ''];
  return prefixes.find(([factor]) => size >= factor * 0.99995) ?? [1e-9, 'n'];
}

/** `digits` significant ones, without an exponent for what people meet: 0.01234, 12.3, 1230. */
export function format_number(value: number, digits = 3): string {
  if (!Number.isFinite(value)) return '–';
  if (value === 0) return '0';
  const exponent = Number(value.toExponential(digits - 1).split('e')[1]); // after rounding
  if (exponent < -4 || exponent > 6) return value.toExponential(digits - 1);
  return value.toFixed(Math.max(0, Math.min(12, digits - 1 - exponent)));
}

/** Without zeros at the end: −2.5, 10. */
export function short_number(value: number, digits = 3): string {
  const text = format_number(value, digits);
  return (text.includes('e') || !text.includes('.') ? text : text.replace(/\.?0+$/, '')).replace('-', '−');
}

/** "1.23 kPa". */
export function format_si(value: number, unit: string, digits = 3): string {
  const [factor, prefix] = si_prefix(value);
  return `${format_number(value / factor, digits)} ${prefix}${unit}`;
}

/** "46 MB". */
export function format_bytes(bytes: number): string {
  return bytes < 1000 ? `${bytes} B` : format_si(bytes, 'B', 2);
}

/** "3:07.25", of seconds. */
export function format_time(seconds: number): string {
  const minutes = Math.floor(seconds / 60);
  return `${minutes}:${(seconds - 60 * minutes).toFixed(2).padStart(5, '0')}`;
}

/** The smallest of 1, 1.5, 2, 3, 5, 7.5 times a power of ten that is not below `value`. */
export function nice_ceiling(value: number): number {
  if (!(value > 0)) return 0;
  const power = 10 ** Math.floor(Math.log10(value));
  const step = [1, 1.5, 2, 3, 5, 7.5, 10].find((one) => one * power >= value * (1 - 1e-9)) ?? 10;
  return step * power;
}

/** The longest of 1, 2, 5 times a power of ten that is not above `value`. */
export function round_below(value: number): number {
  if (!(value > 0)) return 0;
  const power = 10 ** Math.floor(Math.log10(value));
  return ([5, 2, 1].find((one) => one * power <= value * (1 + 1e-9)) ?? 1) * power;
}

/** Round numbers from `low` to `high`, some `wanted` of them. */
export function nice_ticks(low: number, high: number, wanted = 5): number[] {
  if (!(high > low)) return [low];
  const raw = (high - low) / wanted;
  const power = 10 ** Math.floor(Math.log10(raw));
  const step = power * ([1, 2, 2.5, 5, 10].find((one) => one * power >= raw * (1 - 1e-9)) ?? 10);
  const ticks: number[] = [];
  for (let i = Math.ceil(low / step - 1e-6); i * step <= high + 1e-6 * step; ++i) ticks.push(i * step + 0); // no -0
  return ticks;
}
