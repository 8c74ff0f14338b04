import assert from 'node:assert/strict';
import { test } from 'node:test';
import { map_colour, map_texels, Range, sequential_maps, share_of, type Rgb } from '../src/colours';
import { format_number, format_si, nice_ceiling, nice_ticks, short_number, si_prefix } from '../src/format';

/** CIE 1976 lightness of an sRGB colour. */
function lightness([r, g, b]: [number, number, number]): number {
  const linear = [r, g, b].map((one) => (one <= 10 ? one / 255 / 12.92 : ((one / 255 + 0.055) / 1.055) ** 2.4));
  const y = 0.2126 * linear[0]! + 0.7152 * linear[1]! + 0.0722 * linear[2]!;
  return 116 * Math.cbrt(y) - 16;
}

/** As eyes without red (protan) or green (deutan) cones see it: Machado, Oliveira and Fernandes 2009, of full severity, in linear light. */
const blindness = {
  protan: [0.152286, 1.052583, -0.204868, 0.114503, 0.786281, 0.099216, -0.003882, -0.048116, 1.051998],
  deutan: [0.367322, 0.860646, -0.227968, 0.280085, 0.672501, 0.047413, -0.01182, 0.04294, 0.968881],
};
const to_linear = (one: number) => (one <= 10 ? one / 255 / 12.92 : ((one / 255 + 0.055) / 1.055) ** 2.4);
const luminance = ([r, g, b]: Rgb) => 0.2126 * to_linear(r) + 0.7152 * to_linear(g) + 0.0722 * to_linear(b);

/** Luminance as such eyes have it. */
function luminance_of(matrix: number[], colour: Rgb): number {
  const linear = colour.map(to_linear);
  const seen = [0, 3, 6].map((row) => Math.max(0, matrix[row]! * linear[0]! + matrix[row + 1]! * linear[1]! + matrix[row + 2]! * linear[2]!));
  return 0.2126 * seen[0]! + 0.7152 * seen[1]! + 0.0722 * seen[2]!;
}

test('sequential maps grow evenly in lightness, for colour-blind eyes too', () => {
  for (const name of sequential_maps) {
    const colours = Array.from({ length: 101 }, (_, i) => map_colour(name, i / 100));
    const all = colours.map(lightness);
    const slope = (all[100]! - all[10]!) / 90;
    for (let i = 10; i < 100; ++i) {
      const step = all[i + 1]! - all[i]!;
      assert.ok(step > 0.2 * slope && step < 2.2 * slope, `${name} ${i}: ${step} beside ${slope}`);
    }
    for (const [eye, matrix] of Object.entries(blindness)) {
      for (let i = 10; i < 100; i += 5) {
        assert.ok(luminance_of(matrix, colours[i + 5]!) > luminance_of(matrix, colours[i]!), `${name} at ${i} for ${eye}`);
      }
    }
  }
  assert.deepEqual(map_colour('viridis', 1), [0xfd, 0xe7, 0x25]);
});

test('where nothing is, a body stands out from a dark and from a light ground', () => {
  const [dark, light] = [luminance([0x1a, 0x22, 0x2c]), luminance([0xe3, 0xe8, 0xee])];
  for (const [name, share] of [...sequential_maps.map((one) => [one, 0] as const), ['diverging', 0.5] as const]) {
    const own = luminance(map_colour(name, share));
    assert.ok((own + 0.05) / (dark + 0.05) >= 3, `${name} on dark: ${(own + 0.05) / (dark + 0.05)}`);
    assert.ok((light + 0.05) / (own + 0.05) >= 3, `${name} on light: ${(light + 0.05) / (own + 0.05)}`);
  }
});

test('the diverging map is darkest in the middle, blue below and orange above', () => {
  const light = (share: number) => lightness(map_colour('diverging', share));
  for (let i = 0; i < 10; ++i) {
    assert.ok(light(i / 20) > light((i + 1) / 20));
    assert.ok(light(1 - i / 20) > light(1 - (i + 1) / 20));
  }
  const [low, high] = [map_colour('diverging', 0.1), map_colour('diverging', 0.9)];
  assert.ok(low[2] > low[0] && high[0] > high[2]);
});

test('a logarithmic range has three decades', () => {
  assert.ok(Math.abs(share_of(1, 1e-3, 1, true) - 1) < 1e-12);
  assert.ok(Math.abs(share_of(0.1, 1e-3, 1, true) - 2 / 3) < 1e-12);
  assert.ok(Math.abs(share_of(1e-3, 1e-3, 1, true)) < 1e-12);
  assert.equal(share_of(0, 1e-3, 1, true), 0);
  assert.equal(share_of(0.5, 0, 1, false), 0.5);
});

test('texels are the map at equal distances', () => {
  const texels = map_texels('viridis', 11);
  assert.deepEqual([...texels.slice(20, 24)], [...map_colour('viridis', 0.5), 255]);
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
