// node bunny_obj.mjs OUT.obj: the Stanford bunny of the npm package `bunny` as an OBJ.
import fs from 'node:fs';
import { load } from './modules.mjs';

const [out] = process.argv.slice(2);
if (!out) {
  console.error('usage: node bunny_obj.mjs OUT.obj');
  process.exit(2);
}
const { positions, cells } = load('bunny');
const lines = positions.map((p) => `v ${p.join(' ')}`);
for (const cell of cells) lines.push(`f ${cell.map((corner) => corner + 1).join(' ')}`);
fs.writeFileSync(out, lines.join('\n') + '\n');
console.log(`${out}: ${positions.length} vertices, ${cells.length} triangles`);
