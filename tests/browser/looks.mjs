// What tests of the page's looks measure: colours of pixels, places of texts and controls.
import { readFileSync } from 'node:fs';
import { createRequire } from 'node:module';
import path from 'node:path';
import { drawn } from './harness.mjs';

const axe = readFileSync(createRequire(path.join(process.env.PALPATE_BROWSER_MODULES, 'package.json')).resolve('axe-core/axe.min.js'), 'utf8');

/// Windows that the page is looked at in: width, height, and whether by touch.
export const layouts = [
  [360, 640, true],
  [640, 360, true],
  [900, 600, false],
  [1280, 800, false],
  [3840, 2160, false],
];

/// Hides all that stands over the picture.
export async function bare(page) {
  await page.evaluate(() => {
    const style = new CSSStyleSheet();
    style.replaceSync('.stage > :not(canvas) { opacity: 0 !important; }');
    document.adoptedStyleSheets.push(style);
  });
}

/// The picture came to rest: it is drawn whole, and nothing changes it.
export async function rest(page) {
  await drawn(page, 2); // what was asked for
  await page.waitForFunction(() => {
    const now = window.palpate.picture;
    const same = window.rested?.pictures === now.pictures && now.rests;
    window.rested = now;
    return same;
  }, undefined, { polling: 120 });
}

/// Keeps the pixels of the stage in the page under `name`; `bare` first.
export async function keep_pixels(page, name) {
  const png = await page.getByTestId('stage').screenshot({ animations: 'disabled' });
  await page.evaluate(async ([key, base64]) => {
    const bitmap = await createImageBitmap(new Blob([Uint8Array.from(atob(base64), (c) => c.charCodeAt(0))], { type: 'image/png' }));
    const surface = new OffscreenCanvas(bitmap.width, bitmap.height).getContext('2d');
    surface.drawImage(bitmap, 0, 0);
    (window.kept_pixels ??= {})[key] = surface.getImageData(0, 0, bitmap.width, bitmap.height);
  }, [name, png.toString('base64')]);
}

/// The ground alone.
export async function keep_ground(page, name) {
  await page.evaluate(() => (document.querySelector('canvas').style.visibility = 'hidden'));
  await keep_pixels(page, name);
  await page.evaluate(() => (document.querySelector('canvas').style.visibility = ''));
}

/// Contrast (WCAG 2) of what `name` shows against `ground`: of the median pixel, and the share of pixels that differ.
export const contrast = (page, name, ground) =>
  page.evaluate(([one, other]) => {
    const linear = (c) => (c <= 10 ? c / 255 / 12.92 : ((c / 255 + 0.055) / 1.055) ** 2.4);
    const [a, b] = [window.kept_pixels[one].data, window.kept_pixels[other].data];
    const light = (data, k) => 0.2126 * linear(data[k]) + 0.7152 * linear(data[k + 1]) + 0.0722 * linear(data[k + 2]);
    const ratios = [];
    for (let k = 0; k < a.length; k += 4) {
      if (Math.abs(a[k] - b[k]) + Math.abs(a[k + 1] - b[k + 1]) + Math.abs(a[k + 2] - b[k + 2]) < 12) continue;
      const [x, y] = [light(a, k) + 0.05, light(b, k) + 0.05];
      ratios.push(Math.max(x / y, y / x));
    }
    ratios.sort((x, y) => x - y);
    return { median: ratios[ratios.length >> 1], share: ratios.length / (a.length / 4) };
  }, [name, ground]);

/// Mean difference of grey levels between two pictures, within a ring around a place of the stage [px].
export const difference = (page, one, other, { x, y, from, to }) =>
  page.evaluate(([a, b, ring]) => {
    const [first, second] = [window.kept_pixels[a], window.kept_pixels[b]];
    let [sum, count] = [0, 0];
    for (let j = 0; j < first.height; ++j) {
      for (let i = 0; i < first.width; ++i) {
        const away = Math.hypot(i - ring.x, j - ring.y);
        if (away < ring.from || away > ring.to) continue;
        const k = 4 * (j * first.width + i);
        const grey = ({ data }) => 0.299 * data[k] + 0.587 * data[k + 1] + 0.114 * data[k + 2];
        sum += Math.abs(grey(first) - grey(second));
        ++count;
      }
    }
    return sum / count;
  }, [one, other, { x, y, from, to }]);

/// Texts that are cut off or covered, controls that are smaller than `target` pixels: sentences, none where all is well.
export const faults_of_layout = (page, target) =>
  page.evaluate((least) => {
    const style = new CSSStyleSheet(); // as the page lets no other style in
    style.replaceSync('*, *::before, *::after { pointer-events: auto !important; transition: none !important; } .over, .marks, .toasts, .colour-bar { pointer-events: none !important; }'); // which are nothing themselves
    document.adoptedStyleSheets.push(style);
    const found = [];
    const shown = (element) => element.checkVisibility({ visibilityProperty: true, opacityProperty: true }) && element.getClientRects().length > 0;
    const scrolls = (element) => ['auto', 'scroll'].includes(getComputedStyle(element).overflowY);
    // What of a box is left by the parts around it; null: it is scrolled out of sight.
    const seen = (box, element) => {
      let rect = { left: box.left, top: box.top, right: box.right, bottom: box.bottom };
      let is_scrolled = false;
      for (let at = element; at; at = at.parentElement) {
        const { overflowX, overflowY } = getComputedStyle(at);
        if (overflowX === 'visible' && overflowY === 'visible') continue;
        const around = at.getBoundingClientRect();
        is_scrolled ||= scrolls(at);
        rect = { left: Math.max(rect.left, around.left), top: Math.max(rect.top, around.top), right: Math.min(rect.right, around.right), bottom: Math.min(rect.bottom, around.bottom) };
      }
      const cut_x = rect.left - box.left > 1 || box.right - rect.right > 1;
      const cut_y = rect.top - box.top > 1 || box.bottom - rect.bottom > 1;
      return { rect, cut: cut_x || (cut_y && !is_scrolled), out: rect.right - rect.left < 2 || rect.bottom - rect.top < Math.min(6, box.bottom - box.top - 1) };
    };
    const walker = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
    for (let node = walker.nextNode(); node; node = walker.nextNode()) {
      const element = node.parentElement;
      const text = node.textContent.trim();
      if (text === '' || !element || element.closest('script, style, option, .hidden, .u-legend') || !shown(element)) continue;
      const range = document.createRange();
      range.selectNodeContents(node);
      for (const box of range.getClientRects()) {
        if (box.width < 1) continue;
        const { rect, cut, out } = seen(box, element);
        const ellipsis = element.closest('*') && getComputedStyle(element).textOverflow === 'ellipsis';
        if (cut && !ellipsis) found.push(`"${text}" is cut off`);
        if (out || cut) continue;
        const [x, y] = [(rect.left + rect.right) / 2, (rect.top + rect.bottom) / 2];
        for (const at of [rect.left + 1, x, rect.right - 1]) {
          const over = document.elementFromPoint(at, y);
          if (over?.closest('.view-card, .help') && !element.closest('.view-card, .help')) continue; // which were opened for that
          if (over && !element.contains(over) && !over.contains(element)) found.push(`"${text}" is covered by ${over.dataset.testid ?? over.className ?? over.tagName}`);
        }
      }
    }
    for (const control of document.querySelectorAll('button, select, input')) {
      const part = control.matches('[type=checkbox], [type=radio]') ? (control.closest('label, .tick') ?? control) : control;
      if (!shown(part) || control.closest('[hidden]')) continue;
      const { width, height } = part.getBoundingClientRect();
      const name = control.dataset.testid;
      if (Math.min(width, height) < least - 0.5) found.push(`${name} is ${width.toFixed(0)} × ${height.toFixed(0)} px`);
      if (control.matches('button') && control.scrollWidth > control.clientWidth + 1 && getComputedStyle(control).textOverflow !== 'ellipsis') found.push(`${name} is too narrow for its text`);
    }
    // Cards over the picture do not lie on each other.
    const cards = ['.top-left > .row', '.hand', '.replay', '.colour-bar', '.materials', '.banner', '.fault', '.scale-bar', '.arrow-legend', '.axes']
      .flatMap((name) => [...document.querySelectorAll(name)].filter(shown).map((card) => [name, card.getBoundingClientRect()]));
    cards.forEach(([name, a], i) => cards.slice(i + 1).forEach(([other, b]) => {
      if (Math.min(a.right, b.right) - Math.max(a.left, b.left) > 1 && Math.min(a.bottom, b.bottom) - Math.max(a.top, b.top) > 1) found.push(`${name} lies on ${other}`);
    }));
    if (document.documentElement.scrollWidth > innerWidth + 1) found.push('the page is wider than the window');
    document.adoptedStyleSheets = document.adoptedStyleSheets.filter((one) => one !== style);
    return [...new Set(found)];
  }, target);

/// What axe-core finds that is serious or critical: sentences.
export async function barriers(page) {
  await page.evaluate(axe);
  const { violations } = await page.evaluate(() => window.axe.run(document, { resultTypes: ['violations'] }));
  return violations
    .filter(({ impact }) => ['serious', 'critical'].includes(impact))
    .map(({ id, nodes }) => `${id}: ${nodes.map(({ target }) => target.join(' ')).join(', ')}`);
}
