// The picture: what is drawn, when, and how finely.
import { Box3, GridHelper, Group, Scene, Vector2, Vector3, WebGLRenderer } from 'three';
import { set_style } from './dom';
import { Eye, type Margins } from './eye';
import { Light } from './light';
import { Pace } from './pace';
import { Shade, type Around } from './shade';
import type { Section } from './section';
import type { Scene as SceneMessage } from './wire';

const rest_after = 220; // [ms] without a change a whole picture is drawn
const most_pixels = 2; // of the drawing for one of the page, along a side
const most_drawn = 6e6; // pixels of the drawing
const least_drawn = 1.1e5;
const smooth = 1.5; // pixels along a side that become one of a picture that rests
const cut_margin = 24; // pixels of the page around what is drawn: arrows are thick
const cut_step = 32;
const shade_pictures = 4; // that share one shade, where time is short
const many_pixels = 4e6; // of the screen, that the browser takes long to put together without a graphics card
const shade_reach = 0.16; // of half the body's diagonal

/** How often and how finely is drawn, for tests and measurements. */
export interface Drawing {
  pictures: number;
  share: number; // of the screen's pixels along a side
  rests: boolean;
}

/** Whether the processor draws, as far as the browser says. */
function draws_in_software(renderer: WebGLRenderer): boolean {
  const gl = renderer.getContext();
  const names = gl.getExtension('WEBGL_debug_renderer_info');
  return names !== null && /swiftshader|llvmpipe|softpipe|software|basic render/i.test(String(gl.getParameter(names.UNMASKED_RENDERER_WEBGL)));
}

export class View {
  readonly scene = new Scene();
  readonly light = new Light();
  readonly eye: Eye;
  /** Called before each picture is drawn. */
  before_drawing: () => void = () => undefined;
  /** Called after each. */
  after_drawing: () => void = () => undefined;
  /** What of the element is covered by controls. */
  margins: () => Margins = () => ({ top: 60, bottom: 66, left: 24, right: 84 });
  readonly drawing: Drawing = { pictures: 0, share: 1, rests: false };

  /** Around the body as it is now. */
  body_box = new Box3();
  /** Around all that is drawn, but for the grid. */
  readonly seen_box = new Box3();
  /** What the pointer touches: as large as the stage without the colours' bar; of it the picture may show a part only. */
  readonly pad = document.createElement('div');

  /** Of the pad [px]: asked of it in each picture, the browser would lay out the page each time. */
  extent = { width: 0, height: 0 };

  /** Every picture is drawn whole, as for a video. */
  is_whole = false;

  private readonly renderer_ = new WebGLRenderer({ antialias: false, alpha: true, stencil: true });
  private readonly shade_: Shade;
  private readonly is_software_: boolean;
  private readonly pace_ = new Pace();
  private grid_: GridHelper | null = null;
  private readonly still_ = new Group();
  private is_wanted_ = false;
  private wanted_at_ = 0;
  private begun_at_ = 0; // [ms], when the last one was begun
  private done_at_ = 0; // and when the page was free again: a browser without a graphics card waits for each picture after it was drawn
  private readonly handed_over_ = new MessageChannel();
  private rest_timer_ = 0;
  private size_ = '';
  private shade_age_ = 0; // pictures
  private shade_seen_ = ''; // the camera that the shade is of

  constructor(
    readonly element: HTMLElement,
    private readonly section_: Section,
  ) {
    this.renderer_.setClearAlpha(0);
    this.renderer_.autoClear = false;
    this.renderer_.localClippingEnabled = true;
    this.canvas.setAttribute('aria-hidden', 'true');
    this.pad.className = 'pad';
    this.pad.tabIndex = 0;
    this.pad.setAttribute('role', 'application');
    this.pad.setAttribute('aria-label', 'The body. Arrow keys move the tool, Enter presses and lifts it, Shift and arrows turn the view; ? lists all keys');
    this.pad.dataset.testid = 'view';
    element.prepend(this.canvas, this.pad);
    this.is_software_ = draws_in_software(this.renderer_);
    this.shade_ = new Shade(this.light, section_.cut);
    this.scene.add(this.still_);
    this.eye = new Eye(this.pad, () => this.margins());
    this.eye.changed = () => this.draw();
    new ResizeObserver(() => this.resize()).observe(this.pad);
    this.handed_over_.port1.onmessage = () => (this.done_at_ = performance.now());
    this.resize();
  }

  /** Light of this picture is that of the body's nodes. */
  get is_rough(): boolean {
    return !this.drawing.rests && this.pace_.is_rough;
  }

  get canvas(): HTMLCanvasElement {
    return this.renderer_.domElement;
  }

  /** Draws at the next chance; many wishes are one picture. */
  draw(): void {
    if (this.is_wanted_) return;
    this.is_wanted_ = true;
    this.wanted_at_ = performance.now();
    requestAnimationFrame(() => {
      this.is_wanted_ = false;
      const begun = performance.now();
      const is_done = this.done_at_ >= this.begun_at_;
      this.pace_.note(is_done ? this.done_at_ - this.begun_at_ + begun - Math.max(this.done_at_, this.wanted_at_) : begun - this.begun_at_);
      this.begun_at_ = begun;
      this.picture(this.is_whole ? Math.min(smooth, this.pace_.most) : this.pace_.share, this.is_whole);
      this.handed_over_.port2.postMessage(0);
      clearTimeout(this.rest_timer_);
      this.rest_timer_ = window.setTimeout(() => this.rest(), rest_after);
    });
  }

  take_body(body: SceneMessage): void {
    this.eye.take_body(body);
  }

  resize(): void {
    const { clientWidth: width, clientHeight: height } = this.pad;
    this.extent = { width, height };
    if (width === 0 || height === 0) return;
    this.size_ = '';
    this.set_bounds(width, height);
    if (this.is_software_) this.pace_.begin_coarse();
    this.element.classList.toggle('even', this.is_software_ && this.pace_.may_be_blocky); // a browser without a graphics card copies a gradient into each picture
    this.canvas.style.width = `${width}px`;
    this.canvas.style.height = `${height}px`;
    this.eye.resize();
  }

  show_grid(on: boolean, colour: number): void {
    if (this.grid_) this.still_.remove(this.grid_);
    this.grid_?.dispose();
    this.grid_ = null;
    if (on) {
      const box = this.eye.box;
      const size = box.getSize(new Vector3()).length();
      const cell = 10 ** Math.round(Math.log10(size / 10));
      const cells = 2 * Math.ceil(size / cell);
      this.grid_ = new GridHelper(cells * cell, cells, colour, colour);
      const up = new Vector3(...(this.eye.is_flat ? ([0, 0, 1] as const) : this.eye.up));
      this.grid_.quaternion.setFromUnitVectors(new Vector3(0, 1, 0), up);
      this.grid_.position.copy(this.floor(box, up, cell));
      this.grid_.material.transparent = true;
      this.grid_.material.opacity = 0.35;
      this.still_.add(this.grid_);
    }
    this.draw();
  }

  /** Draws at once, without a ground: `shrink` pixels along a side are to become one of a picture `fineness` times as fine as the page. */
  take_picture(fineness: number): { canvas: HTMLCanvasElement; shrink: number } {
    const largest = Math.min(8192, this.renderer_.capabilities.maxTextureSize) / Math.max(this.element.clientWidth, this.element.clientHeight);
    const wanted = Math.min(fineness, largest);
    const shrink = Math.min(fineness > 2 ? 1.5 : 2, largest / wanted);
    this.picture((wanted * shrink) / this.screen_pixels(), true);
    this.draw(); // as it was
    return { canvas: this.canvas, shrink };
  }

  /** It draws no more, and its context is free. */
  dispose(): void {
    clearTimeout(this.rest_timer_);
    this.is_wanted_ = true;
    this.renderer_.dispose();
    this.renderer_.forceContextLoss();
  }

  private floor(box: Box3, up: Vector3, cell: number): Vector3 {
    const centre = box.getCenter(new Vector3());
    const low = box.min.dot(up) < box.max.dot(up) ? box.min : box.max;
    const place = centre.clone().divideScalar(cell).round().multiplyScalar(cell);
    return place.addScaledVector(up, low.dot(up) - place.dot(up));
  }

  /** Bounds of how finely is drawn: edges are smooth where more is drawn than is shown. */
  private set_bounds(width: number, height: number): void {
    const screen = this.screen_pixels();
    this.pace_.most = Math.min(Math.max(1, most_pixels / screen), Math.sqrt(most_drawn / (width * height)) / screen);
    this.pace_.may_be_blocky = width * height * window.devicePixelRatio ** 2 > many_pixels;
    this.pace_.slow = matchMedia('(pointer: coarse)').matches ? 31 : 40; // a finger is on what it moves
    this.pace_.least = Math.min(0.4, Math.sqrt(least_drawn / (width * height)) / screen);
  }

  /** Where a box is in the picture. */
  private around({ min, max }: Box3): Around {
    const { camera } = this.eye;
    const low = new Vector2(1, 1);
    const high = new Vector2(-1, -1);
    for (let k = 0; k < 8; ++k) {
      const corner = new Vector3(k & 1 ? max.x : min.x, k & 2 ? max.y : min.y, k & 4 ? max.z : min.z).applyMatrix4(camera.matrixWorldInverse);
      if (corner.z > -camera.near) return { left: 0, below: 0, width: 1, height: 1 }; // beside who looks
      corner.applyMatrix4(camera.projectionMatrix);
      low.min(new Vector2(corner.x, corner.y));
      high.max(new Vector2(corner.x, corner.y));
    }
    low.clampScalar(-1, 1);
    high.clampScalar(-1, 1);
    return { left: 0.5 + 0.5 * low.x, below: 0.5 + 0.5 * low.y, width: 0.5 * (high.x - low.x), height: 0.5 * (high.y - low.y) };
  }

  /** While it moves the canvas is cut down to where something is drawn: without a graphics card the browser puts together all of it, however little is there. */
  private cut_canvas(is_whole: boolean): void {
    const { width, height } = this.extent;
    const { left, below, width: wide, height: high } = this.around(this.seen_box);
    const outwards = (share: number, size: number) => Math.max(0, Math.floor((share * size - cut_margin) / cut_step) * cut_step);
    const sides = [outwards(1 - below - high, height), outwards(1 - left - wide, width), outwards(below, height), outwards(left, width)];
    this.canvas.classList.toggle('blocky', !is_whole && this.pace_.is_blocky);
    set_style(this.canvas, 'clip-path', is_whole || this.grid_ ? 'none' : `inset(${sides.map((side) => `${side}px`).join(' ')})`);
  }

  private screen_pixels(): number {
    return Math.min(most_pixels, window.devicePixelRatio);
  }

  private rest(): void {
    if (this.is_wanted_) return;
    const begun = performance.now();
    this.picture(Math.min(smooth, this.pace_.most) * this.pace_.rest_share, true);
    requestAnimationFrame(() => requestAnimationFrame((now) => this.pace_.note_rest(now - begun)));
  }

  private picture(share: number, is_fine: boolean): void {
    const { width, height } = this.extent;
    if (width === 0 || height === 0) return;
    const ratio = share * this.screen_pixels();
    const size = `${width} ${height} ${ratio}`;
    if (size !== this.size_) {
      this.size_ = size;
      this.renderer_.setPixelRatio(ratio);
      this.renderer_.setSize(width, height, false);
    }
    Object.assign(this.drawing, { pictures: this.drawing.pictures + 1, share, rests: is_fine });
    this.before_drawing();
    this.render(ratio, is_fine);
    this.cut_canvas(is_fine);
    this.after_drawing();
  }

  /** Whether this picture has the shade of one before: while nobody turns the view a press changes little of it from one to the next. */
  private keeps_shade(is_fine: boolean): boolean {
    const { projectionMatrix, matrixWorldInverse } = this.eye.camera;
    const seen = `${projectionMatrix.elements} ${matrixWorldInverse.elements}`;
    const is_kept = !is_fine && this.pace_.is_thrifty && seen === this.shade_seen_ && ++this.shade_age_ < shade_pictures;
    if (!is_kept) this.shade_age_ = 0;
    this.shade_seen_ = seen;
    return is_kept;
  }

  private render(ratio: number, is_fine: boolean): void {
    const { renderer_: renderer, canvas } = this;
    const { camera, radius, box } = this.eye;
    camera.updateMatrixWorld();
    const { picture_size, depth_range } = this.light.uniforms;
    picture_size.value.set(canvas.width, canvas.height);
    const middle = box.getCenter(new Vector3()).applyMatrix4(camera.matrixWorldInverse);
    depth_range.value.set(-middle.z - 1.5 * radius, 3 * radius);
    this.section_.prepare(ratio);
    if (this.eye.is_flat) this.light.without_shade();
    else {
      this.shade_.set_cut(this.section_.is_on);
      if (!this.keeps_shade(is_fine)) this.shade_.draw(renderer, this.scene, camera, [canvas.width, canvas.height], this.around(this.body_box), shade_reach * radius, is_fine, this.pace_.is_thrifty);
    }
    renderer.clear();
    renderer.render(this.scene, camera);
  }
}
