// The samples of the loop that are kept for the plots.
import { is_marked } from './best_effort';
import type { Ticks } from './wire';

const columns = ['x', 'y', 'z', 'norm', 'shown', 'depth', 'late', 'compute', 'contacts', 'best_effort'] as const;
export type Column = (typeof columns)[number];

/** The last samples, oldest first: times [s], forces [N], depth [m], lateness and compute time [us]; 1 where the force is a best effort. */
export class History {
  private capacity_: number;
  private begin_ = 0; // where the oldest is
  private count_ = 0;
  private tick_: Float64Array;
  private values_: Record<Column, Float32Array>;

  /** Keeps `capacity` samples, or all where `grows`. */
  constructor(
    capacity: number,
    private readonly grows_: boolean,
  ) {
    this.capacity_ = capacity;
    this.tick_ = new Float64Array(capacity);
    this.values_ = Object.fromEntries(columns.map((name) => [name, new Float32Array(capacity)])) as Record<Column, Float32Array>;
  }

  get count(): number {
    return this.count_;
  }
  /** The number of the newest tick, -1 where there is none. */
  get last(): number {
    return this.count_ > 0 ? this.tick(this.count_ - 1) : -1;
  }
  tick(i: number): number {
    return this.tick_[(this.begin_ + i) % this.capacity_]!;
  }
  value(column: Column, i: number): number {
    return this.values_[column][(this.begin_ + i) % this.capacity_]!;
  }

  /** Of a run that began anew what was is before its first tick; a recording that is another one forgets it. */
  add(ticks: Ticks): void {
    if (ticks.first <= this.last) {
      if (this.grows_) this.clear();
      else this.shift(ticks.first - 1 - this.last);
    }
    if (this.grows_) this.reserve(this.count_ + ticks.count);
    const v = this.values_;
    for (let i = Math.max(0, ticks.count - this.capacity_); i < ticks.count; ++i) {
      if (this.count_ === this.capacity_) this.begin_ = (this.begin_ + 1) % this.capacity_;
      else ++this.count_;
      const at = (this.begin_ + this.count_ - 1) % this.capacity_;
      const [x, y, z] = [ticks.force[3 * i]!, ticks.force[3 * i + 1]!, ticks.force[3 * i + 2]!];
      this.tick_[at] = ticks.first + i * ticks.stride;
      v.x[at] = x;
      v.y[at] = y;
      v.z[at] = z;
      v.norm[at] = Math.hypot(x, y, z);
      v.shown[at] = ticks.shown[i]!;
      v.depth[at] = ticks.depth[i]!;
      v.late[at] = ticks.late_us[i]!;
      v.compute[at] = ticks.compute_us[i]!;
      v.contacts[at] = ticks.contacts[i]!;
      v.best_effort[at] = is_marked(ticks, i) ? 1 : 0;
    }
  }

  private clear(): void {
    this.begin_ = 0;
    this.count_ = 0;
  }

  private shift(ticks: number): void {
    for (let i = 0; i < this.count_; ++i) this.tick_[(this.begin_ + i) % this.capacity_]! += ticks;
  }

  /** The first sample whose tick is not before `tick`. */
  from(tick: number): number {
    let low = 0;
    let high = this.count_;
    while (low < high) {
      const middle = (low + high) >> 1;
      if (this.tick(middle) < tick) low = middle + 1;
      else high = middle;
    }
    return low;
  }

  /**
   * Ticks and columns between two ticks for a plot `pixels` wide: of each pixel's samples the least and the largest. A gap in
   * the ticks that is longer than a pixel and five samples is one of nulls.
   */
  decimate(from: number, to: number, pixels: number, wanted: Column[]): (number | null)[][] {
    const first = Math.max(0, this.from(from) - 1);
    const last = Math.min(this.count_, this.from(to) + 1);
    const bucket = Math.max(1, Math.ceil((last - first) / Math.max(1, pixels)));
    const ticks: number[] = [];
    const rows: (number | null)[][] = wanted.map(() => []);
    const stride = last - first > 1 ? (this.tick(last - 1) - this.tick(first)) / (last - first - 1) : 1;
    for (let begin = first; begin < last; begin += bucket) {
      const end = Math.min(last, begin + bucket);
      if (begin > first && this.tick(begin) - this.tick(begin - 1) > Math.max(5 * stride, 5)) {
        ticks.push(this.tick(begin - 1) + 1e-3);
        rows.forEach((row) => row.push(null));
      }
      ticks.push(this.tick(begin));
      if (bucket > 1) ticks.push(this.tick(end - 1));
      wanted.forEach((column, k) => {
        let low = Infinity;
        let high = -Infinity;
        for (let i = begin; i < end; ++i) {
          const value = this.value(column, i);
          if (value < low) low = value;
          if (value > high) high = value;
        }
        rows[k]!.push(low);
        if (bucket > 1) rows[k]!.push(high);
      });
    }
    return [ticks, ...rows];
  }

  /** The column between two ticks, ascending. */
  sorted(column: Column, from: number, to: number): Float32Array {
    const first = this.from(from);
    const last = this.from(to);
    const values = new Float32Array(Math.max(0, last - first));
    for (let i = first; i < last; ++i) values[i - first] = this.value(column, i);
    return values.sort();
  }

  private reserve(wanted: number): void {
    if (wanted <= this.capacity_) return;
    const larger = Math.max(wanted, 2 * this.capacity_);
    const tick = new Float64Array(larger);
    tick.set(this.tick_);
    this.tick_ = tick;
    for (const name of columns) {
      const values = new Float32Array(larger);
      values.set(this.values_[name]);
      this.values_[name] = values;
    }
    this.capacity_ = larger;
  }
}

/** How many of ascending values [us] there are in each class: below 1 us, then `per_decade` classes a decade up to 10 ms, then above. */
export function log_classes(values: Float32Array, per_decade: number): Uint32Array {
  const classes = new Uint32Array(4 * per_decade + 2);
  for (const value of values) {
    const place = value < 1 ? 0 : 1 + Math.floor(Math.log10(value) * per_decade + 1e-6);
    classes[Math.min(place, classes.length - 1)]! += 1;
  }
  return classes;
}

/** Of ascending values: that below which the share `q` of them lies. */
export function quantile(values: Float32Array, q: number): number {
  return values.length > 0 ? values[Math.min(values.length - 1, Math.floor(q * values.length))]! : NaN;
}
