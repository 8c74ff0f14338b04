// What the run is doing, over the picture, with what to do about it.
import { part, write } from './dom';
import type { Mode, State } from './words';

export interface Told {
  kind: 'ended' | 'paused' | 'quiet';
  text: string;
  hint: string;
}

/** What is said of a run; null: all is as usual. `lost` is why there is no connection, empty while there is one. */
export function told_of(state: State | null, mode: Mode, lost: string): Told | null {
  if (lost !== '') {
    const is_refused = lost.startsWith('open the') || lost.startsWith('too many');
    const hint = `${lost.charAt(0).toUpperCase()}${lost.slice(1)}.`;
    if (!state?.model) return is_refused ? { kind: 'ended', text: 'This address shows nothing now', hint } : { kind: 'quiet', text: 'Connecting', hint: lost };
    const again = 'Start it again as before: this page finds it, or says what to open. What is seen is the last picture.';
    return { kind: 'ended', text: is_refused ? 'This address shows something else now' : 'The program has ended', hint: is_refused ? `${hint} What is seen is the last picture.` : again };
  }
  if (!state?.model) return null;
  if (mode === 'file') return null;
  if (mode === 'replay') {
    if (state.you === 'controller' || state.alone || !state.controlled) return null;
    return { kind: 'quiet', text: 'You see what another page shows', hint: 'Move the slider to look for yourself.' };
  }
  if (state.paused) return { kind: 'paused', text: 'Paused', hint: 'Space or “Go on” continues, . makes a single tick. The tool moves then.' };
  if (state.you === 'controller') return null;
  const hint = state.controlled ? 'Another page steers.' : 'Nobody steers: “Take control” lets you touch the body.';
  return { kind: 'quiet', text: 'You are watching', hint };
}

/** Shows it; gives whether there is something to show. */
export function show_told(told: Told | null): void {
  const banner = part('banner');
  banner.hidden = told === null;
  if (!told) return;
  banner.dataset.kind = told.kind;
  write(part('banner-text'), told.text);
  write(part('banner-hint'), told.hint);
}

/** Somebody does what cannot be done now: the banner says why once more. */
export function nudge(): void {
  const banner = part('banner');
  banner.classList.remove('told');
  void banner.offsetWidth; // begins the animation anew
  banner.classList.add('told');
}
