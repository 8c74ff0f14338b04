// How finely pictures are drawn: as finely as the machine keeps up with while they change, and whole once they rest.

const very_slow = 200; // two of them are enough
const quick = 24;
const patience_slow = 3; // pictures
const patience_quick = 45;
const block_share = 0.34; // from here on blocks cost less than smoothness
const first_share = 0.5; // without a graphics card
const first_block_share = 0.2;

export class Pace {
  /** Bounds of `share`. */
  least = 0.4;
  most = 1;
  /** Pixels that are drawn for one of the screen, along a side. */
  share = 1;
  /** Of a picture that rests: below 1 where a whole one would take too long. */
  rest_share = 1;
  /** Shade is kept for some pictures: what goes first, as it is hardly seen. */
  is_thrifty = false;
  /** Drawn pixels become blocks on the screen, which a browser without a graphics card enlarges in half the time; only where `may_be_blocky`. */
  is_blocky = false;
  /** Light is that of the body's nodes, not of each pixel: what goes last. */
  is_rough = false;
  /** [ms] of a picture that is too slow. */
  slow = 40;
  /** The window is so large that enlarging counts. */
  may_be_blocky = false;
  /** There is no graphics card: pictures begin coarse, and do not have to be slow first. */
  begin_coarse(): void {
    this.is_thrifty = true;
    this.is_blocky = this.is_rough = this.may_be_blocky;
    this.share = Math.max(this.least, Math.min(this.share, this.is_blocky ? first_block_share : first_share));
    this.begin();
  }

  private slow_ = 0;
  private quick_ = 0;
  private skipped_ = 2; // pictures that do not count: what came before is in their time

  /** A picture came `wait` [ms] after it was wanted and the one before was begun, or without a pause between them. */
  note(wait: number): void {
    if (this.skipped_ > 0) {
      --this.skipped_;
      return;
    }
    this.slow_ = wait > this.slow ? this.slow_ + 1 : 0;
    this.quick_ = wait < quick ? this.quick_ + 1 : Math.max(0, this.quick_ - 2);
    if (this.slow_ >= (wait > very_slow ? 2 : patience_slow)) this.save(Math.max(0.35, Math.sqrt(this.slow / wait)), wait > very_slow);
    else if (this.quick_ >= patience_quick) this.spend(1.15);
  }

  /** A whole picture was drawn in `took` [ms]. */
  note_rest(took: number): void {
    this.skipped_ = 2;
    if (took > 1200) this.rest_share = Math.max(this.least, 0.7 * this.rest_share);
  }

  /** In this order: shade is kept, pixels are fewer, they are blocks, they are fewer still, light is rough; all but the last at once where pictures are very slow. */
  private save(by: number, at_once: boolean): void {
    if (at_once) {
      this.is_thrifty = true;
      this.is_blocky = this.may_be_blocky;
    }
    const wants_blocks = this.may_be_blocky && !this.is_blocky;
    const least = wants_blocks ? Math.max(this.least, block_share) : this.least;
    if (!this.is_thrifty) this.is_thrifty = true;
    else if (wants_blocks && this.share <= least) this.is_blocky = true;
    else if (this.share <= least) this.is_rough = true;
    else this.share = Math.max(least, this.share * by);
    this.begin();
  }

  /** And back. */
  private spend(by: number): void {
    const is_coarse = this.share < Math.min(this.most, block_share);
    if (this.is_rough) this.is_rough = false;
    else if (this.is_blocky && !is_coarse) this.is_blocky = false;
    else if (this.share < this.most) this.share = Math.min(this.most, this.share * by);
    else this.is_thrifty = false;
    this.begin();
  }

  private begin(): void {
    this.slow_ = this.quick_ = 0;
    this.skipped_ = 2;
  }
}
