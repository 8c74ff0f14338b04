// Messages are written by hand, byte by byte, after PROTOCOL.md.
import assert from 'node:assert/strict';
import { test } from 'node:test';
import { BitText, numbered, Writer, type Numbered } from './messages';
import { NodeValues } from '../src/values';
import { decode, split_messages, type Frame, type Scene } from '../src/wire';

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

test('a scene of two materials, and where they meet', () => {
  const message = three_nodes().pad().u32(3, 1).f32(0, 0, 1, 1, 0, 1, 0, 1, 1).u32(0, 2, 1).u8(1).u8(1).u8(0).done();
  const { material, inner, held } = decode(message, null) as Scene;
  assert.deepEqual([...held], [7, 0, 4]);
  assert.deepEqual([...material], [1]);
  assert.deepEqual([...inner.position.slice(3, 6)], [1, 0, 1]);
  assert.deepEqual([...inner.triangle], [0, 2, 1]);
  assert.deepEqual([[...inner.inside], [...inner.outside]], [[1], [0]]);
  const beyond = three_nodes().pad().u32(1, 1).f32(0, 0, 1).u32(0, 2, 1).u8(1).u8(1).u8(0).done();
  assert.throws(() => decode(beyond, null), /inner surface's node/);
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

/** u = (1, -2, 3), (4, 5, 6), (7, 8, -9) and stress 0, 1, unknown; of the patch's node (-1, 0, 1) and 76. */
const whole_bits = (): BitText =>
  new BitText().block(3, 1, 3, 3).block(4, -2, 7, 3).block(5, 3, 3, -15).block(3, 1, 1, -2).block(1, -1).zeros(1).block(2, 1).block(8, 77);

function frame_message(): ArrayBuffer {
  return numbered({ number: 1, base: 0, exponents: [-1, 7], patch: 4, patch_nodes: 1, bits: whole_bits() });
}

test('a frame', () => {
  const frame = decode(frame_message(), scene, new NodeValues());
  assert.ok(frame?.kind === 'frame');
  assert.equal(frame.tick, 2 ** 40 + 1);
  assert.equal(frame.time, 1.5);
  assert.deepEqual([...frame.tool], [1, 2, 3, 0, 0, 0, 1]);
  assert.deepEqual([...frame.device], [4, 5, 6, 0, 0, 1, 0]);
  assert.deepEqual([...frame.force, ...frame.torque], [10, 20, 30, 40, 50, 60]);
  assert.deepEqual([frame.number, frame.base], [1, 0]);
  assert.deepEqual([frame.unit_u, frame.unit_stress, frame.status, frame.patch], [0.5, 128, 9, 4]);
  assert.deepEqual([frame.force_error, frame.left_out, frame.greens_error], [0.75, 300, 0.125]);
  assert.deepEqual([...frame.contact], [1, 1, 1, 0, 0, 1, 0, 0, -2, 1]);
  assert.deepEqual([...frame.pressure_node], [0, 3]);
  assert.deepEqual([...frame.pressure], [1000, 2000]);
  assert.deepEqual([...frame.u], [1, -2, 3, 4, 5, 6, 7, 8, -9]);
  assert.deepEqual([...frame.stress], [1, 2, 0]);
  assert.deepEqual([...frame.patch_u], [-1, 0, 1]);
  assert.deepEqual([...frame.patch_stress], [77]);
});

test('a frame follows from the one before', () => {
  const values = new NodeValues();
  const first = decode(frame_message(), scene, values);
  assert.ok(first?.kind === 'frame');
  const next = (head: Omit<Numbered, 'bits'>, bits: BitText) => {
    const frame = decode(numbered({ ...head, bits }), scene, values);
    assert.ok(frame?.kind === 'frame');
    return frame;
  };
  // Nothing moves.
  const still = next({ number: 2, base: 1, exponents: [-1, 7], patch: 4, patch_nodes: 1 }, new BitText().zeros(8));
  assert.deepEqual([...still.u], [1, -2, 3, 4, 5, 6, 7, 8, -9]);
  assert.equal(still.version, first.version);
  // The y of the second and third node goes up by 10; units are twice and half as large; another patch.
  const moved = next({ number: 3, base: 2, exponents: [0, 6], patch: 5, patch_nodes: 1 }, new BitText().zeros(1).block(5, 0, 10).zeros(6));
  assert.deepEqual([...moved.u], [1, -1, 2, 2, 13, 3, 4, 14, -4]); // halves go up
  assert.deepEqual([...moved.stress], [1, 3, 0]);
  assert.deepEqual([...moved.patch_u, ...moved.patch_stress], [0, 0, 0, 0]);
  assert.notEqual(moved.version, still.version);
  // Units so small that what was counts for nothing.
  const far = next({ number: 4, base: 3, exponents: [-9, 15], patch: 0, patch_nodes: 0 }, new BitText().zeros(3).block(2, 1));
  assert.deepEqual([...far.u], [0, 0, 0, 0, 0, 0, 0, 0, 0]);
  assert.deepEqual([...far.stress], [1, 1, 1]);
  // One that is whole needs none before.
  assert.deepEqual([...(decode(frame_message(), scene, values) as Frame).u], [1, -2, 3, 4, 5, 6, 7, 8, -9]);
});

test('a frame that follows from another one is refused', () => {
  const values = new NodeValues();
  const later = numbered({ number: 3, base: 2, exponents: [0, 0], bits: new BitText().zeros(4) });
  assert.throws(() => decode(later, scene, values), /follows from 2, not from 0/);
  decode(frame_message(), scene, values);
  assert.throws(() => decode(later, scene, values), /follows from 2, not from 1/);
  for (const bits of [whole_bits().zeros(1), new BitText().zeros(9), new BitText().block(25)]) {
    assert.throws(() => decode(numbered({ number: 1, base: 0, exponents: [0, 0], patch: 4, patch_nodes: 1, bits }), scene, values), RangeError);
  }
});

test('numbers of each size, in more blocks than one and runs that go on', () => {
  const many: Scene = { ...scene, held: new Uint8Array(100), position: new Float32Array(300) };
  for (let width = 1; width <= 15; ++width) {
    const numbers = Array.from({ length: 100 }, (_, k) => ((k * k * 31 + k) % 2 ** width) - 2 ** (width - 1));
    const bits = new BitText();
    const changes = numbers.map((number, k) => number - (numbers[k - 1] ?? 0));
    bits.zeros(4); // x
    for (let at = 0; at < 100; at += 32) bits.block(Math.max(0, width - 7), ...changes.slice(at, at + 32)); // y, up to 256 ones each
    bits.zeros(8); // z and stress
    const frame = decode(numbered({ number: 1, base: 0, exponents: [0, 0], bits }), many, new NodeValues());
    assert.ok(frame?.kind === 'frame');
    assert.deepEqual([...frame.u], numbers.flatMap((y) => [0, y, 0]));
    assert.deepEqual([...frame.stress], new Array(100).fill(0));
  }
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
  for (let bytes = 8; bytes < whole.byteLength; ++bytes) assert.throws(() => decode(whole.slice(0, bytes), scene, new NodeValues()), RangeError);
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
