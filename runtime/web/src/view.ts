// The picture: renderer, camera, lights and what stands still in it.
import {
  AmbientLight,
  ArrowHelper,
  Box3,
  DirectionalLight,
  GridHelper,
  Group,
  OrthographicCamera,
  PerspectiveCamera,
  Plane,
  Raycaster,
  Scene,
  Vector2,
  Vector3,
  WebGLRenderer,
  MOUSE,
  TOUCH,
} from 'three';
import { OrbitControls } from 'three/addons/controls/OrbitControls.js';
import { first_direction, fit_places } from './outlook';
import type { Scene as SceneMessage } from './wire';
import type { Vec3 } from './words';

const axis_colours = [0xff6b6b, 0x69db7c, 0x74a9ff];
const triad_pixels = 84;

export interface Ray {
  origin: Vec3;
  direction: Vec3;
}

export class View {
  readonly scene = new Scene();
  /** Called before each picture is drawn. */
  before_drawing: () => void = () => undefined;

  private readonly renderer_: WebGLRenderer;
  private readonly perspective_ = new PerspectiveCamera(35, 1, 0.01, 100);
  private readonly orthographic_ = new OrthographicCamera(-1, 1, 1, -1, 0.01, 100);
  private camera_: PerspectiveCamera | OrthographicCamera = this.perspective_;
  private controls_: OrbitControls;
  private readonly lamp_ = new Group();
  private grid_: GridHelper | null = null;
  private readonly triad_ = new Scene();
  private readonly triad_camera_ = new OrthographicCamera(-1.25, 1.25, 1.25, -1.25, 0.1, 10);
  private box_ = new Box3(new Vector3(-1, -1, -1), new Vector3(1, 1, 1));
  private places_: Float32Array = new Float32Array(0);
  private towards_: Vec3 = [0, -1, 0];
  private flat_ = false;
  private is_wanted_ = false;
  private is_fitted_ = true; // the person has not turned or moved it since

  constructor(readonly element: HTMLElement) {
    this.renderer_ = new WebGLRenderer({ antialias: true, alpha: true });
    this.renderer_.setClearAlpha(0);
    this.renderer_.autoClear = false;
    this.canvas.tabIndex = 0;
    this.canvas.setAttribute('aria-label', 'The body');
    this.canvas.dataset.testid = 'view';
    element.prepend(this.canvas);

    const key = new DirectionalLight(0xfff4e6, 2.5);
    key.position.set(-1, 1, 0.75);
    const fill = new DirectionalLight(0xbfd4ff, 0.8);
    fill.position.set(1, -0.4, 0.5);
    this.lamp_.add(key, key.target, fill, fill.target);
    this.scene.add(new AmbientLight(0xdfe8ff, 0.5), this.lamp_);
    axis_colours.forEach((colour, axis) => {
      const along = new Vector3().setComponent(axis, 1);
      const arrow = new ArrowHelper(along, new Vector3(), 0.95, colour, 0.3, 0.2);
      this.triad_.add(arrow);
    });

    this.controls_ = this.make_controls();
    new ResizeObserver(() => (this.is_fitted_ ? this.fit() : this.resize())).observe(element);
    this.resize();
  }

  get canvas(): HTMLCanvasElement {
    return this.renderer_.domElement;
  }

  /** Draws at the next chance; many wishes are one picture. */
  draw(): void {
    if (this.is_wanted_) return;
    this.is_wanted_ = true;
    requestAnimationFrame(() => {
      this.is_wanted_ = false;
      this.before_drawing();
      this.render();
    });
  }

  /** Another body: in the plane it is seen from +z, and not turned. */
  take_body(body: SceneMessage): void {
    const box = new Box3().setFromArray(Array.from(body.position));
    const flat = body.dimension === 2;
    this.places_ = body.position;
    if (box.equals(this.box_) && flat === this.flat_) return;
    this.box_ = box;
    this.towards_ = first_direction(body);
    if (flat !== this.flat_) {
      this.flat_ = flat;
      this.camera_ = flat ? this.orthographic_ : this.perspective_;
      this.controls_.dispose();
      this.controls_ = this.make_controls();
    }
    this.fit();
  }

  /** The whole body in view, from where people look. */
  fit(): void {
    this.is_fitted_ = true;
    const centre = this.box_.getCenter(new Vector3());
    const radius = Math.max(1e-9, this.box_.getSize(new Vector3()).length() / 2);
    const camera = this.camera_;
    if (camera instanceof OrthographicCamera) {
      camera.up.set(0, 1, 0);
      camera.position.copy(centre).setZ(centre.z + 10 * radius);
      camera.zoom = 1;
    } else {
      camera.up.set(0, 0, 1);
      const slope = Math.tan((camera.fov * Math.PI) / 360);
      const opening = this.opening();
      const shares = { wide: (opening.width / this.element.clientHeight) * 0.94, high: (opening.height / this.element.clientHeight) * 0.94 };
      const { target, away } = fit_places(this.places_, this.towards_, [0, 0, 1], slope, shares);
      centre.set(...target);
      camera.position.copy(centre).addScaledVector(new Vector3(...this.towards_), away);
    }
    camera.near = 0.02 * radius;
    camera.far = 60 * radius;
    this.controls_.target.copy(centre);
    this.controls_.minDistance = 0.2 * radius;
    this.controls_.maxDistance = 40 * radius;
    this.resize();
    this.controls_.update();
    this.draw();
  }

  show_grid(on: boolean): void {
    if (this.grid_) this.scene.remove(this.grid_);
    this.grid_?.dispose();
    this.grid_ = null;
    if (on) {
      const size = this.box_.getSize(new Vector3()).length();
      const cell = 10 ** Math.round(Math.log10(size / 10));
      const cells = 2 * Math.ceil(size / cell);
      this.grid_ = new GridHelper(cells * cell, cells, 0x4a5568, 0x2a3342);
      this.grid_.rotation.x = Math.PI / 2;
      const centre = this.box_.getCenter(new Vector3());
      this.grid_.position.set(Math.round(centre.x / cell) * cell, Math.round(centre.y / cell) * cell, this.box_.min.z);
      this.scene.add(this.grid_);
    }
    this.draw();
  }

  /** Where the pixel looks: into the picture. */
  ray(client_x: number, client_y: number): Ray {
    const area = this.canvas.getBoundingClientRect();
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

  /** Metres that a pixel shows, in the plane. */
  metres_of_pixel(): number {
    const { left, right, zoom } = this.orthographic_;
    return (right - left) / zoom / Math.max(1, this.canvas.clientWidth);
  }

  /** Into the picture, of length 1. */
  looking(): Vec3 {
    return this.camera_.getWorldDirection(new Vector3()).toArray();
  }

  /** The pixel of the window that shows a place. */
  project(x: number, y: number, z: number): { x: number; y: number } {
    this.camera_.updateMatrixWorld();
    const seen = new Vector3(x, y, z).project(this.camera_);
    const area = this.canvas.getBoundingClientRect();
    return { x: area.left + ((seen.x + 1) / 2) * area.width, y: area.top + ((1 - seen.y) / 2) * area.height };
  }

  /** Draws at once and gives what was drawn, without a background. */
  take_picture(): HTMLCanvasElement {
    this.render();
    return this.canvas;
  }

  private make_controls(): OrbitControls {
    const controls = new OrbitControls(this.camera_, this.canvas);
    controls.enableRotate = !this.flat_;
    controls.zoomToCursor = true;
    controls.mouseButtons = this.flat_
      ? { LEFT: MOUSE.PAN, MIDDLE: MOUSE.PAN, RIGHT: MOUSE.PAN }
      : { LEFT: MOUSE.ROTATE, MIDDLE: MOUSE.PAN, RIGHT: MOUSE.ROTATE };
    controls.touches = this.flat_ ? { ONE: TOUCH.PAN, TWO: TOUCH.DOLLY_PAN } : { ONE: TOUCH.ROTATE, TWO: TOUCH.DOLLY_PAN };
    controls.addEventListener('start', () => (this.is_fitted_ = false));
    controls.addEventListener('change', () => this.draw());
    return controls;
  }

  /** What is free of controls: its size and by how much its middle is right of and below the picture's [pixels]. */
  private opening(): { width: number; height: number; right: number; below: number } {
    const { clientWidth: width, clientHeight: height } = this.element;
    const [top, bottom] = [92, 66]; // controls above and below
    const side = width < 700 ? 8 : 24;
    const bar = this.flat_ || width < 700 ? 64 : 84; // the colour bar
    return { width: width - side - bar, height: Math.max(0.4 * height, height - top - bottom), right: (side - bar) / 2, below: (top - bottom) / 2 };
  }

  private resize(): void {
    const { clientWidth: width, clientHeight: height } = this.element;
    if (width === 0 || height === 0) return;
    this.renderer_.setPixelRatio(Math.min(2, window.devicePixelRatio));
    this.renderer_.setSize(width, height);
    const aspect = width / height;
    this.perspective_.aspect = aspect;
    this.perspective_.updateProjectionMatrix();
    const size = this.box_.getSize(new Vector3());
    const opening = this.opening();
    const half = (0.58 * height * Math.max(size.y / opening.height, size.x / opening.width)) || 1e-9;
    for (const camera of [this.perspective_, this.orthographic_]) camera.setViewOffset(width, height, -opening.right, -opening.below, width, height);
    Object.assign(this.orthographic_, { left: -half * aspect, right: half * aspect, top: half, bottom: -half });
    this.orthographic_.near = 0.01;
    this.orthographic_.updateProjectionMatrix();
    this.camera_.updateProjectionMatrix();
    this.draw();
  }

  private render(): void {
    const renderer = this.renderer_;
    this.lamp_.position.copy(this.camera_.position);
    this.lamp_.quaternion.copy(this.camera_.quaternion);
    renderer.clear();
    renderer.render(this.scene, this.camera_);

    const towards = new Vector3(0, 0, 4).applyQuaternion(this.camera_.quaternion);
    this.triad_camera_.position.copy(towards);
    this.triad_camera_.quaternion.copy(this.camera_.quaternion);
    renderer.clearDepth();
    renderer.setScissorTest(true);
    const bottom = this.element.clientWidth < 700 ? 56 : 8; // above what stands there on a small screen
    renderer.setViewport(8, bottom, triad_pixels, triad_pixels);
    renderer.setScissor(8, bottom, triad_pixels, triad_pixels);
    renderer.render(this.triad_, this.triad_camera_);
    renderer.setScissorTest(false);
    renderer.setViewport(0, 0, this.element.clientWidth, this.element.clientHeight);
  }
}
