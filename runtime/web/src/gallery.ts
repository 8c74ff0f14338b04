// All that is in a folder: what is chosen is opened by a runtime of its own, whose page takes the place of this one.
import { by_id, element } from './dom';
import { Drawing } from './drawing';
import { format_bytes } from './format';
import { kept_theme } from './kept';
import { gallery_of, is_token, page_of, type Place } from './place';
import { SmallPictures } from './small_picture';
import { ThemeChoice, themes, type Theme } from './theme';
import { decode } from './wire';
import { NodeValues } from './values';

const look_wait = 250; // [ms] between looks at how far what is opened is
const list_wait = 3000; // and at the folder

type Kind = 'body' | 'recording' | 'source';

interface Item {
  name: string;
  kind: Kind;
  bytes: number;
  modified: number; // [s] since 1970
}

interface Opened {
  name: string;
  said: string[];
  page: Place | null; // not yet
  ended: boolean;
}

const kinds: Record<Kind, { title: string; does: string }> = {
  body: { title: 'Bodies', does: 'push it' },
  recording: { title: 'Recordings', does: 'look through it' },
  source: { title: 'To make a body of', does: 'make a body of it and push it' },
};

const endings = /\.(palpate\.hdf|mcap|stl|obj|ply|off|inr|inr\.gz|nii|nii\.gz|nrrd|png|pbm)$/i;

/** The token of this page's address, which the tab keeps: the way back from what is opened has none. */
function own_token(): string {
  const given = new URLSearchParams(location.search).get('token');
  try {
    if (is_token(given)) sessionStorage.setItem('token', given);
    return given ?? sessionStorage.getItem('token') ?? '';
  } catch {
    return given ?? ''; // this browser keeps nothing
  }
}

/** This server's, with the token. */
const address = (path: string, name = '') => `./${path}?token=${encodeURIComponent(own_token())}${name && `&name=${encodeURIComponent(name)}`}`;

async function ask(path: string, options: RequestInit = {}, name = ''): Promise<Response> {
  const response = await fetch(address(path, name), options);
  if (!response.ok) throw new Error((await response.text()).trim());
  return response;
}

export class Gallery {
  private readonly items_ = element('div', '', { className: 'items' });
  private readonly note_ = element('p', '', { className: 'note' });
  private readonly opening_ = element('dialog', '', { className: 'opening card' });
  private readonly pictures_ = new Map<string, string>(); // of files as they were, by name and time
  private shown_ = ''; // the list
  private look_timer_ = 0;

  constructor() {
    const theme = new ThemeChoice();
    const kept = kept_theme() as Theme;
    theme.choose(themes.includes(kept) ? kept : 'auto');
    theme.changed = () => {
      this.pictures_.clear();
      this.shown_ = '';
    };
    const name = document.querySelector('.bar .name svg')!.cloneNode(true);
    const file = element('input', '', { type: 'file', multiple: true, hidden: true });
    file.dataset.testid = 'add';
    file.onchange = () => void this.take([...(file.files ?? [])]);
    const add = element('button', 'Add a file', { title: 'A surface, a labelled image, a body or a recording is put into the folder and opened' });
    add.onclick = () => file.click();
    const drawing = new Drawing((picture) => void this.take([picture]));
    const pen = element('button', 'Draw a body', { title: 'What you draw falls, and you push and dent it' });
    pen.dataset.testid = 'draw';
    pen.onclick = () => drawing.open();
    const bar = element('header', '', { className: 'bar' });
    const title = element('div', '', { className: 'name' });
    title.append(name, element('strong', 'Palpate'), this.note_);
    bar.append(title, pen, add, file);
    const main = element('main', '', { className: 'gallery' });
    main.append(this.items_);
    this.items_.dataset.testid = 'items';
    this.note_.dataset.testid = 'folder';
    this.opening_.dataset.testid = 'opening';
    document.body.className = 'gallery';
    document.body.replaceChildren(bar, main, this.opening_, drawing.dialog);
    this.listen_drops();
    void this.go_on(theme);
  }

  private async go_on(theme: ThemeChoice): Promise<void> {
    for (;;) {
      try {
        if (!document.hidden) await this.list(theme);
      } catch (error) {
        this.note_.textContent = error instanceof TypeError ? 'the program has ended' : String((error as Error).message);
      }
      await new Promise((resolve) => setTimeout(resolve, list_wait));
    }
  }

  private async list(theme: ThemeChoice): Promise<void> {
    const text = await (await ask('items')).text();
    if (text === this.shown_) return;
    this.shown_ = text;
    const { folder, items } = JSON.parse(text) as { folder: string; items: Item[] };
    const name = folder.split('/').pop() ?? folder;
    document.title = `Palpate – ${name}`;
    this.note_.textContent = name;
    this.note_.title = folder;
    this.items_.replaceChildren(...(Object.keys(kinds) as Kind[]).flatMap((kind) => this.group(kind, items.filter((item) => item.kind === kind))));
    if (items.length === 0) this.items_.append(this.nothing());
    await this.draw(items, theme.is_light);
  }

  private nothing(): HTMLElement {
    return element('p', 'There is nothing here yet. Drop a surface (.stl, .obj, .ply, .off), a labelled image (.nrrd, .nii, .inr), a picture of a body in the plane (.png, .pbm) or a baked body (.palpate.hdf) on this page.', { className: 'nothing' });
  }

  private group(kind: Kind, items: Item[]): HTMLElement[] {
    if (items.length === 0) return [];
    const list = element('ul');
    for (const item of items) {
      const card = element('button', '', { className: 'item', title: `${item.name}: ${kinds[kind].does}` });
      card.dataset.name = item.name;
      card.dataset.testid = 'item';
      const picture = element('span', '', { className: 'picture' });
      const known = this.pictures_.get(`${item.name} ${item.modified}`);
      if (known) this.put(picture, known);
      else if (kind === 'source') picture.append(element('span', item.name.replace(/^.*\.(?=[^.]+(\.gz)?$)/, ''), { className: 'ending' }));
      const day = new Date(1000 * item.modified).toLocaleDateString(undefined, { dateStyle: 'medium' });
      card.append(picture, element('strong', item.name.replace(/\.palpate\.hdf$|\.mcap$/, '')), element('small', `${format_bytes(item.bytes)} · ${day}`));
      card.onclick = () => void this.open(item.name);
      const one = element('li');
      one.append(card);
      list.append(one);
    }
    return [element('h2', kinds[kind].title), list];
  }

  private put(place: HTMLElement, url: string): void {
    place.replaceChildren(element('img', '', { src: url, alt: '' }));
  }

  /** One after the other, as each takes the server's time and the processor's. */
  private async draw(items: Item[], is_light: boolean): Promise<void> {
    const wanted = items.filter((item) => item.kind !== 'source' && !this.pictures_.has(`${item.name} ${item.modified}`));
    if (wanted.length === 0) return;
    const drawer = new SmallPictures(document.body, is_light);
    for (const item of wanted) {
      const place = this.items_.querySelector<HTMLElement>(`[data-name="${CSS.escape(item.name)}"] .picture`);
      try {
        const bytes = await (await ask('scene', {}, item.name)).arrayBuffer();
        const scene = decode(bytes, null, new NodeValues());
        if (scene?.kind !== 'scene') throw new Error('there is no picture');
        const url = drawer.draw(scene);
        this.pictures_.set(`${item.name} ${item.modified}`, url);
        if (place) this.put(place, url);
      } catch (error) {
        place?.replaceChildren(element('small', (error as Error).message.split('\n')[0]!.replace(/^error: (.*\/)?/, ''), { className: 'problem' }));
      }
    }
    drawer.dispose();
  }

  private async open(name: string): Promise<void> {
    this.show_opening({ name, said: [], page: null, ended: false });
    try {
      await ask('open', { method: 'POST' }, name);
      await this.look();
    } catch (error) {
      this.show_opening({ name, said: [(error as Error).message], page: null, ended: true });
    }
  }

  /** Until it is shown, or has ended without. */
  private async look(): Promise<void> {
    const opened = (await (await ask('opened')).json()) as Opened | null;
    if (!opened || !this.opening_.open) return;
    if (opened.page && !opened.ended) {
      location.assign(page_of(opened.page, location));
      return;
    }
    this.show_opening(opened);
    if (!opened.ended) this.look_timer_ = window.setTimeout(() => void this.look(), look_wait);
  }

  private show_opening({ name, said, ended }: Opened): void {
    const dialog = this.opening_;
    const close = element('button', ended ? 'Close' : 'Cancel');
    close.dataset.testid = 'close';
    close.onclick = () => dialog.close();
    dialog.onclose = () => {
      clearTimeout(this.look_timer_);
      if (!ended) void ask('close', { method: 'POST' });
    };
    dialog.replaceChildren(element('h2', ended ? `${name} cannot be shown` : `Opening ${name}`), element('pre', said.join('\n')), close);
    dialog.setAttribute('aria-label', `Opening ${name}`);
    if (!dialog.open) dialog.showModal();
  }

  private listen_drops(): void {
    const mark = (on: boolean) => document.body.classList.toggle('dropping', on);
    window.addEventListener('dragover', (event) => {
      event.preventDefault();
      mark(true);
    });
    window.addEventListener('dragleave', (event) => event.relatedTarget === null && mark(false));
    window.addEventListener('drop', (event) => {
      event.preventDefault();
      mark(false);
      void this.take([...(event.dataTransfer?.files ?? [])]);
    });
  }

  /** Puts files into the folder; a single one is opened. */
  private async take(files: File[]): Promise<void> {
    for (const file of files) {
      this.show_opening({ name: file.name, said: ['It is being copied into the folder.'], page: null, ended: false });
      try {
        if (!endings.test(file.name)) throw new Error('This is no body (.palpate.hdf), recording (.mcap), surface (.stl, .obj, .ply, .off), labelled image (.nrrd, .nii, .inr) or picture (.png, .pbm).');
        const { name } = (await (await ask('drop', { method: 'POST', body: file }, file.name)).json()) as { name: string };
        if (files.length === 1) await this.open(name);
      } catch (error) {
        this.show_opening({ name: file.name, said: [(error as Error).message], page: null, ended: true });
        return;
      }
    }
    if (files.length > 1) this.opening_.close();
  }
}

/** Where a page was opened from a gallery, the way back is shown. */
export function show_way_back(): void {
  const gallery = gallery_of(location);
  const link = by_id('to-gallery', HTMLAnchorElement);
  link.hidden = gallery === null;
  if (gallery) link.href = gallery;
}
