// Writes an MCAP file with other people's packages, of messages whose fields lie in every awkward way.
// `writing.mjs FILE [--no-indexes] [--no-chunks]`
import {open} from 'node:fs/promises';
import {McapWriter} from '@mcap/core';
import {parse} from '@foxglove/rosmsg';
import {MessageWriter} from '@foxglove/rosmsg2-serialization';

const line = '='.repeat(80) + '\n';
const schemas = {
  'test_msgs/msg/Fixed': `# all kinds of numbers
uint8 LIMIT=7  # a constant
Inner[2] inner
bool yes
float64 large
uint8 a
int16 b
uint8 c
int32 d
uint8 e
int64 f
int8[3] few
geometry_msgs/Vector3 place
float32 last
uint8 end
${line}MSG: test_msgs/Inner
uint8 first
float64 second
${line}MSG: geometry_msgs/Vector3
float64 x
float64 y
float64 z
`,
  'test_msgs/msg/Varying': `string name "nothing"
Inner[] inner
float32[<=8] numbers
string[] words
uint8 odd
float64[] more
builtin_interfaces/Time stamp
Pair pair
uint8 before
Wide[2] uneven
${line}MSG: test_msgs/Inner
uint8 first
uint16 second
${line}MSG: test_msgs/Wide
uint8 first
float64 second
${line}MSG: test_msgs/Pair
string text
int64 number
`};

const [path, ...options] = process.argv.slice(2);
const file = await open(path, 'w');
let at = 0n;
const writable = {position: () => at, write: async bytes => { await file.write(bytes); at += BigInt(bytes.byteLength); }};
const writer = new McapWriter({writable, useChunks: !options.includes('--no-chunks'), useMessageIndex: !options.includes('--no-indexes'),
  chunkSize: 2000});
await writer.start({profile: 'ros2', library: 'test'});
const channels = [];
for (const [name, text] of Object.entries(schemas)) {
  const schemaId = await writer.registerSchema({name, encoding: 'ros2msg', data: new TextEncoder().encode(text)});
  const id = await writer.registerChannel({schemaId, topic: '/' + name, messageEncoding: 'cdr', metadata: new Map()});
  channels.push({id, topic: '/' + name, messages: new MessageWriter(parse(text, {ros2: true}))});
}
await writer.addMetadata({name: 'palpate', metadata: new Map([['a', 'b'], ['c', 'ä']])});
for (let k = 0; k < 100; ++k) {
  const fixed = {inner: [{first: k, second: 1 / (k + 1)}, {first: 1, second: -k}], yes: k % 2 === 1, large: Math.sqrt(k), a: k, b: -300 * k,
    c: 2 * k, d: -70000 * k, e: 100 - k, f: k * 1e12, few: [k, -k, 1], place: {x: k, y: k + 0.5, z: -k}, last: k + 0.25, end: k};
  const varying = {name: 'n'.repeat(k % 9), inner: Array.from({length: k % 4}, (_, i) => ({first: i, second: 256 * i + k})),
    numbers: Array.from({length: k % 9}, (_, i) => i / 4), words: k % 3 ? ['ä', '', 'word'.repeat(k % 5)] : [], odd: k,
    more: k % 2 ? [k, 1 / 3] : [], stamp: {sec: k, nsec: 5}, pair: {text: 'x'.repeat(k % 5), number: k},
    before: k, uneven: [{first: k, second: 1 / 7}, {first: 1, second: k}]};
  const both = [fixed, varying];
  for (const [i, channel] of channels.entries()) {
    if (i === 1 && k % 2) continue;
    await writer.addMessage({channelId: channel.id, sequence: k, logTime: BigInt(k) * 1000n, publishTime: BigInt(k) * 1000n,
      data: channel.messages.writeMessage(both[i])});
  }
}
await writer.end();
await file.close();
