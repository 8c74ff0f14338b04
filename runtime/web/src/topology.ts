// Which vertices are drawn for the nodes of a scene and a patch: pure index work.
import type { Patch, Scene } from './wire';

const crease = Math.cos((40 * Math.PI) / 180);

/**
 * Nodes 0 .. S - 1 are the scene's, S .. N - 1 the patch's; a patch's node in the place of a scene's is drawn as that one. Vertex i
 * is node i; where facets meet at an edge of the body, further vertices follow, so that each side has its own normal.
 */
export interface Topology {
  nodes: number; // N
  scene_nodes: number; // S
  node: Uint32Array; // [V] of each vertex
  triangle: Uint32Array; // [3 T] vertices; neither hidden ones nor any of no area
  corner: Uint32Array; // [3 T] nodes of the same triangles
  edge: Uint32Array; // [2 E] nodes
  outline: Uint32Array; // [2 O] nodes
  welded: Int32Array; // [m] the scene's node in the place of the patch's, or -1
  rest: Float32Array; // [3 N]
}

/** Pairs each node of the patch with the scene's at the same place. */
function weld(scene: Scene, patch: Patch): Int32Array {
  const count = patch.position.length / 3;
  const welded = new Int32Array(count).fill(-1);
  const bits = (values: Float32Array, i: number) => `${values[3 * i]},${values[3 * i + 1]},${values[3 * i + 2]}`;
  const places = new Map<string, number>();
  const candidates = new Set<number>();
  for (const t of patch.hidden) for (let i = 0; i < 3; ++i) candidates.add(scene.triangle[3 * t + i]!);
  for (const i of candidates) places.set(bits(scene.position, i), i);
  for (let i = 0; i < count; ++i) welded[i] = places.get(bits(patch.position, i)) ?? -1;
  return welded;
}

function facet_normals(rest: Float32Array, corner: Uint32Array): Float32Array {
  const normals = new Float32Array(corner.length);
  for (let t = 0; t < corner.length; t += 3) {
    const a = 3 * corner[t]!, b = 3 * corner[t + 1]!, c = 3 * corner[t + 2]!;
    const ux = rest[b]! - rest[a]!, uy = rest[b + 1]! - rest[a + 1]!, uz = rest[b + 2]! - rest[a + 2]!;
    const vx = rest[c]! - rest[a]!, vy = rest[c + 1]! - rest[a + 1]!, vz = rest[c + 2]! - rest[a + 2]!;
    const x = uy * vz - uz * vy, y = uz * vx - ux * vz, z = ux * vy - uy * vx;
    const length = Math.hypot(x, y, z) || 1;
    normals[t] = x / length;
    normals[t + 1] = y / length;
    normals[t + 2] = z / length;
  }
  return normals;
}

/** Of each corner the group of facets at its node that have about the same normal: node i's first is vertex i. */
function split_at_creases(rest: Float32Array, corner: Uint32Array, nodes: number): { vertex: Uint32Array; node: Uint32Array } {
  const normal = facet_normals(rest, corner);
  const vertex = new Uint32Array(corner.length);
  const node = Array.from({ length: nodes }, (_, i) => i);
  const groups: { vertex: number; x: number; y: number; z: number }[][] = Array.from({ length: nodes }, () => []);
  for (let at = 0; at < corner.length; ++at) {
    const t = at - (at % 3);
    const x = normal[t]!, y = normal[t + 1]!, z = normal[t + 2]!;
    const here = groups[corner[at]!]!;
    let group = here.find((g) => g.x * x + g.y * y + g.z * z > crease * Math.hypot(g.x, g.y, g.z));
    if (!group) {
      group = { vertex: here.length === 0 ? corner[at]! : node.push(corner[at]!) - 1, x: 0, y: 0, z: 0 };
      here.push(group);
    }
    group.x += x;
    group.y += y;
    group.z += z;
    vertex[at] = group.vertex;
  }
  return { vertex, node: Uint32Array.from(node) };
}

const edge_key = (a: number, b: number, nodes: number): number => Math.min(a, b) * nodes + Math.max(a, b);

/** Of a scene and the patch in it, if any. */
export function make_topology(scene: Scene, patch: Patch | null): Topology {
  const scene_nodes = scene.held.length;
  const patch_nodes = patch ? patch.position.length / 3 : 0;
  const nodes = scene_nodes + patch_nodes;
  const rest = new Float32Array(3 * nodes);
  rest.set(scene.position);
  if (patch) rest.set(patch.position, scene.position.length);
  const welded = patch ? weld(scene, patch) : new Int32Array(0);
  const drawn = (i: number) => (welded[i]! >= 0 ? welded[i]! : scene_nodes + i);

  const hides = patch !== null && patch.triangle.length > 0;
  const hidden = new Uint8Array(scene.triangle.length / 3);
  if (hides) for (const t of patch.hidden) hidden[t] = 1;
  const corner: number[] = [];
  const bare = new Set<number>(); // edges of hidden triangles
  const seen = new Set<number>(); // edges of those that are drawn
  for (let t = 0; t < hidden.length; ++t) {
    const of_edges = hidden[t] ? bare : seen;
    const [a, b, c] = [scene.triangle[3 * t]!, scene.triangle[3 * t + 1]!, scene.triangle[3 * t + 2]!];
    if (!hidden[t]) corner.push(a, b, c);
    if (hides) of_edges.add(edge_key(a, b, nodes)).add(edge_key(b, c, nodes)).add(edge_key(c, a, nodes));
  }
  const edge: number[] = [];
  for (let e = 0; e < scene.edge.length; e += 2) {
    const key = edge_key(scene.edge[e]!, scene.edge[e + 1]!, nodes);
    if (!bare.has(key) || seen.has(key)) edge.push(scene.edge[e]!, scene.edge[e + 1]!);
  }
  const outline: number[] = [];
  if (patch) {
    const fine = new Set<number>();
    for (let t = 0; t < patch.triangle.length; t += 3) {
      const three = [0, 1, 2].map((i) => drawn(patch.triangle[t + i]!));
      corner.push(...three);
      for (let i = 0; i < 3; ++i) {
        const [a, b] = [three[i]!, three[(i + 1) % 3]!];
        const key = edge_key(a, b, nodes);
        if (!fine.has(key)) edge.push(a, b);
        fine.add(key);
      }
    }
    for (const i of patch.outline) outline.push(drawn(i));
  }
  const corners = Uint32Array.from(corner);
  const { vertex, node } = split_at_creases(rest, corners, nodes);
  return {
    nodes,
    scene_nodes,
    node,
    triangle: vertex,
    corner: corners,
    edge: Uint32Array.from(edge),
    outline: Uint32Array.from(outline),
    welded,
    rest,
  };
}

/** Vertex normals [3 V] of length 1: means of the triangles' by their areas. */
export function vertex_normals(position: Float32Array, triangle: Uint32Array, normal: Float32Array): void {
  normal.fill(0);
  for (let t = 0; t < triangle.length; t += 3) {
    const a = 3 * triangle[t]!, b = 3 * triangle[t + 1]!, c = 3 * triangle[t + 2]!;
    const ax = position[a]!, ay = position[a + 1]!, az = position[a + 2]!;
    const ux = position[b]! - ax, uy = position[b + 1]! - ay, uz = position[b + 2]! - az;
    const vx = position[c]! - ax, vy = position[c + 1]! - ay, vz = position[c + 2]! - az;
    const x = uy * vz - uz * vy, y = uz * vx - ux * vz, z = ux * vy - uy * vx;
    normal[a]! += x; normal[a + 1]! += y; normal[a + 2]! += z;
    normal[b]! += x; normal[b + 1]! += y; normal[b + 2]! += z;
    normal[c]! += x; normal[c + 1]! += y; normal[c + 2]! += z;
  }
  for (let i = 0; i < normal.length; i += 3) {
    const length = Math.sqrt(normal[i]! ** 2 + normal[i + 1]! ** 2 + normal[i + 2]! ** 2) || 1;
    normal[i]! /= length;
    normal[i + 1]! /= length;
    normal[i + 2]! /= length;
  }
}
