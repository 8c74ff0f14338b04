// Two runs side by side: a page that has both pages in it, and what these say to each other through it.
import type { Field } from './colours';
import type { Place } from './eye';
import type { KeptLook } from './view_controls';
import type { Vec3 } from './words';

/** What one of the pages has, and the other is to have too. */
export type Shared =
  | { about: 'look'; look: KeptLook; theme: string }
  | { about: 'eye'; place: Place | null; towards: Vec3 } // no place: all of the body, from there
  | { about: 'range'; field: Field; typed: number | null; largest: number; force: number } // each has its own: of colours, and of the longest arrow [N]
  | { about: 'time'; time: number }; // [s], of recordings

const mark = 'palpate beside';

interface Letter {
  mark: typeof mark;
  shared: Shared | null; // null: the page is there and asks what the other one has, or that was all of it
  leads?: boolean; // with the latter: what this page has from the beginning counts for both
}

function letter_of(event: MessageEvent<unknown>): Letter | null {
  const letter = event.data as Partial<Letter> | null;
  return event.origin === location.origin && letter?.mark === mark ? (letter as Letter) : null;
}

/** Whether this page is in one of the same server. */
function has_neighbour(): boolean {
  try {
    return window.parent !== window && window.parent.location.origin === location.origin;
  } catch {
    return false; // it is another's
  }
}

/** The page of one of two runs, as it talks to the other one. Alone it says and hears nothing. */
export class Neighbour {
  readonly is_there = has_neighbour();
  private readonly known_ = new Map<string, string>(); // what both have, and the range that was said
  private has_begun_ = false; // until then the other one's is what counts
  private leads_ = false;

  /** `begun`: the other one's was all heard. */
  constructor(hear: (shared: Shared) => void, begun: () => void) {
    if (!this.is_there) return;
    window.addEventListener('message', (event: MessageEvent<unknown>) => {
      const letter = letter_of(event);
      if (event.source !== window.parent || !letter) return;
      if (!letter.shared) {
        this.has_begun_ = true;
        this.leads_ = letter.leads === true;
        begun();
        return;
      }
      if (letter.shared.about !== 'range') this.known_.set(letter.shared.about, JSON.stringify(letter.shared));
      hear(letter.shared);
    });
  }

  /** The page can hear from now on. */
  begin(): void {
    this.post(null);
  }

  /** Only what the other one does not have. */
  say(shared: Shared): void {
    const text = JSON.stringify(shared);
    if (!this.has_begun_ || this.known_.get(shared.about) === text) return;
    // Both would say what they begin with, and each take the other's.
    const follows = !this.leads_ && !this.known_.has(shared.about) && (shared.about === 'eye' || shared.about === 'look');
    this.known_.set(shared.about, text);
    if (!follows) this.post(shared);
  }

  /** What came of what was heard is what both have: it is not said again. */
  note(shared: Shared): void {
    this.known_.set(shared.about, JSON.stringify(shared));
  }

  private post(shared: Shared | null): void {
    if (this.is_there) window.parent.postMessage({ mark, shared } satisfies Letter, location.origin);
  }
}

/** The page that has both in it, and carries what one says to the other. Both begin with what the first one has. */
export class Beside {
  private readonly panes_: HTMLIFrameElement[];
  private readonly said_ = new Map<string, Shared>(); // last of each, and of both for ranges

  constructor() {
    document.body.className = 'beside';
    this.panes_ = ['./', './2/'].map((path, k) => {
      const pane = document.createElement('iframe');
      pane.title = k === 0 ? 'First' : 'Second';
      pane.dataset.testid = `pane-${k + 1}`;
      pane.src = `${path}${location.search}${location.hash}`;
      return pane;
    });
    document.body.replaceChildren(...this.panes_);
    window.addEventListener('message', (event: MessageEvent<unknown>) => {
      const letter = letter_of(event);
      const from = this.panes_.findIndex((pane) => pane.contentWindow === event.source);
      if (!letter || from < 0) return;
      if (letter.shared) {
        this.said_.set(letter.shared.about === 'range' ? `range of ${from}` : letter.shared.about, letter.shared);
        this.carry(1 - from, letter.shared);
      } else {
        for (const [what, shared] of this.said_) if (what !== `range of ${from}`) this.carry(from, shared);
        this.carry(from, null, from === 0);
      }
    });
  }

  private carry(to: number, shared: Shared | null, leads = false): void {
    this.panes_[to]?.contentWindow?.postMessage({ mark, shared, leads } satisfies Letter, location.origin);
  }
}
