// Moves through the frames of a session.
import { button, input, part, select, write } from './dom';
import { format_time } from './format';

/** The last of ascending times that is not after `time`, 0 where there is none. */
export function frame_at(times: number[], time: number): number {
  let low = 0;
  let high = times.length;
  while (low < high) {
    const middle = (low + high) >> 1;
    if (times[middle]! <= time) low = middle + 1;
    else high = middle;
  }
  return Math.max(0, low - 1);
}

export class ReplayBar {
  private times_: number[] = [];
  private time_ = 0;
  private may_seek_ = false;
  private asked_ = -1; // the last frame that was sought
  private last_beat_: number | null = null; // while playing

  constructor(private readonly seek_: (frame: number) => void) {
    button('replay-play').addEventListener('click', () => this.toggle());
    button('replay-back').addEventListener('click', () => this.move(-1));
    button('replay-forward').addEventListener('click', () => this.move(1));
    input('scrub').addEventListener('input', () => {
      const frame = Number(input('scrub').value);
      this.stop();
      this.go(frame);
    });
  }

  /** A frame at this time [s] was sought, by who looks. */
  sought: (time: number) => void = () => undefined;

  private get can_move(): boolean {
    return this.may_seek_ && this.times_.length > 0;
  }

  /** The times of all frames [s], which is shown, whether this page may choose another, and whether it sees another than all. */
  show(times: number[], frame: number, may_seek: boolean, is_alone: boolean): void {
    this.times_ = times;
    this.may_seek_ = may_seek;
    for (const id of ['replay-play', 'replay-back', 'replay-forward', 'save-video']) button(id).disabled = !may_seek;
    input('scrub').disabled = !may_seek;
    if (!may_seek) this.last_beat_ = null;
    part('replay').hidden = times.length === 0;
    button('follow').hidden = !is_alone;
    input('scrub').max = String(Math.max(0, times.length - 1));
    if (this.last_beat_ === null && this.asked_ < 0) this.time_ = times[frame] ?? 0;
    if (this.asked_ === frame) this.asked_ = -1;
    this.write();
  }

  seek_time(time: number): void {
    if (this.can_move) this.go(frame_at(this.times_, time));
  }

  move(by: number): void {
    if (!this.can_move) return;
    this.stop();
    this.go(this.frame() + by);
  }

  toggle(): void {
    if (!this.can_move) return;
    if (this.last_beat_ !== null) {
      this.stop();
      return;
    }
    if (this.frame() >= this.times_.length - 1) this.go(0);
    this.last_beat_ = performance.now();
    this.write();
    requestAnimationFrame((now) => this.beat(now));
  }

  /** From the beginning to the end; then, or where it is stopped, `ended` is called. */
  play_once(ended: () => void): void {
    if (!this.can_move) return;
    this.stop();
    this.go(0);
    this.ended_ = ended;
    this.toggle();
  }
  halt(): void {
    this.stop();
  }
  private ended_: (() => void) | null = null;

  private frame(): number {
    return frame_at(this.times_, this.time_ + 1e-9);
  }

  private stop(): void {
    if (this.last_beat_ !== null) this.time_ = this.times_[this.frame()] ?? 0; // of what is shown
    this.last_beat_ = null;
    this.write();
    this.ended_?.();
    this.ended_ = null;
  }

  private go(frame: number): void {
    const wanted = Math.max(0, Math.min(this.times_.length - 1, frame));
    this.time_ = this.times_[wanted] ?? 0;
    this.ask(wanted);
  }

  private ask(frame: number): void {
    this.asked_ = frame;
    this.seek_(frame);
    this.write();
    this.sought(this.times_[frame] ?? 0);
  }

  /** As another page, which plays or seeks: not told again. */
  follow_time(time: number): void {
    if (!this.can_move) return;
    this.stop();
    const frame = frame_at(this.times_, time + 1e-9);
    this.time_ = this.times_[frame] ?? 0;
    this.asked_ = frame;
    this.seek_(frame);
    this.write();
  }

  private beat(now: number): void {
    if (this.last_beat_ === null) return;
    const before = this.frame();
    this.time_ += ((now - this.last_beat_) / 1000) * Number(select('replay-speed').value);
    this.last_beat_ = now;
    const frame = this.frame();
    if (frame !== before) this.ask(frame);
    if (frame >= this.times_.length - 1) this.stop();
    else requestAnimationFrame((next) => this.beat(next));
  }

  private write(): void {
    const plays = this.last_beat_ !== null;
    write(button('replay-play'), plays ? 'Pause' : 'Play');
    button('replay-play').setAttribute('aria-pressed', String(plays));
    input('scrub').value = String(this.frame());
    write(part('replay-time'), `${format_time(this.time_)} / ${format_time(this.times_.at(-1) ?? 0)}`);
  }
}
