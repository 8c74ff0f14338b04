// The number of the surface under the pointer, beside it.
import type { Body } from './body';
import { material_name } from './colour_bar';
import { field_traits } from './colours';
import { part, write } from './dom';
import { format_si } from './format';
import { pick_surface } from './pick';
import type { View } from './view';
import type { Model } from './words';

const beside = 16; // pixels

export class UnderPointer {
  model: Model | null = null;
  /** What is said now, empty: nothing. */
  text = '';
  private at_: { x: number; y: number } | null = null;

  constructor(
    private readonly view_: View,
    private readonly body_: Body,
  ) {
    view_.element.addEventListener('pointermove', (event) => {
      this.at_ = event.target === view_.pad && event.pointerType !== 'touch' && event.buttons === 0 ? { x: event.clientX, y: event.clientY } : null;
    });
    view_.element.addEventListener('pointerdown', () => (this.at_ = null), { capture: true }); // the tool is there
    view_.element.addEventListener('pointerleave', () => (this.at_ = null));
    setInterval(() => this.show(), 80);
  }

  private show(): void {
    const text = this.at_ ? this.read(this.at_.x, this.at_.y) : '';
    this.text = text;
    const label = part('under-pointer');
    label.hidden = text === '';
    if (!this.at_ || text === '') return;
    write(label, text);
    const area = this.view_.element.getBoundingClientRect();
    const left = Math.min(this.at_.x - area.left + beside, area.width - label.offsetWidth - 4);
    label.style.left = `${left}px`;
    label.style.top = `${Math.max(2, this.at_.y - area.top - label.offsetHeight - beside / 2)}px`;
  }

  private read(x: number, y: number): string {
    const { field, scene } = this.body_;
    if (field === 'none' || scene?.dimension !== 3) return '';
    const { origin, direction } = this.view_.eye.ray(x, y);
    const hit = pick_surface(this.body_.surface, origin, direction);
    if (!hit) return '';
    const found = this.body_.value_at(hit);
    if (field === 'material') return material_name(this.model?.materials?.[found.material] ?? NaN, found.material);
    return found.is_known ? format_si(found.value, field_traits[field].unit) : 'not known: held';
  }
}
