// Small pictures of bodies, drawn as the large ones are.
import { Body } from './body';
import { Section } from './section';
import { View } from './view';
import type { Scene } from './wire';

const width = 288; // [px]
const height = 192;
const margin = 12;
const fineness = 2; // pixels of the picture for one of the page, along a side

/** Draws one body after the other: a browser has few drawing contexts. */
export class SmallPictures {
  private readonly section_: Section = new Section(() => this.body_.colours);
  private readonly stage_ = document.createElement('div');
  private readonly view_: View;
  private readonly body_: Body;

  constructor(place: HTMLElement, is_light: boolean) {
    this.stage_.className = 'small-stage';
    this.stage_.setAttribute('aria-hidden', 'true');
    Object.assign(this.stage_.style, { width: `${width}px`, height: `${height}px` });
    place.append(this.stage_);
    this.view_ = new View(this.stage_, this.section_);
    this.view_.pad.tabIndex = -1;
    this.view_.margins = () => ({ top: margin, bottom: margin, left: margin, right: margin });
    this.view_.light.uniforms.is_light.value = is_light ? 1 : 0;
    this.body_ = new Body(this.view_.light, this.section_.cut, this.section_.planes);
    this.body_.ink = is_light ? 0x17202b : 0xe6edf5;
    this.view_.scene.add(this.body_.group);
    this.view_.before_drawing = () => {
      this.body_.prepare(fineness, 0, false);
      this.view_.body_box = this.body_.box;
      this.view_.seen_box.copy(this.body_.box);
    };
  }

  /** As the address of a picture. */
  draw(scene: Scene): string {
    this.body_.take_scene(scene);
    this.body_.show_edges(scene.dimension === 2);
    this.body_.show_through(false);
    this.body_.show_range(0, 1, { map: 'viridis', is_log: false, isolines: 0 });
    this.view_.take_body(scene);
    const { canvas, shrink } = this.view_.take_picture(fineness);
    const small = document.createElement('canvas');
    small.width = Math.round(canvas.width / shrink);
    small.height = Math.round(canvas.height / shrink);
    const pen = small.getContext('2d');
    if (!pen) throw new Error('this browser cannot draw');
    pen.imageSmoothingQuality = 'high';
    pen.drawImage(canvas, 0, 0, small.width, small.height);
    return small.toDataURL();
  }

  dispose(): void {
    this.view_.dispose();
    this.stage_.remove();
  }
}
