// The viewer's page: what comes from the run is shown, what the person does is said to it.
import './style.css';
import { Arrows } from './arrows';
import { of_frame, RecentEfforts, sentence } from './best_effort';
import { Body } from './body';
import { ColourBar } from './colour_bar';
import { field_traits, Range } from './colours';
import { button, input, part, save, show_value, toast, write } from './dom';
import { FileSource, stored_session } from './file_source';
import { format_si, format_time, short_number } from './format';
import { History } from './history';
import { on_keys } from './keyboard';
import { LiveSource, socket_url } from './live_source';
import { show_felt, show_timing, type Felt } from './numbers';
import { Plots } from './plots';
import { Hand, pointer_modes, type HandSettings, type PointerMode } from './pointer';
import { parse_tool } from './pose';
import { headline, is_news, sentences } from './problem';
import { ReplayBar } from './replay_bar';
import { metres, RunControls, typed_number } from './run_controls';
import { compose } from './screenshot';
import type { Listener, Source } from './source';
import { ToolView } from './tool';
import { View } from './view';
import { ViewControls, type Drawn } from './view_controls';
import { floats_of_contact, type Frame, type Patch, type Picture } from './wire';
import type { Mode, Said, State, Word } from './words';

const live_samples = 60_000; // more than ten seconds at the highest rate
const plot_wait = 50; // [ms] between drawings of the plots
const numbers_wait = 100;
const timing_wait = 500;
const kept_patches = 4;

class Page implements Listener {
  private mode_: Mode = 'live';
  private state_: State | null = null;
  private history_ = new History(live_samples, false);
  private readonly efforts_ = new RecentEfforts();
  private latest_: Frame | null = null; // not drawn yet
  private readonly patches_ = new Map<number, Patch>();
  private readonly range_ = new Range();
  private frames_ = 0;
  private ticks_ = 0;
  private plots_wanted_ = false;
  private shape_ = ''; // of the tool that is drawn, with the body that it is drawn for
  private depth_for_ = ''; // the model and tool that the depth suits
  private typed_depth_ = false;

  private readonly view_ = new View(part('stage'));
  private readonly body_ = new Body();
  private readonly tool_ = new ToolView();
  private readonly arrows_ = new Arrows();
  private readonly bar_ = new ColourBar();
  private readonly plots_: Plots;
  private readonly run_ = new RunControls((word) => this.send(word));
  private readonly replay_ = new ReplayBar((frame) => this.send({ type: 'seek', frame }));
  private readonly drawing_: ViewControls;
  private readonly hand_: Hand;
  private readonly source_: Source;

  constructor() {
    this.view_.scene.add(this.body_.group, this.tool_.group, this.arrows_.group);
    this.view_.before_drawing = () => this.draw_body();
    this.plots_ = new Plots(
      {
        force: part('plot-force'),
        depth: part('plot-depth'),
        timing: part('plot-timing'),
        force_unit: part('force-unit'),
        depth_unit: part('depth-unit'),
        live: part('plots-live'),
      },
      (time) => this.replay_.seek_time(time),
    );
    this.plots_.changed = () => this.want_plots();
    this.drawing_ = new ViewControls(
      (drawn) => this.take_drawn(drawn),
      () => this.view_.fit(),
    );
    this.hand_ = new Hand(
      this.view_,
      this.body_,
      () => this.hand_settings(),
      (word) => this.send(word),
      (depth) => this.show_hand_depth(depth),
      (text) => toast(text, '', 'note'),
    );
    this.listen();
    this.drawing_.tell();
    setInterval(() => this.show_numbers(), numbers_wait);
    setInterval(() => this.show_timing(), timing_wait);

    const session = stored_session(document);
    if (session !== null) this.take_mode('file');
    this.source_ = session !== null ? new FileSource(session, this) : new LiveSource(socket_url(location), this);
    this.offer_to_tests();
  }

  // --- from the run ---

  connected(is_connected: boolean, note: string): void {
    const badge = part('connection');
    badge.dataset.state = is_connected ? 'live' : 'lost';
    write(badge, is_connected ? (this.mode_ === 'file' ? 'recorded' : 'connected') : note);
    if (!is_connected) this.hand_.release();
  }

  said(message: Said): void {
    if (message.type === 'hello') {
      if (message.protocol !== 2) toast(`This page does not know protocol ${message.protocol}`, 'Load the page anew.');
      this.take_mode(message.mode);
      write(part('version'), message.version);
      part('book').hidden = message.book !== true;
    } else if (message.type === 'error') {
      if (message.about === 'change') {
        this.run_.show_refused(sentences(message));
        if (this.state_?.model) this.run_.show(this.state_, this.mode_); // what was typed is not what is
      } else {
        toast(headline(message), message.hint);
      }
    } else {
      this.take_state({ ...this.state_, ...message } as State);
    }
  }

  pictured(picture: Picture): void {
    if (picture.kind === 'scene') {
      this.patches_.clear();
      this.latest_ = null;
      this.range_.forget();
      this.body_.take_scene(picture);
      this.view_.take_body(picture);
      this.view_.draw();
    } else if (picture.kind === 'patch') {
      if (picture.number !== 0) this.patches_.set(picture.number, picture);
      while (this.patches_.size > kept_patches) this.patches_.delete(this.patches_.keys().next().value!);
    } else if (picture.kind === 'frame') {
      ++this.frames_;
      this.latest_ = picture;
      this.view_.draw();
      if (this.mode_ !== 'live') this.want_plots();
    } else {
      this.ticks_ += picture.count;
      this.history_.add(picture);
      this.efforts_.take(picture, performance.now());
      this.want_plots();
    }
  }

  private take_mode(mode: Mode): void {
    if (mode !== this.mode_ || mode !== 'live') this.history_ = new History(live_samples, mode !== 'live');
    this.mode_ = mode;
    document.body.classList.toggle('live', mode === 'live');
    document.body.classList.toggle('served', mode !== 'file');
  }

  private take_state(state: State): void {
    if (is_news(state.refused, this.state_?.refused)) {
      toast(headline(state.refused), state.refused.hint);
      this.run_.show_refused(sentences(state.refused));
    }
    if (is_news(state.recording_failed, this.state_?.recording_failed)) {
      const { hint } = state.recording_failed;
      toast(`The recording failed, and the run goes on without it: ${headline(state.recording_failed)}`, hint);
    }
    const recorded = this.state_?.recording;
    if (recorded && !state.recording && state.model && !state.refused) toast(`Recorded ${recorded}`, `palpate-runtime view ${recorded}`, 'note');
    this.state_ = state;
    if (!state.model) return;
    const shape = `${state.settings.tool} ${state.model.size} ${state.model.dimension}`;
    if (shape !== this.shape_) {
      this.shape_ = shape;
      this.tool_.take_shape(parse_tool(state.settings.tool), state.model.size, state.model.dimension);
      this.view_.draw();
    }
    const suits = `${state.model.file} ${state.settings.tool}`;
    if (this.depth_for_ !== suits) {
      this.depth_for_ = suits;
      this.typed_depth_ = false;
      show_value(input('depth'), short_number(1000 * this.usual_depth(), 2));
    }
    this.run_.show(state, this.mode_);
    this.drawing_.show_dimension(state.model.dimension);
    part('hand').hidden = !this.is_hand();
    if (this.mode_ !== 'live') this.replay_.show(state.times ?? [], state.frame ?? 0, this.mode_ === 'file' || state.you === 'controller');
  }

  // --- to the run ---

  private send(word: Word): void {
    this.source_.send(word);
  }

  private is_hand(): boolean {
    const state = this.state_;
    return this.mode_ === 'live' && state?.you === 'controller' && state.pointer;
  }

  /** Where a press begins: as the body suggests, but no deeper than the tool is round or a disc is wide. */
  private usual_depth(): number {
    const suggested = this.state_?.defaults.depth ?? 0;
    const { radius, disc_radius } = parse_tool(this.state_?.settings.tool);
    return radius > 0 ? Math.min(Math.max(radius, disc_radius), suggested) : suggested;
  }

  private hand_settings(): HandSettings | string | null {
    const state = this.state_;
    if (!state?.model || !this.is_hand() || state.busy) return null;
    if (this.body_.scale !== 1) return 'The body is touched where it is: draw displacements true to scale (× 1)';
    const shape = parse_tool(state.settings.tool);
    const mode = pointer_modes.find((one) => input(`mode-${one}`).checked) ?? ('press' as PointerMode);
    const typed = this.typed_depth_ ? typed_number(input('depth').value, 0) : null;
    return {
      mode,
      depth: typed === null ? this.usual_depth() : metres(typed),
      share_of_thickness: typed === null ? 0.25 : Infinity,
      unit_depth: this.usual_depth(),
      // A body that swings has moved on since it was drawn.
      clearance: 0.25 * shape.radius + (state.model.moves ? 0.025 : 0.008) * state.model.size,
      contact: 1e-4 * state.model.size,
      shape,
    };
  }

  private show_hand_depth(depth: number | null): void {
    write(part('depth-now'), depth === null ? '' : `${(1000 * depth).toFixed(2)} mm`);
  }

  private listen(): void {
    input('depth').addEventListener('change', () => {
      this.typed_depth_ = typed_number(input('depth').value, 0) !== null;
      if (!this.typed_depth_ && this.state_) {
        show_value(input('depth'), short_number(1000 * this.usual_depth(), 2));
      }
      input('depth').blur();
    });
    button('screenshot').addEventListener('click', () => void this.save_picture());
    for (const kind of ['stl', 'vtu']) {
      button(`save-${kind}`).addEventListener('click', () => {
        const link = document.createElement('a');
        link.href = `surface.${kind}${location.search}`;
        link.download = '';
        link.click();
      });
    }
    const toggle_panel = () => {
      const is_folded = document.body.classList.toggle('folded');
      button('toggle-panel').setAttribute('aria-pressed', String(!is_folded));
      this.want_plots();
    };
    const show_help = (on: boolean) => {
      part('help-text').hidden = !on;
      button('help').setAttribute('aria-expanded', String(on));
      (on ? part('help-text') : button('help')).focus();
    };
    button('toggle-panel').addEventListener('click', toggle_panel);
    button('help').addEventListener('click', () => show_help(part('help-text').hidden));
    button('help-close').addEventListener('click', () => show_help(false));
    const fields = Object.fromEntries([1, 2, 3, 4, 5, 6, 7].map((n) => [String(n), () => this.drawing_.choose(n)]));
    on_keys({
      ' ': () => (this.mode_ === 'live' ? this.run_.toggle_pause() : this.replay_.toggle()),
      '.': () => (this.mode_ === 'live' ? this.run_.step() : this.replay_.move(1)),
      r: () => this.run_.reset(),
      e: () => this.drawing_.toggle('edges'),
      f: () => this.view_.fit(),
      p: toggle_panel,
      '?': () => show_help(part('help-text').hidden),
      Escape: () => part('help-text').hidden || show_help(false),
      ArrowLeft: () => this.replay_.move(-1),
      ArrowRight: () => this.replay_.move(1),
      ...fields,
    });
  }

  // --- drawing ---

  private take_drawn(drawn: Drawn): void {
    const body = this.body_;
    if (body.field !== drawn.field) this.range_.forget();
    body.field = drawn.field;
    body.scale = drawn.scale;
    body.show_edges(drawn.edges || body.scene?.dimension === 2);
    body.show_outline(drawn.outline);
    body.show_held(drawn.held);
    this.view_.show_grid(drawn.grid);
    body.update();
    this.view_.draw();
  }

  private draw_body(): void {
    const frame = this.latest_;
    const drawn = this.drawing_.drawn;
    if (frame) {
      this.latest_ = null;
      this.body_.take_frame(frame, this.patches_.get(frame.patch) ?? null);
    }
    this.body_.show_edges(drawn.edges || this.body_.scene?.dimension === 2);
    const last = this.body_.frame;
    const is_seen = last !== null && drawn.scale === 1; // beside a body that is drawn larger they would be in the wrong place
    if (last) {
      this.tool_.show(last.tool, last.device);
      this.arrows_.show(last, this.state_?.model?.size ?? 1);
    }
    this.tool_.group.visible = is_seen && drawn.tool && (!this.is_hand() || this.hand_.has_moved); // until then it waits far from the body
    this.arrows_.group.visible = is_seen && drawn.arrows;

    const automatic = this.range_.follow(this.body_.shown.usual, performance.now() / 1000);
    const high = drawn.range ?? automatic;
    const low = field_traits[drawn.field].map === 'diverging' ? -high : 0;
    this.body_.show_range(low, high);
    this.bar_.show(drawn.field, low, high, this.body_.shown.largest);
    this.drawing_.show_range_unit(automatic);
  }

  private want_plots(): void {
    if (this.plots_wanted_) return;
    this.plots_wanted_ = true;
    setTimeout(() => {
      requestAnimationFrame(() => {
        this.plots_wanted_ = false;
        this.plots_.cursor = this.mode_ === 'live' ? null : (this.body_.frame?.time ?? null);
        this.plots_.draw(this.history_, this.state_?.rate ?? 1000, this.mode_ !== 'live');
      });
    }, plot_wait);
  }

  private felt(): Felt {
    const frame = this.body_.frame;
    const sample = frame ? Math.max(0, Math.min(this.history_.count - 1, this.history_.from(frame.tick))) : 0;
    return {
      force: frame ? [frame.force[0]!, frame.force[1]!, frame.force[2]!] : [0, 0, 0],
      depth: this.history_.count > 0 ? this.history_.value('depth', sample) : 0,
      contacts: this.felt_contacts(frame, sample),
      tick: frame?.tick ?? 0,
    };
  }

  /** Recordings have no contact points, but how many there were. */
  private felt_contacts(frame: Frame | null, sample: number): number {
    const drawn = frame ? frame.contact.length / floats_of_contact : 0;
    return this.mode_ === 'live' || this.history_.count === 0 ? drawn : this.history_.value('contacts', sample);
  }

  private show_numbers(): void {
    const has_depth = this.mode_ === 'live' || this.history_.count === 0 || Number.isFinite(this.history_.value('depth', 0));
    part('depth-plot').hidden = part('depth-number').hidden = !has_depth; // a recording does not have it
    show_felt(this.felt());
    const bound = this.body_.frame?.greens_error ?? 0;
    write(part('greens-error'), bound > 0 ? `± ${format_si(bound, 'N', 2)}` : '');
    const text = this.best_effort();
    write(part('best-effort'), text);
    part('best-effort').hidden = text === '';
  }

  /** How far the force may be off: live, of the last moment; of a picture that stands, its own. */
  private best_effort(): string {
    const frame = this.body_.frame;
    if (this.mode_ === 'live' && !this.state_?.paused) return this.efforts_.sentence(performance.now());
    return frame ? sentence([of_frame(frame)]) : '';
  }

  private show_timing(): void {
    this.plots_.draw_timing(this.history_, this.state_?.rate ?? 1000, this.mode_ !== 'live');
    const ticks = this.mode_ === 'live' ? this.state_?.ticks : this.history_.last + 1;
    show_timing(this.plots_.timing, this.state_?.misses ?? 0, ticks ?? 0);
  }

  private async save_picture(): Promise<void> {
    const state = this.state_;
    const felt = this.felt();
    const time = this.body_.frame?.time ?? 0;
    const lines = [
      `force ${format_si(Math.hypot(...felt.force), 'N')}  (${felt.force.map((one) => format_si(one, 'N')).join(', ')})`,
      `depth ${format_si(felt.depth, 'm')}  contacts ${felt.contacts}`,
      `tick ${felt.tick}  time ${format_time(time)}`,
    ];
    if (this.best_effort() !== '') lines.push(this.best_effort());
    if (this.body_.scale !== 1) lines.push(`displacements × ${short_number(this.body_.scale, 2)}`);
    try {
      this.draw_body();
      const title = state?.model?.name ?? 'Palpate';
      save(await compose(this.view_.take_picture(), { title, lines, scale: this.bar_.scale }), `${title}-${felt.tick}.png`);
    } catch (error) {
      toast('The picture could not be saved', String(error));
    }
  }

  /** What browser tests read: `window.palpate`. */
  private offer_to_tests(): void {
    const page = this;
    const offered = {
      get state() {
        return structuredClone(page.state_);
      },
      get lastFrame() {
        const frame = page.body_.frame;
        return frame ? { ...page.felt(), tool: [...frame.tool], device: [...frame.device] } : null;
      },
      get frames() {
        return page.frames_;
      },
      get ticks() {
        return page.ticks_;
      },
      get ready() {
        return page.state_?.model !== undefined && page.body_.frame !== null;
      },
      project: (x: number, y: number, z: number) => page.view_.project(x, y, z),
    };
    Object.defineProperty(window, 'palpate', { value: Object.freeze(offered), writable: false });
  }
}

new Page();
