import assert from 'node:assert/strict';
import { test } from 'node:test';
import { PointerWords } from '../src/pointer_words';
import type { Point } from '../src/words';

const word = (x: number, lifted: boolean): Point => ({ type: 'point', position: [x, 0, 0], orientation: [0, 0, 0, 1], grab: false, lifted });

/** Words, and what the run was sent of them while the connection took some. */
function connection() {
  const sent: string[] = [];
  const all = { sent, takes: true, words: null as unknown as PointerWords };
  all.words = new PointerWords(({ position, lifted }) => {
    if (all.takes) sent.push(`${lifted ? 'lifted' : 'pressed'} ${position[0]}`);
    return all.takes;
  });
  return all;
}

test('a press is repeated while the page is busy, so that the runtime does not take it for gone', () => {
  const { words, sent } = connection();
  words.hear(0);
  words.say(word(1, false), 0);
  for (let now = 125; now <= 3000; now += 125) words.beat(now);
  assert.deepEqual(sent, Array(13).fill('pressed 1')); // at once, and each quarter of a second
});

test('a page that says nothing at all for ten seconds holds nothing any more', () => {
  const { words, sent } = connection();
  words.hear(0);
  words.say(word(1, false), 0);
  words.beat(9_999);
  assert.equal(sent.length, 2);
  words.beat(10_000);
  words.beat(20_000);
  assert.equal(sent.length, 2);
  words.hear(20_000); // it was busy after all
  words.beat(20_000);
  assert.equal(sent.length, 3);
});

test('what hovers is not repeated, nor what is no hand any more', () => {
  const { words, sent } = connection();
  words.hear(0);
  words.say(word(1, true), 0);
  words.beat(1000);
  words.say(word(2, false), 1000);
  words.forget();
  words.beat(2000);
  assert.deepEqual(sent, ['lifted 1', 'pressed 2']);
});

test('a connection that takes no more loses places, and no press or lift', () => {
  const connected = connection();
  const { words, sent } = connected;
  words.hear(0);
  words.say(word(0, true), 0);
  connected.takes = false;
  [word(1, true), word(2, false), word(3, false), word(4, true), word(5, true), word(6, false), word(7, true)].forEach((one, k) => words.say(one, 10 * k));
  words.beat(500);
  assert.deepEqual(sent, ['lifted 0']);
  connected.takes = true;
  words.beat(1000);
  assert.deepEqual(sent, ['lifted 0', 'lifted 1', 'pressed 3', 'lifted 5', 'pressed 6', 'lifted 7']);
});
