// Puts the page together: see bundle.sh.

import {build} from 'esbuild';
import {createHash} from 'node:crypto';
import {readdirSync, readFileSync, writeFileSync} from 'node:fs';

const [here, out] = process.argv.slice(2);
const read = name => readFileSync(`${here}/${name}`, 'utf8');

/** One file of all that `entry` imports, in ASCII, without what ends a script. */
async function bundled(entry) {
  const result = await build({
    entryPoints: [`${here}/${entry}`],
    bundle: true,
    minify: true,
    charset: 'ascii',
    format: 'iife',
    target: ['es2022'],
    nodePaths: [`${process.cwd()}/node_modules`],
    legalComments: 'none',
    write: false
  });
  return result.outputFiles[0].text.trim();
}

const licence = readFileSync('node_modules/three/LICENSE', 'utf8').trim().replace('\u00a9', '(c)');
if (licence.includes('*/')) throw new Error('the licence of three.js ends a comment');
const version = JSON.parse(readFileSync('node_modules/three/package.json', 'utf8')).version;
const script = `/*!\nThe view is drawn with three.js ${version}, bundled and minified; its licence:\n\n${licence}\n*/\n${
    await bundled('main.js')}`;
const style = await bundled('style.css');
for (const text of [script, style])
  if (/<\/(script|style)|<!--/i.test(text)) throw new Error('the bundle holds what ends or opens a block of the page');
const hash = text => `'sha256-${createHash('sha256').update(text).digest('base64')}'`;
// Nothing but this script and this style, and nothing from anywhere.
const policy = `default-src 'none'; script-src ${hash(script)}; style-src ${
    hash(style)}; img-src data: blob:; base-uri 'none'; form-action 'none'`;
// By which tests/report/check_page.py sees, without node, whether the page is made of what lies here.
const sources = createHash('sha256');
for (const name of readdirSync(here).filter(name => /\.(m?js|css|html|json)$/.test(name)).sort())
  sources.update(`${name}\n`).update(readFileSync(`${here}/${name}`));
let page = read('page.template.html');
for (const [place, text] of Object.entries(
         {'bundle:sources': sources.digest('hex'), 'bundle:policy': policy, 'bundle:style': style, 'bundle:script': script}))
  page = page.replace(place, () => text);
if (/[^\n\t\x20-\x7e]/.test(page))
  throw new Error(`the page has to be ASCII: ${JSON.stringify(page.match(/.{0,30}[^\n\t\x20-\x7e].{0,30}/)[0])}`);
writeFileSync(out, page);
console.log(`${out}: ${page.length} bytes`);
