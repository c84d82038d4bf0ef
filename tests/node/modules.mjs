// Modules come from TAIHU_NODE_MODULES (a node_modules folder, or the folder that holds one) or
// from the node_modules beside this file: nothing need be installed into the source tree.
import fs from 'node:fs';
import path from 'node:path';
import { createRequire } from 'node:module';
import { fileURLToPath } from 'node:url';

const given = process.env.TAIHU_NODE_MODULES;
const folder = path.resolve(given ?? path.dirname(fileURLToPath(import.meta.url)));
const base = path.basename(folder) === 'node_modules' ? path.dirname(folder) : folder;

const require = createRequire(path.join(base, 'modules.cjs'));

function found(name, how) {
  try {
    return how(name);
  } catch (error) {
    if (error.code !== 'MODULE_NOT_FOUND') throw error;
    const missing = fs.existsSync(path.join(base, 'node_modules')) ? name : 'node_modules';
    console.error(`${base}: ${missing} is missing; run npm ci there, or set TAIHU_NODE_MODULES`);
    process.exit(2);
  }
}

/** Where the packages are, for a server that hands them to a browser. */
export function modulesFolder() {
  return path.join(base, 'node_modules');
}

/** The module `name`, or an exit that says how to get it. */
export const load = (name) => found(name, require);

/** The path of a file in a package, or the same exit. */
export const resolve = (name) => found(name, require.resolve);
