// The binary messages of the runtime (PROTOCOL.md) as typed arrays. Arrays are views of the message, not copies, except for the numbers at a
// picture's nodes: those are NodeValues', which the next picture changes.
import { NodeValues } from './values';

/** What is drawn of a body: nodes without loads [m], triangles outward, edges of the elements. */
export interface Scene {
  kind: 'scene';
  number: number;
  dimension: 2 | 3;
  position: Float32Array; // [3 S]
  triangle: Uint32Array; // [3 T]
  edge: Uint32Array; // [2 E]
  held: Uint8Array; // [S] bit `axis` is set where a node is held along it
  material: Uint8Array; // [T] of each triangle's element; empty where there is one only, or none is known
  inner: Inner;
}

/** Where materials meet within the body. */
export interface Inner {
  position: Float32Array; // [3 I]
  triangle: Uint32Array; // [3 J] outward of `inside`
  inside: Uint8Array; // [J] material on the one side
  outside: Uint8Array; // [J] and on the other
}

/** The overlay's finer surface in place of the scene's `hidden` triangles. */
export interface Patch {
  kind: 'patch';
  scene: number;
  number: number; // 0: none
  hidden: Uint32Array; // [H]
  position: Float32Array; // [3 m]
  triangle: Uint32Array; // [3 t]
  outline: Uint32Array; // [2 o]
  material: Uint8Array; // [t] as a scene's
}

/** Floats a contact: position, outward normal, force on the body, 1 where it is held. */
export const floats_of_contact = 10;
/** In the place of a von Mises stress that is not known; those that are begin at 1. */
export const unknown_stress = 0;

/** What is seen at one moment: forces on the body [N], displacements times `unit_u` [m], stresses - 1 times `unit_stress` [Pa]. */
export interface Frame {
  kind: 'frame';
  scene: number;
  tick: number;
  time: number; // [s]
  tool: Float32Array; // [7] position, quaternion x y z w
  device: Float32Array; // [7]
  force: Float32Array; // [3]
  torque: Float32Array; // [3]
  number: number; // from 1 on
  base: number; // of the picture from which it follows; 0: from none
  unit_u: number;
  unit_stress: number;
  version: number; // equal where no displacement is another
  status: number;
  patch: number;
  force_error: number; // how far `force` may be off, where it is a best effort [N]
  left_out: number; // contact points that found no room
  greens_error: number; // what compressed Green's functions may move `force` by, at most [N]
  contact: Float32Array; // [10 c]
  pressure_node: Uint32Array; // [q]
  pressure: Float32Array; // [q] [Pa]
  u: Int16Array; // [3 S]
  stress: Uint16Array; // [S]
  patch_u: Int16Array; // [3 m]
  patch_stress: Uint16Array; // [m]
}

/** Samples of the loop, `stride` ticks apart: all of them when live. */
export interface Ticks {
  kind: 'ticks';
  scene: number;
  first: number;
  count: number;
  stride: number;
  force: Float32Array; // [3 n] on the body [N]
  shown: Float32Array; // [n] [N]
  depth: Float32Array; // [n] [m]
  late_us: Float32Array; // [n]
  compute_us: Float32Array; // [n]
  status: Uint32Array; // [n]
  force_error: Float32Array; // [n] as in a frame [N]
  left_out: Uint32Array; // [n]
  contacts: Uint8Array; // [n] 255: or more
}

export type Picture = Scene | Patch | Frame | Ticks;

/** Reads numbers and arrays one after the other; each array begins at a multiple of 4 bytes. */
class Reader {
  private at_ = 0;
  private readonly view_: DataView;

  constructor(private readonly buffer_: ArrayBuffer) {
    this.view_ = new DataView(buffer_);
  }

  u32(): number {
    return this.view_.getUint32(this.advance(4), true);
  }
  i32(): number {
    return this.view_.getInt32(this.advance(4), true);
  }
  f32(): number {
    return this.view_.getFloat32(this.advance(4), true);
  }
  f64(): number {
    return this.view_.getFloat64(this.advance(8), true);
  }
  u8s(count: number): Uint8Array {
    return new Uint8Array(this.buffer_, this.advance(count), count);
  }
  u32s(count: number): Uint32Array {
    return new Uint32Array(this.buffer_, this.advance(4 * count), count);
  }
  f32s(count: number): Float32Array {
    return new Float32Array(this.buffer_, this.advance(4 * count), count);
  }
  rest(): Uint8Array {
    return new Uint8Array(this.buffer_, this.at_);
  }
  get at_end(): boolean {
    return this.at_ >= this.buffer_.byteLength;
  }

  private advance(bytes: number): number {
    const at = this.at_;
    if (at + bytes > this.buffer_.byteLength) {
      throw new RangeError(`a message of ${this.buffer_.byteLength} bytes ends before byte ${at + bytes}`);
    }
    this.at_ = (at + bytes + 3) & ~3;
    return at;
  }
}

function check_indices(indices: Uint32Array, count: number, what: string): void {
  for (const index of indices) {
    if (index >= count) throw new RangeError(`${what} ${index} is not below ${count}`);
  }
}

const one_material = (): Pick<Scene, 'material' | 'inner'> => ({
  material: new Uint8Array(0),
  inner: { position: new Float32Array(0), triangle: new Uint32Array(0), inside: new Uint8Array(0), outside: new Uint8Array(0) },
});

/** What follows a scene of several materials. */
function decode_materials(reader: Reader, triangles: number): Pick<Scene, 'material' | 'inner'> {
  if (reader.at_end) return one_material();
  const nodes = reader.u32();
  const facets = reader.u32();
  const position = reader.f32s(3 * nodes);
  const triangle = reader.u32s(3 * facets);
  check_indices(triangle, nodes, "the inner surface's node");
  const material = reader.u8s(triangles);
  return { material, inner: { position, triangle, inside: reader.u8s(facets), outside: reader.u8s(facets) } };
}

function decode_scene(reader: Reader, number: number): Scene {
  const dimension = reader.u32();
  if (dimension !== 2 && dimension !== 3) throw new RangeError(`a scene of dimension ${dimension}`);
  const nodes = reader.u32();
  const triangles = reader.u32();
  const edges = reader.u32();
  const outer = {
    kind: 'scene' as const,
    number,
    dimension: dimension as 2 | 3,
    position: reader.f32s(3 * nodes),
    triangle: reader.u32s(3 * triangles),
    edge: reader.u32s(2 * edges),
    held: reader.u8s(nodes),
  };
  const scene: Scene = { ...outer, ...decode_materials(reader, triangles) };
  check_indices(scene.triangle, nodes, 'node');
  check_indices(scene.edge, nodes, 'node');
  return scene;
}

function decode_patch(reader: Reader, scene: number): Patch {
  const number = reader.u32();
  const hidden = reader.u32();
  const nodes = reader.u32();
  const triangles = reader.u32();
  const outline = reader.u32();
  const patch: Patch = {
    kind: 'patch',
    scene,
    number,
    hidden: reader.u32s(hidden),
    position: reader.f32s(3 * nodes),
    triangle: reader.u32s(3 * triangles),
    outline: reader.u32s(2 * outline),
    material: reader.at_end ? new Uint8Array(0) : reader.u8s(triangles),
  };
  check_indices(patch.triangle, nodes, "the patch's node");
  check_indices(patch.outline, nodes, "the patch's node");
  return patch;
}

function decode_frame(reader: Reader, scene: number, nodes: number, values: NodeValues | null): Frame {
  const tick = reader.f64();
  const time = reader.f64();
  const number = reader.u32();
  const base = reader.u32();
  const exponent_u = reader.i32();
  const exponent_stress = reader.i32();
  const tool = reader.f32s(7);
  const device = reader.f32s(7);
  const force = reader.f32s(3);
  const torque = reader.f32s(3);
  const status = reader.u32();
  const contacts = reader.u32();
  const patch = reader.u32();
  const patch_nodes = reader.u32();
  const pressures = reader.u32();
  const force_error = reader.f32();
  const left_out = reader.u32();
  const greens_error = reader.f32();
  const contact = reader.f32s(floats_of_contact * contacts);
  const pressure_node = reader.u32s(pressures);
  const pressure = reader.f32s(pressures);
  const shown = values ?? new NodeValues();
  values?.take({ number, base, exponent_u, exponent_stress, nodes, patch, patch_nodes }, reader.rest());
  const { u, stress, patch_u, patch_stress, version } = shown;
  return {
    kind: 'frame',
    scene,
    tick,
    time,
    tool,
    device,
    force,
    torque,
    number,
    base,
    unit_u: 2 ** exponent_u,
    unit_stress: 2 ** exponent_stress,
    version,
    status,
    patch,
    force_error,
    left_out,
    greens_error,
    contact,
    pressure_node,
    pressure,
    u,
    stress,
    patch_u,
    patch_stress,
  };
}

function decode_ticks(reader: Reader, scene: number): Ticks {
  const first = reader.f64();
  const count = reader.u32();
  const stride = reader.u32();
  return {
    kind: 'ticks',
    scene,
    first,
    count,
    stride,
    force: reader.f32s(3 * count),
    shown: reader.f32s(count),
    depth: reader.f32s(count),
    late_us: reader.f32s(count),
    compute_us: reader.f32s(count),
    status: reader.u32s(count),
    force_error: reader.f32s(count),
    left_out: reader.u32s(count),
    contacts: reader.u8s(count),
  };
}

/**
 * A binary message. `scene` is the last one announced: a frame's lengths follow from it. `values` are those of the frame before, which
 * become this one's; without them a frame has no numbers at nodes. Gives null for messages of another scene; throws RangeError where
 * the message is not what PROTOCOL.md says.
 */
export function decode(message: ArrayBuffer, scene: Scene | null, values: NodeValues | null = null): Picture | null {
  const reader = new Reader(message);
  const kind = reader.u32();
  const number = reader.u32();
  if (kind === 1) return decode_scene(reader, number);
  if (number !== scene?.number) return null;
  if (kind === 2) return decode_patch(reader, number);
  if (kind === 3) return decode_frame(reader, number, scene.held.length, values);
  if (kind === 4) return decode_ticks(reader, number);
  throw new RangeError(`a message of unknown kind ${kind}`);
}

/** One message of a page that `export --html` wrote. */
export type StoredMessage = string | ArrayBuffer;

/**
 * The messages one after the other: u32 length, u8 kind (0 text, 1 binary), 3 bytes of padding, then the message. Throws
 * RangeError where one ends early or its kind is unknown.
 */
export function split_messages(stored: Uint8Array): StoredMessage[] {
  const view = new DataView(stored.buffer, stored.byteOffset, stored.byteLength);
  const text = new TextDecoder();
  const messages: StoredMessage[] = [];
  for (let at = 0; at < stored.length; ) {
    if (at + 8 > stored.length) throw new RangeError('a stored message ends early');
    const length = view.getUint32(at, true);
    const kind = view.getUint8(at + 4);
    const body = stored.slice(at + 8, at + 8 + length);
    if (body.length < length) throw new RangeError('a stored message ends early');
    if (kind > 1) throw new RangeError(`a stored message of unknown kind ${kind}`);
    messages.push(kind === 0 ? text.decode(body) : (body.buffer as ArrayBuffer));
    at += 8 + length;
  }
  return messages;
}
