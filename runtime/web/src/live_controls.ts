// The settings of a body that is solved while it is touched: shown for such bodies alone.
import { input, part, select, show_value } from './dom';
import type { State } from './words';

// Its boxes, by the setting's name, with what holds where nothing is set.
const numbers: Record<string, string> = {
  'poissons-ratio': '',
  'live-step': '0.005',
  'mass-damping': '0',
  'stiffness-damping': '0.001',
  yield: 'inf',
  creep: '10',
  'most-plastic': 'inf',
  gravity: '0,0,0',
  'wall-friction': '0.5',
};
const choices: Record<string, string> = { solver: 'corotational', integrator: 'implicit-euler', 'step-solver': 'factor' };

export class LiveControls {
  /** `change` asks for a setting; null is its default. */
  constructor(change: (name: string, value: string | null) => void) {
    for (const name of Object.keys(numbers)) {
      const field = input(name);
      field.addEventListener('change', () => {
        const value = field.value.trim();
        field.blur();
        change(name, value === '' ? null : value);
      });
    }
    for (const name of Object.keys(choices)) select(name).addEventListener('change', () => change(name, select(name).value));
  }

  show({ settings }: State): void {
    part('live-settings').hidden = settings.solver === undefined;
    part('overlay-line').hidden = part('depth-line').hidden = settings.solver !== undefined; // they are of Green's functions
    if (settings.solver === undefined) return;
    part('overlay-note').hidden = true;
    select('contact').disabled = true;
    select('contact').title = 'A body that is solved while it is touched meets the tool with its inertia';
    for (const [name, otherwise] of Object.entries(numbers)) show_value(input(name), settings[name] ?? otherwise);
    for (const [name, otherwise] of Object.entries(choices)) show_value(select(name), settings[name] ?? otherwise);
  }
}
