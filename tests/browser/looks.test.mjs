// How the page looks: a press is seen, bodies stand out, texts are whole; in a real browser against the real runtime.
import assert from 'node:assert/strict';
import path from 'node:path';
import { after, test } from 'node:test';
import { bake, close, drawn, folder, project, ready, run, runtime, serve, told, until, visit } from './harness.mjs';
import { bare, barriers, contrast, difference, faults_of_layout, keep_ground, keep_pixels, layouts, rest } from './looks.mjs';
import { choose, part, recorded, settled } from './steps.mjs';

after(close);

/// A block of soft tissue with a stiffer ball in it.
const block = `name = "block"
[geometry]
box = { origin = [-0.05, -0.05, 0], size = [0.1, 0.1, 0.05], cells = [16, 16, 8] }
[mesh]
element = "hex8"
[[material]]
youngs_modulus = 3000.0
poissons_ratio = 0.45
[[material]]
youngs_modulus = 30000.0
poissons_ratio = 0.45
sphere = { center = [0, 0, 0.03], radius = 0.012 }
[[fixed]]
half_space = { point = [0, 0, 0], normal = [0, 0, -1] }
`;
const sphere = 0.012; // [m]
const place = [0.02, -0.015, 0.05];

async function serve_block(t) {
  const at = await folder(t);
  const file = await bake(at, block, 'block');
  return { at, served: await serve(t, ['play', file, '--view', '--view-address', '127.0.0.1:0', '--tool', `sphere:${sphere}`], at) };
}

async function open_block(t, options) {
  const { served } = await serve_block(t);
  return { served, page: await ready(await visit(t, served.url, options)) };
}

const small = { viewport: { width: 760, height: 500 }, is_drawn: true }; // quick to draw

const set_field = (page, field) => part(page, 'field').selectOption(field);

test('a body at rest stands out from the ground, 3 to 1, in every colouring and theme', async (t) => {
  const { page } = await open_block(t, { ...small, viewport: { width: 640, height: 420 } });
  await bare(page);
  const found = {};
  for (const theme of ['dark', 'light']) {
    await part(page, 'theme').selectOption(theme, { force: true });
    await rest(page);
    await keep_ground(page, 'ground');
    for (const field of ['none', 'magnitude', 'von-mises', 'pressure', 'z', 'material']) {
      await set_field(page, field);
      await rest(page);
      await keep_pixels(page, field);
      const { median, share } = await contrast(page, field, 'ground');
      assert.ok(share > 0.1, `${theme}, ${field}: the body takes ${share} of the picture`);
      found[`${theme} ${field}`] = median.toFixed(2);
      assert.ok(median >= 3, `${theme}, ${field}: ${JSON.stringify(found)}`);
    }
    for (const map of theme === 'dark' ? ['cividis', 'inferno', 'grey'] : []) { // whose ground is nearer to the maps' dark ends
      await set_field(page, 'von-mises');
      await part(page, 'map').selectOption(map, { force: true });
      await rest(page);
      await keep_pixels(page, map);
      const { median } = await contrast(page, map, 'ground');
      found[`${theme} ${map}`] = median.toFixed(2);
      assert.ok(median >= 3, `${theme}, ${map}: ${JSON.stringify(found)}`);
    }
    await part(page, 'map').selectOption('viridis', { force: true });
  }
  t.diagnostic(JSON.stringify(found));
  assert.deepEqual(page.complaints, []);
});

test('in plain colours a tool that hovers, presses by 7 and by 17 mm looks each time another way: 25 grey levels around it', async (t) => {
  const { served } = await serve_block(t);
  const page = await ready(await visit(t, served.url, small));
  await until(page, () => window.palpate.state.you === 'controller');
  await bare(page);
  const { x, y } = await project(page, place);
  await page.mouse.move(x, y);
  await until(page, () => window.palpate.lastFrame.tool[2] < 0.1); // it has come
  await rest(page);
  await keep_pixels(page, 'hover');
  let felt = null;
  for (const depth of [7, 17]) {
    await choose(page, 'press', depth / 1000);
    await page.mouse.move(x, y);
    await page.mouse.down();
    felt = await settled(page);
    await rest(page);
    await keep_pixels(page, `${depth} mm`);
    await page.mouse.up();
  }
  const { left, top } = await part(page, 'stage').evaluate((stage) => stage.getBoundingClientRect().toJSON());
  const centre = await project(page, felt.tool.slice(0, 3));
  const beside = await project(page, [felt.tool[0] + sphere, felt.tool[1], felt.tool[2]]);
  const radius = Math.hypot(beside.x - centre.x, beside.y - centre.y);
  for (const [one, other] of [['hover', '7 mm'], ['7 mm', '17 mm'], ['hover', '17 mm']]) {
    for (const [what, from] of [['with the tool', 0], ['beside it', 1.15 * radius]]) {
      const seen = await difference(page, one, other, { x: x - left, y: y - top, from, to: 1.9 * radius });
      t.diagnostic(`${one} and ${other}, ${what}: ${seen.toFixed(1)} grey levels`);
      assert.ok(seen >= 25, `${one} and ${other}, ${what}: ${seen} grey levels`);
    }
  }
});

test('a press of 5 mm is seen in the plain view: 12 grey levels around the tool', async (t) => {
  const { served } = await serve_block(t);
  for (const theme of ['dark', 'light']) {
    const page = await ready(await visit(t, served.url, { ...small, colorScheme: theme }));
    await until(page, () => window.palpate.state.you === 'controller');
    await bare(page);
    await rest(page);
    await keep_pixels(page, 'before');
    await choose(page, 'press', 0.005);
    const { x, y } = await project(page, place);
    await page.mouse.move(x, y);
    await page.mouse.down();
    const felt = await settled(page);
    assert.ok(felt.depth > 0.0045 && felt.depth < 0.0055, `pressed ${felt.depth} m`);
    await rest(page);
    await keep_pixels(page, 'pressed');
    await page.mouse.up();
    // The dent is as wide as three radii of the tool; what the tool itself covers does not count.
    const { left, top } = await part(page, 'stage').evaluate((stage) => stage.getBoundingClientRect().toJSON());
    const centre = await project(page, felt.tool.slice(0, 3));
    const beside = await project(page, [felt.tool[0] + sphere, felt.tool[1], felt.tool[2]]);
    const radius = Math.hypot(beside.x - centre.x, beside.y - centre.y);
    const seen = await difference(page, 'before', 'pressed', { x: x - left, y: y - top, from: 1.15 * radius, to: 1.9 * radius });
    t.diagnostic(`${theme}: ${seen.toFixed(1)} grey levels`);
    assert.ok(seen >= 12, `${theme}: ${seen} grey levels`);
    await page.context().close();
  }
});

test('arrows keep their size on the screen when the view zooms, and a legend says what they mean', async (t) => {
  const { page } = await open_block(t, small);
  await choose(page, 'press', 0.004);
  const { x, y } = await project(page, place);
  await page.mouse.move(x, y);
  await page.mouse.down();
  await settled(page);
  await rest(page);
  const legend = async () => [await part(page, 'arrow-legend-text').innerText(), (await part(page, 'arrow-legend-line').boundingBox()).width];
  const first = await legend();
  assert.match(first[0], /^[\d.]+ m?N$/);
  const yellow = async () => {
    await keep_pixels(page, 'arrows');
    return page.evaluate(() => {
      const { data } = window.kept_pixels.arrows;
      let count = 0;
      for (let k = 0; k < data.length; k += 4) if (data[k] > 225 && data[k + 1] > 170 && data[k + 1] < 215 && data[k + 2] < 110) ++count;
      return count;
    });
  };
  await bare(page);
  const before = await yellow();
  for (let k = 0; k < 4; ++k) await page.keyboard.press('-');
  await rest(page);
  const zoomed = await yellow();
  await page.mouse.up();
  assert.ok(before > 50 && Math.abs(zoomed / before - 1) < 0.25, `${before} pixels of the arrow, ${zoomed} from farther away`);
});

test('axes have names, and lines of the plots are told apart without colours', async (t) => {
  const { page } = await open_block(t);
  assert.deepEqual((await part(page, 'axes').locator('text').allTextContents()).sort(), ['x', 'y', 'z']);
  const styles = await page.locator('.key').first().locator('i').evaluateAll((lines) => lines.map((line) => getComputedStyle(line).borderTopStyle));
  assert.ok(new Set(styles).size >= 3, `the lines of the force: ${styles}`);
});

test('where the body is held it is hatched', async (t) => {
  const { page } = await open_block(t, small);
  await bare(page);
  await part(page, 'look-from').evaluate((select) => {
    select.value = 'bottom';
    select.dispatchEvent(new Event('change'));
  });
  const red = async (name) => {
    await rest(page);
    await keep_pixels(page, name);
    const { x, y } = await project(page, [0, 0, 0]);
    const { left, top } = await part(page, 'stage').evaluate((stage) => stage.getBoundingClientRect().toJSON());
    return page.evaluate(([key, i, j]) => {
      const { data, width } = window.kept_pixels[key];
      const square = Array.from({ length: 1600 }, (_, k) => data[4 * ((j + Math.floor(k / 40)) * width + i + (k % 40))]);
      return square.sort((a, b) => a - b)[800]; // the nodes' dots are few
    }, [name, Math.round(x - left), Math.round(y - top)]);
  };
  const hatched = await red('hatched');
  await part(page, 'show-held').evaluate((box) => box.click());
  const plain = await red('plain');
  assert.ok(plain - hatched > 20, `red of the held ground: ${hatched}, without hatching ${plain}`);
});

test('a stiffer ball within is seen: by material, cut open, and through the surface', async (t) => {
  const { page } = await open_block(t, small);
  await bare(page);
  const blue = async (name) => {
    await rest(page);
    await keep_pixels(page, name);
    return page.evaluate((key) => {
      const { data } = window.kept_pixels[key];
      let count = 0;
      for (let k = 0; k < data.length; k += 4) if (data[k + 2] > data[k] + 25) ++count;
      return count;
    }, name);
  };
  await part(page, 'theme').selectOption('light', { force: true });
  await part(page, 'show-held').evaluate((box) => box.click()); // its dots are bluish
  await set_field(page, 'material');
  await part(page, 'materials').locator('li').first().waitFor();
  assert.deepEqual(await part(page, 'materials').locator('li').allInnerTexts(), ['1: E = 3.0 kPa', '2: E = 30 kPa']);
  const closed = await blue('closed');
  await part(page, 'section').selectOption('y', { force: true });
  const cut = await blue('cut');
  await part(page, 'section').selectOption('off', { force: true });
  await page.keyboard.press('x');
  const through = await blue('through');
  assert.ok(cut > 1000 && through > 1000 && closed < 0.1 * Math.min(cut, through), `blue pixels: closed ${closed}, cut ${cut}, through ${through}`);
});

test('without a graphics card the ground of a very large window is even, as a gradient is copied into each picture', async (t) => {
  const { served } = await serve_block(t);
  const page = await ready(await visit(t, served.url, { viewport: { width: 1280, height: 800 } }));
  const gradient = () => part(page, 'stage').evaluate((stage) => getComputedStyle(stage).backgroundImage);
  assert.match(await gradient(), /radial-gradient/);
  await page.setViewportSize({ width: 3840, height: 2160 });
  await until(page, () => getComputedStyle(document.querySelector('[data-testid="stage"]')).backgroundImage === 'none');
});

test('no text is cut off or covered, and every target is large enough, at five sizes', async (t) => {
  const { at, served } = await serve_block(t);
  const html = path.join(at, 'out.html');
  await run(runtime, ['export', await recorded(t, at), '--html', html]);
  const check = async (page, what) => {
    await drawn(page, 3); // what follows the size of a part
    const { width, height, hasTouch } = page.window;
    assert.deepEqual(await faults_of_layout(page, hasTouch ? 44 : 24), [], `${width} × ${height}, ${what}`);
  };
  const check_live = async (page) => {
    await set_field(page, 'von-mises');
    const { x, y } = await project(page, place);
    await page.mouse.move(x, y);
    await page.mouse.down();
    await settled(page);
    await check(page, 'pressed');
    await page.mouse.up();
    await page.mouse.move(1, 1);
    await page.keyboard.press('v');
    await check(page, 'with the card of the view');
    await page.keyboard.press('v');
    await page.keyboard.press('?');
    await check(page, 'with the help');
    await page.keyboard.press('Escape');
  };
  const check_recorded = async (page) => {
    await set_field(page, 'von-mises');
    await check(page, 'a recording');
    const [first, ...others] = await page.locator('.numbers > :visible').evaluateAll((tiles) => tiles.map((tile) => tile.getBoundingClientRect().toJSON()));
    const right = Math.max(first.right, ...others.map((tile) => tile.right));
    for (const tile of [first, ...others]) {
      const is_last = ![first, ...others].some((other) => Math.abs(other.top - tile.top) < 2 && other.left > tile.left + 2);
      if (is_last) assert.ok(right - tile.right < 2, `a row of the numbers has a hole at ${page.window.width} × ${page.window.height}`);
    }
    const scrub = await part(page, 'scrub').boundingBox();
    assert.ok(scrub.width >= 90, `a slider of ${scrub.width} px`);
  };
  // A page is opened once with touch and once without, and its window takes the sizes in turn.
  for (const touch of [true, false]) {
    const sizes = layouts.filter(([, , hasTouch]) => hasTouch === touch);
    for (const [url, act] of [[served.url, check_live], [`file://${html}`, check_recorded]]) {
      const [width, height] = sizes[0];
      const page = await ready(await visit(t, url, { viewport: { width, height }, hasTouch: touch, isMobile: touch }));
      if (act === check_live) await until(page, () => window.palpate.state.you === 'controller');
      for (const [width, height, hasTouch] of sizes) {
        page.window = { width, height, hasTouch };
        await page.setViewportSize({ width, height });
        await act(page);
      }
      assert.deepEqual(page.complaints, []);
      await page.context().close();
    }
  }
});

test('body and arrow keep off the legend, the colours and the cards, at five sizes', async (t) => {
  const { served } = await serve_block(t);
  const around = (page, ids) =>
    page.evaluate((names) => names.map((name) => document.querySelector(`[data-testid="${name}"]`)).filter((card) => card.offsetHeight > 0).map((card) => ({ name: card.dataset.testid, ...card.getBoundingClientRect().toJSON() })), ids);
  const lies_on = (box, cards) => cards.filter((card) => Math.min(box.right, card.right) - Math.max(box.left, card.left) > 0 && Math.min(box.bottom, card.bottom) - Math.max(box.top, card.top) > 0).map(({ name }) => name);
  for (const touch of [true, false]) {
    const sizes = layouts.filter(([, , hasTouch]) => hasTouch === touch);
    const page = await ready(await visit(t, served.url, { viewport: { width: sizes[0][0], height: sizes[0][1] }, hasTouch: touch, isMobile: touch }));
    await until(page, () => window.palpate.state.you === 'controller');
    for (const [width, height] of sizes) {
      await page.setViewportSize({ width, height });
      for (const field of ['material', 'von-mises']) {
        await set_field(page, field);
        await rest(page);
        const what = `${width} × ${height}, ${field}`;
        const cards = await around(page, ['colour-card', 'materials', 'colour-gradient', 'hand']);
        assert.equal(cards.some(({ name }) => name === 'materials'), field === 'material', what);
        const drawn_on = await page.locator('.stage > canvas').evaluate((canvas) => canvas.getBoundingClientRect().toJSON());
        assert.deepEqual(lies_on({ ...drawn_on, right: drawn_on.right - 1 }, await around(page, ['colour-bar'])), [], `${what}: what is pulled or zoomed to there lies under the bar`);
        assert.deepEqual(lies_on((await told(page, 'seen')).body, cards), [], `${what}: the body lies on a card`);
        for (const at of [[-0.04, 0.048, 0.05], [0.02, -0.015, 0.05], [0.048, 0.048, 0.05]]) { // the farthest edge, which is the highest in the picture, and the corner beside the legend
          const { x, y } = await project(page, at);
          await page.mouse.move(x, y);
          await page.mouse.down();
          await settled(page);
          await rest(page);
          const ends = (await told(page, 'seen')).arrow;
          await page.mouse.up();
          await until(page, () => window.palpate.lastFrame.contacts === 0);
          const [a, b] = ends;
          const box = { left: Math.min(a.x, b.x) - 2, right: Math.max(a.x, b.x) + 2, top: Math.min(a.y, b.y) - 2, bottom: Math.max(a.y, b.y) + 2 };
          assert.deepEqual(lies_on(box, cards), [], `${what}: the arrow of a press at ${at} runs under a card`);
          assert.ok(Math.hypot(a.x - b.x, a.y - b.y) > 5, `${what}: an arrow from ${JSON.stringify(a)} to ${JSON.stringify(b)}`);
        }
      }
    }
    assert.deepEqual(page.complaints, []);
    await page.context().close();
  }
});

test('axe-core finds nothing serious, in both themes', async (t) => {
  const { at, served } = await serve_block(t);
  const html = path.join(at, 'out.html');
  await run(runtime, ['export', await recorded(t, at), '--html', html]);
  for (const colorScheme of ['dark', 'light']) {
    const page = await ready(await visit(t, served.url, { colorScheme }));
    await set_field(page, 'von-mises');
    assert.deepEqual(await barriers(page), [], colorScheme);
    await page.keyboard.press('v');
    assert.deepEqual(await barriers(page), [], `${colorScheme}, card of the view`);
    await page.keyboard.press('v');
    await page.keyboard.press('?');
    assert.deepEqual(await barriers(page), [], `${colorScheme}, help`);
    await page.keyboard.press('Escape');
    await until(page, () => window.palpate.state.you === 'controller');
    await part(page, 'pause').click();
    await until(page, () => window.palpate.state.paused);
    assert.deepEqual(await barriers(page), [], `${colorScheme}, paused`);
    await part(page, 'pause').click();
    await page.context().close();
    const replay = await ready(await visit(t, `file://${html}`, { colorScheme }));
    assert.deepEqual(await barriers(replay), [], `${colorScheme}, a recording`);
    await replay.context().close();
  }
});
