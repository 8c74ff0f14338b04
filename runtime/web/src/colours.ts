// Colour maps, and the range of numbers that they show.
import { nice_ceiling } from './format';

export type Rgb = [number, number, number]; // 0 .. 255, sRGB

// matplotlib's viridis and ColorBrewer's RdBu, each at equal distances.
const viridis = '440154 482475 414487 355f8d 2a788e 21918c 22a884 44bf70 7ad151 bddf26 fde725';
const blue_red = '053061 2166ac 4393c3 92c5de d1e5f0 f7f7f7 fddbc7 f4a582 d6604d b2182b 67001f';

function anchors(hex: string): Rgb[] {
  return hex.split(' ').map((one) => [0, 2, 4].map((at) => parseInt(one.slice(at, at + 2), 16)) as Rgb);
}

const maps = { sequential: anchors(viridis), diverging: anchors(blue_red) };
export type MapName = keyof typeof maps;

/** The colour at `share` (0 .. 1) of a map. */
export function map_colour(name: MapName, share: number): Rgb {
  const colours = maps[name];
  const place = Math.max(0, Math.min(1, share)) * (colours.length - 1);
  const below = Math.min(colours.length - 2, Math.floor(place));
  const a = colours[below]!;
  const b = colours[below + 1]!;
  return a.map((channel, i) => Math.round(channel + (place - below) * (b[i]! - channel))) as Rgb;
}

/** `width` texels RGBA of a map. */
export function map_texels(name: MapName, width: number): Uint8Array {
  const texels = new Uint8Array(4 * width);
  for (let i = 0; i < width; ++i) texels.set([...map_colour(name, i / (width - 1)), 255], 4 * i);
  return texels;
}

export const fields = ['none', 'magnitude', 'von-mises', 'pressure', 'x', 'y', 'z'] as const;
export type Field = (typeof fields)[number];

export interface FieldTraits {
  label: string;
  unit: string;
  map: MapName;
  cut: number; // share of the surface whose numbers may be above the range
}

const few = 0.004; // what is under a finger tip

export const field_traits: Record<Field, FieldTraits> = {
  none: { label: 'Plain', unit: '', map: 'sequential', cut: 0 },
  magnitude: { label: 'Displacement', unit: 'm', map: 'sequential', cut: few },
  'von-mises': { label: 'Von Mises stress', unit: 'Pa', map: 'sequential', cut: few },
  pressure: { label: 'Contact pressure', unit: 'Pa', map: 'sequential', cut: 0 },
  x: { label: 'Displacement along x', unit: 'm', map: 'diverging', cut: few },
  y: { label: 'Displacement along y', unit: 'm', map: 'diverging', cut: few },
  z: { label: 'Displacement along z', unit: 'm', map: 'diverging', cut: few },
};

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
