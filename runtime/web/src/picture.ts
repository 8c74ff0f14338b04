// The body, the tool and the forces in one picture, drawn as the person wants it.
import type { Vector3 } from 'three';
import { Arrows } from './arrows';
import { Body, type Colouring } from './body';
import { ColourBar } from './colour_bar';
import { field_traits, log_span, Range, type Field } from './colours';
import { part, rem } from './dom';
import { Marks } from './marks';
import { Section, type Filling, type SectionAxis } from './section';
import { parse_tool } from './pose';
import { ToolView } from './tool';
import { View } from './view';
import { Walls } from './walls';
import type { Drawn } from './view_controls';
import type { Frame, Patch, Scene } from './wire';
import type { Model } from './words';

const kept_patches = 4;
const bar_wait = 100; // [ms] between numbers of the colour bar while things move
const still = 1e-5; // of the body's size: what moves less is not drawn anew

/** Whether two frames look the same, for a body of this size. */
export function looks_same(a: Frame, b: Frame, size: number): boolean {
  if (a.version !== b.version || a.patch !== b.patch || a.contact.length !== b.contact.length || a.number === b.number) return false;
  const apart = Math.hypot(...[0, 1, 2].map((k) => a.tool[k]! - b.tool[k]!), ...[0, 1, 2].map((k) => a.device[k]! - b.device[k]!));
  const turned = Math.hypot(...[3, 4, 5, 6].map((k) => a.tool[k]! - b.tool[k]!));
  const force = Math.hypot(...a.force);
  const pushed = Math.hypot(...[0, 1, 2].map((k) => a.force[k]! - b.force[k]!));
  return apart < still * size && turned < 1e-3 && pushed <= 2e-3 * force;
}

/** Displacements within follow those of the surface nearby; stress and pressure are known on the surface alone. */
const filling_of = (field: Field): Filling => (!field_traits[field].has_range ? 'material' : field_traits[field].unit === 'm' ? 'number' : 'unknown');

export class Picture {
  private readonly section_: Section = new Section(() => this.body.colours);
  readonly view = new View(part('stage'), this.section_);
  readonly body = new Body(this.view.light, this.section_.cut, this.section_.planes);
  readonly marks: Marks;
  readonly bar = new ColourBar();
  /** Whether the tool is drawn: a pointer's is not until it has been at the body. */
  has_tool = true;

  private readonly tool_ = new ToolView(this.view.light);
  private readonly arrows_ = new Arrows();
  private readonly walls_ = new Walls();
  private readonly range_ = new Range();
  private readonly patches_ = new Map<number, Patch>();
  private latest_: Frame | null = null; // not drawn yet
  private shown_: Frame | null = null;
  private model_: Model | null = null;
  private shape_ = ''; // of the tool that is drawn, with the body that it is drawn for
  private drawn_: Drawn | null = null;
  private regions_wanted_ = true;

  constructor() {
    this.marks = new Marks(this.view.eye);
    this.body.shows = (place) => this.section_.shows(place);
    this.view.scene.add(this.body.group, this.section_.group, this.tool_.group, this.arrows_.group, this.walls_.group);
    this.view.before_drawing = () => this.prepare();
    this.view.after_drawing = () => {
      const { force, pixels } = this.arrows_.legend;
      this.marks.show(this.arrows_.group.visible ? { force, pixels: pixels * this.arrow_unit } : { force: 0, pixels: 0 });
    };
    this.body.rebuilt = () => {
      this.regions_wanted_ = true;
    };
  }

  /** What came last: what looks as it did before is not drawn. */
  get frame(): Frame | null {
    return this.latest_ ?? this.body.frame;
  }

  take_scene(scene: Scene): void {
    this.patches_.clear();
    this.latest_ = this.shown_ = null;
    this.range_.forget();
    this.arrows_.forget();
    this.body.take_scene(scene);
    this.view.take_body(scene);
    const { min, max } = this.view.eye.box;
    this.section_.set_box(min.toArray(), max.toArray());
    if (this.drawn_) this.take(this.drawn_);
    this.view.draw();
  }

  take_patch(patch: Patch): void {
    if (patch.number !== 0) this.patches_.set(patch.number, patch);
    while (this.patches_.size > kept_patches) this.patches_.delete(this.patches_.keys().next().value!);
  }

  /** Only what looks another way than the picture before is drawn; gives whether it is. */
  take_frame(frame: Frame): boolean {
    this.latest_ = frame;
    const size = this.model_?.size ?? 2 * this.view.eye.radius;
    if (this.shown_ && looks_same(this.shown_, frame, size)) return false;
    this.view.draw();
    return true;
  }

  /** The model as the state tells it, with its settings. */
  take_model(model: Model, settings: Record<string, string>): void {
    this.model_ = model;
    this.take_walls(settings);
    const { tool } = settings;
    const shape = `${tool} ${model.size} ${model.dimension}`;
    if (shape === this.shape_) return;
    this.shape_ = shape;
    this.tool_.take_shape(parse_tool(tool), model.size, model.dimension);
    this.body.tool_size = this.tool_.radius;
    this.view.draw();
  }

  /** What the body falls on is in view with it. */
  private take_walls(settings: Record<string, string>): void {
    const { eye } = this.view;
    if (!this.walls_.take(settings, eye.box, eye.is_flat)) return;
    eye.set_floor(this.walls_.floor);
    this.view.draw();
  }

  /** How high the floor is that the body may fall on; null: there is none. */
  get floor(): number | null {
    return this.walls_.floor;
  }

  /** How it is drawn from now on. */
  take(drawn: Drawn): void {
    const { body, view } = this;
    if (body.field !== drawn.field) this.range_.forget();
    this.drawn_ = drawn;
    body.field = drawn.field;
    body.scale = drawn.scale;
    body.show_edges(drawn.edges || body.scene?.dimension === 2);
    body.show_outline(drawn.outline);
    body.show_held(drawn.held);
    const axis: SectionAxis = body.scene?.dimension === 2 ? 'off' : drawn.section;
    body.is_cut = axis !== 'off';
    body.show_through(drawn.through);
    const was = this.section_.axis;
    this.section_.set(axis, drawn.section_at, drawn.section_flip);
    if (axis !== was) this.face_section();
    view.show_grid(drawn.grid, 0x7a8798);
    view.eye.set_upright(drawn.up);
    view.eye.set_parallel(drawn.parallel);
    body.update();
    view.draw();
  }

  /** Cuts off the half that is towards the camera. */
  face_section(): void {
    this.section_.face(this.view.eye.place.towards);
    this.view.draw();
  }

  set_ink(ink: string, is_light: boolean): void {
    this.body.ink = parseInt(ink.slice(1), 16);
    this.walls_.set_ink(ink);
    this.view.light.uniforms.is_light.value = is_light ? 1 : 0;
    this.view.draw();
  }

  /** Brings everything up to the frame that came last. */
  prepare(): void {
    const drawn = this.drawn_;
    if (!drawn) return;
    if (this.latest_) {
      this.shown_ = { ...this.latest_, tool: this.latest_.tool.slice(), device: this.latest_.device.slice() };
      this.body.take_frame(this.latest_, this.patches_.get(this.latest_.patch) ?? null);
      this.latest_ = null;
    }
    if (this.regions_wanted_ && this.section_.is_on) {
      this.regions_wanted_ = false;
      this.section_.set_regions(this.body.regions());
    }
    this.body.show_edges(drawn.edges || this.body.scene?.dimension === 2);
    this.place_tool(drawn);
    this.body.prepare(this.view.canvas.width / Math.max(1, this.view.extent.width), this.view.light.tool, this.view.is_rough);
    this.view.body_box = this.body.box;
    this.view.seen_box.copy(this.body.box);
    if (this.tool_.group.visible) this.tool_.add_to(this.view.seen_box);
    if (this.arrows_.group.visible) this.view.seen_box.union(this.arrows_.box);
    if (this.walls_.group.visible) this.view.seen_box.union(this.walls_.box);
    this.colour(drawn);
  }

  /** Pixels of the page for one of an arrow: more on large screens, fewer on phones. */
  private get arrow_unit(): number {
    const { width, height } = this.view.extent;
    return rem() * Math.min(1, Math.max(0.5, Math.min(width, height) / (560 * rem())));
  }

  private place_tool(drawn: Drawn): void {
    const frame = this.body.frame;
    const { eye } = this.view;
    eye.camera.updateMatrixWorld();
    const is_seen = frame !== null && drawn.scale === 1; // beside a body that is drawn larger they would be in the wrong place
    if (frame) {
      this.tool_.show(frame.tool, frame.device);
      const unit = this.arrow_unit;
      this.arrows_.show(frame, this.tool_.radius, (place) => unit * eye.pixel_at(place), (from, way, pixels) => eye.room(from, way, unit * pixels) / unit);
    }
    this.tool_.group.visible = is_seen && drawn.tool && this.has_tool && frame.tool.every(Number.isFinite);
    this.arrows_.group.visible = is_seen && drawn.arrows;
    this.tool_.set_clear(field_traits[drawn.field].has_range);
    this.tool_.cast(eye.camera);
  }

  private colour(drawn: Drawn): void {
    const { shown } = this.body;
    const is_log = drawn.log && !field_traits[drawn.field].is_signed;
    this.own_range = this.range_.follow(is_log || drawn.largest ? shown.largest : shown.usual, performance.now() / 1000);
    const automatic = Math.max(this.own_range, this.range_beside.field === drawn.field ? this.range_beside.largest : 0);
    const high = drawn.range ?? automatic;
    const low = field_traits[drawn.field].is_signed ? -high : is_log ? high / log_span : 0;
    const colouring: Colouring = { map: drawn.map, is_log, isolines: drawn.isolines ? 12 : 0 };
    this.body.show_range(low, high, colouring);
    if (this.section_.is_on) this.section_.fill(filling_of(drawn.field), (places) => this.body.numbers_within(places));
    this.automatic_range = automatic;
    const now = performance.now();
    this.bar_is_new = this.view.drawing.rests || drawn.field !== this.bar_field_ || now - this.bar_at_ > bar_wait;
    if (!this.bar_is_new) return;
    this.bar_at_ = now;
    this.bar_field_ = drawn.field;
    const is_surface = this.section_.is_on && filling_of(drawn.field) === 'unknown';
    this.bar.show(drawn.field, low, high, shown.largest, colouring, this.model_?.materials ?? [], is_surface ? 'surface: ' : '');
  }
  /** The bar is of this picture: numbers that change with each cannot be read, and each costs the page a layout. */
  bar_is_new = true;
  private bar_at_ = -Infinity; // [ms]
  private bar_field_: Field | null = null;
  /** The largest number of the range as it comes by itself. */
  automatic_range = 0;
  /** The same without what is shown beside. */
  own_range = 0;
  /** The force of the longest arrow, without what is shown beside [N]; and of what is, whose arrows are as long for a force. */
  get own_force(): number {
    return this.arrows_.own;
  }
  /** The whole force's arrow, where it is drawn. */
  get arrow(): [Vector3, Vector3] | null {
    return this.arrows_.group.visible ? this.arrows_.whole : null;
  }
  set force_beside(force: number) {
    this.arrows_.beside = force;
  }
  /** Of what is shown beside, which has the same colours. */
  range_beside: { field: Field | null; largest: number } = { field: null, largest: 0 };
}
