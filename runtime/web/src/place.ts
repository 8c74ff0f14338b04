// Addresses that lead from the gallery to what is opened, and back. They are made here of a checked port and token, and never taken from a text.

/** Where on this page's host another page is, and what opens it. */
export interface Place {
  port: number;
  token: string;
}

export const is_token = (text: unknown): text is string => typeof text === 'string' && /^[0-9a-f]{32}$/.test(text);
const is_port = (port: unknown): port is number => Number.isInteger(port) && Number(port) > 0 && Number(port) < 65536;

/** The page of what is opened, on this page's host. It is told the way back, but not the token of this page: who is sent its address may push that body, and no more. */
export function page_of(place: Place, here: { hostname: string; port: string }): string {
  if (!is_port(place.port) || !is_token(place.token)) throw new Error('the program told no address');
  return `http://${here.hostname}:${place.port}/?token=${place.token}&gallery=${here.port || 80}`;
}

/** The address of the gallery that a page was opened from; nothing where it was opened by itself. */
export function gallery_of({ search, hostname }: { search: string; hostname: string }): string | null {
  const port = Number(new URLSearchParams(search).get('gallery'));
  return is_port(port) ? `http://${hostname}:${port}/gallery` : null;
}
