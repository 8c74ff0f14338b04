// How the body is drawn, as the person wants it.
import { field_traits, fields, type Field } from './colours';
import { button, input, part, select, write } from './dom';
import { format_number, short_number, si_prefix } from './format';

const most_scaled = 20;

/** How many times as large displacements are drawn where the slider is at 0 .. 100: logarithmic, 1 in the middle, 0 at its end. */
export function scale_of(slider: number): number {
  if (slider <= 0) return 0;
  if (Math.abs(slider - 50) < 1.5) return 1;
  return most_scaled ** ((slider - 50) / 50);
}

export interface Drawn {
  field: Field;
  range: number | null; // the person's own; null: as it comes
  scale: number;
  edges: boolean;
  outline: boolean;
  held: boolean;
  tool: boolean;
  arrows: boolean;
  grid: boolean;
}

const toggles = ['edges', 'outline', 'held', 'tool', 'arrows', 'grid'] as const;

export class ViewControls {
  private range_: number | null = null;

  constructor(
    private readonly changed_: (drawn: Drawn) => void,
    on_fit: () => void,
  ) {
    select('field').addEventListener('change', () => this.set_field(select('field').value as Field));
    input('range').addEventListener('change', () => this.take_range());
    input('scale').addEventListener('input', () => this.tell());
    input('scale').addEventListener('dblclick', () => {
      input('scale').value = '50';
      this.tell();
    });
    for (const name of toggles) input(`show-${name}`).addEventListener('change', () => this.tell());
    button('fit').addEventListener('click', on_fit);
  }

  get drawn(): Drawn {
    const on = Object.fromEntries(toggles.map((name) => [name, input(`show-${name}`).checked])) as Record<(typeof toggles)[number], boolean>;
    return { field: select('field').value as Field, range: this.range_, scale: scale_of(Number(input('scale').value)), ...on };
  }

  set_field(field: Field): void {
    select('field').value = field;
    this.range_ = null;
    input('range').value = '';
    this.tell();
  }

  /** In the plane nothing moves along z. */
  show_dimension(dimension: 2 | 3): void {
    const along_z = [...select('field').options].find((option) => option.value === 'z')!;
    along_z.hidden = along_z.disabled = dimension === 2;
    if (dimension === 2 && select('field').value === 'z') this.set_field('magnitude');
  }

  /** By its number from 1 on. */
  choose(number: number): void {
    const field = fields[number - 1];
    if (field && ![...select('field').options].find((option) => option.value === field)?.disabled) this.set_field(field);
  }

  toggle(name: (typeof toggles)[number]): void {
    input(`show-${name}`).checked = !input(`show-${name}`).checked;
    this.tell();
  }

  /** The unit that the range is typed in follows what is shown. */
  show_range_unit(high: number): void {
    const unit = field_traits[select('field').value as Field].unit;
    if (this.range_ === null) {
      this.factor_ = si_prefix(high);
      write(part('range-unit'), `${this.factor_[1]}${unit}`);
      const placeholder = high > 0 ? format_number(high / this.factor_[0]) : 'auto';
      if (input('range').placeholder !== placeholder) input('range').placeholder = placeholder;
    }
  }
  private factor_: [number, string] = [1, ''];

  tell(): void {
    const drawn = this.drawn;
    part('range-label').hidden = drawn.field === 'none';
    write(part('scale-value'), short_number(drawn.scale, 2));
    const note = part('scaled-note');
    note.hidden = drawn.scale === 1;
    write(note, `Displacements × ${short_number(drawn.scale, 2)}: to touch the body, draw it true to scale (× 1)`);
    this.changed_(drawn);
  }

  private take_range(): void {
    const typed = Number(input('range').value.replace(',', '.'));
    this.range_ = input('range').value.trim() !== '' && typed > 0 ? typed * this.factor_[0] : null;
    if (this.range_ === null) input('range').value = '';
    this.tell();
  }
}
