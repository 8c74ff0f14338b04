import assert from 'node:assert/strict';
import { test } from 'node:test';
import { map_colour, map_texels, Range } from '../src/colours';
import { format_number, format_si, nice_ceiling, nice_ticks, short_number, si_prefix } from '../src/format';

/** CIE 1976 lightness of an sRGB colour. */
function lightness([r, g, b]: [number, number, number]): number {
  const linear = [r, g, b].map((one) => (one <= 10 ? one / 255 / 12.92 : ((one / 255 + 0.055) / 1.055) ** 2.4));
  const y = 0.2126 * linear[0]! + 0.7152 * linear[1]! + 0.0722 * linear[2]!;
  return 116 * Math.cbrt(y) - 16;
}

test('the sequential map grows evenly in lightness', () => {
  const all = Array.from({ length: 101 }, (_, i) => lightness(map_colour('sequential', i / 100)));
  const slope = (all[100]! - all[0]!) / 100;
  for (let i = 0; i < 100; ++i) {
    const step = all[i + 1]! - all[i]!;
    assert.ok(step > 0.2 * slope && step < 2 * slope, `${i}: ${step} beside ${slope}`);
  }
  assert.deepEqual(map_colour('sequential', 0), [0x44, 0x01, 0x54]);
  assert.deepEqual(map_colour('sequential', 1), [0xfd, 0xe7, 0x25]);
});

test('the diverging map is lightest in the middle, blue below and red above', () => {
  const light = (share: number) => lightness(map_colour('diverging', share));
  for (let i = 0; i < 10; ++i) {
    assert.ok(light(i / 20) < light((i + 1) / 20));
    assert.ok(light(1 - i / 20) < light(1 - (i + 1) / 20));
  }
  const [low, high] = [map_colour('diverging', 0.1), map_colour('diverging', 0.9)];
  assert.ok(low[2] > low[0] && high[0] > high[2]);
});

test('texels are the map at equal distances', () => {
  const texels = map_texels('sequential', 11);
  assert.deepEqual([...texels.slice(20, 24)], [...map_colour('sequential', 0.5), 255]);
});

test('a range grows at once, and shrinks only when numbers stay small', () => {
  const range = new Range();
  assert.equal(range.follow(0.9, 0), 1);
  assert.equal(range.follow(1.1, 0.1), 1.5);
  assert.equal(range.follow(0.1, 0.2), 1.5);
  assert.equal(range.follow(1.4, 1.0), 1.5); // not small any more
  assert.equal(range.follow(0.1, 1.1), 1.5);
  assert.equal(range.follow(0.1, 2.5), 1.5);
  assert.ok(Math.abs(range.follow(0.1, 2.7) - 0.1) < 1e-12);
});

test('numbers as people read them', () => {
  assert.equal(format_si(1234, 'Pa'), '1.23 kPa');
  assert.equal(format_si(-0.00456, 'm'), '-4.56 mm');
  assert.equal(format_si(0, 'N'), '0 N');
  assert.equal(format_si(0.99999, 'N'), '1.00 N');
  assert.equal(format_number(0.01234), '0.0123');
  assert.equal(format_number(12345), '12345');
  assert.equal(format_number(NaN), '–');
  assert.equal(short_number(-2.5), '−2.5');
  assert.equal(short_number(100), '100');
  assert.deepEqual(si_prefix(2e-6), [1e-6, 'µ']);
});

test('ticks are round and inside', () => {
  assert.deepEqual(nice_ticks(0, 10, 5), [0, 2, 4, 6, 8, 10]);
  assert.deepEqual(nice_ticks(-1.5, 1.5, 3), [-1, 0, 1]);
  for (const high of [0.013, 0.7, 3.4, 99, 1234]) {
    const ticks = nice_ticks(0, high);
    assert.ok(ticks.length >= 3 && ticks.length <= 7 && ticks.at(-1)! <= high * (1 + 1e-9));
    assert.ok(nice_ceiling(high) >= high && nice_ceiling(high) < 2 * high);
  }
});
