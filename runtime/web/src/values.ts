// Whole numbers at the nodes, kept from one picture to the next: a message says what changed (PROTOCOL.md).

const block = 32;
const parameter_bits = 5;
const run_of_zeros = 31;
const run_bits = 12;
const most_shift = 8;
const most_bits = 24;

/** Takes numbers of up to 24 bits, the lowest bit of each byte first. */
class Bits {
  zeros = 0; // blocks that are all zero, still to come
  private at_ = 0;
  private held_ = 0;
  private count_ = 0; // of bits in held_

  constructor(private readonly bytes_: Uint8Array) {}

  take(bits: number): number {
    while (this.count_ < bits) {
      if (this.at_ === this.bytes_.length) throw new RangeError('a picture ends early');
      this.held_ |= this.bytes_[this.at_++]! << this.count_;
      this.count_ += 8;
    }
    const number = this.held_ & ((1 << bits) - 1);
    this.held_ >>>= bits;
    this.count_ -= bits;
    return number;
  }
  /** How many ones come before the next zero, which is taken too. */
  ones(): number {
    for (let ones = 0; ; ) {
      while (this.count_ < 24 && this.at_ < this.bytes_.length) {
        this.held_ |= this.bytes_[this.at_++]! << this.count_;
        this.count_ += 8;
      }
      if (this.count_ === 0) throw new RangeError('a picture ends early');
      const zeros = ~this.held_;
      const here = 31 - Math.clz32(zeros & -zeros); // place of the first zero
      if (here < this.count_) {
        this.held_ >>>= here + 1;
        this.count_ -= here + 1;
        return ones + here;
      }
      ones += this.count_;
      this.held_ = this.count_ = 0;
    }
  }
  at_end(): boolean {
    return this.zeros === 0 && 8 * (this.bytes_.length - this.at_) + this.count_ < 8;
  }
}

/** What a number counts for in a unit that is 2^shift as large. */
function in_other_unit(number: number, shift: number): number {
  return shift <= 0 ? number * (1 << -shift) : (number + (1 << (shift - 1))) >> shift;
}

/**
 * Of each `stride`-th number from `first` on, what it is after the picture. `shift` is from the unit before to that of the picture. Of
 * stresses 0 is no number, and those that are begin at 1. Gives whether any changed.
 */
function take_channel(bits: Bits, out: Int16Array | Uint16Array, first: number, stride: number, shift: number, is_stress: boolean): boolean {
  const is_forgotten = Math.abs(shift) > most_shift;
  let changed = shift !== 0;
  let change = 0;
  for (let k = first; k < out.length; ) {
    let parameter = run_of_zeros;
    if (bits.zeros === 0) {
      parameter = bits.take(parameter_bits);
      if (parameter === run_of_zeros) bits.zeros = bits.take(run_bits) + 1;
      else if (parameter > most_bits) throw new RangeError(`a picture with numbers of ${parameter} bits`);
    }
    if (bits.zeros > 0) {
      --bits.zeros;
      if (change === 0 && shift === 0) {
        k += block * stride;
        continue;
      }
    }
    for (let i = 0; i < block; ++i, k += stride) {
      if (parameter !== run_of_zeros) {
        const z = (bits.ones() << parameter) | bits.take(parameter);
        change += (z >>> 1) ^ -(z & 1);
      }
      if (k >= out.length) continue;
      let known = out[k]!;
      if (is_forgotten) known = 0;
      else if (shift !== 0 && !is_stress) known = in_other_unit(known, shift);
      else if (shift !== 0 && known > 0) known = 1 + in_other_unit(known - 1, shift);
      out[k] = known + change;
      if (change !== 0) changed = true;
    }
  }
  return changed;
}

/** What a picture's message says of its numbers. */
export interface ValuesHead {
  number: number; // of the picture, from 1 on
  base: number; // of the picture from which it follows; 0: from none
  exponent_u: number; // displacements are in 2^this [m]
  exponent_stress: number; // stresses are in 2^this [Pa]
  nodes: number;
  patch: number; // 0: none
  patch_nodes: number;
}

/** The numbers of the last picture that was taken. Its arrays are changed in place by the next. */
export class NodeValues {
  u = new Int16Array(0); // [3 S] in units
  stress = new Uint16Array(0); // [S] 1 + stress in units; 0: not known
  patch_u = new Int16Array(0); // [3 m]
  patch_stress = new Uint16Array(0); // [m]
  /** Goes up whenever a displacement changed. */
  version = 0;

  private number_ = 0;
  private patch_ = 0;
  private exponent_u_ = 0;
  private exponent_stress_ = 0;

  /** Throws RangeError where the picture follows from another one, or is not what PROTOCOL.md says. */
  take(head: ValuesHead, bytes: Uint8Array): void {
    if (head.base !== 0 && (head.base !== this.number_ || this.stress.length !== head.nodes)) {
      throw new RangeError(`picture ${head.number} follows from ${head.base}, not from ${this.number_}`);
    }
    const has_base = head.base !== 0;
    if (!has_base) {
      this.u = new Int16Array(3 * head.nodes);
      this.stress = new Uint16Array(head.nodes);
    }
    const has_patch = has_base && head.patch === this.patch_ && this.patch_stress.length === head.patch_nodes;
    if (!has_patch) {
      this.patch_u = new Int16Array(3 * head.patch_nodes);
      this.patch_stress = new Uint16Array(head.patch_nodes);
    }
    this.number_ = 0; // until all of it is there
    const bits = new Bits(bytes);
    const shift_u = head.exponent_u - this.exponent_u_;
    const shift_stress = head.exponent_stress - this.exponent_stress_;
    let changed = !has_base || !has_patch;
    for (const [u, stress, follows] of [[this.u, this.stress, has_base], [this.patch_u, this.patch_stress, has_patch]] as const) {
      for (let axis = 0; axis < 3; ++axis) {
        if (take_channel(bits, u, axis, 3, follows ? shift_u : 0, false)) changed = true;
      }
      take_channel(bits, stress, 0, 1, follows ? shift_stress : 0, true);
    }
    if (!bits.at_end()) throw new RangeError('a picture is too long');
    if (changed) ++this.version;
    this.number_ = head.number;
    this.patch_ = head.patch;
    this.exponent_u_ = head.exponent_u;
    this.exponent_stress_ = head.exponent_stress;
  }
}
