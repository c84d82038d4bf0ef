// node decode_glb.mjs FILE.glb...: decodes each Draco primitive with draco3dgltf, a build of the
// decoder that viewers use, and checks what the glTF validator does not look at: that accessors
// state what the decoded arrays hold, and that every level is a closed 2-manifold facing outwards.
import fs from 'node:fs';
import { load } from './modules.mjs';

const kComponents = { SCALAR: 1, VEC2: 2, VEC3: 3, VEC4: 4 };
const kByte = 5121, kFloat = 5126;

function check(condition, message) {
  if (!condition) throw new Error(message);
}

function parseGlb(bytes) {
  const view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
  check(bytes.length >= 28 && view.getUint32(0, true) === 0x46546c67, 'not a GLB');
  check(view.getUint32(4, true) === 2, 'not glTF 2');
  check(view.getUint32(8, true) === bytes.length, 'the header states another length');
  const jsonLength = view.getUint32(12, true);
  check(view.getUint32(16, true) === 0x4e4f534a, 'the first chunk is not JSON');
  const at = 20 + jsonLength;
  const json = JSON.parse(new TextDecoder('utf-8', { fatal: true }).decode(bytes.subarray(20, at)));
  check(view.getUint32(at + 4, true) === 0x004e4942, 'the second chunk is not BIN');
  const bin = bytes.subarray(at + 8, at + 8 + view.getUint32(at, true));
  check(at + 8 + bin.length === bytes.length, 'bytes behind the BIN chunk');
  return { json, bin };
}

function decodeAttribute(draco, decoder, mesh, id, accessor, label) {
  const attribute = decoder.GetAttributeByUniqueId(mesh, id);
  check(attribute.ptr !== 0, `${label}: no Draco attribute ${id}`);
  check(attribute.num_components() === kComponents[accessor.type], `${label}: another type`);
  const isColour = label.endsWith(' COLOR_0');
  check(isColour ? accessor.componentType === kByte && accessor.normalized
    : accessor.componentType === kFloat, `${label}: not ${isColour ? 'bytes' : 'float'}`);
  check(accessor.count === mesh.num_points(),
    `${label}: count ${accessor.count}, decoded ${mesh.num_points()}`);
  const out = new draco.DracoFloat32Array();
  decoder.GetAttributeFloatForAllPoints(mesh, attribute, out);
  const values = Float32Array.from({ length: out.size() }, (_, i) => out.GetValue(i));
  draco.destroy(out);
  check(values.every(Number.isFinite), `${label}: not finite`);
  return values;
}

function checkBounds(accessor, values, label) {
  for (let axis = 0; axis < 3; ++axis) {
    let lo = Infinity, hi = -Infinity;
    for (let i = axis; i < values.length; i += 3) {
      lo = Math.min(lo, values[i]);
      hi = Math.max(hi, values[i]);
    }
    check(Math.fround(accessor.min[axis]) === lo && Math.fround(accessor.max[axis]) === hi,
      `${label}: axis ${axis} is ${lo}..${hi}, not ${accessor.min[axis]}..${accessor.max[axis]}`);
  }
}

function decodePrimitive(draco, { json, bin }, primitive, label) {
  const extension = primitive.extensions?.KHR_draco_mesh_compression;
  check(extension, `${label}: not Draco`);
  check((primitive.mode ?? 4) === 4, `${label}: not triangles`);
  const view = json.bufferViews[extension.bufferView];
  const first = view.byteOffset ?? 0;
  const buffer = new draco.DecoderBuffer();
  buffer.Init(bin.subarray(first, first + view.byteLength), view.byteLength);
  const decoder = new draco.Decoder();
  check(decoder.GetEncodedGeometryType(buffer) === draco.TRIANGULAR_MESH, `${label}: no mesh`);
  const mesh = new draco.Mesh();
  const status = decoder.DecodeBufferToMesh(buffer, mesh);
  check(status.ok(), `${label}: ${status.error_msg()}`);

  const arrays = {};
  for (const [name, id] of Object.entries(extension.attributes)) {
    const accessor = json.accessors[primitive.attributes[name]];
    arrays[name] = decodeAttribute(draco, decoder, mesh, id, accessor, `${label} ${name}`);
  }
  check(arrays.POSITION, `${label}: no POSITION`);
  checkBounds(json.accessors[primitive.attributes.POSITION], arrays.POSITION, `${label} POSITION`);
  for (let i = 0; i < (arrays.NORMAL?.length ?? 0); i += 3)
    check(Math.abs(Math.hypot(...arrays.NORMAL.subarray(i, i + 3)) - 1) < 1e-3,
      `${label}: normal ${i / 3} is not a unit vector`);

  const indices = json.accessors[primitive.indices];
  check(indices.count === 3 * mesh.num_faces(),
    `${label}: ${indices.count} indices, decoded ${3 * mesh.num_faces()}`);
  const corners = new draco.DracoInt32Array();
  const faces = [];
  for (let i = 0; i < mesh.num_faces(); ++i) {
    decoder.GetFaceFromMesh(mesh, i, corners);
    faces.push([0, 1, 2].map((k) => corners.GetValue(k)));
    const inRange = faces[i].every((corner) => corner >= 0 && corner < mesh.num_points());
    check(inRange, `${label}: face ${i} out of range`);
  }
  for (const object of [corners, mesh, decoder, buffer]) draco.destroy(object);
  return { positions: arrays.POSITION, faces };
}

/** Vertices numbered by position, so that seams and doubled points do not hide. */
function weld({ positions, faces }) {
  const known = new Map();
  const points = [];
  const numbers = new Uint32Array(positions.length / 3);
  for (let i = 0; i < numbers.length; ++i) {
    const point = Array.from(positions.subarray(3 * i, 3 * i + 3), (v) => v + 0); // -0 is 0
    const key = point.join();
    if (!known.has(key)) {
      known.set(key, points.length);
      points.push(point);
    }
    numbers[i] = known.get(key);
  }
  return { points, faces: faces.map((face) => face.map((corner) => numbers[corner])) };
}

/** Every edge in two faces, run through once each way; one ring of faces at every vertex. */
function checkManifold({ points, faces }, label) {
  const next = points.map(() => new Map()); // around a vertex: from one neighbour to the next one
  faces.forEach(([a, b, c], i) => {
    check(a !== b && b !== c && c !== a, `${label}: face ${i} repeats a position`);
    for (const [u, v, w] of [[a, b, c], [b, c, a], [c, a, b]]) {
      check(!next[u].has(v), `${label}: edge ${u}-${v} is run through twice the same way`);
      next[u].set(v, w);
    }
  });
  next.forEach((ring, u) => {
    check(ring.size > 0, `${label}: vertex ${u} has no face`);
    const [start] = ring.keys();
    let n = 0;
    for (let v = start; n === 0 || v !== start; ++n) {
      v = ring.get(v);
      check(v !== undefined, `${label}: an edge at vertex ${u} has one face only`);
      check(n <= ring.size, `${label}: the faces at vertex ${u} form no ring`);
    }
    check(n === ring.size, `${label}: the faces at vertex ${u} form more than one ring`);
  });
}

function volume({ points, faces }) {
  const origin = points[0];
  let six = 0;
  for (const face of faces) {
    const [a, b, c] = face.map((i) => points[i].map((v, axis) => v - origin[axis]));
    six += a[0] * (b[1] * c[2] - b[2] * c[1]) + a[1] * (b[2] * c[0] - b[0] * c[2]) +
      a[2] * (b[0] * c[1] - b[1] * c[0]);
  }
  return six / 6;
}

function checkFile(draco, file) {
  const glb = parseGlb(new Uint8Array(fs.readFileSync(file)));
  check(glb.json.meshes?.length > 0, 'no mesh');
  glb.json.meshes.forEach((mesh, level) => {
    const label = `level ${level}`;
    const positions = [], faces = [];
    mesh.primitives.forEach((primitive, i) => {
      const part = decodePrimitive(draco, glb, primitive, `${label} primitive ${i}`);
      const first = positions.length / 3;
      for (const value of part.positions) positions.push(value);
      for (const face of part.faces) faces.push(face.map((corner) => corner + first));
    });
    const welded = weld({ positions: Float32Array.from(positions), faces });
    checkManifold(welded, label);
    const enclosed = volume(welded);
    check(enclosed > 0, `${label}: volume ${enclosed}, faces point inwards`);
    console.log(`${file}: ${label}: ${welded.points.length} vertices, ${faces.length} triangles, ` +
      `volume ${enclosed.toPrecision(9)} m^3`);
  });
}

const files = process.argv.slice(2);
if (files.length === 0) {
  console.error('usage: node decode_glb.mjs FILE.glb...');
  process.exit(2);
}
const draco = await load('draco3dgltf').createDecoderModule({});
let failed = false;
for (const file of files) {
  try {
    checkFile(draco, file);
  } catch (error) {
    console.error(`${file}: ${error.message}`);
    failed = true;
  }
}
process.exit(failed ? 1 : 0);
