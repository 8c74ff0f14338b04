// The unit tests as modules that node's own test runner takes.
import { readdirSync } from 'node:fs';
import { defineConfig } from 'vite';

export default defineConfig({
  build: {
    ssr: true,
    target: 'node18',
    outDir: 'test-out',
    minify: false,
    rollupOptions: {
      input: readdirSync('test').map((file) => `test/${file}`),
      output: { entryFileNames: '[name].mjs' },
    },
  },
});
