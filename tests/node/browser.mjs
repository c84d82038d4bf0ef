// Headless Chromium on a page of this process: three.js as a module, files under names.
import fs from 'node:fs';
import http from 'node:http';
import os from 'node:os';
import path from 'node:path';
import { load, modulesFolder } from './modules.mjs';

const kTypes = { '.js': 'text/javascript', '.wasm': 'application/wasm', '.glb': 'model/gltf-binary' };
const kFlags = ['--no-sandbox', '--disable-gpu', '--enable-unsafe-swiftshader', '--no-first-run',
  '--disable-dev-shm-usage'];

/** A page around a module script that has THREE and `loadGlb(url)`, and sets window.result. */
function page(script) {
  return `<!doctype html><meta charset="utf-8"><body style="margin:0">
<script type="importmap">{"imports":{"three":"/modules/three/build/three.module.js",
"three/addons/":"/modules/three/examples/jsm/"}}</script>
<script type="module">
import * as THREE from 'three';
import { GLTFLoader } from 'three/addons/loaders/GLTFLoader.js';
import { DRACOLoader } from 'three/addons/loaders/DRACOLoader.js';
const draco = new DRACOLoader().setDecoderPath('/modules/three/examples/jsm/libs/draco/gltf/');
const loadGlb = async (url) => (await new GLTFLoader().setDRACOLoader(draco).loadAsync(url)).scene;
try {
${script}
} catch (error) {
  window.result = { error: String(error) };
}
</script>`;
}

function serve(script, files) {
  const modules = modulesFolder();
  return http.createServer((request, answer) => {
    const url = new URL(request.url, 'http://localhost').pathname;
    if (url === '/') {
      answer.setHeader('content-type', 'text/html');
      answer.end(page(script));
      return;
    }
    const file = files[url]
      ?? (url.startsWith('/modules/') ? path.join(modules, url.slice('/modules/'.length)) : '');
    if (!file || !fs.existsSync(file)) {
      answer.statusCode = 404;
      answer.end();
      return;
    }
    answer.setHeader('content-type', kTypes[path.extname(file)] ?? 'application/octet-stream');
    fs.createReadStream(file).pipe(answer);
  });
}

/**
 * What the script left in window.result. `files` says which file a URL such as '/model.glb' is;
 * `picture`, where given, is where what the page shows is kept.
 */
export async function show(script, files, picture) {
  const { chromium } = load('playwright-core');
  const server = serve(script, files);
  await new Promise((done) => server.listen(0, '127.0.0.1', done));
  const profile = fs.mkdtempSync(path.join(os.tmpdir(), 'taihu-chromium-'));
  const browser = await chromium.launchPersistentContext(profile, {
    executablePath: process.env.TAIHU_CHROMIUM ?? '/usr/bin/chromium',
    headless: true,
    args: kFlags,
  });
  try {
    const tab = await browser.newPage();
    await tab.goto(`http://127.0.0.1:${server.address().port}/`);
    await tab.waitForFunction('window.result', null, { timeout: 120000 });
    if (picture) await tab.screenshot({ path: picture, fullPage: true });
    return await tab.evaluate('window.result');
  } finally {
    await browser.close();
    server.close();
    // Chromium's last processes may write for a moment still.
    fs.rmSync(profile, { recursive: true, force: true, maxRetries: 20, retryDelay: 100 });
  }
}
