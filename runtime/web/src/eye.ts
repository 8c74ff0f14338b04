// From where the body is seen: camera, projection, upright axis, and what turns and moves them.
import { Box2, Box3, MOUSE, OrthographicCamera, PerspectiveCamera, Plane, Raycaster, TOUCH, Vector2, Vector3 } from 'three';
import { OrbitControls } from 'three/addons/controls/OrbitControls.js';
import { first_direction, fit_places, guessed_up, turned_up, type Upright } from './outlook';
import type { Scene as SceneMessage } from './wire';
import type { Vec3 } from './words';

export interface Ray {
  origin: Vec3;
  direction: Vec3;
}

/** What of the element is free of controls [pixels from its sides]. */
export interface Margins {
  top: number;
  bottom: number;
  left: number;
  right: number;
}

/** Directions from the body to who looks, where z is up. */
export const presets: Record<string, Vec3> = {
  front: [0, -1, 0],
  back: [0, 1, 0],
  left: [-1, 0, 0],
  right: [1, 0, 0],
  top: [0, -0.0001, 1],
  bottom: [0, -0.0001, -1],
};

/** Where a camera is, to be kept: direction and distances are in sizes of the body. */
export interface Place {
  towards: Vec3;
  target: Vec3;
  away: number;
}

export class Eye {
  /** The picture is another. */
  changed: () => void = () => undefined;
  /** The person begins, and has ended, to turn or move it. */
  taken: () => void = () => undefined;
  is_flat = false;

  private readonly perspective_ = new PerspectiveCamera(30, 1, 0.01, 100);
  private readonly orthographic_ = new OrthographicCamera(-1, 1, 1, -1, 0.01, 100);
  private camera_: PerspectiveCamera | OrthographicCamera = this.perspective_;
  private controls_: OrbitControls;
  private box_ = new Box3(new Vector3(-1, -1, -1), new Vector3(1, 1, 1));
  private body_: SceneMessage | null = null;
  private floor_: number | null = null; // that the body may fall on
  private towards_: Vec3 = [0, -1, 0];
  private up_: Vec3 = [0, 0, 1];
  private upright_: Upright = 'auto';
  private wants_parallel_ = false;
  private is_fitted_ = true; // the person has not turned or moved it since
  private height_ = 0; // of the pad [px], as it was when the cameras took their shape
  private readonly free_ = new Box2(); // of controls, where the picture is from -1 to 1

  constructor(
    private readonly pad_: HTMLElement,
    private readonly margins_: () => Margins,
  ) {
    this.controls_ = this.make_controls();
  }

  get camera(): PerspectiveCamera | OrthographicCamera {
    return this.camera_;
  }
  get box(): Box3 {
    return this.box_;
  }
  /** Half the body's diagonal [m]. */
  get radius(): number {
    return Math.max(1e-9, this.box_.getSize(new Vector3()).length() / 2);
  }
  get up(): Vec3 {
    return this.up_;
  }

  /** Another body: in the plane it is seen from +z, and not turned. */
  take_body(body: SceneMessage): void {
    const box = new Box3().setFromArray(Array.from(body.position));
    const flat = body.dimension === 2;
    this.body_ = body;
    if (box.equals(this.box_) && flat === this.is_flat) return;
    this.box_ = box;
    this.is_flat = flat;
    this.settle();
  }

  /** Height of a floor below the body, which is to be in view with it; null: there is none. */
  set_floor(height: number | null): void {
    if (height === this.floor_) return;
    this.floor_ = height;
    this.stay_above();
    if (this.is_fitted_) this.fit();
  }

  /** Who looks stays above the floor. */
  private stay_above(): void {
    this.controls_.maxPolarAngle = this.floor_ === null || this.is_flat ? Math.PI : 0.5 * Math.PI;
  }

  set_upright(upright: Upright): void {
    if (upright === this.upright_) return;
    this.upright_ = upright;
    if (this.body_) this.settle();
  }

  set_parallel(on: boolean): void {
    this.wants_parallel_ = on;
    const wanted = this.is_flat || on ? this.orthographic_ : this.perspective_;
    if (wanted === this.camera_) return;
    const was_fitted = this.is_fitted_;
    const place = this.place;
    this.camera_ = wanted;
    this.remake_controls();
    this.place = place;
    if (was_fitted) this.fit();
  }

  /** The whole body in view, from where people look. */
  fit(): void {
    this.is_fitted_ = true;
    if (!this.body_) {
      this.shape_cameras();
      return;
    }
    const height = Math.max(1, this.pad_.clientHeight);
    const { width: wide, height: high } = this.opening();
    const full = this.is_flat ? 0.84 : 0.94; // a tool stands beside a body in the plane
    const shares = { wide: (wide / height) * full, high: (high / height) * full };
    const towards: Vec3 = this.is_flat ? [0, 0, 1] : this.towards_;
    const up: Vec3 = this.is_flat ? [0, 1, 0] : this.up_;
    const slope = Math.tan((this.perspective_.fov * Math.PI) / 360);
    const { target, away } = fit_places(this.places(this.body_), towards, up, slope, shares, this.camera_ === this.orthographic_);
    this.go(towards, new Vector3(...target), away);
  }

  /** The body's, and where it would lie on the floor. */
  private places(body: SceneMessage): Float32Array {
    if (this.floor_ === null) return body.position;
    const { min, max } = this.box_;
    const below = [min.x, max.x].flatMap((x) => (this.is_flat ? [x, this.floor_!, 0] : [x, min.y, this.floor_!, x, max.y, this.floor_!]));
    const places = new Float32Array(body.position.length + below.length);
    places.set(body.position);
    places.set(below, body.position.length);
    return places;
  }

  look_from(name: string): void {
    const direction = presets[name];
    if (this.is_flat) return this.fit();
    if (direction) this.towards_ = turned_up(direction, this.up_);
    else if (this.body_) this.towards_ = first_direction(this.body_, this.up_);
    this.fit();
  }

  get place(): Place {
    const target = this.controls_.target;
    const away = this.away();
    return {
      towards: this.camera_.position.clone().sub(target).normalize().toArray(),
      target: target.clone().sub(this.box_.getCenter(new Vector3())).divideScalar(this.radius).toArray(),
      away: away / this.radius,
    };
  }
  set place({ towards, target, away }: Place) {
    this.is_fitted_ = false;
    const centre = new Vector3(...target).multiplyScalar(this.radius).add(this.box_.getCenter(new Vector3()));
    this.go(towards, centre, away * this.radius);
  }
  /** The whole body, from there. */
  fit_from(towards: Vec3): void {
    if (!this.is_flat) this.towards_ = towards;
    this.fit();
  }

  get is_fitted(): boolean {
    return this.is_fitted_;
  }

  /** By keys: angles [rad]. */
  turn(right: number, up: number): void {
    if (this.is_flat) return;
    this.is_fitted_ = false;
    const offset = this.camera_.position.clone().sub(this.controls_.target);
    const axis = new Vector3(...this.up_);
    offset.applyAxisAngle(axis, -right);
    const aside = new Vector3().crossVectors(axis, offset).normalize();
    const angle = offset.angleTo(axis);
    offset.applyAxisAngle(aside, Math.max(0.02 - angle, Math.min(Math.PI - 0.02 - angle, -up)));
    this.camera_.position.copy(this.controls_.target).add(offset);
    this.controls_.update();
    this.changed();
  }

  zoom(factor: number): void {
    const place = this.place;
    place.away /= factor;
    this.place = place;
  }

  /** Where the pixel looks: into the picture. */
  ray(client_x: number, client_y: number): Ray {
    const area = this.pad_.getBoundingClientRect();
    const place = new Vector2(((client_x - area.left) / area.width) * 2 - 1, 1 - ((client_y - area.top) / area.height) * 2);
    const caster = new Raycaster();
    this.camera_.updateMatrixWorld();
    caster.setFromCamera(place, this.camera_);
    return { origin: caster.ray.origin.toArray(), direction: caster.ray.direction.toArray() };
  }

  /** In the plane: the place under the pixel, z = 0. */
  place_in_plane(client_x: number, client_y: number): Vec3 {
    const { origin, direction } = this.ray(client_x, client_y);
    const caster = new Raycaster(new Vector3(...origin), new Vector3(...direction));
    return (caster.ray.intersectPlane(new Plane(new Vector3(0, 0, 1), 0), new Vector3()) ?? new Vector3()).toArray();
  }

  /** Metres that a pixel of the page shows at a place. */
  pixel_at(place: Vector3): number {
    const height = Math.max(1, this.height_);
    if (this.camera_ === this.orthographic_) {
      const { top, bottom, zoom } = this.orthographic_;
      return (top - bottom) / zoom / height;
    }
    const deep = this.looking();
    const from = place.clone().sub(this.camera_.position);
    const depth = Math.max(1e-9, from.x * deep[0] + from.y * deep[1] + from.z * deep[2]);
    return (2 * depth * Math.tan((this.perspective_.fov * Math.PI) / 360)) / height;
  }

  /** Metres that a pixel shows where the camera looks. */
  metres_of_pixel(): number {
    return this.pixel_at(this.controls_.target);
  }

  /** Into the picture, of length 1. */
  looking(): Vec3 {
    return this.camera_.getWorldDirection(new Vector3()).toArray();
  }

  /** How many of `pixels` of the page from a place along a way of length 1 are free of controls. */
  room(from: Vector3, way: Vector3, pixels: number): number {
    const begin = from.clone().project(this.camera_);
    const end = from.clone().addScaledVector(way, pixels * this.pixel_at(from)).project(this.camera_);
    let share = 1;
    for (const axis of ['x', 'y'] as const) {
      const [at, to] = [begin[axis], end[axis]];
      const bound = to < at ? this.free_.min[axis] : this.free_.max[axis];
      if ((to - bound) * (to - at) > 0) share = Math.min(share, (bound - at) / (to - at));
    }
    return Math.max(0, share) * pixels;
  }

  /** The pixel of the window that shows a place. */
  project(x: number, y: number, z: number): { x: number; y: number } {
    this.camera_.updateMatrixWorld();
    const seen = new Vector3(x, y, z).project(this.camera_);
    const area = this.pad_.getBoundingClientRect();
    return { x: area.left + ((seen.x + 1) / 2) * area.width, y: area.top + ((1 - seen.y) / 2) * area.height };
  }

  /** The element has another size or other controls over it. */
  resize(): void {
    if (this.is_fitted_) this.fit();
    else this.shape_cameras();
    this.changed();
  }

  private settle(): void {
    if (!this.body_) return;
    this.up_ = this.is_flat ? [0, 1, 0] : this.upright_ === 'auto' ? guessed_up(this.body_) : turned_up([0, 0, 1], axis_of(this.upright_));
    this.towards_ = this.is_flat ? [0, 0, 1] : first_direction(this.body_, this.up_);
    this.camera_ = this.is_flat || this.wants_parallel_ ? this.orthographic_ : this.perspective_;
    for (const camera of [this.perspective_, this.orthographic_]) camera.up.set(...this.up_);
    this.remake_controls();
    this.fit();
  }

  private go(towards: Vec3, target: Vector3, away: number): void {
    const far = this.camera_ === this.orthographic_ ? 4 * this.radius : away;
    this.camera_.position.copy(target).addScaledVector(new Vector3(...towards), far);
    this.orthographic_.zoom = 1;
    this.half_ = away * Math.tan((this.perspective_.fov * Math.PI) / 360);
    this.camera_.near = this.camera_ === this.orthographic_ ? 0.001 * this.radius : 0.02 * this.radius;
    this.camera_.far = 60 * this.radius;
    this.controls_.target.copy(target);
    this.controls_.minDistance = 0.2 * this.radius;
    this.controls_.maxDistance = 40 * this.radius;
    this.shape_cameras();
    this.controls_.update();
    this.changed();
  }
  private half_ = 1; // height that a parallel picture shows [m], at zoom 1

  private away(): number {
    if (this.camera_ === this.orthographic_) return this.half_ / this.orthographic_.zoom / Math.tan((this.perspective_.fov * Math.PI) / 360);
    return this.camera_.position.distanceTo(this.controls_.target);
  }

  private shape_cameras(): void {
    const { clientWidth: width, clientHeight: height } = this.pad_;
    this.height_ = height;
    if (width === 0 || height === 0) return;
    const aspect = width / height;
    this.perspective_.aspect = aspect;
    Object.assign(this.orthographic_, { left: -this.half_ * aspect, right: this.half_ * aspect, top: this.half_, bottom: -this.half_ });
    const { right, below } = this.opening();
    const margins = this.margins_();
    this.free_.min.set(-1 + (2 * margins.left) / width, -1 + (2 * margins.bottom) / height);
    this.free_.max.set(1 - (2 * margins.right) / width, 1 - (2 * margins.top) / height);
    for (const camera of [this.perspective_, this.orthographic_]) camera.setViewOffset(width, height, -right, -below, width, height);
  }

  /** What is free of controls: its size and by how much its middle is right of and below the picture's [pixels]. */
  private opening(): { width: number; height: number; right: number; below: number } {
    const { clientWidth: width, clientHeight: height } = this.pad_;
    const { top, bottom, left, right } = this.margins_();
    return {
      width: Math.max(0.4 * width, width - left - right),
      height: Math.max(0.4 * height, height - top - bottom),
      right: (left - right) / 2,
      below: (top - bottom) / 2,
    };
  }

  private remake_controls(): void {
    const target = this.controls_.target.clone();
    this.controls_.dispose();
    this.controls_ = this.make_controls();
    this.controls_.target.copy(target);
    this.stay_above();
  }

  private make_controls(): OrbitControls {
    const controls = new OrbitControls(this.camera_, this.pad_);
    controls.enableRotate = !this.is_flat;
    controls.zoomToCursor = true;
    controls.mouseButtons = this.is_flat
      ? { LEFT: MOUSE.PAN, MIDDLE: MOUSE.PAN, RIGHT: MOUSE.PAN }
      : { LEFT: MOUSE.ROTATE, MIDDLE: MOUSE.PAN, RIGHT: MOUSE.ROTATE };
    controls.touches = this.is_flat ? { ONE: TOUCH.PAN, TWO: TOUCH.DOLLY_PAN } : { ONE: TOUCH.ROTATE, TWO: TOUCH.DOLLY_PAN };
    controls.addEventListener('start', () => (this.is_fitted_ = false));
    controls.addEventListener('change', () => this.changed());
    controls.addEventListener('end', () => this.taken());
    return controls;
  }
}

function axis_of(upright: Upright): Vec3 {
  const sign = upright.startsWith('-') ? -1 : 1;
  const axis = 'xyz'.indexOf(upright.at(-1)!);
  return [0, 1, 2].map((k) => (k === axis ? sign : 0)) as Vec3;
}
