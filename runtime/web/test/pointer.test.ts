import assert from 'node:assert/strict';
import { test } from 'node:test';
import { boundary_edges, follow_in_plane, is_inside, pick_boundary, pick_surface, thickness_below } from '../src/pick';
import { disc_profile, dot, minus, norm, normalised, parse_tool, plus, pressed_position, ray_meets_plane, tool_text, turn_onto, turned_depth } from '../src/pose';
import { frame_at } from '../src/replay_bar';
import { scale_of } from '../src/view_controls';
import type { Quaternion, Vec3 } from '../src/words';

const close = (a: number[], b: number[], within = 1e-12) => {
  assert.equal(a.length, b.length);
  a.forEach((one, i) => assert.ok(Math.abs(one - b[i]!) <= within, `${a} is not ${b}`));
};

/** q v q*, written out. */
function turned([x, y, z, w]: Quaternion, v: Vec3): Vec3 {
  const t: Vec3 = [2 * (y * v[2] - z * v[1]), 2 * (z * v[0] - x * v[2]), 2 * (x * v[1] - y * v[0])];
  return [
    v[0] + w * t[0] + y * t[2] - z * t[1],
    v[1] + w * t[1] + z * t[0] - x * t[2],
    v[2] + w * t[2] + x * t[1] - y * t[0],
  ];
}

test('the lowest point of a pressed sphere is its depth below the surface', () => {
  const normal = normalised([1, -2, 3]);
  const point: Vec3 = [0.1, 0.2, 0.3];
  const centre = pressed_position(point, normal, 0.005, 0.002);
  const lowest = plus(centre, normal, -0.005);
  close([dot(minus(point, lowest), normal)], [0.002]);
  close([norm(minus(minus(point, lowest), plus([0, 0, 0], normal, 0.002)))], [0]);
  close(pressed_position(point, normal, 0, 0.002), plus(point, normal, -0.002)); // a point tool
});

test('the tool turns its own axis onto the normal', () => {
  for (const n of [[0, 0, 1], [0, 0, -1], [1, 0, 0], [0.3, -0.5, -0.9], [-1, 1e-4, -1e-3]] as Vec3[]) {
    const normal = normalised(n);
    const turn = turn_onto(normal, 3);
    close([Math.hypot(...turn)], [1]);
    close(turned(turn, [0, 0, 1]), normal, 1e-6);
  }
  for (const angle of [0, 1, 2, 3, -2]) {
    const normal: Vec3 = [Math.cos(angle), Math.sin(angle), 0];
    const turn = turn_onto(normal, 2);
    close(turned(turn, [0, 1, 0]), normal);
    close([turn[0], turn[1]], [0, 0]); // about z alone
  }
});

// A unit cube's top and its left side, with vertex normals as at a smooth edge.
const tilted = normalised([-1, 0, 1]);
const two_faces = {
  position: [0, 0, 1, 1, 0, 1, 1, 1, 1, 0, 1, 1, 0, 0, 0, 0, 1, 0],
  normal: [...tilted, 0, 0, 1, 0, 0, 1, ...tilted, -1, 0, 0, -1, 0, 0],
  triangle: [0, 1, 2, 0, 2, 3, 0, 3, 5, 0, 5, 4],
};

test('a ray finds the nearest triangle that it enters from outside', () => {
  const above = pick_surface(two_faces, [0.7, 0.3, 5], [0, 0, -1]);
  close(above!.point, [0.7, 0.3, 1]);
  assert.ok(above!.normal[2] > 0.9);
  const aside = pick_surface(two_faces, [-3, 0.5, 0.25], [1, 0, 0]);
  close(aside!.point, [0, 0.5, 0.25]);
  assert.equal(pick_surface(two_faces, [0.7, 0.3, -5], [0, 0, 1]), null); // from behind
  assert.equal(pick_surface(two_faces, [1.7, 0.3, 5], [0, 0, -1]), null);
  assert.equal(pick_surface(two_faces, [0.7, 0.3, 0.5], [0, 0, -1]), null); // behind the eye
});

test('how thick the body is below a point of its surface', () => {
  // A wedge: its top is z = 1, its bottom z = x / 2, over 0 < x < 2, 0 < y < 1.
  const wedge = {
    position: [0, 0, 1, 2, 0, 1, 2, 1, 1, 0, 1, 1, 0, 0, 0, 2, 0, 1, 2, 1, 1, 0, 1, 0],
    normal: [],
    triangle: [0, 1, 2, 0, 2, 3, 4, 6, 5, 4, 7, 6],
  };
  for (const x of [0.1, 0.5, 1, 1.9]) close([thickness_below(wedge, { point: [x, 0.3, 1], normal: [0, 0, 1] })], [1 - x / 2]);
  const slope = normalised([1, 0, -2]);
  close([thickness_below(wedge, { point: [1, 0.6, 0.5], normal: slope })], [Math.hypot(0.25, 0.5)]);
  assert.equal(thickness_below(wedge, { point: [3, 0.3, 1], normal: [0, 0, 1] }), Infinity);
});

test('beside a sharp edge the normal is the facet’s', () => {
  close(pick_surface(two_faces, [0.02, 0.5, 5], [0, 0, -1])!.normal, [0, 0, 1]);
});

test('the boundary of triangles has the body on its left', () => {
  const square = [0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0];
  const edges = boundary_edges([0, 1, 2, 0, 2, 3], 4);
  assert.deepEqual([...edges].sort(), [0, 0, 1, 1, 2, 2, 3, 3]);
  for (let e = 0; e < edges.length; e += 2) {
    const [a, b] = [edges[e]!, edges[e + 1]!];
    const along = [square[3 * b]! - square[3 * a]!, square[3 * b + 1]! - square[3 * a + 1]!];
    const inward = [0.5 - square[3 * a]!, 0.5 - square[3 * a + 1]!];
    assert.ok(along[0]! * inward[1]! - along[1]! * inward[0]! > 0);
  }
  const hit = pick_boundary(square, edges, [0.4, 1.05, 0], 0.1);
  close(hit!.point, [0.4, 1, 0]);
  close(hit!.normal, [0, 1, 0]);
  close(pick_boundary(square, edges, [0.4, 0.96, 0], 0.1)!.normal, [0, 1, 0]); // from inside: still outward
  assert.equal(pick_boundary(square, edges, [0.5, 0.5, 0], 0.1), null);
});

test('in the plane a press follows the pointer into the body, and stays on its side', () => {
  const square = [0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0];
  const edges = boundary_edges([0, 1, 2, 0, 2, 3], 4);
  assert.ok(is_inside(square, edges, [0.5, 0.3, 0]) && is_inside(square, edges, [0.01, 0.99, 0]));
  assert.ok(!is_inside(square, edges, [0.5, 1.01, 0]) && !is_inside(square, edges, [-0.1, 0.5, 0]));
  let now = pick_boundary(square, edges, [0.5, 0.9, 0], Infinity)!; // from within, as far as it is
  close(now.point, [0.5, 1, 0]);
  for (const [x, y, deeper] of [[0.5, 0.8, 0.2], [0.45, 0.7, 0.3], [0.45, 0.2, 0.8], [0.45, 1.1, 0]] as const) {
    const place: Vec3 = [x, y, 0];
    const followed = follow_in_plane(now, pick_boundary(square, edges, place, Infinity)!, place);
    close([followed.deeper], [deeper]);
    close(followed.hit.normal, [0, 1, 0]);
    now = followed.hit;
  }
  const above = ({ normal }: { normal: Vec3 }) => normal[1] >= 0; // of a body that lies on a floor
  close(pick_boundary(square, edges, [0.6, 0.1, 0], Infinity, above)!.normal, [1, 0, 0]);
});

test('a ray meets the plane that it looks at', () => {
  close(ray_meets_plane([1, 2, 5], [0, 0, -1], [0, 0, 2], [0, 0, 1])!, [1, 2, 2]);
  assert.equal(ray_meets_plane([1, 2, 5], [0, 0, 1], [0, 0, 2], [0, 0, 1]), null);
  assert.equal(ray_meets_plane([1, 2, 5], [1, 0, 0], [0, 0, 2], [0, 0, 1]), null);
});

test('the wheel turns the depth by tenths, never out of the surface', () => {
  close([turned_depth(0.01, -100, 0.01)], [0.011]);
  close([turned_depth(0.01, 200, 0.01)], [0.008]);
  assert.equal(turned_depth(0.0005, 500, 0.01), 0);
});

test('shapes as the option has them', () => {
  assert.deepEqual(parse_tool('capsule:0.004,0.02'), { radius: 0.004, length: 0.02, disc_radius: 0 });
  assert.deepEqual(parse_tool('sphere:5e-3'), { radius: 0.005, length: 0, disc_radius: 0 });
  assert.deepEqual(parse_tool(undefined), { radius: 0, length: 0, disc_radius: 0 });
  assert.equal(tool_text('capsule', 0.004, 0.02), 'capsule:0.004,0.02');
  assert.equal(tool_text('point', 0.004, 0.02), 'point');
  assert.deepEqual(parse_tool('disc:0.01,0.002'), { radius: 0.002, length: 0, disc_radius: 0.01 });
  assert.deepEqual(parse_tool('disc:0.01'), { radius: 0.001, length: 0, disc_radius: 0.01 });
  assert.equal(tool_text('disc', 0.01, 0.02), 'disc:0.01');
  assert.equal(tool_text('disc', 0.01, 0.02, 0.002), 'disc:0.01,0.002');
});

test('a disc is drawn flat, round at its edge and as wide as it is', () => {
  const profile = disc_profile(0.01, 0.002, 8);
  assert.deepEqual([profile[0], profile.at(-1)], [[0, -0.002], [0, 0.002]]);
  assert.equal(Math.max(...profile.map(([r]) => r)), 0.01);
  for (const [r, height] of profile) {
    const from_core = Math.hypot(Math.max(0, r - 0.008), height);
    assert.ok(Math.abs(from_core - 0.002) < 1e-15);
  }
});

test('a slider of displacements is logarithmic, true to scale in the middle', () => {
  assert.equal(scale_of(0), 0);
  assert.equal(scale_of(50), 1);
  close([scale_of(100), scale_of(75) ** 2, scale_of(25) * scale_of(75)], [20, 20, 1]);
});

test('the frame at a time is the last that was', () => {
  const times = [0, 0.1, 0.2, 0.5];
  assert.deepEqual([-1, 0, 0.15, 0.2, 0.49, 9].map((time) => frame_at(times, time)), [0, 0, 1, 2, 2, 3]);
});
