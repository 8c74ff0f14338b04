// Colour maps, and the range of numbers that they show.
import { nice_ceiling } from './format';

export type Rgb = [number, number, number]; // 0 .. 255, sRGB

function anchors(hex: string): Rgb[] {
  return hex.split(' ').map((one) => [0, 2, 4].map((at) => parseInt(one.slice(at, at + 2), 16)) as Rgb);
}

/** Of a body that nothing colours. */
export const tissue = 0xab5b4a;

/** Of a body that numbers colour, where they are far below the range: it stands out from a dark and from a light ground. */
export const tint: Rgb = [0x8a, 0x6e, 0x66];
const tinted = 0.28; // share of the range in which the tint fades

/**
 * matplotlib's viridis, cividis and inferno from where they are as light as the tint, each at equal distances: lightness grows all the way, for
 * all eyes. The diverging map grows lighter to both sides.
 */
const maps = {
  viridis: anchors('26818e 20938c 22a785 3aba76 60ca60 93d741 cae11f fde725'),
  cividis: anchors('757575 828079 918b78 9f9775 aea371 bfb06b cfbd62 dfca57 f0d846 fee838'),
  inferno: anchors('e05536 eb6628 f57b17 fa9008 fca80d fac026 f5d949 f1ef75 fcffa4'),
  grey: anchors('747474 868686 989898 ababab bebebe d1d1d1 e5e5e5 f9f9f9'),
  diverging: anchors('b5defe 93c8f7 74b0e8 5d97d0 5b84ae 6f7a8c 8a6e66 987452 b27c3f d08a2c ea9d32 fab658 ffd38f'),
};
export type MapName = keyof typeof maps;
export const sequential_maps = ['viridis', 'cividis', 'inferno', 'grey'] as const;
export type SequentialMap = (typeof sequential_maps)[number];

const mixed = (a: Rgb, b: Rgb, share: number): Rgb => a.map((channel, i) => Math.round(channel + share * (b[i]! - channel))) as Rgb;

/** The colour at `share` (0 .. 1) of a map; where it begins, the body's tint. */
export function map_colour(name: MapName, share: number): Rgb {
  const colours = maps[name];
  const at = Math.max(0, Math.min(1, share));
  const place = at * (colours.length - 1);
  const below = Math.min(colours.length - 2, Math.floor(place));
  const colour = mixed(colours[below]!, colours[below + 1]!, place - below);
  if (name === 'diverging' || at >= tinted) return colour;
  const rise = at / tinted;
  const part = rise * rise * (3 - 2 * rise);
  return with_luminance(luminance(tint) + rise * (luminance(colour) - luminance(tint)), mixed(tint, colour, part));
}

const to_linear = (channel: number): number => (channel <= 10 ? channel / 255 / 12.92 : ((channel / 255 + 0.055) / 1.055) ** 2.4);
const to_srgb = (linear: number): number => Math.round(255 * Math.min(1, linear <= 0.0031308 ? 12.92 * linear : 1.055 * linear ** (1 / 2.4) - 0.055));
const luminance = ([r, g, b]: Rgb): number => 0.2126 * to_linear(r) + 0.7152 * to_linear(g) + 0.0722 * to_linear(b);

/** `colour`, made lighter or darker. */
function with_luminance(wanted: number, colour: Rgb): Rgb {
  const factor = wanted / luminance(colour);
  return colour.map((channel) => to_srgb(factor * to_linear(channel))) as Rgb;
}

/** `width` texels RGBA of a map. */
export function map_texels(name: MapName, width: number): Uint8Array {
  const texels = new Uint8Array(4 * width);
  for (let i = 0; i < width; ++i) texels.set([...map_colour(name, i / (width - 1)), 255], 4 * i);
  return texels;
}

/** Of materials, told apart by all eyes (Okabe and Ito 2008, made as light as the ground allows); further ones begin anew. */
export const material_colours: Rgb[] = anchors('b3694f 3f87b5 c49a2c 3f9a78 9c74b8 c26a35 5a7fd0 8a8a3a');

export const fields = ['none', 'magnitude', 'von-mises', 'pressure', 'x', 'y', 'z', 'material'] as const;
export type Field = (typeof fields)[number];

export interface FieldTraits {
  label: string;
  unit: string;
  is_signed: boolean;
  has_range: boolean; // numbers, with a bar that says what colours mean
  cut: number; // share of the surface whose numbers may be above the range
}

const few = 0.004; // what is under a finger tip
const numbers = { is_signed: false, has_range: true, cut: few };

export const field_traits: Record<Field, FieldTraits> = {
  none: { label: 'Plain', unit: '', ...numbers, has_range: false },
  magnitude: { label: 'Displacement', unit: 'm', ...numbers },
  'von-mises': { label: 'Von Mises stress', unit: 'Pa', ...numbers },
  pressure: { label: 'Contact pressure', unit: 'Pa', ...numbers, cut: 0 },
  x: { label: 'Displacement along x', unit: 'm', ...numbers, is_signed: true },
  y: { label: 'Displacement along y', unit: 'm', ...numbers, is_signed: true },
  z: { label: 'Displacement along z', unit: 'm', ...numbers, is_signed: true },
  material: { label: 'Material', unit: '', ...numbers, has_range: false },
};

/** Of a logarithmic range: how many times the least number goes into the largest. */
export const log_span = 1000;

/** Where a number of a range lies on its bar, 0 .. 1 and beyond. */
export function share_of(value: number, low: number, high: number, is_log: boolean): number {
  if (is_log && low >= 0) return value > 0 && high > 0 ? 1 + Math.log(value / high) / Math.log(log_span) : 0;
  return high > low ? (value - low) / (high - low) : 0;
}

const patience = 1.5; // [s] that numbers are small before the range follows

/** The number where the colours end: grows at once, in round steps, and shrinks only after a while. */
export class Range {
  private high_ = 0;
  private small_since_ = Infinity;

  /** `largest` is in the picture at time `now` [s]. */
  follow(largest: number, now: number): number {
    const wanted = nice_ceiling(largest);
    if (wanted > this.high_ || this.high_ === 0) {
      this.high_ = wanted;
      this.small_since_ = Infinity;
    } else if (largest < 0.45 * this.high_ && largest > 0) {
      this.small_since_ = Math.min(this.small_since_, now);
      if (now - this.small_since_ > patience) {
        this.high_ = wanted;
        this.small_since_ = Infinity;
      }
    } else {
      this.small_since_ = Infinity;
    }
    return this.high_;
  }

  forget(): void {
    this.high_ = 0;
    this.small_since_ = Infinity;
  }
}
