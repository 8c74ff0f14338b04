// A picture of the view with its colour bar, scale and numbers, for a file or for each picture of a video.
import type { Scale } from './colour_bar';
import type { Arm, ScaleBar } from './marks';

/** What is written into the picture beside the body. */
export interface Caption {
  title: string;
  lines: string[];
  scale: Scale | null;
  materials: { name: string; colour: string }[];
  bar: ScaleBar;
  arms: Arm[];
}

export const grounds = ['seen', 'white', 'clear'] as const;
export type Ground = (typeof grounds)[number];

/** Colours of a picture: of its ground (empty: none) and of what is written. */
export interface Inks {
  ground: string;
  lit: string; // in the middle of the ground
  ink: string;
  dim: string;
  axes: Record<string, string>;
}

type Context = CanvasRenderingContext2D;

const scale_width = 140; // [px] of a bar with its title

function draw_scale(context: Context, scale: Scale, inks: Inks, width: number, height: number): void {
  const [bar_height, x] = [Math.min(240, height - 150), width - 74];
  const y = (height - bar_height) / 2;
  context.fillStyle = inks.dim;
  context.fillRect(width - scale_width, 0, 0.5, height); // where the picture ends
  const gradient = context.createLinearGradient(0, y + bar_height, 0, y);
  scale.colours.forEach((colour, i) => gradient.addColorStop(i / (scale.colours.length - 1), colour));
  context.fillStyle = gradient;
  context.fillRect(x, y, 14, bar_height);
  context.strokeStyle = inks.dim;
  context.lineWidth = 0.75;
  context.strokeRect(x, y, 14, bar_height);
  if (scale.is_cut) {
    context.fillStyle = scale.colours.at(-1)!;
    context.beginPath();
    context.moveTo(x, y - 2);
    context.lineTo(x + 14, y - 2);
    context.lineTo(x + 7, y - 10);
    context.fill();
  }
  context.fillStyle = inks.ink;
  context.font = '12px system-ui, sans-serif';
  context.textAlign = 'right';
  context.fillText(scale.title, width - 12, y - 48);
  context.fillText(scale.largest, width - 12, y - 30);
  context.textAlign = 'left';
  context.textBaseline = 'middle';
  for (const { share, text } of scale.ticks) {
    const at = y + bar_height * (1 - share);
    context.beginPath();
    context.moveTo(x + 14, at);
    context.lineTo(x + 18, at);
    context.strokeStyle = inks.ink;
    context.stroke();
    context.fillText(text, x + 22, at);
  }
}

function draw_materials(context: Context, materials: Caption['materials'], inks: Inks, width: number, height: number): void {
  context.font = '12px system-ui, sans-serif';
  context.textBaseline = 'middle';
  context.textAlign = 'left';
  const x = width - 26 - Math.max(...materials.map(({ name }) => context.measureText(name).width));
  materials.forEach(({ name, colour }, k) => {
    const y = height / 2 + 20 * (k - materials.length / 2);
    context.fillStyle = colour;
    context.fillRect(x - 18, y - 6, 12, 12);
    context.fillStyle = inks.ink;
    context.fillText(name, x, y);
  });
}

/** The axes in the lower left corner, the bar of known length beside them. */
function draw_marks(context: Context, { bar, arms }: Caption, inks: Inks, height: number): void {
  const [x, y] = [56, height - 56];
  context.textAlign = 'center';
  context.textBaseline = 'middle';
  context.font = '600 13px system-ui, sans-serif';
  context.lineWidth = 3;
  context.lineCap = 'round';
  for (const arm of arms) {
    context.strokeStyle = context.fillStyle = inks.axes[arm.name] ?? inks.ink;
    context.beginPath();
    context.moveTo(x, y);
    context.lineTo(x + arm.x, y + arm.y);
    context.stroke();
    context.fillText(arm.name, x + 1.42 * arm.x, y + 1.42 * arm.y);
  }
  context.strokeStyle = context.fillStyle = inks.ink;
  context.lineWidth = 2;
  context.lineCap = 'butt';
  context.beginPath();
  context.moveTo(x + 61, height - 26);
  context.lineTo(x + 61, height - 20);
  context.lineTo(x + 61 + bar.pixels, height - 20);
  context.lineTo(x + 61 + bar.pixels, height - 26);
  context.stroke();
  context.font = '12px system-ui, sans-serif';
  context.fillText(bar.text, x + 61 + bar.pixels / 2, height - 36);
}

/** Draws it all over a canvas, `shrink` times smaller than `view`, whose page is `page_width` wide. */
export function compose_onto(canvas: HTMLCanvasElement, view: HTMLCanvasElement, shrink: number, page_width: number, caption: Caption, inks: Inks): void {
  const [view_width, view_height] = [Math.round(view.width / shrink), Math.round(view.height / shrink)];
  const unit = view_width / Math.max(1, page_width);
  const wide = view_width + (caption.scale ? Math.round(scale_width * unit) : 0); // the bar beside the picture
  if (canvas.width !== wide || canvas.height !== view_height) Object.assign(canvas, { width: wide, height: view_height });
  const context = canvas.getContext('2d')!;
  context.resetTransform();
  context.clearRect(0, 0, canvas.width, canvas.height);
  if (inks.ground) {
    const [w, h] = [canvas.width, canvas.height];
    const lit = context.createRadialGradient(0.45 * w, 0.38 * h, 0, 0.45 * w, 0.38 * h, 0.8 * Math.hypot(w, h) * 0.7);
    lit.addColorStop(0, inks.lit);
    lit.addColorStop(1, inks.ground);
    context.fillStyle = lit;
    context.fillRect(0, 0, w, h);
  }
  context.imageSmoothingQuality = 'high';
  context.drawImage(view, 0, 0, view_width, view_height);
  context.scale(unit, unit);
  const [width, height] = [canvas.width / unit, canvas.height / unit];
  context.shadowColor = inks.ground || '#ffffff'; // texts can be read over the body
  context.shadowBlur = 5 * unit;
  context.textBaseline = 'top';
  context.textAlign = 'left';
  context.fillStyle = inks.ink;
  context.font = '600 16px system-ui, sans-serif';
  context.fillText(caption.title, 16, 14);
  context.font = '13px ui-monospace, monospace';
  caption.lines.forEach((line, i) => context.fillText(line, 16, 40 + 18 * i));
  if (caption.scale) draw_scale(context, caption.scale, inks, width, height);
  if (caption.materials.length > 0) draw_materials(context, caption.materials, inks, width, height);
  draw_marks(context, caption, inks, height);
}

export function as_png(canvas: HTMLCanvasElement): Promise<Blob> {
  return new Promise((done, fail) => canvas.toBlob((blob) => (blob ? done(blob) : fail(new Error('the browser gave no picture'))), 'image/png'));
}
