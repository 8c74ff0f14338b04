// How finely pictures are drawn: as finely as the machine keeps up with while they change, and whole once they rest.

const slow = 48; // [ms] a picture that is too slow
const very_slow = 200; // two of them are enough
const quick = 24;
const patience_slow = 3; // pictures
const patience_quick = 45;

export class Pace {
  /** Bounds of `share`. */
  least = 0.4;
  most = 1;
  /** Pixels that are drawn for one of the screen, along a side. */
  share = 1;
  /** Of a picture that rests: below 1 where a whole one would take too long. */
  rest_share = 1;
  private slow_ = 0;
  private quick_ = 0;
  private skipped_ = 2; // pictures that do not count: what came before is in their time

  /** A picture came `wait` [ms] after it was wanted and the one before was begun, or without a pause between them. */
  note(wait: number): void {
    if (this.skipped_ > 0) {
      --this.skipped_;
      return;
    }
    this.slow_ = wait > slow ? this.slow_ + 1 : 0;
    this.quick_ = wait < quick ? this.quick_ + 1 : Math.max(0, this.quick_ - 2);
    if (this.slow_ >= (wait > very_slow ? 2 : patience_slow)) this.change(Math.max(0.35, Math.sqrt(slow / wait)));
    else if (this.quick_ >= patience_quick) this.change(1.15);
  }

  /** A whole picture was drawn in `took` [ms]. */
  note_rest(took: number): void {
    this.skipped_ = 2;
    if (took > 1200) this.rest_share = Math.max(this.least, 0.7 * this.rest_share);
  }

  private change(by: number): void {
    this.share = Math.min(this.most, Math.max(this.least, this.share * by));
    this.slow_ = this.quick_ = 0;
    this.skipped_ = 2;
  }
}
