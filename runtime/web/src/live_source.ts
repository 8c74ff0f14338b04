// A run at the other end of a WebSocket, connected anew when it was lost.
import type { Listener, Source } from './source';
import { NodeValues } from './values';
import { decode, type Scene } from './wire';
import type { Said, Word } from './words';

const first_wait = 0.25; // [s]
const longest_wait = 5;
const most_waiting = 1 << 16; // bytes in the socket's buffer: what comes on top is old when it arrives

export class LiveSource implements Source {
  private socket_: WebSocket | null = null;
  private scene_: Scene | null = null;
  private readonly values_ = new NodeValues();
  private wait_ = first_wait;

  constructor(
    private readonly url_: string,
    private readonly listener_: Listener,
  ) {
    this.connect();
  }

  send(word: Word): void {
    const socket = this.socket_;
    if (socket?.readyState !== WebSocket.OPEN) return;
    if (word.type === 'point' && socket.bufferedAmount > most_waiting) return;
    socket.send(JSON.stringify(word));
  }

  private connect(): void {
    const socket = new WebSocket(this.url_, 'palpate.2');
    socket.binaryType = 'arraybuffer';
    this.socket_ = socket;
    socket.onopen = () => {
      this.wait_ = first_wait;
      this.scene_ = null;
      this.listener_.connected(true, '');
    };
    socket.onmessage = (event: MessageEvent<string | ArrayBuffer>) => this.take(event.data);
    socket.onclose = (event) => {
      const why = event.reason ? `: ${event.reason}` : '';
      this.listener_.connected(false, `not connected${why}; trying again`);
      void this.ask_why();
      setTimeout(() => this.connect(), this.wait_ * 1000);
      this.wait_ = Math.min(this.wait_ * 1.7, longest_wait);
    };
  }

  /** A socket that is refused does not say why, but the same address asked for as a page does. */
  private async ask_why(): Promise<void> {
    try {
      const { status } = await fetch(this.url_.replace(/^ws/, 'http'), { cache: 'no-store' });
      if (this.socket_?.readyState === WebSocket.OPEN) return;
      if (status === 403) this.listener_.connected(false, 'the program was started anew: open the address that it printed');
      if (status === 503) this.listener_.connected(false, 'too many pages are open; trying again');
    } catch {
      // it is not there
    }
  }

  private take(data: string | ArrayBuffer): void {
    try {
      if (typeof data === 'string') {
        this.listener_.said(JSON.parse(data) as Said);
        return;
      }
      const picture = decode(data, this.scene_, this.values_);
      if (picture?.kind === 'scene') this.scene_ = picture;
      if (picture) this.listener_.pictured(picture);
    } catch (error) {
      this.listener_.said({ type: 'error', about: 'message', what: String(error), where: '', hint: '' });
    }
  }
}

/** The socket beside this page, with the token that is in its address. */
export function socket_url(page: Location): string {
  return new URL(`socket${page.search}`, page.href).href.replace(/^http/, 'ws').replace(/#.*/, '');
}
