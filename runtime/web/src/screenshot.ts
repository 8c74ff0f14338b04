// A picture of the view with its colour bar and numbers, as PNG.
import type { Scale } from './colour_bar';

/** What is written into the picture beside the body. */
export interface Caption {
  title: string;
  lines: string[];
  scale: Scale | null;
}

export function compose(view: HTMLCanvasElement, caption: Caption): Promise<Blob> {
  const canvas = document.createElement('canvas');
  canvas.width = view.width;
  canvas.height = view.height;
  const context = canvas.getContext('2d')!;
  const unit = view.width / Math.max(1, view.clientWidth);
  context.fillStyle = '#0e1319';
  context.fillRect(0, 0, canvas.width, canvas.height);
  context.drawImage(view, 0, 0);
  context.scale(unit, unit);
  const [width, height] = [canvas.width / unit, canvas.height / unit];

  context.textBaseline = 'top';
  context.fillStyle = '#f2f5f9';
  context.font = '600 16px system-ui, sans-serif';
  context.fillText(caption.title, 16, 14);
  context.font = '13px ui-monospace, monospace';
  context.fillStyle = '#c3cedb';
  caption.lines.forEach((line, i) => context.fillText(line, 16, 40 + 18 * i));

  const { scale } = caption;
  if (scale) {
    const [bar_height, x] = [Math.min(240, height - 120), width - 74];
    const y = (height - bar_height) / 2;
    const gradient = context.createLinearGradient(0, y + bar_height, 0, y);
    scale.colours.forEach((colour, i) => gradient.addColorStop(i / (scale.colours.length - 1), colour));
    context.fillStyle = gradient;
    context.fillRect(x, y, 14, bar_height);
    if (scale.is_cut) {
      context.fillStyle = scale.colours.at(-1)!;
      context.beginPath();
      context.moveTo(x, y - 2);
      context.lineTo(x + 14, y - 2);
      context.lineTo(x + 7, y - 10);
      context.fill();
    }
    context.fillStyle = '#c3cedb';
    context.font = '12px system-ui, sans-serif';
    context.textAlign = 'right';
    context.fillText(scale.title, width - 12, y - 48);
    context.fillText(scale.largest, width - 12, y - 30);
    context.textAlign = 'left';
    context.textBaseline = 'middle';
    for (const { share, text } of scale.ticks) context.fillText(text, x + 20, y + bar_height * (1 - share));
  }
  return new Promise((done, fail) => canvas.toBlob((blob) => (blob ? done(blob) : fail(new Error('the browser gave no picture'))), 'image/png'));
}
