// Messages of the runtime, written byte by byte after PROTOCOL.md.
/** Writes little endian, padded to 4 bytes before each array. */
export class Writer {
  private bytes_: number[] = [];

  u32(...values: number[]): this {
    return this.put(values, 4, (view, value) => view.setUint32(0, value, true));
  }
  f32(...values: number[]): this {
    return this.put(values, 4, (view, value) => view.setFloat32(0, value, true));
  }
  f64(...values: number[]): this {
    return this.put(values, 8, (view, value) => view.setFloat64(0, value, true));
  }
  u8(...values: number[]): this {
    return this.pad().put(values, 1, (view, value) => view.setUint8(0, value));
  }
  pad(): this {
    while (this.bytes_.length % 4 !== 0) this.bytes_.push(0);
    return this;
  }
  done(): ArrayBuffer {
    return Uint8Array.from(this.bytes_).buffer;
  }

  private put(values: number[], size: number, write: (view: DataView, value: number) => void): this {
    for (const value of values) {
      const buffer = new ArrayBuffer(size);
      write(new DataView(buffer), value);
      this.bytes_.push(...new Uint8Array(buffer));
    }
    return this;
  }
}

/** Bits as PROTOCOL.md has them, written as text: each number from its lowest bit on. */
export class BitText {
  private text_ = '';

  add(number: number, bits: number): this {
    for (let k = 0; k < bits; ++k) this.text_ += Math.floor(number / 2 ** k) % 2;
    return this;
  }
  /** A block of 32 numbers, those that are not given 0. */
  block(parameter: number, ...numbers: number[]): this {
    this.add(parameter, 5);
    for (let k = 0; k < 32; ++k) {
      const number = numbers[k] ?? 0;
      const z = number < 0 ? -2 * number - 1 : 2 * number;
      this.text_ += '1'.repeat(Math.floor(z / 2 ** parameter)) + '0';
      this.add(z, parameter);
    }
    return this;
  }
  zeros(blocks: number): this {
    return this.add(31, 5).add(blocks - 1, 12);
  }
  bytes(): number[] {
    const bytes: number[] = [];
    for (let at = 0; at < this.text_.length; at += 8) bytes.push(parseInt([...this.text_.slice(at, at + 8)].reverse().join(''), 2));
    return bytes;
  }
}

export interface Numbered {
  number: number;
  base: number;
  exponents: [number, number];
  patch?: number;
  patch_nodes?: number;
  bits: BitText;
}

/** A frame with one contact and two pressures. */
export function numbered({ number, base, exponents, patch = 0, patch_nodes = 0, bits }: Numbered): ArrayBuffer {
  return new Writer()
    .u32(3, 7)
    .f64(2 ** 40 + 1, 1.5)
    .u32(number, base)
    .u32(...exponents.map((exponent) => exponent >>> 0))
    .f32(1, 2, 3, 0, 0, 0, 1)
    .f32(4, 5, 6, 0, 0, 1, 0)
    .f32(10, 20, 30, 40, 50, 60)
    .u32(9, 1, patch, patch_nodes, 2)
    .f32(0.75)
    .u32(300)
    .f32(0.125)
    .f32(1, 1, 1, 0, 0, 1, 0, 0, -2, 1)
    .u32(0, 3)
    .f32(1000, 2000)
    .u8(...bits.bytes())
    .done();
}
