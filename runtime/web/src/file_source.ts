// A session that stands in the page itself, as `export --html` wrote it.
import type { Listener, Source } from './source';
import { NodeValues } from './values';
import { decode, split_messages, type Frame, type Patch, type Scene } from './wire';
import type { Said, State, Word } from './words';

interface StoredFrame {
  message: ArrayBuffer;
  time: number;
  base: number; // 0: it is whole
  scene: Scene;
  patch: Patch | null;
}

/** The element that holds a session, if this page has one. */
export function stored_session(page: Document): string | null {
  return page.getElementById('palpate-session')?.textContent?.trim() ?? null;
}

async function inflate(base64: string): Promise<Uint8Array> {
  const packed = Uint8Array.from(atob(base64.replaceAll(/\s/g, '')), (letter) => letter.charCodeAt(0));
  const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream('deflate'));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

export class FileSource implements Source {
  private readonly frames_: StoredFrame[] = [];
  private readonly values_ = new NodeValues();
  private shown_: Frame | null = null;
  private shown_at_ = -1; // in frames_
  private shown_scene_: Scene | null = null;
  private shown_patch_: Patch | null = null;

  constructor(
    base64: string,
    private readonly listener_: Listener,
  ) {
    this.load(base64).catch((error: unknown) => {
      listener_.connected(false, 'the session in this page cannot be read');
      const what = `The session in this page cannot be read: ${String(error)}`;
      listener_.said({ type: 'error', about: 'session', what, where: '', hint: 'Export it again' });
    });
  }

  more(): void {} // it gives what is sought
  point(): void {}

  send(word: Word): void {
    if (word.type === 'seek') this.seek(word.frame);
  }

  private async load(base64: string): Promise<void> {
    const messages = split_messages(await inflate(base64));
    this.listener_.connected(true, '');
    let state: Partial<State> = {};
    let scene: Scene | null = null;
    let patches = new Map<number, Patch>();
    for (const message of messages) {
      if (typeof message === 'string') {
        const said = JSON.parse(message) as Said;
        if (said.type === 'state') state = { ...state, ...said };
        else this.listener_.said(said);
        continue;
      }
      const picture = decode(message, scene);
      if (picture?.kind === 'scene') {
        scene = picture;
        patches = new Map();
        this.show_scene(picture);
      } else if (picture?.kind === 'patch') {
        patches.set(picture.number, picture);
      } else if (picture?.kind === 'frame' && scene) {
        const { time, base } = picture;
        this.frames_.push({ message, time, base, scene, patch: patches.get(picture.patch) ?? null });
      } else if (picture?.kind === 'ticks') {
        this.listener_.pictured(picture);
      }
    }
    const times = this.frames_.map(({ time }) => time);
    this.listener_.said({
      ...state,
      type: 'state',
      frames: times.length,
      times,
      duration: state.duration ?? (times.at(-1) ?? 0) - (times[0] ?? 0),
      pointer: false,
    });
    this.seek(state.frame ?? 0);
  }

  private show_scene(scene: Scene): void {
    if (this.shown_scene_ === scene) return;
    this.shown_scene_ = scene;
    this.shown_patch_ = null;
    this.listener_.pictured(scene);
  }

  private seek(frame: number): void {
    const at = Math.max(0, Math.min(this.frames_.length - 1, Math.round(frame)));
    const stored = this.frames_[at];
    if (!stored) return;
    this.show_scene(stored.scene);
    if (stored.patch && stored.patch !== this.shown_patch_) this.listener_.pictured(stored.patch);
    this.shown_patch_ = stored.patch;
    this.make(at);
    if (this.shown_) this.listener_.pictured(this.shown_);
    this.listener_.said({ type: 'state', frame: at });
  }

  /** From the picture that is shown, or from the last whole one before. */
  private make(at: number): void {
    let from = at;
    while (from > 0 && from !== this.shown_at_ + 1 && this.frames_[from]!.base !== 0) --from;
    if (at === this.shown_at_) return;
    this.shown_at_ = -1;
    for (let k = from; k <= at; ++k) {
      const { message, scene } = this.frames_[k]!;
      this.shown_ = decode(message, scene, this.values_) as Frame;
    }
    this.shown_at_ = at;
  }
}
