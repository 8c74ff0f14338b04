// Arrows of the forces on the body: of each contact, and of all together at the tool. They are as long on the screen as forces are large.
import { BackSide, Box3, ConeGeometry, CylinderGeometry, GreaterDepth, Group, InstancedMesh, Matrix4, MeshBasicMaterial, Quaternion, Vector3 } from 'three';
import { nice_ceiling, round_below } from './format';
import { floats_of_contact, type Frame } from './wire';

const most = 256;
const head = 12; // pixels
const longest = 110; // pixels
const shortest = 3; // pixels that are drawn
const border = 1; // pixels
const least_room = 0.3; // of the longest arrow: with less it goes to the tool's other side, if there is more
const up = new Vector3(0, 1, 0);

/** Metres that a pixel shows at a place. */
export type PixelSize = (place: Vector3) => number;
/** How many pixels there are from a place along a way of length 1, up to so many, before controls are in the way. */
export type Room = (from: Vector3, way: Vector3, pixels: number) => number;

/** Arrows of one colour: shafts and heads of length 1 along y; hidden parts are drawn faintly. */
class ArrowSet {
  readonly group = new Group();
  private readonly shafts_: InstancedMesh[];
  private readonly heads_: InstancedMesh[];
  private count_ = 0;

  constructor(
    colour: number,
    private readonly thickness_: number, // pixels
    private readonly box_: Box3,
  ) {
    const plain = new MeshBasicMaterial({ color: colour });
    const hidden = new MeshBasicMaterial({ color: colour, transparent: true, opacity: 0.3, depthFunc: GreaterDepth, depthWrite: false });
    const dark = new MeshBasicMaterial({ color: 0x3a2608, side: BackSide });
    const sets = (geometry: CylinderGeometry | ConeGeometry) => [dark, plain, hidden].map((material) => new InstancedMesh(geometry, material, most));
    this.shafts_ = sets(new CylinderGeometry(1, 1, 1, 10).translate(0, 0.5, 0));
    this.heads_ = sets(new ConeGeometry(1, 1, 16).translate(0, 0.5, 0));
    for (const part of [...this.shafts_, ...this.heads_]) {
      part.frustumCulled = false;
      part.renderOrder = 5;
      this.group.add(part);
    }
    this.clear();
  }

  clear(): void {
    this.count_ = 0;
    for (const part of [...this.shafts_, ...this.heads_]) part.count = 0;
  }

  /** From `tail` so many pixels along `way`, of length 1. */
  add(tail: Vector3, way: Vector3, pixels: number, pixel: number): void {
    if (this.count_ === most || !(pixels > shortest)) return;
    this.box_.expandByPoint(tail).expandByPoint(tail.clone().addScaledVector(way, pixels * pixel));
    const turn = new Quaternion().setFromUnitVectors(up, way);
    const size = Math.min(head, 0.6 * pixels) * (this.thickness_ / 2.4) ** 0.5 * pixel;
    const thick = Math.min(this.thickness_, 0.12 * pixels) * pixel;
    const shaft = pixels * pixel - size;
    const rim = border * Math.min(pixel, 0.4 * thick);
    const neck = tail.clone().addScaledVector(way, shaft);
    this.put(this.shafts_, tail, turn, new Vector3(thick, shaft, thick), tail.clone().addScaledVector(way, -rim), new Vector3(thick + rim, shaft, thick + rim));
    const wide = 0.36 * size;
    this.put(this.heads_, neck, turn, new Vector3(wide, size, wide), neck.clone().addScaledVector(way, -rim), new Vector3(wide + 1.6 * rim, size + 3.5 * rim, wide + 1.6 * rim));
    ++this.count_;
  }

  /** The first of the parts is the border: a little larger. */
  private put(parts: InstancedMesh[], place: Vector3, turn: Quaternion, size: Vector3, border_place: Vector3, border_size: Vector3): void {
    parts.forEach((part, k) => {
      part.setMatrixAt(this.count_, new Matrix4().compose(k === 0 ? border_place : place, turn, k === 0 ? border_size : size));
      part.count = this.count_ + 1;
      part.instanceMatrix.needsUpdate = true;
    });
  }
}

export class Arrows {
  readonly group = new Group();
  /** Around all from tail to tip. */
  readonly box = new Box3();
  private readonly contacts_ = new ArrowSet(0xf07c3e, 1.3, this.box);
  private readonly whole_ = new ArrowSet(0xf2c14e, 2.4, this.box);
  /** The whole force's arrow from tail to tip; null: there is none. */
  whole: [Vector3, Vector3] | null = null;
  private own_ = 0; // force of the longest arrow [N], as this picture's forces want it
  private crowded_ = 0; // the same, as the room for the whole force's arrow wants it
  /** The same of what is shown beside: a force is as long in both pictures. */
  beside = 0;

  constructor() {
    this.group.add(this.contacts_.group, this.whole_.group);
  }

  /** What the legend says: a force [N] and how many pixels long it is; 0: there is none. */
  get legend(): { force: number; pixels: number } {
    const force = round_below(0.6 * this.full);
    return { force, pixels: force > 0 ? (longest * force) / this.full : 0 };
  }

  /** The force of the longest arrow, without what is shown beside [N]. */
  get own(): number {
    return Math.max(this.own_, this.crowded_);
  }

  private get full(): number {
    return Math.max(this.own, this.beside);
  }

  /** Forgets how long forces were. */
  forget(): void {
    this.own_ = 0;
  }

  /** `radius` of the tool [m], which the whole force's arrow does not hide in. The scale follows as forces grow, and shrinks far below; arrows are shorter where there is no room. */
  show(frame: Frame, radius: number, pixel_at: PixelSize, room: Room): void {
    this.contacts_.clear();
    this.whole_.clear();
    this.box.makeEmpty();
    this.whole = null;
    this.crowded_ = 0;
    const force = new Vector3().fromArray(frame.force);
    const size = force.length();
    if (size > this.own_ || (size > 0 && size < 0.02 * this.own_)) this.own_ = nice_ceiling(size);
    const tool = new Vector3().fromArray(frame.tool);
    const pixel = pixel_at(tool);
    const gap = radius + 3 * pixel;
    const way = size > 0 ? force.clone().divideScalar(size) : force;
    const side = size > 0 ? this.side_of(frame, tool, way, gap, room) : 1;
    const { full } = this;
    if (!(full > 0)) return;
    this.show_contacts(frame, full, pixel_at);
    if (!(size > 0)) return;
    const pixels = (longest * size) / full;
    const tail = tool.clone().addScaledVector(way, side > 0 ? gap : -gap - pixels * pixel);
    this.whole_.add(tail, way, pixels, pixel);
    this.whole = [tail, tail.clone().addScaledVector(way, pixels * pixel)];
  }

  /** On which side of the tool the whole force's arrow is: where the force comes from (-1) if it presses, where it goes (1) if it pulls, and the other one where there is too little room. */
  private side_of(frame: Frame, tool: Vector3, way: Vector3, gap: number, room: Room): number {
    let inwards = 0;
    for (let c = 0; c < frame.contact.length; c += floats_of_contact) {
      for (let k = 0; k < 3; ++k) inwards -= frame.contact[c + 3 + k]! * frame.contact[c + 6 + k]!;
    }
    const free_at = (side: number) => room(tool.clone().addScaledVector(way, side * gap), way.clone().multiplyScalar(side), longest);
    let side = frame.contact.length === 0 || inwards > 0 ? -1 : 1;
    let free = free_at(side);
    if (free < least_room * longest) {
      const other = free_at(-side);
      if (other > free) [side, free] = [-side, other];
    }
    this.crowded_ = (longest * Math.hypot(...frame.force)) / Math.max(free, least_room * longest);
    return side;
  }

  private show_contacts(frame: Frame, full: number, pixel_at: PixelSize): void {
    for (let c = 0; c < frame.contact.length; c += floats_of_contact) {
      const place = new Vector3().fromArray(frame.contact, c);
      const normal = new Vector3().fromArray(frame.contact, c + 3);
      const along = new Vector3().fromArray(frame.contact, c + 6);
      const own = along.length();
      if (!(own > 0)) continue;
      const pixel = pixel_at(place);
      const pixels = (longest * own) / full;
      const way = along.divideScalar(own);
      // Outside of the body, where it can be seen: the tip of one that presses, the tail of one that pulls.
      this.contacts_.add(way.dot(normal) < 0 ? place.addScaledVector(way, -pixels * pixel) : place, way, pixels, pixel);
    }
  }
}
