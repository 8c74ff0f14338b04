// The bar beside the picture that says what colours mean.
import { field_traits, map_colour, type Field } from './colours';
import { part, write } from './dom';
import { nice_ticks, short_number, si_prefix } from './format';

/** What a bar shows; null: nothing is coloured. */
export interface Scale {
  title: string;
  largest: string; // in the picture
  is_cut: boolean; // some numbers are beyond the colours
  ticks: { share: number; text: string }[]; // from the bottom up
  colours: string[]; // from the bottom up, at equal distances
}

export function make_scale(field: Field, low: number, high: number, largest: number): Scale | null {
  if (field === 'none') return null;
  const traits = field_traits[field];
  const [factor, prefix] = si_prefix(Math.max(Math.abs(low), Math.abs(high)));
  const ticks = nice_ticks(low / factor, high / factor).map((value) => ({
    share: high > low ? (value * factor - low) / (high - low) : 0,
    text: short_number(Math.abs(value) < 1e-9 ? 0 : value),
  }));
  const colours = Array.from({ length: 21 }, (_, i) => `rgb(${map_colour(traits.map, i / 20).join(' ')})`);
  return {
    title: `${traits.label} [${prefix}${traits.unit}]`,
    largest: `${low < 0 ? 'largest ±' : 'largest '}${short_number(largest / factor)}`,
    is_cut: largest > high * (1 + 1e-6),
    ticks,
    colours,
  };
}

export class ColourBar {
  scale: Scale | null = null;
  private shown_ = '';

  /** `largest` absolute value in the picture, which may be beyond `high`. */
  show(field: Field, low: number, high: number, largest: number): void {
    this.scale = make_scale(field, low, high, largest);
    part('colour-bar').hidden = this.scale === null;
    if (!this.scale) return;
    write(part('colour-largest'), this.scale.largest);
    part('colour-bar').classList.toggle('cut', this.scale.is_cut);
    part('colour-bar').classList.toggle('both', this.scale.is_cut && low < 0);
    const key = `${field} ${low} ${high}`;
    if (key === this.shown_) return;
    this.shown_ = key;
    part('colour-bar').style.setProperty('--top', this.scale.colours.at(-1)!);
    part('colour-bar').style.setProperty('--bottom', this.scale.colours[0]!);
    write(part('colour-title'), this.scale.title);
    part('colour-gradient').style.background = `linear-gradient(to top, ${this.scale.colours.join(', ')})`;
    part('colour-ticks').replaceChildren(
      ...this.scale.ticks.map(({ share, text }) => {
        const tick = document.createElement('span');
        tick.textContent = text;
        tick.style.bottom = `${100 * share}%`;
        return tick;
      }),
    );
  }
}
