// Whether small strain still holds: how far the surface has turned, against what was studied.
import { part, write } from './dom';
import type { State } from './words';

export type Light = 'good' | 'near' | 'over';

const degrees = 180 / Math.PI;

/** Good up to half of the rotation up to which forces were found right within 5 %; null where nothing is known. */
export function light_of(change: State['change'], studied: number | null | undefined): Light | null {
  if (!change || !studied) return null;
  if (change.rotation > studied) return 'over';
  return change.rotation > 0.5 * studied ? 'near' : 'good';
}

/** What it means, with the numbers, and what to do. */
export function light_title(light: Light, change: NonNullable<State['change']>, studied: number, is_warped: boolean): string {
  const strain = (100 * change.strain).toFixed(0);
  const range = `Largest rotation of the surface; its largest strain is ${strain} %. Forces were found right within 5 % up to a rotation of ${(degrees * studied).toFixed(0)}°`;
  if (light === 'good') return `${range}.`;
  if (light === 'near') return `${range}, of which this is more than half.`;
  return `${range}: for this one ${is_warped ? '' : 'turn on Warp, or '}play with --solver corotational.`;
}

/** The light beside the contacts. */
export function show_light({ change, model, settings }: State): void {
  const light = light_of(change, model.studied_rotation);
  const shown = part('range-light');
  shown.hidden = light === null;
  if (light === null || !change || !model.studied_rotation) return;
  shown.dataset.light = light;
  write(shown, `● ${(degrees * change.rotation).toFixed(0)}°`);
  shown.title = light_title(light, change, model.studied_rotation, settings.warp === 'yes');
  shown.ariaLabel = `${light === 'good' ? 'within' : light === 'near' ? 'near the end of' : 'beyond'} what was studied: ${shown.title}`;
}
