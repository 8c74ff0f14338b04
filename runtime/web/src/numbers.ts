// The numbers beside the plots.
import { part, write } from './dom';
import { format_si } from './format';
import type { Timing } from './plots';

export interface Felt {
  force: [number, number, number]; // on the body [N]
  depth: number; // [m], not a number where the tool holds the body
  contacts: number;
  tick: number;
}

const signed = (value: number): string => (value < 0 ? format_si(value, 'N').replace('-', '−') : format_si(value, 'N'));

export function show_felt(felt: Felt): void {
  const norm = Math.hypot(...felt.force);
  write(part('force'), format_si(norm, 'N'));
  // What is rounding beside the whole is 0.
  (['x', 'y', 'z'] as const).forEach((axis, i) => write(part(`force-${axis}`), signed(Math.abs(felt.force[i]!) > 1e-6 * norm ? felt.force[i]! : 0)));
  write(part('depth-felt'), Number.isFinite(felt.depth) ? format_si(felt.depth, 'm') : '–');
  write(part('contacts'), felt.contacts >= 255 ? '255+' : String(felt.contacts));
}

const pair = ([median, most]: [number, number]): string =>
  Number.isFinite(median) ? `${median.toFixed(0)} / ${most.toFixed(0)} µs` : '–';

export function show_timing(timing: Timing, misses: number, ticks: number): void {
  write(part('compute'), pair(timing.compute));
  write(part('late'), pair(timing.late));
  write(part('misses'), misses.toLocaleString('en').replaceAll(',', ' '));
  write(part('ticks'), ticks.toLocaleString('en').replaceAll(',', ' '));
}
