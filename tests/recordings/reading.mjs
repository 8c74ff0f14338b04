// Prints what other people's packages find in an MCAP file: a line of JSON for each message, each by the schema in the file.
// `reading.mjs FILE` goes by the index, in the order of time; with --as-it-is record by record, as of a file without its end.
import {open} from 'node:fs/promises';
import {McapIndexedReader, McapStreamReader} from '@mcap/core';
import {parse} from '@foxglove/rosmsg';
import {MessageReader} from '@foxglove/rosmsg2-serialization';

const [path, mode] = process.argv.slice(2);
const file = await open(path, 'r');
const schemas = new Map(), channels = new Map();
const readers = new Map();

/** Numbers that JSON has not are told as text. */
function plain(value) {
  if (typeof value === 'bigint') return Number.isSafeInteger(Number(value)) ? Number(value) : String(value);
  if (typeof value === 'number') return Number.isFinite(value) ? value : String(value);
  if (ArrayBuffer.isView(value) || Array.isArray(value)) return Array.from(value, plain);
  if (value && typeof value === 'object') return Object.fromEntries(Object.entries(value).map(([key, each]) => [key, plain(each)]));
  return value;
}

function say(record) {
  process.stdout.write(JSON.stringify(plain(record)) + '\n');
}

function tell(message) {
  const channel = channels.get(message.channelId);
  if (!readers.has(message.channelId)) {
    const schema = schemas.get(channel.schemaId);
    if (schema.encoding !== 'ros2msg' || channel.messageEncoding !== 'cdr') throw new Error(`${channel.topic} is not ROS 2's`);
    readers.set(message.channelId, new MessageReader(parse(new TextDecoder().decode(schema.data), {ros2: true})));
  }
  say({topic: channel.topic, time: message.logTime, published: message.publishTime, sequence: message.sequence,
    message: readers.get(message.channelId).readMessage(message.data)});
}

if (mode === '--as-it-is') {
  const stream = new McapStreamReader({validateCrcs: true});
  const block = new Uint8Array(1 << 16);
  for (let n; (n = (await file.read(block, 0, block.length)).bytesRead) > 0;) {
    stream.append(block.slice(0, n));
    for (let record; (record = stream.nextRecord());) {
      if (record.type === 'Schema') schemas.set(record.id, record);
      else if (record.type === 'Channel') channels.set(record.id, record);
      else if (record.type === 'Message') tell(record);
      else if (record.type === 'Metadata') say({metadata: record.name, values: Object.fromEntries(record.metadata)});
    }
  }
  say({done: stream.done()});
} else {
  const {size} = await file.stat();
  const readable = {
    size: async () => BigInt(size),
    read: async (at, length) => {
      const bytes = new Uint8Array(Number(length));
      const {bytesRead} = await file.read(bytes, 0, bytes.length, Number(at));
      if (bytesRead !== bytes.length) throw new Error('read beyond the end');
      return bytes;
    },
  };
  const indexed = await McapIndexedReader.Initialize({readable});
  for (const [id, schema] of indexed.schemasById) schemas.set(id, schema);
  for (const [id, channel] of indexed.channelsById) channels.set(id, channel);
  say({profile: indexed.header.profile, library: indexed.header.library, statistics: {...indexed.statistics,
    channelMessageCounts: Object.fromEntries(indexed.statistics.channelMessageCounts)}, chunks: indexed.chunkIndexes.length});
  for await (const record of indexed.readMetadata()) say({metadata: record.name, values: Object.fromEntries(record.metadata)});
  for await (const message of indexed.readMessages({validateCrcs: true})) tell(message);
}
await file.close();
