"""Group 3: STL, PLY, OFF and GLB files whose counts, lengths and types lie."""

import json
import struct

from tests.bad_input import good_files
from tests.bad_input.cases import read, refused
from tests.bad_input.mesh_texts import CORNERS, TRIANGLES, off, ply, ply_binary, stl, stl_text

NAN = struct.pack("<f", float("nan"))
HUGE = struct.pack("<I", 4_000_000_000)
STL, STL_TEXT = stl(), stl_text()
STLS = {
    "a count of 4e9 in 100 bytes": (bytes(80) + HUGE + bytes(16), "STL"),
    "fewer triangles counted than there are": (STL[:80] + b"\3\0\0\0" + STL[84:], "STL"),
    "more triangles counted than there are": (STL[:80] + b"\5\0\0\0" + STL[84:], "STL"),
    "a byte too many": (STL + b"\0", "STL"),
    "a byte too few": (STL[:-1], "STL"),
    "a coordinate that is nan": (STL[:96] + NAN + STL[100:], "finite|repair"),
    "no triangles": (bytes(84), "no triangles"),
    "binary that begins with solid, cut": (stl(head=b"solid")[:-7], "control character|export"),
    "text that begins otherwise": ("; by hand\n" + STL_TEXT, "by hand"),
    "text without its end": (STL_TEXT.replace("endsolid hand\n", ""), "endsolid"),
    "text cut in a triangle": (STL_TEXT[:200], "endsolid"),
    "text with a word for a number": (STL_TEXT.replace("0.1", "O.1", 1), "export"),
    "text with nan": (STL_TEXT.replace("0.1", "nan", 1), "finite"),
    "text with 1e999": (STL_TEXT.replace("0.1", "1e999", 1), "finite"),
    "text of a square": (
        STL_TEXT.replace("endloop", "vertex 1 1 1\nendloop", 1), "endsolid"),
    "text without triangles": ("solid a\nendsolid a\n", "no triangles"),
    "text that ends before it begins": ("solid\nendsolid\nendsolid\n", "solid"),
}  # fmt: skip
BODY = ply_binary()
PLYS = {
    "4e9 vertices in 100 bytes": (ply(vertices=4_000_000_000), "export"),
    "-1 vertices": (ply(vertices=-1), "count"),
    "binary where text is said": (ply(body=BODY), "control"),
    "the other byte order": (ply(form="binary_big_endian", body=BODY), "vertex 50331648|export"),
    "cut": (ply(form="binary_little_endian", body=BODY[:-3]), "export"),
    "bytes after the end": (ply(form="binary_little_endian", body=BODY + b"\0"), "export"),
    "a coordinate that its type cannot hold": (
        ply().replace(b"float x", b"uchar x"), "export"),
    "nan": (ply(form="binary_little_endian", body=NAN + BODY[4:]), "finite"),
    "text nan": (ply().replace(b"0.1", b"nan", 1), "finite"),
    "beyond single precision": (ply().replace(b"0.1", b"1e39", 1), "finite"),
    "a corner that is not there": (ply().replace(b"3 0 2 1", b"3 0 2 9"), "vertex 9"),
    "a corner of -1": (ply().replace(b"3 0 2 1", b"3 0 2 -1"), "vertex -1"),
    "half a corner": (ply().replace(b"3 0 2 1", b"3 0 2 .5"), "corner"),
    "a list longer than it says": (ply().replace(b"3 0 2 1", b"2 0 2 1"), "export"),
    "no header's end": (ply().replace(b"end_header", b"end"), "end_header"),
    "no format": (ply().replace(b"format ascii 1.0\n", b""), "format"),
    "a format from the future": (ply().replace(b"1.0", b"9.0"), "header"),
    "no z": (ply().replace(b"property float z\n", b""), "z"),
    "two x": (ply().replace(b"property float y", b"property float x"), "export"),
    "x as a list": (ply().replace(b"float x", b"list uchar float x"), "x"),
    "no list of corners": (ply().replace(b"list uchar int", b"int"), "list"),
    "two elements of faces": (
        ply().replace(b"element face 4\n", b"element face 4\nproperty int a\nelement face 4\n"),
        "once"),
    "a list counted in fractions": (ply().replace(b"uchar", b"float"), "whole number"),
    "strips instead of faces": (ply().replace(b"element face", b"element tristrips"), "face"),
    "no faces": (ply(faces=0, body=b"0 0 0\n" * 4), "no triangles"),
}  # fmt: skip
OFFS = {
    "4e9 vertices": (off("4000000000 4 6"), "export"),
    "-4 vertices": (off("-4 4 6"), "export"),
    "one count": (off("4"), "counts"),
    "counts in words": (off("four 4 6"), "export"),
    "a vertex too few counted": (off("3 4 6"), "export"),
    "no counts": ("OFF\n", "counts"),
    "binary OFF": (b"OFF BINARY\n" + bytes(40), "counts"),
    "a corner beyond": (off(faces=[(0, 2, 9), *TRIANGLES[1:]]), "vertex 9"),
    "a corner before": (off(faces=[(0, 2, -1), *TRIANGLES[1:]]), "vertex -1"),
    "a face of two": (off(faces=[(0, 2), *TRIANGLES[1:]]), "three corners"),
    "a face that lies": (off().replace("3 0 2 1", "9 0 2 1"), "says 9 corners lists 3"),
    "nan": (off().replace("0.1", "nan", 1), "finite"),
    "1e999": (off().replace("0.1", "1e999", 1), "finite"),
    "two coordinates": (off().replace("0.1 0.0 0.0", "0.1 0.0"), "three numbers"),
    "homogeneous points": (off().replace("OFF", "4OFF"), "OFF"),
}


def tree() -> dict:
    """A glTF of the tetrahedron, whose numbers lie in one buffer."""
    return {
        "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3",
             "min": [0, 0, 0], "max": [0.1, 0.1, 0.1]},
            {"bufferView": 1, "componentType": 5121, "count": 12, "type": "SCALAR"},
        ],
        "bufferViews": [{"buffer": 0, "byteOffset": 0, "byteLength": 48},
                        {"buffer": 0, "byteOffset": 48, "byteLength": 12}],
        "buffers": [{"byteLength": 60}],
    }  # fmt: skip


NUMBERS = b"".join(struct.pack("<3f", *each) for each in CORNERS) + bytes(sum(TRIANGLES, ()))


def glb(said: object, binary: bytes = NUMBERS) -> bytes:
    """A GLB file of a tree, or of bytes in its place."""
    text = said if isinstance(said, bytes) else json.dumps(said).encode()
    text += b" " * (-len(text) % 4)
    binary += bytes(-len(binary) % 4)
    chunks = struct.pack("<I4s", len(text), b"JSON") + text
    chunks += struct.pack("<I4s", len(binary), b"BIN\0") + binary
    return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks


def changed(path: str, value: object) -> bytes:
    """A GLB whose tree has another value at a path of keys and places."""
    return glb(good_files.changed(json.dumps(tree()), path, value).encode())


GOOD = glb(tree())
GLBS = {
    "version 1": (GOOD[:4] + b"\1" + GOOD[5:], "glTF 2"),
    "a length that lies": (GOOD[:8] + b"\xff" + GOOD[9:], "export"),
    "cut": (GOOD[:-9], "export"),
    "a head only": (GOOD[:12], "bytes"),
    "no JSON": (glb(b"not JSON"), "JSON"),
    "a list for a tree": (glb(b"[]"), "object"),
    "10^5 deep JSON": (glb(b"[" * 100_000), "JSON"),
    "an accessor of 2e9": (changed("accessors.0.count", 2_000_000_000), "export"),
    "an accessor out of its view": (changed("accessors.0.byteOffset", 40), "export"),
    "a view out of its buffer": (changed("bufferViews.0.byteOffset", 4000), "export"),
    "a view that is not there": (changed("accessors.0.bufferView", 7), "7 of a list of 2"),
    "a view of -1": (changed("accessors.0.bufferView", -1), "-1 of a list of 2"),
    "an accessor that is not there": (
        changed("meshes.0.primitives.0.indices", 99), "99 of a list of 2"),
    "a mesh that is not there": (changed("nodes.0.mesh", 5), "5 of a list of 1"),
    "a scene that is not there": (changed("scene", 5), "5 of a list of 1"),
    "a cycle of nodes": (changed("nodes.0.children", [0]), "tree"),
    "a node twice": (changed("scenes.0.nodes", [0, 0]), "tree"),
    "corners in floats": (changed("accessors.1.componentType", 5126), "export"),
    "points in shorts": (changed("accessors.0.componentType", 5122), "export"),
    "points in two dimensions": (changed("accessors.0.type", "VEC2"), "export"),
    "sparse numbers": (changed("accessors.0.sparse", {"count": 1}), "sparse"),
    "a corner beyond": (glb(tree(), NUMBERS[:-1] + b"\x63"), "vertex 99"),
    "nan": (glb(tree(), NAN + NUMBERS[4:]), "finite"),
    "a matrix of nan": (
        glb(json.dumps({**tree(), "nodes": [{"mesh": 0, "matrix": [float("nan")] * 16}]}).encode()),
        "export"),
    "a matrix of three": (changed("nodes.0.matrix", [1, 0, 0]), "export"),
    "a matrix that projects": (changed("nodes.0.matrix", [1] * 16), "export"),
    "a rotation of length 9": (changed("nodes.0.rotation", [9, 0, 0, 0]), "quaternion"),
    "a scale of 1e300": (changed("nodes.0.scale", [1e300] * 3), "SIZE|unit"),
    "a scale of 0": (changed("nodes.0.scale", [0, 0, 0]), "across"),
    "lines": (changed("meshes.0.primitives.0.mode", 1), "triangles"),
    "points": (changed("meshes.0.primitives.0.mode", 0), "triangles"),
    "fans": (changed("meshes.0.primitives.0.mode", 6), "triangles"),
    "11 corners": (changed("accessors.1.count", 11), "export"),
    "Draco": (
        changed("extensionsRequired", ["KHR_draco_mesh_compression"]), "compression"),
    "quantized numbers": (changed("extensionsUsed", ["KHR_mesh_quantization"]), "compression"),
    "a part's compression": (
        changed("meshes.0.primitives.0.extensions", {"KHR_draco_mesh_compression": {}}), "plain"),
    "a mesh that is a camera too": (changed("nodes.0.camera", 0), "a camera with meshes"),
    "a skin": (changed("nodes.0.skin", 0), "skin"),
    "morphs": (changed("meshes.0.primitives.0.targets", [{"POSITION": 0}]), "morph"),
    "numbers behind http": (changed("buffers.0.uri", "http://localhost/a.bin"), "outside"),
    "numbers in ../": (changed("buffers.0.uri", "../a.bin"), "outside the binary"),
    "numbers in /etc/passwd": (changed("buffers.0.uri", "/etc/passwd"), "outside the binary"),
    "numbers in base64": (
        changed("buffers.0.uri", "data:;base64," + "A" * 10_000_000), "outside the binary"),
    "two buffers": (changed("buffers", [{"byteLength": 60}] * 2), "outside the binary"),
    "no meshes": (glb({"asset": {"version": "2.0"}}), "no triangles"),
    "meshes of no scene": (changed("scenes.0.nodes", []), "no triangles"),
    "10^5 deep nodes": (
        glb({**tree(), "nodes": [*({"children": [i + 1]} for i in range(100_000)), {"mesh": 0}]}),
        "tree"),
}  # fmt: skip
GOODS = {
    "good.glb": GOOD,
    "normals.stl": STL[:84] + 3 * NAN + STL[96:],
    "solid.stl": stl(head=b"solid but binary"),
    "double.ply": ply(kind="double", form="binary_big_endian", body=ply_binary(">", "d")),
    "textures.glb": changed("images", [{"uri": "../../etc/passwd"}]),
    "materials.glb": changed("extensionsUsed", ["KHR_materials_unlit"]),
}
TABLES = {"stl": STLS, "ply": PLYS, "off": OFFS, "glb": GLBS}
CASES = [
    refused(f"{kind}: {name}", f"part.{kind}", *said)
    for kind, table in TABLES.items()
    for name, said in table.items()
]
CASES += [read(name, data) for name, data in GOODS.items()]
