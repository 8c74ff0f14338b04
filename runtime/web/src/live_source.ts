// A run at the other end of a socket, connected anew when it was lost.
import type { Asked, News } from './run_socket';
import RunSocket from './run_socket?worker&inline';
import type { Listener, Source } from './source';
import type { Point, Word } from './words';

const first_wait = 0.25; // [s]
const longest_wait = 5;
const longest_drawing = 250; // [ms] that more is not asked for: a page out of sight draws nothing

export class LiveSource implements Source {
  private readonly socket_ = new RunSocket();
  private wait_ = first_wait;
  private is_open_ = false;
  private ask_timer_ = 0;

  constructor(
    private readonly url_: string,
    private readonly listener_: Listener,
  ) {
    this.socket_.onmessage = ({ data }: MessageEvent<News[]>) => this.take(data);
    this.ask({ about: 'socket', url: url_ });
    this.more();
  }

  send(word: Word): void {
    this.ask({ about: 'word', text: JSON.stringify(word) });
  }

  point(word: Point | null): void {
    this.ask({ about: 'point', word });
  }

  /** The page has drawn what came last. */
  more(): void {
    clearTimeout(this.ask_timer_);
    this.ask_timer_ = 0;
    this.ask({ about: 'more' });
  }

  private ask(asked: Asked): void {
    this.socket_.postMessage(asked);
  }

  private take(news: News[]): void {
    let is_drawn = false;
    for (const one of news) {
      if (one.about === 'said') this.listener_.said(one.said);
      else if (one.about === 'picture') is_drawn = this.listener_.pictured(one.picture) || is_drawn;
      else if (one.about === 'open') this.open();
      else this.close(one.reason);
    }
    if (is_drawn) this.ask_timer_ = window.setTimeout(() => this.more(), longest_drawing);
    else this.more();
  }

  private open(): void {
    this.is_open_ = true;
    this.wait_ = first_wait;
    this.listener_.connected(true, '');
  }

  private close(reason: string): void {
    this.is_open_ = false;
    this.listener_.connected(false, `not connected${reason ? `: ${reason}` : ''}; trying again`);
    void this.ask_why();
    setTimeout(() => this.ask({ about: 'socket', url: this.url_ }), this.wait_ * 1000);
    this.wait_ = Math.min(this.wait_ * 1.7, longest_wait);
  }

  /** A socket that is refused does not say why, but the same address asked for as a page does. */
  private async ask_why(): Promise<void> {
    try {
      const { status } = await fetch(this.url_.replace(/^ws/, 'http'), { cache: 'no-store' });
      if (this.is_open_) return;
      if (status === 403) this.listener_.connected(false, 'the program was started anew: open the address that it printed');
      if (status === 503) this.listener_.connected(false, 'too many pages are open; trying again');
    } catch {
      // it is not there
    }
  }
}

/** The socket beside this page, with the token that is in its address. */
export function socket_url(page: Location): string {
  return new URL(`socket${page.search}`, page.href).href.replace(/^http/, 'ws').replace(/#.*/, '');
}
