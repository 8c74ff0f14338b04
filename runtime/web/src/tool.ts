// The tool where it is, and faintly where the hand wants it.
import {
  CapsuleGeometry,
  Group,
  LatheGeometry,
  Mesh,
  MeshStandardMaterial,
  SphereGeometry,
  Vector2,
  type BufferGeometry,
} from 'three';
import { disc_profile, type ToolShape } from './pose';

const size_of_point = 0.008; // of the body's

/** A disc normal to y, round at its edge. */
function disc_geometry(disc_radius: number, edge: number): BufferGeometry {
  return new LatheGeometry(disc_profile(disc_radius, edge, 12).map(([r, y]) => new Vector2(r, y)), 64);
}

export class ToolView {
  readonly group = new Group();
  private readonly tool_ = new Mesh<BufferGeometry, MeshStandardMaterial>(
    new SphereGeometry(1),
    new MeshStandardMaterial({ color: 0xdfe7f2, roughness: 0.3, metalness: 0.35, transparent: true, opacity: 0.45 }),
  );
  private readonly ghost_ = new Mesh<BufferGeometry, MeshStandardMaterial>(
    this.tool_.geometry,
    new MeshStandardMaterial({ color: 0x6cb6ff, transparent: true, opacity: 0.22, depthWrite: false }),
  );
  private size_ = 1; // of what is seen of it

  constructor() {
    this.group.add(this.tool_, this.ghost_);
    this.group.visible = false;
  }

  /** The shape, for a body of this size [m] and dimension. */
  take_shape(shape: ToolShape, body_size: number, dimension: 2 | 3): void {
    this.size_ = shape.radius > 0 ? shape.radius : size_of_point * body_size;
    let geometry: BufferGeometry;
    if (shape.disc_radius > 0) {
      geometry = disc_geometry(shape.disc_radius, shape.radius);
      if (dimension === 3) geometry.rotateX(Math.PI / 2);
    } else if (shape.length > 0) {
      geometry = new CapsuleGeometry(shape.radius, shape.length, 12, 32).translate(0, shape.length / 2, 0);
      if (dimension === 3) geometry.rotateX(Math.PI / 2);
    } else {
      geometry = new SphereGeometry(this.size_, 40, 24);
    }
    this.tool_.geometry.dispose();
    this.tool_.geometry = this.ghost_.geometry = geometry;
  }

  /** Poses as a frame has them: position, quaternion x y z w. */
  show(tool: Float32Array, device: Float32Array): void {
    this.group.visible = tool.every(Number.isFinite);
    const place = (mesh: Mesh, pose: Float32Array) => {
      mesh.position.fromArray(pose);
      mesh.quaternion.fromArray(pose, 3).normalize();
    };
    place(this.tool_, tool);
    place(this.ghost_, device);
    this.ghost_.visible = this.tool_.position.distanceTo(this.ghost_.position) > 0.03 * this.size_;
  }
}
