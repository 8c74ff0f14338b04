// The bar beside the picture that says what colours mean, or the list of materials.
import type { Colouring } from './body';
import { field_traits, map_colour, material_colours, share_of, type Field } from './colours';
import { part, write } from './dom';
import { format_si, nice_ticks, short_number, si_prefix } from './format';

/** What a bar shows; null: nothing is coloured. */
export interface Scale {
  title: string;
  largest: string; // in the picture
  is_cut: boolean; // some numbers are beyond the colours
  ticks: { share: number; text: string }[]; // from the bottom up
  colours: string[]; // from the bottom up, at equal distances
}

export function make_scale(field: Field, low: number, high: number, largest: number, colouring: Colouring): Scale | null {
  const traits = field_traits[field];
  if (!traits.has_range) return null;
  const [factor, prefix] = si_prefix(Math.max(Math.abs(low), Math.abs(high)));
  const is_log = colouring.is_log && low > 0 && high > 0;
  const wanted = is_log ? [0, 1, 2, 3].map((k) => high / factor / 10 ** k) : nice_ticks(low / factor, high / factor);
  const ticks = wanted.map((value) => ({
    share: share_of(value * factor, low, high, is_log),
    text: short_number(Math.abs(value) < 1e-9 ? 0 : value),
  }));
  const map = traits.is_signed ? 'diverging' : colouring.map;
  const colours = Array.from({ length: 33 }, (_, i) => `rgb(${map_colour(map, i / 32).join(' ')})`);
  return {
    title: `${traits.label} [${prefix}${traits.unit}]`,
    largest: `${low < 0 ? 'largest ±' : 'largest '}${short_number(largest / factor)}`,
    is_cut: largest > high * (1 + 1e-6),
    ticks,
    colours,
  };
}

/** Materials have no names: they are told by number and stiffness. */
export const material_name = (modulus: number, number: number): string => `${number + 1}: E = ${format_si(modulus, 'Pa', 2)}`;

export class ColourBar {
  scale: Scale | null = null;
  /** Names of the materials, where the body is coloured by them. */
  materials: string[] = [];
  private shown_ = '';

  /** `largest` absolute value in the picture, which may be beyond `high`; `where` begins the line below the title. */
  show(field: Field, low: number, high: number, largest: number, colouring: Colouring, moduli: number[], where: string): void {
    this.scale = make_scale(field, low, high, largest, colouring);
    this.show_materials(field === 'material' ? moduli.map(material_name) : []);
    part('colour-bar').hidden = this.scale === null;
    part('stage').classList.toggle('has-bar', this.scale !== null); // which has a column of its own: what is pulled or zoomed to there is cut off
    if (!this.scale) return;
    write(part('colour-largest'), where + this.scale.largest);
    part('colour-bar').classList.toggle('cut', this.scale.is_cut);
    part('colour-bar').classList.toggle('both', this.scale.is_cut && low < 0);
    const key = `${field} ${low} ${high} ${colouring.map} ${colouring.is_log}`;
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

  private show_materials(materials: string[]): void {
    this.materials = materials;
    const list = part('materials');
    list.hidden = materials.length === 0;
    const key = materials.join('\n');
    if (list.dataset.shown === key) return;
    list.dataset.shown = key;
    list.replaceChildren(
      ...materials.map((name, k) => {
        const line = document.createElement('li');
        const swatch = document.createElement('i');
        swatch.style.background = `rgb(${material_colours[k % material_colours.length]!.join(' ')})`;
        line.append(swatch, name);
        return line;
      }),
    );
  }
}
