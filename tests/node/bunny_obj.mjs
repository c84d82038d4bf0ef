// node bunny_obj.mjs OUT.obj [--open]: the Stanford bunny of the npm package `bunny` as an OBJ.
// The package closes the scan's bottom; --open leaves out the faces of its lowest twentieth again.
import fs from 'node:fs';
import { load } from './modules.mjs';

const [out, open] = process.argv.slice(2);
if (!out || (open && open !== '--open')) {
  console.error('usage: node bunny_obj.mjs OUT.obj [--open]');
  process.exit(2);
}
const { positions, cells } = load('bunny');
const lines = positions.map((p) => `v ${p.join(' ')}`);
const heights = positions.map((p) => p[1]);
const low = Math.min(...heights), floor = low + 0.05 * (Math.max(...heights) - low);
const faces = open ? cells.filter((cell) => cell.some((corner) => heights[corner] > floor)) : cells;
for (const cell of faces) lines.push(`f ${cell.map((corner) => corner + 1).join(' ')}`);
fs.writeFileSync(out, lines.join('\n') + '\n');
console.log(`${out}: ${positions.length} vertices, ${faces.length} triangles`);
