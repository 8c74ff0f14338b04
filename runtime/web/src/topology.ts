// Which vertices are drawn for the nodes of a scene and a patch: pure index work.
import { cross, norm } from './pose';
import type { Patch, Scene } from './wire';
import type { Vec3 } from './words';

const crease = Math.cos((40 * Math.PI) / 180);

/**
 * Nodes 0 .. S - 1 are the scene's, S .. N - 1 the patch's; a patch's node in the place of a scene's is drawn as that one. Vertex i
 * is node i; where facets meet at an edge of the body, further vertices follow, so that each side has its own normal.
 */
export interface Topology {
  nodes: number; // N
  scene_nodes: number; // S
  node: Uint32Array; // [V] of each vertex
  material: Uint8Array; // [V] that the vertex' triangles are of
  triangle: Uint32Array; // [3 T] vertices; neither hidden ones nor any of no area
  corner: Uint32Array; // [3 T] nodes of the same triangles
  edge: Uint32Array; // [2 E] nodes
  outline: Uint32Array; // [2 O] nodes
  welded: Int32Array; // [m] the scene's node in the place of the patch's, or -1
  rest: Float32Array; // [3 N]
  area: Float32Array; // [N] of the surface that a node stands for; in the plane without an inside, length
}

/** Pairs each node of the patch with the scene's at the same place, to the last bit. */
function weld(scene: Scene, patch: Patch): Int32Array {
  const count = patch.position.length / 3;
  const welded = new Int32Array(count).fill(-1);
  const scene_bits = new Uint32Array(scene.position.buffer, scene.position.byteOffset, scene.position.length);
  const patch_bits = new Uint32Array(patch.position.buffer, patch.position.byteOffset, patch.position.length);
  const hash = (bits: Uint32Array, i: number) =>
    Math.imul(bits[3 * i]!, 73856093) ^ Math.imul(bits[3 * i + 1]!, 19349663) ^ Math.imul(bits[3 * i + 2]!, 83492791);
  const places = new Map<number, number[]>();
  const is_listed = new Uint8Array(scene.held.length);
  const list = (node: number | undefined) => {
    if (node === undefined || is_listed[node]) return;
    is_listed[node] = 1;
    const key = hash(scene_bits, node);
    const here = places.get(key);
    if (here) here.push(node);
    else places.set(key, [node]);
  };
  for (const t of patch.hidden) for (let i = 3 * t; i < 3 * t + 3; ++i) list(scene.triangle[i]);
  if (scene.dimension === 2) for (let i = 0; i < is_listed.length; ++i) list(i); // any may be on the patch's boundary
  for (let i = 0; i < count; ++i) {
    const same = places.get(hash(patch_bits, i))?.find((node) => [0, 1, 2].every((k) => scene_bits[3 * node + k] === patch_bits[3 * i + k]));
    if (same !== undefined) welded[i] = same;
  }
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

interface Split {
  vertex: Uint32Array;
  node: Uint32Array;
  material: Uint8Array;
}

/** Of each corner the group of facets at its node that have about the same normal and one material: node i's first is vertex i. */
function split_at_creases(rest: Float32Array, corner: Uint32Array, nodes: number, material_of: Uint8Array): Split {
  const normal = facet_normals(rest, corner);
  const vertex = new Uint32Array(corner.length);
  const node = new Uint32Array(nodes + corner.length);
  const sum = new Float32Array(3 * node.length); // of each group's facet normals
  const next = new Int32Array(node.length).fill(-1); // group of the same node
  const material = new Uint8Array(node.length);
  let count = nodes;
  for (let i = 0; i < nodes; ++i) node[i] = i;
  for (let at = 0; at < corner.length; ++at) {
    const t = at - (at % 3);
    const x = normal[t]!, y = normal[t + 1]!, z = normal[t + 2]!;
    let group = corner[at]!;
    const own = material_of[t / 3] ?? 0;
    for (;;) {
      const a = sum[3 * group]!, b = sum[3 * group + 1]!, c = sum[3 * group + 2]!;
      const size = Math.sqrt(a * a + b * b + c * c);
      if (size === 0 || (a * x + b * y + c * z > crease * size && material[group] === own)) break;
      if (next[group]! < 0) {
        node[count] = corner[at]!;
        next[group] = count++;
      }
      group = next[group]!;
    }
    sum[3 * group]! += x;
    sum[3 * group + 1]! += y;
    sum[3 * group + 2]! += z;
    vertex[at] = group;
    material[group] = own;
  }
  return { vertex, node: node.slice(0, count), material: material.slice(0, count) };
}

const beside = new WeakMap<Scene, Int32Array>();

/** Of each edge of the scene the two triangles beside it, -1 where there is none: made once, patches come often. */
function triangles_beside(scene: Scene): Int32Array {
  const known = beside.get(scene);
  if (known) return known;
  const nodes = scene.held.length;
  const key = (a: number, b: number) => Math.min(a, b) * nodes + Math.max(a, b);
  const edges = new Map<number, number>();
  for (let e = 0; e < scene.edge.length; e += 2) edges.set(key(scene.edge[e]!, scene.edge[e + 1]!), e);
  const triangles = new Int32Array(scene.edge.length).fill(-1);
  for (let at = 0; at < scene.triangle.length; ++at) {
    const t = at - (at % 3);
    const e = edges.get(key(scene.triangle[at]!, scene.triangle[t + ((at + 1) % 3)]!));
    if (e !== undefined) triangles[triangles[e]! < 0 ? e : e + 1] = t / 3;
  }
  beside.set(scene, triangles);
  return triangles;
}

/**
 * In the plane a patch is a finer boundary alone: triangles with an edge that it cuts become fans of triangles, so that the body ends
 * where its boundary is. `corner` are nodes of triangles, `outline` edges of which nodes from `scene_nodes` on are the patch's; gives
 * the new corners and the edges that were cut, as keys of `edge_key`.
 */
function follow_boundary(corner: Uint32Array, outline: Uint32Array, scene_nodes: number, edge_key: (a: number, b: number) => number) {
  const beside = new Map<number, number[]>();
  for (let e = 0; e < outline.length; e += 2) {
    for (const [a, b] of [[outline[e]!, outline[e + 1]!], [outline[e + 1]!, outline[e]!]] as const) beside.set(a, [...(beside.get(a) ?? []), b]);
  }
  /** The patch's nodes from a to b, none where the way does not lead there. */
  const way = (a: number, b: number): number[] => {
    for (const start of beside.get(a) ?? []) {
      const passed: number[] = [];
      let [before, at] = [a, start];
      while (at >= scene_nodes && passed.length < beside.size) {
        passed.push(at);
        const next = beside.get(at)!.find((node) => node !== before);
        if (next === undefined) break;
        [before, at] = [at, next];
      }
      if (at === b) return passed;
    }
    return [];
  };
  const cut = new Set<number>();
  const made: number[] = [];
  const waiting: [number, number, number][] = [];
  for (let t = 0; t < corner.length; t += 3) waiting.push([corner[t]!, corner[t + 1]!, corner[t + 2]!]);
  for (let triangle = waiting.pop(); triangle; triangle = waiting.pop()) {
    const turns = [0, 1, 2].map((k) => [triangle![k]!, triangle![(k + 1) % 3]!, triangle![(k + 2) % 3]!] as const);
    const found = turns.map(([a, b]) => (a < scene_nodes && b < scene_nodes ? way(a, b) : []));
    const k = found.findIndex((passed) => passed.length > 0);
    if (k < 0) {
      made.push(...triangle);
      continue;
    }
    const [a, b, apex] = turns[k]!;
    cut.add(edge_key(a, b));
    const chain = [a, ...found[k]!, b];
    for (let i = 1; i < chain.length; ++i) waiting.push([chain[i - 1]!, chain[i]!, apex]);
  }
  return { corner: Uint32Array.from(made), cut };
}

/** A third of each triangle's area is its corner's, or half of each edge's length where there are no triangles. */
function node_areas(rest: Float32Array, corner: Uint32Array, edge: Uint32Array, nodes: number): Float32Array {
  const area = new Float32Array(nodes);
  const way = (a: number, b: number) => [0, 1, 2].map((k) => rest[3 * b + k]! - rest[3 * a + k]!) as Vec3;
  for (let t = 0; t < corner.length; t += 3) {
    const [a, b, c] = [corner[t]!, corner[t + 1]!, corner[t + 2]!];
    const share = norm(cross(way(a, b), way(a, c))) / 6;
    for (const node of [a, b, c]) area[node]! += share;
  }
  for (let e = 0; corner.length === 0 && e < edge.length; e += 2) {
    const half = norm(way(edge[e]!, edge[e + 1]!)) / 2;
    area[edge[e]!]! += half;
    area[edge[e + 1]!]! += half;
  }
  return area;
}

/** Of a scene and the patch in it, if any. */
export function make_topology(scene: Scene, patch: Patch | null): Topology {
  const scene_nodes = scene.held.length;
  const nodes = scene_nodes + (patch ? patch.position.length / 3 : 0);
  const rest = new Float32Array(3 * nodes);
  rest.set(scene.position);
  if (patch) rest.set(patch.position, scene.position.length);
  const welded = patch ? weld(scene, patch) : new Int32Array(0);
  const drawn = (i: number) => (welded[i]! >= 0 ? welded[i]! : scene_nodes + i);

  const fine = patch?.triangle ?? new Uint32Array(0);
  const hidden = new Uint8Array(scene.triangle.length / 3);
  if (patch && fine.length > 0) for (const t of patch.hidden) hidden[t] = 1;
  const corner = new Uint32Array(scene.triangle.length + fine.length);
  const material_of = new Uint8Array(corner.length / 3);
  let corners = 0;
  for (let t = 0; t < hidden.length; ++t) {
    if (hidden[t]) continue;
    material_of[corners / 3] = scene.material[t] ?? 0;
    for (let i = 0; i < 3; ++i) corner[corners++] = scene.triangle[3 * t + i]!;
  }
  for (let t = 0; t < fine.length / 3; ++t) material_of[corners / 3 + t] = patch?.material[t] ?? 0;
  for (let i = 0; i < fine.length; ++i) corner[corners++] = drawn(fine[i]!);

  const outline = Uint32Array.from(patch?.outline ?? [], drawn);
  let all = corner.slice(0, corners);
  let cut = new Set<number>();
  const edge_key = (a: number, b: number) => Math.min(a, b) * nodes + Math.max(a, b);
  const is_plane = scene.dimension === 2 && corners > 0;
  if (is_plane && outline.length > 0) ({ corner: all, cut } = follow_boundary(all, outline, scene_nodes, edge_key));
  const { vertex, node, material } = split_at_creases(rest, all, nodes, material_of);
  if (!patch) {
    const area = node_areas(rest, all, scene.edge, nodes);
    return { nodes, scene_nodes, node, material, triangle: vertex, corner: all, edge: scene.edge, outline, welded, rest, area };
  }
  const edge: number[] = fine.length > 0 || is_plane ? [...outline] : [];
  const sides = triangles_beside(scene);
  for (let e = 0; e < scene.edge.length; e += 2) {
    const [a, b] = [sides[e]!, sides[e + 1]!];
    const is_hidden = a >= 0 && hidden[a] === 1 && (b < 0 || hidden[b] === 1);
    if (!is_hidden && !cut.has(edge_key(scene.edge[e]!, scene.edge[e + 1]!))) edge.push(scene.edge[e]!, scene.edge[e + 1]!);
  }
  // An edge within the patch is met once in either sense; the others are its outline.
  for (let at = 0; at < fine.length; ++at) {
    const a = fine[at]!;
    const b = fine[at - (at % 3) + ((at + 1) % 3)]!;
    if (a < b) edge.push(drawn(a), drawn(b));
  }
  const edges = Uint32Array.from(edge);
  const area = node_areas(rest, all, edges, nodes);
  return { nodes, scene_nodes, node, material, triangle: vertex, corner: all, edge: edges, outline, welded, rest, area };
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
