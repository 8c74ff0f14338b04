// Keys, states and what is kept: what a person does at the page, in a real browser against the real runtime.
import assert from 'node:assert/strict';
import { readFile } from 'node:fs/promises';
import path from 'node:path';
import { after, test } from 'node:test';
import { close, film_times, folder, project, ready, run, runtime, serve, told, until, visit } from './harness.mjs';
import { choose, open_cube, part, recorded, settled, top } from './steps.mjs';

after(close);

const small = { viewport: { width: 900, height: 600 } };
const small_picture = { width: 800, height: 500 }; // quick to draw
const banner = (page) => part(page, 'banner-text');
const scrub_to = (page, frame) =>
  page.evaluate((value) => {
    const scrub = document.querySelector('[data-testid="scrub"]');
    scrub.value = String(value);
    scrub.dispatchEvent(new Event('input'));
  }, frame);

test('keys move the tool, press, deepen and lift; with Shift they turn the view', async (t) => {
  const { page } = await open_cube(t, { args: ['--tool', 'sphere:0.1'] });
  const outline = () => part(page, 'view').evaluate((canvas) => getComputedStyle(canvas).outlineStyle);
  await choose(page, 'press', 0.02);
  await page.keyboard.press('t');
  await part(page, 'view').focus();
  await page.keyboard.press('ArrowRight'); // a key, not a pointer, has the focus now
  assert.notEqual(await outline(), 'none');
  await page.keyboard.press('Enter');
  const pressed = await settled(page);
  assert.ok(pressed.force[2] < 0, `force ${pressed.force}`);
  await page.keyboard.press(']');
  await until(page, (depth) => window.palpate.lastFrame.depth > 1.02 * depth, pressed.depth);
  for (let k = 0; k < 3; ++k) await page.keyboard.press('ArrowRight');
  await until(page, (x) => window.palpate.lastFrame.tool[0] > x + 0.01, pressed.tool[0]);
  await page.keyboard.press('Enter');
  await until(page, () => window.palpate.lastFrame.contacts === 0);
  const before = (await told(page, 'eye')).towards;
  await page.keyboard.press('Shift+ArrowDown');
  const after_keys = (await told(page, 'eye')).towards;
  assert.ok(Math.hypot(...after_keys.map((one, k) => one - before[k])) > 0.05, 'the view turned');
  assert.equal(await page.evaluate(() => document.activeElement.dataset.testid), 'view');
  await page.mouse.click(20, 400);
  assert.equal(await outline(), 'none', 'a pointer needs no ring');
  await page.keyboard.press('ArrowRight');
  assert.notEqual(await outline(), 'none', 'a key does again');
  assert.deepEqual(page.complaints, []);
});

test('space pauses, whatever was clicked before; a press while paused says so, and a grab has no depth', async (t) => {
  const { page } = await open_cube(t);
  let saved = 0;
  page.on('download', () => ++saved);
  await Promise.all([page.waitForEvent('download'), part(page, 'save-vtu').click()]);
  await page.keyboard.press(' ');
  await until(page, () => window.palpate.state.paused);
  assert.equal(saved, 1, 'space did not save again');
  assert.equal(await banner(page).innerText(), 'Paused');
  assert.match(await part(page, 'banner-hint').innerText(), /Space/);
  const { x, y } = await project(page, top);
  await page.mouse.move(x, y);
  await page.mouse.down();
  assert.ok(await part(page, 'banner').evaluate((element) => element.classList.contains('told')), 'the banner nods');
  await page.mouse.up();
  await page.keyboard.press(' ');
  await until(page, () => !window.palpate.state.paused);
  await part(page, 'banner').waitFor({ state: 'hidden' });
  await choose(page, 'grab');
  await page.mouse.move(x, y);
  await page.mouse.down();
  await page.mouse.move(x + 20, y - 20, { steps: 3 });
  await settled(page);
  await until(page, () => document.querySelector('[data-testid="depth-felt"]').innerText === '–');
  await page.mouse.up();
  assert.equal(saved, 1, 'nor later, though a file takes its time');
});

test('what is typed and is no number goes back to what is, and says so once', async (t) => {
  const { page } = await open_cube(t);
  for (let k = 0; k < 3; ++k) {
    await part(page, 'friction').fill('abc');
    await part(page, 'friction').press('Enter');
    await page.getByText(/abc is not a number/).first().waitFor();
  }
  assert.equal(await part(page, 'friction').inputValue(), '');
  await part(page, 'depth').fill('abc');
  await part(page, 'depth').press('Enter');
  assert.match(await part(page, 'depth').inputValue(), /^[\d.]+$/);
  await part(page, 'field').selectOption('magnitude');
  await part(page, 'range').fill('abc');
  await part(page, 'range').press('Enter');
  assert.equal(await part(page, 'range').inputValue(), '');
  assert.ok((await page.locator('.toast').count()) <= 1, 'sentences do not pile up');
  await page.keyboard.press('v');
  for (let k = 0; k < 3; ++k) await part(page, 'copy-link').evaluate((button) => button.click()); // the sentence may lie over it
  await page.getByText(/The address of this view/).first().waitFor();
  assert.equal(await page.locator('.toast').count(), 1, 'equal sentences replace each other');
});

test('a program that has ended is told over the picture, and nothing can be steered', async (t) => {
  const { page, served } = await open_cube(t);
  await served.stop('SIGKILL');
  await page.getByText('The program has ended').waitFor();
  assert.match(await part(page, 'banner-hint').innerText(), /Start it again/);
  for (const id of ['pause', 'step', 'reset', 'record', 'save-stl', 'save-vtu', 'control', 'tool-kind', 'friction']) {
    assert.ok(await part(page, id).isDisabled(), `${id} is disabled`);
  }
  assert.ok(await part(page, 'hand').isHidden());
  assert.ok(await part(page, 'screenshot').isEnabled(), 'the last picture can be saved');
});

test('colours go to the largest, or over three decades; a field has one name', async (t) => {
  const { page } = await open_cube(t, { cells: 10, args: ['--tool', 'sphere:0.15'] });
  await part(page, 'field').selectOption('von-mises');
  await choose(page, 'press', 0.05);
  const { x, y } = await project(page, top);
  await page.mouse.move(x, y);
  await page.mouse.down();
  await settled(page);
  const ticks = async () => (await part(page, 'colour-ticks').locator('span').allInnerTexts()).map(Number);
  const is_cut = () => part(page, 'colour-bar').evaluate((bar) => bar.classList.contains('cut'));
  const set = (name) => page.evaluate((id) => document.querySelector(`[data-testid="${id}"]`).click(), name);
  await until(page, () => document.querySelector('[data-testid="colour-bar"]').classList.contains('cut')); // a node of 600 has a smaller share of the surface than is left out
  await set('show-largest');
  await until(page, () => !document.querySelector('[data-testid="colour-bar"]').classList.contains('cut'));
  await set('show-largest');
  await set('show-log');
  await until(page, () => [...document.querySelectorAll('[data-testid="colour-ticks"] span')].filter(({ innerText }) => innerText !== '0').length === 4); // a logarithm has no 0
  const [a, b, c, d] = await ticks();
  assert.ok(Math.abs(a / b - 10) < 0.1 && Math.abs(b / c - 10) < 0.1 && Math.abs(c / d - 10) < 0.6, `${a} ${b} ${c} ${d}`);
  assert.equal(await is_cut(), false);
  await page.mouse.up();
  await until(page, () => window.palpate.lastFrame.contacts === 0);
  await page.mouse.move(x, y);
  await until(page, () => /Pa$/.test(window.palpate.underPointer));
  for (const option of await part(page, 'field').locator('option').all()) {
    const value = await option.getAttribute('value');
    if (['none', 'material'].includes(value)) continue;
    await part(page, 'field').selectOption(value);
    const name = (await option.innerText()).trim();
    await until(page, (wanted) => document.querySelector('[data-testid="colour-title"]').innerText.toLowerCase().startsWith(`${wanted.toLowerCase()} [`), name);
  }
  const [download] = await Promise.all([page.waitForEvent('download'), part(page, 'save-vtu').click()]);
  const vtu = await readFile(await download.path(), 'latin1');
  for (const name of ['displacement', 'von_mises', 'pressure']) assert.match(vtu, new RegExp(`Name="${name}"`)); // as in recordings
});

test('how a model is looked at is kept, and an address opens it', async (t) => {
  const { page, served } = await open_cube(t);
  await part(page, 'field').selectOption('von-mises');
  await page.keyboard.press('e');
  await page.keyboard.press('v');
  await part(page, 'map').selectOption('cividis');
  await part(page, 'up').selectOption('y');
  const above = await project(page, [0.5, 1, 0.5]);
  const below = await project(page, [0.5, 0, 0.5]);
  assert.ok(above.y < below.y - 50 && Math.abs(above.x - below.x) < 0.05 * (below.y - above.y), 'y is upright in the picture');
  await part(page, 'look-from').selectOption('front');
  await part(page, 'show-parallel').check();
  await until(page, () => Object.values(localStorage).some((text) => text.startsWith('{') && JSON.parse(text).look.parallel === '1'));
  await page.keyboard.press('Shift+ArrowRight'); // when nothing else is about to be kept
  const { towards } = await told(page, 'eye');
  await part(page, 'theme').selectOption('light');
  await part(page, 'copy-link').click();
  const link = page.url();
  assert.match(link, /#.*field=von-mises/);
  const looks = async (one) => {
    const values = {};
    for (const id of ['field', 'map', 'up']) values[id] = await part(one, id).inputValue();
    values.edges = await part(one, 'show-edges').isChecked();
    values.parallel = await part(one, 'show-parallel').isChecked();
    return values;
  };
  const wanted = { field: 'von-mises', map: 'cividis', up: 'y', edges: true, parallel: true };
  const same_eye = async (one) => {
    const now = (await told(one, 'eye')).towards;
    assert.ok(Math.hypot(...now.map((value, k) => value - towards[k])) < 1e-3, `from ${now}, wanted ${towards}`);
  };
  await until(page, (wanted) => Object.values(localStorage).some((text) => {
    const place = text.startsWith('{') ? JSON.parse(text).place : null; // the last of all that is kept
    return place && Math.hypot(...place.towards.map((value, k) => value - wanted[k])) < 1e-3;
  }), towards);
  await page.goto(served.url);
  await ready(page);
  await until(page, () => document.querySelector('[data-testid="field"]').value === 'von-mises');
  assert.deepEqual(await looks(page), wanted);
  await same_eye(page);
  assert.equal(await page.evaluate(() => document.documentElement.dataset.theme), 'light');
  const other = await ready(await visit(t, link)); // another browser, which has kept nothing
  await until(other, () => document.querySelector('[data-testid="field"]').value === 'von-mises');
  assert.deepEqual(await looks(other), wanted);
  await same_eye(other);
  assert.equal(await other.evaluate(() => document.documentElement.dataset.theme), 'dark', 'the theme is the browser’s own');
});

test('pictures are saved twice and four times as fine, on white or on nothing', async (t) => {
  const { page } = await open_cube(t, { viewport: small_picture, is_drawn: true });
  const { width, height } = await part(page, 'view').boundingBox();
  const save = async (size, ground) => {
    await part(page, 'view-menu').click();
    await part(page, 'picture-size').selectOption(size);
    await part(page, 'picture-ground').selectOption(ground);
    await part(page, 'view-menu').click();
    const [download] = await Promise.all([page.waitForEvent('download'), part(page, 'screenshot').click()]);
    const png = await readFile(await download.path());
    const corner = await page.evaluate(async (base64) => {
      const bitmap = await createImageBitmap(new Blob([Uint8Array.from(atob(base64), (c) => c.charCodeAt(0))], { type: 'image/png' }));
      const surface = new OffscreenCanvas(1, 1).getContext('2d');
      surface.drawImage(bitmap, 0, 0);
      return [...surface.getImageData(0, 0, 1, 1).data];
    }, png.toString('base64'));
    return { size: [png.readUInt32BE(16), png.readUInt32BE(20)], corner };
  };
  const white = await save('2', 'white');
  assert.deepEqual(white.size.map(Math.round), [2 * Math.round(width), 2 * Math.round(height)]);
  assert.deepEqual(white.corner, [255, 255, 255, 255]);
  const clear = await save('4', 'clear');
  assert.deepEqual(clear.size.map(Math.round), [4 * Math.round(width), 4 * Math.round(height)]);
  assert.equal(clear.corner[3], 0);
});

test('a recording is filmed, its playhead is where the picture is, and watchers look for themselves', async (t) => {
  const at = await folder(t);
  const session = await recorded(t, at, 0.1);
  const served = await serve(t, ['view', session, '--view-address', '127.0.0.1:0'], at);
  const page = await ready(await visit(t, served.url, { viewport: small_picture, is_drawn: true }));
  const watcher = await ready(await visit(t, served.url, small));
  const { frames } = await told(page, 'state');
  await scrub_to(page, Math.floor(frames / 2));
  await until(watcher, () => window.palpate.lastFrame.force[2] < 0); // it sees what the other shows
  assert.equal((await told(watcher, 'state')).you, 'watcher');
  await scrub_to(watcher, 1);
  await until(watcher, () => window.palpate.state.alone && window.palpate.lastFrame.force[2] === 0);
  assert.ok((await told(page, 'lastFrame')).force[2] < 0, 'the other page is left alone');
  await part(watcher, 'follow').click();
  await until(watcher, () => !window.palpate.state.alone && window.palpate.lastFrame.force[2] < 0);
  assert.ok(await part(watcher, 'follow').isHidden());
  await part(page, 'replay-play').click();
  await until(page, (time) => window.palpate.time !== time, await told(page, 'time'));
  await part(page, 'replay-play').click();
  await until(page, () => window.palpate.playhead !== null && Math.abs(window.palpate.playhead - window.palpate.time) < 1e-9);
  const shown = await part(page, 'replay-time').innerText();
  await until(page, () => document.querySelector('[data-testid="replay-time"]').innerText.startsWith(`0:0${window.palpate.time.toFixed(2)}`));
  assert.match(shown, / \/ 0:01\.50$/);
  await watcher.context().close();
  await part(page, 'replay-speed').selectOption('0.25'); // 6 s: a busy machine draws few pictures a second
  const [download] = await Promise.all([page.waitForEvent('download'), part(page, 'save-video').click()]);
  const video = await readFile(await download.path());
  const times = film_times(video);
  assert.ok(times.length >= 4, `pictures at ${times} ms`);
  assert.ok(times.at(-1) > 1000, `pictures at ${times} ms`); // a busy machine loses the last ones
  assert.deepEqual(page.complaints, []);
});

test('an exported page has the looks of the live one', async (t) => {
  const at = await folder(t);
  const html = path.join(at, 'out.html');
  await run(runtime, ['export', await recorded(t, at), '--html', html]);
  const page = await ready(await visit(t, `file://${html}`, { ...small, colorScheme: 'light' }));
  assert.ok((await readFile(html)).length > 700_000);
  assert.equal(await page.evaluate(() => document.documentElement.dataset.theme), 'light');
  await part(page, 'depth-number').waitFor({ state: 'hidden' }); // recordings have no depth, once they are read
  const { frames } = await told(page, 'state');
  await scrub_to(page, Math.floor(frames / 2));
  await until(page, () => window.palpate.lastFrame.force[2] < 0);
  await part(page, 'arrow-legend').waitFor();
  const scrub = await part(page, 'scrub').boundingBox();
  const bar = await part(page, 'replay').boundingBox();
  assert.ok(scrub.width >= 120, `a slider of ${scrub.width} px`);
  for (const id of ['replay-speed', 'save-video', 'replay-time']) {
    const { x, y, width, height } = await part(page, id).boundingBox();
    assert.ok(x >= bar.x && x + width <= bar.x + bar.width && y >= bar.y && y + height <= bar.y + bar.height, `${id} is in its card`);
  }
  assert.deepEqual(page.complaints, []);
});
