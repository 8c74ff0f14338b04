// Light or dark: what the person chose, else what the system has. Colours of the page stand in style.css; pictures ask here.

export const themes = ['auto', 'dark', 'light'] as const;
export type Theme = (typeof themes)[number];

const prefers_light = matchMedia('(prefers-color-scheme: light)');
const colours = new Map<string, string>(); // of the theme as it is: plots ask for some twenty each time

export class ThemeChoice {
  private choice_: Theme = 'auto';
  /** Colours are others now. */
  changed: () => void = () => undefined;

  constructor() {
    prefers_light.addEventListener('change', () => this.apply());
    this.apply();
  }

  get choice(): Theme {
    return this.choice_;
  }
  get is_light(): boolean {
    return this.choice_ === 'auto' ? prefers_light.matches : this.choice_ === 'light';
  }

  choose(theme: Theme): void {
    this.choice_ = theme;
    this.apply();
  }

  private apply(): void {
    document.documentElement.dataset.theme = this.is_light ? 'light' : 'dark';
    colours.clear();
    this.changed();
  }
}

/** The colour that a custom property of style.css has now. */
export function css_colour(name: string): string {
  let colour = colours.get(name);
  if (colour === undefined) colours.set(name, (colour = getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim()));
  return colour;
}
