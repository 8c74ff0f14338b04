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
  private ask_timer_ = 0;

  constructor(
    private readonly url_: string,
    private readonly listener_: Listener,
  ) {
    this.socket_.onmessage = ({ data }: MessageEvent<News[]>) => this.take(data);
    void this.connect();
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
    this.wait_ = first_wait;
    this.listener_.connected(true, '');
  }

  private close(reason: string): void {
    this.lose(`not connected${reason ? `: ${reason}` : ''}; trying again`);
  }

  private lose(note: string): void {
    this.listener_.connected(false, note);
    setTimeout(() => void this.connect(), this.wait_ * 1000);
    this.wait_ = Math.min(this.wait_ * 1.7, longest_wait);
  }

  private async connect(): Promise<void> {
    const refused = await why_not(this.url_);
    if (refused === '') this.ask({ about: 'socket', url: this.url_ });
    else this.lose(refused);
  }
}

const hex = (bytes: Uint8Array): string => [...bytes].map((byte) => byte.toString(16).padStart(2, '0')).join('');

/**
 * Why this address is not that of who answers there, empty where it is: the token is sent to nobody who does not prove to have it, as
 * the port may have been another program's since the page was loaded. Where the browser lets no page hash, on a network that all can listen to,
 * nothing is asked.
 */
async function why_not(url: string): Promise<string> {
  if (!('subtle' in crypto)) return '';
  const token = new URL(url).searchParams.get('token') ?? '';
  const nonce = hex(crypto.getRandomValues(new Uint8Array(16)));
  try {
    const answer = await fetch(`/proof?nonce=${nonce}`, { cache: 'no-store' });
    if (answer.status === 503) return 'too many pages are open; trying again';
    const proof = hex(new Uint8Array(await crypto.subtle.digest('SHA-256', new TextEncoder().encode(token + nonce))));
    return (await answer.text()).trim() === proof ? '' : 'open the whole address that palpate-runtime printed when it was started';
  } catch {
    return 'not connected; trying again';
  }
}

/** The socket beside this page, with the token that is in its address. */
export function socket_url(page: Location): string {
  return new URL(`socket${page.search}`, page.href).href.replace(/^http/, 'ws').replace(/#.*/, '');
}
