// What is told where the force is a best effort, and by how much it may be off.
import { short_number } from './format';
import type { Frame, Ticks } from './wire';

const not_converged_bit = 1 << 8; // StepStatus::not_converged
const late_bit = 1 << 12; // StepStatus::late_motion
const unbalanced_bit = 1 << 14; // StepStatus::unbalanced
const stays = 1000; // [ms] that a best effort is told of when it is over

/** What a tick, or the worst of several, could not do. */
export interface Effort {
  share: number; // of the force that may be wrong; 1: all of it, or more
  left_out: number; // contact points that found no room
  not_converged: boolean;
  unbalanced: boolean; // at depth
  stood_still: boolean; // the body, which gives way with time
}

function effort_of(force: number, force_error: number, left_out: number, status: number): Effort {
  return {
    share: force_error > 0 ? force_error / Math.max(force, force_error) : 0,
    left_out,
    not_converged: (status & not_converged_bit) !== 0,
    unbalanced: (status & unbalanced_bit) !== 0,
    stood_still: force_error > 0 && (status & late_bit) !== 0,
  };
}

const is_best = (effort: Effort): boolean => effort.left_out > 0 || effort.not_converged || effort.unbalanced || effort.stood_still;

function worst(efforts: Effort[]): Effort | null {
  const told = efforts.filter(is_best);
  if (told.length === 0) return null;
  return {
    share: Math.max(...told.map((one) => one.share)),
    left_out: Math.max(...told.map((one) => one.left_out)),
    not_converged: told.some((one) => one.not_converged),
    unbalanced: told.some((one) => one.unbalanced),
    stood_still: told.some((one) => one.stood_still),
  };
}

export function of_frame(frame: Frame): Effort {
  return effort_of(Math.hypot(...frame.force), frame.force_error, frame.left_out, frame.status);
}

/** Of sample `i`. */
export function of_tick(ticks: Ticks, i: number): Effort {
  const force = Math.hypot(ticks.force[3 * i]!, ticks.force[3 * i + 1]!, ticks.force[3 * i + 2]!);
  return effort_of(force, ticks.force_error[i]!, ticks.left_out[i]!, ticks.status[i]!);
}

/** Whether sample `i` is marked in the plots. */
export function is_marked(ticks: Ticks, i: number): boolean {
  return is_best(of_tick(ticks, i));
}

/** A sentence for the worst of some ticks; empty where none was a best effort. */
export function sentence(efforts: Effort[]): string {
  const effort = worst(efforts);
  if (!effort) return '';
  const reasons: string[] = [];
  if (effort.not_converged) reasons.push('not converged');
  if (effort.unbalanced) reasons.push('the balance at depth was not met');
  if (effort.stood_still) reasons.push('the body stood still');
  if (effort.left_out > 0) reasons.push(`${effort.left_out} contact point${effort.left_out > 1 ? 's' : ''} left out`);
  const percent = 100 * effort.share;
  let size = `force within about ${short_number(percent, 2)} %`;
  if (percent < 0.1) size = 'force within 0.1 %';
  if (percent > 99) size = 'force off by 100 % or more';
  return `Best effort: ${size} (${reasons.join(', ')})`;
}

/** The best efforts of the last moment. */
export class RecentEfforts {
  private recent_: { effort: Effort; time: number }[] = [];

  /** Takes ticks in that came at `now` [ms]. */
  take(ticks: Ticks, now: number): void {
    const effort = worst(Array.from({ length: ticks.count }, (_, i) => of_tick(ticks, i)));
    if (effort) this.recent_.push({ effort, time: now });
  }

  /** As `sentence`, of what is not older than a moment. */
  sentence(now: number): string {
    this.recent_ = this.recent_.filter(({ time }) => now - time <= stays);
    return sentence(this.recent_.map(({ effort }) => effort));
  }
}
