// Elements of the page.

const found = new Map<string, Element>(); // all are in index.html and stay: they are looked for once

/** The element of index.html with this data-testid, of the kind that is expected. */
export function by_id<E extends HTMLElement>(id: string, kind: new () => E): E {
  const element = found.get(id) ?? document.querySelector(`[data-testid="${id}"]`);
  if (!(element instanceof kind)) throw new Error(`the page has no ${kind.name} named ${id}`);
  found.set(id, element);
  return element;
}

export const button = (id: string) => by_id(id, HTMLButtonElement);
export const input = (id: string) => by_id(id, HTMLInputElement);
export const select = (id: string) => by_id(id, HTMLSelectElement);
export const part = (id: string) => by_id(id, HTMLElement);

/** Sets a text only when it is another: that is cheap, and leaves what is selected alone. */
export function write(element: HTMLElement, text: string): void {
  if (element.textContent !== text) element.textContent = text;
}

const styles = new WeakMap<HTMLElement, string>();

/** Sets an element's own style only when it is another: the browser would lay out again even for the same. */
export function set_style(element: HTMLElement, property: string, value: string): void {
  const wanted = `${property}: ${value}`;
  if (styles.get(element) === wanted) return;
  styles.set(element, wanted);
  element.style.setProperty(property, value);
}

/** Shows what the runtime has, unless somebody is typing there. */
export function show_value(element: HTMLInputElement | HTMLSelectElement, value: string): void {
  if (document.activeElement !== element && element.value !== value) element.value = value;
}

let rem_ = 0;

/** Lengths may have changed. */
export function forget_rem(): void {
  rem_ = 0;
}

/** Lengths in style.css grow with large screens: pixels of what is one at the usual size. Asked for in each picture, it is read once per size of the window. */
export function rem(): number {
  if (rem_ === 0) {
    rem_ = parseFloat(getComputedStyle(document.documentElement).fontSize) / 16;
    addEventListener('resize', forget_rem, { once: true, capture: true });
  }
  return rem_;
}

/** Lets a file be saved. */
export function save(blob: Blob, name: string): void {
  const link = document.createElement('a');
  link.href = URL.createObjectURL(blob);
  link.download = name;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 10_000);
}

/** A sentence that goes away by itself. */
export function toast(message: string, hint = '', kind: 'error' | 'note' = 'error'): void {
  const element = document.createElement('div');
  element.className = `toast ${kind}`;
  element.setAttribute('role', kind === 'error' ? 'alert' : 'status');
  const text = document.createElement('strong');
  text.textContent = message;
  element.append(text);
  if (hint) {
    const line = document.createElement('span');
    line.textContent = hint;
    element.append(line);
  }
  const place = part('toasts');
  for (const old of place.children) if (old.textContent === element.textContent) old.remove();
  place.append(element);
  while (place.children.length > 4) place.firstElementChild?.remove();
  element.addEventListener('click', () => element.remove());
  setTimeout(() => element.remove(), kind === 'error' ? 9000 : 4000);
}

/** A new element with its text and properties. */
export function element<K extends keyof HTMLElementTagNameMap>(kind: K, text = '', values: Partial<HTMLElementTagNameMap[K]> = {}): HTMLElementTagNameMap[K] {
  const made = document.createElement(kind);
  made.textContent = text;
  return Object.assign(made, values);
}
