// What tests of the page do with the cube: open it, press it, record it.
import assert from 'node:assert/strict';
import { writeFile } from 'node:fs/promises';
import path from 'node:path';
import { bake, cube, folder, project, ready, run, runtime, serve, told, until, visit } from './harness.mjs';

export const top = [0.5, 0.5, 1]; // a node of the cube, which its 6 cells an edge have there

/// The cube in a folder of its own, for pages to come: { at, file, served }.
export async function serve_cube(t, { cells = 6, args = ['--tool', 'point'], toml = '' } = {}) {
  const at = await folder(t);
  const file = await bake(at, cube(cells, toml));
  return { at, file, served: await serve(t, ['play', file, '--view', '--view-address', '127.0.0.1:0', ...args], at) };
}

/// The same with a page: { at, file, served, page }.
export async function open_cube(t, { viewport = { width: 1010, height: 640 }, is_drawn = false, ...options } = {}) {
  const cube = await serve_cube(t, options);
  return { ...cube, page: await ready(await visit(t, cube.served.url, { viewport, is_drawn })) };
}

export const part = (page, id) => page.getByTestId(id);

export async function choose(page, mode, depth) {
  await part(page, `mode-${mode}`).check({ force: true });
  if (depth !== undefined) {
    await part(page, 'depth').fill(String(1000 * depth));
    await part(page, 'depth').press('Enter');
  }
}

/// The force once it no longer changes in 20 ticks, of which the tool needs some to follow the pointer.
export async function settled(page) {
  await page.evaluate(() => (window.settling = null));
  await until(page, () => {
    const now = window.palpate.lastFrame;
    const then = window.settling;
    if (!now) return false;
    if (!then || now.tick < then.tick || now.tick >= then.tick + 20) window.settling = now;
    const size = Math.hypot(...now.force);
    return then && now.contacts > 0 && now.tick >= then.tick + 20 && Math.hypot(...now.force.map((f, k) => f - then.force[k])) < 1e-4 * size;
  });
  return told(page, 'lastFrame');
}

/// Presses at a place of the body until it rests, and lifts: the frame before that. `firmer`: force over depth [N/m], by 3 % of which it is to be
/// softer first (an overlay's mesh is made beside the ticks, which go on without it).
export async function pressed(page, place, firmer = null) {
  const { x, y } = await project(page, place);
  await page.mouse.move(x, y);
  await page.mouse.down();
  if (firmer !== null) {
    await until(
      page,
      (last) => {
        const { contacts, force, depth } = window.palpate.lastFrame;
        return contacts > 0 && Math.abs(force[2] / depth) < 0.97 * Math.abs(last);
      },
      firmer,
    );
  }
  const felt = await settled(page);
  await page.mouse.up();
  return felt;
}

/// The force on the body [N] that displaces the top's node by `d` [m], by the sparse route of its own command.
export async function probe(file, d) {
  const { stdout } = await run(runtime, ['probe', file, '--at', top.join(), '--displace', d.join(), '--json']);
  return JSON.parse(stdout).nodes[0].force;
}

/// Records a scripted push of the cube, by a point or a ball.
export async function recorded(t, at, radius = 0, ...options) {
  const file = await bake(at, cube(6));
  const touch = path.join(at, 'touch.csv');
  const row = (time, z) => `${time},0.5,0.5,${z + radius}\n`;
  await writeFile(touch, `t,x,y,z\n${row(0, 1.1)}${row(0.5, 0.95)}${row(1, 0.95)}${row(1.5, 1.1)}`);
  const session = path.join(at, 'push.mcap');
  const tool = radius > 0 ? `sphere:${radius}` : 'point';
  await run(runtime, ['play', file, '--device', `script:${touch}`, '--fast', '--record', session, '--tool', tool, ...options], { cwd: at });
  return session;
}

/// Seeks from frame to frame: the force is there in the middle, and not at the ends.
export async function leaf_through(page) {
  const { frames } = await told(page, 'state');
  assert.ok(frames > 40, `${frames} frames`);
  const seek = async (frame) => {
    await page.evaluate((value) => {
      const scrub = document.querySelector('[data-testid="scrub"]');
      scrub.value = String(value);
      scrub.dispatchEvent(new Event('input'));
    }, frame);
  };
  await seek(Math.floor(frames / 2));
  await until(page, () => window.palpate.lastFrame.force[2] < -1e-3);
  // It plays by the clock: a machine that is busy may show nothing of the second in which it is pressed.
  for (let round = 0, pressed = false; !pressed; ++round) {
    assert.ok(round < 10, 'played ten times and never pressed');
    await seek(0);
    await until(page, () => window.palpate.lastFrame.force[2] === 0);
    await part(page, 'replay-play').click();
    pressed = await page
      .waitForFunction(() => window.palpate.lastFrame.force[2] < -1e-3, undefined, { polling: 20, timeout: 10000 })
      .then(() => true, () => false);
  }
  assert.deepEqual(page.complaints, []);
}
