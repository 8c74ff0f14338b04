// Where the tool is wanted for a point of the surface: formulas alone.
import type { Quaternion, Vec3 } from './words';

export interface ToolShape {
  radius: number; // 0: a point
  length: number; // of a capsule's segment, from the origin along its own axis
  disc_radius: number; // of a disc, normal to its own axis, with its edge, which is rounded by `radius`; 0: no disc
}

/** Of the radius: by what the edge of a disc is rounded where the option does not say. */
const usual_edge = 0.1;

/** Of the option `tool`: "point", "sphere:R", "capsule:R,L", "disc:R" or "disc:R,EDGE". */
export function parse_tool(text: string | undefined): ToolShape {
  const [kind = '', sizes = ''] = (text ?? 'point').split(':');
  const [radius = 0, second] = sizes.split(',').map(Number);
  if (kind === 'sphere') return { radius, length: 0, disc_radius: 0 };
  if (kind === 'capsule') return { radius, length: second ?? 0, disc_radius: 0 };
  if (kind === 'disc') return { radius: second ?? usual_edge * radius, length: 0, disc_radius: radius };
  return { radius: 0, length: 0, disc_radius: 0 };
}

/** As the option `tool` has it; of a disc the edge is the usual one unless it is given. */
export function tool_text(kind: string, radius: number, length: number, edge?: number): string {
  if (kind === 'sphere') return `sphere:${radius}`;
  if (kind === 'capsule') return `capsule:${radius},${length}`;
  if (kind === 'disc') return edge === undefined ? `disc:${radius}` : `disc:${radius},${edge}`;
  return 'point';
}

/** Outline of a disc from the lower middle round its edge to the upper: pairs of distance from the axis and height. */
export function disc_profile(disc_radius: number, edge: number, steps: number): [number, number][] {
  const core = disc_radius - edge;
  const round = Array.from({ length: steps + 1 }, (_, k): [number, number] => {
    const angle = Math.PI * (k / steps - 0.5);
    return [core + edge * Math.cos(angle), edge * Math.sin(angle)];
  });
  return [[0, -edge], ...round, [0, edge]];
}

export const plus = (a: Vec3, b: Vec3, scale = 1): Vec3 => [a[0] + scale * b[0], a[1] + scale * b[1], a[2] + scale * b[2]];
export const minus = (a: Vec3, b: Vec3): Vec3 => plus(a, b, -1);
export const dot = (a: Vec3, b: Vec3): number => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
export const cross = (a: Vec3, b: Vec3): Vec3 => [
  a[1] * b[2] - a[2] * b[1],
  a[2] * b[0] - a[0] * b[2],
  a[0] * b[1] - a[1] * b[0],
];
export const norm = (a: Vec3): number => Math.hypot(a[0], a[1], a[2]);
export const normalised = (a: Vec3): Vec3 => {
  const length = norm(a);
  return length > 0 ? [a[0] / length, a[1] / length, a[2] / length] : [0, 0, 1];
};

/**
 * The origin of a tool that the surface is `depth` inside of: the tool's surface is that far below `point`, against the
 * outward normal. A negative depth is a clearance.
 */
export function pressed_position(point: Vec3, normal: Vec3, radius: number, depth: number): Vec3 {
  return plus(point, normal, radius - depth);
}

/** The shortest turn that takes the tool's own axis (z; in the plane y, about z) onto the unit vector `normal`. */
export function turn_onto(normal: Vec3, dimension: 2 | 3): Quaternion {
  if (dimension === 2) {
    const angle = Math.atan2(-normal[0], normal[1]);
    return [0, 0, Math.sin(angle / 2), Math.cos(angle / 2)];
  }
  if (normal[2] < -0.999999) return [1, 0, 0, 0];
  const turn: Quaternion = [-normal[1], normal[0], 0, 1 + normal[2]];
  const length = Math.hypot(...turn);
  return turn.map((one) => one / length) as Quaternion;
}

/** Where a ray meets the plane through `point` with this normal; null where it runs along it or away from it. */
export function ray_meets_plane(origin: Vec3, direction: Vec3, point: Vec3, normal: Vec3): Vec3 | null {
  const slope = dot(direction, normal);
  if (Math.abs(slope) < 1e-12) return null;
  const way = dot(minus(point, origin), normal) / slope;
  return way > 0 ? plus(origin, direction, way) : null;
}

/** `depth` after the wheel turned by `pixels` (towards the person: shallower), in steps of a tenth of `unit`. */
export function turned_depth(depth: number, pixels: number, unit: number): number {
  return Math.max(0, Math.min(20 * unit, depth - (pixels / 100) * 0.1 * unit));
}
