// Pages that come, go, watch and attack, in a real browser against the real runtime.
import assert from 'node:assert/strict';
import { createServer, request } from 'node:http';
import { existsSync } from 'node:fs';
import { copyFile, readFile } from 'node:fs/promises';
import { after, test } from 'node:test';
import { close, example, open, project, ready, serve, source, told, until, visit } from './harness.mjs';
import { open_cube, part, serve_cube, settled, top } from './steps.mjs';

after(close);

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
  await until(page, (ticks) => window.palpate.state.ticks > ticks + 500, (await told(page, 'state')).ticks);
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
  const { served } = await serve_cube(t);
  const page = await ready(await visit(t, served.url));
  await page.evaluate(() => {
    const badge = document.querySelector('[data-testid="connection"]');
    window.seen_states = [];
    new MutationObserver(() => window.seen_states.push(badge.dataset.state)).observe(badge, { attributes: true });
  });
  await page.workers()[0].evaluate(() => globalThis.palpate.lose());
  await until(page, () => window.seen_states.includes('lost') && window.seen_states.at(-1) === 'live');
  const count = await told(page, 'frames');
  await until(page, (before) => window.palpate.frames > before + 5, count);
  await page.reload();
  await ready(page);
  assert.equal(await part(page, 'connection').innerText(), 'connected');
  const [download] = await Promise.all([page.waitForEvent('download'), part(page, 'save-stl').click()]);
  assert.ok((await readFile(await download.path())).length > 84);
});

test('a page finds the next run of the same body, and says where another one is shown or another program has the port', async (t) => {
  const first = await serve_cube(t);
  await first.served.stop();
  const start = (file) => serve(t, ['play', file, '--view', '--view-address', `127.0.0.1:${first.served.port}`], first.at, { env: { ...process.env, XDG_RUNTIME_DIR: first.at } });
  let served = await start(first.file);
  const page = await ready(await visit(t, served.url));
  const connected = (is_so) => until(page, (wanted) => (document.querySelector('[data-testid="connection"]').dataset.state === 'live') === wanted, is_so);
  await served.stop();
  await connected(false);
  await page.getByText('Start it again as before').waitFor();
  const asked = [];
  const stranger = createServer((request, response) => (asked.push(request.url), response.end('{}'))).listen(served.port, '127.0.0.1');
  await page.getByText('Open the whole address that palpate-runtime printed').waitFor();
  stranger.closeAllConnections();
  await new Promise((resolve) => stranger.close(resolve));
  assert.ok(asked.length > 0 && asked.every((url) => /^\/proof\?nonce=\w{32}$/.test(url)), `a stranger was asked ${asked}`);
  served = await start(first.file);
  await connected(true);
  await until(page, () => window.palpate.state.you === 'controller');
  await served.stop();
  const copy = `${first.at}/other.palpate.hdf`;
  await copyFile(first.file, copy);
  served = await start(copy);
  await page.getByText('This address shows something else now').waitFor();
  await page.reload();
  await page.getByText('This address shows nothing now').waitFor();
  await page.getByText('Open the whole address that palpate-runtime printed').waitFor();
  await page.goto(served.url);
  await ready(page);
});

test('the help opens the book, if scripts/docs has built it, and the book can be searched', async (t) => {
  const { page } = await open_cube(t);
  await part(page, 'help').click();
  const is_built = existsSync(`${source}/build/docs/html/index.html`);
  assert.equal(await part(page, 'book').isVisible(), is_built);
  if (!is_built) return;
  const [book] = await Promise.all([page.waitForEvent('popup'), part(page, 'book').getByRole('link').click()]);
  const refused = [];
  book.on('console', (said) => said.type() === 'error' && refused.push(said.text()));
  book.on('pageerror', (error) => refused.push(String(error)));
  await book.getByRole('heading', { level: 1 }).waitFor();
  await book.getByPlaceholder('Search').fill('overlay');
  await book.getByPlaceholder('Search').press('Enter');
  await book.getByRole('link', { name: /overlay/i }).first().waitFor();
  await book.locator('.theme-toggle:visible').first().click();
  assert.notEqual(await book.evaluate(() => document.body.dataset.theme), 'auto');
  assert.deepEqual(refused, []);
});

test('foreign pages are refused', async (t) => {
  const { served } = await serve_cube(t);
  const { search } = new URL(served.url);
  const status = (headers, query = search) =>
    new Promise((resolve, reject) => {
      const asked = request({ host: '127.0.0.1', port: served.port, path: `/socket${query}`, headers: { Connection: 'Upgrade', Upgrade: 'websocket', 'Sec-WebSocket-Version': '13', 'Sec-WebSocket-Key': 'AAAAAAAAAAAAAAAAAAAAAA==', 'Sec-WebSocket-Protocol': 'palpate.2', ...headers } });
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
        const socket = new WebSocket(url, 'palpate.2');
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
          const socket = new WebSocket(url, 'palpate.2');
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
