// Arrows of the forces on the body: of each contact, and of all together at the tool.
import { ConeGeometry, CylinderGeometry, Group, InstancedMesh, Matrix4, MeshBasicMaterial, Quaternion, Vector3 } from 'three';
import { nice_ceiling } from './format';
import { floats_of_contact, type Frame } from './wire';

const most = 256;
const head = 0.28; // share of the length
const up = new Vector3(0, 1, 0);

/** Arrows of one colour; an arrow of length 1 stands on the origin along y. */
class ArrowSet {
  readonly group = new Group();
  private readonly shafts_: InstancedMesh;
  private readonly heads_: InstancedMesh;
  private count_ = 0;

  constructor(
    colour: number,
    private readonly thickness_: number,
  ) {
    const material = new MeshBasicMaterial({ color: colour, transparent: true, opacity: 1, depthTest: false });
    this.shafts_ = new InstancedMesh(new CylinderGeometry(1, 1, 1 - head, 10).translate(0, (1 - head) / 2, 0), material, most);
    this.heads_ = new InstancedMesh(new ConeGeometry(2.6, head, 14).translate(0, 1 - head / 2, 0), material, most);
    for (const part of [this.shafts_, this.heads_]) {
      part.frustumCulled = false;
      part.renderOrder = 5;
      this.group.add(part);
    }
    this.clear();
  }

  clear(): void {
    this.count_ = this.shafts_.count = this.heads_.count = 0;
  }

  add(from: Vector3, along: Vector3, body_size: number): void {
    const length = along.length();
    if (this.count_ === most || !(length > 1e-4 * body_size)) return;
    const turn = new Quaternion().setFromUnitVectors(up, along.clone().divideScalar(length));
    const thick = Math.min(this.thickness_ * body_size, 0.07 * length);
    const matrix = new Matrix4().compose(from, turn, new Vector3(thick, length, thick));
    for (const part of [this.shafts_, this.heads_]) {
      part.setMatrixAt(this.count_, matrix);
      part.count = this.count_ + 1;
      part.instanceMatrix.needsUpdate = true;
    }
    ++this.count_;
  }
}

export class Arrows {
  readonly group = new Group();
  private readonly contacts_ = new ArrowSet(0xff9b5e, 0.0022);
  private readonly whole_ = new ArrowSet(0xffe08a, 0.004);
  private scale_ = 0; // force that is a quarter of the body long [N]

  constructor() {
    this.group.add(this.contacts_.group, this.whole_.group);
  }

  /** The longest arrow is up to a quarter of the body; the scale follows as forces grow, and shrinks far below. */
  show(frame: Frame, body_size: number): void {
    this.contacts_.clear();
    this.whole_.clear();
    const force = new Vector3().fromArray(frame.force);
    const size = force.length();
    if (size > this.scale_ || size < 0.02 * this.scale_) this.scale_ = nice_ceiling(size);
    if (!(this.scale_ > 0)) return;
    const metres = (0.25 * body_size) / this.scale_;
    for (let c = 0; c < frame.contact.length; c += floats_of_contact) {
      const place = new Vector3().fromArray(frame.contact, c);
      const normal = new Vector3().fromArray(frame.contact, c + 3);
      const along = new Vector3().fromArray(frame.contact, c + 6).multiplyScalar(metres);
      // Outside of the body, where it can be seen: the tip of one that presses, the tail of one that pulls.
      this.contacts_.add(along.dot(normal) < 0 ? place.sub(along) : place, along, body_size);
    }
    const along = force.multiplyScalar(metres);
    const tool = new Vector3().fromArray(frame.tool);
    this.whole_.add(tool.sub(along), along, body_size);
  }
}
