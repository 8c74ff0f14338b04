import assert from 'node:assert/strict';
import { test } from 'node:test';
import { round_below } from '../src/format';
import { Pace } from '../src/pace';

const times = (count: number, act: () => void) => Array.from({ length: count }, act);

test('pictures that are slow become coarser, and fine again where there is time', () => {
  const pace = new Pace();
  times(40, () => pace.note(16));
  assert.equal(pace.share, 1);
  times(40, () => pace.note(120));
  const coarse = pace.share;
  assert.ok(coarse < 0.6 && coarse >= 0.4, `${coarse}`);
  times(400, () => pace.note(16));
  assert.equal(pace.share, 1);
});

test('what is too slow for a finger is quick enough for a mouse', () => {
  const [mouse, finger] = [new Pace(), new Pace()];
  finger.slow = 31;
  for (const pace of [mouse, finger]) times(40, () => pace.note(36));
  assert.deepEqual([mouse.is_thrifty, mouse.share], [false, 1]);
  assert.ok(finger.is_thrifty && finger.share < 1);
});

test('shade is saved first and pixels last, and all of it comes back', () => {
  const pace = new Pace();
  Object.assign(pace, { may_be_blocky: true, least: 0.1 });
  const seen: string[] = [];
  const look = () => {
    const now = [pace.is_thrifty ? 'thrifty' : '', pace.share < 1 ? (pace.share < 0.3 ? 'few' : 'fewer') : '', pace.is_blocky ? 'blocks' : ''].join(' ').trim();
    if (seen.at(-1) !== now) seen.push(now);
  };
  look();
  times(60, () => (pace.note(120), look()));
  assert.deepEqual(seen, ['', 'thrifty', 'thrifty fewer', 'thrifty fewer blocks', 'thrifty few blocks']);
  assert.ok(Math.abs(pace.share - 0.1) < 1e-9);
  assert.ok(pace.is_rough, 'light goes last');
  times(1500, () => (pace.note(16), look()));
  assert.deepEqual(seen.slice(5), ['thrifty fewer blocks', 'thrifty fewer', 'thrifty', '']);
  assert.equal(pace.is_rough, false);
});

test('very slow pictures save all at once, and without a graphics card they begin so', () => {
  const slow = new Pace();
  Object.assign(slow, { may_be_blocky: true, least: 0.1 });
  times(4, () => slow.note(700)); // two do not count
  assert.ok(slow.is_thrifty && slow.is_blocky && slow.share < 0.36, `${slow.share}`);
  const software = new Pace();
  Object.assign(software, { may_be_blocky: true, least: 0.1 });
  software.begin_coarse();
  assert.ok(software.is_thrifty && software.is_blocky && software.share < 0.3, `${software.share}`);
  times(1500, () => software.note(16));
  assert.ok(software.share === 1 && !software.is_blocky && !software.is_thrifty, 'it comes back where there is time');
});

test('one slow picture changes nothing, and what a whole one took does not count', () => {
  const pace = new Pace();
  times(3, () => pace.note(16));
  pace.note(500);
  times(3, () => pace.note(16));
  assert.equal(pace.share, 1);
  for (let k = 0; k < 20; ++k) {
    pace.note_rest(800);
    pace.note(800);
    pace.note(800);
    pace.note(16);
  }
  assert.equal(pace.share, 1);
  assert.equal(pace.rest_share, 1);
  pace.note_rest(3000);
  assert.ok(pace.rest_share < 1);
});

test('bars of known length are round', () => {
  assert.equal(round_below(0.037), 0.02);
  assert.equal(round_below(0.05), 0.05);
  assert.ok(Math.abs(round_below(0.0099) - 0.005) < 1e-12);
  assert.equal(round_below(0), 0);
});
