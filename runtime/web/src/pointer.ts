// The pointer as the hand: presses, pushes and grabs what is under it.
import type { Body } from './body';
import { follow_in_plane, is_inside, pick_boundary, pick_surface, thickness_below, type Hit, type Surface } from './pick';
import { minus, plus, pressed_position, ray_meets_plane, turn_onto, turned_depth, type ToolShape } from './pose';
import type { View } from './view';
import type { Point, Quaternion, Vec3 } from './words';

export const pointer_modes = ['press', 'push', 'grab'] as const;
export type PointerMode = (typeof pointer_modes)[number];

const least_wait = 8; // [ms] from one word to the next
const key_id = -1; // in the place of a pointer's
const reach_in_plane = 24; // pixels from the boundary that still touch it from outside

export interface HandSettings {
  mode: PointerMode;
  depth: number; // [m] where a press begins ...
  share_of_thickness: number; // ... and no more than this of how thick the body is there
  unit_depth: number; // [m] a wheel's notch is a tenth of it
  clearance: number; // [m] of a tool that hovers
  contact: number; // [m] of one that all but touches
  floor: number | null; // that the body lies on: the tool does not come from below
  shape: ToolShape;
}

interface Press {
  id: number; // of the pointer
  mode: PointerMode;
  start: Hit;
  now: Hit;
  orientation: Quaternion;
  surface: Surface; // as it was when the press began: the tool slides along it
  depth: number;
  deeper: number; // [m] in the plane: by a drag into the body
  pushed: number; // [m] of the wheel, into the picture
  client: { x: number; y: number };
  begun_at: number; // [ms] when it was said, and when ...
  down_at: number; // ... the pointer was let down
  is_over: boolean; // it was lifted, and the tool is still to follow
  plane_start: Vec3; // where the ray met the screen's plane at the start
  pinch: { id: number; x: number; y: number; distance: number; depth: number; pushed: number } | null;
}

export class Hand {
  private press_: Press | null = null;
  private hover_: { x: number; y: number } | null = null;
  private hovering_ = false;
  private word_: Point | null = null; // what is wanted and was not said
  private last_: Point | null = null;
  private last_at_ = -Infinity;
  private beats_ = false; // a beat is to come

  /**
   * `settings` gives null where the pointer is no hand now, or a sentence that says what keeps it from being one. `send` says a
   * word to the runtime (null: the pointer is no hand any more), `changed` tells of depth and press.
   */
  constructor(
    private readonly view_: View,
    private readonly body_: Body,
    private readonly settings_: () => HandSettings | string | null,
    private readonly send_: (word: Point | null) => void,
    private readonly changed_: (depth: number | null) => void,
    private readonly hint_: (text: string) => void,
  ) {
    const area = view_.element;
    const on = (name: string, take: (event: PointerEvent) => void) =>
      area.addEventListener(name, (event) => take(event as PointerEvent), { capture: true });
    on('pointerdown', (event) => this.down(event));
    on('pointermove', (event) => this.move(event));
    on('pointerup', (event) => this.up(event));
    on('pointercancel', (event) => this.up(event));
    on('pointerleave', () => (this.hover_ = null));
    area.addEventListener('wheel', (event) => this.wheel(event), { capture: true, passive: false });
    area.addEventListener('contextmenu', (event) => event.preventDefault());
    window.addEventListener('blur', () => this.release());
  }

  /** Says what is wanted soon, and not with the next picture, which may be slow. */
  private want_beat(): void {
    if (this.beats_) return;
    this.beats_ = true;
    setTimeout(() => {
      if (!this.press_) this.follow_hover();
      this.say();
      this.beats_ = false;
    }, Math.max(0, this.last_at_ + least_wait - performance.now()));
  }

  get is_pressed(): boolean {
    return this.press_ !== null;
  }
  /** Whether it has been at the body. */
  get has_moved(): boolean {
    return this.last_ !== null;
  }

  /** Lets go, as when the pointer is lifted. */
  release(): void {
    const press = this.press_;
    if (!press) return;
    this.press_ = null;
    this.changed_(null);
    this.view_.pad.style.cursor = '';
    const settings = this.settings_();
    if (settings && typeof settings !== 'string') this.want_hover(settings, press.now, press.orientation, settings.clearance);
    else this.send_((this.word_ = null));
  }

  /** The pointer was lifted: the tool is pressed for as long as it was down, also where the page came late to both. */
  private let_go(press: Press, lifted_at: number): void {
    press.is_over = true;
    const left = press.begun_at + Math.max(lifted_at - press.down_at, least_wait) - performance.now();
    if (left <= 0) this.release();
    else setTimeout(() => this.press_ === press && this.release(), left);
  }

  private down(event: PointerEvent): void {
    if (event.target !== this.view_.pad) return;
    if (this.press_?.is_over) this.release();
    if (this.press_) {
      this.begin_pinch(event);
      event.stopPropagation();
      return;
    }
    if (event.button !== 0 || !event.isPrimary) return;
    if (!this.begin(event.clientX, event.clientY, event.pointerId, event.timeStamp)) return;
    event.stopPropagation();
    event.preventDefault();
    this.view_.pad.setPointerCapture(event.pointerId);
    this.view_.pad.style.cursor = 'grabbing';
    this.view_.pad.focus({ preventScroll: true });
  }

  /** Presses what is there in the window; gives whether that is a body that may be touched. */
  private begin(x: number, y: number, id: number, down_at: number): boolean {
    const settings = this.settings_();
    if (settings === null) return false;
    const hit = this.hit(x, y);
    if (!hit) return false;
    if (typeof settings === 'string') {
      this.hint_(settings);
      return false;
    }
    this.press_ = {
      id,
      mode: settings.mode,
      start: hit,
      now: hit,
      orientation: turn_onto(hit.normal, this.dimension()),
      surface: this.body_.snapshot(),
      depth: Math.min(settings.depth, settings.share_of_thickness * this.thickness(hit)),
      deeper: 0,
      pushed: 0,
      client: { x, y },
      begun_at: performance.now(),
      down_at,
      is_over: false,
      plane_start: this.on_screen_plane(x, y, hit.point) ?? hit.point,
      pinch: null,
    };
    // The tool comes to where it touches, not through the body: a finger has not hovered, and a grab holds on from there.
    this.want_hover(settings, hit, this.press_.orientation, settings.mode === 'grab' ? settings.contact : settings.clearance);
    this.say();
    this.want_press(settings);
    this.say(); // it may be lifted before the page comes to say more
    return true;
  }

  // --- by keys: a place in the window that arrows move ---

  private key_place_: { x: number; y: number } | null = null;

  /** Moves the tool along the screen by so many pixels. */
  key_move(right: number, down: number): void {
    const at = (this.key_place_ ??= this.on_body(this.middle()));
    at.x += right;
    at.y += down;
    if (this.press_?.id === key_id) this.slide(at.x, at.y);
    else if (!this.press_) this.want_hover_at({ ...at });
  }

  /** Presses where the tool is, or lets go. */
  key_press(): void {
    if (this.press_) {
      this.release();
      return;
    }
    const at = (this.key_place_ = this.on_body(this.key_place_ ?? this.middle()));
    this.begin(at.x, at.y, key_id, performance.now());
  }

  /** Lets go of what keys press. */
  release_key(): void {
    if (this.press_?.id === key_id) this.release();
  }

  /** As the wheel does, by so many notches. */
  key_deepen(notches: number): void {
    this.deepen(-100 * notches);
  }

  private middle(): { x: number; y: number } {
    const { position } = this.body_.surface;
    const sum: Vec3 = [0, 0, 0];
    for (let i = 0; i < position.length; ++i) sum[i % 3]! += (3 * position[i]!) / position.length;
    return this.view_.eye.project(...sum);
  }

  /** The same place, or where the body is none the one nearest to it in the window that shows some of it. */
  private on_body(place: { x: number; y: number }): { x: number; y: number } {
    if (this.hit(place.x, place.y)) return place;
    const { position, triangle } = this.body_.surface;
    const corners = triangle.length > 0 ? triangle : this.body_.boundary;
    const several = triangle.length > 0 ? 3 : 2;
    const middle = (first: number) => {
      const at: Vec3 = [0, 0, 0];
      for (let k = 0; k < 3 * several; ++k) at[k % 3]! += position[3 * corners[first + Math.floor(k / 3)]! + (k % 3)]! / several;
      return this.view_.eye.project(...at);
    };
    let nearest = Infinity;
    let found = place;
    for (let first = 0; first < corners.length; first += several) {
      const at = middle(first);
      const away = Math.hypot(at.x - place.x, at.y - place.y);
      if (away >= nearest || !this.hit(at.x, at.y)) continue;
      nearest = away;
      found = at;
    }
    return found;
  }

  private move(event: PointerEvent): void {
    const press = this.press_;
    if (!press) {
      if (event.pointerType === 'touch' || event.buttons !== 0) this.hover_ = null;
      else this.want_hover_at(event.target === this.view_.pad ? { x: event.clientX, y: event.clientY } : null);
      return;
    }
    event.stopPropagation();
    if (press.is_over) return;
    const settings = this.settings_();
    if (!settings || typeof settings === 'string') {
      this.release();
      return;
    }
    if (press.pinch?.id === event.pointerId) {
      this.pinch(event, settings);
    } else if (press.id === event.pointerId) {
      this.slide(event.clientX, event.clientY);
    }
    this.want_press(settings);
  }

  private slide(x: number, y: number): void {
    const press = this.press_!;
    const settings = this.settings_();
    press.client = { x, y };
    if (press.mode === 'press' && this.dimension() === 2) this.slide_in_plane(press);
    else if (press.mode === 'press') press.now = this.hit(x, y, press.surface) ?? press.now;
    if (settings && typeof settings !== 'string') this.want_press(settings);
  }

  private slide_in_plane(press: Press): void {
    const to = this.on_screen_plane(press.client.x, press.client.y, press.start.point);
    if (!to) return;
    const place = plus(press.start.point, minus(to, press.plane_start));
    const nearest = pick_boundary(press.surface.position, this.body_.boundary, place, Infinity, this.has_room());
    if (nearest) ({ hit: press.now, deeper: press.deeper } = follow_in_plane(press.now, nearest, place));
  }

  private up(event: PointerEvent): void {
    const press = this.press_;
    if (!press) return;
    if (press.pinch?.id === event.pointerId) press.pinch = null;
    else if (press.id === event.pointerId) this.let_go(press, event.timeStamp);
    else return;
    event.stopPropagation();
  }

  private wheel(event: WheelEvent): void {
    if (!this.press_) return;
    event.preventDefault();
    event.stopPropagation();
    this.deepen(event.deltaMode === WheelEvent.DOM_DELTA_PIXEL ? event.deltaY : 33 * event.deltaY);
  }

  private deepen(pixels: number): void {
    const press = this.press_;
    const settings = this.settings_();
    if (!press || !settings || typeof settings === 'string') return;
    if (press.mode === 'press') press.depth = turned_depth(press.depth, pixels, settings.unit_depth);
    else press.pushed -= (pixels / 100) * 0.1 * settings.unit_depth;
    this.want_press(settings);
  }

  private begin_pinch(event: PointerEvent): void {
    const press = this.press_!;
    if (press.pinch) return;
    const distance = Math.hypot(event.clientX - press.client.x, event.clientY - press.client.y);
    press.pinch = { id: event.pointerId, x: event.clientX, y: event.clientY, distance, depth: press.depth, pushed: press.pushed };
  }

  private pinch(event: PointerEvent, settings: HandSettings): void {
    const press = this.press_!;
    const pinch = press.pinch!;
    const closer = pinch.distance - Math.hypot(event.clientX - press.client.x, event.clientY - press.client.y);
    press.depth = turned_depth(pinch.depth, -5 * closer, settings.unit_depth);
    press.pushed = pinch.pushed + (closer / 20) * 0.1 * settings.unit_depth;
  }

  private dimension(): 2 | 3 {
    return this.body_.scene?.dimension ?? 3;
  }

  /** Whether a tool that touches a point of the boundary is above the floor. */
  private has_room(): (hit: Hit) => boolean {
    const settings = this.settings_();
    if (!settings || typeof settings === 'string' || settings.floor === null) return () => true;
    const { floor, shape } = settings;
    return ({ point, normal }) => point[1] + shape.radius * normal[1] > floor + shape.radius;
  }

  /** Of the body: in space what the pixel shows, in the plane the point of the boundary where one gets to it from outside. */
  private hit(x: number, y: number, surface: Surface = this.body_.surface): Hit | null {
    if (this.dimension() === 2) {
      const place = this.view_.eye.place_in_plane(x, y);
      const { position } = surface;
      const reach = is_inside(position, this.body_.boundary, place) ? Infinity : reach_in_plane * this.view_.eye.metres_of_pixel();
      return pick_boundary(position, this.body_.boundary, place, reach, this.has_room());
    }
    const { origin, direction } = this.view_.eye.ray(x, y);
    return pick_surface(surface, origin, direction);
  }

  /** How thick the body is below a point of its surface [m]. In the plane it is not asked. */
  private thickness(hit: Hit): number {
    return this.dimension() === 2 ? Infinity : thickness_below(this.body_.surface, hit);
  }

  private on_screen_plane(x: number, y: number, through: Vec3): Vec3 | null {
    if (this.dimension() === 2) return this.view_.eye.place_in_plane(x, y);
    const { origin, direction } = this.view_.eye.ray(x, y);
    return ray_meets_plane(origin, direction, through, this.view_.eye.looking());
  }

  private want_press(settings: HandSettings): void {
    const press = this.press_!;
    const { radius } = settings.shape;
    let position: Vec3;
    if (press.mode === 'press') {
      position = pressed_position(press.now.point, press.now.normal, radius, press.depth + press.deeper);
      this.changed_(press.depth + press.deeper);
    } else {
      const now = this.on_screen_plane(press.client.x, press.client.y, press.start.point) ?? press.plane_start;
      const away: Vec3 = this.dimension() === 2 ? [0, 0, 0] : this.view_.eye.looking();
      const way = plus(minus(now, press.plane_start), away, press.pushed);
      const from = pressed_position(press.start.point, press.start.normal, radius, press.mode === 'push' ? press.depth : 0);
      position = plus(from, way);
      press.now = { point: plus(press.start.point, way), normal: press.start.normal };
    }
    this.word_ = { type: 'point', position, orientation: press.orientation, grab: press.mode === 'grab', lifted: false };
    this.want_beat();
  }

  private want_hover(settings: HandSettings, hit: Hit, orientation: Quaternion, clearance: number): void {
    const position = pressed_position(hit.point, hit.normal, settings.shape.radius, -clearance);
    this.word_ = { type: 'point', position, orientation, grab: false, lifted: true };
    this.want_beat();
  }

  private want_hover_at(at: { x: number; y: number } | null): void {
    this.hover_ = at;
    if (at) this.want_beat();
  }

  private follow_hover(): void {
    const at = this.hover_;
    if (!at) return;
    this.hover_ = null;
    const settings = this.settings_();
    const hit = settings === null ? null : this.hit(at.x, at.y);
    this.hovering_ = hit !== null;
    this.view_.pad.style.cursor = this.hovering_ ? 'pointer' : '';
    if (hit && settings && typeof settings !== 'string') this.want_hover(settings, hit, turn_onto(hit.normal, this.dimension()), settings.clearance);
  }

  private say(): void {
    if (!this.word_) return;
    this.send_(this.word_);
    this.last_ = this.word_;
    this.last_at_ = performance.now();
    this.word_ = null;
  }
}
