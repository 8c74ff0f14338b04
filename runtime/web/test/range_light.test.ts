import assert from 'node:assert/strict';
import test from 'node:test';
import { light_of, light_title, small_strain_words, turned_beside } from '../src/range_light';

const turned = (degrees: number) => ({ rotation: (degrees * Math.PI) / 180, strain: 0.034 });
const studied = (18 * Math.PI) / 180;

test('the light goes by the studied range', () => {
  assert.equal(light_of(turned(0), studied), 'good');
  assert.equal(light_of(turned(8.9), studied), 'good');
  assert.equal(light_of(turned(9.1), studied), 'near');
  assert.equal(light_of(turned(17.9), studied), 'near');
  assert.equal(light_of(turned(18.1), studied), 'over');
});

test('there is none where nothing was studied, or nothing is shown', () => {
  assert.equal(light_of(turned(50), null), null);
  assert.equal(light_of(turned(50), undefined), null);
  assert.equal(light_of(null, studied), null);
  assert.equal(light_of(undefined, studied), null);
});

test('it says the numbers and what to do', () => {
  assert.match(light_title('good', turned(3), studied, false), /strain is 3 %.*within 5 % up to a rotation of 18°\.$/);
  assert.match(light_title('near', turned(12), studied, false), /more than half/);
  assert.match(light_title('over', turned(30), studied, false), /turn on Depth/);
  assert.doesNotMatch(light_title('over', turned(95), studied, true), /turn on Depth/);
  assert.match(light_title('over', turned(95), studied, true), /--solver corotational/);
});

test('it says what small strain would have', () => {
  assert.deepEqual(small_strain_words(0.361), { short: 'linear +36 %', sentence: 'By small strain this touch would have 36 % more force.' });
  assert.equal(small_strain_words(-0.02)?.short, 'linear −2 %');
  for (const none of [undefined, 0, 0.004]) assert.equal(small_strain_words(none), null);
});

test('what turns within the dent of a tool does not count, and what turns beside it does', () => {
  const up = [0, 0, 1];
  const steep = [Math.sin(1), 0, Math.cos(1)];
  const bent = [Math.sin(0.2), 0, Math.cos(0.2)];
  const rest = [...up, ...up, ...up];
  const surface = { position: [0.01, 0, 0, 0.05, 0, 0, 0.1, 0, 0], normal: [...steep, ...up, ...bent], triangle: [] };
  const near = (a: number, b: number) => assert.ok(Math.abs(a - b) < 1e-12, `${a} is not ${b}`);
  near(turned_beside(rest, surface, null, 0.01), 1);
  near(turned_beside(rest, surface, [0, 0, 0], 0.01), 0.2);
  near(turned_beside(rest, surface, [0, 0, 0], 0.001), 1);
});
