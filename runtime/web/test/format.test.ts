import assert from 'node:assert/strict';
import { test } from 'node:test';
import { format_number, format_si, format_time, nice_ceiling, nice_ticks, short_number, si_prefix } from '../src/format';

test('each prefix stands for its power of ten', () => {
  const letters: [string, number][] = [['G', 9], ['M', 6], ['k', 3], ['', 0], ['m', -3], ['µ', -6], ['n', -9]];
  for (const [letter, power] of letters) {
    for (const number of [1, 12, 345]) {
      assert.deepEqual(si_prefix(number * 10 ** power), [Number(`1e${power}`), letter]);
      assert.equal(format_si(number * 10 ** power, 'm'), `${number.toPrecision(3)} ${letter}m`);
      assert.equal(format_si(-number * 10 ** power, 'm'), `-${number.toPrecision(3)} ${letter}m`);
    }
  }
  assert.equal(format_si(1.2e-5, 'm'), '12.0 µm');
  assert.equal(format_si(1.2e-2, 'm'), '12.0 mm');
  assert.equal(format_si(0, 'N'), '0 N');
  assert.equal(format_si(4e12, 'Pa'), '4000 GPa');
  assert.equal(format_si(3e-12, 'm'), '0.00300 nm');
  assert.equal(format_si(0.99996, 'N'), '1.00 N'); // not 1000 mN
});

test('numbers as people read them', () => {
  assert.equal(format_number(0.01234), '0.0123');
  assert.equal(format_number(12.34), '12.3');
  assert.equal(format_number(1234), '1234');
  assert.equal(format_number(9.996), '10.0');
  assert.equal(format_number(1.5e-7), '1.50e-7');
  assert.equal(format_number(NaN), '–');
  assert.equal(short_number(-2.5), '−2.5');
  assert.equal(short_number(10), '10');
  assert.equal(format_time(187.25), '3:07.25');
});

test('scales end at round numbers', () => {
  assert.deepEqual([0.011, 0.16, 2.1, 31, 480, 7600].map(nice_ceiling).map((x) => Number(x.toPrecision(3))), [0.015, 0.2, 3, 50, 500, 10000]);
  assert.deepEqual(nice_ticks(-1, 1), [-1, -0.5, 0, 0.5, 1]);
  assert.deepEqual(nice_ticks(0, 10), [0, 2, 4, 6, 8, 10]);
});
