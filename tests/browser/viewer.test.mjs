// The viewer's page in a real browser, against the real runtime.
import assert from 'node:assert/strict';
import { createServer, request } from 'node:http';
import { spawn } from 'node:child_process';
import { readFile, rm, writeFile } from 'node:fs/promises';
import path from 'node:path';
import { after, test } from 'node:test';
import { bake, close, cube, example, folder, near, open, project, ready, run, runtime, serve, shelf, source, told, until, visit } from './harness.mjs';

after(close);

const top = [0.5, 0.5, 1]; // a node of the cube, which its 6 cells an edge have there

/// The cube with a page, in a folder of its own: { at, file, page, served }.
async function open_cube(t, { cells = 6, args = ['--tool', 'point'], toml = '' } = {}) {
  const at = await folder(t);
  const file = await bake(at, cube(cells, toml));
  const served = await serve(t, ['play', file, '--view', '--view-address', '127.0.0.1:0', ...args], at);
  const page = await ready(await visit(t, served.url));
  return { at, file, served, page };
}

const part = (page, id) => page.getByTestId(id);

async function choose(page, mode, depth) {
  await part(page, `mode-${mode}`).check({ force: true });
  if (depth !== undefined) {
    await part(page, 'depth').fill(String(1000 * depth));
    await part(page, 'depth').press('Enter');
  }
}

/// The force once it no longer changes from picture to picture.
async function settled(page) {
  await until(page, () => {
    const now = window.palpate.lastFrame;
    const then = window.settling;
    window.settling = now;
    const size = Math.hypot(...now.force);
    return then && now.contacts > 0 && now.tick > then.tick && Math.hypot(...now.force.map((f, k) => f - then.force[k])) < 1e-4 * size;
  });
  return told(page, 'lastFrame');
}

/// The force on the body [N] that displaces the top's node by `d` [m], by the sparse route of its own command.
async function probe(file, d) {
  const { stdout } = await run(runtime, ['probe', file, '--at', top.join(), '--displace', d.join(), '--json']);
  return JSON.parse(stdout).nodes[0].force;
}

test('the page comes whole from the runtime and asks nobody else', async (t) => {
  const { page } = await open_cube(t);
  await assert.doesNotReject(part(page, 'stage').locator('canvas').first().waitFor());
  assert.equal(await part(page, 'model').innerText(), 'cube');
  assert.equal(await part(page, 'connection').innerText(), 'connected');
  assert.match(await part(page, 'role').innerText(), /controller, mouse/);
  assert.deepEqual(page.complaints, []);
});

test('a drag of the mouse gives the force of the finite elements: grabbed and pulled as by probe', async (t) => {
  const { page, file } = await open_cube(t);
  await choose(page, 'grab');
  const { x, y } = await project(page, top);
  await page.mouse.move(x, y);
  await page.mouse.down();
  await page.mouse.move(x + 20, y - 25, { steps: 5 });
  const felt = await settled(page);
  await page.mouse.up();
  const moved = felt.tool.slice(0, 3).map((value, k) => value - top[k]);
  assert.ok(Math.hypot(...moved) > 0.01, `moved by ${moved}`);
  const wanted = await probe(file, moved);
  // The cursor is within a pixel of the node, 1/50 of an element.
  const away = Math.hypot(...felt.force.map((f, k) => f - wanted[k]));
  assert.ok(away < 0.06 * Math.hypot(...wanted), `force ${felt.force}, probe ${wanted}`);
});

test('pressing pushes inwards, deeper is more, by the wheel too, and letting go ends it', async (t) => {
  const { page } = await open_cube(t);
  await choose(page, 'press', 0.02);
  const { x, y } = await project(page, top);
  await page.mouse.move(x, y);
  await page.mouse.down();
  const first = await settled(page);
  assert.ok(first.force[2] < 0 && Math.abs(first.force[2]) > 5 * Math.hypot(first.force[0], first.force[1]), `force ${first.force}`);
  near(first.depth, 1 - first.tool[2], 0.01, 'depth by the tool');
  near(first.depth, 0.02, 0.06, 'depth'); // the coupling gives way
  await page.mouse.wheel(0, -100);
  await until(page, (depth) => window.palpate.lastFrame.depth > 1.2 * depth, first.depth);
  const deeper = await settled(page);
  // Linear as long as it touches one point only.
  near(deeper.force[2] / first.force[2], deeper.depth / first.depth, 0.03, 'force over depth');
  await page.mouse.up();
  await until(page, () => window.palpate.lastFrame.contacts === 0 && Math.hypot(...window.palpate.lastFrame.force) === 0);
});

test('a sphere presses as a script does', async (t) => {
  const { at, file, page } = await open_cube(t, { args: ['--tool', 'sphere:0.1', '--coupling', '100'] });
  await choose(page, 'press', 0.03);
  const { x, y } = await project(page, top);
  await page.mouse.move(x, y);
  await page.mouse.down();
  const felt = await settled(page);
  await page.mouse.up();
  const [px, py, pz] = felt.device;
  const touch = path.join(at, 'touch.csv');
  await writeFile(touch, `t,x,y,z\n0,${px},${py},1.2\n0.5,${px},${py},${pz}\n1.5,${px},${py},${pz}\n`);
  const report = path.join(at, 'report.json');
  const contacts = path.join(at, 'contacts.csv');
  await run(runtime, ['play', file, '--device', `script:${touch}`, '--fast', '--tool', 'sphere:0.1', '--coupling', '100', '--contacts', contacts, '--report', report]);
  const rows = (await readFile(contacts, 'utf8')).trim().split('\n').slice(1).map((line) => line.split(',').map(Number));
  const wanted = [6, 7, 8].map((column) => rows.reduce((sum, row) => sum + row[column], 0));
  const away = Math.hypot(...felt.force.map((f, k) => f - wanted[k]));
  assert.ok(away < 0.01 * Math.hypot(...wanted), `force ${felt.force}, script ${wanted}`);
});

test('fingers press too', async (t) => {
  const { served } = await open_cube(t);
  const first = await open();
  for (const context of first.contexts()) await context.close(); // control is free
  const page = await ready(await visit(t, served.url, { hasTouch: true, isMobile: true, viewport: { width: 420, height: 800 } }));
  await until(page, () => window.palpate.state.you === 'controller');
  const { x, y } = await project(page, top);
  const session = await page.context().newCDPSession(page);
  await session.send('Input.dispatchTouchEvent', { type: 'touchStart', touchPoints: [{ x, y }] });
  const felt = await settled(page);
  assert.ok(felt.force[2] < 0, `force ${felt.force}`);
  await session.send('Input.dispatchTouchEvent', { type: 'touchEnd', touchPoints: [] });
  await until(page, () => window.palpate.lastFrame.contacts === 0);
});

test('plots and numbers follow', async (t) => {
  const { page } = await open_cube(t);
  const drawn = () => page.evaluate(() => [...document.querySelectorAll('[data-testid="plot-force"] canvas')].map((canvas) => canvas.toDataURL()).join());
  const before = await drawn();
  const ticks = await told(page, 'ticks');
  const { x, y } = await project(page, top);
  await page.mouse.move(x, y);
  await page.mouse.down();
  await settled(page);
  await until(page, () => /[1-9]/.test(document.querySelector('[data-testid="force"]').innerText));
  assert.match(await part(page, 'force').innerText(), /N$/);
  assert.match(await part(page, 'depth-felt').innerText(), /m$/);
  assert.notEqual(await drawn(), before);
  assert.ok((await told(page, 'ticks')) > ticks);
  await page.mouse.up();
});

test('pause, a tick at a time, reset', async (t) => {
  const { page } = await open_cube(t);
  await until(page, () => window.palpate.state.ticks > 100);
  await part(page, 'pause').click();
  await until(page, () => window.palpate.state.paused);
  await page.waitForTimeout(700); // what was under way has come
  const { ticks } = await told(page, 'state');
  await page.waitForTimeout(700);
  assert.equal((await told(page, 'state')).ticks, ticks);
  await part(page, 'step').click();
  await until(page, (count) => window.palpate.state.ticks === count + 1, ticks);
  await part(page, 'pause').click();
  await until(page, (count) => window.palpate.state.ticks > count + 50, ticks);
  await part(page, 'reset').click();
  await until(page, (count) => window.palpate.state.ticks < count, (await told(page, 'state')).ticks);
});

test('settings are taken, refused with a reason, and felt', async (t) => {
  const { page } = await open_cube(t, { toml: '[storage]\nscope = "layers"\nlayers = 2\n' });
  await part(page, 'tool-kind').selectOption('sphere');
  await until(page, () => window.palpate.state.settings.tool?.startsWith('sphere:'));
  await part(page, 'radius').fill('100');
  await part(page, 'radius').press('Enter');
  await until(page, () => window.palpate.state.settings.tool === 'sphere:0.1');
  await choose(page, 'press', 0.02);
  const push = async () => {
    const { x, y } = await project(page, top);
    await page.mouse.move(x, y);
    await page.mouse.down();
    const felt = await settled(page);
    await page.mouse.up();
    await until(page, () => window.palpate.lastFrame.contacts === 0);
    return felt.force[2] / felt.depth;
  };
  const once = await push();
  await part(page, 'stiffness-scale').fill('2');
  await part(page, 'stiffness-scale').press('Enter');
  await until(page, () => window.palpate.state.settings['stiffness-scale'] === '2' && !window.palpate.state.busy);
  await until(page, () => window.palpate.ready);
  near((await push()) / once, 2, 0.03, 'force with twice the stiffness');
  await part(page, 'stiffness-scale').fill('1');
  await part(page, 'stiffness-scale').press('Enter');
  await until(page, () => window.palpate.state.settings['stiffness-scale'] === '1' && !window.palpate.state.busy);
  await part(page, 'overlay').click(); // it is checked once the runtime has taken it
  await until(page, () => window.palpate.state.settings.overlay !== undefined && !window.palpate.state.busy);
  const softer = await push();
  assert.ok(Math.abs(softer) < 0.97 * Math.abs(once), `with an overlay ${softer}, without ${once}`);
  await part(page, 'friction').fill('-1');
  await part(page, 'friction').press('Enter');
  await page.getByText(/not a number/).first().waitFor();
  assert.equal(await part(page, 'contact').isDisabled(), true); // the cube has no dynamics
  assert.deepEqual(page.complaints, []);
});

test('a recording begins and ends with the button, and is whole', async (t) => {
  const { page, at } = await open_cube(t);
  await part(page, 'record').click();
  await until(page, () => window.palpate.state.recording);
  const { recording } = await told(page, 'state');
  assert.ok(await part(page, 'tool-kind').isDisabled(), 'settings are locked while it records');
  const { x, y } = await project(page, top);
  await page.mouse.move(x, y);
  await page.mouse.down();
  await settled(page);
  await page.mouse.up();
  await part(page, 'record').click();
  await until(page, () => !window.palpate.state.recording);
  const file = path.resolve(at, recording);
  const { stdout } = await run(runtime, ['session', file, '--json']);
  const told_by_file = JSON.parse(stdout);
  assert.ok(told_by_file.ticks_in_contact > 50 && told_by_file.frames > 10 && told_by_file.device === 'mouse', stdout);
  // The hand is in it: it repeats to the last bit.
  const model = path.join(at, 'model.palpate.hdf');
  await run(runtime, ['play', model, '--device', `replay:${file}`, '--fast', '--report', path.join(at, 'replay.json')]);
  const replay = JSON.parse(await readFile(path.join(at, 'replay.json'), 'utf8'));
  assert.equal(replay.replay.different_ticks, 0);
});

test('a recording that fails says so at once', async (t) => {
  const { page, at } = await open_cube(t);
  await part(page, 'record').click();
  await until(page, () => window.palpate.state.recording && window.palpate.state.ticks > 0);
  const { recording } = await told(page, 'state');
  await rm(path.resolve(at, `${recording}.parts`), { recursive: true });
  await until(page, () => window.palpate.state.recording_failed);
  await page.getByText('Recording failed', { exact: true }).waitFor();
  await page.getByText(/The recording failed, and the run goes on without it: .*No such file/).first().waitFor();
  const before = await told(page, 'state');
  await page.waitForFunction((ticks) => window.palpate.state.ticks > ticks + 100, before.ticks);
  await part(page, 'record').click();
  await until(page, () => !window.palpate.state.recording);
  assert.equal(await part(page, 'record-label').textContent(), 'Record');
});

test('pictures and shapes can be saved', async (t) => {
  const { page } = await open_cube(t);
  const save = async (id) => {
    const [download] = await Promise.all([page.waitForEvent('download'), part(page, id).click()]);
    return readFile(await download.path());
  };
  const stl = await save('save-stl');
  const triangles = stl.readUInt32LE(80);
  assert.equal(stl.length, 84 + 50 * triangles);
  let volume = 0;
  for (let k = 0; k < triangles; ++k) {
    const v = Array.from({ length: 9 }, (_, i) => stl.readFloatLE(84 + 50 * k + 12 + 4 * i));
    volume += (v[0] * (v[4] * v[8] - v[5] * v[7]) - v[1] * (v[3] * v[8] - v[5] * v[6]) + v[2] * (v[3] * v[7] - v[4] * v[6])) / 6;
  }
  near(volume, 1, 1e-5, 'volume of the STL');
  const vtu = (await save('save-vtu')).toString('latin1');
  assert.match(vtu, /<VTKFile type="UnstructuredGrid"/);
  assert.match(vtu, /von_mises/i);
  assert.equal((await save('screenshot')).subarray(1, 4).toString(), 'PNG');
});

test('one steers, any number watch, and control goes on', async (t) => {
  const { page, served } = await open_cube(t);
  const watcher = await ready(await visit(t, served.url));
  const other = await ready(await visit(t, served.url));
  await until(page, () => window.palpate.state.watchers === 3);
  assert.equal((await told(other, 'state')).you, 'watcher');
  assert.equal((await told(watcher, 'state')).you, 'watcher');
  assert.ok(await part(watcher, 'pause').isDisabled());
  const { x, y } = await project(page, top);
  await watcher.mouse.move(x, y); // does nothing
  await watcher.mouse.down();
  await page.waitForTimeout(500);
  assert.equal((await told(page, 'lastFrame')).contacts, 0);
  await watcher.mouse.up();
  await page.mouse.move(x, y);
  await page.mouse.down();
  await settled(page);
  for (const one of [watcher, other]) {
    const seen = await settled(one); // the same is seen by all
    assert.ok(seen.force[2] < 0);
  }
  await page.context().close(); // the pressing hand is gone
  await until(watcher, () => window.palpate.lastFrame.contacts === 0 && !window.palpate.state.controlled);
  await part(watcher, 'control').click();
  await until(watcher, () => window.palpate.state.you === 'controller');
});

test('the page comes back by itself when its connection is lost, and after a reload', async (t) => {
  const { served } = await open_cube(t);
  const page = await visit(t, served.url, {}, () => {
    window.sockets = [];
    window.WebSocket = class extends WebSocket {
      constructor(...args) {
        super(...args);
        window.sockets.push(this);
      }
    };
  });
  await ready(page);
  await page.evaluate(() => window.sockets.at(-1).close());
  await until(page, () => window.sockets.length > 1 && document.querySelector('[data-testid="connection"]').dataset.state === 'live');
  const count = await told(page, 'frames');
  await until(page, (before) => window.palpate.frames > before + 5, count);
  await page.reload();
  await ready(page);
  assert.equal(await part(page, 'connection').innerText(), 'connected');
  const [download] = await Promise.all([page.waitForEvent('download'), part(page, 'save-stl').click()]);
  assert.ok((await readFile(await download.path())).length > 84);
});

test('a program that was started anew has another address, which the page says', async (t) => {
  const { page, served, file, at } = await open_cube(t);
  await served.stop();
  await until(page, () => document.querySelector('[data-testid="connection"]').dataset.state === 'lost');
  const again = await serve(t, ['play', file, '--view', '--view-address', `127.0.0.1:${served.port}`], at);
  await page.getByText('the program was started anew: open the address that it printed').waitFor();
  await page.goto(again.url);
  await ready(page);
});

test('without a tool it is a ball that suits the body, and presses no deeper than the body is thick', async (t) => {
  const at = await folder(t);
  const file = await bake(at, `name = "slab"
[geometry]
box = { origin = [0, 0, 0], size = [1, 1, 0.1], cells = [8, 8, 1] }
[material]
youngs_modulus = 1.0
poissons_ratio = 0.3
[[fixed]]
box = { min = [-1, -1, -1], max = [0.01, 2, 2] }
`, 'slab');
  const served = await serve(t, ['play', file, '--view', '--view-address', '127.0.0.1:0'], at);
  const page = await ready(await visit(t, served.url));
  const { settings, defaults } = await told(page, 'state');
  assert.match(settings.tool, /^sphere:0\.1/); // between 3 and 10 % of 1.42 m
  near(defaults.depth, 0.025, 1e-6, 'a quarter of the least extent');
  assert.equal(await part(page, 'depth').inputValue(), '25');
  assert.equal(await part(page, 'tool-kind').inputValue(), 'sphere');
  // A ball as large as the body's diagonal is none to feel it with.
  await part(page, 'radius').fill('5000');
  await part(page, 'radius').press('Enter');
  await page.getByText(/the tool is 10 m long, and the whole body 1\.418 m/).first().waitFor();
  assert.ok(await part(page, 'refused').isVisible(), 'it stands beside the settings');
  assert.equal((await told(page, 'state')).settings.tool, settings.tool);
  await part(page, 'radius').fill('60');
  await part(page, 'radius').press('Enter');
  await until(page, () => window.palpate.state.settings.tool === 'sphere:0.06');
  assert.ok(await part(page, 'refused').isHidden());
  assert.deepEqual(page.complaints, []);
});

test('a press begins no deeper than a quarter of the thickness, unless it was typed', async (t) => {
  const at = await folder(t);
  // A block with a thin shelf: the box around it is thick.
  const file = await bake(at, await shelf(at), 'shelf');
  const served = await serve(t, ['play', file, '--view', '--view-address', '127.0.0.1:0', '--tool', 'sphere:0.1'], at);
  const page = await ready(await visit(t, served.url));
  const begins = async () => {
    const { x, y } = await project(page, [1.5, 0.5, 1]);
    await page.mouse.move(x, y);
    await page.mouse.down();
    await until(page, () => /mm$/.test(document.querySelector('[data-testid="depth-now"]').innerText));
    const depth = parseFloat(await part(page, 'depth-now').innerText());
    await page.mouse.up();
    return depth;
  };
  near(await begins(), 25, 0.05, 'a quarter of 0.1 m');
  await choose(page, 'press', 0.08);
  near(await begins(), 80, 1e-6, 'as typed');
});

test('overlays are offered as far as the file has layers', async (t) => {
  const { page, served } = await open_cube(t, { toml: '[storage]\nscope = "layers"\nlayers = 1\n' });
  assert.equal((await told(page, 'state')).model.overlay_rings, 1);
  assert.equal(await part(page, 'overlay-rings').getAttribute('max'), '1');
  assert.equal(await part(page, 'overlay-rings').inputValue(), '1');
  await part(page, 'overlay').click();
  await until(page, () => window.palpate.state.settings.overlay === 'r=3,rings=1' && !window.palpate.state.busy);
  await page.evaluate(() => {
    const rings = document.querySelector('[data-testid="overlay-rings"]');
    rings.max = '3'; // as an old page would
    rings.value = '3';
    rings.dispatchEvent(new Event('change'));
  });
  await page.getByText(/layers below the surface for at most 1 rings?, not 3/).first().waitFor();
  assert.ok(await part(page, 'refused').isVisible());
  await page.context().close();
  await served.stop();
  const none = await open_cube(t, { toml: '[storage]\nscope = "surface"\n' });
  assert.equal(await part(none.page, 'overlay').isDisabled(), true);
  assert.ok(await part(none.page, 'overlay-note').isVisible());
  assert.match(await part(none.page, 'overlay-note').innerText(), /keeps no layers below the surface/);
  assert.equal(await part(none.page, 'show-outline').locator('xpath=..').innerText(), 'outline');
});

test('with a hand in the device its faults and its safety are not the page\'s', async (t) => {
  const at = await folder(t);
  const file = await bake(at, cube(4));
  const port = 20000 + (process.pid % 20000);
  const keys = { ...process.env, XDG_RUNTIME_DIR: at };
  const bridge = spawn(example, ['--port', String(port), '--seconds', '600', '--from', '0,0,0.1', '--to', '0,0,0.1'], { env: keys, stdio: 'ignore' });
  t.after(() => bridge.kill('SIGKILL'));
  const safety = 'late=10,most_late=1e9,stale_life=10,silence=5,silence_fade=4';
  const served = await serve(t, ['play', file, '--view', '--view-address', '127.0.0.1:0', '--device', `bridge:${port}`, '--safety', safety], at, { env: keys });
  const page = await ready(await visit(t, served.url));
  assert.equal((await told(page, 'state')).hand, true);
  assert.ok(await part(page, 'hand-note').isVisible());
  bridge.kill('SIGSTOP'); // the partner is silent: it is lost
  await until(page, () => window.palpate.state.fault !== null);
  assert.ok(await part(page, 'acknowledge').isHidden());
  assert.match(await part(page, 'fault').innerText(), /presses Enter/);
  const answer = await page.evaluate(
    (url) =>
      new Promise((resolve) => {
        const socket = new WebSocket(url, 'palpate.1');
        const told = [];
        const wanted = [{ type: 'acknowledge' }, { type: 'change', settings: { safety: 'max_force=1000' } }, { type: 'change', settings: { coupling: '1e9' } }];
        socket.onmessage = (event) => {
          if (typeof event.data !== 'string') return;
          const word = JSON.parse(event.data);
          if (word.type === 'state' && word.you !== 'controller' && !word.controlled) socket.send(JSON.stringify({ type: 'control', take: true }));
          if (word.type === 'state' && word.you === 'controller' && told.length === 0) for (const one of wanted) socket.send(JSON.stringify(one));
          if (word.type === 'error' && told.push(word) >= wanted.length) resolve(told.slice(0, wanted.length));
        };
        document.querySelector('[data-testid="control"]').click(); // the page leaves control
      }),
    served.url.replace('http', 'ws').replace('/?', '/socket?'),
  );
  assert.deepEqual(
    answer.map(({ about, reason }) => [about, reason]),
    [['acknowledge', 'hand'], ['change', 'hand'], ['change', 'hand']],
  );
});

test('foreign pages are refused', async (t) => {
  const { served } = await open_cube(t);
  const { search } = new URL(served.url);
  const status = (headers, query = search) =>
    new Promise((resolve, reject) => {
      const asked = request({ host: '127.0.0.1', port: served.port, path: `/socket${query}`, headers: { Connection: 'Upgrade', Upgrade: 'websocket', 'Sec-WebSocket-Version': '13', 'Sec-WebSocket-Key': 'AAAAAAAAAAAAAAAAAAAAAA==', 'Sec-WebSocket-Protocol': 'palpate.1', ...headers } });
      asked.on('upgrade', (response, socket) => (socket.destroy(), resolve(response.statusCode)));
      asked.on('response', (response) => resolve(response.statusCode));
      asked.on('error', reject);
      asked.end();
    });
  assert.equal(await status({ Origin: `http://127.0.0.1:${served.port}` }), 101);
  assert.equal(await status({}, ''), 403);
  assert.equal(await status({}, `?token=${'0'.repeat(32)}`), 403);
  assert.equal(await status({ Origin: 'http://example.org' }), 403);
  assert.equal(await status({ Host: `example.org:${served.port}` }), 403);
  // As a browser does it: a page of another origin on this very machine.
  const foreign = createServer((_, response) => response.end('<!doctype html>'));
  await new Promise((resolve) => foreign.listen(0, '127.0.0.1', resolve));
  t.after(() => foreign.close());
  const context = await (await open()).newContext();
  t.after(() => context.close());
  const page = await context.newPage();
  await page.goto(`http://127.0.0.1:${foreign.address().port}/`);
  const outcome = await page.evaluate(
    (url) =>
      new Promise((resolve) => {
        const socket = new WebSocket(url, 'palpate.1');
        socket.onopen = () => resolve('open');
        socket.onerror = () => resolve('refused');
      }),
    `ws://127.0.0.1:${served.port}/socket${search}`,
  );
  assert.equal(outcome, 'refused');
});

test('malformed and huge messages end their own connection and nothing else', async (t) => {
  const { page, served } = await open_cube(t);
  const other = await visit(t, served.url);
  const say = (text) =>
    other.evaluate(
      ([url, said]) =>
        new Promise((resolve) => {
          const socket = new WebSocket(url, 'palpate.1');
          socket.onopen = () => socket.send(said.repeat ? said : new Uint8Array(said));
          socket.onclose = (event) => resolve({ code: event.code, reason: event.reason });
        }),
      [`ws://127.0.0.1:${served.port}/socket${new URL(served.url).search}`, text],
    );
  const before = await told(page, 'ticks');
  for (const text of ['{', '[]', '{"type":"fly"}', '{"type":"point","position":[0,0]}', '['.repeat(10_000), 'x'.repeat(1_000_000), [1, 2, 3]]) {
    const { code, reason } = await say(text);
    assert.ok(code >= 1002 && code <= 1011, `closed with ${code} ${reason}`);
  }
  await until(page, (count) => window.palpate.ticks > count + 500, before);
  assert.equal((await told(page, 'state')).you, 'controller');
  assert.equal(await part(page, 'connection').innerText(), 'connected');
});

test('a body in the plane lies flat with its mesh, and is pushed from outside', async (t) => {
  const at = await folder(t);
  const file = await bake(at, await readFile(path.join(source, 'meshes/models/plate/model.toml'), 'utf8'), 'plate');
  const served = await serve(t, ['play', file, '--view', '--view-address', '127.0.0.1:0'], at);
  const page = await ready(await visit(t, served.url));
  await choose(page, 'press', 0.02);
  const { x, y } = await project(page, [0.5, 1, 0]);
  await page.mouse.move(x, y - 3);
  await page.mouse.down();
  const felt = await settled(page);
  await page.mouse.up();
  assert.ok(felt.force[1] < 0 && felt.force[2] === 0, `force ${felt.force}`);
  const { stdout } = await run(runtime, ['probe', file, '--at', '0.5,1', '--displace', `0,${-felt.depth}`, '--json']);
  near(felt.force[1], JSON.parse(stdout).nodes[0].force[1], 0.05, 'force');
  assert.deepEqual(page.complaints, []);
});

test('a best effort is told while it lasts, with the size of its error and marks in the plot', async (t) => {
  const { page } = await open_cube(t, { cells: 8, args: ['--tool', 'sphere:0.5', '--max-contacts', '3'] });
  const banner = part(page, 'best-effort');
  const marks = () =>
    page.evaluate(() => {
      const canvas = document.querySelector('[data-testid="plot-force"] canvas');
      const { data } = canvas.getContext('2d').getImageData(0, 0, canvas.width, canvas.height);
      let found = 0; // pixels of #ffb454
      for (let k = 0; k < data.length; k += 4) if (data[k] === 255 && data[k + 1] === 180 && data[k + 2] === 84) ++found;
      return found;
    });
  await choose(page, 'press', 0.002);
  const { x, y } = await project(page, top);
  await page.mouse.move(x, y);
  assert.ok(await banner.isHidden());
  await choose(page, 'press', 0.1);
  await page.mouse.down();
  await settled(page);
  await banner.waitFor();
  assert.match(await banner.innerText(), /^Best effort: force (within about [\d.]+ %|off by 100 % or more) \(\d+ contact points left out\)$/);
  assert.ok((await marks()) > 0);
  if (process.env.PALPATE_STORE_BANNER) await page.screenshot({ path: process.env.PALPATE_STORE_BANNER });
  await page.mouse.up();
  await until(page, () => window.palpate.lastFrame.contacts === 0);
  await banner.waitFor({ state: 'hidden' });
  assert.deepEqual(page.complaints, []);
});

test('a press with room for all its contacts is no best effort', async (t) => {
  const { page } = await open_cube(t, { cells: 8, args: ['--tool', 'sphere:0.5'] });
  await choose(page, 'press', 0.1);
  const { x, y } = await project(page, top);
  await page.mouse.move(x, y);
  await page.mouse.down();
  await settled(page);
  assert.ok(await part(page, 'best-effort').isHidden());
  await page.mouse.up();
});

/// Records a scripted push of the cube, by a point or a ball.
async function recorded(t, at, radius = 0, ...options) {
  const file = await bake(at, cube(6));
  const touch = path.join(at, 'touch.csv');
  const row = (time, z) => `${time},0.5,0.5,${z + radius}\n`;
  await writeFile(touch, `t,x,y,z\n${row(0, 1.1)}${row(0.5, 0.95)}${row(1, 0.95)}${row(1.5, 1.1)}`);
  const session = path.join(at, 'push.h5');
  const tool = radius > 0 ? `sphere:${radius}` : 'point';
  await run(runtime, ['play', file, '--device', `script:${touch}`, '--fast', '--record', session, '--tool', tool, ...options], { cwd: at });
  return session;
}

/// Seeks from frame to frame: the force is there in the middle, and not at the ends.
async function leaf_through(page) {
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
  await seek(0);
  await until(page, () => window.palpate.lastFrame.force[2] === 0);
  await part(page, 'replay-play').click();
  await until(page, () => window.palpate.lastFrame.force[2] < -1e-3);
  assert.deepEqual(page.complaints, []);
}

test('a recording is played, step by step too', async (t) => {
  const at = await folder(t);
  const served = await serve(t, ['view', await recorded(t, at), '--view-address', '127.0.0.1:0'], at);
  await leaf_through(await ready(await visit(t, served.url)));
});

test('a best effort is told of the frames of a recording that have one', async (t) => {
  const at = await folder(t);
  const session = await recorded(t, at, 0.4, '--max-contacts', '2');
  const html = path.join(at, 'out.html');
  await run(runtime, ['export', session, '--html', html]);
  const page = await ready(await visit(t, `file://${html}`));
  assert.ok(await part(page, 'best-effort').isHidden());
  const { frames } = await told(page, 'state');
  await page.evaluate((value) => {
    const scrub = document.querySelector('[data-testid="scrub"]');
    scrub.value = String(value);
    scrub.dispatchEvent(new Event('input'));
  }, Math.floor(frames / 2));
  await part(page, 'best-effort').waitFor();
  assert.match(await part(page, 'best-effort').innerText(), /contact points? left out/);
});

test('a recording becomes one page that needs nothing', async (t) => {
  const at = await folder(t);
  const html = path.join(at, 'out.html');
  await run(runtime, ['export', await recorded(t, at), '--html', html]);
  await leaf_through(await ready(await visit(t, `file://${html}`)));
});

test('the picture is the stored one', async (t) => {
  const { page } = await open_cube(t, { args: ['--tool', 'sphere:0.15', '--coupling', '100'] });
  await part(page, 'field').selectOption('von-mises');
  await choose(page, 'press', 0.1);
  const { x, y } = await project(page, top);
  await page.mouse.move(x, y);
  await page.mouse.down();
  await settled(page);
  const canvas = await part(page, 'stage').locator('canvas').first().screenshot({ animations: 'disabled' });
  await page.mouse.up();
  const stored = path.join(source, 'tests/browser/pressed-cube.png');
  if (process.env.PALPATE_STORE_PICTURE) await writeFile(stored, canvas);
  // Both as the browser decodes them: the share of pixels that differ by more than a twentieth in some colour.
  const share = await page.evaluate(
    async ([a, b]) => {
      const pixels = async (base64) => {
        const bitmap = await createImageBitmap(await (await fetch(`data:image/png;base64,${base64}`)).blob());
        const surface = new OffscreenCanvas(bitmap.width, bitmap.height).getContext('2d');
        surface.drawImage(bitmap, 0, 0);
        return surface.getImageData(0, 0, bitmap.width, bitmap.height);
      };
      const [one, other] = [await pixels(a), await pixels(b)];
      if (one.width !== other.width || one.height !== other.height) return 1;
      let different = 0;
      for (let k = 0; k < one.data.length; k += 4) {
        if ([0, 1, 2].some((c) => Math.abs(one.data[k + c] - other.data[k + c]) > 13)) ++different;
      }
      return different / (one.width * one.height);
    },
    [canvas.toString('base64'), (await readFile(stored)).toString('base64')],
  );
  assert.ok(share < 0.02, `${(100 * share).toFixed(2)} % of the pixels differ from tests/browser/pressed-cube.png`);
});
