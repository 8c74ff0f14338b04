// Force and depth over time, and how long ticks took.
import uPlot from 'uplot';
import 'uplot/dist/uPlot.min.css';
import { rem } from './dom';
import { short_number, si_prefix } from './format';
import { css_colour } from './theme';
import { log_classes, quantile, type Column, type History } from './history';

const shown_seconds = 10;
const ink = () => css_colour('dim');
const grid = () => css_colour('grid');
const font = () => `${Math.round(11 * rem())}px system-ui, sans-serif`;

interface Line {
  column: Column;
  label: string;
  colour: string; // as style.css names it
  width?: number;
  dash?: number[];
}

const force_lines: Line[] = [
  { column: 'norm', label: 'size', colour: 'ink', width: 1.6 },
  { column: 'x', label: 'x', colour: 'x' },
  { column: 'y', label: 'y', colour: 'y', dash: [7, 3] },
  { column: 'z', label: 'z', colour: 'z', dash: [2, 2] },
];
const depth_lines: Line[] = [{ column: 'depth', label: 'depth', colour: 'warm', width: 1.4 }];

/** Seconds that are shown: all plots share them. */
interface Window {
  from: number;
  to: number;
}

/** One plot of columns over time, drawn from what is left of the samples a pixel. */
class TimePlot {
  private readonly plot_: uPlot;
  private prefix_: [number, string] = [1, ''];
  private is_empty_ = true; // nothing but 0, which has no scale
  private marked_: number[] = []; // times of best efforts [s]

  constructor(
    private readonly element_: HTMLElement,
    private readonly lines_: Line[],
    private readonly unit_: string,
    private readonly marks_: boolean, // best efforts
    height: number,
    cursor: () => number | null,
    on_select: (window: Window) => void,
    on_click: (time: number) => void,
  ) {
    const axis = { stroke: ink, grid: { stroke: grid, width: 1 }, ticks: { show: false }, font: font() };
    this.plot_ = new uPlot(
      {
        width: Math.max(50, element_.clientWidth),
        height,
        padding: [8, 8, 0, 0],
        legend: { show: false },
        cursor: { drag: { x: true, y: false, setScale: false, dist: 5 }, points: { show: false }, y: false, sync: { key: 'time' } },
        select: { show: true, left: 0, top: 0, width: 0, height: 0 },
        scales: { x: { time: false, auto: false, range: (_, low, high) => [low, high] }, y: { range: (_, low, high) => padded(low, high) } },
        axes: [
          { ...axis, size: 20 * rem(), gap: 4, values: (_, ticks) => ticks.map((tick) => short_number(tick, 5)) },
          { ...axis, size: 46 * rem(), gap: 3, space: 22 * rem(), values: (_, ticks) => ticks.map((tick) => (this.is_empty_ && tick !== 0 ? '' : short_number(tick / this.prefix_[0]))) },
        ],
        series: [
          {},
          ...lines_.map((line) => ({
            label: line.label,
            stroke: () => css_colour(line.colour),
            width: line.width ?? 1,
            ...(line.dash ? { dash: line.dash } : {}),
            points: { show: false },
            spanGaps: false,
          })),
        ],
        hooks: {
          setSelect: [
            (plot) => {
              const { left, width } = plot.select;
              if (width < 5) return;
              on_select({ from: plot.posToVal(left, 'x'), to: plot.posToVal(left + width, 'x') });
              plot.setSelect({ left: 0, top: 0, width: 0, height: 0 }, false);
            },
          ],
          draw: [(plot) => draw_marks(plot, this.marked_), (plot) => draw_cursor(plot, cursor())],
        },
      },
      [[0], ...lines_.map(() => [null])] as uPlot.AlignedData,
      element_,
    );
    this.plot_.over.addEventListener('click', (event) => {
      if (this.plot_.select.width < 5) on_click(this.plot_.posToVal(event.offsetX, 'x'));
    });
    new ResizeObserver(() => this.plot_.setSize({ width: Math.max(50, element_.clientWidth), height })).observe(element_);
  }

  /** With its prefix, as "[kN]"; empty where nothing but 0 is drawn, which has no scale. */
  get unit(): string {
    return this.is_empty_ ? '' : `[${this.prefix_[1]}${this.unit_}]`;
  }

  draw(history: History, rate: number, window: Window): void {
    if (this.element_.offsetParent === null) return; // folded away
    const columns: Column[] = [...this.lines_.map((line) => line.column), 'best_effort'];
    const data = history.decimate(window.from * rate, window.to * rate, this.plot_.width, columns);
    data[0] = data[0]!.map((tick) => tick! / rate);
    const marks = data.pop()!;
    this.marked_ = this.marks_ ? data[0].filter((_, k) => (marks[k] ?? 0) > 0).map((time) => time!) : [];
    if (data[0].length === 0) data.forEach((row, k) => row.push(k === 0 ? window.from : null));
    let largest = 0;
    for (const row of data.slice(1)) for (const value of row) largest = Math.max(largest, Math.abs(value ?? 0));
    this.is_empty_ = largest === 0;
    this.prefix_ = si_prefix(largest);
    this.plot_.batch(() => {
      this.plot_.setData(data as uPlot.AlignedData, false);
      this.plot_.setScale('x', { min: window.from, max: window.to });
    });
  }
}

function padded(low: number | null, high: number | null): [number, number] {
  const bottom = Math.min(0, low ?? 0);
  const top = Math.max(0, high ?? 0);
  const room = 0.08 * (top - bottom);
  if (room === 0) return [0, 1];
  return [bottom < 0 ? bottom - room : 0, top > 0 ? top + room : 0];
}

/** A stroke at the lower edge for each of some times. */
function draw_marks(plot: uPlot, times: number[]): void {
  const { ctx, bbox } = plot;
  ctx.save();
  ctx.fillStyle = css_colour('warm');
  const [width, height] = [2 * devicePixelRatio, 5 * devicePixelRatio];
  for (const time of times) {
    const x = plot.valToPos(time, 'x', true);
    if (x >= bbox.left && x <= bbox.left + bbox.width) ctx.fillRect(x - width / 2, bbox.top + bbox.height - height, width, height);
  }
  ctx.restore();
}

function draw_cursor(plot: uPlot, time: number | null): void {
  if (time === null) return;
  const x = plot.valToPos(time, 'x', true);
  const { ctx, bbox } = plot;
  if (!(x >= bbox.left && x <= bbox.left + bbox.width)) return;
  ctx.save();
  ctx.strokeStyle = css_colour('accent');
  ctx.lineWidth = devicePixelRatio;
  ctx.beginPath();
  ctx.moveTo(x, bbox.top);
  ctx.lineTo(x, bbox.top + bbox.height);
  ctx.stroke();
  ctx.restore();
}

const per_decade = 6;

/** Two histograms over each other, logarithmic from 1 us to 10 ms. */
class TimingPlot {
  private readonly canvas_ = document.createElement('canvas');

  constructor(element: HTMLElement, height: number) {
    this.canvas_.style.cssText = `width:100%;height:${height}px;display:block`;
    this.canvas_.setAttribute('role', 'img');
    this.canvas_.setAttribute('aria-label', 'Histogram of compute time and lateness');
    element.append(this.canvas_);
  }

  draw(compute: Float32Array, late: Float32Array): void {
    const canvas = this.canvas_;
    if (canvas.offsetParent === null) return;
    const ratio = devicePixelRatio;
    const [width, height] = [canvas.clientWidth, canvas.clientHeight];
    if (canvas.width !== Math.round(width * ratio) || canvas.height !== Math.round(height * ratio)) {
      canvas.width = Math.round(width * ratio);
      canvas.height = Math.round(height * ratio);
    }
    const context = canvas.getContext('2d')!;
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
    context.clearRect(0, 0, width, height);
    const [left, bottom, top] = [8, height - 16 * rem(), 6];
    const span = width - 16;
    context.font = font();
    context.fillStyle = ink();
    context.strokeStyle = grid();
    context.textAlign = 'center';
    const classes = 4 * per_decade + 2;
    ['1 µs', '10 µs', '100 µs', '1 ms', '10 ms'].forEach((text, decade) => {
      const x = left + (span * (1 + decade * per_decade)) / classes;
      context.beginPath();
      context.moveTo(x, top);
      context.lineTo(x, bottom);
      context.stroke();
      context.fillText(text, Math.min(width - 18, Math.max(14, x)), height - 3);
    });
    const bars = (values: Float32Array, colour: string) => {
      const counts = log_classes(values, per_decade);
      const most = Math.log1p(Math.max(1, ...counts));
      context.fillStyle = colour;
      context.globalAlpha = 0.65;
      counts.forEach((count, k) => {
        if (count === 0) return;
        const size = Math.max(1.5, ((bottom - top) * Math.log1p(count)) / most);
        context.fillRect(left + (span * k) / classes + 0.5, bottom - size, span / classes - 1, size);
      });
      context.globalAlpha = 1;
    };
    bars(late, css_colour('warm'));
    bars(compute, css_colour('accent'));
    context.strokeStyle = css_colour('edge');
    context.beginPath();
    context.moveTo(left, bottom + 0.5);
    context.lineTo(left + span, bottom + 0.5);
    context.stroke();
  }
}

/** Medians and 99.9 % of what is shown [us]. */
export interface Timing {
  compute: [number, number];
  late: [number, number];
}

export interface PlotElements {
  force: HTMLElement;
  depth: HTMLElement;
  timing: HTMLElement;
  force_unit: HTMLElement;
  depth_unit: HTMLElement;
  live: HTMLElement; // a button that ends a zoom
}

/** All plots over the same window of time: the last ten seconds, all of a replay, or what was dragged over. */
export class Plots {
  timing: Timing = { compute: [NaN, NaN], late: [NaN, NaN] };
  /** In a replay: what is shown now [s]. */
  cursor: number | null = null;
  private readonly force_: TimePlot;
  private readonly depth_: TimePlot;
  private readonly timing_: TimingPlot;
  private zoom_: Window | null = null;

  constructor(
    private readonly elements_: PlotElements,
    on_seek: (time: number) => void,
  ) {
    const zoom = (window: Window | null) => {
      this.zoom_ = window;
      elements_.live.hidden = window === null;
      this.changed();
    };
    const plot = (element: HTMLElement, lines: Line[], unit: string, marks: boolean, height: number) => {
      element.addEventListener('dblclick', () => zoom(null));
      return new TimePlot(element, lines, unit, marks, height, () => this.cursor, zoom, on_seek);
    };
    this.force_ = plot(elements_.force, force_lines, 'N', true, 164 * rem());
    this.depth_ = plot(elements_.depth, depth_lines, 'm', false, 112 * rem());
    this.timing_ = new TimingPlot(elements_.timing, 84 * rem());
    elements_.live.addEventListener('click', () => zoom(null));
  }

  /** Something else than the samples has changed: the caller draws again. */
  changed: () => void = () => undefined;

  draw(history: History, rate: number, shows_all: boolean): void {
    const last = Math.max(0, history.last) / rate;
    const first = history.count > 0 ? history.tick(0) / rate : 0; // below 0 where the run began anew
    const from = Math.max(Math.min(0, first), last - shown_seconds);
    let window: Window = { from, to: from + shown_seconds };
    if (shows_all && history.count > 0) window = { from: first, to: Math.max(last, 1e-3) };
    if (this.zoom_) window = this.zoom_;
    this.force_.draw(history, rate, window);
    this.depth_.draw(history, rate, window);
    this.elements_.force_unit.textContent = this.force_.unit;
    this.elements_.depth_unit.textContent = this.depth_.unit;
  }

  /** Some twice a second: sorting is not for each picture. */
  draw_timing(history: History, rate: number, shows_all: boolean): void {
    const to = history.last + 1;
    const from = shows_all ? 0 : to - shown_seconds * rate;
    const compute = history.sorted('compute', from, to);
    const late = history.sorted('late', from, to);
    this.timing = {
      compute: [quantile(compute, 0.5), quantile(compute, 0.999)],
      late: [quantile(late, 0.5), quantile(late, 0.999)],
    };
    this.timing_.draw(compute, late);
  }
}
