// The pointer's words on their way to the run, in the thread of the socket: a page that draws a slow picture says nothing meanwhile.
import type { Point } from './words';

const longest_wait = 250; // [ms] while pressed: the runtime gives up a pointer that is silent for five
const longest_silence = 10_000; // [ms] of the page, which then is taken for hung

/**
 * A press is repeated for a page that is busy. Where the connection takes no more, places on the way of a press or of a hovering
 * pointer are left out; that it was let down or lifted is sent later.
 */
export class PointerWords {
  private waiting_: Point[] = []; // let down and lifted in turn
  private last_: Point | null = null;
  private sent_at_ = -Infinity;
  private heard_at_ = -Infinity;

  /** `send` gives whether the connection took the word. Times are in milliseconds. */
  constructor(private readonly send_: (word: Point) => boolean) {}

  /** The page said something, of the pointer or not. */
  hear(now: number): void {
    this.heard_at_ = now;
  }

  say(word: Point, now: number): void {
    this.last_ = word;
    if (this.waiting_.at(-1)?.lifted === word.lifted) this.waiting_.pop();
    this.waiting_.push(word);
    this.beat(now);
  }

  /** To be called some times a second. */
  beat(now: number): void {
    const is_pressed = this.last_?.lifted === false && now - this.heard_at_ < longest_silence;
    if (is_pressed && this.waiting_.length === 0 && now - this.sent_at_ >= longest_wait) this.waiting_.push(this.last_!);
    while (this.waiting_.length > 0 && this.send_(this.waiting_[0]!)) {
      this.waiting_.shift();
      this.sent_at_ = now;
    }
  }

  /** The pointer is no hand any more, or nobody is there to hear of it. */
  forget(): void {
    this.waiting_ = [];
    this.last_ = null;
  }
}
