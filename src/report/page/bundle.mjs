// bundle.mjs FOLDER PAGE.html: the page with its script and style in one file; three.js and uPlot
// come from FOLDER/node_modules.
import { readFile, writeFile, rename } from 'node:fs/promises';
import { createRequire } from 'node:module';
import { dirname, join } from 'node:path';
import { fileURLToPath } from 'node:url';

const [folder, page] = process.argv.slice(2);
const source = dirname(fileURLToPath(import.meta.url));
const esbuild = createRequire(join(folder, 'package.json'))('esbuild');

async function bundled(entry) {
  const result = await esbuild.build({
    entryPoints: [join(source, entry)],
    nodePaths: [join(folder, 'node_modules')],
    bundle: true,
    minify: true,
    write: false,
    format: 'iife',
    target: 'es2022',
    legalComments: 'inline',
    logLevel: 'warning',
  });
  return result.outputFiles[0].text;
}

const style = await bundled('style.css');
const script = await bundled('main.js');
const whole = (await readFile(join(source, 'page.html'), 'utf8'))
  .replace('<!--style-->', () => `<style>${style}</style>`)
  .replace('<!--script-->', () => `<script>${script.replaceAll('</script', '<\\/script')}</script>`);
await writeFile(`${page}.new`, whole);
await rename(`${page}.new`, page);
