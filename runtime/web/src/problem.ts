// What cannot be done, as a person reads it.
import type { Problem } from './words';

/** In one line, without the way out. */
export const headline = ({ what, where }: Problem): string => (where ? `${where}: ${what}` : what);

/** With the way out, as sentences. */
export function sentences(problem: Problem): string {
  const { hint } = problem;
  return hint ? `${headline(problem)}. ${hint.charAt(0).toUpperCase()}${hint.slice(1)}.` : headline(problem);
}

/** `now` is there and says something else than `before`. */
export const is_news = (now: Problem | null | undefined, before: Problem | null | undefined): now is Problem =>
  Boolean(now) && (!before || sentences(now!) !== sentences(before));
