// Nodal displacements and the number by which each node is coloured.
import type { Field } from './colours';
import type { Surface } from './pick';
import type { Topology } from './topology';
import { floats_of_contact, unknown_stress, type Frame } from './wire';

/** Displacements [3 N] in metres of the scene's nodes and the patch's; those of a patch that the frame does not have stay 0. */
export function displacements(frame: Frame, topology: Topology, out: Float32Array): void {
  const scene = Math.min(frame.u.length, 3 * topology.scene_nodes);
  for (let i = 0; i < scene; ++i) out[i] = frame.u[i]! * frame.unit_u;
  const from = 3 * topology.scene_nodes;
  const patch = Math.min(frame.patch_u.length, out.length - from);
  for (let i = 0; i < patch; ++i) out[from + i] = frame.patch_u[i]! * frame.unit_u;
  for (let i = 0; i < patch / 3; ++i) {
    const node = topology.welded[i]!;
    if (node >= 0) for (let k = 0; k < 3; ++k) out[3 * node + k] = out[from + 3 * i + k]!;
  }
}

/** The node that lies nearest to a place. */
function nearest_node(place: ArrayLike<number>, { nodes, rest }: Topology, u: Float32Array): number {
  let [best, found] = [Infinity, 0];
  for (let i = 0; i < nodes; ++i) {
    const away = Math.hypot(rest[3 * i]! + u[3 * i]! - place[0]!, rest[3 * i + 1]! + u[3 * i + 1]! - place[1]!, rest[3 * i + 2]! + u[3 * i + 2]! - place[2]!);
    if (away < best) [best, found] = [away, i];
  }
  return found;
}

/** Where a tool holds the body the force is that of a point, and the stress there as large as the mesh is fine: it is not known, as where the body is fixed. */
function forget_held(frame: Frame, topology: Topology, u: Float32Array, value: Float32Array, known: Float32Array): void {
  for (let c = 0; c < frame.contact.length; c += floats_of_contact) {
    if (!(frame.contact[c + floats_of_contact - 1]! > 0)) continue;
    const node = nearest_node(frame.contact.subarray(c, c + 3), topology, u);
    value[node] = known[node] = 0;
  }
}

function fill_stress(frame: Frame, topology: Topology, value: Float32Array, known: Float32Array): void {
  const take = (stress: Uint16Array, from: number, count: number) => {
    for (let i = 0; i < count; ++i) {
      known[from + i] = stress[i] === unknown_stress ? 0 : 1;
      value[from + i] = known[from + i]! * (stress[i]! - 1) * frame.unit_stress;
    }
  };
  take(frame.stress, 0, Math.min(frame.stress.length, topology.scene_nodes));
  take(frame.patch_stress, topology.scene_nodes, Math.min(frame.patch_stress.length, topology.nodes - topology.scene_nodes));
}

/**
 * Values [N] of `field`, and 1 where it is known, else 0; `u` as displacements() gives it. The result is the largest absolute value.
 */
export function fill_field(field: Field, frame: Frame, topology: Topology, u: Float32Array, value: Float32Array, known: Float32Array): number {
  known.fill(1);
  value.fill(0);
  const component = field === 'x' ? 0 : field === 'y' ? 1 : 2;
  if (field === 'magnitude') {
    for (let i = 0; i < topology.nodes; ++i) value[i] = Math.sqrt(u[3 * i]! ** 2 + u[3 * i + 1]! ** 2 + u[3 * i + 2]! ** 2);
  } else if (field === 'von-mises') {
    fill_stress(frame, topology, value, known);
    forget_held(frame, topology, u, value, known);
  } else if (field === 'pressure') {
    for (let i = 0; i < frame.pressure_node.length; ++i) {
      const node = frame.pressure_node[i]!;
      if (node < topology.nodes) value[node] = frame.pressure[i]!;
    }
  } else if (field !== 'none') {
    for (let i = 0; i < topology.nodes; ++i) value[i] = u[3 * i + component]!;
  }
  if (field === 'von-mises' || field === 'pressure') {
    topology.welded.forEach((node, i) => {
      const own = topology.scene_nodes + i;
      if (node < 0 || (field === 'pressure' && value[own] === 0)) return;
      value[node] = value[own]!;
      known[node] = known[own]!;
    });
  }
  let largest = 0;
  for (let i = 0; i < topology.nodes; ++i) largest = Math.max(largest, Math.abs(value[i]!));
  return largest;
}

/**
 * How deep each node is pressed in, of the tool's size, in `value`: along the force, from where it was when the tool was last
 * away, against the mean of the nodes some three sizes away, which bend or move along with what is around the dent.
 */
export function fill_dent(frame: Frame, topology: Topology, u: Float32Array, untouched: Float32Array, size: number, value: Float32Array): void {
  const force = Math.hypot(...frame.force);
  const way = frame.force.map((f) => f / force);
  const away = (i: number) => Math.hypot(...[0, 1, 2].map((k) => topology.rest[3 * i + k]! + u[3 * i + k]! - frame.tool[k]!)) / size;
  let [sum, whole] = [0, 0];
  for (let i = 0; i < topology.nodes; ++i) {
    value[i] = 0;
    for (let k = 0; k < 3; ++k) value[i]! += way[k]! * (u[3 * i + k]! - (untouched[3 * i + k] ?? 0));
    const weight = 1 / (1 + (away(i) - 3.7) ** 4);
    sum += weight * value[i]!;
    whole += weight;
  }
  for (let i = 0; i < topology.nodes; ++i) value[i] = Math.max(0, value[i]! - sum / whole) / (size * (1 + (away(i) / 3) ** 6));
}

/**
 * At places within a closed surface [3 n] what lies between the values of its vertices: means over all directions, weighted by one
 * over the way to the surface (mean value coordinates, Ju, Schaefer and Warren 2005), a point a triangle.
 */
export function mean_values(places: ArrayLike<number>, { position: p, triangle }: Surface, value: ArrayLike<number>): Float32Array {
  const count = triangle.length / 3;
  const middle = new Float64Array(3 * count);
  const area = new Float64Array(3 * count); // outward, half as long as the cross product
  const mean = new Float64Array(count);
  for (let t = 0; t < count; ++t) {
    const [a, b, c] = [3 * triangle[3 * t]!, 3 * triangle[3 * t + 1]!, 3 * triangle[3 * t + 2]!];
    for (let k = 0; k < 3; ++k) {
      const [m, n] = [(k + 1) % 3, (k + 2) % 3];
      middle[3 * t + k] = (p[a + k]! + p[b + k]! + p[c + k]!) / 3;
      area[3 * t + k] = 0.5 * ((p[b + m]! - p[a + m]!) * (p[c + n]! - p[a + n]!) - (p[b + n]! - p[a + n]!) * (p[c + m]! - p[a + m]!));
    }
    mean[t] = (value[a / 3]! + value[b / 3]! + value[c / 3]!) / 3;
  }
  return Float32Array.from({ length: places.length / 3 }, (_, i) => {
    let [sum, whole] = [0, 0];
    for (let t = 0; t < count; ++t) {
      const x = middle[3 * t]! - places[3 * i]!, y = middle[3 * t + 1]! - places[3 * i + 1]!, z = middle[3 * t + 2]! - places[3 * i + 2]!;
      const away2 = x * x + y * y + z * z + 1e-30;
      const weight = Math.abs(area[3 * t]! * x + area[3 * t + 1]! * y + area[3 * t + 2]! * z) / (away2 * away2); // without its sign: a place just outside has what is beside it
      sum += weight * mean[t]!;
      whole += weight;
    }
    return whole === 0 ? 0 : sum / whole;
  });
}

const per_octave = 16;
const octaves = 20;

/**
 * The absolute value that is exceeded on the share `cut` of the area where it is known and not 0, to some per cent: a few hot nodes under a
 * tool do not set it. `largest` is the largest absolute value.
 */
export function usual_largest(value: Float32Array, known: Float32Array, area: Float32Array, largest: number, cut: number): number {
  if (!(largest > 0)) return 0;
  const classes = new Float64Array(per_octave * octaves);
  let whole = 0;
  for (let i = 0; i < area.length; ++i) {
    const size = Math.abs(value[i]!);
    if (size === 0 || known[i] === 0) continue;
    const below = Math.floor(per_octave * Math.log2(largest / size));
    classes[Math.min(classes.length - 1, below)]! += area[i]!;
    whole += area[i]!;
  }
  let above = 0;
  for (let k = 0; k < classes.length; ++k) {
    above += classes[k]!;
    if (above > cut * whole) return largest * 2 ** (-k / per_octave);
  }
  return largest;
}
