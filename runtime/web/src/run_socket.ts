// A run's socket, in a thread of its own: what comes is read there as it comes, and the page has all of it, with the last picture only, when it asks.
import { PointerWords } from './pointer_words';
import { NodeValues } from './values';
import { decode, type Frame, type Picture, type Scene } from './wire';
import type { Point, Said } from './words';

/** From the page: where the socket is, a word to the run, one of its pointer (null: it is no hand any more), or that the page is ready for more. */
export type Asked = { about: 'socket'; url: string } | { about: 'word'; text: string } | { about: 'point'; word: Point | null } | { about: 'more' };
/** To the page, in the order in which it came. */
export type News = { about: 'open' } | { about: 'closed'; reason: string } | { about: 'said'; said: Said } | { about: 'picture'; picture: Picture };

const most_waiting = 1 << 16; // bytes in the socket's buffer: what comes on top is old when it arrives
const pointer_period = 125; // [ms]

let socket: WebSocket | null = null;
let scene: Scene | null = null;
let news: News[] = [];
let is_asked = false;
const values = new NodeValues();
const pointer = new PointerWords((word) => {
  if (socket?.readyState !== WebSocket.OPEN || socket.bufferedAmount > most_waiting) return false;
  socket.send(JSON.stringify(word));
  return true;
});
setInterval(() => pointer.beat(performance.now()), pointer_period);

/** Its own arrays: those of the decoder change with the next picture. */
const kept = (frame: Frame): Frame => ({
  ...frame,
  u: frame.u.slice(),
  stress: frame.stress.slice(),
  patch_u: frame.patch_u.slice(),
  patch_stress: frame.patch_stress.slice(),
});

function tell(one: News): void {
  if (one.about === 'picture' && one.picture.kind === 'frame') news = news.filter((old) => old.about !== 'picture' || old.picture.kind !== 'frame');
  news.push(one);
  if (is_asked) give();
}

function give(): void {
  is_asked = false;
  const given = news.map((one) => (one.about === 'picture' && one.picture.kind === 'frame' ? { about: one.about, picture: kept(one.picture) } : one));
  news = [];
  postMessage(given);
}

function take(data: string | ArrayBuffer): void {
  try {
    if (typeof data === 'string') {
      tell({ about: 'said', said: JSON.parse(data) as Said });
      return;
    }
    const picture = decode(data, scene, values);
    if (picture?.kind === 'scene') scene = picture;
    if (picture) tell({ about: 'picture', picture });
  } catch (error) {
    tell({ about: 'said', said: { type: 'error', about: 'message', what: String(error), where: '', hint: '' } });
  }
}

function connect(url: string): void {
  const made = new WebSocket(url, 'palpate.2');
  made.binaryType = 'arraybuffer';
  socket = made;
  made.onopen = () => {
    scene = null;
    tell({ about: 'open' });
  };
  made.onmessage = (event: MessageEvent<string | ArrayBuffer>) => take(event.data);
  made.onclose = ({ reason }) => {
    pointer.forget();
    tell({ about: 'closed', reason });
  };
}

onmessage = ({ data: asked }: MessageEvent<Asked>) => {
  pointer.hear(performance.now());
  if (asked.about === 'socket') {
    connect(asked.url);
  } else if (asked.about === 'word') {
    if (socket?.readyState === WebSocket.OPEN) socket.send(asked.text);
  } else if (asked.about === 'point') {
    if (asked.word && socket?.readyState === WebSocket.OPEN) pointer.say(asked.word, performance.now());
    else pointer.forget();
  } else {
    is_asked = true;
    if (news.length > 0) give();
  }
};

/** What browser tests do: `palpate.lose()`. */
Object.assign(globalThis, { palpate: { lose: () => socket?.close() } });
