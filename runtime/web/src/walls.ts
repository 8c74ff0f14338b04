// What a body that is solved while it is touched falls on and bumps against: floor, room and obstacle, as lines.
import { Box3, BufferGeometry, Color, Float32BufferAttribute, Group, LineBasicMaterial, LineSegments } from 'three';
import type { Vec3 } from './words';

const hatch = 0.05; // [size of the body] from one to the next
const floor_lines = 12; // each way, of a floor in space
const beyond = 1.5; // sizes of the body that a floor without walls goes on beside it

const numbers = (text: string | undefined): number[] => (text ? text.split(',').map(Number) : []);

/** Line segments, from place to place. */
type Lines = Vec3[];

/** A wall in the plane from a to b, with hatches `step` apart on its right: there is no way through. */
function hatched(a: Vec3, b: Vec3, step: number): Lines {
  const length = Math.hypot(b[0] - a[0], b[1] - a[1]);
  const [x, y] = [(b[0] - a[0]) / length, (b[1] - a[1]) / length];
  const lines: Lines = [a, b];
  for (let along = step; along < length; along += step) {
    const at: Vec3 = [a[0] + along * x, a[1] + along * y, 0];
    lines.push(at, [at[0] + 0.7 * step * (y - x), at[1] - 0.7 * step * (x + y), 0]);
  }
  return lines;
}

/** A floor between two corners, with lines both ways. */
function grid(low: Vec3, high: Vec3, height: number): Lines {
  const lines: Lines = [];
  for (let k = 0; k <= floor_lines; ++k) {
    const share = k / floor_lines;
    const x = low[0] + share * (high[0] - low[0]);
    const y = low[1] + share * (high[1] - low[1]);
    lines.push([x, low[1], height], [x, high[1], height], [low[0], y, height], [high[0], y, height]);
  }
  return lines;
}

/** The edges of a box, without those of its lid where it is open. */
function edges(low: Vec3, high: Vec3, is_open: boolean): Lines {
  const corner = (k: number): Vec3 => [k & 1 ? high[0] : low[0], k & 2 ? high[1] : low[1], k & 4 ? high[2] : low[2]];
  const lines: Lines = [];
  for (let k = 0; k < 8; ++k) {
    for (const bit of [1, 2, 4]) {
      if ((k & bit) === 0 && !(is_open && bit < 4 && (k & 4) !== 0)) lines.push(corner(k), corner(k | bit));
    }
  }
  return lines;
}

/** The lines of floor, room and obstacle beside a body in a box, and how high the highest floor is. */
export function wall_lines(settings: Record<string, string>, box: Box3, is_plane: boolean): { lines: Lines; floor: number | null } {
  const lines: Lines = [];
  const up = is_plane ? 1 : 2;
  const size = Math.max(box.max.x - box.min.x, box.max.y - box.min.y, box.max.z - box.min.z);
  const around = (side: 'min' | 'max'): Vec3 => box[side].toArray().map((at) => at + (side === 'min' ? -1 : 1) * beyond * size) as Vec3;
  const [room, obstacle] = [numbers(settings.room), numbers(settings.obstacle)];
  const floors = [...(settings.floor === undefined ? [] : [Number(settings.floor)]), ...(room.length === 6 ? [room[up]!] : [])];
  if (settings.floor !== undefined) {
    const height = Number(settings.floor);
    const [low, high] = [around('min'), around('max')];
    lines.push(...(is_plane ? hatched([low[0], height, 0], [high[0], height, 0], hatch * size) : grid(low, high, height)));
  }
  if (room.length === 6) {
    const [low, high] = [room.slice(0, 3) as Vec3, room.slice(3) as Vec3];
    if (is_plane) {
      const corner = (x: number, y: number): Vec3 => [x, y, 0];
      const turns = [corner(low[0], high[1]), corner(low[0], low[1]), corner(high[0], low[1]), corner(high[0], high[1])];
      for (let k = 0; k < 3; ++k) lines.push(...hatched(turns[k]!, turns[k + 1]!, hatch * size));
    } else {
      lines.push(...grid(low, high, low[2]), ...edges(low, high, true));
    }
  }
  if (obstacle.length === 6) {
    const [low, high] = [obstacle.slice(0, 3) as Vec3, obstacle.slice(3) as Vec3];
    if (is_plane) low[2] = high[2] = 0;
    lines.push(...edges(low, high, false));
  }
  return { lines, floor: floors.length > 0 ? Math.max(...floors) : null };
}

export class Walls {
  readonly group = new Group();
  readonly box = new Box3();
  floor: number | null = null; // height of the highest one
  private readonly lines_ = new LineSegments(new BufferGeometry(), new LineBasicMaterial({ transparent: true, opacity: 0.7 }));
  private shown_ = '';

  constructor() {
    this.group.add(this.lines_);
    this.group.visible = false;
  }

  set_ink(ink: string): void {
    this.lines_.material.color = new Color(ink);
  }

  /** Of a body at rest in a box; gives whether they are others than before. */
  take(settings: Record<string, string>, box: Box3, is_plane: boolean): boolean {
    const key = JSON.stringify([settings.floor, settings.room, settings.obstacle, box.min, box.max, is_plane]);
    if (key === this.shown_) return false;
    this.shown_ = key;
    const { lines, floor } = wall_lines(settings, box, is_plane);
    this.group.visible = lines.length > 0;
    this.lines_.geometry.setAttribute('position', new Float32BufferAttribute(lines.flat(), 3));
    this.box.setFromArray(lines.flat());
    this.lines_.geometry.computeBoundingSphere();
    this.floor = floor;
    return true;
  }
}
