// Arrows of the forces on the body: of each contact, and of all together at the tool. They are as long on the screen as forces are large.
import { BackSide, Box3, ConeGeometry, CylinderGeometry, GreaterDepth, Group, InstancedMesh, Matrix4, MeshBasicMaterial, Quaternion, Vector3 } from 'three';
import { nice_ceiling, round_below } from './format';
import { floats_of_contact, type Frame } from './wire';

const most = 256;
const head = 12; // pixels
const longest = 110; // pixels
const shortest = 3; // pixels that are drawn
const border = 1; // pixels
const up = new Vector3(0, 1, 0);

/** Metres that a pixel shows at a place. */
export type PixelSize = (place: Vector3) => number;

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
  private own_ = 0; // force of the longest arrow [N], as this picture's forces want it
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
    return this.own_;
  }

  private get full(): number {
    return Math.max(this.own_, this.beside);
  }

  /** Forgets how long forces were. */
  forget(): void {
    this.own_ = 0;
  }

  /** `radius` of the tool [m], which the whole force's arrow does not hide in. The scale follows as forces grow, and shrinks far below. */
  show(frame: Frame, radius: number, pixel_at: PixelSize): void {
    this.contacts_.clear();
    this.whole_.clear();
    this.box.makeEmpty();
    const force = new Vector3().fromArray(frame.force);
    const size = force.length();
    if (size > this.own_ || (size > 0 && size < 0.02 * this.own_)) this.own_ = nice_ceiling(size);
    const { full } = this;
    if (!(full > 0)) return;
    let inwards = 0;
    for (let c = 0; c < frame.contact.length; c += floats_of_contact) {
      const place = new Vector3().fromArray(frame.contact, c);
      const normal = new Vector3().fromArray(frame.contact, c + 3);
      const along = new Vector3().fromArray(frame.contact, c + 6);
      const own = along.length();
      inwards -= normal.dot(along);
      if (!(own > 0)) continue;
      const pixel = pixel_at(place);
      const pixels = (longest * own) / full;
      const way = along.divideScalar(own);
      // Outside of the body, where it can be seen: the tip of one that presses, the tail of one that pulls.
      this.contacts_.add(way.dot(normal) < 0 ? place.addScaledVector(way, -pixels * pixel) : place, way, pixels, pixel);
    }
    if (!(size > 0)) return;
    const tool = new Vector3().fromArray(frame.tool);
    const pixel = pixel_at(tool);
    const pixels = (longest * size) / full;
    const way = force.divideScalar(size);
    const presses = frame.contact.length === 0 || inwards > 0;
    const gap = radius + 3 * pixel;
    this.whole_.add(presses ? tool.addScaledVector(way, -gap - pixels * pixel) : tool.addScaledVector(way, gap), way, pixels, pixel);
  }
}
