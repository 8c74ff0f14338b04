// Pictures and videos of the view, as files.
import { material_colours } from './colours';
import { button, save, select, toast } from './dom';
import type { Picture } from './picture';
import { as_png, compose_onto, type Caption, type Ground, type Inks } from './screenshot';
import { css_colour } from './theme';

const on_paper: Inks = { ground: '#ffffff', lit: '#ffffff', ink: '#17202b', dim: '#4c5a6b', axes: { x: '#c02531', y: '#1f7a33', z: '#1f5fc4' } };
const video_rate = 30; // pictures a second
const video_bits = 8_000_000; // a second
const last_held = 500; // [ms]

function inks_of(ground: Ground): Inks {
  if (ground === 'white') return on_paper;
  const seen = {
    ground: css_colour('ground'),
    lit: css_colour('ground-lit'),
    ink: css_colour('ink'),
    dim: css_colour('dim'),
    axes: { x: css_colour('x'), y: css_colour('y'), z: css_colour('z') },
  };
  return ground === 'clear' ? { ...on_paper, ground: '' } : seen;
}

/** What the caption says besides what the picture knows itself. */
export type Words = () => { title: string; lines: string[] };

export class Saving {
  private recorder_: MediaRecorder | null = null;
  private readonly canvas_ = document.createElement('canvas');

  constructor(
    private readonly picture_: Picture,
    private readonly words_: Words,
  ) {}

  get is_filming(): boolean {
    return this.recorder_ !== null;
  }

  async save_picture(name: string): Promise<void> {
    try {
      const { canvas: view, shrink } = this.picture_.view.take_picture(Number(select('picture-size').value));
      const canvas = document.createElement('canvas');
      compose_onto(canvas, view, shrink, this.picture_.view.extent.width, this.caption(), inks_of(select('picture-ground').value as Ground));
      save(await as_png(canvas), `${name}.png`);
    } catch (error) {
      toast('The picture could not be saved', String(error));
    }
  }

  /** Films all that is drawn once it has `begun`, until `stop`. */
  film(name: string, begun: () => void): void {
    // VP8 first: a browser without a graphics card keeps more pictures of it.
    const kind = ['video/webm;codecs=vp8', 'video/webm;codecs=vp9', 'video/webm'].find((one) => globalThis.MediaRecorder?.isTypeSupported(one));
    if (!kind) {
      toast('This browser cannot record videos', 'Firefox and Chromium can');
      return;
    }
    this.compose();
    const recorder = new MediaRecorder(this.canvas_.captureStream(video_rate), { mimeType: kind, videoBitsPerSecond: video_bits });
    const parts: Blob[] = [];
    recorder.ondataavailable = ({ data }) => parts.push(data);
    recorder.onstop = () => save(new Blob(parts, { type: 'video/webm' }), `${name}.webm`);
    recorder.onstart = begun;
    recorder.start(1000);
    this.recorder_ = recorder;
    button('save-video').setAttribute('aria-pressed', 'true');
  }

  /** Holds the last picture for a moment, as what is drawn just before the end is not in the file. */
  stop(): void {
    const recorder = this.recorder_;
    this.drawn();
    setTimeout(() => recorder?.stop(), last_held);
    this.recorder_ = null;
    button('save-video').setAttribute('aria-pressed', 'false');
  }

  /** After each picture. */
  drawn(): void {
    if (this.recorder_) this.compose();
  }

  /** As it is seen; all pictures of a video have one size, that of the first. */
  private compose(): void {
    const { view } = this.picture_;
    compose_onto(this.canvas_, view.canvas, 1, view.extent.width, this.caption(), inks_of('seen'));
  }

  private caption(): Caption {
    const { bar, marks } = this.picture_;
    const materials = bar.materials.map((name, k) => ({ name, colour: `rgb(${material_colours[k % material_colours.length]!.join(' ')})` }));
    return { ...this.words_(), scale: bar.scale, materials, bar: marks.bar, arms: marks.arms };
  }
}
