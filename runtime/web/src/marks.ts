// What stands beside the body in the picture: the axes, a bar of known length, and how long arrows are.
import { Quaternion, Vector3 } from 'three';
import { part, rem, set_style, write } from './dom';
import type { Eye } from './eye';
import { format_si, round_below, short_number } from './format';

const axes = ['x', 'y', 'z'] as const;
const arm = 26; // pixels
const bar_most = 120; // pixels

/** Length in the unit that people use for it: "20 mm", "0.5 m". */
export const format_length = (metres: number): string => (metres < 0.5 ? `${short_number(1000 * metres)} mm` : `${short_number(metres)} m`);

export interface ScaleBar {
  pixels: number;
  text: string;
}

/** One end of an axis in the picture, from the middle of the axes [pixels]; `deep` is how much it points away. */
export interface Arm {
  name: string;
  x: number;
  y: number;
  deep: number;
}

export class Marks {
  bar: ScaleBar = { pixels: 0, text: '' };
  arms: Arm[] = [];

  private readonly turned_ = new Quaternion(0, 0, 0, 0); // the camera that the axes are of

  constructor(private readonly eye_: Eye) {}

  /** As the camera is now; the legend of the arrows, whose force is 0 where there are none. */
  show(legend: { force: number; pixels: number }): void {
    const pixel = this.eye_.metres_of_pixel();
    const length = round_below(bar_most * rem() * pixel);
    this.bar = { pixels: length / pixel, text: format_length(length) };
    write(part('scale-bar-text'), this.bar.text);
    set_style(part('scale-bar-line'), 'width', `${this.bar.pixels.toFixed(1)}px`);
    part('arrow-legend').hidden = !(legend.force > 0);
    if (legend.force > 0) {
      write(part('arrow-legend-text'), format_si(legend.force, 'N', 2));
      set_style(part('arrow-legend-line'), 'width', `${legend.pixels.toFixed(1)}px`);
    }
    this.show_axes();
  }

  private show_axes(): void {
    if (this.turned_.equals(this.eye_.camera.quaternion)) return;
    this.turned_.copy(this.eye_.camera.quaternion);
    const turn = this.eye_.camera.quaternion.clone().invert();
    this.arms = axes
      .map((name, axis) => {
        const way = new Vector3().setComponent(axis, 1).applyQuaternion(turn);
        return { name, x: arm * way.x, y: -arm * way.y, deep: -way.z };
      })
      .sort((a, b) => b.deep - a.deep);
    for (const { name, x, y, deep } of this.arms) {
      const group = document.getElementById(`axis-${name}`)!;
      group.querySelector('line')!.setAttribute('x2', x.toFixed(1));
      group.querySelector('line')!.setAttribute('y2', y.toFixed(1));
      group.querySelector('text')!.setAttribute('x', (1.42 * x).toFixed(1));
      group.querySelector('text')!.setAttribute('y', (1.42 * y + 4).toFixed(1));
      group.style.visibility = this.eye_.is_flat && name === 'z' ? 'hidden' : ''; // it points at who looks
      group.style.opacity = deep > 0.6 ? '0.55' : '1';
    }
  }
}
