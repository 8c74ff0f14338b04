// The bar beside the picture that says what colours mean.
import { field_traits, map_colour, type Field } from './colours';
import { part, write } from './dom';
import { nice_ticks, short_number, si_prefix } from './format';

/** What a bar shows; null: nothing is coloured. */
export interface Scale {
  title: string;
  ticks: { share: number; text: string }[]; // from the bottom up
  colours: string[]; // from the bottom up, at equal distances
}

export function make_scale(field: Field, low: number, high: number): Scale | null {
  if (field === 'none') return null;
  const traits = field_traits[field];
  const [factor, prefix] = si_prefix(Math.max(Math.abs(low), Math.abs(high)));
  const ticks = nice_ticks(low / factor, high / factor).map((value) => ({
    share: high > low ? (value * factor - low) / (high - low) : 0,
    text: short_number(Math.abs(value) < 1e-9 ? 0 : value),
  }));
  const colours = Array.from({ length: 21 }, (_, i) => `rgb(${map_colour(traits.map, i / 20).join(' ')})`);
  return { title: `${traits.label} [${prefix}${traits.unit}]`, ticks, colours };
}

export class ColourBar {
  scale: Scale | null = null;
  private shown_ = '';

  show(field: Field, low: number, high: number): void {
    const key = `${field} ${low} ${high}`;
    if (key === this.shown_) return;
    this.shown_ = key;
    this.scale = make_scale(field, low, high);
    part('colour-bar').hidden = this.scale === null;
    if (!this.scale) return;
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
