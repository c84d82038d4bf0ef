#!/usr/bin/env python3
"""make_glb_corpus.py FOLDER: the GLBs of the regression corpus."""
import json
import struct
import sys
from pathlib import Path

BASE = {"asset": {"version": "2.0"}, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
        "buffers": [{"byteLength": 36}], "bufferViews": [{"buffer": 0, "byteLength": 36}]}


def accessor(**more):
    return [{"componentType": 5126, "type": "VEC3", "count": 3, "bufferView": 0, **more}]


def write(name, corners=bytes(36), **changes):
    text = json.dumps({**BASE, "accessors": accessor(), **changes}).encode()
    text += b" " * (-len(text) % 4)
    body = struct.pack("<II", len(text), 0x4E4F534A) + text
    body += struct.pack("<II", len(corners), 0x004E4942) + corners
    (Path(sys.argv[1]) / name).write_bytes(struct.pack("<III", 0x46546C67, 2, 12 + len(body)) + body)


write("outside-uri.glb", buffers=[{"byteLength": 36, "uri": "../../../../etc/passwd"}])
write("view-past-buffer.glb", bufferViews=[{"buffer": 0, "byteLength": 4294967295}])
write("accessor-wraps.glb", accessors=accessor(byteOffset=18446744073709551600))
write("count-huge.glb", accessors=accessor(count=4294967296))
write("node-loop.glb", nodes=[{"mesh": 0, "children": [0]}])
write("nan.glb", struct.pack("<9f", 0, 0, 0, 1, 0, 0, 0, float("nan"), 0))
