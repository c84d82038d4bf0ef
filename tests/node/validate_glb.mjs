// node validate_glb.mjs FILE.glb...: the official glTF validator; exit 0 only without errors,
// warnings and infos other than those that Draco data and lower levels always cause.
import fs from 'node:fs';
import path from 'node:path';
import { load } from './modules.mjs';

const kAllowed = new Set(['UNSUPPORTED_EXTENSION', 'UNUSED_OBJECT']);
const kSeverity = ['error', 'warning', 'info', 'hint'];

const files = process.argv.slice(2);
if (files.length === 0) {
  console.error('usage: node validate_glb.mjs FILE.glb...');
  process.exit(2);
}
const validator = load('gltf-validator');
let failed = false;
for (const file of files) {
  const bytes = new Uint8Array(fs.readFileSync(file));
  const options = { uri: path.basename(file), maxIssues: 0 };
  const { issues } = await validator.validateBytes(bytes, options);
  const wrong = issues.messages.filter((m) => m.severity < 2 || !kAllowed.has(m.code));
  for (const m of wrong)
    console.error(`${file}: ${kSeverity[m.severity]} ${m.code} ${m.pointer ?? ''}: ${m.message}`);
  const bad = wrong.length > 0 || issues.numErrors > 0 || issues.numWarnings > 0;
  failed ||= bad;
  console.log(`${file}: ${issues.numErrors} errors, ${issues.numWarnings} warnings, ` +
    `${issues.numInfos} infos${bad ? '' : ', valid'}`);
}
process.exit(failed ? 1 : 0);
