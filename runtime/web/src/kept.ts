// How each model is looked at, kept by the browser, and as an address that others can open.
import type { Place } from './eye';
import type { KeptLook } from './view_controls';

export interface Kept {
  look: KeptLook;
  place: Place | null; // of the camera, unless it shows the whole body
}

const key_of = (model: string) => `palpate view ${model}`;

/** A browser that keeps nothing, for this page or at all, is none the worse. */
function storage(): Storage | null {
  try {
    return window.localStorage;
  } catch {
    return null;
  }
}

export function keep(model: string, kept: Kept): void {
  try {
    storage()?.setItem(key_of(model), JSON.stringify(kept));
  } catch {
    // it is full
  }
}

export function kept_of(model: string): Kept | null {
  try {
    const text = storage()?.getItem(key_of(model));
    return text ? checked(JSON.parse(text)) : null;
  } catch {
    return null;
  }
}

export const kept_theme = (): string => storage()?.getItem('palpate theme') ?? 'auto';
export const keep_theme = (theme: string): void => storage()?.setItem('palpate theme', theme);

/** What follows # in an address. */
export function as_hash({ look, place }: Kept): string {
  const words = new URLSearchParams(look);
  if (place) words.set('eye', [...place.towards, ...place.target, place.away].map((number) => Number(number.toPrecision(5))).join(' '));
  return words.toString();
}

export function of_hash(hash: string): Kept | null {
  const words = new URLSearchParams(hash.replace(/^#/, ''));
  if (words.size === 0) return null;
  const numbers = (words.get('eye') ?? '').split(' ').map(Number);
  words.delete('eye');
  const [a = 0, b = 0, c = 0, d = 0, e = 0, f = 0, away = 0] = numbers;
  return checked({ look: Object.fromEntries(words), place: numbers.length === 7 ? { towards: [a, b, c], target: [d, e, f], away } : null });
}

/** Only what has the shape of something kept, and numbers that are numbers. */
function checked(read: unknown): Kept | null {
  const { look, place } = (read ?? {}) as Partial<Kept>;
  if (typeof look !== 'object' || look === null) return null;
  const kept: Kept = { look: {}, place: null };
  for (const [name, value] of Object.entries(look)) if (typeof value === 'string') kept.look[name] = value;
  const numbers = place ? [...(place.towards ?? []), ...(place.target ?? []), place.away] : [];
  if (place && numbers.length === 7 && numbers.every((number) => Number.isFinite(number)) && place.away > 0) kept.place = place;
  return kept;
}
