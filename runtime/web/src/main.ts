// The viewer's page: what comes from the run is shown, what the person does is said to it.
import './style.css';
import { Beside, Neighbour, type Shared } from './beside';
import { of_frame, RecentEfforts, sentence } from './best_effort';
import { button, forget_rem, input, part, select, show_value, toast, write } from './dom';
import type { Eye, Margins } from './eye';
import { FileSource, stored_session } from './file_source';
import { format_si, format_time, short_number } from './format';
import { History } from './history';
import { as_hash, keep, keep_theme, kept_of, kept_theme, of_hash, type Kept } from './kept';
import { on_keys } from './keyboard';
import { show_light, turned_beside } from './range_light';
import { LiveSource, socket_url } from './live_source';
import { Gallery, show_way_back } from './gallery';
import { show_felt, show_timing, type Felt } from './numbers';
import { Picture } from './picture';
import { Plots } from './plots';
import { Hand, pointer_modes, type HandSettings, type PointerMode } from './pointer';
import { parse_tool } from './pose';
import { headline, is_news, sentences } from './problem';
import { ReplayBar } from './replay_bar';
import { metres, RunControls, typed_number } from './run_controls';
import { Saving } from './saving';
import type { Listener, Source } from './source';
import { nudge, show_told, told_of } from './states';
import { css_colour, ThemeChoice, themes, type Theme } from './theme';
import { UnderPointer } from './under_pointer';
import { ViewControls } from './view_controls';
import { floats_of_contact, type Frame, type Picture as Message } from './wire';
import type { Mode, Said, State, Word } from './words';

const live_samples = 60_000; // more than ten seconds at the highest rate
const plot_wait = 100; // [ms] between drawings of the plots
const idle_plot_wait = 300; // while nothing is touched: they only move along
const playhead_wait = 40; // and in a recording, where they show what the picture is of
const plot_share = 0.06; // of the time is theirs, where the page is slow
const numbers_wait = 100;
const timing_wait = 1000;
const keep_wait = 500; // [ms] before how a model is looked at is kept
const key_pixels = 8; // that an arrow key moves the tool

/** Whether the tool has taken hold of the body, so that nothing is pressed in. */
function holds(frame: Frame | null): boolean {
  return frame !== null && frame.contact.length > 0 && frame.contact[floats_of_contact - 1]! > 0;
}

class Page implements Listener {
  private mode_: Mode = 'live';
  private state_: State | null = null;
  private history_ = new History(live_samples, false);
  private readonly efforts_ = new RecentEfforts();
  private frames_ = 0;
  private ticks_ = 0;
  private plots_wanted_ = false;
  private plots_took_ = 0; // [ms]
  private lost_ = 'the program'; // why there is no connection; empty: there is one
  private kept_for_ = ''; // the model whose look is shown
  private keep_timer_ = 0;
  private depth_for_ = ''; // the model and tool that the depth suits
  private typed_depth_ = false;

  private readonly theme_ = new ThemeChoice();
  private readonly picture_ = new Picture();
  private readonly saving_ = new Saving(this.picture_, () => this.caption_words());
  private readonly under_pointer_ = new UnderPointer(this.picture_.view, this.picture_.body);
  private readonly plots_: Plots;
  private readonly run_ = new RunControls((word) => this.send(word));
  private readonly replay_ = new ReplayBar((frame) => this.send({ type: 'seek', frame }));
  private readonly drawing_: ViewControls;
  private readonly hand_: Hand;
  private readonly source_: Source;
  private readonly neighbour_ = new Neighbour(
    (shared) => this.take_shared(shared),
    () => {
      this.share_look();
      this.share_picture();
    },
  );

  constructor() {
    const { view } = this.picture_;
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
    this.drawing_ = new ViewControls((drawn) => {
      this.picture_.take(drawn);
      this.want_keep();
      this.share_look();
    });
    this.hand_ = new Hand(
      view,
      this.picture_.body,
      () => this.hand_settings(),
      (word) => this.source_.point(word),
      (depth) => this.show_hand_depth(depth),
      (text) => toast(text, '', 'note'),
    );
    const prepared = view.before_drawing;
    view.before_drawing = () => {
      this.picture_.has_tool = !this.is_hand() || this.hand_.has_moved; // until then it waits far from the body
      prepared();
      if (this.picture_.bar_is_new) this.drawing_.show_range_unit(this.picture_.automatic_range);
    };
    const marked = view.after_drawing;
    view.after_drawing = () => {
      marked();
      setTimeout(() => this.source_.more()); // once the browser has taken the picture
      this.saving_.drawn();
      this.share_picture();
      if (this.mode_ !== 'live') this.want_plots(); // the playhead is where the picture is
    };
    view.margins = () => this.margins();
    const watch = new ResizeObserver(() => view.eye.resize());
    for (const id of ['colour-card', 'materials', 'hand', 'replay']) watch.observe(part(id));
    view.eye.taken = () => this.want_keep();
    this.replay_.sought = (time) => this.neighbour_.say({ about: 'time', time });
    this.listen();
    this.listen_keys();
    show_way_back();
    this.choose_theme(kept_theme() as Theme);
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
    write(badge, is_connected ? (this.mode_ === 'file' ? 'recorded' : 'connected') : 'not connected');
    this.lost_ = is_connected ? '' : note;
    if (!is_connected) this.hand_.release();
    this.show_state();
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
        if (this.state_?.model) this.run_.show(this.state_, this.mode_, this.lost_ === ''); // what was typed is not what is
      } else {
        toast(headline(message), message.hint);
      }
    } else {
      this.take_state({ ...this.state_, ...message } as State);
    }
  }

  pictured(message: Message): boolean {
    if (message.kind === 'scene') {
      this.picture_.take_scene(message);
      if (this.state_?.model) this.show_kept(this.state_.model.file); // the next state may be long in coming
    } else if (message.kind === 'patch') {
      this.picture_.take_patch(message);
    } else if (message.kind === 'frame') {
      ++this.frames_;
      return this.picture_.take_frame(message);
    } else {
      this.ticks_ += message.count;
      this.history_.add(message);
      this.efforts_.take(message, performance.now());
      this.want_plots();
    }
    return false;
  }

  private take_mode(mode: Mode): void {
    if (mode !== this.mode_ || mode !== 'live') this.history_ = new History(live_samples, mode !== 'live');
    this.mode_ = mode;
    document.body.classList.toggle('live', mode === 'live');
    document.body.classList.toggle('served', mode !== 'file');
    document.body.classList.toggle('pane', this.neighbour_.is_there);
    forget_rem();
    if (this.neighbour_.is_there && window.innerHeight <= 480 && !document.body.classList.contains('folded')) this.toggle_panel();
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
    this.picture_.take_model(state.model, state.settings);
    this.under_pointer_.model = state.model;
    const suits = `${state.model.file} ${state.settings.tool}`;
    if (this.depth_for_ !== suits) {
      this.depth_for_ = suits;
      this.typed_depth_ = false;
      show_value(input('depth'), short_number(1000 * this.usual_depth(), 2));
    }
    this.drawing_.show_model(state.model.dimension, state.model.materials?.length ?? 1);
    this.show_kept(state.model.file);
    this.show_state();
    if (this.mode_ !== 'live') this.replay_.show(state.times ?? [], state.frame ?? 0, this.lost_ === '', state.alone === true);
  }

  /** What stands over the picture, and which controls can act. */
  private show_state(): void {
    const state = this.state_;
    show_told(told_of(state, this.mode_, this.lost_));
    if (!state?.model) return;
    this.run_.show(state, this.mode_, this.lost_ === '');
    this.show_light(state);
    part('hand').hidden = !this.is_hand();
    document.body.classList.toggle('lost', this.lost_ !== '');
  }

  private show_light(state: State): void {
    const { body, frame } = this.picture_;
    const is_pressed = frame !== null && frame.contact.length > 0 && !holds(frame);
    // In the plane, and drawn larger than it is, the page does not know better than the run.
    const knows = state.model.dimension === 3 && body.scale === 1;
    show_light(state, knows ? turned_beside(body.rest_normal, body.surface, is_pressed ? frame.tool : null, body.tool_size) : Infinity);
  }

  // --- to the run ---

  private send(word: Word): void {
    this.source_.send(word);
  }

  private is_hand(): boolean {
    const state = this.state_;
    return this.mode_ === 'live' && this.lost_ === '' && state?.you === 'controller' && state.pointer;
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
    if (this.picture_.body.scale !== 1) return 'The body is touched where it is: draw displacements true to scale (× 1)';
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
      floor: this.picture_.floor,
      shape,
    };
  }

  private show_hand_depth(depth: number | null): void {
    if (depth !== null) part('first-hint').hidden = true;
    write(part('depth-now'), depth === null ? '' : `asked ${(1000 * depth).toFixed(2)} mm`);
  }

  private listen(): void {
    input('depth').addEventListener('change', () => {
      input('depth').blur();
      this.typed_depth_ = typed_number(input('depth').value, 0) !== null;
      if (!this.typed_depth_ && this.state_) {
        show_value(input('depth'), short_number(1000 * this.usual_depth(), 2));
      }
    });
    button('screenshot').addEventListener('click', () => {
      void this.saving_.save_picture(`${this.state_?.model?.name ?? 'Palpate'}-${this.felt().tick}`);
    });
    button('fit').addEventListener('click', () => this.look((eye) => eye.fit()));
    button('save-video').addEventListener('click', () => this.film());
    button('follow').addEventListener('click', () => this.follow());
    select('look-from').addEventListener('change', () => {
      const from = select('look-from').value;
      if (from) this.look((eye) => eye.look_from(from));
      select('look-from').value = '';
    });
    select('theme').addEventListener('change', () => this.choose_theme(select('theme').value as Theme));
    this.theme_.changed = () => this.show_theme();
    button('copy-link').addEventListener('click', () => void this.copy_link());
    for (const kind of ['stl', 'vtu']) {
      button(`save-${kind}`).addEventListener('click', () => {
        const link = document.createElement('a');
        link.href = `surface.${kind}${location.search}`;
        link.download = '';
        link.click();
      });
    }
    button('toggle-panel').addEventListener('click', () => this.toggle_panel());
    button('help').addEventListener('click', () => this.show_help(part('help-text').hidden));
    button('help-close').addEventListener('click', () => this.show_help(false));
  }

  private listen_keys(): void {
    const fields = Object.fromEntries([1, 2, 3, 4, 5, 6, 7, 8].map((n) => [String(n), () => this.drawing_.choose(n)]));
    const arrow = (right: number, down: number) => () => {
      if (this.mode_ !== 'live') this.replay_.move(right);
      else if (this.is_hand()) this.hand_.key_move(key_pixels * right, key_pixels * down);
      else this.look((eye) => eye.turn(-0.1 * right, -0.1 * down));
    };
    on_keys({
      ' ': () => (this.mode_ === 'live' ? this.run_.toggle_pause() : this.replay_.toggle()),
      '.': () => (this.mode_ === 'live' ? this.run_.step() : this.replay_.move(1)),
      r: () => this.run_.reset(),
      e: () => this.drawing_.toggle('edges'),
      x: () => this.drawing_.toggle('through'),
      o: () => this.drawing_.toggle('parallel'),
      c: () => this.drawing_.next_section(),
      v: () => this.drawing_.show_menu(part('view-card').hidden),
      f: () => this.look((eye) => eye.fit()),
      t: () => this.look((eye) => eye.look_from('top')),
      b: () => this.look((eye) => eye.look_from('usual')),
      p: () => this.toggle_panel(),
      '+': () => this.look((eye) => eye.zoom(1.15)),
      '-': () => this.look((eye) => eye.zoom(1 / 1.15)),
      '[': () => this.hand_.key_deepen(-1),
      ']': () => this.hand_.key_deepen(1),
      '?': () => this.show_help(part('help-text').hidden),
      Escape: () => this.escape(),
      ArrowLeft: arrow(-1, 0),
      ArrowRight: arrow(1, 0),
      ArrowUp: arrow(0, -1),
      ArrowDown: arrow(0, 1),
      'Shift+ArrowLeft': () => this.look((eye) => eye.turn(0.1, 0)),
      'Shift+ArrowRight': () => this.look((eye) => eye.turn(-0.1, 0)),
      'Shift+ArrowUp': () => this.look((eye) => eye.turn(0, 0.1)),
      'Shift+ArrowDown': () => this.look((eye) => eye.turn(0, -0.1)),
      ...fields,
    });
    const { pad } = this.picture_.view;
    window.addEventListener('pointerdown', () => pad.classList.add('by-pointer'), { capture: true }); // its focus needs no ring
    window.addEventListener('keydown', () => pad.classList.remove('by-pointer'));
    pad.addEventListener('keydown', (event) => {
      if (event.key !== 'Enter') return;
      event.preventDefault();
      this.hand_.key_press();
    });
    window.addEventListener('pointerdown', ({ target }) => target === pad && this.state_?.paused && this.mode_ === 'live' && nudge(), { capture: true });
    pad.addEventListener('blur', () => this.hand_.release_key());
  }

  private escape(): void {
    if (!part('help-text').hidden) this.show_help(false);
    else if (!part('view-card').hidden) this.drawing_.show_menu(false);
    else this.hand_.release();
  }

  private toggle_panel(): void {
    const is_folded = document.body.classList.toggle('folded');
    button('toggle-panel').setAttribute('aria-pressed', String(!is_folded));
    this.want_plots();
  }

  private show_help(on: boolean): void {
    part('help-text').hidden = !on;
    button('help').setAttribute('aria-expanded', String(on));
    (on ? part('help-text') : button('help')).focus();
  }

  // --- beside another page ---

  private share_look(): void {
    if (this.kept_for_ !== '') this.neighbour_.say({ about: 'look', look: this.drawing_.kept, theme: this.theme_.choice });
  }

  /** What a picture has that the one beside it is to have too. */
  private share_picture(): void {
    if (!this.neighbour_.is_there || this.kept_for_ === '') return;
    this.neighbour_.say(this.shared_eye());
    const { own_range: largest, own_force: force, body } = this.picture_;
    this.neighbour_.say({ about: 'range', field: body.field, typed: this.drawing_.typed_range, largest, force });
  }

  private shared_eye(): Shared {
    const { eye } = this.picture_.view;
    const place = eye.place;
    return { about: 'eye', place: eye.is_fitted ? null : place, towards: place.towards };
  }

  private take_shared(shared: Shared): void {
    const { eye } = this.picture_.view;
    if (shared.about === 'look') {
      this.drawing_.kept = shared.look;
      if (shared.theme !== this.theme_.choice) this.choose_theme(shared.theme as Theme);
      this.neighbour_.note({ about: 'look', look: this.drawing_.kept, theme: this.theme_.choice });
    } else if (shared.about === 'eye') {
      if (shared.place) eye.place = shared.place;
      else eye.fit_from(shared.towards);
      this.neighbour_.note(this.shared_eye());
    } else if (shared.about === 'range') {
      this.picture_.range_beside = shared;
      this.picture_.force_beside = shared.force;
      if (shared.field === this.picture_.body.field) this.drawing_.typed_range = shared.typed;
      this.picture_.view.draw();
    } else {
      this.replay_.follow_time(shared.time);
    }
  }

  // --- how it is looked at ---

  private choose_theme(theme: Theme): void {
    const known = themes.includes(theme) ? theme : 'auto';
    select('theme').value = known;
    this.theme_.choose(known);
    keep_theme(known);
    this.show_theme();
    this.share_look();
  }

  private show_theme(): void {
    this.picture_.set_ink(css_colour('ink'), this.theme_.is_light);
    this.want_plots();
    this.show_timing();
  }

  /** What the address says counts before what was kept of this model. */
  private show_kept(model: string): void {
    if (this.kept_for_ === model || this.picture_.body.scene === null) return;
    const kept = (this.kept_for_ === '' ? of_hash(location.hash) : null) ?? kept_of(model);
    this.kept_for_ = model;
    if (kept) {
      this.drawing_.kept = kept.look;
      if (kept.place) this.picture_.view.eye.place = kept.place;
      this.picture_.face_section();
    }
    this.neighbour_.begin();
  }

  private get kept(): Kept {
    const { eye } = this.picture_.view;
    return { look: this.drawing_.kept, place: eye.is_fitted ? null : eye.place };
  }

  /** What a person does to see it from elsewhere. */
  private look(act: (eye: Eye) => void): void {
    act(this.picture_.view.eye);
    this.want_keep();
  }

  private want_keep(): void {
    clearTimeout(this.keep_timer_);
    this.keep_timer_ = window.setTimeout(() => this.kept_for_ && keep(this.kept_for_, this.kept), keep_wait);
  }

  private async copy_link(): Promise<void> {
    const link = `${location.href.replace(/#.*/, '')}#${as_hash(this.kept)}`;
    history.replaceState(null, '', link);
    try {
      await navigator.clipboard.writeText(link);
      toast('The address of this view is copied', '', 'note');
    } catch {
      toast('The address of this view is in the browser’s bar', '', 'note');
    }
  }

  /** What of the stage is covered by controls, from its sides [px]: the body and the arrow of its force are elsewhere. */
  private margins(): Margins {
    const stage = part('stage').getBoundingClientRect();
    const shown = (ids: string[]) => ids.map((id) => part(id)).filter((card) => card.offsetHeight > 0).map((card) => card.getBoundingClientRect());
    const rem = parseFloat(getComputedStyle(document.documentElement).fontSize);
    const is_small = stage.width < 700 || stage.height < 420;
    const above = Math.max(0, ...shown(['colour-card']).map(({ bottom }) => bottom - stage.top));
    const below = Math.max(0, ...shown(['hand', 'replay', 'scale-bar']).map(({ top }) => stage.bottom - top)) || (is_small ? 3.4 : 4.2) * rem;
    const beside = Math.max(0, ...shown(['materials']).map(({ left }) => stage.right - left));
    const bar = part('stage').classList.contains('has-bar') ? 0 : parseFloat(getComputedStyle(part('stage')).getPropertyValue('--bar')) * rem; // room that is kept for the colours' bar, so that the body does not jump with it
    return { top: above + 0.4 * rem, bottom: below + 0.4 * rem, left: (is_small ? 0.5 : 1.5) * rem, right: Math.max(bar, beside) + 0.5 * rem };
  }

  /** Plays all of a recording once, and saves what is seen. */
  private film(): void {
    if (this.saving_.is_filming) {
      this.replay_.halt();
      return;
    }
    this.picture_.view.is_whole = true;
    this.saving_.film(this.state_?.model?.name ?? 'Palpate', () =>
      this.replay_.play_once(() => {
        this.saving_.stop();
        this.picture_.view.is_whole = false;
      }),
    );
  }

  /** Sees again what the page that steers shows. */
  private follow(): void {
    this.replay_.halt();
    this.send({ type: 'follow' });
  }

  // --- drawing ---

  private want_plots(): void {
    if (this.plots_wanted_) return;
    this.plots_wanted_ = true;
    const wait = this.mode_ !== 'live' ? playhead_wait : (this.picture_.frame?.contact.length ?? 0) > 0 ? plot_wait : idle_plot_wait;
    setTimeout(() => {
      requestAnimationFrame(() => {
        this.plots_wanted_ = false;
        const began = performance.now();
        this.plots_.cursor = this.mode_ === 'live' ? null : (this.picture_.frame?.time ?? null);
        this.plots_.draw(this.history_, this.state_?.rate ?? 1000, this.mode_ !== 'live');
        queueMicrotask(() => (this.plots_took_ = performance.now() - began)); // uPlot draws in one of its own, before
      });
    }, Math.max(wait, this.plots_took_ / plot_share));
  }

  private felt(): Felt {
    const { frame } = this.picture_;
    if (!frame) return { force: [0, 0, 0], depth: 0, contacts: 0, tick: 0 };
    const history = this.history_;
    const is_live = this.mode_ === 'live';
    const drawn = frame.contact.length / floats_of_contact;
    const [x, y, z] = frame.force;
    if (history.count === 0) return { force: [x!, y!, z!], depth: holds(frame) ? NaN : 0, contacts: drawn, tick: frame.tick };
    // Live, ticks and pictures come apart: the numbers are those of the last tick that is not newer than the picture.
    const sample = is_live ? Math.max(0, history.from(frame.tick + 1) - 1) : Math.min(history.count - 1, history.from(frame.tick));
    return {
      force: is_live ? [history.value('x', sample), history.value('y', sample), history.value('z', sample)] : [x!, y!, z!],
      depth: holds(frame) ? NaN : history.value('depth', sample),
      contacts: is_live ? drawn : history.value('contacts', sample), // recordings have no contact points, but how many there were
      tick: is_live ? history.tick(sample) : frame.tick,
    };
  }

  private show_numbers(): void {
    part('depth-plot').hidden = part('depth-number').hidden = !this.has_depth();
    show_felt(this.felt());
    const bound = this.picture_.frame?.greens_error ?? 0;
    write(part('greens-error'), bound > 0 ? `± ${format_si(bound, 'N', 2)}` : '');
    const text = this.best_effort();
    write(part('best-effort'), text);
    part('best-effort').hidden = text === '';
  }

  /** A recording does not have it, and a grab has none. */
  private has_depth(): boolean {
    return this.mode_ === 'live' || this.history_.count === 0 || Number.isFinite(this.history_.value('depth', 0));
  }

  /** How far the force may be off: live, of the last moment; of a picture that stands, its own. */
  private best_effort(): string {
    const { frame } = this.picture_;
    if (this.mode_ === 'live' && !this.state_?.paused) return this.efforts_.sentence(performance.now());
    return frame ? sentence([of_frame(frame)]) : '';
  }

  private show_timing(): void {
    this.plots_.draw_timing(this.history_, this.state_?.rate ?? 1000, this.mode_ !== 'live');
    const ticks = this.mode_ === 'live' ? this.state_?.ticks : this.history_.last + 1;
    part('ticks-plot').hidden = this.mode_ !== 'live' && !(this.plots_.timing.compute[1] > 0); // a script's has no times
    show_timing(this.plots_.timing, this.state_?.misses ?? 0, ticks ?? 0);
  }

  private caption_words(): { title: string; lines: string[] } {
    const felt = this.felt();
    const scale = this.picture_.body.scale;
    const lines = [
      `force ${format_si(Math.hypot(...felt.force), 'N')}  (${felt.force.map((one) => format_si(one, 'N')).join(', ')})`,
      this.has_depth() && Number.isFinite(felt.depth) ? `depth ${format_si(felt.depth, 'm')}  contacts ${felt.contacts}` : `contacts ${felt.contacts}`,
      `tick ${felt.tick}  time ${format_time(this.picture_.frame?.time ?? 0)}`,
    ];
    if (this.best_effort() !== '') lines.push(this.best_effort());
    if (scale !== 1) lines.push(`displacements × ${short_number(scale, 2)}`);
    return { title: this.state_?.model?.name ?? 'Palpate', lines };
  }

  /** What browser tests read: `window.palpate`. */
  private offer_to_tests(): void {
    const page = this;
    const offered = {
      get state() {
        return structuredClone(page.state_);
      },
      get lastFrame() {
        const frame = page.picture_.frame;
        return frame ? { ...page.felt(), tool: [...frame.tool], device: [...frame.device] } : null;
      },
      get picture() {
        return { ...page.picture_.view.drawing };
      },
      /** Around the body in the window, and the ends of the whole force's arrow [px]. */
      get seen() {
        const { body, arrow, view } = page.picture_;
        const { position } = body.surface;
        const places = Array.from({ length: position.length / 3 }, (_, i) => view.eye.project(position[3 * i]!, position[3 * i + 1]!, position[3 * i + 2]!));
        const [x, y] = [places.map((place) => place.x), places.map((place) => place.y)];
        return {
          body: { left: Math.min(...x), right: Math.max(...x), top: Math.min(...y), bottom: Math.max(...y) },
          arrow: arrow?.map((place) => view.eye.project(...place.toArray())) ?? null,
        };
      },
      get underPointer() {
        return page.under_pointer_.text;
      },
      get eye() {
        return page.picture_.view.eye.place;
      },
      get playhead() {
        return page.plots_.cursor; // [s], where plots have it
      },
      get time() {
        return page.picture_.frame?.time ?? null; // [s], of the picture
      },
      get frames() {
        return page.frames_;
      },
      get ticks() {
        return page.ticks_;
      },
      get ready() {
        return page.state_?.model !== undefined && page.picture_.frame !== null;
      },
      project: (x: number, y: number, z: number) => page.picture_.view.eye.project(x, y, z),
    };
    Object.defineProperty(window, 'palpate', { value: Object.freeze(offered), writable: false });
  }
}

if (/\/beside$/.test(location.pathname)) new Beside();
else if (/\/gallery$/.test(location.pathname)) new Gallery();
else new Page();
