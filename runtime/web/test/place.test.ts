// Where the gallery leads, and back.
import assert from 'node:assert/strict';
import { test } from 'node:test';
import { gallery_of, page_of } from '../src/place';

const token = 'a'.repeat(32);

test('the page of a body is on this host, and its address opens nothing else', () => {
  assert.equal(page_of({ port: 8018, token }, { hostname: 'localhost', port: '9000' }), `http://localhost:8018/?token=${token}&gallery=9000`);
  assert.equal(page_of({ port: 8018, token }, { hostname: '[::1]', port: '' }), `http://[::1]:8018/?token=${token}&gallery=80`);
});

test('what is no port and token is no address', () => {
  const wrong = [{ port: 'javascript:alert(1)', token }, { port: '8018@evil.example', token }, { port: 0, token }, { port: 65536, token }, { port: 1.5, token }, { port: 8018, token: '' }, { port: 8018, token: `${token}&x=1` }, { port: 8018, token: 'A'.repeat(32) }, {}];
  for (const place of wrong) assert.throws(() => page_of(place as { port: number; token: string }, { hostname: 'localhost', port: '9000' }), JSON.stringify(place));
});

test('the way back is a port of this host, without a token', () => {
  assert.equal(gallery_of({ search: `?token=${token}&gallery=8017`, hostname: '127.0.0.1' }), 'http://127.0.0.1:8017/gallery');
  for (const search of ['', '?gallery=', '?gallery=0', '?gallery=65536', '?gallery=8017.' + token, '?gallery=javascript:alert(1)', '?gallery=80@evil.example', '?gallery=-1', '?gallery=1.5'])
    assert.equal(gallery_of({ search, hostname: '127.0.0.1' }), null, search);
});
