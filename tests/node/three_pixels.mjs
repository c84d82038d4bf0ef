// node three_pixels.mjs FILE.glb [PICTURE.png]: opens a Draco GLB with three.js in headless Chromium
// and judges the pixels: the finest level alone is shown, with the decoded number of triangles, in
// the middle, shaded, and with the outline that its own vertices have.
import fs from 'node:fs';
import { show } from './browser.mjs';

const kSize = 256;

/** Runs in the page. Parallel light from the eye, so that shading tells slopes apart. */
const kScript = `
  const scene = await loadGlb('/model.glb');
  const box = new THREE.Box3().setFromObject(scene);
  const middle = box.getCenter(new THREE.Vector3()), half = box.getSize(new THREE.Vector3()).length() / 2;
  const camera = new THREE.OrthographicCamera(-half, half, half, -half, 0, 4 * half);
  camera.position.copy(middle).add(new THREE.Vector3(0, 0, 2 * half));
  const world = new THREE.Scene();
  world.background = new THREE.Color(0x0000ff);
  const light = new THREE.DirectionalLight(0xffffff, 3);
  light.position.set(1, 2, 3);
  world.add(scene, light, new THREE.AmbientLight(0xffffff, 0.5));
  const renderer = new THREE.WebGLRenderer({ preserveDrawingBuffer: true });
  renderer.setPixelRatio(1);
  renderer.setSize(${kSize}, ${kSize});
  document.body.append(renderer.domElement);
  renderer.render(world, camera);
  const gl = renderer.getContext();
  const pixels = new Uint8Array(4 * ${kSize} * ${kSize});
  gl.readPixels(0, 0, ${kSize}, ${kSize}, gl.RGBA, gl.UNSIGNED_BYTE, pixels);
  const meshes = [], points = [];
  scene.traverse((o) => {
    if (!o.isMesh) return;
    meshes.push({ triangles: o.geometry.index.count / 3, attributes: Object.keys(o.geometry.attributes) });
    const p = o.geometry.attributes.position;
    for (let i = 0; i < p.count; ++i) points.push(p.getX(i) - middle.x, p.getY(i) - middle.y);
  });
  window.result = { meshes, half, points, pixels: Array.from(pixels) };
`;

function check(condition, message) {
  if (!condition) throw new Error(message);
}

/** Triangles of the first mesh as its accessor states them; decode_glb.mjs checks that. */
function finestTriangles(model) {
  const bytes = fs.readFileSync(model);
  const json = JSON.parse(bytes.subarray(20, 20 + bytes.readUInt32LE(12)).toString('utf8'));
  return json.accessors[json.meshes[0].primitives[0].indices].count / 3;
}

function judge({ error, meshes, half, points, pixels }, triangles) {
  check(!error, error);
  check(meshes.length === 1, `${meshes.length} meshes are shown; lower levels must not be`);
  check(meshes[0].triangles === triangles, `${meshes[0].triangles} triangles, the file says ${triangles}`);
  for (const name of ['position', 'normal'])
    check(meshes[0].attributes.includes(name), `no attribute ${name}`);
  const isRock = (x, y) => {
    const at = 4 * (y * kSize + x); // rows from the bottom, as the camera's y
    return !(pixels[at] === 0 && pixels[at + 1] === 0 && pixels[at + 2] === 255);
  };
  const toPixel = (v) => Math.min(kSize - 2, Math.max(1, Math.floor((v / half + 1) / 2 * kSize)));
  // A vertex on the outline may fall into the pixel beside it.
  const nearRock = (x, y) => [-1, 0, 1].some((i) => [-1, 0, 1].some((j) => isRock(x + i, y + j)));
  let missed = 0;
  for (let i = 0; i < points.length; i += 2)
    missed += !nearRock(toPixel(points[i]), toPixel(points[i + 1]));
  check(missed === 0, `${missed} of ${points.length / 2} vertices are not on rock`);
  const shades = new Set();
  let rock = 0, sum = 0;
  for (let y = 0; y < kSize; ++y)
    for (let x = 0; x < kSize; ++x)
      if (isRock(x, y)) {
        const grey = pixels[4 * (y * kSize + x) + 1];
        shades.add(grey);
        sum += grey;
        ++rock;
      }
  const share = rock / (kSize * kSize), mean = sum / rock;
  check(share > 0.05 && share < 0.8, `${(100 * share).toFixed(1)} % of the picture is rock`);
  check(shades.size > 32, `${shades.size} shades: normals are missing or all alike`);
  check(mean > 40 && mean < 230, `the rock's mean brightness is ${mean.toFixed(0)} of 255`);
  return `${triangles} triangles, ${(100 * share).toFixed(1)} % of the picture, ${shades.size} shades, ` +
    `mean ${mean.toFixed(0)}, attributes ${meshes[0].attributes.join(' ')}`;
}

const [model, picture] = process.argv.slice(2);
if (!model) {
  console.error('usage: node three_pixels.mjs FILE.glb [PICTURE.png]');
  process.exit(2);
}
try {
  console.log(`${model}: ${judge(await show(kScript, { '/model.glb': model }, picture), finestTriangles(model))}`);
} catch (error) {
  console.error(`${model}: ${error.message}`);
  process.exit(1);
}
