// All that is in a folder, to choose from, in a real browser against the real runtime.
import assert from 'node:assert/strict';
import { readdirSync, readFileSync } from 'node:fs';
import { copyFile, readdir, readFile, rm, writeFile } from 'node:fs/promises';
import path from 'node:path';
import { after, test } from 'node:test';
import { bake, close, cube, folder, near, ready, serve, told, until, visit } from './harness.mjs';
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
    const bitmap = await createImageBitmap(await (await fetch(url)).blob());
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
