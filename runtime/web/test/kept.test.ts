import assert from 'node:assert/strict';
import { test } from 'node:test';
import { as_hash, of_hash } from '../src/kept';
import { told_of } from '../src/states';
import type { State } from '../src/words';

test('an address brings back what it was made from', () => {
  const kept = { look: { field: 'von-mises', 'show-edges': '1' }, place: { towards: [0, -0.6, 0.8] as [number, number, number], target: [0.1, 0, 0] as [number, number, number], away: 3.5 } };
  assert.deepEqual(of_hash(`#${as_hash(kept)}`), kept);
  assert.deepEqual(of_hash(`#${as_hash({ ...kept, place: null })}`), { ...kept, place: null });
});

test('an address that was mangled shows what can be read of it', () => {
  assert.equal(of_hash(''), null);
  assert.equal(of_hash('#field=x&eye=1+2+3')!.place, null);
  assert.equal(of_hash('#field=x&eye=1+2+3+4+5+6+NaN')!.place, null);
  assert.deepEqual(of_hash('#field=x')!.look, { field: 'x' });
});

const run = { model: { name: 'cube' }, you: 'controller', controlled: true, paused: false } as unknown as State;

test('what the run is doing is told with what to do', () => {
  assert.equal(told_of(run, 'live', ''), null);
  assert.equal(told_of({ ...run, paused: true }, 'live', '')?.kind, 'paused');
  assert.equal(told_of(run, 'live', 'not connected; trying again')?.text, 'The program has ended');
  assert.equal(told_of(null, 'live', 'not connected; trying again')?.text, 'Connecting');
  for (const state of [null, run]) assert.match(told_of(state, 'live', 'open the whole address')!.hint, /^Open the whole address/);
  assert.match(told_of({ ...run, you: 'watcher' }, 'live', '')!.hint, /Another page/);
  assert.match(told_of({ ...run, you: 'watcher', controlled: false }, 'live', '')!.hint, /Take control/);
  assert.equal(told_of({ ...run, paused: true }, 'file', ''), null);
});
