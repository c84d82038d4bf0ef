"""blender -b --factory-startup --python check_glb.py -- FILE.glb

Imports a GLB of levels and judges the finest: the counts that the file states, closed, outward.
(Blender does not know MSFT_lod and shows the others too.)
"""
import json
import struct
import sys
import traceback

import bmesh
import bpy

try:
    import numpy
except ImportError:
    print("skipped: the importer needs numpy (python3-numpy)")
    sys.exit(77)

if not hasattr(numpy, "bool"):  # Debian's numpy has dropped the name that this importer uses
    numpy.bool = bool


def document(path):
    with open(path, "rb") as file:
        (length,) = struct.unpack("<12xI4x", file.read(20))
        return json.loads(file.read(length))


def stated(path):
    """Vertices and triangles of the finest level, from the accessors."""
    glb = document(path)
    primitive = glb["meshes"][0]["primitives"][0]
    count = lambda accessor: glb["accessors"][accessor]["count"]
    return count(primitive["attributes"]["POSITION"]), count(primitive["indices"]) // 3


def check(condition, message):
    if not condition:
        raise RuntimeError(message)


def judge(path):
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.import_scene.gltf(filepath=path)
    finest = document(path)["nodes"][0]["name"]
    data = bpy.data.objects[finest].data
    counts = (len(data.vertices), len(data.polygons))
    check(counts == stated(path), f"{counts} vertices and faces, the file says {stated(path)}")
    mesh = bmesh.new()
    mesh.from_mesh(data)
    open_edges = sum(not e.is_manifold for e in mesh.edges)
    check(open_edges == 0, f"{open_edges} edges are not between two faces")
    check(all(v.is_manifold for v in mesh.verts), "a vertex is not a manifold")
    volume = mesh.calc_volume(signed=True)
    check(volume > 0, f"the volume is {volume}")
    return f"{counts[0]} vertices, {counts[1]} triangles, closed, volume {volume:.6g} m^3"


file = sys.argv[sys.argv.index("--") + 1]
try:
    print(f"{file}: {judge(file)}")
except Exception:
    traceback.print_exc()
    sys.exit(1)
