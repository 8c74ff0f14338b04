// The run and its settings: what the runtime has is shown, what the person wants is asked for.
import { button, input, part, select, show_value, write } from './dom';
import { format_number } from './format';
import { LiveControls } from './live_controls';
import { parse_tool, tool_text } from './pose';
import { sentences } from './problem';
import type { Mode, State, Word } from './words';

/** A number as typed, with a point or a comma; null where it is none or below `least`. */
export function typed_number(text: string, least: number): number | null {
  const value = Number(text.trim().replace(',', '.'));
  return text.trim() !== '' && Number.isFinite(value) && value >= least ? value : null;
}

/** Metres from typed millimetres, as short as it can be written. */
export const metres = (millimetres: number): number => Number((millimetres / 1000).toPrecision(9));
const millimetres = (value: number): string => String(Number((value * 1000).toPrecision(6)));

// The most that the page offers: with more it would wait for minutes.
const most_rings = 4;
const most_refinement = 6;

/** Who moves the tool, in a few words. */
function role_of(state: State, mode: Mode, is_connected: boolean): string {
  if (!is_connected) return 'last picture';
  if (mode === 'replay') return state.you === 'controller' ? 'recording, you steer' : state.alone ? 'recording, on your own' : 'recording, watching';
  return state.you === 'controller' ? `you steer, by ${state.device}` : 'watching';
}

export class RunControls {
  private state_: State | null = null;
  private readonly live_ = new LiveControls((name, value) => this.change(name, value));

  constructor(private readonly send_: (word: Word) => void) {
    const on = (id: string, word: () => Word) => button(id).addEventListener('click', () => send_(word()));
    on('pause', () => ({ type: 'pause', paused: !this.state_?.paused }));
    on('step', () => ({ type: 'step' }));
    on('reset', () => ({ type: 'reset' }));
    on('record', () => ({ type: 'record', on: !this.state_?.recording }));
    on('control', () => ({ type: 'control', take: this.state_?.you !== 'controller' }));
    on('acknowledge', () => ({ type: 'acknowledge' }));

    select('tool-kind').addEventListener('change', () => this.change_tool());
    input('radius').addEventListener('change', () => this.change_tool());
    input('length').addEventListener('change', () => this.change_tool());
    input('edge').addEventListener('change', () => this.change_tool());
    this.on_number('friction', 'friction', 0);
    this.on_number('load-scale', 'load-scale', -Infinity);
    this.on_number('stiffness-scale', 'stiffness-scale', 1e-9);
    select('contact').addEventListener('change', () => this.change('contact', select('contact').value));
    for (const id of ['overlay', 'overlay-r', 'overlay-rings']) input(id).addEventListener('change', () => this.change_overlay(id));
    input('two-levels').addEventListener('change', () => this.change('depth', !input('two-levels').checked ? 'no' : this.state_?.model.goes_deep ? null : 'yes'));
  }

  toggle_pause(): void {
    if (!button('pause').disabled) button('pause').click();
  }
  step(): void {
    if (!button('step').disabled) button('step').click();
  }
  reset(): void {
    if (!button('reset').disabled) button('reset').click();
  }

  /** What was asked for and not done; empty: nothing. */
  show_refused(text: string): void {
    write(part('refused'), text);
    part('refused').hidden = text === '';
  }

  /** While there is no connection nothing can be changed. */
  show(state: State, mode: Mode, is_connected: boolean): void {
    this.state_ = state;
    const steers = mode === 'live' && state.you === 'controller' && is_connected;
    write(part('model'), state.session ? `${state.model.name}: ${state.session}` : state.model.name);
    document.title = `${state.model.name} – Palpate`;
    part('role').hidden = mode === 'file';
    write(part('role'), role_of(state, mode, is_connected));
    part('watchers').hidden = mode === 'file' || state.watchers < 2;
    write(part('watchers'), `${state.watchers} pages open`);
    part('phase').hidden = mode !== 'live' || !state.phase || state.phase === 'active';
    write(part('phase'), state.phase ?? '');

    this.show_transport(state, steers);
    this.show_settings(state, steers);
    part('fault').hidden = !state.fault;
    write(part('fault-name'), (state.fault?.name ?? '').replaceAll('_', ' '));
    write(part('fault-remedy'), state.fault?.remedy ?? '');
    for (const id of ['save-stl', 'save-vtu', 'control']) button(id).disabled = !is_connected;
    if (is_connected) button('control').disabled = state.you !== 'controller' && state.controlled;
    button('acknowledge').disabled = !steers;
    button('acknowledge').hidden = Boolean(state.hand); // a hand's faults are not a page's to acknowledge
    part('fault-hand').hidden = part('hand-note').hidden = !state.hand;
    part('busy').hidden = !state.busy;
    write(part('busy-text'), state.busy ?? '');
    part('locked').hidden = !state.locked || mode !== 'live';
    write(part('locked'), state.locked ?? '');
    this.show_facts(state);
  }

  private show_transport(state: State, steers: boolean): void {
    for (const id of ['pause', 'reset', 'record']) button(id).disabled = !steers;
    button('step').disabled = !steers || !state.paused;
    button('pause').setAttribute('aria-pressed', String(state.paused));
    write(button('pause'), state.paused ? 'Go on' : 'Pause');
    button('record').setAttribute('aria-pressed', String(Boolean(state.recording)));
    const failed = state.recording && state.recording_failed;
    button('record').classList.toggle('failed', Boolean(failed));
    write(part('record-label'), failed ? 'Recording failed' : state.recording ? state.recording.split('/').at(-1)! : 'Record');
    button('record').title = failed
      ? `${sentences(failed)}\nWhat was kept is in ${state.recording}. Press to go on without.`
      : state.recording
      ? `Finish ${state.recording}`
      : 'Begin anew from the untouched body, and write every tick to a file';
    write(button('control'), state.you === 'controller' ? 'Leave control' : state.controlled ? 'Controlled elsewhere' : 'Take control');
  }

  private show_settings(state: State, steers: boolean): void {
    const { settings, model, defaults } = state;
    (part('settings') as HTMLFieldSetElement).disabled = !steers || Boolean(state.locked) || Boolean(state.busy);
    const kind = (settings.tool ?? 'point').split(':')[0]!;
    const shape = parse_tool(settings.tool);
    show_value(select('tool-kind'), kind);
    part('radius-label').hidden = kind === 'point';
    part('length-label').hidden = kind !== 'capsule';
    part('edge-label').hidden = kind !== 'disc';
    show_value(input('radius'), millimetres(shape.disc_radius || shape.radius || defaults.radius));
    show_value(input('edge'), kind === 'disc' ? millimetres(shape.radius) : '');
    show_value(input('length'), millimetres(shape.length || Number((4 * defaults.radius).toPrecision(3))));
    write(part('tool-note'), state.tool_note);
    part('tool-note').hidden = !state.tool_note;
    show_value(input('friction'), settings.friction ?? '');
    input('friction').placeholder = format_number(defaults.friction, 2);
    show_value(select('contact'), settings.contact ?? 'quasi-static');
    select('contact').disabled = !model.moves;
    select('contact').title = model.moves ? 'Dynamic: the body swings' : 'This model has no dynamics: the body cannot swing';
    this.show_overlay_limits(model.overlay_rings ?? most_rings, model.element);
    if (model.overlay_refinement) {
      const [least, most] = model.overlay_refinement;
      input('overlay-r').min = String(least);
      input('overlay-r').max = String(Math.min(most, most_refinement));
    }
    input('overlay').checked = settings.overlay !== undefined;
    const overlay = /^(?:r=(\d+))?,?(?:rings=(\d+))?/.exec(settings.overlay ?? '');
    if (overlay?.[1]) show_value(input('overlay-r'), overlay[1]);
    if (overlay?.[2]) show_value(input('overlay-rings'), overlay[2]);
    this.show_depth(state);
    this.live_.show(state);
    show_value(input('stiffness-scale'), settings['stiffness-scale'] ?? '1');
    show_value(input('load-scale'), settings['load-scale'] ?? '1');
    input('load-scale').disabled = !model.loads;
    input('load-scale').title = model.loads ? 'Gravity and other loads of the model, times this' : 'This model has no loads';
  }

  /** A body on two levels has no inertia and no patches. */
  private show_depth({ settings, model }: State): void {
    const is_deep = model.deep === true;
    const in_the_way = settings.overlay !== undefined ? 'overlay' : settings.contact === 'dynamic' ? 'dynamic contact' : '';
    const depth = input('two-levels');
    depth.checked = is_deep;
    depth.disabled = !is_deep && in_the_way !== '';
    depth.title = depth.disabled ? `Not with ${in_the_way}: turn that off first` : 'The body turns and bends far, by a coarse body of large strain';
    const is_asked = settings.depth === 'yes';
    input('overlay').title = is_asked ? 'Not with depth' : 'A finer mesh under the tool';
    if (is_deep) select('contact').title = 'With depth the body has no inertia';
    if (!is_asked) return;
    for (const id of ['overlay', 'overlay-r', 'overlay-rings']) input(id).disabled = true;
    part('overlay-note').hidden = true;
  }

  /** No more is offered than the file has layers for. */
  private show_overlay_limits(rings: number, element: string): void {
    const most = Math.min(rings, most_rings);
    for (const id of ['overlay', 'overlay-r', 'overlay-rings']) input(id).disabled = most === 0;
    const field = input('overlay-rings');
    field.max = String(Math.max(most, 1));
    if (most > 0 && Number(field.value) > most) field.value = field.max;
    const of_file = `This file keeps ${rings === 0 ? 'no layers' : `layers for ${rings} ${rings === 1 ? 'ring' : 'rings'}`} below the surface; precomputed with more [storage] layers it would have more`;
    const why = element === 'tet4a' ? 'Elements of tet4a share their stiffness, and overlays replace single ones: they want [mesh] element = "tet10"' : of_file;
    write(part('overlay-note'), `${why}.`);
    part('overlay-note').hidden = most > 0;
    field.title = rings < most_rings ? why : 'How many elements around the tool';
  }

  private show_facts(state: State): void {
    const { model } = state;
    const facts: [string, string][] = [['Model', model.file]];
    if (model.nodes) facts.push(['Mesh', `${model.nodes} nodes, ${model.elements} ${model.element}`]); // a recording does not know
    facts.push(
      ['Surface', `${model.surface_nodes} nodes${model.dofs ? `, ${model.dofs} dofs` : ''}`],
      ['Size', `${format_number(model.size * 1000)} mm`],
      ['Moved by', state.device],
      ['Rate', `${state.rate} ticks per second`],
    );
    const key = JSON.stringify(facts);
    if (part('facts').dataset.shown === key) return;
    part('facts').dataset.shown = key;
    part('facts').replaceChildren(
      ...facts.flatMap(([name, value]) => {
        const term = document.createElement('dt');
        term.textContent = name;
        const what = document.createElement('dd');
        what.textContent = value;
        return [term, what];
      }),
    );
  }

  private change(name: string, value: string | null): void {
    this.show_refused('');
    this.send_({ type: 'change', settings: { [name]: value } });
  }

  /** Empty is the default. */
  private on_number(id: string, name: string, least: number): void {
    const field = input(id);
    field.addEventListener('change', () => {
      const value = typed_number(field.value, least);
      if (value === null && field.value.trim() !== '') {
        const bound = least > 0 ? ' above 0' : least === 0 ? ', 0 or more' : '';
        this.show_refused(`${field.value} is not a number${bound}: nothing was changed`);
        if (this.state_) field.value = this.state_.settings[name] ?? '';
        return;
      }
      this.change(name, value === null ? null : String(value));
      field.blur();
    });
  }

  private change_tool(): void {
    const kind = select('tool-kind').value;
    const defaults = this.state_?.defaults;
    const radius = typed_number(input('radius').value, 1e-9);
    const length = typed_number(input('length').value, 1e-9);
    const edge = typed_number(input('edge').value, 1e-9);
    const has_edge = kind === 'disc' && input('edge').value.trim() !== '';
    if (kind !== 'point' && (radius === null || (kind === 'capsule' && length === null) || (has_edge && edge === null))) {
      this.show_refused('Radius, length and edge are numbers above 0, in millimetres');
      return;
    }
    const text = tool_text(
      kind,
      radius ? metres(radius) : (defaults?.radius ?? 0),
      length ? metres(length) : 0,
      has_edge && edge ? metres(edge) : undefined,
    );
    this.change('tool', text);
    select('tool-kind').blur();
  }

  private change_overlay(id: string): void {
    if (id !== 'overlay') input('overlay').checked = true;
    const [r, rings] = ['overlay-r', 'overlay-rings'].map((one) => {
      const { min, max, value } = input(one);
      return Math.min(Number(max), Math.max(Number(min), Math.round(Number(value)) || Number(min)));
    });
    this.change('overlay', input('overlay').checked ? `r=${r},rings=${rings}` : null);
    if (id !== 'overlay') input(id).blur();
  }
}
