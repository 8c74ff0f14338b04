import assert from 'node:assert/strict';
import { test } from 'node:test';
import { displacements, fill_dent, fill_field, mean_values } from '../src/field';
import { boundary_edges } from '../src/pick';
import { make_topology, vertex_normals } from '../src/topology';
import type { Frame, Patch, Scene } from '../src/wire';

const one_material = {
  material: new Uint8Array(0),
  inner: { position: new Float32Array(0), triangle: new Uint32Array(0), inside: new Uint8Array(0), outside: new Uint8Array(0) },
};

// The unit cube, each face two triangles.
const corners = [0, 1, 2, 3, 4, 5, 6, 7].flatMap((i) => [i & 1, (i >> 1) & 1, i >> 2]);
const facets = [
  [0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5],
].flatMap(([a, b, c, d]) => [a!, b!, c!, a!, c!, d!]);
const cube: Scene = {
  kind: 'scene',
  number: 1,
  dimension: 3,
  position: Float32Array.from(corners),
  triangle: Uint32Array.from(facets),
  edge: Uint32Array.from([0, 1, 4, 5, 0, 4, 4, 6]),
  held: new Uint8Array(8),
  ...one_material,
};
// The top, whose triangles are 2 and 3, by four triangles about its middle.
const patch: Patch = {
  kind: 'patch',
  scene: 1,
  number: 1,
  hidden: Uint32Array.from([2, 3]),
  position: Float32Array.from([0, 0, 1, 1, 0, 1, 1, 1, 1, 0, 1, 1, 0.5, 0.5, 1]),
  triangle: Uint32Array.from([0, 1, 4, 1, 2, 4, 2, 3, 4, 3, 0, 4]),
  outline: Uint32Array.from([0, 1, 1, 2, 2, 3, 3, 0]),
  material: new Uint8Array(0),
};

test('each side of a cube has its own normals', () => {
  const topology = make_topology(cube, null);
  assert.equal(topology.node.length, 24);
  assert.deepEqual([...topology.node.slice(0, 8)], [0, 1, 2, 3, 4, 5, 6, 7]);
  const position = Float32Array.from([...topology.node].flatMap((i) => [...cube.position.slice(3 * i, 3 * i + 3)]));
  const normal = new Float32Array(position.length);
  vertex_normals(position, topology.triangle, normal);
  for (let i = 0; i < normal.length; i += 3) {
    const sizes = [...normal.slice(i, i + 3)].map(Math.abs).sort();
    assert.deepEqual(sizes, [0, 0, 1]);
  }
  for (let t = 0; t < topology.triangle.length; ++t) assert.equal(topology.node[topology.triangle[t]!], topology.corner[t]);
});

/** Of closed triangles, by the theorem of Gauss. */
function volume(position: Float32Array, corner: Uint32Array): number {
  let sum = 0;
  for (let t = 0; t < corner.length; t += 3) {
    const [a, b, c] = [0, 1, 2].map((i) => [...position.slice(3 * corner[t + i]!, 3 * corner[t + i]! + 3)]) as [number[], number[], number[]];
    sum += a[0]! * (b[1]! * c[2]! - b[2]! * c[1]!) + a[1]! * (b[2]! * c[0]! - b[0]! * c[2]!) + a[2]! * (b[0]! * c[1]! - b[1]! * c[0]!);
  }
  return sum / 6;
}

test('a patch closes the hole of what it hides', () => {
  const topology = make_topology(cube, patch);
  assert.equal(topology.corner.length / 3, 12 - 2 + 4);
  assert.ok(Math.abs(volume(topology.rest, topology.corner) - 1) < 1e-6);
  assert.deepEqual([...topology.welded], [4, 5, 7, 6, -1]);
  const sides = new Map<string, number>(); // each edge once in either sense: no gap, nothing twice
  for (let t = 0; t < topology.corner.length; t += 3) {
    for (let i = 0; i < 3; ++i) {
      const [a, b] = [topology.corner[t + i]!, topology.corner[t + ((i + 1) % 3)]!];
      sides.set(`${a},${b}`, (sides.get(`${a},${b}`) ?? 0) + 1);
    }
  }
  for (const [edge, count] of sides) {
    assert.equal(count, 1);
    assert.equal(sides.get(edge.split(',').reverse().join(',')), 1);
  }
});

test('sides of two materials do not share vertices', () => {
  const material = Uint8Array.from({ length: 12 }, (_, t) => (t === 2 ? 1 : 0)); // one half of the top
  const topology = make_topology({ ...cube, material }, null);
  const of = (t: number) => [0, 1, 2].map((k) => topology.triangle[3 * t + k]!);
  assert.ok(of(2).every((vertex) => topology.material[vertex] === 1));
  assert.ok(of(3).every((vertex) => topology.material[vertex] === 0));
  assert.equal(topology.node.length, 24 + 2); // the two nodes of the diagonal once more
});

test('edges that only hidden triangles have are not drawn', () => {
  const diagonal: Scene = { ...cube, edge: Uint32Array.from([4, 5, 4, 7, 0, 4]) }; // 4-7 lies within the top
  const { edge } = make_topology(diagonal, patch);
  const drawn = new Set<string>();
  for (let e = 0; e < edge.length; e += 2) drawn.add([edge[e]!, edge[e + 1]!].sort((a, b) => a - b).join());
  // The outline on the scene's own nodes, the four spokes to the patch's middle, and what is left of the scene.
  assert.deepEqual([...drawn].sort(), ['0,4', '4,12', '4,5', '4,6', '5,12', '5,7', '6,12', '6,7', '7,12'].sort());
  assert.deepEqual([...make_topology(diagonal, null).edge], [4, 5, 4, 7, 0, 4]);
});

const frame: Frame = {
  kind: 'frame', scene: 1, tick: 1, time: 0, patch: 1, status: 0, force_error: 0, left_out: 0, greens_error: 0,
  tool: new Float32Array(7), device: new Float32Array(7), force: new Float32Array(3), torque: new Float32Array(3),
  number: 1, base: 0, version: 1, unit_u: 0.5, unit_stress: 10,
  contact: new Float32Array(0),
  pressure_node: Uint32Array.from([1, 8 + 1, 8 + 4]), pressure: Float32Array.from([7, 30, 20]),
  u: Int16Array.from({ length: 24 }, (_, i) => i),
  stress: Uint16Array.from([2, 3, 4, 0, 6, 7, 8, 9]),
  patch_u: Int16Array.from({ length: 15 }, (_, i) => -i),
  patch_stress: Uint16Array.from([51, 0, 53, 54, 55]),
};

test('numbers of a welded node are the patch’s', () => {
  const topology = make_topology(cube, patch);
  const [u, value, known] = [new Float32Array(39), new Float32Array(13), new Float32Array(13)];
  displacements(frame, topology, u);
  assert.deepEqual([...u.slice(3, 6)], [1.5, 2, 2.5]); // node 1
  assert.deepEqual([...u.slice(15, 18)], [-1.5, -2, -2.5]); // node 5 is the patch's 1
  assert.deepEqual([...u.slice(36, 39)], [-6, -6.5, -7]);

  assert.equal(fill_field('von-mises', frame, topology, u, value, known), 540);
  assert.deepEqual([value[0], value[4], value[12]], [10, 500, 540]);
  assert.deepEqual([known[0], known[3], known[5], known[12]], [1, 0, 0, 1]);

  assert.equal(fill_field('pressure', frame, topology, u, value, known), 30);
  assert.deepEqual([value[0], value[1], value[5], value[12]], [0, 7, 30, 20]);

  assert.equal(fill_field('y', frame, topology, u, value, known), 6.5); // of the patch's middle
  assert.equal(value[3], 5);
  assert.equal(value[7], -3.5);
});

test('in the plane the body ends where a patch has its boundary', () => {
  const square: Scene = {
    kind: 'scene', number: 1, dimension: 2,
    position: Float32Array.from([0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0]),
    triangle: Uint32Array.from([0, 1, 2, 0, 2, 3]), edge: Uint32Array.from([0, 1, 1, 2, 2, 3, 3, 0]), held: new Uint8Array(4), ...one_material,
  };
  const upper: Patch = {
    kind: 'patch', scene: 1, number: 1, hidden: new Uint32Array(0), triangle: new Uint32Array(0),
    position: Float32Array.from([1, 1, 0, 0.7, 1, 0, 0.3, 1, 0, 0, 1, 0, 0, 0.5, 0, 0, 0, 0]), // from the right upper corner, left and down
    outline: Uint32Array.from([0, 1, 1, 2, 2, 3, 3, 4, 4, 5]),
    material: new Uint8Array(0),
  };
  const { corner, edge, area } = make_topology(square, upper);
  const boundary = boundary_edges(corner, 10);
  const next = new Map(Array.from({ length: boundary.length / 2 }, (_, e) => [boundary[2 * e]!, boundary[2 * e + 1]!]));
  const round = [0];
  while (round.length < 9 && next.get(round.at(-1)!) !== 0) round.push(next.get(round.at(-1)!)!);
  assert.deepEqual(round, [0, 1, 2, 5, 6, 3, 8]);
  assert.ok(Math.abs(area.reduce((sum, one) => sum + one, 0) - 1) < 1e-6);
  const drawn = Array.from({ length: edge.length / 2 }, (_, e) => [edge[2 * e]!, edge[2 * e + 1]!].sort((a, b) => a - b).join()).sort();
  assert.deepEqual(drawn, ['0,1', '1,2', '2,5', '5,6', '3,6', '3,8', '0,8'].sort());
});

test('magnitudes', () => {
  const topology = make_topology(cube, null);
  const [u, value, known] = [new Float32Array(24), new Float32Array(8), new Float32Array(8)];
  displacements(frame, topology, u);
  const largest = fill_field('magnitude', frame, topology, u, value, known);
  assert.ok(Math.abs(largest - 0.5 * Math.hypot(21, 22, 23)) < 1e-4);
  assert.ok(Math.abs(value[1]! - 0.5 * Math.hypot(3, 4, 5)) < 1e-5);
});

test('where the tool holds a node its stress is not known: it is that of a point', () => {
  const topology = make_topology(cube, null);
  const stress = Uint16Array.from({ length: 8 }, (_, i) => (i === 7 ? 60001 : 1 + i));
  const u = new Float32Array(24);
  const largest = (held: number) => {
    const frame = { stress, patch_stress: new Uint16Array(0), unit_stress: 2, contact: Float32Array.from([0.9, 1, 1.1, 0, 0, 1, 0, 0, -1, held]) } as unknown as Frame;
    const [value, known] = [new Float32Array(topology.nodes), new Float32Array(topology.nodes)];
    return [fill_field('von-mises', frame, topology, u, value, known), known[7], known[6]];
  };
  assert.deepEqual(largest(0), [120000, 1, 1]);
  assert.deepEqual(largest(1), [12, 0, 1]);
});

test('a dent is how far nodes have gone with the force since the tool was away, near the tool', () => {
  const topology = make_topology(cube, null);
  const fell = Float32Array.from({ length: 24 }, (_, i) => (i % 3 === 2 ? -3 : 0)); // all of it, before the tool came
  const u = fell.slice();
  u[3 * 7 + 2]! -= 0.8; // then the corner (1, 1, 1) was pressed
  const frame = { force: [0, 0, -2], tool: Float32Array.from([1, 1, -2.8, 0, 0, 0, 1]) } as unknown as Frame;
  const value = new Float32Array(topology.nodes);
  fill_dent(frame, topology, u, fell, 10, value);
  assert.ok(Math.abs(value[7]! - 0.07) < 2e-3, `${value[7]}`); // (0.8 - some 0.1) of 10
  assert.ok([...value].slice(0, 7).every((one) => one === 0));
  fill_dent(frame, topology, u, fell, 0.1, value);
  assert.ok(value[7]! <= 8 && value[7]! > 1, `${value[7]}`);
  frame.tool[0] = 5; // far from there
  fill_dent(frame, topology, u, fell, 0.1, value);
  assert.ok(value[7]! < 1e-2, `${value[7]}`);
});

test('between the values of a closed surface lie those within', () => {
  const surface = { position: cube.position, normal: [], triangle: cube.triangle };
  const at = (x: number, y: number, z: number, value: number[]) => mean_values([x, y, z], surface, value)[0]!;
  assert.ok(Math.abs(at(0.3, 0.6, 0.2, Array(8).fill(7)) - 7) < 1e-6);
  const height = [0, 0, 0, 0, 1, 1, 1, 1];
  assert.ok(Math.abs(at(0.5, 0.5, 0.5, height) - 0.5) < 1e-6);
  const [low, high] = [at(0.5, 0.5, 0.2, height), at(0.5, 0.5, 0.8, height)];
  for (const z of [-0.3, -0.01, 1.01, 1.3]) assert.ok(at(0.9, 0.9, z, height) >= 0 && at(0.9, 0.9, z, height) <= 1); // outside
  assert.ok(low > 0 && low < 0.35 && high > 0.65 && high < 1, `${low} ${high}`);
});
