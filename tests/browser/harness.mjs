// The programs and the browser for the tests of the viewer's page.
import assert from 'node:assert/strict';
import { execFile, spawn } from 'node:child_process';
import { mkdtemp, readFile, rm, writeFile } from 'node:fs/promises';
import { createRequire } from 'node:module';
import { tmpdir } from 'node:os';
import path from 'node:path';
import { promisify } from 'node:util';

const { chromium } = createRequire(path.join(process.env.PALPATE_BROWSER_MODULES, 'package.json'))('playwright-core');
const binary = process.env.PALPATE_BINARY_DIR;
const precompute = path.join(binary, 'precompute/palpate-precompute');
export const example = path.join(binary, 'runtime/palpate-bridge-example');
export const runtime = path.join(binary, 'runtime/palpate-runtime');
export const source = path.resolve(import.meta.dirname ?? path.dirname(new URL(import.meta.url).pathname), '../..');

export const run = promisify(execFile);

/// An empty folder that is gone after the test.
export async function folder(t) {
  const made = await mkdtemp(path.join(tmpdir(), 'palpate-'));
  t.after(() => rm(made, { recursive: true, force: true, maxRetries: 20, retryDelay: 100 }));
  return made;
}

const baked = new Map(); // bytes of what was baked from a description

/// Bakes a description, once however many tests want it; returns the file.
export async function bake(into, toml, name = 'model') {
  const file = path.join(into, `${name}.palpate.hdf`);
  const known = `${name}\n${toml}`;
  if (baked.has(known)) {
    await writeFile(file, baked.get(known));
    return file;
  }
  const description = path.join(into, `${name}.toml`);
  await writeFile(description, toml);
  await run(precompute, [description, '-o', file], { cwd: into });
  baked.set(known, await readFile(file));
  return file;
}

/// theory.md section 4's cube, of tetrahedra; E = 1 Pa.
export function cube(cells, more = '') {
  return `name = "cube"
[geometry]
box = { origin = [0, 0, 0], size = [1, 1, 1], cells = [${cells}, ${cells}, ${cells}] }
[mesh]
element = "tet4"
[material]
youngs_modulus = 1.0
poissons_ratio = 0.3
[[fixed]]
half_space = { point = [0, 0, 0], normal = [0, 0, -1] }
${more}`;
}

/// A block of 1 m with a shelf, 0.1 m thick, from x = 1 to 2 along its top (z = 1): the description, its surface written beside it.
export async function shelf(into) {
  const steps = { x: [0, 0.25, 0.5, 0.75, 1, 1.25, 1.5, 1.75, 2], y: [0, 0.25, 0.5, 0.75, 1], z: [0, 0.3, 0.6, 0.9, 1] };
  const solid = (i, k) => i < 4 || k === 3;
  const nodes = new Map();
  const node = (i, j, k) => {
    const key = `${i},${j},${k}`;
    if (!nodes.has(key)) nodes.set(key, { number: nodes.size + 1, at: [steps.x[i], steps.y[j], steps.z[k]] });
    return nodes.get(key).number;
  };
  const hexahedra = [];
  for (let i = 0; i < 8; ++i)
    for (let j = 0; j < 4; ++j)
      for (let k = 0; k < 4; ++k)
        if (solid(i, k)) hexahedra.push([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]].map(([a, b, c]) => node(i + a, j + b, k + c)));
  const lines = (list) => list.map((one) => one.join(' ')).join('\n');
  await writeFile(
    path.join(into, 'shelf.mesh'),
    `MeshVersionFormatted 2\nDimension 3\nVertices\n${nodes.size}\n${lines([...nodes.values()].map(({ at }) => [...at, 0]))}\nHexahedra\n${hexahedra.length}\n${lines(hexahedra.map((one) => [...one, 1]))}\nEnd\n`,
  );
  return `name = "shelf"
[geometry]
volume = "shelf.mesh"
[material]
youngs_modulus = 1.0
poissons_ratio = 0.3
[[fixed]]
half_space = { point = [0, 0, 0], normal = [0, 0, -1] }
`;
}

/// palpate-runtime with a page: { url, port, child, output(), stop() }. Stopped after the test.
export async function serve(t, args, cwd, options = {}) {
  const child = spawn(runtime, args, { cwd, stdio: ['ignore', 'pipe', 'pipe'], ...options });
  let text = '';
  const ended = new Promise((resolve) => child.on('close', (code, signal) => resolve(code ?? signal)));
  const url = await new Promise((resolve, reject) => {
    const hear = (chunk) => {
      text += chunk;
      const found = /http:\/\/[^\s]+/.exec(text);
      if (found) resolve(found[0]);
    };
    child.stderr.on('data', hear);
    child.stdout.on('data', hear);
    ended.then((code) => reject(new Error(`palpate-runtime ended with ${code}: ${text}`)));
  });
  const stop = async (signal = 'SIGINT') => {
    child.kill(signal);
    return ended;
  };
  t.after(() => stop('SIGKILL'));
  return { url, port: Number(new URL(url).port), child, ended, stop, output: () => text };
}

let browser = null;

/// A browser of this process, software rendering; the last test closes it.
export async function open() {
  browser ??= await chromium.launch({
    executablePath: process.env.PALPATE_CHROMIUM ?? '/usr/bin/chromium',
    args: ['--no-sandbox', '--enable-unsafe-swiftshader'], // as it draws by itself without a graphics card: told that it has one, it would emulate all of that
  });
  return browser;
}

export async function close() {
  await browser?.close();
  browser = null;
}

/// Leaves the body's canvas empty and out of sight: a browser without a graphics card spends most of its time on what tests of buttons and numbers do not look at.
function draw_nothing() {
  for (const name of ['clear', 'drawArrays', 'drawElements', 'drawElementsInstanced']) WebGL2RenderingContext.prototype[name] = () => undefined;
  document.addEventListener('DOMContentLoaded', () => {
    const style = new CSSStyleSheet(); // as the page lets no other style in
    style.replaceSync('.stage > canvas { visibility: hidden; }');
    document.adoptedStyleSheets.push(style);
  });
}

/// A page of its own context, which notes what goes wrong in it: errors of scripts, and requests to anywhere but the runtime. Its body is seen only if it `is_drawn`.
export async function visit(t, url, { is_drawn = false, ...options } = {}, before = null) {
  const context = await (await open()).newContext({ viewport: { width: 1280, height: 800 }, colorScheme: 'dark', ...options });
  t.after(() => context.close());
  const page = await context.newPage();
  page.setDefaultTimeout(120_000); // guards against what never comes, not against a busy machine
  page.complaints = [];
  page.on('pageerror', (error) => page.complaints.push(String(error)));
  page.on('console', (message) => /Content Security Policy/.test(message.text()) && page.complaints.push(message.text()));
  page.on('request', (request) => {
    const to = new URL(request.url());
    if (['http:', 'https:', 'ws:', 'wss:'].includes(to.protocol) && to.hostname !== new URL(url).hostname) page.complaints.push(`asks ${to}`);
  });
  if (!is_drawn) await page.addInitScript(draw_nothing);
  if (before) await page.addInitScript(before);
  await page.goto(url);
  return page;
}

/// The page has the body and a picture of it.
export async function ready(page) {
  await page.waitForFunction(() => window.palpate?.ready);
  return page;
}

/// What window.palpate[name] is now.
export const told = (page, name) => page.evaluate((key) => window.palpate[key], name);

/// Waits until `condition`, evaluated in the page with `argument`, holds.
export const until = (page, condition, argument) => page.waitForFunction(condition, argument, { polling: 50 });

/// The browser has drawn so many times.
export const drawn = (page, times) =>
  page.evaluate((count) => new Promise((done) => {
    const next = (left) => (left === 0 ? done() : requestAnimationFrame(() => next(left - 1)));
    next(count);
  }), times);

/// Where a point of the body is on the screen [px].
export async function project(page, point) {
  return page.evaluate(([x, y, z]) => window.palpate.project(x, y, z), point);
}

export function near(value, wanted, share, what) {
  assert.ok(Math.abs(value - wanted) <= share * Math.abs(wanted), `${what}: ${value}, wanted ${wanted} within ${share}`);
}

/** When each picture of a WebM file is shown [ms]: the blocks of its clusters (Matroska, RFC 9559). */
export function film_times(file) {
  const number = (at, length, first = file[at]) => file.subarray(at + 1, at + length).reduce((sum, byte) => 256 * sum + byte, first);
  const length_at = (at) => Math.clz32(file[at]) - 23;
  const parents = [0x18538067, 0x1f43b675, 0xa0]; // segment, cluster, group of blocks
  const blocks = [0xa3, 0xa1];
  const time = 0xe7;
  const times = [];
  let began = 0;
  for (let at = 0; at < file.length; ) {
    const id = number(at, length_at(at));
    at += length_at(at);
    const width = length_at(at);
    const size = number(at, width, file[at] & (0xff >> width));
    at += width;
    if (parents.includes(id)) continue; // what is in it comes next
    if (id === time) began = number(at - 1, size + 1, 0);
    if (blocks.includes(id)) times.push(began + file.readInt16BE(at + 1));
    at += size;
  }
  return times;
}
