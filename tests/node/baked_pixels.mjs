// node baked_pixels.mjs FINE.glb BAKED.glb [PICTURE.png]: the finest level of BAKED.glb, rendered by
// three.js in headless Chromium from four sides with its normal map and without, against the same
// renders of FINE.glb. Fails unless the map is worth 3 dB of PSNR over the pixels that show rock.
// The picture: a row for each side; fine, baked, without the map.
import { show } from './browser.mjs';

const kSize = 320, kSides = 4, kGain_dB = 3;

/** Occlusion is left out of all: it dims, and what is judged are normals. */
const kScript = `
  const fine = await loadGlb('/fine.glb'), baked = await loadGlb('/baked.glb');
  const materials = [];
  for (const scene of [fine, baked])
    scene.traverse((o) => {
      if (!o.isMesh) return;
      o.material.vertexColors = false;
      o.material.aoMap = null;
      if (scene === baked) materials.push({ material: o.material, map: o.material.normalMap,
        tangents: 'tangent' in o.geometry.attributes });
    });
  const box = new THREE.Box3().setFromObject(fine);
  const middle = box.getCenter(new THREE.Vector3()), half = box.getSize(new THREE.Vector3()).length() / 2;
  const camera = new THREE.OrthographicCamera(-half, half, half, -half, 0, 4 * half);
  const renderer = new THREE.WebGLRenderer({ preserveDrawingBuffer: true });
  renderer.setPixelRatio(1);
  renderer.setSize(${kSize}, ${kSize});
  const gl = renderer.getContext();
  const sheet = document.createElement('canvas');
  sheet.width = 3 * ${kSize};
  sheet.height = ${kSides} * ${kSize};
  document.body.append(sheet);
  const render = (scene, side, column) => {
    const angle = 2 * Math.PI * side / ${kSides};
    const eye = new THREE.Vector3(Math.sin(angle), 0.4, Math.cos(angle));
    camera.position.copy(middle).addScaledVector(eye.normalize(), 2 * half);
    camera.lookAt(middle);
    const world = new THREE.Scene();
    world.background = new THREE.Color(0x0000ff);
    const light = new THREE.DirectionalLight(0xffffff, 3);
    light.position.copy(eye).add(new THREE.Vector3(0.3, 1, 0)); // aims at the origin: parallel
    world.add(scene, light, new THREE.AmbientLight(0xffffff, 0.3));
    renderer.render(world, camera);
    sheet.getContext('2d').drawImage(renderer.domElement, column * ${kSize}, side * ${kSize});
    const pixels = new Uint8Array(4 * ${kSize} * ${kSize});
    gl.readPixels(0, 0, ${kSize}, ${kSize}, gl.RGBA, gl.UNSIGNED_BYTE, pixels);
    return pixels;
  };
  const setMaps = (on) => materials.forEach(({ material, map }) => {
    material.normalMap = on ? map : null;
    material.needsUpdate = true;
  });
  const isRock = (p, i) => !(p[i] === 0 && p[i + 1] === 0 && p[i + 2] === 255);
  const squares = [0, 0];
  let n = 0;
  for (let side = 0; side < ${kSides}; ++side) {
    const truth = render(fine, side, 0);
    setMaps(true);
    const pictures = [render(baked, side, 1)];
    setMaps(false);
    pictures.push(render(baked, side, 2));
    for (let i = 0; i < truth.length; i += 4) {
      if (!isRock(truth, i)) continue;
      ++n;
      pictures.forEach((p, k) => { squares[k] += (p[i + 1] - truth[i + 1]) ** 2; });
    }
  }
  window.result = { n, psnr: squares.map((s) => 10 * Math.log10(255 * 255 * n / s)),
    maps: materials.map(({ map, tangents }) => map !== null && tangents) };
`;

const [fine, baked, picture] = process.argv.slice(2);
if (!baked) {
  console.error('usage: node baked_pixels.mjs FINE.glb BAKED.glb [PICTURE.png]');
  process.exit(2);
}
try {
  const { error, n, psnr, maps } =
    await show(kScript, { '/fine.glb': fine, '/baked.glb': baked }, picture);
  if (error) throw new Error(error);
  if (maps.length !== 1 || !maps[0]) throw new Error('not one mesh with a normal map and tangents');
  if (n < 10000) throw new Error(`${n} pixels of rock only`);
  const gain = psnr[0] - psnr[1];
  console.log(`${baked}: ${psnr[0].toFixed(2)} dB with its map, ${psnr[1].toFixed(2)} dB without`);
  if (!(gain >= kGain_dB)) throw new Error(`the map is worth ${gain.toFixed(2)} dB, not ${kGain_dB}`);
} catch (error) {
  console.error(`${baked}: ${error.message}`);
  process.exit(1);
}
