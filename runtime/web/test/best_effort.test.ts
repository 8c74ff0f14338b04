import assert from 'node:assert/strict';
import { test } from 'node:test';
import { is_marked, of_tick, RecentEfforts, sentence } from '../src/best_effort';
import type { Ticks } from '../src/wire';

const not_converged = 1 << 8; // StepStatus::not_converged
const unbalanced = 1 << 14; // StepStatus::unbalanced
const pose_limited = 1 << 7;
const late_motion = 1 << 12;

/** Samples of a force of 2 N along y, each [status, error in N, contact points left out]. */
function ticks(...samples: [number, number, number][]): Ticks {
  const count = samples.length;
  const zeros = () => new Float32Array(count);
  return {
    kind: 'ticks',
    scene: 1,
    first: 0,
    count,
    stride: 1,
    force: Float32Array.from({ length: 3 * count }, (_, i) => (i % 3 === 1 ? -2 : 0)),
    shown: zeros(),
    depth: zeros(),
    late_us: zeros(),
    compute_us: zeros(),
    status: Uint32Array.from(samples, ([status]) => status),
    force_error: Float32Array.from(samples, ([, error]) => error),
    left_out: Uint32Array.from(samples, ([, , left_out]) => left_out),
    contacts: new Uint8Array(count),
  };
}
const said = (...samples: [number, number, number][]): string => {
  const all = ticks(...samples);
  return sentence(samples.map((_, i) => of_tick(all, i)));
};

test('the worst of the ticks is told, with its reasons', () => {
  assert.equal(said(), '');
  assert.equal(said([0, 0, 0], [pose_limited, 0, 0]), '');
  assert.equal(said([0, 0, 0], [not_converged, 0.05, 0], [not_converged, 0.01, 0]), 'Best effort: force within about 2.5 % (not converged)');
  assert.equal(said([0, 0.3, 1]), 'Best effort: force within about 15 % (1 contact point left out)');
  assert.equal(said([not_converged, 0.3, 0], [0, 0.1, 12]), 'Best effort: force within about 15 % (not converged, 12 contact points left out)');
});

test('a body that stood still is told where that makes an error', () => {
  assert.equal(said([late_motion, 0, 0]), '');
  assert.equal(said([late_motion, 1.5, 0]), 'Best effort: force within about 75 % (the body stood still)');
  assert.deepEqual([0, 1].map((i) => is_marked(ticks([late_motion, 0, 0], [late_motion, 1, 0]), i)), [false, true]);
});

test('a balance that was not met at depth is told', () => {
  assert.equal(said([unbalanced, 0.1, 0]), 'Best effort: force within about 5 % (the balance at depth was not met)');
});

test('errors that are next to nothing, or all there is', () => {
  assert.equal(said([not_converged, 0.001, 0]), 'Best effort: force within 0.1 % (not converged)');
  assert.equal(said([not_converged, 0, 0]), 'Best effort: force within 0.1 % (not converged)');
  assert.equal(said([0, 7, 3]), 'Best effort: force off by 100 % or more (3 contact points left out)');
});

test('ticks of a best effort are marked', () => {
  const all = ticks([0, 0, 0], [not_converged, 0, 0], [pose_limited, 0, 0], [0, 0, 2]);
  assert.deepEqual([0, 1, 2, 3].map((i) => is_marked(all, i)), [false, true, false, true]);
});

test('it is told for a moment longer than it lasts, and the worst is forgotten', () => {
  const recent = new RecentEfforts();
  recent.take(ticks([not_converged, 1, 0]), 1000);
  recent.take(ticks([not_converged, 0.2, 0], [0, 0, 0]), 1500);
  recent.take(ticks([0, 0, 0]), 1600);
  assert.match(recent.sentence(1900), /50 %/);
  assert.match(recent.sentence(2200), /10 %/);
  assert.equal(recent.sentence(2600), '');
});
