// Floor, room and obstacle as lines.
import assert from 'node:assert/strict';
import { test } from 'node:test';
import { Box3, Vector3 } from 'three';
import { wall_lines } from '../src/walls';

const box = new Box3(new Vector3(0, 0, 0), new Vector3(0.2, 0.1, 0.1));
const flat = new Box3(new Vector3(0, 0, 0), new Vector3(0.2, 0.1, 0));

test('without walls nothing is drawn', () => {
  assert.deepEqual(wall_lines({}, box, false), { lines: [], floor: null });
});

test('a floor lies at its height and goes on beside the body', () => {
  const { lines, floor } = wall_lines({ floor: '-0.05' }, box, false);
  assert.equal(floor, -0.05);
  assert.ok(lines.every(([, , z]) => z === -0.05));
  assert.ok(Math.min(...lines.map(([x]) => x)) <= -0.2 && Math.max(...lines.map(([x]) => x)) >= 0.4);
});

test('in the plane hatches are on the side that the body cannot be on', () => {
  const room = [-0.1, -0.05, -1, 0.3, 0.3, 1];
  const { lines, floor } = wall_lines({ room: room.join() }, flat, true);
  assert.equal(floor, -0.05);
  const inside = ([x, y]: number[]) => x! > room[0]! + 1e-9 && x! < room[3]! - 1e-9 && y! > room[1]! + 1e-9;
  assert.ok(lines.length > 60);
  assert.ok(lines.every((at) => !inside(at) && at[2] === 0));
});

test('a room has no lid, an obstacle all of its edges', () => {
  const lid = (lines: number[][]) => lines.filter((at, k) => k % 2 === 0 && at[2] === 0.5 && lines[k + 1]![2] === 0.5).length;
  assert.equal(lid(wall_lines({ room: '-1,-1,-0.5,1,1,0.5' }, box, false).lines), 0);
  assert.equal(lid(wall_lines({ obstacle: '-1,-1,-0.5,1,1,0.5' }, box, false).lines), 4);
  assert.equal(wall_lines({ obstacle: '-1,-1,-0.5,1,1,0.5' }, box, false).lines.length, 24);
});
