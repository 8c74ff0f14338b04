// Where messages come from.
import type { Point, Said, Word } from './words';
import type { Picture } from './wire';

export interface Listener {
  said(message: Said): void;
  /** Gives whether a picture is drawn of it. */
  pictured(picture: Picture): boolean;
  /** `note` is empty while all is well. */
  connected(is_connected: boolean, note: string): void;
}

/** A run at the other end of a socket, or a session that stands in the page. */
export interface Source {
  send(word: Word): void;
  /** Where the pointer wants the tool; null: it is no hand any more. */
  point(word: Point | null): void;
  /** A picture was drawn: the source may give the next one. */
  more(): void;
}
