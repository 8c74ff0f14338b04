import assert from 'node:assert/strict';
import test from 'node:test';
import { light_of, light_title } from '../src/range_light';

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
  assert.match(light_title('over', turned(30), studied, false), /turn on Warp/);
  assert.doesNotMatch(light_title('over', turned(95), studied, true), /--warp/);
  assert.match(light_title('over', turned(95), studied, true), /--solver corotational/);
});
