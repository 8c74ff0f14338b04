import assert from 'node:assert/strict';
import { test } from 'node:test';
import { usual_largest } from '../src/field';
import { first_direction, fit_places, guessed_up, turned_up } from '../src/outlook';
import { dot, minus } from '../src/pose';
import type { Scene } from '../src/wire';
import type { Vec3 } from '../src/words';

/** A unit cube, triangles outward; held where `is_held`. */
function cube(is_held: (place: Vec3) => boolean): Scene {
  const places = Array.from({ length: 8 }, (_, i) => [i & 1, (i >> 1) & 1, (i >> 2) & 1] as Vec3);
  const triangle = [0, 2, 3, 0, 3, 1, 4, 5, 7, 4, 7, 6, 0, 1, 5, 0, 5, 4, 2, 6, 7, 2, 7, 3, 0, 4, 6, 0, 6, 2, 1, 3, 7, 1, 7, 5];
  return {
    kind: 'scene',
    number: 1,
    dimension: 3,
    position: Float32Array.from(places.flat()),
    triangle: Uint32Array.from(triangle),
    edge: new Uint32Array(0),
    held: Uint8Array.from(places, (place) => (is_held(place) ? 7 : 0)),
    material: new Uint8Array(0),
    inner: { position: new Float32Array(0), triangle: new Uint32Array(0), inside: new Uint8Array(0), outside: new Uint8Array(0) },
  };
}

test('a body is looked at from its upper front, but not at what is held', () => {
  const usual = first_direction(cube(([, , z]) => z === 0));
  assert.ok(usual[0] > 0 && usual[1] < 0 && usual[2] > 0, `${usual}`);
  assert.ok(Math.abs(Math.hypot(...usual) - 1) < 1e-12);
  assert.ok(first_direction(cube(([, , z]) => z === 1))[2] < 0, 'hung from its upper side');
  assert.ok(first_direction(cube(([, y]) => y === 0))[1] > 0, 'held in front');
});

test('all places are in the opening, and two opposite sides of it are touched', () => {
  const { position } = cube(() => false);
  const towards = first_direction(cube(() => false));
  const [slope, opening] = [0.3, { wide: 1.2, high: 0.7 }];
  const { target, away } = fit_places(position, towards, [0, 0, 1], slope, opening);
  const right: Vec3 = [-towards[1] / Math.hypot(towards[0], towards[1]), towards[0] / Math.hypot(towards[0], towards[1]), 0];
  let nearest = Infinity;
  for (let i = 0; i < 8; ++i) {
    const place = minus(Array.from(position.slice(3 * i, 3 * i + 3)) as Vec3, target);
    const reach = slope * (away - dot(place, towards)); // half the picture's height there
    const across = dot(place, right);
    const upright = Math.sqrt(Math.max(0, dot(place, place) - across ** 2 - dot(place, towards) ** 2));
    const room = Math.min(opening.wide * reach - Math.abs(across), opening.high * reach - upright);
    assert.ok(room > -1e-9, `corner ${i}`);
    nearest = Math.min(nearest, room);
  }
  assert.ok(nearest < 1e-9, `${nearest} is free`);
});

test('a hot spot does not set the range, and zeros do not count', () => {
  const value = new Float32Array(2000).fill(1);
  value.fill(0, 1000);
  value[0] = -50;
  const known = new Float32Array(2000).fill(1);
  const area = new Float32Array(2000).fill(2);
  const usual = usual_largest(value, known, area, 50, 0.004);
  assert.ok(usual >= 1 && usual < 1.05, `${usual}`);
  assert.equal(usual_largest(value, known, area, 50, 0), 50);
  area[0] = 10; // five in a thousand
  assert.equal(usual_largest(value, known, area, 50, 0.004), 50);
  known[0] = 0;
  assert.ok(usual_largest(value, known, area, 1, 0.004) === 1);
  assert.equal(usual_largest(new Float32Array(3), known.slice(0, 3), area.slice(0, 3), 0, 0.004), 0);
});

test('a body that stands on what holds it along y has y up, any other z', () => {
  assert.deepEqual(guessed_up(cube(([, y]) => y === 0)), [0, 1, 0]);
  assert.deepEqual(guessed_up(cube(([, , z]) => z === 0)), [0, 0, 1]);
  assert.deepEqual(guessed_up(cube(([x]) => x === 0)), [0, 0, 1]); // a beam is not set on its end
  assert.deepEqual(guessed_up(cube(() => false)), [0, 0, 1]);
});

test('directions with another axis up are turned, not mirrored', () => {
  for (const up of [[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]] as Vec3[]) {
    const [x, y, z] = ([[1, 0, 0], [0, 1, 0], [0, 0, 1]] as Vec3[]).map((axis) => turned_up(axis, up)) as [Vec3, Vec3, Vec3];
    assert.equal(dot(z, up), 1);
    assert.ok(Math.abs(dot([x[1] * y[2] - x[2] * y[1], x[2] * y[0] - x[0] * y[2], x[0] * y[1] - x[1] * y[0]], z) - 1) < 1e-12);
  }
});
