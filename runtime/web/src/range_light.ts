// Whether small strain still holds: how far the surface has turned, against what was studied.
import { part, write } from './dom';
import type { Surface } from './pick';
import type { State } from './words';

export type Light = 'good' | 'near' | 'over';

const dent_reach = 4; // sizes of the tool
const degrees = 180 / Math.PI;

/** Good up to half of the rotation up to which forces were found right within 5 %; null where nothing is known. */
export function light_of(change: State['change'], studied: number | null | undefined): Light | null {
  if (!change || !studied) return null;
  if (change.rotation > studied) return 'over';
  return change.rotation > 0.5 * studied ? 'near' : 'good';
}

/**
 * How far the surface has turned beside the dent of a tool of this size [m], where `tool` is null all of it [rad]: the largest angle of
 * a vertex normal from where it was. Within a dent all turns, steeply, and small strain bears that.
 */
export function turned_beside(rest_normal: ArrayLike<number>, { position, normal }: Surface, tool: ArrayLike<number> | null, size: number): number {
  const reach = dent_reach * size;
  let least = 1; // cosine
  for (let i = 0; i < normal.length; i += 3) {
    const cosine = rest_normal[i]! * normal[i]! + rest_normal[i + 1]! * normal[i + 1]! + rest_normal[i + 2]! * normal[i + 2]!;
    if (cosine >= least) continue;
    if (tool && Math.hypot(position[i]! - tool[0]!, position[i + 1]! - tool[1]!, position[i + 2]! - tool[2]!) < reach) continue;
    least = cosine;
  }
  return Math.acos(Math.max(-1, least));
}

/** How much more force small strain would have, in few words and in a sentence; null where that is not known, or less than 1 %. */
export function small_strain_words(more: number | undefined): { short: string; sentence: string } | null {
  const percent = Math.round(100 * (more ?? 0));
  if (percent === 0) return null;
  const size = Math.abs(percent);
  return {
    short: `linear ${percent > 0 ? '+' : '−'}${size} %`,
    sentence: `By small strain this touch would have ${size} % ${percent > 0 ? 'more' : 'less'} force.`,
  };
}

/** What it means, with the numbers, and what to do. */
export function light_title(light: Light, change: NonNullable<State['change']>, studied: number, is_deep: boolean): string {
  const strain = (100 * change.strain).toFixed(0);
  const range = `Largest rotation of the surface beside the dent; its largest strain is ${strain} %. Forces were found right within 5 % up to a rotation of ${(degrees * studied).toFixed(0)}°`;
  if (light === 'good') return `${range}.`;
  if (light === 'near') return `${range}, of which this is more than half.`;
  return `${range}: for this one ${is_deep ? '' : 'turn on Depth, or '}play with --solver corotational.`;
}

/** The light beside the contacts, and what it means where it is not green; `beside` is what turned_beside has. */
export function show_light({ change: all, model, small_strain }: State, beside: number): void {
  const change = all ? { ...all, rotation: Math.min(all.rotation, beside) } : all;
  const of_body = light_of(change, model.studied_rotation);
  const light = of_body === 'good' && light_of(all, model.studied_rotation) !== 'good' ? null : of_body; // nothing is known of a steep dent
  const shown = part('range-light');
  shown.hidden = light === null;
  part('range-note').hidden = light === null || light === 'good';
  if (light === null || !change || !model.studied_rotation) return;
  shown.dataset.light = light;
  const words = small_strain_words(small_strain);
  write(shown, `● ${words?.short ?? `turned ${(degrees * change.rotation).toFixed(0)}°`}`);
  write(part('range-note'), light_title(light, change, model.studied_rotation, model.deep === true));
  shown.title = `${words ? `${words.sentence} ` : ''}${light_title(light, change, model.studied_rotation, model.deep === true)}`;
  shown.ariaLabel = `${light === 'good' ? 'within' : light === 'near' ? 'near the end of' : 'beyond'} what was studied: ${shown.title}`;
}
