// The JSON messages of PROTOCOL.md.

export type Vec3 = [number, number, number];
export type Quaternion = [number, number, number, number];
export type Mode = 'live' | 'replay' | 'file';

export interface Hello {
  type: 'hello';
  protocol: number;
  version: string;
  mode: Mode;
  id?: number;
  book?: boolean; // is served beside the page
}

export interface Model {
  name: string;
  file: string;
  dimension: 2 | 3;
  nodes: number;
  surface_nodes: number;
  elements: number;
  dofs: number;
  element: string;
  size: number;
  bounds: [Vec3, Vec3];
  moves: boolean;
  deep?: boolean; // on two levels: it turns and bends far
  goes_deep?: boolean; // it is unless the settings say otherwise
  loads: boolean;
  overlay_rings?: number; // the most that an overlay may have; 0: none may be
  overlay_refinement?: [number, number]; // least and most
  studied_rotation?: number | null; // up to which forces were found right within 5 % [rad]; null: no bound is known
  materials?: number[]; // Young's moduli [Pa] in the order of their numbers; absent: not known
}

/** How the run is. What a message leaves out is as it was. */
export interface State {
  scene: number;
  you: 'controller' | 'watcher';
  controlled: boolean;
  watchers: number;
  model: Model;
  device: string;
  pointer: boolean;
  hand?: boolean; // a hand is in the device
  rate: number;
  ticks: number;
  paused: boolean;
  recording: string | null;
  recording_failed: Problem | null;
  busy: string | null;
  refused: Problem | null;
  locked: string | null;
  fault: { name: string; remedy: string } | null;
  phase: string;
  misses: number;
  change?: { rotation: number; strain: number } | null; // the largest of the surface [rad], [-]; null: not known
  small_strain?: number; // by which small strain has more force than two levels, as a fraction; 0: not on two levels
  settings: Record<string, string>;
  tool_note: string; // may be empty
  defaults: { radius: number; reach: number; friction: number; depth: number };
  session?: string; // name of a recording's file
  frames?: number;
  frame?: number;
  alone?: boolean; // of a replay it sees another frame than the page that steers
  duration?: number;
  times?: number[];
}

/** What cannot be done, its place (an option, a file), and a way out; the last two may be empty. */
export interface Problem {
  what: string;
  where: string;
  hint: string;
}

/** The problem of a message that this page sent, or cannot read; the runtime gives the reason. */
export type Refusal = Problem & { type: 'error'; about: string; reason?: 'value' | 'control' | 'hand' | 'locked' };

export type Said = Hello | (Partial<State> & { type: 'state' }) | Refusal;

/** Where the tool is wanted. */
export interface Point {
  type: 'point';
  position: Vec3;
  orientation: Quaternion;
  grab: boolean;
  lifted: boolean;
}

export type Word =
  | { type: 'pause'; paused: boolean }
  | { type: 'step' }
  | { type: 'reset' }
  | { type: 'acknowledge' }
  | { type: 'change'; settings: Record<string, string | null> }
  | { type: 'record'; on: boolean }
  | { type: 'control'; take: boolean }
  | { type: 'seek'; frame: number }
  | { type: 'follow' };
