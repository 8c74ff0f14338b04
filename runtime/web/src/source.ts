// Where messages come from.
import type { Said, Word } from './words';
import type { Picture } from './wire';

export interface Listener {
  said(message: Said): void;
  pictured(picture: Picture): void;
  /** `note` is empty while all is well. */
  connected(is_connected: boolean, note: string): void;
}

/** A run at the other end of a socket, or a session that stands in the page. */
export interface Source {
  send(word: Word): void;
}
