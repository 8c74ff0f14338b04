import assert from 'node:assert/strict';
import { test } from 'node:test';
import { headline, is_news, sentences } from '../src/problem';

const problem = { what: 'it is -1 (below 0)', where: '--friction', hint: 'give 0 (no friction) or more' };

test('a problem is read as its parts are, whatever stands in them', () => {
  assert.equal(headline(problem), '--friction: it is -1 (below 0)');
  assert.equal(sentences(problem), '--friction: it is -1 (below 0). Give 0 (no friction) or more.');
  assert.equal(sentences({ what: 'no memory', where: '', hint: '' }), 'no memory');
});

test('a problem is news once', () => {
  assert.ok(is_news(problem, null));
  assert.ok(is_news(problem, undefined));
  assert.ok(!is_news({ ...problem }, problem));
  assert.ok(is_news({ ...problem, hint: 'another' }, problem));
  assert.ok(!is_news(null, problem));
});
