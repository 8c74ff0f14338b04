// What stands beside the body in the picture: the axes, a bar of known length, and how long arrows are.
import { Vector3 } from 'three';
import { part, rem, write } from './dom';
import type { Eye } from './eye';
import { format_si, short_number } from './format';

const axes = ['x', 'y', 'z'] as const;
const arm = 26; // pixels
const bar_most = 120; // pixels

/** The longest of 1, 2, 5 times a power of ten that is not above `value`. */
export function round_below(value: number): number {
  if (!(value > 0)) return 0;
  const power = 10 ** Math.floor(Math.log10(value));
  return ([5, 2, 1].find((one) => one * power <= value * (1 + 1e-9)) ?? 1) * power;
}

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

  constructor(private readonly eye_: Eye) {}

  /** As the camera is now; the legend of the arrows, whose force is 0 where there are none. */
  show(legend: { force: number; pixels: number }): void {
    const pixel = this.eye_.metres_of_pixel();
    const length = round_below(bar_most * rem() * pixel);
    this.bar = { pixels: length / pixel, text: format_length(length) };
    write(part('scale-bar-text'), this.bar.text);
    part('scale-bar-line').style.width = `${this.bar.pixels.toFixed(1)}px`;
    part('arrow-legend').hidden = !(legend.force > 0);
    if (legend.force > 0) {
      write(part('arrow-legend-text'), format_si(legend.force, 'N', 2));
      part('arrow-legend-line').style.width = `${legend.pixels.toFixed(1)}px`;
    }
    this.show_axes();
  }

  private show_axes(): void {
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
      group.style.opacity = deep > 0.6 ? '0.55' : '1';
    }
  }
}
