// From where a body is looked at first: formulas alone.
import { cross, dot, minus, normalised, norm, plus } from './pose';
import type { Scene } from './wire';
import type { Vec3 } from './words';

const at = (values: ArrayLike<number>, i: number): Vec3 => [values[3 * i]!, values[3 * i + 1]!, values[3 * i + 2]!];

const usual: Vec3 = [0.55, -1, 0.55]; // upper front, a little from the right; z is up
const preference = 1.25; // how much more another side must show

export const uprights = ['auto', 'x', 'y', 'z', '-x', '-y', '-z'] as const;
/** The axis that is up in the picture. */
export type Upright = (typeof uprights)[number];

/** A direction that is given with z up, where `up` is an axis. */
export function turned_up([x, y, z]: Vec3, up: Vec3): Vec3 {
  if (up[1] > 0.5) return [x, z, -y];
  if (up[1] < -0.5) return [x, -z, y];
  if (up[0] > 0.5) return [z, y, -x];
  if (up[0] < -0.5) return [-z, y, x];
  return up[2] < -0.5 ? [x, -y, -z] : [x, y, z];
}

const clearly = 2; // how many times more along y than along z and x

/** A body that lies on what holds it, along y, has y up; else z is. */
export function guessed_up(scene: Scene): Vec3 {
  const { position, held } = scene;
  const all: Vec3 = [0, 0, 0];
  const lower: Vec3 = [0, 0, 0];
  let count = 0;
  for (let i = 0; i < held.length; ++i) {
    for (let k = 0; k < 3; ++k) all[k]! += position[3 * i + k]! / held.length;
    if (held[i] === 0) continue;
    ++count;
    for (let k = 0; k < 3; ++k) lower[k]! += position[3 * i + k]!;
  }
  if (count === 0) return [0, 0, 1];
  const [x, y, z] = minus(all, plus([0, 0, 0], lower, 1 / count));
  return y > clearly * Math.abs(z) && y > clearly * Math.abs(x) ? [0, 1, 0] : [0, 0, 1];
}

/**
 * The direction [1] from the body towards the person: the usual one, or the one of some others that shows clearly more of what can be
 * touched and less of what is held.
 */
export function first_direction(scene: Scene, up: Vec3 = [0, 0, 1]): Vec3 {
  const { position, triangle, held } = scene;
  const sides: Vec3[] = [usual];
  for (const [x, y] of [[-1, -1], [1, 1], [-1, 1]] as const) sides.push([0.55 * x, y, 0.55], [x, 0.55 * y, 0.55]);
  sides.push([1, -0.55, 0.55], [0.55, -1, -0.45]);
  const directions = sides.map((side) => turned_up(normalised(side), up));
  const seen = directions.map(() => 0);
  for (let t = 0; t < triangle.length; t += 3) {
    const corners = [triangle[t]!, triangle[t + 1]!, triangle[t + 2]!];
    const a = at(position, corners[0]!);
    const facet = cross(minus(at(position, corners[1]!), a), minus(at(position, corners[2]!), a));
    const worth = corners.every((node) => held[node] !== 0) ? -1 : 1;
    directions.forEach((towards, k) => (seen[k]! += worth * Math.max(0, dot(facet, towards))));
  }
  let best = 0;
  for (let k = 1; k < seen.length; ++k) if (seen[k]! > (best === 0 ? preference : 1) * seen[best]!) best = k;
  return directions[best]!;
}

/** The part of the picture that is free of controls: half its width and height, in shares of half the height of the picture. */
export interface Opening {
  wide: number;
  high: number;
}

/**
 * Where a camera looks (the middle of what is seen) and from how far along `towards`, so that all places fit the opening; `slope` is
 * the tangent of half the camera's angle, `up` is upright in the picture.
 */
export function fit_places(position: ArrayLike<number>, towards: Vec3, up: Vec3, slope: number, opening: Opening, is_parallel = false): { target: Vec3; away: number } {
  const right = normalised(cross(up, towards));
  const upright = cross(towards, right);
  const low: Vec3 = [Infinity, Infinity, Infinity];
  const high: Vec3 = [-Infinity, -Infinity, -Infinity];
  const axes = [right, upright, towards];
  const count = position.length / 3;
  for (let i = 0; i < count; ++i) {
    axes.forEach((axis, k) => {
      const along = dot(at(position, i), axis);
      low[k] = Math.min(low[k]!, along);
      high[k] = Math.max(high[k]!, along);
    });
  }
  let target: Vec3 = [0, 0, 0];
  axes.forEach((axis, k) => (target = plus(target, axis, (low[k]! + high[k]!) / 2)));
  let away = 0;
  for (let i = 0; i < count; ++i) {
    const place = minus(at(position, i), target);
    const needed = Math.max(Math.abs(dot(place, right)) / opening.wide, Math.abs(dot(place, upright)) / opening.high);
    away = Math.max(away, needed / slope + (is_parallel ? 0 : dot(place, towards)));
  }
  return { target, away: Math.max(away, 1e-9 * (1 + norm(target))) };
}
