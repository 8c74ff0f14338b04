// Two runs side by side, with one camera, one range of colours and one playhead, in a real browser against the real runtime.
import assert from 'node:assert/strict';
import { createServer } from 'node:http';
import path from 'node:path';
import { after, test } from 'node:test';
import { close, drawn, folder, open, project, ready, run, runtime, serve, told, until, visit } from './harness.mjs';
import { barriers, faults_of_layout, layouts, rest } from './looks.mjs';
import { choose, part, recorded, settled, top } from './steps.mjs';

after(close);

const window_size = { viewport: { width: 900, height: 500 } };

/// The pages within the page: [first, second], both with a picture.
async function panes(page) {
  const found = [];
  for (const id of ['pane-1', 'pane-2']) found.push(await (await part(page, id).elementHandle()).contentFrame());
  for (const pane of found) await ready(pane);
  return found;
}

const scrub_to = (pane, frame) =>
  pane.evaluate((value) => {
    const scrub = document.querySelector('[data-testid="scrub"]');
    scrub.value = String(value);
    scrub.dispatchEvent(new Event('input'));
  }, frame);

const ticks_of_bar = (pane) => part(pane, 'colour-ticks').locator('span').allInnerTexts();

test('two recordings have one camera, one range of colours and one playhead', async (t) => {
  const [soft, stiff] = [await folder(t), await folder(t)];
  const one = await recorded(t, soft, 0.1);
  const other = await recorded(t, stiff, 0.1, '--stiffness-scale', '4');
  const served = await serve(t, ['view', one, other, '--view-address', '127.0.0.1:0'], soft);
  assert.match(served.url, /\/beside\?token=/);
  const page = await visit(t, served.url, window_size);
  const [first, second] = await panes(page);
  for (const pane of [first, second]) assert.equal((await told(pane, 'state')).you, 'controller');
  const same_eye = async () => {
    const [a, b] = [await told(first, 'eye'), await told(second, 'eye')];
    return Math.max(...a.towards.map((value, k) => Math.abs(value - b.towards[k])), Math.abs(a.away - b.away));
  };

  const before = (await told(second, 'eye')).towards;
  await part(first, 'view').focus();
  for (let k = 0; k < 3; ++k) await page.keyboard.press('Shift+ArrowRight');
  await page.keyboard.press('+');
  await until(second, (towards) => Math.hypot(...window.palpate.eye.towards.map((one, k) => one - towards[k])) > 0.2, before);
  for (let round = 0; (await same_eye()) > 1e-6; ++round) {
    assert.ok(round < 400, `the cameras are ${await same_eye()} apart`);
    await page.waitForTimeout(50);
  }

  const { times } = await told(first, 'state');
  const at = Math.floor(times.length / 2);
  await scrub_to(second, at);
  await until(first, () => window.palpate.lastFrame.force[2] < 0);
  await until(second, () => window.palpate.lastFrame.force[2] < 0);
  assert.ok(Math.abs((await told(first, 'time')) - (await told(second, 'time'))) < 0.02);
  const ratio = (await told(second, 'lastFrame')).force[2] / (await told(first, 'lastFrame')).force[2];
  assert.ok(Math.abs(ratio - 4) < 0.2, `the stiffer one's force is ${ratio} times as large`);

  await part(first, 'field').selectOption('von-mises');
  await until(second, () => document.querySelector('[data-testid="field"]').value === 'von-mises');
  await until(second, () => document.querySelectorAll('[data-testid="colour-ticks"] span').length > 0);
  await until(first, (wanted) => [...document.querySelectorAll('[data-testid="colour-ticks"] span')].map((tick) => tick.innerText).join() === wanted, (await ticks_of_bar(second)).join());
  const largest = async (pane) => parseFloat((await part(pane, 'colour-largest').innerText()).replace('largest ', ''));
  assert.ok((await largest(second)) > 2 * (await largest(first)), 'the stiffer one has the larger stress');

  const pictures = async () => {
    const drawn = [];
    for (const pane of [first, second]) {
      await rest(pane);
      drawn.push((await told(pane, 'picture')).pictures);
    }
    return drawn;
  };
  const rested = await pictures();
  for (const pane of [first, second]) await drawn(pane, 30);
  assert.deepEqual(await pictures(), rested, 'both come to rest, though their ranges differ');

  await part(first, 'replay-play').click();
  await until(second, (time) => window.palpate.time > time + 0.1, times[at]);
  await part(second, 'replay-play').click(); // it plays now, and the first follows
  await until(first, () => document.querySelector('[data-testid="replay-play"]').innerText === 'Play');
  assert.deepEqual(page.complaints, []);
});

test('a recording stands beside a body that is touched', async (t) => {
  const at = await folder(t);
  const session = await recorded(t, at, 0.1);
  const file = path.join(at, 'model.palpate.hdf');
  const served = await serve(t, ['play', file, '--view', '--view-address', '127.0.0.1:0', '--tool', 'sphere:0.1', '--beside', session], at);
  const page = await visit(t, served.url, window_size);
  const [live, recording] = await panes(page);
  assert.equal((await told(recording, 'state')).pointer, false);
  await choose(live, 'press', 0.02);
  const { x, y } = await project(live, top);
  const corner = await part(page, 'pane-1').boundingBox();
  await page.mouse.move(corner.x + x, corner.y + y);
  await page.mouse.down();
  assert.ok((await settled(live)).force[2] < 0);
  await page.mouse.up();
  assert.ok(Math.abs((await told(recording, 'lastFrame')).force[2]) === 0, 'it is not pressed');
  const [download] = await Promise.all([page.waitForEvent('download'), part(live, 'save-stl').evaluate((button) => button.click())]);
  assert.match(download.suggestedFilename(), /\.stl$/);
  assert.deepEqual(page.complaints, []);
});

test('no text is cut off or covered, and every target is large enough, at five sizes', async (t) => {
  const at = await folder(t);
  const session = await recorded(t, at, 0.1);
  const served = await serve(t, ['play', path.join(at, 'model.palpate.hdf'), '--view', '--view-address', '127.0.0.1:0', '--tool', 'sphere:0.1', '--beside', session], at);
  for (const [width, height, hasTouch] of layouts) {
    const page = await visit(t, served.url, { viewport: { width, height }, hasTouch, isMobile: hasTouch });
    const both = await panes(page);
    await until(both[0], () => window.palpate.state.you === 'controller');
    await part(both[0], 'field').selectOption('von-mises');
    await until(both[1], () => document.querySelector('[data-testid="field"]').value === 'von-mises');
    await scrub_to(both[1], 30); // it is pressed, so that there is something to colour
    await until(both[1], () => document.querySelectorAll('[data-testid="colour-ticks"] span').length > 0);
    for (const [k, pane] of both.entries()) {
      const check = async (what) => assert.deepEqual(await faults_of_layout(pane, hasTouch ? 44 : 24), [], `${width} × ${height}, ${k === 0 ? 'live' : 'recorded'}${what}`);
      await check('');
      await part(pane, 'view-menu').click();
      await check(', with the card of the view');
      await part(pane, 'view-menu').click();
      const { height: seen } = await part(pane, 'view').boundingBox();
      assert.ok(seen > 0.4 * height, `${width} × ${height}: the picture is ${seen} px high`);
    }
    if (width === 1280) {
      assert.deepEqual(await barriers(page), []);
      for (const pane of both) assert.deepEqual(await barriers(pane), []);
    }
    assert.deepEqual(page.complaints, []);
    await page.context().close();
  }
});

/// A page of another address with a frame that shows `url`.
async function framing(t, url) {
  const foreign = createServer((_, response) => response.end(`<!doctype html><iframe src="${url}" width="800" height="450"></iframe>`));
  await new Promise((resolve) => foreign.listen(0, '127.0.0.1', resolve));
  t.after(() => foreign.close());
  const context = await (await open()).newContext(window_size);
  t.after(() => context.close());
  return { page: await context.newPage(), address: `http://127.0.0.1:${foreign.address().port}/` };
}

test('a notebook may have it in a frame where that is asked for', async (t) => {
  const at = await folder(t);
  const served = await serve(t, ['view', await recorded(t, at), '--view-address', '127.0.0.1:0', '--view-framed'], at);
  const { page, address } = await framing(t, served.url);
  await page.goto(address);
  const inner = await (await page.locator('iframe').elementHandle()).contentFrame();
  await ready(inner);
  assert.equal((await told(inner, 'state')).you, 'controller');
});

test('pages of other addresses cannot have it in them', async (t) => {
  const at = await folder(t);
  const session = await recorded(t, at);
  const served = await serve(t, ['view', session, session, '--view-address', '127.0.0.1:0'], at);
  const own = served.url.replace('/beside', '/');
  const { page, address } = await framing(t, own);
  const refused = page.waitForEvent('console', { predicate: (said) => /frame-ancestors/.test(said.text()) });
  await page.goto(address);
  await refused;
  assert.equal(await page.frames()[1].evaluate(() => window.palpate === undefined), true);
  const { stderr } = await run(runtime, ['view', session, session, session]).catch((error) => error);
  assert.match(stderr, /^error: /);
});
