// One page that needs nothing else: scripts and styles stand in it.
import { createHash } from 'node:crypto';
import { readFileSync } from 'node:fs';
import { defineConfig, type Plugin } from 'vite';

const used = ['three', 'uplot'];

/** The text of an element as the source of a content security policy: no other script or style may stand in the page. */
function hash_of(text: string): string {
  if (text.includes('\r')) throw new Error('a browser reads a carriage return as another character');
  return `'sha256-${createHash('sha256').update(text).digest('base64')}'`;
}

/** Puts scripts and styles in the place of the elements that name them, what a policy needs to know of them into <meta name="sources">, and the licences of what is used at the end. */
function single_file(): Plugin {
  return {
    name: 'single-file',
    enforce: 'post',
    generateBundle(_, bundle) {
      const page = bundle['index.html'];
      if (page?.type !== 'asset') throw new Error('there is no index.html');
      let html = String(page.source);
      const replace = (element: RegExp, by: string) => {
        if (!element.test(html)) throw new Error(`index.html has no ${element}`);
        html = html.replace(element, () => by);
      };
      const sources: string[] = [];
      for (const [name, part] of Object.entries(bundle)) {
        if (part === page) continue;
        const file = name.replaceAll('.', '\\.');
        if (part.type === 'chunk') {
          const code = part.code.replaceAll('</script', '<\\/script').replaceAll('<!--', '<\\!--');
          replace(new RegExp(`<script[^>]*src="[^"]*${file}"[^>]*></script>`), `<script type="module">${code}</script>`);
          sources.push(hash_of(code));
        } else {
          replace(new RegExp(`<link[^>]*href="[^"]*${file}"[^>]*>`), `<style>${String(part.source)}</style>`);
          sources.push(hash_of(String(part.source)));
        }
        delete bundle[name];
      }
      replace(/<head>/, `<head>\n<meta name="sources" content="${sources.join(' ')}">`);
      const licences = used.map((name) => `${name}\n${readFileSync(`node_modules/${name}/LICENSE`, 'utf8')}`).join('\n');
      page.source = `${html}\n<!--\nThis page contains:\n\n${licences.replaceAll('--', '- -')}-->\n`;
    },
  };
}

export default defineConfig({
  plugins: [single_file()],
  build: {
    target: 'es2022',
    modulePreload: { polyfill: false },
    cssCodeSplit: false,
    assetsInlineLimit: Number.MAX_SAFE_INTEGER,
    chunkSizeWarningLimit: 2000,
    rollupOptions: { output: { inlineDynamicImports: true } },
  },
});
