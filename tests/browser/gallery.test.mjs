// All that is in a folder, to choose from, in a real browser against the real runtime.
import assert from 'node:assert/strict';
import { readdirSync, readFileSync } from 'node:fs';
import { copyFile, readdir, readFile, rm, writeFile } from 'node:fs/promises';
import path from 'node:path';
import { after, test } from 'node:test';
import { bake, close, cube, folder, near, open, ready, run, runtime, serve, told, until, visit } from './harness.mjs';
import { barriers, faults_of_layout } from './looks.mjs';
import { part, recorded } from './steps.mjs';

after(close);

const item = (page, name) => page.locator(`[data-name="${name}"]`);

/// Command lines of the processes that one has started.
const children_of = (pid) =>
  readdirSync('/proc')
    .filter((one) => /^\d+$/.test(one))
    .flatMap((one) => {
      try {
        const stat = readFileSync(`/proc/${one}/stat`, 'utf8');
        return Number(stat.slice(stat.lastIndexOf(')') + 2).split(' ')[1]) === pid ? [readFileSync(`/proc/${one}/cmdline`, 'utf8').replaceAll('\0', ' ')] : [];
      } catch {
        return []; // it has ended
      }
    });

/// A folder with a cube, a press of it, a plate, a file that is cut off and one that is nothing of ours: { at, served }.
async function gallery(t) {
  const at = await folder(t);
  await recorded(t, at, 0.1);
  const body = path.join(at, 'model.palpate.hdf');
  await copyFile(body, path.join(at, 'cube.palpate.hdf'));
  await writeFile(path.join(at, 'broken.palpate.hdf'), (await readFile(body)).subarray(0, 5000));
  await writeFile(path.join(at, 'notes.txt'), 'nothing');
  await rm(path.join(at, 'model.toml'), { force: true }); // what was baked before comes without
  await writeFile(path.join(at, 'lump.obj'), 'this is no surface\n');
  return { at, served: await serve(t, ['view', '--view-address', '127.0.0.1:0'], at) };
}

const shown = (page) => page.locator('[data-testid="item"]').evaluateAll((all) => all.map((one) => one.dataset.name));

test('a body is chosen, left, and a recording chosen', async (t) => {
  const { served } = await gallery(t);
  assert.match(served.url, /\/gallery\?token=/);
  const page = await visit(t, served.url, { is_drawn: true });
  const picture = (name) => item(page, name).locator('img');
  await picture('cube.palpate.hdf').waitFor();
  await picture('push.mcap').waitFor();
  assert.deepEqual(await shown(page), ['broken.palpate.hdf', 'cube.palpate.hdf', 'model.palpate.hdf', 'push.mcap', 'lump.obj']);
  assert.match(await item(page, 'broken.palpate.hdf').locator('.problem').innerText(), /broken\.palpate\.hdf: the file is truncated/);
  const [rest, same, pressed] = await Promise.all(['cube.palpate.hdf', 'model.palpate.hdf', 'push.mcap'].map((name) => picture(name).getAttribute('src')));
  assert.equal(rest, same);
  assert.notEqual(rest, pressed); // where it felt most
  const colours = await page.evaluate(async (url) => {
    const image = new Image();
    image.src = url;
    await image.decode();
    const bitmap = await createImageBitmap(image);
    const pen = new OffscreenCanvas(bitmap.width, bitmap.height).getContext('2d');
    pen.drawImage(bitmap, 0, 0);
    return [[0.5, 0.5], [0.02, 0.02]].map(([x, y]) => [...pen.getImageData(x * bitmap.width, y * bitmap.height, 1, 1).data]);
  }, rest);
  assert.ok(colours[0][0] > 100 && colours[0][3] === 255 && colours[1][3] === 0, `${colours}: a red body on no ground`);
  assert.deepEqual(page.complaints, []);

  await item(page, 'cube.palpate.hdf').click();
  await ready(page);
  assert.equal((await told(page, 'state')).model.name, 'cube');
  assert.equal((await told(page, 'state')).you, 'controller');
  assert.equal(children_of(served.child.pid).length, 1);
  const port = new URL(page.url()).port;

  await part(page, 'to-gallery').click();
  await item(page, 'push.mcap').click();
  await ready(page);
  assert.equal((await told(page, 'state')).session, 'push.mcap');
  const left = children_of(served.child.pid);
  assert.ok(left.length === 1 && left[0].includes('push.mcap'), left.join('; '));
  assert.equal(new URL(page.url()).port, port); // so that the page finds what it keeps
  await served.stop();
  await assert.rejects(fetch(page.url()));
});

/// Tries to run a script in a page, by each way that a text could bring one; returns those that did.
async function scripts_that_ran(page) {
  await page.evaluate(() => {
    window.ran = [];
    const put = (kind, values) => document.body.append(Object.assign(document.createElement(kind), values));
    put('script', { textContent: 'window.ran.push("inline")' });
    put('script', { src: 'data:text/javascript,window.ran.push("data")' });
    put('script', { src: URL.createObjectURL(new Blob(['window.ran.push("blob")'])) });
    put('div', { innerHTML: '<img src="nothing:" onerror="window.ran.push(\'event\')"><b style="color: rgb(1, 2, 3)"></b>' });
    put('iframe', { srcdoc: '<script>parent.ran.push("frame")<' + '/script>' });
    put('a', { href: 'javascript:window.ran.push("link")' });
    document.querySelector('a[href^="javascript"]').click();
    setTimeout('window.ran.push("text")', 0);
    if (getComputedStyle(document.querySelector('div > b[style]')).color === 'rgb(1, 2, 3)') window.ran.push('style');
  });
  await page.evaluate(() => new Promise((resolve) => setTimeout(resolve, 500))); // what would run does so by then
  return page.evaluate(() => window.ran);
}

test('what files say is text in the gallery, the page and what is exported', async (t) => {
  const at = await folder(t);
  const evil = '<img src=x: onerror=window.ran.push(1)>';
  const address = 'open javascript:window.ran.push(2) in a browser';
  for (const [file, name] of [[evil, evil], ['b', address], ["c' onclick=window.ran.push(3) '", `"'>&lt;${evil}`]])
    await copyFile(await bake(at, cube(2).replace('"cube"', JSON.stringify(name)), 'baked'), path.join(at, `${file}.palpate.hdf`));
  await rm(path.join(at, 'baked.palpate.hdf'));
  await rm(path.join(at, 'baked.toml'), { force: true });
  const recording = `run ${evil}.mcap`;
  await writeFile(path.join(at, `${evil}.csv`), 't,x,y,z\n0,0.5,0.5,1.3\n0.1,0.5,0.5,1.05\n');
  await run(runtime, ['play', `${evil}.palpate.hdf`, '--device', `script:${evil}.csv`, '--tool', 'sphere:0.1', '--fast', '--record', recording], { cwd: at });
  await writeFile(path.join(at, `${evil}.mcap`), 'no recording');
  await writeFile(path.join(at, `lump ${evil}.obj`), `this is no surface ${evil}\n`);
  const served = await serve(t, ['view', '--view-address', '127.0.0.1:0'], at);
  const note_scripts = () => (window.ran ??= []);
  const page = await visit(t, served.url, {}, note_scripts);
  const none_ran = async (what) => {
    assert.deepEqual(await page.evaluate(() => window.ran), [], what);
    assert.equal(await page.locator('img[src^="x:"]').count(), 0, what);
    assert.deepEqual(page.complaints, [], what);
  };
  await page.locator('[data-testid="item"]').first().waitFor();
  assert.ok((await shown(page)).includes(`${evil}.palpate.hdf`));
  await page.locator('.problem').first().waitFor();
  await none_ran('the gallery');
  for (const [file, name] of [[evil, evil], ['b', address], ["c' onclick=window.ran.push(3) '", `"'>&lt;${evil}`]]) {
    await page.locator('[data-testid="item"]').and(page.locator(`[title^=${JSON.stringify(`${file}.palpate.hdf`)}]`)).click();
    await ready(page);
    assert.match(page.url(), /^http:\/\/127\.0\.0\.1:\d+\/\?token=[0-9a-f]{32}&gallery=\d+$/);
    assert.ok(!page.url().includes(new URL(served.url).searchParams.get('token')), 'the link opens that body alone');
    assert.equal((await told(page, 'state')).model.name, name);
    await page.evaluate((text) => window.palpate.send?.({ type: 'change', settings: { [text]: text } }), evil);
    await none_ran(`the page of ${name}`);
    await part(page, 'to-gallery').click();
    await page.locator('[data-testid="item"]').first().waitFor();
    assert.equal(new URL(page.url()).search, '', 'the tab knows the token');
  }
  await page.locator(`[data-testid="item"][title^=${JSON.stringify(recording)}]`).click();
  await ready(page);
  assert.equal(await part(page, 'model').textContent(), `${evil}: ${recording}`);
  assert.ok((await page.locator('body').textContent()).includes(`script:${evil}.csv`), 'what moved the tool');
  await none_ran('the page of a recording');
  await part(page, 'to-gallery').click();
  await page.locator(`[data-testid="item"][title^=${JSON.stringify(`lump ${evil}.obj`)}]`).click();
  await until(page, () => /cannot be shown/.test(document.querySelector('[data-testid="opening"] h2')?.textContent));
  await none_ran('an error');
  await page.keyboard.press('Escape');
  assert.deepEqual(await scripts_that_ran(page), []);
  assert.ok(page.complaints.length > 0, 'the policy refused them');

  const other = await (await open()).newContext();
  t.after(() => other.close());
  const stranger = await other.newPage(); // has the address without the token
  await stranger.goto(served.url.replace(/\?.*/, ''));
  await stranger.getByText('Open the whole address that the runtime printed').waitFor();

  await run(runtime, ['export', recording, '--html', 'touch.html'], { cwd: at });
  const written = await visit(t, `file://${path.join(at, 'touch.html')}`, {}, note_scripts);
  await ready(written);
  assert.deepEqual(written.complaints, []);
  assert.deepEqual(await written.evaluate(() => window.ran), []);
  assert.deepEqual(await scripts_that_ran(written), []);
  assert.ok(written.complaints.length > 0);
});

test('what cannot be opened is told with its reason', async (t) => {
  const { served } = await gallery(t);
  const page = await visit(t, served.url);
  await item(page, 'broken.palpate.hdf').click();
  const opening = part(page, 'opening');
  await until(page, () => /cannot be shown/.test(document.querySelector('[data-testid="opening"] h2')?.textContent));
  assert.match(await opening.innerText(), /error: .*truncated[^]*hint: /);
  await page.keyboard.press('Escape');
  assert.equal(await opening.isVisible(), false);
  await item(page, 'lump.obj').click(); // palpate-precompute says why
  await until(page, () => /lump.obj cannot be shown/.test(document.querySelector('[data-testid="opening"] h2')?.textContent));
  assert.match(await opening.innerText(), /error: .*lump\.obj/);
  await part(page, 'close').click();
  assert.deepEqual(await shown(page), ['broken.palpate.hdf', 'cube.palpate.hdf', 'model.palpate.hdf', 'push.mcap', 'lump.obj']);
});

test('a file that is dropped lands in the folder and is opened', async (t) => {
  const at = await folder(t);
  const other = await folder(t);
  const file = await bake(other, cube(4), 'small');
  const served = await serve(t, ['view', at, '--view-address', '127.0.0.1:0'], other);
  const page = await visit(t, served.url);
  await page.getByText('There is nothing here yet').waitFor();
  const drop = async (name, bytes) => {
    const data = await page.evaluateHandle(
      ([as, base64]) => {
        const transfer = new DataTransfer();
        transfer.items.add(new File([Uint8Array.from(atob(base64), (one) => one.charCodeAt(0))], as));
        return transfer;
      },
      [name, bytes.toString('base64')],
    );
    await page.dispatchEvent('main', 'drop', { dataTransfer: data });
  };
  const bytes = await readFile(file);
  await drop('small.palpate.hdf', bytes);
  await ready(page);
  assert.equal((await told(page, 'state')).model.name, 'cube');
  assert.deepEqual(await readFile(path.join(at, 'small.palpate.hdf')), bytes);

  await part(page, 'to-gallery').click();
  await item(page, 'small.palpate.hdf').waitFor();
  await part(page, 'add').setInputFiles({ name: 'small.palpate.hdf', mimeType: '', buffer: bytes }); // what is there stays
  await ready(page);
  assert.deepEqual(await readdir(at), ['small-2.palpate.hdf', 'small.palpate.hdf']);

  await part(page, 'to-gallery').click();
  await item(page, 'small-2.palpate.hdf').waitFor();
  const disc = Array.from({ length: 60 }, (_, y) => Array.from({ length: 60 }, (_, x) => (Math.hypot(x - 29.5, y - 29.5) < 20 ? 1 : 0)).join(' '));
  await drop('disc.pbm', Buffer.from(`P1\n60 60\n${disc.join('\n')}\n`)); // a drawing becomes a body that falls
  await ready(page);
  const { model, settings } = await told(page, 'state');
  assert.deepEqual([model.name, model.dimension, settings.solver, settings.gravity], ['disc', 2, 'corotational', '0,-9.81,0']);
  await part(page, 'to-gallery').click();
  await item(page, 'disc.palpate.hdf').click();
  await ready(page);
  assert.equal((await told(page, 'state')).settings.solver, 'corotational');
  await part(page, 'to-gallery').click();
  await item(page, 'small-2.palpate.hdf').waitFor();
  const before = await readdir(at);
  await drop('letter.txt', Buffer.from('dear'));
  await until(page, () => /letter.txt cannot be shown/.test(document.querySelector('[data-testid="opening"] h2')?.textContent));
  assert.deepEqual(await readdir(at), before);
});

test('what is drawn becomes a body that falls', async (t) => {
  const at = await folder(t);
  const served = await serve(t, ['view', at, '--view-address', '127.0.0.1:0'], at);
  const page = await visit(t, served.url, { viewport: { width: 1000, height: 800 } });
  await part(page, 'draw').click();
  assert.ok(await part(page, 'drop-it').isDisabled(), 'there is nothing to drop yet');
  const paper = await part(page, 'paper').boundingBox();
  const line = async (places) => {
    const on = places.map(([x, y]) => [paper.x + x * paper.width, paper.y + y * paper.height]);
    await page.mouse.move(...on[0]);
    await page.mouse.down();
    for (const place of on) await page.mouse.move(...place, { steps: 5 });
    await page.mouse.up();
  };
  const dark = () => page.evaluate(() => {
    const { data } = document.querySelector('[data-testid="paper"]').getContext('2d').getImageData(0, 0, 720, 480);
    return data.filter((value, k) => k % 4 === 0 && value < 128).length / (720 * 480);
  });
  const square = [[0.3, 0.3], [0.7, 0.3], [0.7, 0.7], [0.3, 0.7], [0.3, 0.31]];
  await line(square);
  // 288 x 192 pixels within the line and a round pen of 30 around it.
  near(await dark(), (318 * 222 - (4 - Math.PI) * 15 ** 2) / (720 * 480), 0.02, 'a closed line is filled');
  const whole = await dark();
  await part(page, 'rubber').check();
  await line([[0.5, 0.5], [0.52, 0.5]]);
  near(whole - (await dark()), (14.4 * 30 + Math.PI * 15 ** 2) / (720 * 480), 0.05, 'the rubber makes a hole');
  assert.deepEqual(page.complaints, []);
  await part(page, 'drop-it').click();
  await ready(page);
  const { model, settings } = await told(page, 'state');
  assert.deepEqual([model.name, model.dimension, settings.solver], ['drawing', 2, 'corotational']);
  assert.ok((await readdir(at)).includes('drawing.palpate.hdf'));
});

for (const [width, height, hasTouch, colorScheme] of [[360, 640, true, 'light'], [1280, 800, false, 'dark']]) {
  test(`the gallery is laid out in ${width} × ${height}, ${colorScheme}`, async (t) => {
    const { served } = await gallery(t);
    const page = await visit(t, served.url, { viewport: { width, height }, hasTouch, colorScheme });
    await item(page, 'push.mcap').locator('img').waitFor();
    assert.deepEqual(await faults_of_layout(page, hasTouch ? 44 : 24), []);
    assert.deepEqual(await barriers(page), []);
    await part(page, 'draw').click();
    await part(page, 'paper').waitFor();
    const words = ['Draw a body in one', 'Pen', 'rubber', 'Clear', 'Cancel', 'Drop it']; // what lies behind the dialog is covered, as it is meant to be
    const faults = (await faults_of_layout(page, hasTouch ? 44 : 24)).filter((fault) => !/ is covered by /.test(fault) || words.some((word) => fault.startsWith(`"${word}`)));
    assert.deepEqual(faults, []);
    assert.deepEqual(await barriers(page), [], 'with the paper');
    await page.keyboard.press('Escape');
    await item(page, 'cube.palpate.hdf').click();
    await ready(page);
    assert.deepEqual(await faults_of_layout(page, hasTouch ? 44 : 24), [], 'with the way back');
  });
}
