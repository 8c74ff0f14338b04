// Which point of the surface is under the pointer.
import { cross, dot, minus, normalised, plus } from './pose';
import type { Vec3 } from './words';

export interface Hit {
  point: Vec3;
  normal: Vec3; // outward, of length 1
  corner?: [number, number, number]; // vertices of the triangle ...
  weight?: Vec3; // ... and how near each is
}

/** A surface as it is at one moment. */
export interface Surface {
  position: ArrayLike<number>; // [3 V]
  normal: ArrayLike<number>; // [3 V]
  triangle: ArrayLike<number>; // [3 T]
  shows?: (place: Vec3) => boolean; // what is cut away is not there
}

const same_side = Math.cos((35 * Math.PI) / 180); // beyond it a vertex normal is that of an edge, and the facet's counts

const at = (values: ArrayLike<number>, i: number): Vec3 => [values[3 * i]!, values[3 * i + 1]!, values[3 * i + 2]!];

interface Crossing {
  way: number; // [lengths of the direction]
  triangle: number; // its place in the list
  weight_b: number;
  weight_c: number;
}

/** The first triangle that the ray crosses inwards (`side` 1) or outwards (-1); null: none. */
function first_crossing(surface: Surface, origin: Vec3, direction: Vec3, side: 1 | -1): Crossing | null {
  const { position: p, triangle } = surface;
  const [dx, dy, dz] = direction;
  let nearest = Infinity;
  let found = -1;
  let weight_b = 0;
  let weight_c = 0;
  // Möller and Trumbore 1997, without arrays: some ten thousand triangles for each move of the pointer.
  for (let t = 0; t < triangle.length; t += 3) {
    const a = 3 * triangle[t]!;
    const b = 3 * triangle[t + 1]!;
    const c = 3 * triangle[t + 2]!;
    const ax = p[a]!, ay = p[a + 1]!, az = p[a + 2]!;
    const ux = p[b]! - ax, uy = p[b + 1]! - ay, uz = p[b + 2]! - az;
    const vx = p[c]! - ax, vy = p[c + 1]! - ay, vz = p[c + 2]! - az;
    const hx = dy * vz - dz * vy, hy = dz * vx - dx * vz, hz = dx * vy - dy * vx;
    const determinant = side * (ux * hx + uy * hy + uz * hz);
    if (determinant <= 1e-30) continue; // seen from the other side
    const sx = side * (origin[0] - ax), sy = side * (origin[1] - ay), sz = side * (origin[2] - az);
    const beta = sx * hx + sy * hy + sz * hz;
    if (beta < 0 || beta > determinant) continue;
    const qx = sy * uz - sz * uy, qy = sz * ux - sx * uz, qz = sx * uy - sy * ux;
    const gamma = dx * qx + dy * qy + dz * qz;
    if (gamma < 0 || beta + gamma > determinant) continue;
    const way = (vx * qx + vy * qy + vz * qz) / determinant;
    if (way <= 0 || way >= nearest) continue;
    if (surface.shows && !surface.shows(plus(origin, direction, way))) continue;
    nearest = way;
    found = t;
    weight_b = beta / determinant;
    weight_c = gamma / determinant;
  }
  return found < 0 ? null : { way: nearest, triangle: found, weight_b, weight_c };
}

/** The first triangle of `surface` that the ray enters from outside; null: none. */
export function pick_surface(surface: Surface, origin: Vec3, direction: Vec3): Hit | null {
  const crossing = first_crossing(surface, origin, direction, 1);
  if (!crossing) return null;
  const { position: p, triangle } = surface;
  const { triangle: t, weight_b, weight_c } = crossing;
  const [a, b, c] = [triangle[t]!, triangle[t + 1]!, triangle[t + 2]!];
  const facet = normalised(cross(minus(at(p, b), at(p, a)), minus(at(p, c), at(p, a))));
  const n = surface.normal;
  const smooth = normalised(plus(plus(plus([0, 0, 0], at(n, a), 1 - weight_b - weight_c), at(n, b), weight_b), at(n, c), weight_c));
  return {
    point: plus(origin, direction, crossing.way),
    normal: dot(smooth, facet) > same_side ? smooth : facet,
    corner: [a, b, c],
    weight: [1 - weight_b - weight_c, weight_b, weight_c],
  };
}

/** How far it is from a point of the surface through the body, against its normal; Infinity where there is no other side. */
export function thickness_below(surface: Surface, hit: Hit): number {
  return first_crossing(surface, hit.point, plus([0, 0, 0], hit.normal, -1), -1)?.way ?? Infinity;
}

/**
 * In the plane: the nearest point of the boundary, up to `reach` away from `place` (z = 0); null: none is so near. `edge` has
 * the body on its left. `has_room`: whether a tool may come to a point from there.
 */
export function pick_boundary(
  position: ArrayLike<number>,
  edge: ArrayLike<number>,
  place: Vec3,
  reach: number,
  has_room: (hit: Hit) => boolean = () => true,
): Hit | null {
  let nearest = reach * reach;
  let hit: Hit | null = null;
  for (let e = 0; e < edge.length; e += 2) {
    const a = at(position, edge[e]!);
    const along = minus(at(position, edge[e + 1]!), a);
    const length2 = dot(along, along);
    const share = length2 > 0 ? Math.max(0, Math.min(1, dot(minus(place, a), along) / length2)) : 0;
    const point = plus(a, along, share);
    const apart = minus(place, point);
    const distance2 = dot(apart, apart);
    const found = { point, normal: normalised([along[1], -along[0], 0]) };
    if (distance2 > nearest || !has_room(found)) continue;
    nearest = distance2;
    hit = found;
  }
  return hit;
}

/** In the plane: whether a place is within the boundary. */
export function is_inside(position: ArrayLike<number>, edge: ArrayLike<number>, [x, y]: Vec3): boolean {
  let inside = false;
  for (let e = 0; e < edge.length; e += 2) {
    const [ax, ay] = at(position, edge[e]!);
    const [bx, by] = at(position, edge[e + 1]!);
    if (ay > y !== by > y && x < ax + ((y - ay) / (by - ay)) * (bx - ax)) inside = !inside;
  }
  return inside;
}

/** In the plane a press begins at the nearest point of the boundary, and goes with the pointer: along the boundary, and inwards. */
export function follow_in_plane(now: Hit, nearest: Hit, place: Vec3): { hit: Hit; deeper: number } {
  // Past the middle of the body its other side is nearer: the tool stays on its own.
  const inwards = (hit: Hit) => dot(minus(hit.point, place), hit.normal);
  const hit = inwards(nearest) > 0 && dot(nearest.normal, now.normal) < 0 ? now : nearest;
  return { hit, deeper: Math.max(0, inwards(hit)) };
}

/** The edges that belong to one triangle only, in its sense: of triangles that turn left, the body is on their left. */
export function boundary_edges(triangle: ArrayLike<number>, nodes: number): Uint32Array {
  const seen = new Map<number, [number, number] | null>();
  for (let t = 0; t < triangle.length; t += 3) {
    for (let i = 0; i < 3; ++i) {
      const a = triangle[t + i]!;
      const b = triangle[t + ((i + 1) % 3)]!;
      const key = Math.min(a, b) * nodes + Math.max(a, b);
      seen.set(key, seen.has(key) ? null : [a, b]);
    }
  }
  return Uint32Array.from([...seen.values()].flatMap((edge) => edge ?? []));
}
