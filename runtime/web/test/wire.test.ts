// Messages are written here by hand, byte by byte, after PROTOCOL.md.
import assert from 'node:assert/strict';
import { test } from 'node:test';
import { decode, split_messages, type Scene } from '../src/wire';

/** Writes little endian, padded to 4 bytes before each array. */
class Writer {
  private bytes_: number[] = [];

  u32(...values: number[]): this {
    return this.put(values, 4, (view, value) => view.setUint32(0, value, true));
  }
  f32(...values: number[]): this {
    return this.put(values, 4, (view, value) => view.setFloat32(0, value, true));
  }
  f64(...values: number[]): this {
    return this.put(values, 8, (view, value) => view.setFloat64(0, value, true));
  }
  i16(...values: number[]): this {
    return this.pad().put(values, 2, (view, value) => view.setInt16(0, value, true));
  }
  u16(...values: number[]): this {
    return this.pad().put(values, 2, (view, value) => view.setUint16(0, value, true));
  }
  u8(...values: number[]): this {
    return this.pad().put(values, 1, (view, value) => view.setUint8(0, value));
  }
  pad(): this {
    while (this.bytes_.length % 4 !== 0) this.bytes_.push(0);
    return this;
  }
  done(): ArrayBuffer {
    return Uint8Array.from(this.bytes_).buffer;
  }

  private put(values: number[], size: number, write: (view: DataView, value: number) => void): this {
    for (const value of values) {
      const buffer = new ArrayBuffer(size);
      write(new DataView(buffer), value);
      this.bytes_.push(...new Uint8Array(buffer));
    }
    return this;
  }
}

const three_nodes = (): Writer => new Writer().u32(1, 7, 3, 3, 1, 3).f32(0, 0, 0, 1, 0, 0, 0, 1, 0).u32(0, 1, 2).u32(0, 1, 1, 2, 2, 0).u8(7, 0, 4);
const scene = decode(three_nodes().done(), null) as Scene;

test('a scene', () => {
  assert.equal(scene.kind, 'scene');
  assert.equal(scene.number, 7);
  assert.equal(scene.dimension, 3);
  assert.deepEqual([...scene.position], [0, 0, 0, 1, 0, 0, 0, 1, 0]);
  assert.deepEqual([...scene.triangle], [0, 1, 2]);
  assert.deepEqual([...scene.edge], [0, 1, 1, 2, 2, 0]);
  assert.deepEqual([...scene.held], [7, 0, 4]);
});

test('a patch', () => {
  const message = new Writer().u32(2, 7, 4, 1, 2, 1, 1).u32(0).f32(1, 2, 3, 4, 5, 6).u32(0, 1, 1).u32(1, 0).done();
  const patch = decode(message, scene);
  assert.ok(patch?.kind === 'patch');
  assert.equal(patch.number, 4);
  assert.deepEqual([...patch.hidden], [0]);
  assert.deepEqual([...patch.position], [1, 2, 3, 4, 5, 6]);
  assert.deepEqual([...patch.triangle], [0, 1, 1]);
  assert.deepEqual([...patch.outline], [1, 0]);
});

function frame_message(): ArrayBuffer {
  return new Writer()
    .u32(3, 7)
    .f64(2 ** 40 + 1, 1.5)
    .f32(1, 2, 3, 0, 0, 0, 1)
    .f32(4, 5, 6, 0, 0, 1, 0)
    .f32(10, 20, 30, 40, 50, 60, 0.5, 100)
    .u32(9, 1, 4, 1, 2)
    .f32(0.75)
    .u32(300)
    .f32(1, 1, 1, 0, 0, 1, 0, 0, -2, 1)
    .u32(0, 3)
    .f32(1000, 2000)
    .i16(1, -2, 3, 4, 5, 6, 7, 8, -9)
    .u16(1, 2, 65535)
    .i16(-1, 0, 1)
    .u16(77)
    .done();
}

test('a frame: arrays of two bytes begin at multiples of four', () => {
  const frame = decode(frame_message(), scene);
  assert.ok(frame?.kind === 'frame');
  assert.equal(frame.tick, 2 ** 40 + 1);
  assert.equal(frame.time, 1.5);
  assert.deepEqual([...frame.tool], [1, 2, 3, 0, 0, 0, 1]);
  assert.deepEqual([...frame.device], [4, 5, 6, 0, 0, 1, 0]);
  assert.deepEqual([...frame.force, ...frame.torque], [10, 20, 30, 40, 50, 60]);
  assert.deepEqual([frame.unit_u, frame.unit_stress, frame.status, frame.patch], [0.5, 100, 9, 4]);
  assert.deepEqual([frame.force_error, frame.left_out], [0.75, 300]);
  assert.deepEqual([...frame.contact], [1, 1, 1, 0, 0, 1, 0, 0, -2, 1]);
  assert.deepEqual([...frame.pressure_node], [0, 3]);
  assert.deepEqual([...frame.pressure], [1000, 2000]);
  assert.deepEqual([...frame.u], [1, -2, 3, 4, 5, 6, 7, 8, -9]);
  assert.deepEqual([...frame.stress], [1, 2, 65535]);
  assert.deepEqual([...frame.patch_u], [-1, 0, 1]);
  assert.deepEqual([...frame.patch_stress], [77]);
});

test('ticks', () => {
  const message = new Writer().u32(4, 7).f64(12).u32(2, 1).f32(1, 2, 3, 4, 5, 6).f32(7, 8).f32(0.5, 0.25).f32(50, 60).f32(9, 10).u32(0, 256).f32(0, 0.125).u32(0, 70_000).u8(1, 255).done();
  const ticks = decode(message, scene);
  assert.ok(ticks?.kind === 'ticks');
  assert.deepEqual([ticks.first, ticks.count, ticks.stride], [12, 2, 1]);
  assert.deepEqual([...ticks.force], [1, 2, 3, 4, 5, 6]);
  assert.deepEqual([...ticks.shown], [7, 8]);
  assert.deepEqual([...ticks.depth], [0.5, 0.25]);
  assert.deepEqual([...ticks.late_us], [50, 60]);
  assert.deepEqual([...ticks.compute_us], [9, 10]);
  assert.deepEqual([...ticks.status], [0, 256]);
  assert.deepEqual([...ticks.force_error], [0, 0.125]);
  assert.deepEqual([...ticks.left_out], [0, 70_000]);
  assert.deepEqual([...ticks.contacts], [1, 255]);
});

test('messages of another scene are ignored', () => {
  assert.equal(decode(frame_message(), { ...scene, number: 8 }), null);
  assert.equal(decode(frame_message(), null), null);
});

test('what is no message is refused', () => {
  assert.throws(() => decode(new Writer().u32(5, 7).done(), scene), RangeError);
  assert.throws(() => decode(new Writer().u32(1, 7, 4, 0, 0, 0).done(), null), RangeError);
  const whole = frame_message();
  for (let bytes = 8; bytes < whole.byteLength - 3; bytes += 4) assert.throws(() => decode(whole.slice(0, bytes), scene), RangeError);
  assert.throws(() => decode(new Writer().u32(1, 7, 3, 1, 1, 0).f32(0, 0, 0).u32(0, 0, 1).u8(0).done(), null), /node 1 is not below 1/);
  assert.throws(() => decode(new Writer().u32(1, 7, 3, 1, 0, 1).f32(0, 0, 0).u32(0, 1).u8(0).done(), null), /node 1 is not below 1/);
});

test('stored messages one after the other', () => {
  const stored = new Writer().u32(2, 0).u8(0x68, 0x69).done();
  const binary = new Writer().u32(4, 1, 42).done();
  const all = new Uint8Array([...new Uint8Array(stored).slice(0, 10), ...new Uint8Array(binary)]);
  const [text, bytes] = split_messages(all);
  assert.equal(text, 'hi');
  assert.deepEqual([...new Uint32Array(bytes as ArrayBuffer)], [42]);
  assert.throws(() => split_messages(all.slice(0, -1)), /ends early/);
  assert.throws(() => split_messages(new Uint8Array([0, 0, 0, 0, 2, 0, 0, 0])), /unknown kind/);
});
