// node validate_json.mjs SCHEMA.json FILE.json...: files against a JSON Schema (draft 2020-12), by ajv.
// A FILE of `-` is standard input; an object with a `recipe` in it stands for that recipe, but for tiles.json.
import fs from 'node:fs';
import { load } from './modules.mjs';

const [schema, ...files] = process.argv.slice(2);
if (files.length === 0) {
  console.error('usage: node validate_json.mjs SCHEMA.json FILE.json...');
  process.exit(2);
}
const Ajv = load('ajv/dist/2020').default;
const check = new Ajv({ allErrors: true }).compile(JSON.parse(fs.readFileSync(schema)));
let bad = 0;
for (const file of files) {
  const json = JSON.parse(fs.readFileSync(file === '-' ? 0 : file));
  if (!check('taihu_tiles' in json ? json : json.recipe ?? json)) {
    bad = 1;
    for (const e of check.errors) console.log(`${file}: ${e.instancePath || '/'} ${e.message}`);
  } else {
    console.log(`${file}: as the schema says`);
  }
}
process.exit(bad);
