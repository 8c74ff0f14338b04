// How the body is drawn, as the person wants it.
import { field_traits, fields, sequential_maps, type Field, type SequentialMap } from './colours';
import { button, input, part, select, write } from './dom';
import { format_number, short_number, si_prefix } from './format';
import { uprights, type Upright } from './outlook';
import { section_axes, type SectionAxis } from './section';

const most_scaled = 20;

/** How many times as large displacements are drawn where the slider is at 0 .. 100: logarithmic, 1 in the middle, 0 at its end. */
export function scale_of(slider: number): number {
  if (slider <= 0) return 0;
  if (Math.abs(slider - 50) < 1.5) return 1;
  return most_scaled ** ((slider - 50) / 50);
}

const toggles = ['edges', 'outline', 'held', 'tool', 'arrows', 'grid', 'through', 'log', 'largest', 'isolines', 'parallel', 'section-flip'] as const;
type Toggle = (typeof toggles)[number];

export interface Drawn {
  field: Field;
  range: number | null; // the person's own; null: as it comes
  scale: number;
  map: SequentialMap;
  up: Upright;
  section: SectionAxis;
  section_at: number; // 0 .. 1 through the body
  section_flip: boolean;
  edges: boolean;
  outline: boolean;
  held: boolean;
  tool: boolean;
  arrows: boolean;
  grid: boolean;
  through: boolean;
  log: boolean;
  largest: boolean; // the range ends there
  isolines: boolean;
  parallel: boolean;
}

/** What is kept of it, by the names of the controls. */
export type KeptLook = Record<string, string>;

const choices = { field: fields, map: sequential_maps, up: uprights, section: section_axes } as const;

export class ViewControls {
  private range_: number | null = null;
  private factor_: [number, string] = [1, ''];
  private has_materials_ = false;

  constructor(private readonly changed_: (drawn: Drawn) => void) {
    select('field').addEventListener('change', () => this.set_field(select('field').value as Field));
    input('range').addEventListener('change', () => this.take_range());
    for (const name of ['map', 'up', 'section']) select(name).addEventListener('change', () => this.tell());
    for (const name of ['scale', 'section-at']) input(name).addEventListener('input', () => this.tell());
    input('scale').addEventListener('dblclick', () => {
      input('scale').value = '50';
      this.tell();
    });
    for (const name of toggles) input(`show-${name}`).addEventListener('change', () => this.tell());
    button('view-menu').addEventListener('click', () => this.show_menu(part('view-card').hidden));
  }

  get drawn(): Drawn {
    const on = (name: Toggle) => input(`show-${name}`).checked;
    return {
      field: select('field').value as Field,
      range: this.range_,
      scale: scale_of(Number(input('scale').value)),
      map: select('map').value as SequentialMap,
      up: select('up').value as Upright,
      section: select('section').value as SectionAxis,
      section_at: Number(input('section-at').value) / 100,
      section_flip: on('section-flip'),
      edges: on('edges'),
      outline: on('outline'),
      held: on('held'),
      tool: on('tool'),
      arrows: on('arrows'),
      grid: on('grid'),
      through: on('through'),
      log: on('log'),
      largest: on('largest'),
      isolines: on('isolines'),
      parallel: on('parallel'),
    };
  }

  show_menu(on: boolean): void {
    part('view-card').hidden = !on;
    button('view-menu').setAttribute('aria-expanded', String(on));
  }

  set_field(field: Field): void {
    select('field').value = field;
    this.range_ = null;
    input('range').value = '';
    this.tell();
  }

  /** In the plane nothing moves along z, and nothing is cut open; a body of one material is not coloured by it. */
  show_model(dimension: 2 | 3, materials: number): void {
    const offer = (field: Field, on: boolean) => {
      const option = [...select('field').options].find((one) => one.value === field)!;
      option.hidden = option.disabled = !on;
      if (!on && select('field').value === field) this.set_field('none');
    };
    offer('z', dimension === 3);
    this.has_materials_ = materials > 1;
    offer('material', this.has_materials_);
    part('space-only').hidden = dimension === 2;
  }

  /** By its number from 1 on. */
  choose(number: number): void {
    const field = fields[number - 1];
    if (field && ![...select('field').options].find((option) => option.value === field)?.disabled) this.set_field(field);
  }

  toggle(name: Toggle): void {
    input(`show-${name}`).checked = !input(`show-${name}`).checked;
    this.tell();
  }

  /** The next axis that the body is cut open across, then none. */
  next_section(): void {
    const at = section_axes.indexOf(select('section').value as SectionAxis);
    select('section').value = section_axes[(at + 1) % section_axes.length]!;
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

  get kept(): KeptLook {
    const look: KeptLook = { scale: input('scale').value, 'section-at': input('section-at').value };
    for (const name of Object.keys(choices)) look[name] = select(name).value;
    for (const name of toggles) look[name] = input(`show-${name}`).checked ? '1' : '0';
    return look;
  }
  /** What is not known, or cannot be here, stays as it is. */
  set kept(look: KeptLook) {
    for (const [name, allowed] of Object.entries(choices)) {
      const value = look[name];
      if (value !== undefined && (allowed as readonly string[]).includes(value)) select(name).value = value;
    }
    if (select('field').value === 'material' && !this.has_materials_) select('field').value = 'none';
    for (const name of ['scale', 'section-at']) if (look[name] !== undefined && Number.isFinite(Number(look[name]))) input(name).value = look[name]!;
    for (const name of toggles) if (look[name] !== undefined) input(`show-${name}`).checked = look[name] === '1';
    this.tell();
  }

  tell(): void {
    const drawn = this.drawn;
    part('range-label').hidden = !field_traits[drawn.field].has_range;
    input('section-at').disabled = input('show-section-flip').disabled = drawn.section === 'off';
    write(part('scale-value'), `× ${short_number(drawn.scale, 2)}`);
    const note = part('scaled-note');
    note.hidden = drawn.scale === 1;
    write(note, `Displacements × ${short_number(drawn.scale, 2)}: to touch the body, draw it true to scale (× 1)`);
    this.changed_(drawn);
  }

  /** As it was typed; null: as it comes. */
  get typed_range(): number | null {
    return this.range_;
  }
  set typed_range(range: number | null) {
    if (range === this.range_) return;
    this.range_ = range;
    input('range').value = range === null ? '' : short_number(range / this.factor_[0]);
    this.tell();
  }

  private take_range(): void {
    const text = input('range').value.trim();
    const typed = Number(text.replace(',', '.'));
    if (text !== '' && !(typed > 0)) {
      input('range').value = this.range_ === null ? '' : short_number(this.range_ / this.factor_[0]);
      return;
    }
    this.range_ = text !== '' ? typed * this.factor_[0] : null;
    this.tell();
  }
}
