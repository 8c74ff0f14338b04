// The page's controls, savings and recordings, in a real browser against the real runtime.
import assert from 'node:assert/strict';
import { spawn } from 'node:child_process';
import { readFile } from 'node:fs/promises';
import path from 'node:path';
import { after, test } from 'node:test';
import { bake, close, cube, example, folder, near, project, ready, run, runtime, serve, told, until, visit } from './harness.mjs';
import { choose, leaf_through, open_cube, part, pressed, recorded, settled, top } from './steps.mjs';

after(close);

test('the page comes whole from the runtime and asks nobody else', async (t) => {
  const { page } = await open_cube(t, { is_drawn: true });
  await assert.doesNotReject(part(page, 'stage').locator('canvas').first().waitFor());
  assert.equal(await part(page, 'model').innerText(), 'cube');
  assert.equal(await part(page, 'connection').innerText(), 'connected');
  assert.match(await part(page, 'role').innerText(), /you steer, by mouse/);
  const words = await part(page, 'panel').innerText();
  for (const word of ['too slow', 'late start', 'computing', 'best effort']) assert.ok(words.includes(word), `the panel says "${word}"`);
  await part(page, 'scale').evaluate((slider) => {
    slider.value = '100';
    slider.dispatchEvent(new Event('input'));
  });
  assert.match(await part(page, 'scaled-note').innerText(), /^Displacements × 20: to touch the body, draw it true to scale/);
  assert.deepEqual(page.complaints, []);
});

test('pause, a tick at a time, reset', async (t) => {
  const { page } = await open_cube(t);
  await until(page, () => window.palpate.state.ticks > 100);
  await part(page, 'pause').click();
  await until(page, () => window.palpate.state.paused);
  // Once what was under way has come, each step is one tick and nothing else is.
  let ticks = 0;
  for (let [single, steps] = [0, 0]; single < 3; ++steps) {
    assert.ok(steps < 10, 'it goes on while it is paused');
    ({ ticks } = await told(page, 'state'));
    await part(page, 'step').click();
    await until(page, (count) => window.palpate.state.ticks > count, ticks);
    single = (await told(page, 'state')).ticks === ticks + 1 ? single + 1 : 0;
  }
  await part(page, 'pause').click();
  await until(page, (count) => window.palpate.state.ticks > count + 50, ticks);
  await part(page, 'reset').click();
  await until(page, (count) => window.palpate.state.ticks < count, (await told(page, 'state')).ticks);
});

test('settings are taken, refused with a reason, and felt', async (t) => {
  const { page } = await open_cube(t, { toml: '[storage]\nscope = "layers"\nlayers = 2\n', args: ['--tool', 'point', '--overlay', 'no'] });
  await part(page, 'tool-kind').selectOption('sphere');
  await until(page, () => window.palpate.state.settings.tool?.startsWith('sphere:'));
  await part(page, 'radius').fill('100');
  await part(page, 'radius').press('Enter');
  await until(page, () => window.palpate.state.settings.tool === 'sphere:0.1');
  await choose(page, 'press', 0.02);
  const push = async (firmer) => {
    const felt = await pressed(page, top, firmer);
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
  await until(page, () => window.palpate.state.settings.overlay !== 'no' && !window.palpate.state.busy);
  const softer = await push(once);
  assert.ok(Math.abs(softer) < 0.97 * Math.abs(once), `with an overlay ${softer}, without ${once}`);
  await part(page, 'friction').fill('-1');
  await part(page, 'friction').press('Enter');
  await page.getByText(/not a number/).first().waitFor();
  assert.equal(await part(page, 'contact').isDisabled(), true); // the cube has no dynamics
  assert.deepEqual(page.complaints, []);
});

test('depth is turned on and off, and keeps out what it has no place for', async (t) => {
  const { page } = await open_cube(t, { toml: '[storage]\nscope = "layers"\nlayers = 2\n', args: ['--tool', 'sphere:0.1'] });
  const studied = async () => (180 / Math.PI) * (await told(page, 'state')).model.studied_rotation;
  near(await studied(), 90, 0.01, 'range of two levels, which a static body is on');
  const turn = async (name, value, key = name) => {
    await part(page, name).click();
    await until(page, ([key, now]) => (window.palpate.state.settings[key] ?? null) === now && !window.palpate.state.busy, [key, value]);
    await until(page, () => window.palpate.ready);
  };
  assert.equal(await part(page, 'two-levels').isChecked(), true);
  await choose(page, 'press', 0.02);
  const felt = await pressed(page, top);
  assert.ok(felt.force[2] < 0, `it pushes the body down: ${felt.force}`);
  await turn('two-levels', 'no', 'depth');
  near(await studied(), 19, 0.01, 'range of small strain');
  await turn('two-levels', null, 'depth');
  near(await studied(), 90, 0.01, 'range of two levels again');
  await turn('overlay', 'r=3,rings=2'); // takes the place of depth
  near(await studied(), 19, 0.01, 'range of overlays');
  assert.equal(await part(page, 'two-levels').isDisabled(), true);
  assert.match(await part(page, 'two-levels').getAttribute('title'), /Not with overlay/);
  assert.deepEqual(page.complaints, []);
});

test('a live body has settings of its own, which are taken and refused with a reason', async (t) => {
  const at = await folder(t);
  const soft = cube(3).replace('youngs_modulus = 1.0', 'youngs_modulus = 1e6\ndensity = 1000').replace(/\[\[fixed\]\][^]*$/, '[storage]\nscope = "none"\n');
  const file = await bake(at, soft);
  const options = ['--solver', 'corotational', '--gravity', '0,0,-9.81', '--floor', '-0.2'];
  const served = await serve(t, ['play', file, '--view', '--view-address', '127.0.0.1:0', '--tool', 'sphere:0.1', ...options], at);
  const page = await ready(await visit(t, served.url, { viewport: { width: 1010, height: 900 } }));
  await part(page, 'live-settings').waitFor();
  assert.equal(await part(page, 'overlay').isVisible(), false);
  assert.equal(await part(page, 'contact').isDisabled(), true);
  assert.equal(await part(page, 'solver').inputValue(), 'corotational');
  assert.equal(await part(page, 'gravity').inputValue(), '0,0,-9.81');
  assert.equal(await part(page, 'yield').inputValue(), 'inf');
  const taken = async (name, value) => {
    await until(page, ([key, now]) => window.palpate.state.settings[key] === now && !window.palpate.state.busy, [name, value]);
    await until(page, () => window.palpate.ready);
  };
  for (const [name, value] of Object.entries({ yield: '0.05', creep: '20', 'most-plastic': '0.5', 'live-step': '0.01', 'mass-damping': '2', 'stiffness-damping': '0.01', 'wall-friction': '0.25', gravity: '0,0,-5', 'poissons-ratio': '0.45' })) {
    await part(page, name).fill(value);
    await part(page, name).press('Enter');
    await taken(name, value);
  }
  await part(page, 'step-solver').selectOption('cg');
  await taken('step-solver', 'cg');
  await part(page, 'integrator').selectOption('midpoint');
  await taken('integrator', 'midpoint');
  await part(page, 'live-step').fill('1');
  await part(page, 'live-step').press('Enter');
  await page.getByText(/at most 0.1/).first().waitFor();
  await part(page, 'live-step').fill('0.05');
  await part(page, 'live-step').press('Enter');
  await taken('live-step', '0.05');
  await part(page, 'integrator').selectOption('semi-implicit-euler');
  await page.getByText(/the longest stable one is/).first().waitFor();
  await until(page, () => window.palpate.state.settings.integrator === 'midpoint' && !window.palpate.state.busy);
  const cubes = await open_cube(t);
  assert.equal(await part(cubes.page, 'live-settings').isVisible(), false);
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
  assert.ok(told_by_file.ticks_in_contact > 50 && told_by_file.pictures > 10 && told_by_file.device === 'mouse', stdout);
  // The hand is in it: it repeats to the last bit.
  const model = path.join(at, 'model.palpate.hdf');
  await run(runtime, ['play', model, '--device', `replay:${file}`, '--fast', '--report', path.join(at, 'replay.json')]);
  const replay = JSON.parse(await readFile(path.join(at, 'replay.json'), 'utf8'));
  assert.equal(replay.replay.different_ticks, 0);
});

test('a recording that fails says so at once', async (t) => {
  const { page, served } = await open_cube(t);
  await part(page, 'record').click();
  await until(page, () => window.palpate.state.recording && window.palpate.state.ticks > 0);
  await run('prlimit', ['--pid', String(served.child.pid), '--fsize=1000']); // as a full disk
  await until(page, () => window.palpate.state.recording_failed);
  await page.getByText('Recording failed', { exact: true }).waitFor();
  await page.getByText(/The recording failed, and the run goes on without it: .*File too large/).first().waitFor();
  const before = await told(page, 'state');
  await page.waitForFunction((ticks) => window.palpate.state.ticks > ticks + 100, before.ticks);
  await part(page, 'record').click();
  await until(page, () => !window.palpate.state.recording);
  assert.equal(await part(page, 'record-label').textContent(), 'Record');
});

test('pictures and shapes can be saved', async (t) => {
  const { page } = await open_cube(t, { is_drawn: true });
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
  const name = path.join(at, 'bridge.socket');
  const bridge = spawn(example, ['--socket', name, '--seconds', '600', '--from', '0,0,0.1', '--to', '0,0,0.1'], { stdio: 'ignore' });
  t.after(() => bridge.kill('SIGKILL'));
  const safety = 'late=10,most_late=1e9,stale_life=10,silence=5,silence_fade=4';
  const served = await serve(t, ['play', file, '--view', '--view-address', '127.0.0.1:0', '--device', `bridge:${name}`, '--safety', safety], at);
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
        const socket = new WebSocket(url, 'palpate.2');
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
