// A page that `export --html` wrote: pictures follow from others, and are jumped to in any order.
import assert from 'node:assert/strict';
import { test } from 'node:test';
import { deflateSync } from 'node:zlib';
import { FileSource } from '../src/file_source';
import type { Frame, Picture } from '../src/wire';
import type { Said } from '../src/words';
import { BitText, numbered, Writer } from './messages';

const frames = 11;
const whole_each = 4;

/** Picture k has x = 3 k at the first of three nodes; one in four is whole. */
function session(): string {
  const messages: (string | ArrayBuffer)[] = [
    '{"type":"state","frame":0}',
    new Writer().u32(1, 7, 3, 3, 1, 0).f32(0, 0, 0, 1, 0, 0, 0, 1, 0).u32(0, 1, 2).u8(0, 0, 0).done(),
  ];
  for (let k = 0; k < frames; ++k) {
    const is_whole = k % whole_each === 0;
    const change = is_whole ? 3 * k : 3;
    const bits = change === 0 ? new BitText().zeros(4) : new BitText().block(0, change, -change).zeros(3);
    messages.push(numbered({ number: k + 1, base: is_whole ? 0 : k, exponents: [0, 0], bits }));
  }
  const bytes: number[] = [];
  for (const message of messages) {
    const body = typeof message === 'string' ? new TextEncoder().encode(message) : new Uint8Array(message);
    bytes.push(...new Uint8Array(Uint32Array.of(body.length, typeof message === 'string' ? 0 : 1).buffer), ...body);
  }
  return deflateSync(Uint8Array.from(bytes)).toString('base64');
}

test('pictures of a page are what they are, in whatever order they are asked for', async () => {
  const shown: number[] = [];
  let last: Partial<Frame> = {};
  let loaded = () => {};
  const is_loaded = new Promise<void>((resolve) => (loaded = resolve));
  const source = new FileSource(session(), {
    connected: () => {},
    said: (message: Said) => {
      assert.notEqual(message.type, 'error', JSON.stringify(message));
      if (message.type === 'state' && message.frame === 0 && shown.length > 0) loaded();
    },
    pictured: (picture: Picture) => {
      if (picture.kind !== 'frame') return false;
      last = picture;
      shown.push(picture.u[0]!);
      return true;
    },
  });
  await is_loaded;
  assert.deepEqual(shown, [0]);
  for (const frame of [1, 2, 3, 4, 5, 9, 3, 3, 10, 6, 7, 0, 4, 8, 2]) {
    source.send({ type: 'seek', frame });
    assert.deepEqual([last.number, [...last.u!]], [frame + 1, [3 * frame, 0, 0, 0, 0, 0, 0, 0, 0]], `frame ${frame}`);
  }
  source.send({ type: 'seek', frame: 99 });
  assert.equal(last.number, frames);
});
