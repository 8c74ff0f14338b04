// The programs and the browser for the tests of the viewer's page.
import assert from 'node:assert/strict';
import { execFile, spawn } from 'node:child_process';
import { mkdtemp, rm, writeFile } from 'node:fs/promises';
import { createRequire } from 'node:module';
import { tmpdir } from 'node:os';
import path from 'node:path';
import { promisify } from 'node:util';

const { chromium } = createRequire(path.join(process.env.PALPATE_BROWSER_MODULES, 'package.json'))('playwright-core');
const binary = process.env.PALPATE_BINARY_DIR;
const precompute = path.join(binary, 'precompute/palpate-precompute');
export const runtime = path.join(binary, 'runtime/palpate-runtime');
export const source = path.resolve(import.meta.dirname ?? path.dirname(new URL(import.meta.url).pathname), '../..');

export const run = promisify(execFile);

/// An empty folder that is gone after the test.
export async function folder(t) {
  const made = await mkdtemp(path.join(tmpdir(), 'palpate-'));
  t.after(() => rm(made, { recursive: true, force: true }));
  return made;
}

/// Bakes a description; returns the file.
export async function bake(into, toml, name = 'model') {
  const description = path.join(into, `${name}.toml`);
  await writeFile(description, toml);
  const file = path.join(into, `${name}.palpate.hdf`);
  await run(precompute, [description, '-o', file], { cwd: into });
  return file;
}

/// theory.md section 4's cube, of tetrahedra; E = 1 Pa.
export function cube(cells, more = '') {
  return `name = "cube"
[geometry]
box = { origin = [0, 0, 0], size = [1, 1, 1], cells = [${cells}, ${cells}, ${cells}] }
[material]
youngs_modulus = 1.0
poissons_ratio = 0.3
[[fixed]]
half_space = { point = [0, 0, 0], normal = [0, 0, -1] }
${more}`;
}

/// palpate-runtime with a page: { url, port, child, output(), stop() }. Stopped after the test.
export async function serve(t, args, cwd) {
  const child = spawn(runtime, args, { cwd, stdio: ['ignore', 'pipe', 'pipe'] });
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
    args: ['--no-sandbox', '--use-angle=swiftshader', '--enable-unsafe-swiftshader', '--ignore-gpu-blocklist'],
  });
  return browser;
}

export async function close() {
  await browser?.close();
  browser = null;
}

/// A page of its own context, which notes what goes wrong in it: errors of scripts, and requests to anywhere but the runtime.
export async function visit(t, url, options = {}) {
  const context = await (await open()).newContext({ viewport: { width: 1280, height: 800 }, ...options });
  t.after(() => context.close());
  const page = await context.newPage();
  page.setDefaultTimeout(30_000);
  page.complaints = [];
  page.on('pageerror', (error) => page.complaints.push(String(error)));
  page.on('request', (request) => {
    const to = new URL(request.url());
    if (['http:', 'https:', 'ws:', 'wss:'].includes(to.protocol) && to.host !== new URL(url).host) page.complaints.push(`asks ${to}`);
  });
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

/// Where a point of the body is on the screen [px].
export async function project(page, point) {
  return page.evaluate(([x, y, z]) => window.palpate.project(x, y, z), point);
}

export function near(value, wanted, share, what) {
  assert.ok(Math.abs(value - wanted) <= share * Math.abs(wanted), `${what}: ${value}, wanted ${wanted} within ${share}`);
}
