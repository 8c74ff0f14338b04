import assert from 'node:assert/strict';
import { test } from 'node:test';
import { History, log_classes, quantile } from '../src/history';
import type { Ticks } from '../src/wire';

/** Depth is the tick's number times a thousandth. */
function ticks(first: number, count: number): Ticks {
  const zeros = () => new Float32Array(count);
  const depth = Float32Array.from({ length: count }, (_, i) => (first + i) / 1000);
  const force = new Float32Array(3 * count).fill(2);
  const none = () => new Uint32Array(count);
  return { kind: 'ticks', scene: 1, first, count, stride: 1, force, shown: zeros(), depth, late_us: zeros(), compute_us: depth, status: none(), force_error: zeros(), left_out: none(), contacts: new Uint8Array(count) };
}

test('the newest samples are kept', () => {
  const history = new History(10, false);
  history.add(ticks(0, 7));
  history.add(ticks(7, 8));
  assert.equal(history.count, 10);
  assert.equal(history.tick(0), 5);
  assert.equal(history.last, 14);
  assert.ok(Math.abs(history.value('depth', 3) - 0.008) < 1e-8);
  assert.ok(Math.abs(history.value('norm', 0) - Math.sqrt(12)) < 1e-6);
  history.add(ticks(20, 25));
  assert.deepEqual([history.count, history.tick(0), history.last], [10, 35, 44]);
});

test('a run that began anew goes on where the plots are, what was before 0; a replay keeps all, and forgets another one', () => {
  const live = new History(10, false);
  live.add(ticks(0, 7));
  live.add(ticks(0, 2));
  live.add(ticks(2, 1));
  assert.deepEqual(Array.from({ length: live.count }, (_, i) => live.tick(i)), [-7, -6, -5, -4, -3, -2, -1, 0, 1, 2]);
  assert.ok(Math.abs(live.value('depth', 6) - 0.006) < 1e-8 && live.value('depth', 7) === 0);
  const history = new History(10, true);
  for (let first = 0; first < 100; first += 25) history.add(ticks(first, 25));
  assert.deepEqual([history.count, history.tick(0), history.last], [100, 0, 99]);
  assert.ok(Math.abs(history.value('depth', 60) - 0.06) < 1e-8);
  history.add(ticks(0, 5));
  assert.deepEqual([history.count, history.last], [5, 4]);
});

test('what is left for a plot keeps the least and the largest, and gaps', () => {
  const history = new History(5000, false);
  const spike = ticks(0, 1000);
  spike.depth.fill(0);
  spike.depth[517] = 9;
  spike.depth[613] = -3;
  history.add(spike);
  history.add(ticks(2000, 1000));
  const [times, depth] = history.decimate(0, 3000, 100, ['depth']) as [number[], (number | null)[]];
  assert.ok(times.length < 250);
  assert.equal(Math.max(...depth.map((one) => one ?? 0)), 9);
  assert.equal(Math.min(...depth.map((one) => one ?? 0)), -3);
  for (let i = 1; i < times.length; ++i) assert.ok(times[i]! >= times[i - 1]!);
});

test('one best effort among many ticks is left', () => {
  const history = new History(5000, false);
  const one = ticks(0, 1000);
  one.left_out[517] = 3;
  history.add(one);
  const [times, marks] = history.decimate(0, 1000, 100, ['best_effort']) as [number[], number[]];
  const marked = times.filter((_, k) => marks[k]! > 0);
  assert.equal(marked.length, 1);
  assert.ok(Math.abs(marked[0]! - 517) < 10);
});

test('a gap in the ticks is one in the plot', () => {
  const history = new History(5000, false);
  history.add(ticks(0, 100));
  history.add(ticks(200, 100));
  const [times, depth] = history.decimate(0, 300, 1000, ['depth']) as [number[], (number | null)[]];
  const gap = depth.indexOf(null);
  assert.ok(gap > 0 && times[gap]! > 99 && times[gap]! < 200);
});

test('classes and quantiles', () => {
  const values = Float32Array.from([0.5, 1, 9.9, 10, 99, 1000, 20_000]);
  const classes = log_classes(values, 1);
  assert.deepEqual([...classes], [1, 2, 2, 0, 1, 1]);
  const sorted = Float32Array.from({ length: 1000 }, (_, i) => i);
  assert.deepEqual([quantile(sorted, 0.5), quantile(sorted, 0.999)], [500, 999]);
  assert.ok(Number.isNaN(quantile(new Float32Array(0), 0.5)));
});
